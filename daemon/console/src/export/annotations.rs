//! The classes of a map for programs that annotate images: COCO and TagLab.

use super::cells::MapCells;
use super::files::indexed_png;
use scenecast_protocol::map::{Cell, Rect};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The cells of each class, by the label that stands for it.
fn classes(cells: &MapCells) -> BTreeMap<u8, u32> {
    let mut classes = BTreeMap::new();
    for (label, count) in cells.counts() {
        *classes.entry(cells.book.shown_as(label)).or_default() += count;
    }
    classes
}

/// One annotation for each class, as runs of pixels of the map's PNG: a class may have holes, which polygons of COCO cannot have. The
/// error is one line for people.
///
/// Source: <https://cocodataset.org/#format-data>.
pub(super) fn coco(cells: &MapCells) -> Result<Vec<u8>, String> {
    // The file refers to the PNG, so it has the same limit.
    indexed_png(cells)?;
    let Rect { width, height, .. } = cells.rectangle();
    let classes = classes(cells);
    let categories = |&label: &u8| json!({ "id": label, "name": cells.book.title(label), "supercategory": "sea floor", "color": cells.book.colour(label) });
    let annotations = classes.iter().map(|(&class, &area)| {
        let (runs, bbox) = runs(cells, class);
        json!({
            "id": class, "image_id": 1, "category_id": class, "area": area, "bbox": bbox, "iscrowd": 1,
            "segmentation": { "counts": runs, "size": [height, width] },
        })
    });
    let caption = cells.caption.as_ref();
    let image = json!({
        "id": 1, "file_name": "map.png", "width": width, "height": height, "date_captured": caption.map(|caption| &caption.utc),
    });
    let file = json!({
        "info": { "description": caption.map(super::cells::MapCaption::title) },
        "images": [image],
        "categories": classes.keys().map(categories).collect::<Vec<Value>>(),
        "annotations": annotations.collect::<Vec<Value>>(),
    });
    Ok(file.to_string().into())
}

/// The lengths of runs of pixels outside of a class and in it, in turn, column by column from the top left; and the box around the class:
/// left, top, width and height.
fn runs(cells: &MapCells, class: u8) -> (Vec<u32>, [u32; 4]) {
    let Rect { x, y, width, height } = cells.rectangle();
    let (mut runs, mut run, mut is_inside) = (Vec::new(), 0, false);
    let (mut low, mut high) = ((width, height), (0, 0));
    for column in 0..width {
        for row in 0..height {
            let cell = Cell::new(x.wrapping_add_unsigned(column), y.wrapping_add_unsigned(height - 1 - row));
            let label = cells.label(cell);
            let is_class = label != 0 && cells.book.shown_as(label) == class;
            if is_class {
                low = (low.0.min(column), low.1.min(row));
                high = (high.0.max(column + 1), high.1.max(row + 1));
            }
            if is_class != is_inside {
                runs.push(std::mem::take(&mut run));
                is_inside = is_class;
            }
            run += 1;
        }
    }
    runs.push(run);
    (runs, [low.0, low.1, high.0.saturating_sub(low.0), high.1.saturating_sub(low.1)])
}

/// A dictionary of labels; TagLab reads the map's PNG as a label image by its colours.
pub(super) fn tag_lab(cells: &MapCells) -> String {
    let label = |&class: &u8| {
        let name = cells.book.title(class);
        json!({
            "id": name, "name": name, "description": null, "fill": cells.book.colour(class), "border": [200, 200, 200], "visible": true,
        })
    };
    let empty = json!({
        "id": "Empty", "name": "Empty", "description": null, "fill": [0, 0, 0], "border": [200, 200, 200], "visible": true,
    });
    let labels: Vec<Value> = [empty].into_iter().chain(classes(cells).keys().map(label)).collect();
    let description = cells.caption.as_ref().map_or("scenecast map".to_owned(), super::cells::MapCaption::title);
    json!({ "Name": "scenecast", "Description": description, "Labels": labels }).to_string()
}

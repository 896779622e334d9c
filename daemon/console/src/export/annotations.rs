//! The classes of a map for programs that annotate images: COCO and TagLab.

use super::{ExportError, check_picture};
use scenecast_protocol::map::{Cell, Rect, UNEXPLORED};
use scenecast_surface::{MapCaption, MapCells};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// One annotation for each class, as runs of pixels of the map's PNG: a class may have holes, which polygons of COCO cannot have. The
/// error is one line for people.
///
/// Source: <https://cocodataset.org/#format-data>.
pub(super) fn coco(cells: &MapCells) -> Result<Vec<u8>, ExportError> {
    // The file refers to the PNG, so it has the same limit.
    check_picture(cells)?;
    let Rect { width, height, .. } = cells.rectangle();
    let masks = masks(cells);
    let category = |&class: &u8| {
        json!({
            "id": class, "name": cells.book.title(class), "supercategory": "sea floor", "color": cells.book.colour(class),
        })
    };
    let annotation = |(&class, mask): (&u8, &ClassMask)| {
        json!({
            "id": class, "image_id": 1, "category_id": class, "area": mask.area, "bbox": mask.bbox(), "iscrowd": 1,
            "segmentation": { "counts": mask.runs, "size": [height, width] },
        })
    };
    let caption = cells.caption.as_ref();
    // The PNG of a map without cells has a pixel.
    let image = json!({
        "id": 1, "file_name": "map.png", "width": width.max(1), "height": height.max(1), "date_captured": caption.map(|caption| &caption.utc),
    });
    let file = json!({
        "info": { "description": caption.map(MapCaption::title) },
        "images": [image],
        "categories": masks.keys().map(category).collect::<Vec<Value>>(),
        "annotations": masks.iter().map(annotation).collect::<Vec<Value>>(),
    });
    Ok(file.to_string().into())
}

/// The pixels of a class.
#[derive(Default)]
struct ClassMask {
    /// The lengths of runs of pixels outside of the class and in it, in turn, column by column from the top left.
    runs: Vec<u32>,
    /// Where the last run ends.
    end: u32,
    area: u32,
    /// Columns and rows of the first and beyond the last.
    bounds: Option<[u32; 4]>,
}

impl ClassMask {
    fn add(&mut self, at: u32, height: u32) {
        match self.runs.last_mut() {
            Some(run) if self.end == at => *run += 1,
            _ => self.runs.extend([at - self.end, 1]),
        }
        (self.end, self.area) = (at + 1, self.area + 1);
        let (column, row) = (at / height, at % height);
        let [left, top, right, bottom] = self.bounds.unwrap_or([column, row, column, row]);
        self.bounds = Some([left.min(column), top.min(row), right.max(column + 1), bottom.max(row + 1)]);
    }

    /// The box around the class: left, top, width and height.
    fn bbox(&self) -> [u32; 4] {
        let [left, top, right, bottom] = self.bounds.unwrap_or_default();
        [left, top, right - left, bottom - top]
    }
}

/// The pixels of each class, by the label that stands for it.
fn masks(cells: &MapCells) -> BTreeMap<u8, ClassMask> {
    let Rect { x, y, width, height } = cells.rectangle();
    let mut masks: BTreeMap<u8, ClassMask> = BTreeMap::new();
    for at in 0..width * height {
        let (column, row) = (at / height, at % height);
        let label = cells.label(Cell::new(x.wrapping_add_unsigned(column), y.wrapping_add_unsigned(height - 1 - row)));
        if label != UNEXPLORED {
            masks.entry(cells.book.shown_as(label)).or_default().add(at, height);
        }
    }
    for mask in masks.values_mut() {
        let rest = width * height - mask.end;
        mask.runs.extend((rest > 0).then_some(rest));
    }
    masks
}

/// A dictionary of labels; TagLab reads the map's PNG as a label image by its colours.
pub(super) fn tag_lab(cells: &MapCells) -> String {
    let label = |&class: &u8| {
        let name = cells.book.title(class);
        json!({
            "id": name, "name": name, "description": null, "fill": cells.book.colour(class), "border": [200, 200, 200], "visible": true,
        })
    };
    let classes: BTreeSet<u8> = cells.counts().into_keys().map(|label| cells.book.shown_as(label)).collect();
    let empty = json!({
        "id": "Empty", "name": "Empty", "description": null, "fill": [0, 0, 0], "border": [200, 200, 200], "visible": true,
    });
    let labels: Vec<Value> = [empty].into_iter().chain(classes.iter().map(label)).collect();
    let description = cells.caption.as_ref().map_or("scenecast map".to_owned(), MapCaption::title);
    json!({ "Name": "scenecast", "Description": description, "Labels": labels }).to_string()
}

//! Annotated classes of places or pixels, and the agreement of a model's labels with them.

use super::LabelledMap;
use super::extent::around;
use super::words_file::{LineFault, Lines};
use image::{GrayImage, Luma};
use scene_model::topics::{FlatCell, coord_of};
use scenecast_core::UserError;
use scenecast_files::{finite_number, read_classes};
use scenecast_protocol::map::Rect;
use scenecast_worlds::scoring::{Annotations, LabelGrid, SceneScore, score};
use std::collections::BTreeMap;
use std::path::Path;

/// Mutual information of labels and classes, and of displaced labels and classes.
pub(crate) type Quality = SceneScore;

/// Maximum number of cells times classes in the table of counts.
const MAX_COUNTS: u64 = 1 << 27;
/// Class value of cells without annotation.
const NONE: u8 = 255;

/// Scores a map cell by cell. The class of a cell is that of most of its pixels or places; of
/// equally frequent ones the lowest.
///
/// `cell_px` is the edge of a cell in pixels of the mosaic, where the annotations are an image.
pub(crate) fn quality(map: &LabelledMap, annotated: &Annotated, cell_px: f32) -> Result<Quality, UserError> {
    match annotated {
        Annotated::Pixels { classes, ignore } => {
            let annotations =
                Annotations::new(classes, classes.dimensions(), cell_px, ignore).map_err(UserError::input)?;
            let (columns, rows) = annotations.size();
            Ok(score(&LabelGrid::from_map(&map.flat, 0, -1, columns, rows), &annotations))
        }
        Annotated::Places(places) => {
            let sheet = LayerSheet::new(&map.volume, places)?;
            let classes = sheet.classes(places, map.cell_m);
            let annotations =
                Annotations::new(&classes, classes.dimensions(), 1.0, &[NONE]).map_err(UserError::input)?;
            Ok(score(&sheet.labels(&map.volume), &annotations))
        }
    }
}

/// The heights of a map in three dimensions, laid side by side in one grid.
struct LayerSheet {
    bounds: Rect,
    layers: Vec<i32>,
}

impl LayerSheet {
    fn new(volume: &[FlatCell], places: &[([f64; 3], u8)]) -> Result<Self, UserError> {
        let bounds = around(volume)?;
        let mut layers: Vec<i32> = volume.iter().map(|cell| cell.z).collect();
        layers.sort_unstable();
        layers.dedup();
        let classes = places.iter().map(|place| u64::from(place.1) + 1).max().unwrap_or(1);
        let cells = u64::from(bounds.width) * u64::from(bounds.height) * layers.len() as u64;
        if cells * classes > MAX_COUNTS {
            let cause =
                format!("{cells} cells and {classes} classes are too many to score: choose a larger --cell-size");
            return Err(UserError::Input(cause));
        }
        Ok(Self { bounds, layers })
    }

    fn index(&self, [x, y, z]: [i32; 3]) -> Option<usize> {
        let Rect { width, height, .. } = self.bounds;
        let column = u32::try_from(x.checked_sub(self.bounds.x)?).ok().filter(|&column| column < width)?;
        let row = u32::try_from(y.checked_sub(self.bounds.y)?).ok().filter(|&row| row < height)?;
        let layer = self.layers.binary_search(&z).ok()?;
        Some((layer * height as usize + row as usize) * width as usize + column as usize)
    }

    fn labels(&self, volume: &[FlatCell]) -> LabelGrid {
        let mut grid = LabelGrid::empty(self.bounds.width as usize, self.bounds.height as usize * self.layers.len());
        for cell in volume {
            if let Some(index) = self.index([cell.x, cell.y, cell.z]) {
                grid.labels[index] = Some(cell.topic.0);
            }
        }
        grid
    }

    fn classes(&self, places: &[([f64; 3], u8)], cell_m: [f64; 3]) -> GrayImage {
        let mut votes: BTreeMap<usize, BTreeMap<u8, u32>> = BTreeMap::new();
        for (at, class) in places {
            if let Some(index) = coord_of(*at, cell_m).and_then(|coord| self.index(coord)) {
                *votes.entry(index).or_default().entry(*class).or_default() += 1;
            }
        }
        let width = self.bounds.width;
        let mut image = GrayImage::from_pixel(width, self.bounds.height * self.layers.len() as u32, Luma([NONE]));
        for (index, classes) in votes {
            let most = classes.iter().max_by_key(|(class, votes)| (**votes, std::cmp::Reverse(**class)));
            if let Some((class, _)) = most {
                image.put_pixel(index as u32 % width, index as u32 / width, Luma([*class]));
            }
        }
        image
    }
}

/// Class value for "not annotated".
const IGNORE: u8 = 255;
/// Maximum number of different classes of places.
const MAX_CLASSES: usize = 255;

/// Annotations in the form of their file.
pub(crate) enum Annotated {
    /// One class for each pixel of the mosaic.
    Pixels {
        classes: GrayImage,
        /// Classes that are left out of the score.
        ignore: Vec<u8>,
    },
    /// One class for each place: x, y, z in metres.
    Places(Vec<([f64; 3], u8)>),
}

impl Annotated {
    /// Reads an indexed or grey image of a mosaic's size.
    pub(crate) fn of_mosaic(path: &Path, size: (u32, u32), ignore: &[u8]) -> Result<Self, UserError> {
        let classes = read_classes(path, size)?;
        let ignore: Vec<u8> = ignore.iter().copied().chain([IGNORE]).collect();
        let Some(classes) = GrayImage::from_raw(size.0, size.1, classes) else {
            return Err(UserError::file(path, "cut off"));
        };
        if classes.as_raw().iter().all(|class| ignore.contains(class)) {
            return Err(UserError::file(path, "nothing is annotated"));
        }
        Ok(Self::Pixels { classes, ignore })
    }

    /// Reads lines `x,y,z,class` in metres, a class being a number or a name.
    pub(crate) fn of_places(path: &Path, ignore: &[u8]) -> Result<Self, UserError> {
        let mut lines = Lines::open(path)?;
        let (mut places, mut names) = (Vec::new(), BTreeMap::new());
        while let Some(line) = lines.next()? {
            if places.is_empty() && names.is_empty() && line.text.starts_with('x') {
                continue;
            }
            let place = parse(line.text).map(|(at, class)| (at, class.to_owned()));
            let (at, class) = place.map_err(|error| lines.error(error))?;
            let is_ignored = |number: u8| number == IGNORE || ignore.contains(&number);
            if class.parse().is_ok_and(is_ignored) {
                continue;
            }
            let next = names.len();
            let index = *names.entry(class).or_insert(next);
            if index >= MAX_CLASSES {
                return Err(lines.error(format!("more than {MAX_CLASSES} different classes")));
            }
            places.push((at, index as u8));
        }
        if places.is_empty() {
            return Err(UserError::file(path, "nothing is annotated; lines are x,y,z,class"));
        }
        Ok(Self::Places(places))
    }
}

fn parse(text: &str) -> Result<([f64; 3], &str), LineFault> {
    let mut fields = text.split(',');
    let at =
        [finite_number(fields.next(), "x")?, finite_number(fields.next(), "y")?, finite_number(fields.next(), "z")?];
    match (fields.next().map(str::trim), fields.next()) {
        (Some(class), None) if !class.is_empty() => Ok((at, class)),
        (Some(_), Some(_)) => Err(LineFault::Long),
        _ => Err(LineFault::NoClass),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene_model::project::Observation;
    use scene_model::topics::{SceneConfig, SceneModel};

    #[test]
    fn labels_equal_to_the_classes_have_full_information() {
        let config = SceneConfig { cell_m: [1.0; 3], vocabulary: 4, gamma: 0.01, ..SceneConfig::default() };
        let mut model = SceneModel::new(config).unwrap();
        let (mut seen, mut places) = (Vec::new(), Vec::new());
        for i in 0..400 {
            let (x, y, z) = (f64::from(i % 20) + 0.5, f64::from(i / 20) - 9.5, if i % 2 == 0 { 0.0 } else { 5.0 });
            let word = if i % 2 == 0 { 0 } else { 3 };
            seen.extend(vec![Observation { word, x, y, z }; 20]);
            places.push(([x, y, z], word as u8));
        }
        places.push(([500.0, 0.0, 0.0], 9));
        model.insert(0.0, &seen);
        model.sweep(30);
        let found =
            quality(&LabelledMap::of_topics(&model), &Annotated::Places(places), 1.0).unwrap().mutual_information;
        assert_eq!(found.n, 400);
        assert!((found.nats - 2f64.ln()).abs() < 0.01, "{found:?}");
    }

    fn read(name: &str, text: &str) -> Result<Vec<([f64; 3], u8)>, UserError> {
        let path = std::env::temp_dir().join(format!("scenecast-{}-classes-{name}.csv", std::process::id()));
        std::fs::write(&path, text).unwrap();
        match Annotated::of_places(&path, &[7])? {
            Annotated::Places(places) => Ok(places),
            Annotated::Pixels { .. } => unreachable!(),
        }
    }

    #[test]
    fn classes_are_numbers_or_names_and_ignored_ones_are_left_out() {
        let places = read("good", "x,y,z,class\n1,2,3,sand\n0,0,0,255\n0,0,0,7\n4,5,6,3\n1,1,1,sand\n").unwrap();
        assert_eq!(places, [([1.0, 2.0, 3.0], 0), ([4.0, 5.0, 6.0], 1), ([1.0, 1.0, 1.0], 0)]);
    }

    #[test]
    fn a_wrong_line_is_refused_with_its_number() {
        let refusal = |text: &str| read("bad", text).unwrap_err().to_string();
        assert!(refusal("1,2,3,1\n1,2,3\n").contains(":2: class is missing"));
        assert!(refusal("1,nan,3,1\n").contains(":1: y = nan"));
        assert!(refusal("0,0,0,255\n").contains("nothing is annotated"));
    }
}

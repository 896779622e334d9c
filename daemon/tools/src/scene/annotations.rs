//! Annotated classes of places or pixels.

use super::lines::{Lines, number};
use image::GrayImage;
use scenecast_core::UserError;
use scenecast_files::read_classes;
use std::collections::BTreeMap;
use std::path::Path;

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

fn parse(text: &str) -> Result<([f64; 3], &str), String> {
    let mut fields = text.split(',');
    let at = [number(fields.next(), "x")?, number(fields.next(), "y")?, number(fields.next(), "z")?];
    match (fields.next().map(str::trim), fields.next()) {
        (Some(class), None) if !class.is_empty() => Ok((at, class)),
        (Some(_), Some(_)) => Err("more than x,y,z,class".to_owned()),
        _ => Err("class is missing".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

//! Label maps in files.

use scenecast_core::UserError;
use scenecast_protocol::map_codec::LabelRaster;
use std::path::{Path, PathBuf};

/// Largest file of a map, bytes.
pub const MAX_MAP_BYTES: u64 = 1 << 30;

/// Reads a map from an indexed PNG.
pub fn read_map(path: &Path) -> Result<LabelRaster, UserError> {
    let bytes = scenecast_config::read_regular(path, MAX_MAP_BYTES)?;
    LabelRaster::from_png(&bytes).map_err(|e| UserError::file(path, e))
}

/// Refuses a map of another size than that of `base`.
pub fn same_size(base: (&Path, &LabelRaster), map: (&Path, &LabelRaster)) -> Result<(), UserError> {
    if (base.1.width, base.1.height) == (map.1.width, map.1.height) {
        return Ok(());
    }
    let base = format!("its base {} has {} x {}", base.0.display(), base.1.width, base.1.height);
    Err(UserError::file(map.0, format!("{} x {} cells; {base}; both must be the same", map.1.width, map.1.height)))
}

/// The PNG files of a folder, sorted by the last number in their names.
pub fn numbered(dir: &Path) -> Result<Vec<PathBuf>, UserError> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(|e| UserError::file(dir, e))? {
        let path = entry.map_err(|e| UserError::file(dir, e))?.path();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            files.push((number(&path)?, path));
        }
    }
    files.sort();
    if let Some(twice) = files.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(UserError::file(&twice[1].1, format!("number {} is there twice", twice[0].0)));
    }
    if files.is_empty() {
        return Err(UserError::file(dir, "no PNG file; numbered ones are needed, as in 1.png, 2.png"));
    }
    Ok(files.into_iter().map(|(_, path)| path).collect())
}

/// The last number in a file's name.
fn number(path: &Path) -> Result<u64, UserError> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let last = stem.rsplit(|c: char| !c.is_ascii_digit()).find(|digits| !digits.is_empty());
    let number = last.and_then(|digits| digits.parse().ok());
    number.ok_or_else(|| UserError::file(path, "its name has no number below 2^64 for its position in the series"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_number_of_a_name_is_its_position() {
        let of = |name: &str| number(Path::new(name)).ok();
        assert_eq!(of("dir9/step-007.png"), Some(7));
        assert_eq!(of("reef2_12b.png"), Some(12));
        assert_eq!((of("map.png"), of("99999999999999999999.png")), (None, None));
    }
}

//! Files that are written whole or not at all, and the small ones that are read whole: vocabularies, names and colours of
//! classes.

use scene_model::words::Measures;
use scenecast_core::UserError;
use scenecast_labels::{Content, Item, MAX_HEADER_BYTES};
use std::io::Write;
use std::path::Path;

/// Writes a file so that a reader sees the old or the new one, never half of one. A device or a pipe is written as it
/// is: a rename would put a file in place of `/dev/null` or `/dev/stdout`.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), UserError> {
    let failed = |e: std::io::Error| UserError::Failed(format!("{}: {e}", path.display()));
    if std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        return std::fs::OpenOptions::new()
            .write(true)
            .open(path)
            .and_then(|mut device| device.write_all(bytes))
            .map_err(failed);
    }
    let part = path.with_extension("part");
    let written = std::fs::File::create(&part)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .and_then(|()| std::fs::rename(&part, path));
    if let Err(e) = written {
        let _ = std::fs::remove_file(&part);
        return Err(failed(e));
    }
    sync_folder(path.parent().unwrap_or(Path::new(""))).map_err(failed)
}

/// Makes the names of a folder safe; the empty path is the working folder.
pub fn sync_folder(path: &Path) -> std::io::Result<()> {
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    std::fs::File::open(path)?.sync_all()
}

/// Most bytes of a vocabulary; one takes some kilobytes.
const MAX_BYTES: u64 = 1 << 20;

/// Reads a vocabulary that `scenecast vocabulary train` wrote.
pub fn read_vocabulary(path: &Path) -> Result<Measures, UserError> {
    let bytes = scenecast_config::read_regular(path, MAX_BYTES)?;
    let advice = "make one with scenecast vocabulary train";
    scene_model::vocabulary::load(&bytes).map_err(|e| UserError::file(path, format!("{e}; {advice}")))
}

/// The vocabulary of `scene.vocabulary`; `None` for the one that ships.
///
/// # Errors
/// As [`read_vocabulary`].
pub fn configured_vocabulary(file: Option<&Path>) -> Result<Option<Measures>, UserError> {
    file.map(read_vocabulary).transpose()
}

/// Reads a file with names of classes: an item of the kind `classes`, without names.
///
/// # Errors
/// The file cannot be read, or it is another item.
pub fn read_class_names(path: &Path) -> Result<Item, UserError> {
    let header = scenecast_config::read_regular(path, MAX_HEADER_BYTES as u64)?;
    let item = Item::read(header.trim_ascii(), &[]).map_err(|why| UserError::file(path, why))?;
    match item.content {
        Content::Classes => Ok(item),
        _ => Err(UserError::file(path, "it takes the kind \"classes\" alone")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_device_is_written_and_never_replaced() {
        use std::os::unix::fs::{FileTypeExt as _, symlink};
        let folder = std::env::temp_dir().join(format!("scenecast-write-whole-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let link = folder.join("sink");
        symlink("/dev/null", &link).unwrap();
        super::write_whole(&link, b"gone").unwrap();
        assert!(std::fs::metadata(&link).unwrap().file_type().is_char_device());
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "no other file is left");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_file_of_classes_is_read_or_refused_by_name() {
        let path = std::env::temp_dir().join(format!("scenecast-{}-classes.json", std::process::id()));
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            read_class_names(&path).map(|item| item.classes.len()).map_err(|e| e.to_string())
        };
        let named = r#"{"kind":"classes","classes":[{"class":0,"name":"sand"},{"class":1,"name":"rock"}]}"#;
        assert_eq!(read(&format!("{named}\n")), Ok(2));
        let wrong = read(r#"{"kind":"classes","classes":[{"class":0,"name":""}]}"#).unwrap_err();
        assert!(wrong.contains("-classes.json") && wrong.contains("class 0"), "{wrong}");
        assert!(read("[]").is_err());
        std::fs::remove_file(&path).unwrap();
    }
}

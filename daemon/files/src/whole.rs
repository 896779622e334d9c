//! Files that are written whole or not at all.

use scenecast_core::UserError;
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

#[cfg(test)]
mod tests {
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
}

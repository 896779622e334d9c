//! Files that are written whole or not at all.

use scenecast_core::UserError;
use std::io::Write;
use std::path::Path;

/// Writes a file so that a reader sees the old or the new one, never half of one.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), UserError> {
    let failed = |e: std::io::Error| UserError::Failed(format!("{}: {e}", path.display()));
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

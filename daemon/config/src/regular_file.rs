//! Reading of whole files.

use scenecast_core::UserError;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Maximum size of a configuration, a scenario or a table that is read, bytes.
pub(crate) const MAX_TEXT_BYTES: u64 = 16 << 20;

/// Opens a file of at most `max` bytes. A device or a pipe is refused: it may have no end, or no beginning.
///
/// # Errors
/// A file that cannot be opened, is not a regular file, or is too large.
pub fn open_regular(path: &Path, max: u64) -> Result<File, UserError> {
    let about = std::fs::metadata(path).map_err(|e| UserError::file(path, e))?;
    if about.is_dir() {
        return Err(UserError::file(path, "it is a folder: expected a file"));
    }
    if !about.is_file() {
        return Err(UserError::file(
            path,
            "it is not a regular file, but a device, a pipe or a socket: expected a file",
        ));
    }
    if about.len() > max {
        return Err(UserError::file(path, format!("it has {} bytes: at most {max} are read", about.len())));
    }
    File::open(path).map_err(|e| UserError::file(path, e))
}

/// The bytes of a file of at most `max` bytes, the first ones if the file grows meanwhile.
///
/// # Errors
/// As [`open_regular`].
pub fn read_regular(path: &Path, max: u64) -> Result<Vec<u8>, UserError> {
    let mut bytes = Vec::new();
    open_regular(path, max)?.take(max).read_to_end(&mut bytes).map_err(|e| UserError::file(path, e))?;
    Ok(bytes)
}

/// The text of a file of at most 16 MiB.
///
/// # Errors
/// As [`read_regular`], and a file that is not UTF-8.
pub fn read_regular_text(path: &Path) -> Result<String, UserError> {
    let bytes = read_regular(path, MAX_TEXT_BYTES)?;
    String::from_utf8(bytes).map_err(|e| {
        let line = 1 + e.as_bytes().iter().take(e.utf8_error().valid_up_to()).filter(|byte| **byte == b'\n').count();
        UserError::file(path, format!("line {line} is not text in UTF-8"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_folders_and_large_files_are_refused() {
        let error = |path: &Path, max| read_regular(path, max).unwrap_err().to_string();
        let dir = std::env::temp_dir().join(format!("scenecast-regular-file-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let file = dir.join("file");
        std::fs::write(&file, "12345\n67").unwrap();
        assert!(error(&dir, 9).contains("it is a folder"));
        assert!(error(&file, 3).contains("at most 3 are read"));
        assert_eq!(read_regular(&file, 8).unwrap().len(), 8);
        #[cfg(unix)]
        assert!(error(Path::new("/dev/zero"), 9).contains("not a regular file"));
        std::fs::write(&file, [b'1', b'\n', 0xFF]).unwrap();
        assert!(read_regular_text(&file).unwrap_err().to_string().contains("line 2 is not text in UTF-8"));
        std::fs::remove_dir_all(&dir).unwrap();
    }
}

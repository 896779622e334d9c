//! Symbolic links with stable names to devices whose names change.

use scenecast_core::UserError;
use std::path::{Path, PathBuf};

/// A folder of links. Links made by this process are removed at its end.
#[derive(Debug)]
pub struct Links {
    folder: Option<PathBuf>,
    made: Vec<PathBuf>,
}

impl Links {
    /// Creates the folder if it does not exist; with `None` there are no links.
    pub fn new(folder: Option<&Path>) -> Result<Self, UserError> {
        if let Some(folder) = folder {
            std::fs::create_dir_all(folder)
                .map_err(|e| UserError::Input(format!("--link-dir {}: {e}", folder.display())))?;
        }
        Ok(Self { folder: folder.map(Path::to_owned), made: Vec::new() })
    }

    /// Points the link `name` to a device and replaces an existing link atomically. A file that is no link is refused.
    #[cfg(unix)]
    pub fn point(&mut self, name: &str, device: &Path) -> Result<Option<PathBuf>, UserError> {
        let Some(folder) = &self.folder else { return Ok(None) };
        let link = folder.join(name);
        if std::fs::symlink_metadata(&link).is_ok_and(|found| !found.is_symlink()) {
            return Err(UserError::Input(format!("{}: there is a file that is no symbolic link", link.display())));
        }
        let fresh = folder.join(format!(".{name}.new"));
        let _ = std::fs::remove_file(&fresh);
        std::os::unix::fs::symlink(device, &fresh)
            .and_then(|()| std::fs::rename(&fresh, &link))
            .map_err(|e| UserError::Failed(format!("{}: {e}", link.display())))?;
        self.made.push(link.clone());
        Ok(Some(link))
    }

    /// Removes a link if this process made it.
    pub fn remove(&mut self, name: &str) {
        if let Some(index) = self.made.iter().position(|link| link.file_name().is_some_and(|n| n == name)) {
            remove_link(&self.made.swap_remove(index));
        }
    }
}

impl Drop for Links {
    fn drop(&mut self) {
        self.made.iter().for_each(|link| remove_link(link));
    }
}

/// A link that is already gone is no error.
fn remove_link(link: &Path) {
    if std::fs::symlink_metadata(link).is_ok_and(|found| found.is_symlink()) {
        let _ = std::fs::remove_file(link);
    }
}

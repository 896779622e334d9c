//! Symbolic links with stable names to devices whose names come and go.

use scenecast_core::UserError;
use std::path::{Path, PathBuf};

/// A folder of links; those made here are removed at the end.
#[derive(Debug)]
pub struct Links {
    folder: Option<PathBuf>,
    made: Vec<PathBuf>,
}

impl Links {
    /// Makes the folder if need be; without one there are no links.
    pub fn new(folder: Option<&Path>) -> Result<Self, UserError> {
        if let Some(folder) = folder {
            std::fs::create_dir_all(folder)
                .map_err(|e| UserError::Input(format!("--link-dir {}: {e}", folder.display())))?;
        }
        Ok(Self { folder: folder.map(Path::to_owned), made: Vec::new() })
    }

    /// Points the link `name` to a device, replacing a link that is there, at once. Anything else there is left alone and
    /// told.
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

    /// Removes a link that was made here.
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

/// Nobody needs to know of a link that is already gone.
fn remove_link(link: &Path) {
    if std::fs::symlink_metadata(link).is_ok_and(|found| found.is_symlink()) {
        let _ = std::fs::remove_file(link);
    }
}

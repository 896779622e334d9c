//! Unix sockets.

use super::feed::Feed;
use super::serve::{Connection, serve};
use scenecast_core::UserError;
use std::io;
use std::os::unix::fs::FileTypeExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::time::Duration;

impl Connection for UnixStream {
    fn set_timeouts(&self, idle: Duration) -> io::Result<()> {
        self.set_read_timeout(Some(idle))?;
        self.set_write_timeout(Some(idle))
    }
}

/// Listens at a path. A socket that an earlier run has left there is replaced; any other file is not.
pub(crate) fn local(path: &Path, key: &str) -> Result<Feed, UserError> {
    let failed = |e: io::Error| UserError::Failed(format!("{key}: {}: {e}", path.display()));
    let is_left = std::fs::symlink_metadata(path).is_ok_and(|found| found.file_type().is_socket());
    if is_left && UnixStream::connect(path).is_err() {
        std::fs::remove_file(path).map_err(failed)?;
    }
    let listener = UnixListener::bind(path).map_err(failed)?;
    tracing::info!("labels are taken at {}", path.display());
    let name = path.display().to_string();
    serve(move || listener.accept().map(|(stream, _)| (stream, name.clone())))
}

//! Files of a process belong to its user alone.

/// Makes new files and folders readable for the user of this process only.
pub fn keep_private() {
    #[cfg(unix)]
    {
        use nix::sys::stat::{Mode, umask};
        umask(Mode::S_IRWXG | Mode::S_IRWXO);
    }
}

//! Files and memory of a process of a mission belong to its user alone.

use scenecast_config::Config;

/// Makes new files and folders readable for the user of this process only, and its memory, where it holds a key or tokens, for nobody:
/// no core dump, no debugger of the same user.
pub(super) fn keep_private(config: &Config) {
    #[cfg(unix)]
    {
        use nix::sys::stat::{Mode, umask};
        umask(Mode::S_IRWXG | Mode::S_IRWXO);
    }
    #[cfg(target_os = "linux")]
    if (config.link.key_file.is_some() || config.console.token_file.is_some())
        && let Err(error) = nix::sys::prctl::set_dumpable(false)
    {
        tracing::warn!("the memory of this process cannot be kept out of core dumps: {error}");
    }
    #[cfg(not(target_os = "linux"))]
    let _ = config;
}

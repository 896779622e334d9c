//! The file of the mission key, or of the keys of a vehicle.

use super::Config;
use scenecast_core::UserError;
use scenecast_protocol::seal::{HeldKey, KeyFile};
use scenecast_protocol::wire::Address;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use zeroize::Zeroizing;

/// A bound for the file: a key with comments is shorter.
const MAX_BYTES: u64 = 64 * 1024;

/// The key of an end in `link.key_file`; `None` if it is empty, so that frames are not authenticated.
///
/// Logs a warning if other users of this machine may read the file.
///
/// # Errors
///
/// The file cannot be read, or has the keys of a vehicle other than this end.
pub fn load_key(config: &Config, end: Address) -> Result<Option<KeyFile>, UserError> {
    let Some(path) = &config.link.key_file else { return Ok(None) };
    let (key, warning) = read_key(path)?;
    if let Some(warning) = warning {
        tracing::warn!("{warning}");
    }
    if let HeldKey::Vehicle(key) = &key.key
        && key.address != end.number()
    {
        let (of, mission) = (key.address, key.mission);
        let line = match end {
            Address::SURFACE => {
                format!("this is the key of vehicle {of}; the surface needs the mission key, fingerprint {mission:08x}")
            }
            _ => format!(
                "this is the key of vehicle {of}, and this is vehicle {}; scenecast key derive writes its key",
                end.number()
            ),
        };
        return Err(UserError::file(path, line));
    }
    Ok(Some(key))
}

/// The keys in a file, and a warning if other users of this machine may read it.
pub fn read_key(path: &Path) -> Result<(KeyFile, Option<String>), UserError> {
    let problem = |e: std::io::Error| UserError::file(path, format!("{e}; scenecast key new writes a key file"));
    let file = File::open(path).map_err(problem)?;
    let warning = others_may_read(&file)
        .then(|| format!("{}: other users may read this key; chmod 600 FILE prevents that", path.display()));
    hide_memory();
    let mut text = Zeroizing::new(String::with_capacity(1024));
    file.take(MAX_BYTES).read_to_string(&mut text).map_err(problem)?;
    let key = KeyFile::parse(&text).map_err(|e| UserError::file(path, e))?;
    Ok((key, warning))
}

/// Keeps the memory of this process, which is to hold a key or tokens, out of core dumps and from debuggers of the same user.
pub(super) fn hide_memory() {
    #[cfg(target_os = "linux")]
    if let Err(error) = nix::sys::prctl::set_dumpable(false) {
        tracing::warn!("the memory of this process cannot be kept out of core dumps: {error}");
    }
}

#[cfg(unix)]
pub(super) fn others_may_read(file: &File) -> bool {
    use std::os::unix::fs::PermissionsExt;
    file.metadata().is_ok_and(|m| m.is_file() && m.permissions().mode() & 0o077 != 0)
}

#[cfg(not(unix))]
pub(super) fn others_may_read(_: &File) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::seal::{MissionKey, VehicleKey};

    fn file_of(name: &str, text: &str) -> (std::path::PathBuf, Config) {
        let path = std::env::temp_dir().join(format!("scenecast-key-file-{}-{name}", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let mut config = Config::default();
        config.link.key_file = Some(path.clone());
        (path, config)
    }

    #[test]
    fn without_a_file_there_is_no_key() {
        assert!(load_key(&Config::default(), Address::SURFACE).unwrap().is_none());
    }

    #[test]
    fn a_key_is_read_from_its_file() {
        let key = MissionKey::from_bytes([3; 16]);
        let (path, config) = file_of("good", &format!("# reef\n{}", *key.to_text()));
        let read = load_key(&config, Address::SURFACE).unwrap().unwrap();
        std::fs::remove_file(path).unwrap();
        assert_eq!(read.key.fingerprint(), key.fingerprint());
    }

    #[test]
    fn the_key_of_a_vehicle_serves_no_other_end() {
        let key = VehicleKey::derive(&MissionKey::from_bytes([3; 16]), 2);
        let (path, config) = file_of("vehicle", &key.to_text());
        let load = |number| load_key(&config, Address::vehicle(number).unwrap_or(Address::SURFACE));
        let [own, other, surface] = [2, 3, 0].map(load);
        std::fs::remove_file(path).unwrap();
        assert_eq!(own.unwrap().unwrap().key.fingerprint(), MissionKey::from_bytes([3; 16]).fingerprint());
        assert!(other.unwrap_err().to_string().contains("vehicle 2, and this is vehicle 3"));
        assert!(surface.unwrap_err().to_string().contains("needs the mission key"));
    }

    #[test]
    fn a_broken_file_is_named_with_the_line_and_what_is_allowed() {
        let (path, config) = file_of("broken", "# reef\nhello\n");
        let said = load_key(&config, Address::SURFACE).unwrap_err();
        std::fs::remove_file(&path).unwrap();
        assert_eq!(said.exit_code(), 2);
        let said = said.to_string();
        assert!(said.starts_with(&format!("{}: line 2: ", path.display())), "{said}");
        assert!(said.contains("scenecast-key 2 KEY CHECK"), "{said}");
        let missing = load_key(&config, Address::SURFACE).unwrap_err().to_string();
        assert!(missing.contains(&path.display().to_string()) && missing.contains("scenecast key new"), "{missing}");
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_others_may_read_is_noticed() {
        use std::os::unix::fs::PermissionsExt;
        let (path, _) = file_of("mode", &MissionKey::from_bytes([3; 16]).to_text());
        let noticed = [0o600, 0o400, 0o640, 0o604].map(|mode| {
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            read_key(&path).unwrap().1.is_some()
        });
        std::fs::remove_file(&path).unwrap();
        assert_eq!(noticed, [false, false, true, true]);
    }
}

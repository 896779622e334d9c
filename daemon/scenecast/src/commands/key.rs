//! `scenecast key`

use clap::{Args, Subcommand};
use scenecast_core::{Principal, Role, Takes, UserError, errln, outln};
use scenecast_protocol::seal::{HeldKey, KeyFile, MissionKey, VehicleKey};
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use zeroize::Zeroizing;

/// The key of the mission, those of its vehicles, and the token of the operator's page.
#[derive(Debug, Subcommand)]
pub(super) enum Key {
    /// Write a new random key of a mission to a new file.
    New(New),
    /// Write the key of one vehicle, derived from the key of the mission, to a new file.
    Derive(Derive),
    /// Add the next key to the file of the mission, or let it take the place of the present one.
    Rotate(Rotate),
    /// Print whose key a file has, and the fingerprint of the mission key.
    Show(Show),
    /// Write a new random token for the operator's page to a new file.
    Token(Token),
}

/// Write a new random key of a mission to a new file that only its owner may read.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast key new --out reef-3.key")]
pub(super) struct New {
    /// File to write; it must not exist
    #[arg(long, value_name = "FILE", default_value = "mission.key")]
    out: PathBuf,
}

/// Write the key of one vehicle to a new file that only its owner may read.
///
/// It opens the link of this vehicle alone: who takes the vehicle can imitate no other, nor the surface to another.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast key derive mission.key --vehicle 3 --out auv-3.key")]
pub(super) struct Derive {
    /// Key file of the mission
    #[arg(value_name = "FILE")]
    mission: PathBuf,
    /// Address of the vehicle
    #[arg(long, value_name = "ADDRESS", value_parser = clap::value_parser!(u8).range(1..=14))]
    vehicle: u8,
    /// File to write; it must not exist [default: auv-ADDRESS.key]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Add the next key of the mission to its file. The surface offers each vehicle its own under the present one.
///
/// Restart the surface then. Its log names each vehicle that uses the next key. When all do, --finish makes it the present one;
/// until then the surface accepts both. A vehicle that has not changed by then is out of reach until it has a new key file.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: scenecast key rotate mission.key\n         scenecast key rotate mission.key --finish --changed 1,2"
)]
pub(super) struct Rotate {
    /// Key file of the mission
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Remove the present key: the next one takes its place
    #[arg(long, requires = "changed")]
    finish: bool,
    /// Addresses of the vehicles that use the next key, by the surface's log: every one that is still to be reached
    #[arg(long, value_name = "ADDRESSES", value_delimiter = ',', requires = "finish",
          value_parser = clap::value_parser!(u8).range(1..=14))]
    changed: Vec<u8>,
}

/// Write a new random token to a new file that only its owner may read. Without a role its holders are administrators.
#[derive(Debug, Args)]
#[command(after_help = TOKEN_EXAMPLES)]
pub(super) struct Token {
    /// File to write; it must not exist
    #[arg(long, value_name = "FILE", default_value = "console.token")]
    out: PathBuf,
    /// Role of its holder: viewer (reads), operator (orders) or administrator (settings, too)
    #[arg(long, value_name = "ROLE", value_parser = role, requires = "name")]
    role: Option<Role>,
    /// Name of its holder, as the page shows it
    #[arg(long, value_name = "NAME", requires = "role")]
    name: Option<String>,
}

const TOKEN_EXAMPLES: &str = "\
Example: scenecast key token --out console.token
         scenecast key token --role operator --name anna --out anna.token

console.token_file may have a line of each person: cat anna.token bob.token > console.tokens";

fn role(text: &str) -> Result<Role, Takes> {
    Role::from_name(text).ok_or(Takes("expected viewer, operator or administrator"))
}

/// Print whose key a file has, and the fingerprint of the mission key, which is equal at all ends of a mission.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast key show mission.key")]
pub(super) struct Show {
    /// Key file of a mission or of a vehicle
    #[arg(value_name = "FILE")]
    file: PathBuf,
}

impl Key {
    pub(super) fn run(self) -> Result<(), UserError> {
        match self {
            Self::New(new) => {
                let key = random_key()?;
                write_new(&new.out, &key.to_text())?;
                outln!("{}: mission, fingerprint {:08x}", new.out.display(), key.fingerprint());
                outln!("Set link.key_file of the surface to its path. For each vehicle, write a key of its own:");
                outln!("scenecast key derive {} --vehicle 1", new.out.display());
            }
            Self::Token(token) => {
                let line = token_line(token.role.zip(token.name.as_deref()), &random_token()?)?;
                write_new(&token.out, &line)?;
                outln!("{}: a new token", token.out.display());
                match token.name {
                    None => outln!(
                        "Set console.token_file of the surface to its path, and give a copy to those who may give orders."
                    ),
                    Some(name) => outln!(
                        "Append its line to the file in console.token_file of the surface, and give the file to {name}."
                    ),
                }
            }
            Self::Derive(derive) => {
                let (mission, _) = mission_keys(&derive.mission)?;
                let key = VehicleKey::derive(&mission, derive.vehicle);
                let out = derive.out.unwrap_or_else(|| format!("auv-{}.key", derive.vehicle).into());
                write_new(&out, &key.to_text())?;
                outln!("{}: vehicle {}, fingerprint {:08x}", out.display(), key.address, key.mission);
                outln!("Copy the file to the vehicle, and set its link.key_file to the path.");
            }
            Self::Rotate(rotate) => rotate.run()?,
            Self::Show(show) => {
                let (KeyFile { key, next }, warning) = scenecast_config::read_key(&show.file)?;
                let of = match &key {
                    HeldKey::Mission(_) => "mission".to_owned(),
                    HeldKey::Vehicle(key) => format!("vehicle {}", key.address),
                };
                outln!("{}: {of}, fingerprint {:08x}", show.file.display(), key.fingerprint());
                if let Some(next) = next {
                    outln!("{}: next key of the mission, fingerprint {:08x}", show.file.display(), next.fingerprint());
                }
                if let Some(warning) = warning {
                    errln!("scenecast: {warning}");
                }
            }
        }
        Ok(())
    }
}

impl Rotate {
    fn run(self) -> Result<(), UserError> {
        let path = &self.file;
        let (present, next) = mission_keys(path)?;
        match (next, self.finish) {
            (None, false) => {
                let next = random_key()?;
                replace(path, &Zeroizing::new([present.to_text().as_str(), next.to_next_text().as_str()].concat()))?;
                outln!("{}: next key, fingerprint {:08x}", path.display(), next.fingerprint());
                outln!(
                    "Restart the surface: it gives each vehicle that it hears its own. When its log names every vehicle:"
                );
                outln!("scenecast key rotate {} --finish --changed 1,2", path.display());
            }
            (Some(next), true) => {
                replace(path, &next.to_text())?;
                outln!("{}: mission, fingerprint {:08x}", path.display(), next.fingerprint());
                outln!(
                    "Restart the surface. A vehicle that loses its state folder falls back to its key file: write each a new one in \
                     time:"
                );
                for vehicle in &self.changed {
                    outln!("scenecast key derive {} --vehicle {vehicle}", path.display());
                }
                outln!("Any other vehicle is out of reach until it has such a file.");
            }
            (Some(next), false) => {
                let fingerprint = next.fingerprint();
                let line = format!(
                    "it has a next key already, fingerprint {fingerprint:08x}; --finish --changed 1,2 lets it take the place of the present one"
                );
                return Err(UserError::file(path, line));
            }
            (None, true) => {
                return Err(UserError::file(
                    path,
                    "it has no next key; scenecast key rotate without --finish adds one",
                ));
            }
        }
        Ok(())
    }
}

/// The present key of a mission and the next one, if there is one.
fn mission_keys(path: &Path) -> Result<(MissionKey, Option<MissionKey>), UserError> {
    match scenecast_config::read_key(path)?.0 {
        KeyFile { key: HeldKey::Mission(key), next } => Ok((key, next)),
        _ => Err(UserError::file(path, "this is the key of a vehicle; name the key file of the mission")),
    }
}

/// Puts a new secret in the place of a file, whole or not at all.
fn replace(path: &Path, text: &str) -> Result<(), UserError> {
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    let new = PathBuf::from(name);
    write_new(&new, text)?;
    std::fs::rename(&new, path).map_err(|e| UserError::Failed(format!("{}: {e}", path.display())))
}

/// A key from the operating system's random source.
fn random_key() -> Result<MissionKey, UserError> {
    let mut bytes = Zeroizing::new([0; 16]);
    getrandom::fill(&mut *bytes).map_err(|e| UserError::Failed(format!("no random bytes from the system: {e}")))?;
    Ok(MissionKey::from_bytes(*bytes))
}

/// The text of a token file.
fn token_line(holder: Option<(Role, &str)>, token: &str) -> Result<Zeroizing<String>, UserError> {
    let Some((role, name)) = holder else { return Ok(Zeroizing::new(token.to_owned())) };
    let rule = "1 to 32 letters, digits, dots, hyphens or underscores";
    let principal = Principal::new(name, role);
    let principal = principal.ok_or_else(|| UserError::Input(format!("--name {name:?}: a name has {rule}")))?;
    Ok(Zeroizing::new(format!("{role} {} {token}", principal.name())))
}

/// A token of 128 bits from the operating system's random source.
fn random_token() -> Result<Zeroizing<String>, UserError> {
    let mut bytes = Zeroizing::new([0; 16]);
    getrandom::fill(&mut *bytes).map_err(|e| UserError::Failed(format!("no random bytes from the system: {e}")))?;
    Ok(Zeroizing::new(format!("{:032x}\n", u128::from_be_bytes(*bytes))))
}

/// Writes a secret to a file that does not exist yet, readable by its owner alone; an interrupted write leaves no file.
fn write_new(path: &Path, text: &str) -> Result<(), UserError> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(path).map_err(|e| match e.kind() {
        ErrorKind::AlreadyExists => {
            UserError::file(path, "it exists and is not overwritten; name another file with --out, or remove it")
        }
        _ => UserError::file(path, e),
    })?;
    file.write_all(text.as_bytes()).and_then(|()| file.sync_all()).map_err(|e| {
        let _ = std::fs::remove_file(path);
        UserError::Failed(format!("{}: {e}", path.display()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fresh(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("scenecast-key-{}-{name}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        path
    }

    #[test]
    fn a_new_key_is_readable_by_its_owner_only() {
        let (path, key) = (fresh("new"), random_key().unwrap());
        write_new(&path, &key.to_text()).unwrap();
        let (read, warning) = scenecast_config::read_key(&path).unwrap();
        assert_eq!((read.key.fingerprint(), warning), (key.fingerprint(), None));
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        }
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn a_next_key_is_added_once_and_replaces_the_present_one() {
        let (path, key) = (fresh("rotate"), random_key().unwrap());
        write_new(&path, &key.to_text()).unwrap();
        let rotate = |finish: bool| Rotate { file: path.clone(), finish, changed: vec![1] }.run();
        let prints = || {
            let (present, next) = mission_keys(&path).unwrap();
            (present.fingerprint(), next.map(|next| next.fingerprint()))
        };
        assert!(rotate(true).unwrap_err().to_string().contains("no next key"));
        rotate(false).unwrap();
        let (present, next) = prints();
        assert_eq!(present, key.fingerprint());
        assert!(rotate(false).unwrap_err().to_string().contains(&format!("{:08x}", next.unwrap())));
        rotate(true).unwrap();
        assert_eq!(prints(), (next.unwrap(), None));
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        }
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn a_file_that_exists_is_kept() {
        let path = fresh("kept");
        std::fs::write(&path, "precious").unwrap();
        let refused = write_new(&path, &random_key().unwrap().to_text()).unwrap_err();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "precious");
        std::fs::remove_file(&path).unwrap();
        assert_eq!(refused.exit_code(), 2);
        assert!(refused.to_string().contains("not overwritten"), "{refused}");
    }

    #[test]
    fn a_token_with_a_role_is_a_line_for_the_surface() {
        let path = fresh("role");
        let line = token_line(Some((Role::Operator, "anna")), &random_token().unwrap()).unwrap();
        write_new(&path, &line).unwrap();
        let grants = scenecast_config::read_tokens(&path).unwrap();
        std::fs::remove_file(path).unwrap();
        assert_eq!(Some(&grants[0].principal), Principal::new("anna", Role::Operator).as_ref());
        assert_eq!(token_line(Some((Role::Viewer, "a b")), "x").unwrap_err().exit_code(), 2);
    }

    #[test]
    fn two_keys_differ() {
        assert_ne!(*random_key().unwrap().to_text(), *random_key().unwrap().to_text());
    }
}

//! Files of secrets: the mission key or the keys of a vehicle, and the tokens that the operator's page and scripts present.

use super::Config;
use scenecast_core::{Principal, Role, UserError};
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

/// A bound for the file: 64 tokens with their names and comments are shorter.
const MAX_TOKEN_FILE_BYTES: u64 = 32 * 1024;
/// Allowed lengths of a token, bytes.
const LENGTH: std::ops::RangeInclusive<usize> = 16..=256;
/// Tokens in a file at most.
const MAX_TOKENS: usize = 64;
const LINE_RULE: &str = "a line is ROLE NAME TOKEN, the role being viewer, operator or administrator";
const TOKEN_RULE: &str =
    "a token has 16 to 256 printable ASCII characters without blanks; scenecast key token writes one";

/// A token and the principal that it identifies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TokenGrant {
    pub principal: Principal,
    pub token: Zeroizing<String>,
}

/// The tokens of `console.token_file`; none if it is empty.
///
/// Logs a warning if other users of this machine may read the file.
pub fn load_tokens(config: &Config) -> Result<Vec<TokenGrant>, UserError> {
    let Some(path) = &config.console.token_file else { return Ok(Vec::new()) };
    if File::open(path).is_ok_and(|f| others_may_read(&f)) {
        tracing::warn!("{}: other users may read the tokens; chmod 600 FILE prevents that", path.display());
    }
    read_tokens(path).map_err(|e| UserError::Input(format!("console.token_file = {e}")))
}

/// The tokens in a file: lines `ROLE NAME TOKEN`, or a single token, which makes its holders administrators. Lines that
/// are empty or begin with `#` are ignored.
pub fn read_tokens(path: &Path) -> Result<Vec<TokenGrant>, UserError> {
    let problem = |e: std::io::Error| UserError::file(path, format!("{e}; scenecast key token writes a token file"));
    hide_memory();
    let mut text = Zeroizing::new(String::with_capacity(MAX_TOKEN_FILE_BYTES as usize + 1));
    File::open(path).map_err(problem)?.take(MAX_TOKEN_FILE_BYTES + 1).read_to_string(&mut text).map_err(problem)?;
    if text.len() as u64 > MAX_TOKEN_FILE_BYTES {
        return Err(UserError::file(path, format!("more than {MAX_TOKEN_FILE_BYTES} bytes: {LINE_RULE}")));
    }
    parse(&text).map_err(|line| UserError::file(path, line))
}

/// The only token in a file, for a client.
pub fn read_token(path: &Path) -> Result<Zeroizing<String>, UserError> {
    match &mut read_tokens(path)?[..] {
        [one] => Ok(std::mem::take(&mut one.token)),
        all => Err(UserError::file(path, format!("it has {} tokens; a client needs a file with its own", all.len()))),
    }
}

/// What is wrong in a file of tokens. No error repeats a token, since logs keep it.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
enum TokenFault {
    #[error("line {line}: {fault}")]
    Line { line: usize, fault: GrantFault },
    #[error("line {line}: the name {name} stands in an earlier line")]
    NameTwice { line: usize, name: String },
    #[error("line {line}: it has the token of {name}; each needs its own")]
    TokenTwice { line: usize, name: String },
    #[error("line {line}: more than {MAX_TOKENS} tokens")]
    Many { line: usize },
    #[error("no token; {LINE_RULE}; {TOKEN_RULE}")]
    None,
}

/// What is wrong in a line of a file of tokens.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
enum GrantFault {
    #[error("{LINE_RULE}; a file with a single token has one word; {TOKEN_RULE}")]
    Words,
    #[error("{0:?} is not a role: {LINE_RULE}; {TOKEN_RULE}")]
    Role(String),
    #[error("{0:?}: a name has 1 to 32 letters, digits, dots, hyphens or underscores")]
    Name(String),
    #[error("no token; {TOKEN_RULE}")]
    Token,
}

fn parse(text: &str) -> Result<Vec<TokenGrant>, TokenFault> {
    let lines = text.lines().map(str::trim).enumerate().filter(|(_, l)| !l.is_empty() && !l.starts_with('#'));
    let mut grants: Vec<TokenGrant> = Vec::new();
    let mut is_single = false;
    for (line, text) in lines.map(|(i, text)| (i + 1, text)) {
        let grant = match text.split_whitespace().collect::<Vec<_>>()[..] {
            [role, name, token] if !is_single => grant(role, name, token),
            [token] if grants.is_empty() => {
                is_single = true;
                check_token(token).map(|token| TokenGrant { principal: Principal::sole_administrator(), token })
            }
            _ => Err(GrantFault::Words),
        };
        let grant = grant.map_err(|fault| TokenFault::Line { line, fault })?;
        let name_where = |is_same: &dyn Fn(&TokenGrant) -> bool| {
            grants.iter().find(|other| is_same(other)).map(|other| other.principal.name().to_owned())
        };
        if let Some(name) = name_where(&|other| other.principal.name() == grant.principal.name()) {
            return Err(TokenFault::NameTwice { line, name });
        }
        if let Some(name) = name_where(&|other| other.token == grant.token) {
            return Err(TokenFault::TokenTwice { line, name });
        }
        grants.push(grant);
        if grants.len() > MAX_TOKENS {
            return Err(TokenFault::Many { line });
        }
    }
    if grants.is_empty() { Err(TokenFault::None) } else { Ok(grants) }
}

fn grant(role: &str, name: &str, token: &str) -> Result<TokenGrant, GrantFault> {
    let role = Role::from_name(role).ok_or_else(|| GrantFault::Role(role.to_owned()))?;
    let principal = Principal::new(name, role).ok_or_else(|| GrantFault::Name(name.to_owned()))?;
    Ok(TokenGrant { principal, token: check_token(token)? })
}

fn check_token(token: &str) -> Result<Zeroizing<String>, GrantFault> {
    let is_sound = LENGTH.contains(&token.len()) && token.bytes().all(|b| b.is_ascii_graphic());
    is_sound.then(|| Zeroizing::new(token.to_owned())).ok_or(GrantFault::Token)
}

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
    read_text(path, MAX_TEXT_BYTES)
}

/// Why a text that begins with these bytes cannot be read as UTF-8, with the command that converts it, if it is UTF-16.
pub fn utf16_fault(text: &[u8]) -> Option<String> {
    // The first signs of a text are those of its format, which have one byte in ASCII.
    let encoding = match text {
        [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] => "UTF-16",
        [a, 0, b, 0, ..] if *a != 0 && *b != 0 => "UTF-16LE",
        [0, a, 0, b, ..] if *a != 0 && *b != 0 => "UTF-16BE",
        _ => return None,
    };
    Some(format!("it is UTF-16 and not UTF-8: iconv -f {encoding} -t UTF-8 OLD > NEW converts it"))
}

/// The text of a file of at most `max` bytes.
///
/// # Errors
/// As [`read_regular`], and a file that is not UTF-8.
pub fn read_text(path: &Path, max: u64) -> Result<String, UserError> {
    let bytes = read_regular(path, max)?;
    if let Some(fault) = utf16_fault(&bytes) {
        return Err(UserError::file(path, fault));
    }
    String::from_utf8(bytes).map_err(|e| {
        let line = 1 + e.as_bytes().iter().take(e.utf8_error().valid_up_to()).filter(|byte| **byte == b'\n').count();
        UserError::file(path, format!("line {line} is not text in UTF-8"))
    })
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

    const ANNA: &str = "operator anna 0123456789abcdef";

    fn read<T>(name: &str, text: &str, read: fn(&Path) -> Result<T, UserError>) -> Result<T, String> {
        let path = std::env::temp_dir().join(format!("scenecast-token-{}-{name}", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let found = read(&path);
        std::fs::remove_file(&path).unwrap();
        found.map_err(|e| e.to_string())
    }

    #[test]
    fn a_single_token_is_that_of_an_administrator() {
        let text = "# reef\n\n 0123456789abcdef \n";
        assert_eq!(*read("good", text, read_token).unwrap(), "0123456789abcdef");
        let grants = parse(text).unwrap();
        assert_eq!((grants.len(), grants[0].principal.role()), (1, Role::Administrator));
    }

    #[test]
    fn each_line_names_a_role_and_a_person() {
        let text = format!("# the watch\n{ANNA}\n\nviewer  bob\tfedcba9876543210\n");
        let grants = parse(&text).unwrap();
        let roles: Vec<_> = grants.iter().map(|g| (g.principal.name(), g.principal.role(), &**g.token)).collect();
        assert_eq!(roles, [("anna", Role::Operator, "0123456789abcdef"), ("bob", Role::Viewer, "fedcba9876543210")]);
        assert_eq!(*read("own", ANNA, read_token).unwrap(), "0123456789abcdef");
        assert!(read("all", &text, read_token).unwrap_err().contains("it has 2 tokens"));
    }

    #[test]
    fn wrong_lines_are_refused_with_their_number() {
        for (text, expected) in [
            (format!("{ANNA}\n0123456789abcdee\n"), "line 2: a line is ROLE NAME TOKEN"),
            (format!("0123456789abcdee\n{ANNA}\n"), "line 2: a line is ROLE NAME TOKEN"),
            ("0123456789abcdef\nnext\n".to_owned(), "line 2: a line is ROLE NAME TOKEN"),
            (format!("{ANNA}\nowner bob fedcba9876543210\n"), "line 2: \"owner\" is not a role"),
            (format!("{ANNA}\nviewer anna fedcba9876543210\n"), "line 2: the name anna"),
            (format!("{ANNA}\nviewer bob 0123456789abcdef\n"), "line 2: it has the token of anna"),
            ("viewer <b> 0123456789abcdef".to_owned(), "line 1: \"<b>\": a name has"),
        ] {
            let line = parse(&text).unwrap_err().to_string();
            assert!(line.starts_with(expected) && !line.contains("fedcba"), "{line}");
        }
        let many: String = (0..65).map(|i| format!("viewer v{i} {i:016}\n")).collect();
        assert!(parse(&many).unwrap_err().to_string().contains("more than 64 tokens"));
    }

    #[test]
    fn tokens_that_are_guessable_or_cannot_be_sent_are_refused() {
        for (name, text) in [
            ("empty", ""),
            ("short", "hunter2\n"),
            ("blanks", "correct horse battery staple\n"),
            ("short-of-anna", "operator anna hunter2\n"),
        ] {
            let line = read(name, text, read_token).unwrap_err();
            assert!(line.contains("16 to 256") && line.contains("scenecast key token"), "{line}");
            assert!(!line.contains("hunter2"), "{line}");
        }
    }

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
        for (bytes, encoding) in [
            (&b"\xFF\xFE[\0l\0"[..], "UTF-16"),
            (b"[\0l\0", "UTF-16LE"),
            (b"\xFE\xFF\0[", "UTF-16"),
            (b"\0[\0l", "UTF-16BE"),
        ] {
            std::fs::write(&file, bytes).unwrap();
            let error = read_regular_text(&file).unwrap_err().to_string();
            assert!(error.contains(&format!("it is UTF-16 and not UTF-8: iconv -f {encoding} -t UTF-8")), "{error}");
        }
        std::fs::remove_dir_all(&dir).unwrap();
    }
}

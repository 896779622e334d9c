//! The file of the tokens that the operator's page and scripts present.

use super::Config;
use super::key_file::{hide_memory, others_may_read};
use scenecast_core::{Principal, Role, UserError};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use zeroize::Zeroizing;

/// A bound for the file: 64 tokens with their names and comments are shorter.
const MAX_BYTES: u64 = 32 * 1024;
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
    let mut text = Zeroizing::new(String::with_capacity(MAX_BYTES as usize + 1));
    File::open(path).map_err(problem)?.take(MAX_BYTES + 1).read_to_string(&mut text).map_err(problem)?;
    if text.len() as u64 > MAX_BYTES {
        return Err(UserError::file(path, format!("more than {MAX_BYTES} bytes: {LINE_RULE}")));
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

fn parse(text: &str) -> Result<Vec<TokenGrant>, String> {
    let lines = text.lines().map(str::trim).enumerate().filter(|(_, l)| !l.is_empty() && !l.starts_with('#'));
    let mut grants: Vec<TokenGrant> = Vec::new();
    let mut is_single = false;
    for (number, line) in lines.map(|(i, line)| (i + 1, line)) {
        let grant = match line.split_whitespace().collect::<Vec<_>>()[..] {
            [role, name, token] if !is_single => grant(role, name, token),
            [token] if grants.is_empty() => {
                is_single = true;
                check_token(token).map(|token| TokenGrant { principal: Principal::sole_administrator(), token })
            }
            _ => Err(format!("{LINE_RULE}; a file with a single token has one word; {TOKEN_RULE}")),
        };
        let grant = grant.map_err(|e| format!("line {number}: {e}"))?;
        if let Some(other) = grants.iter().find(|g| g.principal.name() == grant.principal.name()) {
            return Err(format!("line {number}: the name {} stands in an earlier line", other.principal.name()));
        }
        if let Some(other) = grants.iter().find(|g| g.token == grant.token) {
            return Err(format!("line {number}: it has the token of {}; each needs its own", other.principal.name()));
        }
        grants.push(grant);
        if grants.len() > MAX_TOKENS {
            return Err(format!("line {number}: more than {MAX_TOKENS} tokens"));
        }
    }
    if grants.is_empty() { Err(format!("no token; {LINE_RULE}; {TOKEN_RULE}")) } else { Ok(grants) }
}

fn grant(role: &str, name: &str, token: &str) -> Result<TokenGrant, String> {
    let role = Role::from_name(role).ok_or_else(|| format!("{role:?} is not a role: {LINE_RULE}; {TOKEN_RULE}"))?;
    let principal = Principal::new(name, role);
    let rule = "a name has 1 to 32 letters, digits, dots, hyphens or underscores";
    let principal = principal.ok_or_else(|| format!("{name:?}: {rule}"))?;
    Ok(TokenGrant { principal, token: check_token(token)? })
}

/// The error does not repeat the token, since logs keep it.
fn check_token(token: &str) -> Result<Zeroizing<String>, String> {
    let is_sound = LENGTH.contains(&token.len()) && token.bytes().all(|b| b.is_ascii_graphic());
    is_sound.then(|| Zeroizing::new(token.to_owned())).ok_or_else(|| format!("no token; {TOKEN_RULE}"))
}

#[cfg(test)]
mod tests {
    use super::*;

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
            let line = parse(&text).unwrap_err();
            assert!(line.starts_with(expected) && !line.contains("fedcba"), "{line}");
        }
        let many: String = (0..65).map(|i| format!("viewer v{i} {i:016}\n")).collect();
        assert!(parse(&many).unwrap_err().contains("more than 64 tokens"));
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
}

//! The file of the token that the operator's page and scripts present.

use super::Config;
use super::key_file::others_may_read;
use scenecast_core::UserError;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use zeroize::Zeroizing;

/// A bound for the file: a token with comments is shorter.
const MAX_BYTES: u64 = 4096;
/// Allowed lengths of a token, bytes.
const LENGTH: std::ops::RangeInclusive<usize> = 16..=256;

/// The token of `console.token_file`; `None` if it is empty.
///
/// Logs a warning if other users of this machine may read the file.
pub fn load_token(config: &Config) -> Result<Option<Zeroizing<String>>, UserError> {
    let Some(path) = &config.console.token_file else { return Ok(None) };
    if File::open(path).is_ok_and(|f| others_may_read(&f)) {
        tracing::warn!("{}: other users may read this token; chmod 600 FILE prevents that", path.display());
    }
    let named = |p: UserError| UserError::Input(format!("console.token_file = {p}"));
    read_token(path).map(Some).map_err(named)
}

/// The token in a file: its first line that is not empty and does not begin with `#`.
pub fn read_token(path: &Path) -> Result<Zeroizing<String>, UserError> {
    let problem = |e: std::io::Error| UserError::file(path, format!("{e}; scenecast key token writes a token file"));
    let mut text = Zeroizing::new(String::with_capacity(MAX_BYTES as usize));
    File::open(path).map_err(problem)?.take(MAX_BYTES).read_to_string(&mut text).map_err(problem)?;
    let mut lines = text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with('#'));
    let token = lines.next().unwrap_or_default();
    if !LENGTH.contains(&token.len()) || !token.bytes().all(|b| b.is_ascii_graphic()) {
        let rule = "one line of 16 to 256 printable ASCII characters without blanks";
        return Err(UserError::file(path, format!("no token; allowed: {rule}; scenecast key token writes one")));
    }
    Ok(Zeroizing::new(token.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, text: &str) -> Result<String, String> {
        let path = std::env::temp_dir().join(format!("scenecast-token-{}-{name}", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let read = read_token(&path);
        std::fs::remove_file(&path).unwrap();
        read.map(|t| t.to_string()).map_err(|e| e.to_string())
    }

    #[test]
    fn a_token_is_the_first_line_that_is_no_comment() {
        assert_eq!(read("good", "# reef\n\n 0123456789abcdef \nnext\n").unwrap(), "0123456789abcdef");
    }

    #[test]
    fn what_could_be_guessed_or_not_be_sent_is_refused() {
        for (name, text) in [("empty", ""), ("short", "hunter2\n"), ("blanks", "correct horse battery staple\n")] {
            let said = read(name, text).unwrap_err();
            assert!(said.contains("16 to 256") && said.contains("scenecast key token"), "{said}");
        }
    }
}

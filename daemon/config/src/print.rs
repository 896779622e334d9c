//! Writing of a configuration file with every key explained.

use super::KEYS;
use super::load::default_of;

/// A file with the defaults of every key that a role reads: `a` the vehicle, `s` the surface, `r` the rehearsal.
pub fn print(role: char) -> String {
    let mut out = String::new();
    let mut section = "";
    for key in KEYS.iter().filter(|k| k.roles.contains(role)) {
        let (s, name) = key.name.split_once('.').unwrap_or_default();
        if s != section {
            section = s;
            out.push_str(&format!("\n[{s}]\n"));
        }
        let default = default_of(key);
        out.push_str(&format!("# {}\n# takes {}\n{name} = {default}\n", key.doc, key.takes(&default)));
    }
    out.trim_start().to_owned()
}

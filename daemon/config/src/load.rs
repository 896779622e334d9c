//! Reading of configuration files and `--set` options.

use crate::check::check_together;
use crate::sections::key::Section;
use crate::{Config, Key};
use scenecast_core::UserError;
use std::path::Path;
use toml::de::{DeTable, DeValue};
use toml::{Spanned, Table, Value};

/// A value that somebody gave, and where.
struct Given {
    key: String,
    value: Value,
    /// The text of a value of the command line: a word such as 7E1 reads as a number.
    word: Option<String>,
    place: String,
}

/// The defaults, changed by a file and then by `key=value` options.
///
/// # Errors
/// One line that names the place, the key and the allowed values.
pub fn load(file: Option<&Path>, sets: &[String]) -> Result<Config, UserError> {
    let mut given = Vec::new();
    if let Some(path) = file {
        let text = crate::read_regular_text(path)?;
        read_file(path, &text, &mut given)?;
    }
    for set in sets {
        given.push(read_set(set)?);
    }
    let mut config = Config::default();
    for value in &given {
        apply(&mut config, value)?;
    }
    check_together(&config)?;
    Ok(config)
}

fn read_file(path: &Path, text: &str, given: &mut Vec<Given>) -> Result<(), UserError> {
    let place = |at: usize| format!("{}:{}", path.display(), line_of(text, at));
    let table = DeTable::parse(text)
        .map_err(|e| UserError::Input(format!("{}: {}", place(e.span().map_or(0, |s| s.start)), e.message())))?;
    for (section, value) in table.get_ref() {
        let is_known = Section::ALL.iter().any(|s| s.name == section.get_ref());
        let keys = match value.get_ref() {
            DeValue::Table(keys) if is_known => keys,
            _ => return Err(unknown(section.get_ref(), &place(section.span().start))),
        };
        for (name, value) in keys {
            let key = format!("{}.{}", section.get_ref(), name.get_ref());
            let mut push = |key: String, at: usize, value| {
                let place = place(at);
                let value = plain(value).ok_or_else(|| UserError::Input(format!("{place}: {key} cannot be read")))?;
                given.push(Given { key, value, word: None, place });
                Ok(())
            };
            match value.get_ref() {
                DeValue::Table(members) if Key::find(&key).is_some_and(Key::is_table) => {
                    for (member, value) in members {
                        push(format!("{key}.{}", member.get_ref()), member.span().start, value)?;
                    }
                }
                _ => push(key, name.span().start, value)?,
            }
        }
    }
    Ok(())
}

/// The number of the line in which byte `at` is.
fn line_of(text: &str, at: usize) -> usize {
    text.get(..at).map_or(1, |before| before.matches('\n').count() + 1)
}

/// A value without its place in the file; no key takes a date.
fn plain(value: &Spanned<DeValue<'_>>) -> Option<Value> {
    Some(match value.get_ref() {
        DeValue::String(s) => Value::String(s.to_string()),
        DeValue::Integer(i) => Value::Integer(i64::from_str_radix(i.as_str(), i.radix()).ok()?),
        DeValue::Float(f) => Value::Float(f.as_str().parse().ok()?),
        DeValue::Boolean(b) => Value::Boolean(*b),
        DeValue::Array(a) => Value::Array(a.iter().map(plain).collect::<Option<_>>()?),
        DeValue::Table(t) => {
            let members = t.iter().map(|(name, value)| Some((name.get_ref().to_string(), plain(value)?)));
            Value::Table(members.collect::<Option<_>>()?)
        }
        DeValue::Datetime(_) => return None,
    })
}

fn read_set(set: &str) -> Result<Given, UserError> {
    let (key, text) = set
        .split_once('=')
        .ok_or_else(|| UserError::Input(format!("--set {set}: expected KEY=VALUE, as in link.budget_bps=2000")))?;
    let parsed = format!("v = {text}").parse::<Table>().ok().and_then(|mut t| t.remove("v"));
    let value = parsed.unwrap_or_else(|| Value::String(text.to_owned()));
    Ok(Given { key: key.trim().to_owned(), value, word: Some(text.to_owned()), place: format!("--set {set}") })
}

fn apply(config: &mut Config, given: &Given) -> Result<(), UserError> {
    let Given { key: name, value, word, place } = given;
    let Some((key, member)) = find(name) else { return Err(unknown(name, place)) };
    let members = (key.operations.members)();
    if let (None, false, Value::Table(table)) = (member, members.is_empty(), value) {
        return table.iter().try_for_each(|(member, value)| {
            let (key, value) = (format!("{name}.{member}"), value.clone());
            let member = Given { key, value, word: None, place: place.clone() };
            apply(config, &member)
        });
    }
    if let Some(member) = member.filter(|member| !members.contains(member)) {
        let takes = format!("{} has {}", key.name, members.join(", "));
        return Err(UserError::Input(format!("{place}: {} has no member {member}; {takes}", key.name)));
    }
    let mut set = |value: &Value| (key.operations.set)(config, member, value, &key.rule);
    let as_word = |word: &String| Value::String(word.clone());
    set(value).or_else(|| set(&as_word(word.as_ref()?))).ok_or_else(|| refused(key, given))
}

fn refused(key: &Key, given: &Given) -> UserError {
    let Given { key: name, value, place, .. } = given;
    UserError::Input(format!("{place}: {name} = {value} is not allowed; allowed: {}", key.allowed()))
}

/// The key of a name, and the member of its table, if the name ends in one.
fn find(name: &str) -> Option<(&'static Key, Option<&str>)> {
    if let Some(key) = Key::find(name) {
        return Some((key, None));
    }
    let (key, member) = name.rsplit_once('.')?;
    Key::find(key).filter(|key| key.is_table()).map(|key| (key, Some(member)))
}

fn unknown(name: &str, place: &str) -> UserError {
    let names: Vec<&str> = if name.contains('.') {
        Key::all().map(|key| key.name).collect()
    } else {
        Section::ALL.iter().map(|section| section.name).collect()
    };
    let nearest = names.into_iter().min_by_key(|known| strsim::damerau_levenshtein(known, name));
    let nearest = nearest.map(|known| format!("; the nearest is {known}")).unwrap_or_default();
    UserError::Input(format!("{place}: there is no key {name}{nearest} (scenecast config lists all keys)"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LayerName;

    fn message(sets: &[&str]) -> String {
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
        load(None, &sets).unwrap_err().to_string()
    }

    fn loaded(sets: &[&str]) -> Config {
        load(None, &sets.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn every_default_is_allowed_and_is_read_as_it_was_written() {
        for key in Key::all() {
            let mut config = Config::default();
            let default = key.value(&config);
            assert_eq!((key.operations.set)(&mut config, None, &default, &key.rule), Some(()), "{}", key.name);
            assert_eq!(key.value(&config), default, "{}", key.name);
        }
        assert_eq!(loaded(&[]), Config::default());
    }

    #[test]
    fn a_misspelt_key_is_answered_with_the_nearest_one() {
        let said = message(&["link.bugdet_bps=2000"]);
        assert!(said.contains("no key link.bugdet_bps") && said.contains("nearest is link.budget_bps"), "{said}");
        assert!(message(&["lnik=2"]).contains("nearest is link "));
    }

    #[test]
    fn a_value_out_of_range_is_answered_with_the_range() {
        let said = message(&["link.frame_bytes=9"]);
        assert_eq!(
            said,
            "--set link.frame_bytes=9: link.frame_bytes = 9 is not allowed; allowed: a whole number from 32 to 1024 bytes"
        );
    }

    #[test]
    fn a_file_is_read_with_its_line_in_every_complaint() {
        let mut given = Vec::new();
        read_file(Path::new("x.toml"), "[link]\nbudget_bps = 5\n", &mut given).unwrap();
        let said = apply(&mut Config::default(), &given[0]).unwrap_err().to_string();
        assert!(said.starts_with("x.toml:2: link.budget_bps = 5"), "{said}");
        let broken = read_file(Path::new("x.toml"), "[link]\n\nbudget_bps = = 5\n", &mut given).unwrap_err();
        assert!(broken.to_string().starts_with("x.toml:3: "), "{broken}");
    }

    #[test]
    fn a_member_of_a_table_is_refused_with_its_own_line() {
        let mut given = Vec::new();
        read_file(Path::new("x.toml"), "[link.shares]\nmap = 60\nfix = 101\n", &mut given).unwrap();
        let mut config = Config::default();
        apply(&mut config, &given[0]).unwrap();
        assert_eq!(config.link.shares.0, [10, 5, 5, 60, 20]);
        let said = apply(&mut config, &given[1]).unwrap_err().to_string();
        assert!(said.starts_with("x.toml:3: link.shares.fix = 101"), "{said}");
    }

    #[test]
    fn sealing_without_a_key_is_refused() {
        let said = message(&["link.encrypt=true"]);
        assert!(said.contains("link.encrypt") && said.contains("link.key_file"), "{said}");
        loaded(&["link.authenticate=all"]);
        loaded(&["link.encrypt=true", "link.authenticate=all", "link.key_file=k"]);
    }

    #[test]
    fn shares_add_up_to_a_hundred_at_most_and_vehicles_differ() {
        let said = message(&["link.shares={ map = 60, exemplar = 30 }"]);
        assert!(said.contains("directive = 10, status = 5, fix = 5, map = 60, exemplar = 30"), "{said}");
        assert!(said.contains("link.shares") && said.contains("110 %"), "{said}");
        let said = message(&["link.shares.map=101"]);
        assert!(said.contains("link.shares.map = 101") && said.contains("a whole number from 0 to 100 %"), "{said}");
        let said = message(&["link.shares={ sonar = 5 }"]);
        assert!(said.ends_with("link.shares has directive, status, fix, map, exemplar"), "{said}");
        let said = message(&["link.vehicles=[2, 2]"]);
        assert!(said.ends_with("a list of different whole numbers from 1 to 14"), "{said}");
        assert_eq!(loaded(&["link.vehicles=[1, 3]"]).link.vehicles, [1, 3]);
    }

    #[test]
    fn members_that_are_not_given_keep_their_values() {
        let config = loaded(&["link.shares={ map = 40 }", "link.shares.fix=15"]);
        assert_eq!(config.link.shares.0, [10, 5, 15, 40, 20]);
    }

    #[test]
    fn a_list_in_place_of_shares_is_refused_with_the_members() {
        let said = message(&["link.shares=[10, 5, 5, 60, 20]"]);
        assert!(said.ends_with("for each of directive, status, fix, map, exemplar"), "{said}");
    }

    #[test]
    fn layers_are_named_once_and_leave_a_share_to_labels() {
        let said = message(&["map.layers=[\"colour\"]"]);
        let names: Vec<&str> = LayerName::all().map(LayerName::as_str).collect();
        assert!(said.ends_with(&format!("a list of different words of {}", names.join(", "))), "{said}");
        assert!(message(&["map.layers=[\"depth\", \"depth\"]"]).contains("different words"));
        assert!(message(&["map.layers=depth"]).contains("a list"));
        let said = message(&["map.layer_shares={ confidence = 60, curiosity = 50 }"]);
        assert!(said.contains("map.layer_shares") && said.contains("110 %"), "{said}");
        let config = loaded(&["map.layers=[]", "map.layer_shares.depth=10"]);
        let depth = LayerName::new("depth").unwrap();
        assert_eq!((config.map.layers.len(), config.map.layer_shares.get(&depth)), (0, Some(&10)));
    }

    #[test]
    fn a_frame_with_a_tag_has_room_for_a_report() {
        let said = message(&["link.key_file=k", "link.frame_bytes=40"]);
        assert!(said.starts_with("link.frame_bytes = 40") && said.contains("48 to 1024"), "{said}");
        assert!(said.contains("or link.authenticate = \"down\""), "{said}");
        let said = message(&["link.authenticate=down", "link.key_file=k", "link.frame_bytes=32"]);
        assert!(said.contains("a hello") && said.contains("41 to 1024"), "{said}");
        loaded(&["link.authenticate=down", "link.key_file=k", "link.frame_bytes=41"]);
        loaded(&["link.frame_bytes=40"]);
    }

    #[test]
    fn whole_numbers_do_for_fractions_and_bare_words_for_text() {
        let config = loaded(&["channel.range_m=1000", "map.codec=png"]);
        assert_eq!((config.channel.range_m, config.map.codec.to_string().as_str()), (1000.0, "png"));
    }
}

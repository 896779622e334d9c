//! Reading of configuration files and `--set` options.

use super::{Allowed, Config, KEYS, Key};
use scenecast_core::UserError;
use std::path::Path;
use toml::de::{DeTable, DeValue};
use toml::{Spanned, Table, Value};

/// A value that somebody gave, and where.
struct Given {
    key: String,
    value: Value,
    place: String,
}

/// The defaults, changed by a file and then by `key=value` options.
///
/// Every problem is one line that names the place, the key and what is allowed.
pub fn load(file: Option<&Path>, sets: &[String]) -> Result<Config, UserError> {
    let mut given = Vec::new();
    if let Some(path) = file {
        let text = std::fs::read_to_string(path).map_err(|e| UserError::file(path, e))?;
        read_file(path, &text, &mut given)?;
    }
    for set in sets {
        given.push(read_set(set)?);
    }
    let mut table = Table::try_from(Config::default()).map_err(|e| UserError::Failed(e.to_string()))?;
    for g in given {
        let value = check(&g)?;
        let (section, name) = g.key.split_once('.').unwrap_or((&g.key, ""));
        if let Some(Value::Table(section)) = table.get_mut(section) {
            section.insert(name.to_owned(), value);
        }
    }
    let config: Config = table.try_into().map_err(|e: toml::de::Error| UserError::Input(e.message().to_owned()))?;
    check_together(&config)?;
    Ok(config)
}

/// What no single value tells: an area has a size, a turn has room for a frame, a seal needs a key.
fn check_together(config: &Config) -> Result<(), UserError> {
    const LONGEST_FRAME_S: f64 = 55.0;
    let [west, south, east, north] = config.survey.area_m;
    if config.survey.area_m != [0.0; 4] && !(east - west >= 1.0 && north - south >= 1.0) {
        let given = format!("survey.area_m = {:?}", config.survey.area_m);
        let rule = "west, south, east, north with east and north at least 1 m above west and south, or all 0";
        return Err(UserError::Input(format!("{given} is not allowed: it takes {rule}")));
    }
    let link = &config.link;
    check_shares("link.shares", &link.shares)?;
    check_shares("map.layer_shares", &config.map.layer_shares)?;
    if link.key_file.is_empty() && (link.encrypt || link.authenticate == "all") {
        let given = if link.encrypt { "link.encrypt = true" } else { "link.authenticate = \"all\"" };
        let what = "it needs a key; set link.key_file to a file that scenecast key new has written";
        return Err(UserError::Input(format!("{given} is not allowed with an empty link.key_file: {what}")));
    }
    crate::modem::check(config)?;
    super::place::check(config)?;
    check_frame(config)?;
    let bits = f64::from(config.link.frame_bytes * 8 + config.modem.overhead_bits);
    for (key, rate) in [("channel.bit_rate", config.channel.bit_rate), ("modem.bit_rate", config.modem.bit_rate)] {
        if bits / rate > LONGEST_FRAME_S {
            let least = (bits / LONGEST_FRAME_S).ceil();
            let frame = config.link.frame_bytes;
            let what =
                format!("{key} = {rate}: a frame of link.frame_bytes = {frame} takes longer than {LONGEST_FRAME_S} s");
            return Err(UserError::Input(format!("{what}; allowed is {least} bit/s or more, or a smaller frame")));
        }
    }
    Ok(())
}

/// Under a key a frame ends in a tag, beside which the longest thing that cannot be cut must fit.
fn check_frame(config: &Config) -> Result<(), UserError> {
    let link = &config.link;
    let (least, with, what) = match (link.key_file.as_str(), link.authenticate.as_str()) {
        ("", _) => return Ok(()),
        (_, "all") => (48, "link.authenticate = \"all\"", "the vehicle's report"),
        _ => (36, "a link.key_file", "a position fix"),
    };
    let frame_bytes = crate::full_frame_bytes(config);
    if frame_bytes >= least {
        return Ok(());
    }
    let given = match config.modem.kind.as_str() {
        "micromodem" => format!("modem.rate = {} with frames of {frame_bytes} bytes", config.modem.rate),
        _ => format!("link.frame_bytes = {frame_bytes}"),
    };
    let why = format!("{what} does not fit a smaller frame beside the tag");
    Err(UserError::Input(format!("{given} is not allowed with {with}: it takes {least} to 1024 bytes, for {why}")))
}

fn check_shares(key: &str, shares: &[u8]) -> Result<(), UserError> {
    let sum: u32 = shares.iter().map(|&s| u32::from(s)).sum();
    if sum <= 100 {
        return Ok(());
    }
    let given = format!("{key} = {shares:?}");
    Err(UserError::Input(format!("{given} is not allowed: they add up to {sum} %, and together they take 100 or less")))
}

fn read_file(path: &Path, text: &str, given: &mut Vec<Given>) -> Result<(), UserError> {
    let place = |at: usize| format!("{}:{}", path.display(), text.get(..at).map_or(1, |t| t.matches('\n').count() + 1));
    let table = DeTable::parse(text)
        .map_err(|e| UserError::Input(format!("{}: {}", place(e.span().map_or(0, |s| s.start)), e.message())))?;
    for (section, value) in table.get_ref() {
        let DeValue::Table(keys) = value.get_ref() else {
            return Err(unknown(section.get_ref(), &place(section.span().start)));
        };
        if !KEYS.iter().any(|k| k.name.split('.').next() == Some(section.get_ref())) {
            return Err(unknown(section.get_ref(), &place(section.span().start)));
        }
        for (name, value) in keys {
            let key = format!("{}.{}", section.get_ref(), name.get_ref());
            let place = place(name.span().start);
            let value = plain(value).ok_or_else(|| UserError::Input(format!("{place}: {key} cannot be read")))?;
            given.push(Given { key, value, place });
        }
    }
    Ok(())
}

/// A value without its place in the file; dates and nested tables have no use here.
fn plain(value: &Spanned<DeValue<'_>>) -> Option<Value> {
    Some(match value.get_ref() {
        DeValue::String(s) => Value::String(s.to_string()),
        DeValue::Integer(i) => Value::Integer(i64::from_str_radix(i.as_str(), i.radix()).ok()?),
        DeValue::Float(f) => Value::Float(f.as_str().parse().ok()?),
        DeValue::Boolean(b) => Value::Boolean(*b),
        DeValue::Array(a) => Value::Array(a.iter().map(plain).collect::<Option<_>>()?),
        DeValue::Datetime(_) | DeValue::Table(_) => return None,
    })
}

fn read_set(set: &str) -> Result<Given, UserError> {
    let (key, text) = set
        .split_once('=')
        .ok_or_else(|| UserError::Input(format!("--set {set}: expected KEY=VALUE, as in link.budget_bps=2000")))?;
    let parsed = format!("v = {text}").parse::<Table>().ok().and_then(|mut t| t.remove("v"));
    let value = parsed.unwrap_or_else(|| Value::String(text.to_owned()));
    Ok(Given { key: key.trim().to_owned(), value, place: format!("--set {set}") })
}

fn check(given: &Given) -> Result<Value, UserError> {
    let Some(key) = KEYS.iter().find(|k| k.name == given.key) else { return Err(unknown(&given.key, &given.place)) };
    let default = default_of(key);
    fit(&given.value, &default, key).ok_or_else(|| {
        UserError::Input(format!(
            "{}: {} = {} is not allowed: it takes {}",
            given.place,
            key.name,
            given.value,
            key.takes(&default)
        ))
    })
}

/// `value` in the type of `default`, if it lies within what the key allows.
fn fit(value: &Value, default: &Value, key: &Key) -> Option<Value> {
    let in_range = |x: f64| match key.allowed {
        Allowed::Range(low, high) | Allowed::List(low, high) => (low..=high).contains(&x),
        _ => false,
    };
    match (default, value) {
        (Value::Integer(_), Value::Integer(i)) => in_range(*i as f64).then(|| value.clone()),
        (Value::Float(_), Value::Float(f)) => in_range(*f).then(|| value.clone()),
        (Value::Float(_), Value::Integer(i)) => in_range(*i as f64).then_some(Value::Float(*i as f64)),
        (Value::Boolean(_), Value::Boolean(_)) => Some(value.clone()),
        (Value::String(_), Value::String(s)) => match key.allowed {
            Allowed::Choice(words) => words.contains(&s.as_str()).then(|| value.clone()),
            _ => Some(value.clone()),
        },
        (Value::Array(_), Value::Array(v)) if matches!(key.allowed, Allowed::List(..) | Allowed::Words(_)) => {
            let is_allowed = |x: &Value| match key.allowed {
                Allowed::Words(words) => x.as_str().is_some_and(|word| words.contains(&word)),
                _ => x.as_integer().is_some_and(|i| in_range(i as f64)),
            };
            let differ = (1..v.len()).all(|i| !v[..i].contains(&v[i]));
            (v.iter().all(is_allowed) && differ).then(|| value.clone())
        }
        (Value::Array(d), Value::Array(v)) if d.len() == v.len() => {
            d.iter().zip(v).map(|(d, v)| fit(v, d, key)).collect::<Option<Vec<_>>>().map(Value::Array)
        }
        _ => None,
    }
}

pub(super) fn default_of(key: &Key) -> Value {
    let table = Table::try_from(Config::default()).unwrap_or_default();
    let (section, name) = key.name.split_once('.').unwrap_or_default();
    table.get(section).and_then(|s| s.get(name)).cloned().unwrap_or(Value::Boolean(false))
}

impl Key {
    /// What the key takes, for people.
    pub(super) fn takes(&self, default: &Value) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match (self.allowed, default) {
            (Allowed::Range(low, high), Value::Integer(_)) => format!("a whole number from {low} to {high}{unit}"),
            (Allowed::Range(low, high), Value::Array(a)) => {
                let whole = if a.iter().all(Value::is_integer) { "whole " } else { "" };
                format!("{} {whole}numbers from {low} to {high}{unit}", a.len())
            }
            (Allowed::List(low, high), _) => format!("a list of different whole numbers from {low} to {high}{unit}"),
            (Allowed::Range(low, high), _) => format!("a number from {low} to {high}{unit}"),
            (Allowed::Choice(words), _) => format!("one of {}", words.join(", ")),
            (Allowed::Words(words), _) => format!("a list of different ones of {}", words.join(", ")),
            (Allowed::Text, _) => "text in quotes".to_owned(),
            (Allowed::Flag, _) => "true or false".to_owned(),
        }
    }
}

fn unknown(key: &str, place: &str) -> UserError {
    let nearest = KEYS.iter().map(|k| k.name).min_by_key(|name| distance(name, key)).unwrap_or_default();
    UserError::Input(format!(
        "{place}: there is no key {key}; the nearest is {nearest} (scenecast config lists them all)"
    ))
}

/// Edit distance.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut corner = std::mem::replace(&mut row[0], i + 1);
        for (j, &cb) in b.iter().enumerate() {
            let best = (corner + usize::from(ca != cb)).min(row[j] + 1).min(row[j + 1] + 1);
            corner = std::mem::replace(&mut row[j + 1], best);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(sets: &[&str]) -> String {
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
        load(None, &sets).unwrap_err().to_string()
    }

    #[test]
    fn every_key_has_a_default_within_what_it_allows_and_every_field_has_a_key() {
        for key in KEYS {
            let default = default_of(key);
            assert_eq!(fit(&default, &default, key).as_ref(), Some(&default), "{}", key.name);
        }
        let table = Table::try_from(Config::default()).unwrap();
        let fields: usize = table.values().map(|s| s.as_table().unwrap().len()).sum();
        assert_eq!(fields, KEYS.len());
    }

    #[test]
    fn a_misspelt_key_is_answered_with_the_nearest_one() {
        let said = message(&["link.bugdet_bps=2000"]);
        assert!(said.contains("no key link.bugdet_bps") && said.contains("nearest is link.budget_bps"), "{said}");
    }

    #[test]
    fn a_value_out_of_range_is_answered_with_the_range() {
        let said = message(&["link.frame_bytes=9"]);
        assert_eq!(
            said,
            "--set link.frame_bytes=9: link.frame_bytes = 9 is not allowed: it takes a whole number from 32 to 1024 bytes"
        );
    }

    #[test]
    fn a_file_is_read_with_its_line_in_every_complaint() {
        let mut given = Vec::new();
        read_file(Path::new("x.toml"), "[link]\nbudget_bps = 5\n", &mut given).unwrap();
        let said = check(&given[0]).unwrap_err().to_string();
        assert!(said.starts_with("x.toml:2: link.budget_bps = 5"), "{said}");
        let broken = read_file(Path::new("x.toml"), "[link]\n\nbudget_bps = = 5\n", &mut given).unwrap_err();
        assert!(broken.to_string().starts_with("x.toml:3: "), "{broken}");
    }

    #[test]
    fn sealing_without_a_key_is_refused() {
        for set in ["link.encrypt=true", "link.authenticate=all"] {
            let said = message(&[set]);
            assert!(said.contains(set.split('=').next().unwrap()) && said.contains("link.key_file"), "{said}");
        }
        let all = ["link.encrypt=true", "link.authenticate=all", "link.key_file=k"].map(str::to_owned);
        assert!(load(None, &all).is_ok());
    }

    #[test]
    fn shares_add_up_to_a_hundred_at_most_and_vehicles_differ() {
        let said = message(&["link.shares=[10, 5, 5, 60, 30]"]);
        assert!(said.contains("link.shares = [10, 5, 5, 60, 30]") && said.contains("110 %"), "{said}");
        let said = message(&["link.shares=[10, 5]"]);
        assert!(said.ends_with("it takes 5 whole numbers from 0 to 100 %"), "{said}");
        let said = message(&["link.vehicles=[2, 2]"]);
        assert!(said.ends_with("it takes a list of different whole numbers from 1 to 14"), "{said}");
        assert_eq!(load(None, &["link.vehicles=[1, 3]".into()]).unwrap().link.vehicles, [1, 3]);
    }

    #[test]
    fn planes_are_named_each_once_and_their_shares_leave_something_to_labels() {
        let said = message(&["map.planes=[\"colour\"]"]);
        assert!(said.ends_with("it takes a list of different ones of confidence, depth, curiosity"), "{said}");
        assert!(message(&["map.planes=[\"depth\", \"depth\"]"]).contains("different ones"));
        assert!(message(&["map.planes=depth"]).contains("a list"));
        let said = message(&["map.layer_shares=[60, 0, 50]"]);
        assert!(said.contains("map.layer_shares = [60, 0, 50]") && said.contains("110 %"), "{said}");
        let config = load(None, &["map.planes=[]".into(), "map.layer_shares=[20, 10, 0]".into()]).unwrap();
        assert_eq!((config.map.planes.len(), config.map.layer_shares), (0, [20, 10, 0]));
    }

    #[test]
    fn a_frame_with_a_tag_has_room_for_a_report() {
        let sealed = ["link.authenticate=all", "link.key_file=k", "link.frame_bytes=40"];
        let said = message(&sealed);
        assert!(said.starts_with("link.frame_bytes = 40") && said.contains("48 to 1024"), "{said}");
        let said = message(&["link.key_file=k", "link.frame_bytes=32"]);
        assert!(said.contains("a position fix") && said.contains("36 to 1024"), "{said}");
        assert!(load(None, &sealed[2..].iter().map(|s| (*s).to_owned()).collect::<Vec<_>>()).is_ok());
    }

    #[test]
    fn whole_numbers_do_for_fractions_and_bare_words_for_text() {
        let config = load(None, &["channel.range_m=1000".into(), "map.codec=png".into()]).unwrap();
        assert_eq!((config.channel.range_m, config.map.codec.as_str()), (1000.0, "png"));
    }
}

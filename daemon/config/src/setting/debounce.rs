//! How long values of cells are held back.

use super::Setting;
use crate::rule::Rule;
use scenecast_protocol::map::Hold;
use serde_json::json;
use std::time::Duration;
use toml::Value;

/// How long a new value of a cell must be stable before it is sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Debounce {
    /// As long as the backlog takes.
    Automatic,
    Seconds(f64),
}

impl Debounce {
    const AUTOMATIC: &str = "auto";

    /// The rule for the labels at a budget of `bits_per_s`.
    pub fn hold(self, bits_per_s: u32) -> Hold {
        match self {
            Self::Automatic => Hold::Backlog(bits_per_s),
            Self::Seconds(s) => Hold::For(Duration::from_secs_f64(s)),
        }
    }

    /// The wait for a layer, which the automatic rule sends at once.
    pub fn of_layers(self) -> Duration {
        match self {
            Self::Automatic => Duration::ZERO,
            Self::Seconds(s) => Duration::from_secs_f64(s),
        }
    }
}

impl Setting for Debounce {
    fn read(value: &Value, rule: &Rule) -> Option<Self> {
        if value.as_str() == Some(Self::AUTOMATIC) {
            return Some(Self::Automatic);
        }
        f64::read(value, rule).map(Self::Seconds)
    }

    fn write(&self) -> Value {
        match self {
            Self::Automatic => Value::String(Self::AUTOMATIC.to_owned()),
            Self::Seconds(s) => s.write(),
        }
    }

    fn allowed(rule: &Rule) -> String {
        format!("{:?} or {}", Self::AUTOMATIC, f64::allowed(rule))
    }

    fn schema(rule: &Rule) -> serde_json::Value {
        json!({ "anyOf": [{ "const": Self::AUTOMATIC }, f64::schema(rule)] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load;

    #[test]
    fn a_debounce_is_automatic_or_a_number_of_seconds() {
        let read = |value: &str| load(None, &[format!("map.debounce_s={value}")]).map(|config| config.map.debounce_s);
        assert_eq!(load(None, &[]).unwrap().map.debounce_s, Debounce::Automatic);
        assert_eq!(read("auto").unwrap(), Debounce::Automatic);
        assert_eq!(read("2.5").unwrap(), Debounce::Seconds(2.5));
        let error = read("-1").unwrap_err().to_string();
        assert!(error.contains("\"auto\" or a number from 0 to 600 s"), "{error}");
        assert_eq!(Debounce::Automatic.hold(100), Hold::Backlog(100));
        assert_eq!(Debounce::Seconds(2.5).hold(100), Hold::For(Duration::from_millis(2500)));
    }
}

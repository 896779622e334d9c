//! The bodies of orders, the same for every way in, and their conversion into the content of slots.

mod changes;
mod places;
mod record;
mod settings;
mod tasks;

pub use changes::OrderChanges;
pub(crate) use places::hundredths;
pub use places::{AreaOrder, AreasOrder, DestinationOrder, FenceOrder, LimitsOrder};
pub use record::{
    CommandOrder, CommandOrderAction, DismissOrder, DraftOrder, LabelOrder, MarkerOrder, NoteOrder, RemoveMarkerOrder,
};
use scenecast_protocol::directive::{Constraints, Slot};
use serde_json::Value;
pub use settings::SettingsOrder;
pub use tasks::{
    AgainOrder, BudgetOrder, CONSTRAINT_NAMES, ConstraintsAction, ConstraintsOrder, DryRunOrder, ExemplarAction,
    ExemplarOrder, RestoreOrder, SharesOrder, TakeOverOrder, UtilityOrder,
};

/// The number of a label as the name of a member: 1 to 254, without a sign or a leading zero.
const LABEL: &str = "^([1-9][0-9]?|1[0-9]{2}|2[0-4][0-9]|25[0-4])$";

/// The name of an order for people: hold, resume and abort share a slot.
pub fn order_name(order: &Slot) -> &'static str {
    match order {
        Slot::Constraints(Constraints { abort: true, .. }) => "abort",
        Slot::Constraints(Constraints { hold: true, .. }) => "hold",
        Slot::Constraints(_) => "resume",
        other => other.id().name(),
    }
}

/// A member with its unit, as in "depth 2 to 25 m".
pub fn member_in_words(name: &str, value: &Value) -> String {
    let (name, unit) = name_and_unit(name);
    let is_end = |end: &Value| end.is_number() || end.is_null();
    let value = match value.as_array().map(Vec::as_slice) {
        Some([Value::Null, high]) if high.is_number() => format!("at most {}", value_in_words(high)),
        Some([low, Value::Null]) if low.is_number() => format!("at least {}", value_in_words(low)),
        Some([low, high]) if is_end(low) && is_end(high) => {
            format!("{} to {}", value_in_words(low), value_in_words(high))
        }
        _ => value_in_words(value),
    };
    [Some(name), Some(value), unit.map(str::to_owned)].into_iter().flatten().collect::<Vec<_>>().join(" ")
}

/// The words of a member's name, and the unit that ends it.
pub(crate) fn name_and_unit(name: &str) -> (String, Option<&'static str>) {
    let units = [("_bps", "bit/s"), ("_m", "m"), ("_s", "s")];
    // A rate is a number for each second.
    let unit = units.into_iter().find(|(end, _)| name.ends_with(end) && !name.ends_with("_per_s"));
    let words = unit.and_then(|(end, _)| name.strip_suffix(end)).unwrap_or(name);
    (words.replace('_', " "), unit.map(|(_, unit)| unit))
}

/// A value without quotation marks, and a whole number without decimals.
pub fn value_in_words(value: &Value) -> String {
    value.as_f64().map_or_else(|| value.to_string().replace('"', ""), |number| number.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_have_their_units_and_open_ends() {
        let told = |name: &str, value: &str| member_in_words(name, &serde_json::from_str(value).unwrap());
        assert_eq!(told("depth_m", "[5.0, 30.5]"), "depth 5 to 30.5 m");
        assert_eq!(
            [told("depth_m", "[null, 30]"), told("depth_m", "[5, null]")],
            ["depth at most 30 m", "depth at least 5 m"]
        );
        assert_eq!([told("silence_s", "300.0"), told("on_silence", "\"hold\"")], ["silence 300 s", "on silence hold"]);
        assert_eq!(told("frames_per_s", "0.5"), "frames per s 0.5", "a rate is no time");
    }
}

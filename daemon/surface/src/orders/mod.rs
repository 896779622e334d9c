//! The bodies of orders, the same for every way in, and their conversion into the content of slots.

mod changes;
mod places;
mod record;
mod settings;
mod vehicle;
mod words;

pub use changes::OrderChanges;
pub(crate) use places::hundredths;
pub use places::{AreaOrder, AreasOrder, DestinationOrder, FenceOrder, LimitsOrder};
pub use record::{
    CommandOrder, CommandOrderAction, DismissOrder, DraftOrder, LabelOrder, MarkerOrder, NoteOrder, RemoveMarkerOrder,
};
pub use settings::SettingsOrder;
pub use vehicle::{
    AgainOrder, BudgetOrder, CONSTRAINT_NAMES, ConstraintsAction, ConstraintsOrder, ExemplarAction, ExemplarOrder,
    RestoreOrder, SharesOrder, TakeOverOrder, UtilityOrder,
};
pub(crate) use words::name_and_unit;
pub use words::{member_in_words, value_in_words};

use scenecast_protocol::directive::{Constraints, Slot};

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

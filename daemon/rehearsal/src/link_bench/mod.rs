//! What the link achieves over range, frame size and loss, with opaque payload in virtual time.

mod budgets;
mod fleet;
mod golden;
mod opaque;
mod ranging;
mod speed;
mod summary;
mod table;
mod tally;
mod trial;
mod water;

pub use budgets::{BudgetRow, measure_budgets};
pub use fleet::{FleetRow, measure_fleet};
pub use golden::{LinkTable, link_table};
pub use opaque::{OpaqueReplica, OpaqueSource};
pub use ranging::{RangingRow, measure_ranging};
pub use speed::{Speed, measure_speed};
pub use summary::Summary;
pub use table::{Pattern, Place, Row, places};
pub use trial::Effort;
pub use water::{Setting, Water};

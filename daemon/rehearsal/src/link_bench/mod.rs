//! Efficiency and latency of the link over range, frame size and loss, with opaque payload in virtual time.

mod bench;
mod budgets;
mod fleet;
mod golden;
mod opaque;
#[cfg(test)]
mod opaque_tests;
mod ranging;
mod speed;
mod summary;
mod table;
mod tally;
mod trial;

pub use bench::{LinkBench, LinkSetting};
pub use budgets::{BudgetRow, measure_budgets};
pub use fleet::{FleetRow, measure_fleet};
pub use golden::{LinkTable, link_table};
pub use opaque::{OpaqueReplica, OpaqueSource};
pub use ranging::{RangingRow, measure_ranging};
pub use speed::{Speed, measure_speed};
pub use summary::Summary;
pub use table::{LinkCase, LinkRow, Pattern, link_cases};
pub use trial::LinkEffort;

//! Efficiency and latency of the link over range, frame size and loss, with opaque payload in virtual time.

mod bench;
mod budgets;
mod figures;
mod fleet;
mod golden;
mod opaque;
mod ranging;
mod speed;
mod tally;
mod trial;

pub use bench::{LinkBench, LinkSetting};
pub use budgets::{BudgetRow, measure_budgets};
pub use fleet::{FleetRow, measure_fleet};
pub use golden::{LinkCase, LinkRow, LinkTable, Pattern, link_cases, link_table};
pub use opaque::{OpaqueReplica, OpaqueSource};
pub use ranging::{RangingRow, measure_ranging};
pub use speed::{Speed, measure_speed};
pub use tally::Summary;
pub use trial::LinkEffort;

#[cfg(test)]
mod opaque_tests;

//! Which content goes out next, and how many bits it may take.

mod audit;
mod background;
mod budget;
mod shares;

pub use audit::Audit;
pub use background::{BackgroundOrder, BackgroundStream};
pub use budget::BitBudget;
pub use shares::{Class, ClassShares, Shares};

//! Which content goes out next, and how many bits it may take.

mod audit;
mod budget;
mod shares;
mod spend;

pub use audit::Audit;
pub use budget::BitBudget;
pub use shares::{Class, ClassShares, Shares};
pub use spend::{Extra, SpendOrder};

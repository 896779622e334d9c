//! What is worth the next bits, and how many there may be.

mod audit;
mod budget;
mod shares;
mod spend;

pub use audit::Audit;
pub use budget::BitBudget;
pub use shares::{Class, ClassShares, Shares};
pub use spend::{Extra, SpendOrder};

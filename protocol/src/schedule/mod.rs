//! Which content goes out next, and how many bits it may take.

mod background;
mod budget;
mod shares;

pub use background::{BackgroundError, BackgroundOrder, BackgroundStream};
pub use budget::{Audit, BitBudget};
pub use shares::{Class, ClassShares, Shares};

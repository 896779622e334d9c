//! What is known of the settings of the scene model before a mission: how much each tells, and what its stream takes.

mod fit;
mod table;

pub use fit::{Fit, NoRow};
pub use fit::{least, most};
pub use table::{Measurement, Row, Setting, TuningTable};

//! Measured information and bit rate of settings of the scene model.

mod fit;
mod table;

pub use fit::{Fit, NoRow};
pub use fit::{least, most};
pub use table::{Measurement, Row, Setting, TuningTable};

//! The client behind `scenecast ctl`: it reads the state, writes files, and gives orders.

mod book;
mod changes;
mod constraints;
mod download;
mod http;
mod names;
mod orders;
mod session;
mod settings;
mod text;

pub use book::{LabelChange, edit_label, mark, note, remove_mark, show_marks};
pub use changes::{LogSelection, save_log, show_labels, show_log, show_status, watch};
pub use constraints::{
    FenceFile, LIMITS, clear_fence, clear_limits, give_again, restore_orders, send_constraints, set_fence, set_limits,
    set_return_point, show_fence, show_limits, take_over,
};
pub use download::{cancel_exemplar, save_exemplar, save_map};
pub use http::Client;
pub use orders::{
    AreasFile, BudgetChange, change_command, go, set_areas, set_budget, set_utility, show_areas, show_budget,
    show_command, show_utility, try_utility,
};
pub use session::Session;
pub use settings::{SettingsChange, change_settings};

use scenecast_core::UserError;
use std::pin::Pin;

/// Runs a command of the client to its end.
pub fn block_on(command: impl Future<Output = Result<(), UserError>>) -> Result<(), UserError> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    // Of a boxed future the runtime has one copy of the code, of another one several.
    let command: Pin<Box<dyn Future<Output = _>>> = Box::pin(command);
    runtime.map_err(UserError::failed)?.block_on(command)
}

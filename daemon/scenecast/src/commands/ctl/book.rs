//! `scenecast ctl label`, `mark`

use clap::{Args, Subcommand};
use scenecast_console::client::{self, LabelChange, Session};
use scenecast_core::UserError;

#[derive(Debug, Args)]
pub(super) struct LabelArgs {
    /// Label on the map: its number, 1 to 254, or its name
    label: String,
    /// Its name, at most 60 characters; "": none
    #[arg(long, value_name = "NAME", required_unless_present_any = ["colour", "merge_into"])]
    name: Option<String>,
    /// Its colour, as in #a0b1c2; "": that of its number
    #[arg(long, value_name = "COLOUR")]
    colour: Option<String>,
    /// Number or name of another label, which it is shown as a part of; "": none
    #[arg(long, value_name = "LABEL")]
    merge_into: Option<String>,
}

#[derive(Debug, Subcommand)]
pub(super) enum MarkCommand {
    /// Set a marker.
    #[command(after_help = "Example: scenecast ctl mark set 12.5 -40 'lost anchor'")]
    Set {
        /// Metres east of the origin
        #[arg(allow_negative_numbers = true)]
        east_m: f64,
        /// Metres north of the origin
        #[arg(allow_negative_numbers = true)]
        north_m: f64,
        /// What is there, at most 200 characters
        text: String,
    },
    /// Remove a marker.
    #[command(after_help = "Example: scenecast ctl mark remove 2")]
    Remove {
        /// Its number
        number: u32,
    },
}

pub(super) async fn label(session: &Session, args: LabelArgs) -> Result<(), UserError> {
    let LabelArgs { label, name, colour, merge_into } = args;
    client::edit_label(session, &label, LabelChange { name, colour, merged_into: merge_into }).await
}

pub(super) async fn mark(session: &Session, change: Option<MarkCommand>) -> Result<(), UserError> {
    match change {
        None => client::show_marks(session).await,
        Some(MarkCommand::Set { east_m, north_m, text }) => client::mark(session, [east_m, north_m], text).await,
        Some(MarkCommand::Remove { number }) => client::remove_mark(session, number).await,
    }
}

//! `scenecast doctor`

use clap::{Args, Subcommand, ValueEnum};
use scenecast_core::UserError;
use scenecast_protocol::wire::Address;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(super) enum Doctor {
    Modem(Modem),
}

/// Look at the port of the modem: whether it opens, who speaks there and at which speed, and whether the modem gets ready.
///
/// The modem is set up as by the process of this end, which must not run meanwhile. No frame is sent; an S2C modem may transmit what it
/// gets at a wrong speed.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast doctor modem --config config/auv.toml --role auv")]
pub(super) struct Modem {
    /// Configuration file of the end
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// The end whose modem it is
    #[arg(long, value_enum, default_value_t = End::Asv)]
    role: End,
    /// Set a key of the configuration, as in modem.baud=9600
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum End {
    Auv,
    Asv,
}

impl Doctor {
    pub(super) fn run(self) -> Result<(), UserError> {
        let Self::Modem(Modem { config, role, sets }) = self;
        let config = scenecast_config::load(Some(&config), &sets)?;
        let end = match role {
            End::Auv => scenecast_config::vehicle_address(&config)?,
            End::Asv => Address::SURFACE,
        };
        scenecast_runtime::check_modem(&config, end)
    }
}

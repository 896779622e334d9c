//! `scenecast ctl`

mod constraints;

use clap::{Args, Subcommand};
use constraints::{FenceCommand, LimitsCommand, ReturnPointCommand};
use scenecast_console::client::{self as ctl, BudgetChange, Client, SettingsChange};
use scenecast_console::orders::ExemplarWish;
use scenecast_core::UserError;
use scenecast_surface::SettingsOrder;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

const EXAMPLES: &str = "\
Example: scenecast ctl status
         scenecast ctl map --out reef.png
         scenecast ctl utility set 3=0.8 5=-1 --exploration 0.2 --wait 120
         scenecast ctl budget set 2000 --shares map=60,exemplar=10
         scenecast ctl settings --gamma 1e-5 --cells coarse --wait 120
         scenecast ctl settings --fit 800
         scenecast ctl exemplar 3 --out label-3.webp
         scenecast ctl fence set fence.geojson --wait 120
         scenecast ctl limits set --depth 5..30 --silence 300 --on-silence return
         scenecast ctl hold --wait 60
         scenecast ctl watch --json --url http://192.168.1.7:8460 --token-file console.token

Exit codes: 0 done; 1 refused, not applied in time, or nobody answers; 2 wrong usage";

const EXEMPLAR_EXAMPLES: &str = "\
Example: scenecast ctl exemplar 3 --out label-3.webp --wait 300
         scenecast ctl exemplar 3 --out label-3-large.webp --larger
         scenecast ctl exemplar 3 --cancel";

/// Speak with a running surface: see what it has, give orders.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Ctl {
    /// Where the surface serves its page
    #[arg(long, global = true, value_name = "URL", default_value = "http://127.0.0.1:8460")]
    url: String,
    /// File of the surface's token, if it has one
    #[arg(long, global = true, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Print JSON for programs
    #[arg(long, global = true)]
    json: bool,
    /// Address of the vehicle, if there are several
    #[arg(long, global = true, value_name = "N")]
    vehicle: Option<u8>,
    /// Wait so long for an order to be applied; for an image 600 unless it is given
    #[arg(long, global = true, value_name = "SECONDS", allow_negative_numbers = true)]
    wait: Option<f64>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Print how mission, link and vehicles are, with the age of each value.
    #[command(after_help = "Example: scenecast ctl status")]
    Status,
    /// Write the operator's map; the name's end says the format: .png (with world file and projection), .geojson, .ply,
    /// .csv, .json.
    #[command(after_help = "Example: scenecast ctl map --out reef.png")]
    Map {
        /// File to write
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
    /// Print the labels on the map.
    #[command(after_help = "Example: scenecast ctl labels --json")]
    Labels,
    /// Print the weights that were sent last, or send others.
    #[command(after_help = "Example: scenecast ctl utility set 3=0.8 5=-1 --exploration 0.2 --wait 120")]
    Utility {
        #[command(subcommand)]
        change: Option<UtilityCommand>,
    },
    /// Print the bit budget and the shares of the classes, or change them.
    #[command(
        after_help = "Example: scenecast ctl budget set 2000 --shares map=60,exemplar=10 --spend exemplars,depth"
    )]
    Budget {
        #[command(subcommand)]
        change: Option<BudgetCommand>,
    },
    /// Print the settings of the vehicle, asked for and in force, or send others; what is not named stays as it is there.
    #[command(after_help = SETTINGS_EXAMPLES)]
    Settings(SettingsArgs),
    /// Write the image of a label, which the vehicle is asked for if it is not here.
    #[command(after_help = EXEMPLAR_EXAMPLES)]
    Exemplar {
        /// Label
        label: u8,
        /// File to write, WebP
        #[arg(long, value_name = "FILE", required_unless_present = "cancel")]
        out: Option<PathBuf>,
        /// Ask for another image, although there is one
        #[arg(long)]
        again: bool,
        /// Ask for the newest image with twice its edge
        #[arg(long, conflicts_with = "again")]
        larger: bool,
        /// Ask for none any more: what is on its way is not sent to its end
        #[arg(long, conflicts_with_all = ["again", "larger", "out"])]
        cancel: bool,
    },
    /// Print the fence with its keep-outs and return point, as sent last and as in force, or send another.
    #[command(after_help = "Example: scenecast ctl fence set fence.geojson --wait 120")]
    Fence {
        #[command(subcommand)]
        change: Option<FenceCommand>,
    },
    /// Move the point that the vehicle returns to.
    #[command(after_help = "Example: scenecast ctl return-point set 12.5 -40 --wait 120")]
    ReturnPoint {
        #[command(subcommand)]
        change: ReturnPointCommand,
    },
    /// Print the limits, as sent last and as in force, or send others.
    #[command(
        after_help = "Example: scenecast ctl limits set --depth 5..30 --silence 300 --on-silence return --wait 120"
    )]
    Limits {
        #[command(subcommand)]
        change: Option<LimitsCommand>,
    },
    /// Tell the vehicle to stay where it is.
    #[command(after_help = "Example: scenecast ctl hold --wait 60")]
    Hold,
    /// Tell the vehicle to go on, after a hold, an abort or a breach.
    #[command(after_help = "Example: scenecast ctl resume --wait 60")]
    Resume,
    /// Tell the vehicle to end its survey and to do what its limits say of an abort.
    #[command(after_help = "Example: scenecast ctl abort --yes --wait 60")]
    Abort {
        /// Yes, end it
        #[arg(long)]
        yes: bool,
    },
    /// Print changes as they come, until Ctrl-C.
    #[command(after_help = "Example: scenecast ctl watch --json")]
    Watch,
}

const SETTINGS_EXAMPLES: &str = "\
Example: scenecast ctl settings
         scenecast ctl settings --gamma 1e-5 --frames 0.2 --layers none --wait 120
         scenecast ctl settings --alpha 0 --cells \"\"     both as the vehicle is configured
         scenecast ctl settings --fit                    what fits the map's share of the budget
         scenecast ctl settings --fit 800 --dry-run      what would fit 800 bit/s";

#[derive(Debug, Args)]
struct SettingsArgs {
    /// Preference for labels that are used elsewhere, 1e-9 to 1e3; 0: as configured
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    alpha: Option<f64>,
    /// Prior weight of each word in a label, 1e-9 to 1e3; 0: as configured
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    beta: Option<f64>,
    /// Weight of a new label, 1e-12 to 1e3; 0: as configured
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    gamma: Option<f64>,
    /// Words resampled a second of mission time, 1 to 1e8; 0: as configured
    #[arg(long, value_name = "WORDS/S", allow_negative_numbers = true)]
    refine: Option<f64>,
    /// Camera frames a second that the scene model sees at most, 0.01 to 30; 0: as configured
    #[arg(long, value_name = "1/S", allow_negative_numbers = true)]
    frames: Option<f64>,
    /// Cells that are told: fine, coarse-to-fine, coarse (every fourth both ways); "": as configured
    #[arg(long, value_name = "BAND")]
    cells: Option<String>,
    /// Layers that are told: none, or different ones of confidence, depth, curiosity with commas between; "": as configured
    #[arg(long, value_name = "LAYERS")]
    layers: Option<String>,
    /// lawnmower, greedy, horizon; "": as configured
    #[arg(long, value_name = "NAME")]
    planner: Option<String>,
    /// Take the settings that tell most of those whose stream fits so many bits a second [default: the map's share of the
    /// vehicle's budget]; the options above go before them
    #[arg(long, value_name = "BIT/S", num_args = 0..=1, allow_negative_numbers = true)]
    fit: Option<Option<f64>>,
    /// Say what would be sent, and send nothing
    #[arg(long)]
    dry_run: bool,
}

impl SettingsArgs {
    fn change(self) -> SettingsChange {
        let order = SettingsOrder {
            planner: self.planner,
            cells: self.cells,
            layers: self.layers,
            alpha: self.alpha,
            beta: self.beta,
            gamma: self.gamma,
            refine_words_per_s: self.refine,
            frames_per_s: self.frames,
        };
        SettingsChange { order, fit: self.fit, dry_run: self.dry_run }
    }
}

#[derive(Debug, Subcommand)]
enum UtilityCommand {
    /// Send weights; labels that are not named weigh 0.
    #[command(after_help = "Example: scenecast ctl utility set 3=0.8 5=-1 --exploration 0.2")]
    Set {
        /// Label and weight, -1 to 1
        #[arg(value_name = "LABEL=WEIGHT", value_parser = label_weight)]
        weights: Vec<(u8, f64)>,
        /// Weight of unseen cells, -1 to 1
        #[arg(long, value_name = "WEIGHT", value_parser = weight, allow_hyphen_values = true)]
        exploration: Option<f64>,
        /// Keep the weights that are not named as they were sent last
        #[arg(long)]
        keep: bool,
    },
}

#[derive(Debug, Subcommand)]
enum BudgetCommand {
    /// Change the budget of the surface and of all vehicles.
    #[command(after_help = "Example: scenecast ctl budget set 2000 --shares map=60,exemplar=10 --wait 60")]
    Set {
        /// Bits on air a second, 10 to 10000000; left out: as it is
        #[arg(value_name = "BIT/S", value_parser = clap::value_parser!(u32).range(10..=10_000_000))]
        bits_per_s: Option<u32>,
        /// Least shares in percent by class, together at most 100; those that are not named stay
        #[arg(long, value_name = "CLASS=PERCENT,..", value_delimiter = ',', value_parser = class_percent)]
        shares: Vec<(String, u8)>,
        /// What left-over bits are spent on, in this order: different ones of finer, depth, exemplars, confidence,
        /// curiosity, or none
        #[arg(long, value_name = "WHAT,..", value_delimiter = ',')]
        spend: Option<Vec<String>>,
    },
}

fn weight(text: &str) -> Result<f64, String> {
    let weight = text.parse().ok().filter(|w| (-1.0..=1.0).contains(w));
    weight.ok_or_else(|| "it takes a number from -1 to 1".to_owned())
}

fn label_weight(text: &str) -> Result<(u8, f64), String> {
    let (label, w) = text.split_once('=').ok_or("it takes LABEL=WEIGHT, as in 3=0.8")?;
    let label = label.parse().ok().filter(|l| (1..=254).contains(l)).ok_or("a label is a number from 1 to 254")?;
    Ok((label, weight(w)?))
}

fn class_percent(text: &str) -> Result<(String, u8), String> {
    let (class, percent) = text.split_once('=').ok_or("it takes CLASS=PERCENT, as in map=60")?;
    let percent = percent.parse().ok().filter(|p| *p <= 100).ok_or("a share is a number from 0 to 100")?;
    Ok((class.trim().to_owned(), percent))
}

impl Ctl {
    pub(super) fn run(self) -> Result<(), UserError> {
        let wait = match self.wait {
            Some(s) if !(0.0..=1e6).contains(&s) => {
                return Err(UserError::Input(format!("--wait {s}: it takes 0 to 1000000 seconds")));
            }
            wait => wait.map(Duration::from_secs_f64),
        };
        let token = self.token_file.as_deref().map(scenecast_config::read_token).transpose()?;
        let client = Client::new(&self.url, token)?;
        let ctl = ctl::Ctl { client, json: self.json, vehicle: self.vehicle, wait };
        ctl::block_on(async move {
            match self.command {
                Command::Status => ctl.status().await,
                Command::Map { out } => ctl.map(&out).await,
                Command::Labels => ctl.labels().await,
                Command::Utility { change: None } => ctl.utility().await,
                Command::Utility { change: Some(UtilityCommand::Set { weights, exploration, keep }) } => {
                    ctl.set_utility(BTreeMap::from_iter(weights), exploration, keep).await
                }
                Command::Budget { change: None } => ctl.budget().await,
                Command::Budget { change: Some(BudgetCommand::Set { bits_per_s, shares, spend }) } => {
                    let spend = spend.map(|words| words.into_iter().filter(|w| w != "none").collect());
                    ctl.set_budget(BudgetChange { bits_per_s, shares: BTreeMap::from_iter(shares), spend }).await
                }
                Command::Settings(settings) => ctl.settings(settings.change()).await,
                Command::Exemplar { label, out: Some(out), again, larger, .. } => {
                    let wish = larger.then_some(ExemplarWish::Larger).or(again.then_some(ExemplarWish::Another));
                    ctl.exemplar(label, &out, wish).await
                }
                Command::Exemplar { label, out: None, .. } => ctl.cancel_exemplar(label).await,
                Command::Fence { change } => constraints::fence(&ctl, change).await,
                Command::ReturnPoint { change } => constraints::return_point(&ctl, change).await,
                Command::Limits { change } => constraints::limits(&ctl, change).await,
                Command::Hold => constraints::hold(&ctl, true).await,
                Command::Resume => constraints::hold(&ctl, false).await,
                Command::Abort { yes } => constraints::abort(&ctl, yes).await,
                Command::Watch => ctl.watch().await,
            }
        })
    }
}

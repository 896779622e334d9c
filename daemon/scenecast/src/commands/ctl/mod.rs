//! `scenecast ctl`

mod book;
mod command;
mod constraints;

use book::{LabelArgs, MarkCommand};
use clap::builder::PossibleValuesParser;
use clap::{Args, Subcommand};
use command::CommandChange;
use constraints::{AreasCommand, FenceCommand, Go, LimitsCommand, ReturnPointCommand};
use scenecast_console::client::{self, BudgetChange, Client, LogSelection, Session, SettingsChange};
use scenecast_core::{ClientName, Takes, UserError};
use scenecast_surface::{ExemplarAction, LogKind, SettingsOrder};
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
         scenecast ctl command take
         scenecast ctl log --kind order
         scenecast ctl watch --json --url http://192.168.1.7:8460 --token-file console.token

Exit codes: 0 success; 1 refused, not applied in time, or no answer; 2 wrong usage";

const EXEMPLAR_EXAMPLES: &str = "\
Example: scenecast ctl exemplar 3 --out label-3.webp --wait 300
         scenecast ctl exemplar 3 --out label-3-large.webp --larger
         scenecast ctl exemplar 3 --cancel";

const LOG_EXAMPLES: &str = "\
Example: scenecast ctl log --kind order
         scenecast ctl log --since 250 --json
         scenecast ctl log --out log.csv";

/// Show the state of a running surface and give orders.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Ctl {
    /// Address of the surface's page
    #[arg(long, global = true, value_name = "URL", default_value = "http://127.0.0.1:8460")]
    url: String,
    /// File with your token, if the surface requires one
    #[arg(long, global = true, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Print JSON instead of text
    #[arg(long, global = true)]
    json: bool,
    /// Address or name of the vehicle, if there are several
    #[arg(long, global = true, value_name = "VEHICLE")]
    vehicle: Option<String>,
    /// Maximum wait for an order to be applied [default: 0; for an image 600]
    #[arg(long, global = true, value_name = "SECONDS", allow_negative_numbers = true)]
    wait: Option<f64>,
    #[command(subcommand)]
    command: CtlCommand,
}

#[derive(Debug, Subcommand)]
enum CtlCommand {
    /// Print the state of mission, link and vehicles, with the age of each value.
    #[command(after_help = "Example: scenecast ctl status")]
    Status,
    /// Write the operator's map in the format of the file's extension: .png (with world file, projection and
    /// classes), .tif, .utm.tif and .wgs84.tif (GeoTIFF with classes), .geojson, .ply, .csv, .labels.csv,
    /// .coco.json and .taglab.json (classes for annotation), .json.
    #[command(after_help = "Example: scenecast ctl map --out reef.png")]
    Map {
        /// File to write, replaced if it exists
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// Number of labels at which the tree of the labels is cut, as with the slider of the page; without it all labels
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=254))]
        labels: Option<u8>,
    },
    /// Print the labels on the map.
    #[command(after_help = "Example: scenecast ctl labels --json")]
    Labels {
        /// Print the groups of labels where their tree is cut at this number, as with the slider of the page
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=254))]
        labels: Option<u8>,
    },
    /// Change name, colour or merging of a label; they stay at the surface, and are in every export.
    #[command(after_help = "Example: scenecast ctl label 3 --name 'soft coral'
         scenecast ctl label 5 --merge-into 'soft coral'")]
    Label(LabelArgs),
    /// Print the markers on the map, set one, or remove one; they stay at the surface, and are in the exports.
    #[command(after_help = "Example: scenecast ctl mark set 12.5 -40 'lost anchor'")]
    Mark {
        #[command(subcommand)]
        change: Option<MarkCommand>,
    },
    /// Add a note about the vehicle to the log and to the report.
    #[command(after_help = "Example: scenecast ctl note 'turbid since noon'")]
    Note {
        /// At most 1000 characters
        text: String,
    },
    /// Print the last weights sent, try others, or send them.
    #[command(after_help = "Example: scenecast ctl utility set 3=0.8 5=-1 --exploration 0.2 --wait 120")]
    Utility {
        #[command(subcommand)]
        change: Option<UtilityCommand>,
    },
    /// Print the bit budget and the shares of the classes, or change them.
    #[command(
        after_help = "Example: scenecast ctl budget set 2000 --shares map=60,exemplar=10 --background exemplars,depth"
    )]
    Budget {
        #[command(subcommand)]
        change: Option<BudgetCommand>,
    },
    /// Print the settings of the vehicle, requested and in force, or send others. Settings that
    /// are not given stay unchanged.
    #[command(after_help = SETTINGS_EXAMPLES)]
    Settings(SettingsArgs),
    /// Write an image of a label, and request it from the vehicle if the surface has none.
    #[command(after_help = EXEMPLAR_EXAMPLES)]
    Exemplar {
        /// Label on the map: its number, 1 to 254, or its name
        label: String,
        /// WebP file to write, replaced if it exists
        #[arg(long, value_name = "FILE", required_unless_present = "cancel")]
        out: Option<PathBuf>,
        /// Request another image even if there is one
        #[arg(long)]
        again: bool,
        /// Request the latest image with twice its width
        #[arg(long, conflicts_with = "again")]
        larger: bool,
        /// Cancel the request: the vehicle stops sending the image
        #[arg(long, conflicts_with_all = ["again", "larger", "out"])]
        cancel: bool,
    },
    /// Print the fence with its keep-outs and return point, last sent and in force, or send another.
    #[command(after_help = "Example: scenecast ctl fence set fence.geojson --wait 120")]
    Fence {
        #[command(subcommand)]
        change: Option<FenceCommand>,
    },
    /// Send the vehicle to a place at once; there it resumes its survey.
    #[command(after_help = "Example: scenecast ctl go 12.5 -40 --wait 120")]
    Go(Go),
    /// Print the weighted areas, last sent and in force, or send others.
    #[command(after_help = "Example: scenecast ctl areas set areas.geojson --wait 120")]
    Areas {
        #[command(subcommand)]
        change: Option<AreasCommand>,
    },
    /// Move the point that the vehicle returns to.
    #[command(after_help = "Example: scenecast ctl return-point set 12.5 -40 --wait 120")]
    ReturnPoint {
        #[command(subcommand)]
        change: ReturnPointCommand,
    },
    /// Print the limits, last sent and in force, or send others.
    #[command(
        after_help = "Example: scenecast ctl limits set --depth 5..30 --silence 300 --on-silence return --wait 120"
    )]
    Limits {
        #[command(subcommand)]
        change: Option<LimitsCommand>,
    },
    /// Order the vehicle to hold its position.
    #[command(after_help = "Example: scenecast ctl hold --wait 60")]
    Hold,
    /// Order the vehicle to resume its survey after a hold, an abort or a breach.
    #[command(after_help = "Example: scenecast ctl resume --wait 60")]
    Resume,
    /// Order the vehicle to abort: it ends its survey and carries out the reaction of its limits.
    #[command(after_help = "Example: scenecast ctl abort --yes --wait 60")]
    Abort {
        /// Confirm the abort, which ends the survey
        #[arg(long)]
        yes: bool,
    },
    /// Give an order again that the surface has withdrawn: another surface has given a newer one, or it is late.
    #[command(after_help = "Example: scenecast ctl again limits --wait 60")]
    Again {
        /// The slot of the order: utility, constraints (hold, abort), settings, budget, limits, fence,
        /// destination or areas
        slot: String,
    },
    /// Send the orders again that the vehicle has lost, except one to resume.
    #[command(after_help = "Example: scenecast ctl restore")]
    Restore,
    /// Take the vehicle over from another surface with the same key.
    #[command(after_help = "Example: scenecast ctl take-over")]
    TakeOver,
    /// Print who has command, the right to give orders other than hold and abort; or request it, hand
    /// it over, take it, give it up.
    #[command(
        name = "command",
        after_help = "Example: scenecast ctl command\n         scenecast ctl command hand-over bob"
    )]
    Authority {
        #[command(subcommand)]
        change: Option<CommandChange>,
    },
    /// Print the log of the mission: orders and edits with their authors, answers, silences, new
    /// labels, images; its last 2000 entries at most.
    #[command(after_help = LOG_EXAMPLES)]
    Log {
        /// Only entries of this kind
        #[arg(long, value_name = "KIND", value_parser = kinds())]
        kind: Option<String>,
        /// Only entries with a higher number
        #[arg(long, value_name = "NUMBER")]
        since: Option<u64>,
        /// CSV file to write instead of printing, replaced if it exists
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Print changes as they happen, until Ctrl-C.
    #[command(after_help = "Example: scenecast ctl watch --json")]
    Watch,
}

const SETTINGS_EXAMPLES: &str = "\
Example: scenecast ctl settings
         scenecast ctl settings --labels 8 --frames 0.2 --layers none --wait 120
         scenecast ctl settings --labels 0 --cells \"\"    both as configured on the vehicle
         scenecast ctl settings --fit                    fitted to the map's share of the budget
         scenecast ctl settings --fit 800 --dry-run      show settings that fit 800 bit/s";

#[derive(Debug, Args)]
struct SettingsArgs {
    /// Preference for topics that are used elsewhere, 1e-9 to 1e3; 0: as configured
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    alpha: Option<f64>,
    /// Prior weight of each word in a topic, 1e-9 to 1e3; 0: as configured
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    beta: Option<f64>,
    /// Weight of a new topic, 1e-12 to 1e3; 0: as configured
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    gamma: Option<f64>,
    /// Words resampled a second of mission time, 1 to 1e8; 0: as configured
    #[arg(long, value_name = "WORDS/S", allow_negative_numbers = true)]
    refine: Option<f64>,
    /// Camera frames a second that the scene model sees at most, 0.01 to 30; 0: as configured
    #[arg(long, value_name = "1/S", allow_negative_numbers = true)]
    frames: Option<f64>,
    /// Most labels that the map tells apart, 2 to 32; 0: as configured
    #[arg(long, value_name = "N")]
    labels: Option<u8>,
    /// Cells to send: fine, coarse-to-fine, coarse (every fourth in both directions); "": as configured
    #[arg(long, value_name = "BAND")]
    cells: Option<String>,
    /// Layers to send: none, or names of layers as in map.layers, separated by commas; "": as configured
    #[arg(long, value_name = "LAYERS")]
    layers: Option<String>,
    /// lawnmower, greedy, horizon; "": as configured
    #[arg(long, value_name = "NAME")]
    planner: Option<String>,
    /// Once no look pays any more: repeat (look at favoured labels again), explore (the rest, then hold), hold; "": as
    /// configured
    #[arg(long, value_name = "NAME")]
    at_end: Option<String>,
    /// Whether images place the frames of the camera on the map: on, off (odometry and compass alone); "": as configured
    #[arg(long, value_name = "ON|OFF")]
    registration: Option<String>,
    /// Use the most informative settings whose stream fits a budget [default: the map's share of the
    /// vehicle's budget]. The options above have precedence
    #[arg(long, value_name = "BIT/S", num_args = 0..=1, allow_negative_numbers = true)]
    fit: Option<Option<f64>>,
    /// Print the order instead of sending it
    #[arg(long)]
    dry_run: bool,
}

impl SettingsArgs {
    fn change(self) -> SettingsChange {
        let order = SettingsOrder {
            planner: self.planner,
            at_end: self.at_end,
            registration: self.registration,
            cells: self.cells,
            layers: self.layers,
            alpha: self.alpha,
            beta: self.beta,
            gamma: self.gamma,
            refine_words_per_s: self.refine,
            frames_per_s: self.frames,
            labels: self.labels,
        };
        SettingsChange { order, fit: self.fit, dry_run: self.dry_run }
    }
}

#[derive(Debug, Subcommand)]
enum UtilityCommand {
    /// Send weights. Labels that are not listed get 0.
    #[command(after_help = "Example: scenecast ctl utility set 3=0.8 5=-1 --exploration 0.2
         scenecast ctl utility set 'soft coral=0.5' --keep")]
    Set(UtilityArgs),
    /// Print what the vehicle would do by these weights, and send nothing.
    #[command(after_help = "Example: scenecast ctl utility try 3=0.9 --exploration 0.1")]
    Try(UtilityArgs),
}

#[derive(Debug, Args)]
struct UtilityArgs {
    /// Number or name of a label, and its weight, -1 to 1. A name stands also for the labels that are merged into it
    #[arg(value_name = "LABEL=WEIGHT", value_parser = label_weight)]
    weights: Vec<(String, f64)>,
    /// Weight of unexplored cells, -1 to 1
    #[arg(long, value_name = "WEIGHT", value_parser = weight, allow_hyphen_values = true)]
    exploration: Option<f64>,
    /// Keep the last weights of labels that are not listed
    #[arg(long)]
    keep: bool,
}

#[derive(Debug, Subcommand)]
enum BudgetCommand {
    /// Change the budget of the surface and of all vehicles.
    #[command(after_help = "Example: scenecast ctl budget set 2000 --shares map=60,exemplar=10 --wait 60")]
    Set {
        /// Bits on air a second, 10 to 10000000 [default: unchanged]
        #[arg(value_name = "BIT/S", value_parser = clap::value_parser!(u32).range(10..=10_000_000))]
        bits_per_s: Option<u32>,
        /// Minimum shares in percent by class, in total at most 100; other classes stay unchanged
        #[arg(long, value_name = "CLASS=PERCENT,..", value_delimiter = ',', value_parser = class_percent)]
        shares: Vec<(String, u8)>,
        /// Background streams that use spare capacity, in this order: none, or different ones of finer,
        /// exemplars, floor and the names of layers
        #[arg(long, value_name = "STREAM,..", value_delimiter = ',')]
        background: Option<Vec<String>>,
    },
}

/// The kinds of entries of the log, as values of an option.
fn kinds() -> PossibleValuesParser {
    PossibleValuesParser::new(LogKind::ALL.map(LogKind::name))
}

fn weight(text: &str) -> Result<f64, Takes> {
    let weight = text.parse().ok().filter(|w| (-1.0..=1.0).contains(w));
    weight.ok_or(Takes("expected a number from -1 to 1"))
}

fn label_weight(text: &str) -> Result<(String, f64), Takes> {
    // A name may contain an equals sign.
    let form = Takes("expected LABEL=WEIGHT, as in 3=0.8 or 'soft coral=0.5'");
    let (label, w) = text.rsplit_once('=').ok_or(form)?;
    if label.trim().parse().is_ok_and(|number: i64| !(1..=254).contains(&number)) {
        return Err(Takes("a label is a number from 1 to 254, or a name"));
    }
    Ok((label.to_owned(), weight(w)?))
}

fn class_percent(text: &str) -> Result<(String, u8), Takes> {
    let (class, percent) = text.split_once('=').ok_or(Takes("expected CLASS=PERCENT, as in map=60"))?;
    let percent = percent.parse().ok().filter(|p| *p <= 100).ok_or(Takes("a share is a number from 0 to 100"))?;
    Ok((class.trim().to_owned(), percent))
}

impl Ctl {
    pub(super) fn run(self) -> Result<(), UserError> {
        scenecast_runtime::keep_private();
        let wait = match self.wait {
            Some(s) if !(0.0..=1e6).contains(&s) => {
                return Err(UserError::Input(format!("--wait {s}: the range is 0 to 1000000 seconds")));
            }
            wait => wait.map(Duration::from_secs_f64),
        };
        let token = self.token_file.as_deref().map(scenecast_config::read_token).transpose()?;
        let name = ClientName::of_program(&format!("ctl-{}", scenecast_runtime::host_name()));
        let client = Client::new(&self.url, token, name)?;
        let session = Session { client, json: self.json, vehicle: self.vehicle, wait };
        client::block_on(self.command.run(&session))
    }
}

impl CtlCommand {
    async fn run(self, session: &Session) -> Result<(), UserError> {
        match self {
            Self::Status => client::show_status(session).await,
            Self::Map { out, labels } => client::save_map(session, &out, labels).await,
            Self::Labels { labels } => client::show_labels(session, labels).await,
            Self::Label(args) => book::label(session, args).await,
            Self::Mark { change } => book::mark(session, change).await,
            Self::Note { text } => client::note(session, text).await,
            Self::Utility { change: None } => client::show_utility(session).await,
            Self::Utility { change: Some(UtilityCommand::Set(UtilityArgs { weights, exploration, keep })) } => {
                client::set_utility(session, &weights, exploration, keep).await
            }
            Self::Utility { change: Some(UtilityCommand::Try(UtilityArgs { weights, exploration, keep })) } => {
                client::try_utility(session, &weights, exploration, keep).await
            }
            Self::Budget { change: None } => client::show_budget(session).await,
            Self::Budget { change: Some(BudgetCommand::Set { bits_per_s, shares, background }) } => {
                let background = background.map(|names| names.into_iter().filter(|n| n != "none").collect());
                let change = BudgetChange { bits_per_s, shares: BTreeMap::from_iter(shares), background };
                client::set_budget(session, change).await
            }
            Self::Settings(settings) => client::change_settings(session, settings.change()).await,
            Self::Exemplar { label, out: Some(out), again, larger, .. } => {
                let action = larger.then_some(ExemplarAction::Larger).or(again.then_some(ExemplarAction::Another));
                client::save_exemplar(session, &label, &out, action).await
            }
            Self::Exemplar { label, out: None, .. } => client::cancel_exemplar(session, &label).await,
            Self::Fence { change } => constraints::fence(session, change).await,
            Self::Go(go) => constraints::go(session, go).await,
            Self::Areas { change } => constraints::areas(session, change).await,
            Self::ReturnPoint { change } => constraints::return_point(session, change).await,
            Self::Limits { change } => constraints::limits(session, change).await,
            Self::Hold => constraints::hold(session, true).await,
            Self::Resume => constraints::hold(session, false).await,
            Self::Abort { yes } => constraints::abort(session, yes).await,
            Self::Again { slot } => client::give_again(session, slot).await,
            Self::Restore => client::restore_orders(session).await,
            Self::TakeOver => client::take_over(session).await,
            Self::Authority { change } => command::command(session, change).await,
            Self::Log { kind, since, out } => {
                let selection = LogSelection { kind, since };
                match out {
                    Some(out) => client::save_log(session, &selection, &out).await,
                    None => client::show_log(session, &selection).await,
                }
            }
            Self::Watch => client::watch(session).await,
        }
    }
}

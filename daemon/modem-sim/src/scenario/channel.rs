//! `[channel]`, `[[link]]`, `[[outage]]` and `[[stranger]]`: the channel, and other transmitters.

use super::reader::TableReader;
use super::{index_of, node, seconds};
use scenecast_core::UserError;
use sim_channel::acoustics::wind_of_sea_state;
use sim_channel::loss::{GilbertElliott, RangeTable, Snr, ThreeState, Trace};
use sim_channel::{ChannelConfig, LossModel, NodeId, NodePosition, Outage, OutageScope, presets};
use std::time::Duration;

/// A transmitter that sends at random times and receives no frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Stranger {
    pub position: NodePosition,
    pub bytes: usize,
    pub airtime: Duration,
    pub mean_gap: Duration,
}

/// Largest time in a scenario, s.
pub(super) const MAX_S: f64 = 1e7;
/// Largest coordinate of a position, m.
pub(super) const MAX_DISTANCE_M: f64 = 1e6;

/// Reads a preset and the keys that change it.
pub(super) fn read_channel(table: TableReader<'_>) -> Result<ChannelConfig, UserError> {
    let mut channel = table.choice("preset", &presets::ALL)?.map_or_else(ChannelConfig::default, |preset| preset());
    if let Some(loss) = table.table("loss")? {
        channel.loss = read_loss(loss)?;
    }
    set(&mut channel.sound_speed_m_s, table.number("sound_speed_m_s", 1300.0..=1700.0, "m/s")?);
    set(&mut channel.half_duplex, table.flag("half_duplex")?);
    set(&mut channel.corruption, table.number("corruption", 0.0..=1.0, "")?);
    set(&mut channel.duplication, table.number("duplication", 0.0..=1.0, "")?);
    set(&mut channel.reordering, table.number("reordering", 0.0..=1.0, "")?);
    set(&mut channel.reorder_delay, table.number("reorder_delay_s", 0.0..=600.0, "s")?.map(seconds));
    set(&mut channel.max_range_m, table.number("max_range_m", 1.0..=MAX_DISTANCE_M, "m")?);
    table.finish()?;
    Ok(channel)
}

fn set<T>(place: &mut T, given: Option<T>) {
    if let Some(given) = given {
        *place = given;
    }
}

/// Reads `from`, `to` and the loss model of that link.
pub(super) fn read_link(table: TableReader<'_>, names: &[&str]) -> Result<(NodeId, NodeId, LossModel), UserError> {
    let (from, to) = (index_of(&table, "from", names)?, index_of(&table, "to", names)?);
    let loss =
        table.table("loss")?.ok_or_else(|| table.missing("loss", "a table, as in loss = { model = \"none\" }"))?;
    let link = (node(from), node(to), read_loss(loss)?);
    table.finish()?;
    Ok(link)
}

/// An outage of all links, of one `modem`, or of the direction `from` .. `to`.
pub(super) fn read_outage(table: TableReader<'_>, names: &[&str]) -> Result<Outage, UserError> {
    let from = table.number("from_s", 0.0..=MAX_S, "s")?.map_or(Duration::ZERO, seconds);
    let until = table.number("until_s", 0.0..=MAX_S, "s")?.map_or(Duration::MAX, seconds);
    if until <= from {
        return Err(table.wrong("until_s", "a time after from_s"));
    }
    let given = |key| Ok::<_, UserError>(table.text(key)?.is_some());
    let scope = if given("modem")? {
        OutageScope::Node(node(index_of(&table, "modem", names)?))
    } else if given("from")? || given("to")? {
        OutageScope::Link { from: node(index_of(&table, "from", names)?), to: node(index_of(&table, "to", names)?) }
    } else {
        OutageScope::All
    };
    table.finish()?;
    Ok(Outage { from, until, scope })
}

/// Reads another transmitter in the same channel.
pub(super) fn read_stranger(table: TableReader<'_>) -> Result<Stranger, UserError> {
    let position = table.numbers("position_m", -MAX_DISTANCE_M..=MAX_DISTANCE_M, "m")?;
    let stranger = Stranger {
        position: position.map_or_else(NodePosition::default, |[x, y, z]| NodePosition::new(x, y, z)),
        bytes: table.whole("bytes", 1..=4096, "bytes")?.unwrap_or(32) as usize,
        airtime: seconds(table.number("airtime_s", 0.01..=60.0, "s")?.unwrap_or(0.5)),
        mean_gap: seconds(table.number("mean_gap_s", 0.01..=86_400.0, "s")?.unwrap_or(20.0)),
    };
    table.finish()?;
    Ok(stranger)
}

type ReadModel = fn(&TableReader<'_>) -> Result<LossModel, UserError>;

const MODELS: [(&str, ReadModel); 8] = [
    ("none", |_| Ok(LossModel::None)),
    ("independent", independent),
    ("gilbert_elliott", gilbert_elliott),
    ("three_state", three_state),
    ("snr", snr),
    ("range", range),
    ("trace", trace),
    ("fit", fit),
];

fn read_loss(table: TableReader<'_>) -> Result<LossModel, UserError> {
    let names = MODELS.map(|(name, _)| name).join(", ");
    let read = table.choice("model", &MODELS)?.ok_or_else(|| table.missing("model", format!("one of {names}")))?;
    let model = read(&table)?;
    table.finish()?;
    Ok(model)
}

fn probability(table: &TableReader<'_>, key: &'static str) -> Result<f64, UserError> {
    table.number(key, 0.0..=1.0, "")?.ok_or_else(|| table.missing(key, "a number from 0 to 1"))
}

fn dwell(table: &TableReader<'_>, key: &'static str) -> Result<Duration, UserError> {
    let given = table.number(key, 0.001..=MAX_S, "s")?;
    given.map(seconds).ok_or_else(|| table.missing(key, format!("a number from 0.001 to {MAX_S} s")))
}

fn independent(table: &TableReader<'_>) -> Result<LossModel, UserError> {
    Ok(LossModel::Independent { probability: probability(table, "probability")? })
}

fn gilbert_elliott(table: &TableReader<'_>) -> Result<LossModel, UserError> {
    let model = GilbertElliott {
        dwell_good: dwell(table, "good_s")?,
        dwell_bad: dwell(table, "bad_s")?,
        loss_good: probability(table, "loss_good")?,
        loss_bad: probability(table, "loss_bad")?,
    };
    Ok(model.into())
}

fn three_state(table: &TableReader<'_>) -> Result<LossModel, UserError> {
    let half = |key| Ok::<_, UserError>(table.number(key, 0.0..=1.0, "")?.unwrap_or(0.5));
    let model = ThreeState {
        dwell: [dwell(table, "good_s")?, dwell(table, "medium_s")?, dwell(table, "bad_s")?],
        loss: [probability(table, "loss_good")?, probability(table, "loss_medium")?, probability(table, "loss_bad")?],
        good_to_medium: half("good_to_medium")?,
        medium_to_good: half("medium_to_good")?,
        bad_to_good: half("bad_to_good")?,
    };
    Ok(model.into())
}

fn snr(table: &TableReader<'_>) -> Result<LossModel, UserError> {
    let mut model = Snr::default();
    set(&mut model.source_level_db, table.number("source_level_db", 100.0..=230.0, "dB re 1 uPa at 1 m")?);
    set(&mut model.frequency_khz, table.number("frequency_khz", 0.1..=100.0, "kHz")?);
    set(&mut model.bandwidth_khz, table.number("bandwidth_khz", 0.01..=100.0, "kHz")?);
    set(&mut model.spreading, table.number("spreading", 1.0..=2.0, "")?);
    set(&mut model.wind_m_s, table.whole("sea_state", 0..=6, "")?.map(|state| wind_of_sea_state(state as u8)));
    set(&mut model.wind_m_s, table.number("wind_m_s", 0.0..=60.0, "m/s")?);
    set(&mut model.shipping, table.number("shipping", 0.0..=1.0, "")?);
    set(&mut model.extra_noise_db, table.number("extra_noise_db", -60.0..=120.0, "dB")?);
    set(&mut model.implementation_loss_db, table.number("implementation_loss_db", -30.0..=60.0, "dB")?);
    set(&mut model.detection_snr_db, table.number("detection_snr_db", -60.0..=60.0, "dB")?);
    set(&mut model.fading_std_db, table.number("fading_std_db", 0.0..=30.0, "dB")?);
    set(&mut model.fading_coherence, table.number("fading_coherence_s", 0.001..=86_400.0, "s")?.map(seconds));
    Ok(model.into())
}

/// Reads a file whose path is relative to the scenario.
fn file(table: &TableReader<'_>) -> Result<(std::path::PathBuf, String), UserError> {
    let name =
        table.text("file")?.ok_or_else(|| table.missing("file", "the name of a file, relative to the scenario"))?;
    let path = table.path().parent().unwrap_or(std::path::Path::new(".")).join(name);
    let text = scenecast_config::read_regular_text(&path)
        .map_err(|e| table.wrong("file", format!("a file that can be read ({e})")))?;
    Ok((path, text))
}

fn range(table: &TableReader<'_>) -> Result<LossModel, UserError> {
    let (path, text) = file(table)?;
    RangeTable::from_csv(&text).map(LossModel::from).map_err(|e| UserError::file(&path, e))
}

/// A CSV of time and delivered, or a `frames.log` of ours; `direction` picks `up` or `down` from the latter.
fn trace(table: &TableReader<'_>) -> Result<LossModel, UserError> {
    let (path, text) = file(table)?;
    let direction = table.choice("direction", &[("up", "up"), ("down", "down")])?;
    let is_log = direction.is_some() || path.extension().is_some_and(|extension| extension == "log");
    let trace = if is_log { Trace::from_frames_log(&text, direction) } else { Trace::from_csv(&text) };
    trace.map(LossModel::from).map_err(|e| UserError::file(&path, e))
}

/// One link of a table of Markov fits, two or three states, a step taken as `step_s`.
fn fit(table: &TableReader<'_>) -> Result<LossModel, UserError> {
    let (path, text) = file(table)?;
    let step = dwell(table, "step_s")?;
    let states = table.whole("states", 2..=3, "")?.unwrap_or(3);
    let row = table.whole("row", 1..=10_000, "")?.unwrap_or(1) as usize;
    let pick = |models: Vec<LossModel>| {
        let count = models.len();
        models.into_iter().nth(row - 1).ok_or_else(|| table.wrong("row", format!("a whole number from 1 to {count}")))
    };
    let bad = |e| UserError::file(&path, e);
    if states == 2 {
        let links = GilbertElliott::from_csv(&text, step).map_err(bad)?;
        return pick(links.into_iter().map(|link| link.model.into()).collect());
    }
    let links = ThreeState::from_csv(&text, step).map_err(bad)?;
    pick(links.into_iter().map(|link| link.model.into()).collect())
}

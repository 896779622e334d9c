//! The scenario of `scenecast modem-sim`: the channel, its modems, and the schedule of faults.

mod channel;
mod fault;
mod modem;
mod reader;

pub use channel::Stranger;
pub use fault::ModemFault;
#[cfg(test)]
use modem::ModemMake;
pub use modem::{EmulatedPort, ScenarioModem};

use reader::{ScenarioSource, TableReader};
use scenecast_core::UserError;
use sim_channel::{ChannelConfig, LossModel, NodeId};
use std::path::Path;
use std::time::Duration;
use toml::de::DeTable;

/// Maximum number of modems and strangers together: each is a node of the channel.
const MAX_NODES: usize = 100;

#[derive(Debug)]
pub struct Scenario {
    pub seed: u64,
    pub channel: ChannelConfig,
    /// Links with a loss model of their own.
    pub links: Vec<(NodeId, NodeId, LossModel)>,
    /// In the order of the file; the first is node 1.
    pub modems: Vec<ScenarioModem>,
    /// Other transmitters in the same channel.
    pub strangers: Vec<Stranger>,
    /// Emulated time, index of the modem, and fault.
    pub faults: Vec<(Duration, usize, ModemFault)>,
}

impl Scenario {
    /// Reads a file; errors name the file, the line, the key and the allowed values.
    pub fn load(path: &Path) -> Result<Self, UserError> {
        let text = scenecast_config::read_regular_text(path)?;
        Self::read(ScenarioSource { path, text: &text })
    }

    fn read(source: ScenarioSource<'_>) -> Result<Self, UserError> {
        let table = DeTable::parse(source.text)
            .map_err(|e| source.error(e.span().map_or(0, |span| span.start), e.message()))?;
        let file = TableReader::new(source, String::new(), 0, table.get_ref());
        let seed = file.whole("seed", 0..=u64::MAX >> 1, "")?.unwrap_or(1);
        let tables = file.tables("modem")?;
        let modems = tables.into_iter().map(|table| modem::read(table, seed)).collect::<Result<Vec<_>, _>>()?;
        check_modems(&source, &modems)?;
        let names: Vec<&str> = modems.iter().map(|modem| modem.name.as_str()).collect();
        let mut channel = match file.table("channel")? {
            Some(table) => channel::read_channel(table)?,
            None => ChannelConfig::default(),
        };
        for table in file.tables("outage")? {
            channel.outages.push(channel::read_outage(table, &names)?);
        }
        let links = file.tables("link")?.into_iter().map(|table| channel::read_link(table, &names));
        let links = links.collect::<Result<Vec<_>, _>>()?;
        let strangers =
            file.tables("stranger")?.into_iter().map(channel::read_stranger).collect::<Result<Vec<_>, _>>()?;
        let faults = file.tables("fault")?.into_iter().map(|table| fault::read(table, &names));
        let faults = faults.collect::<Result<Vec<_>, _>>()?;
        file.finish()?;
        if modems.len() + strangers.len() > MAX_NODES {
            return Err(source.error(0, format!("more than {MAX_NODES} modems and strangers are not allowed")));
        }
        Ok(Self { seed, channel, links, modems, strangers, faults })
    }
}

/// The node of the modem at an index.
pub fn node(index: usize) -> NodeId {
    NodeId(u8::try_from(index + 1).unwrap_or(u8::MAX))
}

fn check_modems(source: &ScenarioSource<'_>, modems: &[ScenarioModem]) -> Result<(), UserError> {
    if modems.is_empty() {
        return Err(source.error(0, "there is no [[modem]]: at least one is needed"));
    }
    for (index, modem) in modems.iter().enumerate() {
        if modems.iter().take(index).any(|other| other.name == modem.name) {
            return Err(source.error(modem.at, format!("modem.name = \"{}\" is given twice: names differ", modem.name)));
        }
        let same = |other: &ScenarioModem| other.port == modem.port && modem.port.is_fixed();
        if modems.iter().take(index).any(same) {
            return Err(source.error(modem.at, format!("modem {}: its TCP address is given twice", modem.name)));
        }
    }
    Ok(())
}

/// The index of a modem's name.
fn index_of(table: &TableReader<'_>, key: &'static str, names: &[&str]) -> Result<usize, UserError> {
    let words: Vec<(&str, usize)> = names.iter().enumerate().map(|(index, name)| (*name, index)).collect();
    let takes = format!("one of {}", names.join(", "));
    table.choice(key, &words)?.ok_or_else(|| table.missing(key, takes))
}

fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or_default()
}

#[cfg(test)]
mod tests;

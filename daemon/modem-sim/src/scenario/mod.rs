//! The scenario of `scenecast modem-sim`: the channel, its modems, and the schedule of faults.

mod modem;
mod reader;
mod trouble;
mod water;

#[cfg(test)]
use modem::Make;
pub use modem::{Modem, Place};
pub use trouble::Trouble;
pub use water::Stranger;

use reader::{Reader, Source};
use scenecast_core::UserError;
use sim_channel::{ChannelConfig, LossModel, NodeId};
use std::path::Path;
use std::time::Duration;
use toml::de::DeTable;

/// Most modems and strangers together: each is a node of the channel.
const MAX_NODES: usize = 100;

#[derive(Debug)]
pub struct Scenario {
    pub seed: u64,
    pub channel: ChannelConfig,
    /// Links that lose in their own way.
    pub links: Vec<(NodeId, NodeId, LossModel)>,
    /// In the order of the file; the first is node 1.
    pub modems: Vec<Modem>,
    /// Others who talk on the same water.
    pub strangers: Vec<Stranger>,
    /// Time, modem and fault.
    pub faults: Vec<(Duration, usize, Trouble)>,
}

impl Scenario {
    /// Reads a file; errors name the file, the line, the key and the allowed values.
    pub fn load(path: &Path) -> Result<Self, UserError> {
        let text = std::fs::read_to_string(path).map_err(|e| UserError::file(path, e))?;
        Self::read(Source { path, text: &text })
    }

    fn read(source: Source<'_>) -> Result<Self, UserError> {
        let table = DeTable::parse(source.text)
            .map_err(|e| source.problem(e.span().map_or(0, |span| span.start), e.message()))?;
        let file = Reader::new(source, String::new(), 0, table.get_ref());
        let seed = file.whole("seed", 0..=u64::MAX >> 1, "")?.unwrap_or(1);
        let tables = file.tables("modem")?;
        let modems = tables.into_iter().map(|table| modem::read(table, seed)).collect::<Result<Vec<_>, _>>()?;
        check_modems(&source, &modems)?;
        let names: Vec<&str> = modems.iter().map(|modem| modem.name.as_str()).collect();
        let mut channel = match file.table("channel")? {
            Some(table) => water::read_channel(table)?,
            None => ChannelConfig::default(),
        };
        for table in file.tables("outage")? {
            channel.outages.push(water::read_outage(table, &names)?);
        }
        let links = file.tables("link")?.into_iter().map(|table| water::read_link(table, &names));
        let links = links.collect::<Result<Vec<_>, _>>()?;
        let strangers =
            file.tables("stranger")?.into_iter().map(water::read_stranger).collect::<Result<Vec<_>, _>>()?;
        let faults = file.tables("fault")?.into_iter().map(|table| trouble::read(table, &names));
        let faults = faults.collect::<Result<Vec<_>, _>>()?;
        file.finish()?;
        if modems.len() + strangers.len() > MAX_NODES {
            return Err(source.problem(0, format!("more than {MAX_NODES} modems and strangers are not allowed")));
        }
        Ok(Self { seed, channel, links, modems, strangers, faults })
    }
}

/// The node of the modem at an index.
pub fn node(index: usize) -> NodeId {
    NodeId(u8::try_from(index + 1).unwrap_or(u8::MAX))
}

fn check_modems(source: &Source<'_>, modems: &[Modem]) -> Result<(), UserError> {
    if modems.is_empty() {
        return Err(source.problem(0, "there is no [[modem]]: at least one is needed"));
    }
    for (index, modem) in modems.iter().enumerate() {
        if modems.iter().take(index).any(|other| other.name == modem.name) {
            return Err(
                source.problem(modem.at, format!("modem.name = \"{}\" is given twice: names differ", modem.name))
            );
        }
        let same = |other: &Modem| other.place == modem.place && modem.place.is_fixed();
        if modems.iter().take(index).any(same) {
            return Err(source.problem(modem.at, format!("modem {}: its TCP address is given twice", modem.name)));
        }
    }
    Ok(())
}

/// The index of a modem's name.
fn index_of(table: &Reader<'_>, key: &'static str, names: &[&str]) -> Result<usize, UserError> {
    let words: Vec<(&str, usize)> = names.iter().enumerate().map(|(index, name)| (*name, index)).collect();
    let takes = format!("one of {}", names.join(", "));
    table.choice(key, &words)?.ok_or_else(|| table.missing(key, takes))
}

fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or_default()
}

#[cfg(test)]
mod tests;

//! The checkpoint of the map that another program makes.

use super::ForeignMap;
use super::band::BandMap;
use super::ground::{ChangingGrid, Votes};
use scene_model::envelope::{Envelope, EnvelopeError};
use scenecast_config::Config;
use scenecast_protocol::map::{Cell, ClassEntry, LabelGrid, LayerDescriptor};
use serde::{Deserialize, Serialize};

const ENVELOPE: Envelope = Envelope { magic: *b"SCNLABEL", version: 2 };

/// Cells as x, y and value.
type Cells = Vec<(i32, i32, u8)>;

#[derive(Serialize, Deserialize)]
struct Content {
    lineage: u64,
    epoch: u8,
    cell_m: f64,
    last_s: Option<f64>,
    /// The last names of the sources.
    marks: [Option<String>; 2],
    votes: Votes,
    labels: Cells,
    erased: Cells,
    /// Descriptor as on the wire, levels, and cells that are no longer known.
    bands: Vec<(Vec<u8>, Cells, Cells)>,
    /// Label, and entry as on the wire.
    classes: Vec<(u8, Vec<u8>)>,
}

/// Why a checkpoint of foreign labels cannot be restored.
#[derive(Debug, thiserror::Error)]
pub enum ForeignRestoreError {
    /// The bytes are no checkpoint, of another version, or damaged.
    #[error(transparent)]
    Envelope(#[from] EnvelopeError),
    /// The checksum is right, but the content contradicts itself.
    #[error("its content is inconsistent")]
    Inconsistent,
    #[error("it was made with cells of {0} m")]
    OtherCells(f64),
}

fn pack(grid: &LabelGrid) -> Cells {
    grid.iter().map(|(cell, value)| (cell.x, cell.y, value)).collect()
}

fn unpack(cells: &Cells) -> LabelGrid {
    cells.iter().map(|&(x, y, value)| (Cell::new(x, y), value)).collect()
}

impl ForeignMap {
    pub(super) fn encode(&self, lineage: u64) -> Vec<u8> {
        let band = |map: &BandMap| (map.descriptor.to_bytes(), pack(map.levels.grid()), pack(&map.erased));
        let content = Content {
            lineage,
            epoch: self.epoch,
            cell_m: self.cell_m,
            last_s: self.last_s,
            marks: self.marks.clone(),
            votes: self.votes.clone(),
            labels: pack(self.labels.grid()),
            erased: pack(&self.erased),
            bands: self.bands.iter().map(band).collect(),
            classes: self.classes.values().map(|entry| (entry.label(), entry.to_bytes())).collect(),
        };
        ENVELOPE.seal(&postcard::to_allocvec(&content).unwrap_or_default())
    }

    /// Restores the bytes of [`crate::MapProducer::save`]; returns the map and the number of the mission that it belongs to.
    pub fn restore(config: &Config, bytes: &[u8]) -> Result<(Self, u64), ForeignRestoreError> {
        let content: Content =
            postcard::from_bytes(ENVELOPE.open(bytes)?).map_err(|_| ForeignRestoreError::Inconsistent)?;
        let mut map = Self::new(config, content.epoch);
        if content.cell_m != map.cell_m {
            return Err(ForeignRestoreError::OtherCells(content.cell_m));
        }
        for (descriptor, levels, erased) in &content.bands {
            let descriptor = LayerDescriptor::from_bytes(descriptor).ok_or(ForeignRestoreError::Inconsistent)?;
            let levels = ChangingGrid::new(unpack(levels));
            map.bands.restore(BandMap { descriptor, levels, erased: unpack(erased) });
        }
        for (label, bytes) in &content.classes {
            let entry = ClassEntry::from_bytes(*label, bytes).ok_or(ForeignRestoreError::Inconsistent)?;
            map.classes.insert(*label, entry);
        }
        (map.votes, map.last_s, map.marks) = (content.votes, content.last_s, content.marks);
        map.highest = content.labels.iter().map(|&(_, _, label)| label).max().unwrap_or(0);
        (map.labels, map.erased) = (ChangingGrid::new(unpack(&content.labels)), unpack(&content.erased));
        Ok((map, content.lineage))
    }
}

//! What the operator's settings change on the vehicle: which cells and layers it tells, and how it chooses its way.

use super::{Vehicle, VehicleOutput};
use crate::MapUpdate;
use scenecast_protocol::directive::{CellBand, RefusalReason, Settings};
use scenecast_protocol::map::{Cell, LabelGrid, LayerId, LayerMask, UNEXPLORED};
use scenecast_protocol::map_codec::Stride;
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;

/// Seconds of the budget that a backlog must exceed to go out coarse to fine where the operator asks for that and the
/// configuration names none.
const COARSE_AFTER_S: f64 = 30.0;

/// The map as the vehicle sees it, of which it may tell a part.
#[derive(Debug, Default)]
pub(super) struct Telling {
    pub(super) settings: Settings,
    /// Every cell that the scene model has a label for.
    pub(super) seen: LabelGrid,
    /// Versions of that so far.
    pub(super) version: u64,
    layers: BTreeMap<LayerId, Vec<(Cell, f64)>>,
    /// As configured: seconds of the budget, 0: never coarse.
    coarse_after_s: f64,
    is_coarse: bool,
    told_layers: LayerMask,
}

impl Telling {
    /// What survived the last run; nothing was seen yet.
    pub(super) fn restore(bytes: &[u8]) -> Self {
        Self { settings: Settings::from_bytes(bytes).unwrap_or_default(), ..Self::default() }
    }

    fn band(&self) -> CellBand {
        let configured = match (self.is_coarse, self.coarse_after_s > 0.0) {
            (true, _) => CellBand::Coarse,
            (false, true) => CellBand::CoarseToFine,
            (false, false) => CellBand::Fine,
        };
        self.settings.cells.value().unwrap_or(configured)
    }

    /// Bytes of backlog that go out coarse to fine, at so many bits a second.
    fn coarse_limit(&self, bits_per_s: u32) -> Option<usize> {
        let seconds = if self.coarse_after_s > 0.0 { self.coarse_after_s } else { COARSE_AFTER_S };
        match self.band() {
            CellBand::Fine => None,
            CellBand::CoarseToFine => Some((f64::from(bits_per_s) / 8.0 * seconds) as usize),
            CellBand::Coarse => Some(0),
        }
    }

    pub(super) fn see(&mut self, update: &MapUpdate) {
        let changed = update.cells.iter().filter(|&&(cell, label)| self.seen.set(cell, label) != label).count();
        self.version += u64::from(changed > 0);
        self.layers.clone_from(&update.layers);
    }

    /// Labels mean something else from now on.
    pub(super) fn forget(&mut self) {
        self.seen.clear();
        self.layers.clear();
        self.version += 1;
    }
}

impl Vehicle {
    /// What is told unless the operator says otherwise: only coarse cells or all, a backlog that the budget needs longer for
    /// than `coarse_after_s` seconds (0: none) coarse to fine, and these layers.
    pub fn configure_telling(&mut self, is_coarse: bool, coarse_after_s: f64, layers: LayerMask) {
        self.telling.is_coarse = is_coarse;
        self.telling.coarse_after_s = coarse_after_s;
        self.telling.told_layers = layers;
        self.follow_telling();
    }

    /// The settings in force; what they do not name is as configured.
    pub fn settings(&self) -> &Settings {
        &self.telling.settings
    }

    pub(super) fn apply_settings(&mut self, settings: &Settings, now: Instant) -> Result<(), RefusalReason> {
        settings.check().map_err(|_| RefusalReason::OutOfRange)?;
        let tells_parts = settings.cells.value().is_some() || settings.layers.value().is_some();
        if self.whole_png.is_some() && tells_parts {
            return Err(RefusalReason::OutOfRange);
        }
        let before = self.telling.settings;
        self.telling.settings = before.then(settings);
        self.durable.settings = self.telling.settings.to_bytes();
        if self.telling.settings.planner.value() != before.planner.value() {
            self.steering.set_planner(self.telling.settings.planner.value());
            self.reconsider();
        }
        self.follow_telling();
        self.tell(now);
        self.outputs.push_back(VehicleOutput::Tune(self.telling.settings));
        Ok(())
    }

    /// Which cells and layers are told follows settings, configuration and budget.
    pub(super) fn follow_telling(&mut self) {
        let limit = self.telling.coarse_limit(self.link.budget_bps());
        let is_coarse = self.telling.band() == CellBand::Coarse;
        let layers = self.telling.settings.layers.value().unwrap_or(self.telling.told_layers);
        self.link.source_mut().set_coarse_limit(limit);
        self.link.set_coarse_layers(is_coarse.then_some(0));
        self.link.select_layers(layers);
    }

    /// Hands the link what is to be told of what was seen.
    ///
    /// Where only coarse cells are told, a finer one that the link has already stays up to date: what the operator sees
    /// is never older than it looks.
    pub(super) fn tell(&mut self, now: Instant) {
        let is_coarse = self.telling.band() == CellBand::Coarse;
        let (link, telling) = (&mut self.link, &self.telling);
        let is_told = |told: &LabelGrid, cell: Cell| {
            !is_coarse || Stride::Four.on_lattice(cell).is_some() || told.get(cell) != UNEXPLORED
        };
        let cells: Vec<(Cell, u8)> = telling.seen.iter().filter(|&(cell, _)| is_told(link.map(), cell)).collect();
        link.set_map(cells, now);
        for (&id, cells) in &telling.layers {
            let cells: Vec<(Cell, f64)> =
                cells.iter().copied().filter(|&(cell, _)| is_told(link.map(), cell)).collect();
            link.set_layer(id, cells, now);
        }
    }
}

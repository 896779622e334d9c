//! The baseline: the whole PNG is sent again after each change of the map, in fragments, of which lost ones are sent again.

use crate::frames_log::{FramesLog, Repeats};
use crate::link_rig::LinkRig;
use crate::meter::Meter;
use crate::mission::{MapQuality, Mission};
use crate::virtual_time::VirtualTime;
use scenecast_config::Config;
use scenecast_core::{UserError, label_picture};
use scenecast_protocol::link::LinkStats;
use scenecast_protocol::map::{Cell, LabelGrid, Rect, StateReplica, StateSource};
use scenecast_protocol::time::Instant;
use std::collections::{BTreeMap, BTreeSet};

/// What a row is made of, after the survey.
pub(crate) struct Stream<'a> {
    pub(crate) name: &'static str,
    pub(crate) labels: &'a Meter,
    /// Both maps every half minute, then at the end.
    pub(crate) series: &'a [MapQuality],
    pub(crate) end: MapQuality,
    /// The counters of the vehicle's end, and the bits that it put on air, repeats of the modem left out and included.
    pub(crate) stats: &'a LinkStats,
    pub(crate) sent_bits: u64,
    pub(crate) bits_on_air: u64,
    pub(crate) frames: &'a FramesLog,
    pub(crate) repeats: Repeats,
}

/// Bare links beside a mission that carry its map as whole PNGs.
///
/// Frames, acknowledgements, repair of lost parts, turns, budget and shares are those of the mission, and the channel has the
/// same losses. Orders, fixes, images and layers are not sent.
pub(crate) struct Baseline {
    rig: LinkRig<WholeSource, WholeReplica>,
    /// The version of the vehicle's map that the source has.
    version: u64,
    labels: Meter,
    series: Vec<MapQuality>,
}

impl Baseline {
    /// Links for a mission with this configuration and seed.
    pub(crate) fn new(config: &Config, seed: u64) -> Result<Self, UserError> {
        let rig = LinkRig::new(config, WholeSource::default(), seed)?;
        Ok(Self { rig, version: 0, labels: Meter::default(), series: Vec::new() })
    }

    /// Follows the mission to its present time, and takes its map.
    pub(crate) fn follow(&mut self, mission: &Mission) {
        let (vehicle, now) = (mission.vehicle(), mission.now());
        self.rig.run_until(now, |_| false);
        if vehicle.map_version() != self.version {
            self.version = vehicle.map_version();
            self.rig.vehicle.end_mut().source_mut().replace(vehicle.map().clone());
        }
        self.rig.status = vehicle.status(now);
        let operator = self.rig.view().map(|view| view.replica());
        let versions = (self.version, operator.map_or(0, WholeReplica::version));
        let empty = LabelGrid::default();
        self.labels.look(vehicle.map(), operator.map_or(&empty, WholeReplica::shown), versions, now);
        if let Some(sample) = mission.quality_series().get(self.series.len()) {
            self.series.push(self.quality(mission, sample));
        }
    }

    /// A sample of the mission, with the operator's map of these links.
    fn quality(&self, mission: &Mission, sample: &MapQuality) -> MapQuality {
        let view = self.rig.view();
        let map = view.map(|view| view.replica().shown().clone()).unwrap_or_default();
        let report = view.and_then(|view| view.status()).map(|(status, _)| status);
        MapQuality {
            operator: mission.shown_information(&map, report),
            agreement: self.labels.agreement(),
            age_s: self.labels.age_s(mission.now()),
            ..*sample
        }
    }

    /// The measurements after the survey.
    pub(crate) fn stream(&self, mission: &Mission) -> Stream<'_> {
        let audit = self.rig.vehicle.audit();
        Stream {
            name: "whole-png",
            labels: &self.labels,
            series: &self.series,
            end: self.quality(mission, &mission.quality()),
            stats: self.rig.vehicle.end().stats(),
            sent_bits: audit.total_bits(),
            bits_on_air: self.rig.bits_on_air()[0],
            frames: self.rig.frames(),
            repeats: Repeats::of(self.rig.view(), self.rig.frames()),
        }
    }
}

/// Bytes before those of a fragment: the number of the picture, the place of the first byte, and whether it is the last one.
const HEAD: usize = 9;

/// Sends the newest grid once the one before has arrived.
#[derive(Debug, Default)]
pub struct WholeSource {
    grid: LabelGrid,
    is_changed: bool,
    number: u32,
    picture: Vec<u8>,
    /// Fragments that wait, as places and lengths, and those on the air.
    waiting: Vec<(usize, usize)>,
    flying: BTreeSet<(usize, usize)>,
    next: usize,
}

impl WholeSource {
    /// Sets the labels of cells.
    pub fn set(&mut self, cells: &[(Cell, u8)]) {
        self.grid.extend(cells.iter().copied());
        self.is_changed = true;
    }

    /// Sets all labels; cells that the grid does not have lose theirs.
    pub fn replace(&mut self, grid: LabelGrid) {
        self.grid = grid;
        self.is_changed = true;
    }

    fn is_sent(&self) -> bool {
        self.next == self.picture.len() && self.waiting.is_empty() && self.flying.is_empty()
    }

    fn begin(&mut self) {
        if self.is_sent() && std::mem::take(&mut self.is_changed) {
            self.number += 1;
            self.picture = encode(&self.grid).unwrap_or_default();
            self.next = 0;
        }
    }
}

impl StateSource for WholeSource {
    type Carried = (usize, usize);

    fn next_chunk(&mut self, room: usize, _now: Instant) -> Option<(Vec<u8>, Self::Carried)> {
        self.begin();
        let room = room.checked_sub(HEAD).filter(|&room| room > 0)?;
        let lost = self.waiting.pop();
        let (place, whole) = lost.unwrap_or((self.next, self.picture.len() - self.next));
        let length = whole.min(room);
        if length == 0 {
            return None;
        }
        if lost.is_some() && length < whole {
            // The surface has refused a fragment that counts as lost, or will do so, and may get it in parts.
            self.waiting.push((place + length, whole - length));
        }
        self.next = self.next.max(place + length);
        self.flying.insert((place, length));
        let is_last = place + length == self.picture.len();
        let head = [&self.number.to_be_bytes()[..], &(place as u32).to_be_bytes(), &[u8::from(is_last)]].concat();
        Some(([&head, &self.picture[place..place + length]].concat(), (place, length)))
    }

    fn handle_fate(&mut self, carried: Self::Carried, delivered: bool, _now: Instant) {
        if self.flying.remove(&carried) && !delivered {
            self.waiting.push(carried);
        }
    }

    fn handle_peer_restart(&mut self, _now: Instant) {
        (self.picture, self.next, self.is_changed) = (Vec::new(), 0, true);
        self.waiting.clear();
        self.flying.clear();
    }

    fn backlog_bytes(&self) -> usize {
        let more = if self.is_sent() && self.is_changed { 1000 } else { 0 };
        self.picture.len() - self.next + self.waiting.iter().map(|(_, length)| length).sum::<usize>() + more
    }

    fn is_converged(&self) -> bool {
        self.is_sent() && !self.is_changed
    }

    fn digest(&self) -> u16 {
        0
    }
}

/// Shows the last grid of which every fragment is here.
#[derive(Debug, Default)]
pub struct WholeReplica {
    shown: LabelGrid,
    number: u32,
    fragments: BTreeMap<usize, Vec<u8>>,
    length: Option<usize>,
    version: u64,
}

impl WholeReplica {
    pub fn shown(&self) -> &LabelGrid {
        &self.shown
    }
}

impl StateReplica for WholeReplica {
    fn apply(&mut self, _number: u64, chunk: &[u8], _now: Instant) -> bool {
        let Some((&[a, b, c, d, e, f, g, h, last], bytes)) = chunk.split_first_chunk::<HEAD>() else { return false };
        let (number, place) = (u32::from_be_bytes([a, b, c, d]), u32::from_be_bytes([e, f, g, h]) as usize);
        if number != self.number {
            (self.number, self.length) = (number, None);
            self.fragments.clear();
        }
        self.fragments.insert(place, bytes.to_vec());
        if last != 0 {
            self.length = Some(place + bytes.len());
        }
        let held: usize = self.fragments.values().map(Vec::len).sum();
        if self.length == Some(held) {
            let picture: Vec<u8> = self.fragments.values().flatten().copied().collect();
            if let Some(grid) = decode(&picture) {
                self.shown = grid;
                self.version += 1;
            }
        }
        true
    }

    fn advance_base(&mut self, _horizon: u64) {}

    fn base_digest(&self) -> u16 {
        0
    }

    fn version(&self) -> u64 {
        self.version
    }

    fn take(&mut self) -> Self {
        let version = self.version + 1;
        std::mem::replace(self, Self { version, ..Self::default() })
    }
}

/// The south-west cell, two numbers of 32 bits, then the PNG; `None` for a grid that is too large.
fn encode(grid: &LabelGrid) -> Option<Vec<u8>> {
    let bounds = grid.bounds().unwrap_or(Rect { x: 0, y: 0, width: 1, height: 1 });
    let png = label_picture::encode_within(grid, bounds).ok()?;
    Some([&bounds.x.to_be_bytes()[..], &bounds.y.to_be_bytes(), &png].concat())
}

fn decode(picture: &[u8]) -> Option<LabelGrid> {
    let (x, rest) = picture.split_first_chunk()?;
    let (y, png) = rest.split_first_chunk()?;
    label_picture::decode(png, i32::from_be_bytes(*x), i32::from_be_bytes(*y)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link_rig::LinkRig;
    use crate::virtual_time::VirtualTime;
    use std::time::Duration;

    #[test]
    fn a_grid_around_the_origin_arrives_in_spite_of_losses() {
        let sets = ["channel.loss=0.3", "link.frame_bytes=64"].map(str::to_owned);
        let config = scenecast_config::load(None, &sets).unwrap();
        let mut rig = LinkRig::<_, WholeReplica>::new(&config, WholeSource::default(), 5).unwrap();
        let label = |i: i32| (i * i % 7) as u8 + 1;
        let grid: LabelGrid = (0..900).map(|i| (Cell::new(i % 30 - 20, i / 30 - 9), label(i))).collect();
        let shows = |rig: &LinkRig<_, WholeReplica>, grid: &LabelGrid| {
            rig.view().is_some_and(|view| view.replica().shown() == grid)
        };
        let smaller: LabelGrid = grid.iter().filter(|(cell, _)| cell.x < 3).collect();
        for grid in [grid, smaller] {
            rig.vehicle.end_mut().source_mut().replace(grid.clone());
            let until = rig.now + Duration::from_secs(120);
            assert!(rig.run_until(until, |rig| shows(rig, &grid)), "{} cells have not arrived", grid.explored());
        }
    }
}

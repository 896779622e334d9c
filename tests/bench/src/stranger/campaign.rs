//! Dives that a stranger attacks in bursts, with a quiet time after each, until he has transmitted enough frames.

use super::Protection;
use super::account::{AttackKind, Judged, LinkJudgement};
use super::ends::AttackedEnds;
use super::forger::{ForgedFrame, Forger};
use super::state::{SurfaceState, VehicleState};
use scenecast_protocol::link::DropReason;
use scenecast_protocol::mac::Access;
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_rehearsal::VirtualTime;
use scenecast_rehearsal::link_bench::Summary;
use serde::Serialize;
use sim_channel::RandomStream;
use std::collections::BTreeMap;
use std::time::Duration;

/// Time in which the link should have recovered after the last forged frame, and after which a wait is given up.
const RECOVERY_S: f64 = 60.0;
const GIVE_UP_S: f64 = 600.0;
/// Bursts of a dive; the next dive begins with new processes and a new map.
const BURSTS: usize = 12;
/// The most frames of a burst.
const MAX_BURST: usize = 600;

/// How the frames of one kind were judged.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct KindFigures {
    pub kind: AttackKind,
    pub frames: u64,
    /// Frames by judgement at the surface.
    pub surface: BTreeMap<String, u64>,
    /// Frames by judgement at the vehicle.
    pub vehicle: BTreeMap<String, u64>,
}

/// A burst after which the link needed more than 60 s.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LateRecovery {
    /// Seconds from the last forged frame; 600 if the wait was given up.
    pub seconds: f64,
    pub dive: u64,
    /// Number of the burst in its dive, from 0.
    pub burst: usize,
    pub access: &'static str,
    /// The state of the link at the start of the burst.
    pub state: &'static str,
    /// The only kind of frame in the burst; `None` for a mixture of all.
    pub kind: Option<AttackKind>,
    /// The state in which the wait was given up; empty if it was not.
    pub given_up: String,
}

/// The figures of one protection.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StrangerFigures {
    pub protection: Protection,
    pub seed: u64,
    /// The number of frames of the stranger.
    pub frames: u64,
    pub bursts: usize,
    pub kinds: Vec<KindFigures>,
    /// Cells of the operator's map that changed by a frame of the stranger.
    pub cells_changed: u64,
    /// Cells that changed by authentic frames that the stranger delivered first.
    pub cells_relayed: u64,
    /// Frames that failed their CRC, tag or decoder and changed the state of an end.
    pub invalid_changes: u64,
    /// Frames that did not decode, each the third of its kind, after which the surface began a new run.
    pub divergences: u64,
    /// Copies of ended runs that were lost without being overtaken.
    pub erased_maps: u64,
    /// The number of orders that were applied.
    pub orders_applied: u64,
    /// Applied orders that the operator did not give.
    pub foreign_orders: u64,
    /// Applied orders that had been applied before or were replaced.
    pub repeated_orders: u64,
    /// Authentic numbered frames that arrived unharmed.
    pub authentic_frames: u64,
    /// The number of them by their judgement.
    pub authentic: BTreeMap<String, u64>,
    /// Share of them that was refused and is no duplicate.
    pub authentic_refused: f64,
    /// The same share of dives without the stranger.
    pub authentic_refused_control: f64,
    /// Judgements of authentic hellos. An answer to a replayed hello is refused: it costs airtime only.
    pub hellos: BTreeMap<String, u64>,
    /// Times from the last forged frame until the maps and the orders agreed, seconds.
    pub recovery_mean_s: f64,
    pub recovery_p95_s: f64,
    pub recovery_max_s: f64,
    /// Bursts after which the link needed more than 60 s, the longest first.
    pub late_recoveries: Vec<LateRecovery>,
    /// Bursts after which the link had not recovered within 600 s.
    pub failed_recoveries: usize,
    /// The same mean without the stranger.
    pub recovery_control_s: f64,
}

impl StrangerFigures {
    /// Largest share of authentic frames refused above that of the control.
    const MAX_REFUSED: f64 = 0.01;

    /// The promises that were broken, for people.
    pub fn broken_promises(&self) -> Vec<String> {
        let is_keyed = self.protection != Protection::None;
        let is_all = self.protection == Protection::All;
        let refused = self.authentic_refused - self.authentic_refused_control;
        let promises = [
            (is_all && self.cells_changed > 0, format!("{} cells of the map were changed", self.cells_changed)),
            (is_keyed && self.foreign_orders > 0, format!("{} foreign orders were applied", self.foreign_orders)),
            (is_all && self.repeated_orders > 0, format!("{} orders were applied again", self.repeated_orders)),
            (is_all && refused > Self::MAX_REFUSED, format!("{refused:.4} more of the authentic frames were refused")),
            (self.invalid_changes > 0, format!("{} invalid frames changed the state", self.invalid_changes)),
            (self.erased_maps > 0, format!("{} earlier maps were erased", self.erased_maps)),
            (self.failed_recoveries > 0, format!("{} bursts were not recovered from", self.failed_recoveries)),
        ];
        promises.into_iter().filter(|(is_broken, _)| *is_broken).map(|(_, text)| text).collect()
    }
}

/// Attacks both ends with `frames` frames. `progress` receives the share that was transmitted.
pub fn measure_stranger(
    protection: Protection,
    frames: u64,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> StrangerFigures {
    let mut attack = Campaign::new(protection, seed, true);
    let mut control = Campaign::new(protection, seed, false);
    let mut dive = 0;
    while attack.frames < frames {
        attack.dive(dive, frames, progress);
        // The same restarts in the same kind of access, without the stranger.
        control.dive(dive, frames, &mut |_| ());
        dive += 1;
    }
    attack.figures(&control)
}

/// Judgements of the frames of one kind: at the surface, at the vehicle.
type ByEnd = [Judged; 2];

struct Campaign {
    protection: Protection,
    seed: u64,
    /// Whether the stranger transmits; otherwise he only counts.
    is_attacked: bool,
    forger: Forger,
    rng: RandomStream,
    frames: u64,
    judged: BTreeMap<AttackKind, ByEnd>,
    authentic: [Judged; 2],
    recoveries: Vec<f64>,
    late: Vec<LateRecovery>,
    cells_changed: u64,
    cells_relayed: u64,
    invalid_changes: u64,
    divergences: u64,
    erased_maps: u64,
    orders: [u64; 3],
    /// The operator's map before the next frame of the stranger, and its version.
    shown: (u64, LabelGrid),
}

impl Campaign {
    fn new(protection: Protection, seed: u64, is_attacked: bool) -> Self {
        Self {
            protection,
            seed,
            is_attacked,
            forger: Forger::new(RandomStream::new(seed, &[2])),
            rng: RandomStream::new(seed, &[3]),
            frames: 0,
            judged: BTreeMap::new(),
            authentic: Default::default(),
            recoveries: Vec::new(),
            late: Vec::new(),
            cells_changed: 0,
            cells_relayed: 0,
            invalid_changes: 0,
            divergences: 0,
            erased_maps: 0,
            orders: [0; 3],
            shown: (0, LabelGrid::default()),
        }
    }

    /// A dive of both ends, until `frames` were transmitted in all.
    fn dive(&mut self, number: u64, frames: u64, progress: &mut dyn FnMut(f64)) {
        const ACCESS: [Access; 4] =
            [Access::Shared, Access::Shared, Access::ModemOwned { pool_frames: 8 }, Access::Polled];
        let access = ACCESS[(number % 4) as usize];
        let mut ends = AttackedEnds::new(self.protection, access, RandomStream::new(self.seed, &[4, number]));
        self.forger.end_run();
        for burst in 0..BURSTS {
            if self.frames >= frames {
                break;
            }
            let (state, kind) = self.burst(&mut ends, burst, frames);
            let (seconds, given_up) = self.quiet(&mut ends);
            if seconds > RECOVERY_S {
                let access = match access {
                    Access::Shared => "shared",
                    Access::ModemOwned { .. } => "modem-owned",
                    Access::Polled => "polled",
                    Access::FullDuplex => "full-duplex",
                };
                self.late.push(LateRecovery { seconds, dive: number, burst, access, state, kind, given_up });
            }
            progress(self.frames as f64 / frames as f64);
        }
        for (sums, counts) in self.authentic.iter_mut().zip(&ends.authentic) {
            counts.iter().for_each(|(&judgement, count)| *sums.entry(judgement).or_default() += count);
        }
        self.erased_maps += ends.erased_maps;
        let counts = [ends.orders.applications, ends.orders.foreign, ends.orders.repeated];
        self.orders.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
    }

    /// A burst in one of the states of the link; returns the state and the only kind of its frames.
    fn burst(&mut self, ends: &mut AttackedEnds, number: usize, frames: u64) -> (&'static str, Option<AttackKind>) {
        const STATES: [&str; 5] =
            ["before contact", "in contact", "out of range", "vehicle restarted", "surface restarted"];
        let state = if number == 0 { 0 } else { 1 + self.rng.below(4) };
        match state {
            2 => ends.is_out_of_range = true,
            3 => ends.restart_vehicle(),
            4 => ends.restart_surface(),
            _ => {}
        }
        if state >= 3 {
            self.forger.end_run();
        }
        if state > 0 {
            ends.survey(40);
        }
        let length = (1 + self.rng.below(MAX_BURST)).min((frames - self.frames) as usize);
        let pause_ms = 20 + self.rng.below(400);
        // Some bursts meet a link that is at rest. A single kind takes the link farther than a mixture of all, in which each
        // new run ends the forgeries for the one before.
        let is_busy = self.rng.below(3) > 0;
        let at = self.rng.below(2 * AttackKind::ALL.len());
        let kind = AttackKind::ALL.get(at).copied();
        let kinds = kind.as_ref().map_or(&AttackKind::ALL[..], std::slice::from_ref);
        for step in 0..length {
            self.forger.overhear(std::mem::take(&mut ends.overheard));
            self.transmit(ends, kinds);
            ends.run(Duration::from_millis(1 + self.rng.below(pause_ms) as u64));
            if is_busy && step % 20 == 0 {
                ends.survey(16);
            }
            if is_busy && step % 70 == 0 {
                ends.issue();
            }
        }
        ends.is_out_of_range = false;
        (STATES[state], kind)
    }

    /// One frame of the stranger at one of the ends.
    fn transmit(&mut self, ends: &mut AttackedEnds, kinds: &[AttackKind]) {
        let mut frame = self.forger.forge(kinds, ends.shown());
        // Two flips of one bit leave a frame unchanged, too.
        if ends.is_untaken(&frame.bytes) {
            frame.kind = AttackKind::Relayed;
        } else if frame.kind == AttackKind::Relayed {
            frame.kind = AttackKind::Replayed;
        }
        self.frames += 1;
        if !self.is_attacked {
            return;
        }
        let judgement = match frame.to_vehicle {
            true => {
                let before = VehicleState::of(&ends.vehicle);
                let judgement = ends.deliver(true, &frame.bytes);
                ends.apply_orders();
                self.invalid_changes += u64::from(judgement.is_invalid() && before != VehicleState::of(&ends.vehicle));
                judgement
            }
            false => self.transmit_to_surface(ends, &frame),
        };
        let judged = self.judged.entry(frame.kind).or_default();
        *judged[usize::from(frame.to_vehicle)].entry(judgement).or_default() += 1;
    }

    fn transmit_to_surface(&mut self, ends: &mut AttackedEnds, frame: &ForgedFrame) -> LinkJudgement {
        let before = SurfaceState::of(&ends.surface);
        if self.shown.0 != before.map_version {
            self.shown = (before.map_version, ends.shown().cloned().unwrap_or_default());
        }
        let judgement = ends.deliver(false, &frame.bytes);
        let after = SurfaceState::of(&ends.surface);
        if after.map_version != before.map_version {
            let now = ends.shown().cloned().unwrap_or_default();
            let cells = difference(&self.shown.1, &now);
            let is_relayed = frame.kind == AttackKind::Relayed;
            *(if is_relayed { &mut self.cells_relayed } else { &mut self.cells_changed }) += cells;
            self.shown = (after.map_version, now);
        }
        if judgement.is_invalid() && before != after {
            let is_divergence =
                judgement == LinkJudgement::Refused(DropReason::Undecodable) && after.runs > before.runs;
            *(if is_divergence { &mut self.divergences } else { &mut self.invalid_changes }) += 1;
        }
        judgement
    }

    /// The operator gives an order after the last forged frame; then the link has time to recover.
    /// Returns the seconds that it took, and the state in which the wait was given up.
    fn quiet(&mut self, ends: &mut AttackedEnds) -> (f64, String) {
        ends.issue();
        let began = ends.now();
        let mut checked = began;
        let until = began + Duration::from_secs_f64(GIVE_UP_S);
        let mut is_recovered = false;
        while !is_recovered && ends.now() < until {
            is_recovered = ends.run_until((ends.now() + Duration::from_secs(2)).min(until), |ends| {
                // Comparing maps is slow, so it is done twice a second.
                if ends.now().since(checked) < Duration::from_millis(500) {
                    return false;
                }
                checked = ends.now();
                ends.is_recovered()
            });
            ends.answer_question();
        }
        let time = ends.now().since(began).as_secs_f64();
        let given_up = if is_recovered { String::new() } else { ends.facts() };
        self.recoveries.push(if is_recovered { time } else { f64::INFINITY });
        self.forger.overhear(std::mem::take(&mut ends.overheard));
        ends.run(Duration::from_secs(1 + self.rng.below(20) as u64));
        (time, given_up)
    }

    fn figures(self, control: &Self) -> StrangerFigures {
        let kinds = AttackKind::ALL.into_iter().filter_map(|kind| {
            let [surface, vehicle] = self.judged.get(&kind)?;
            let frames = surface.values().chain(vehicle.values()).sum();
            Some(KindFigures { kind, frames, surface: named(surface), vehicle: named(vehicle) })
        });
        let kinds = kinds.collect();
        let (authentic_frames, authentic_refused) = refused(&self.authentic[0]);
        let finite = |times: &[f64]| times.iter().map(|time| time.min(GIVE_UP_S)).collect::<Vec<_>>();
        let times = finite(&self.recoveries);
        let mean = |times: &[f64]| times.iter().sum::<f64>() / times.len().max(1) as f64;
        let mut late_recoveries = self.late;
        late_recoveries.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
        let sorted = Summary::of(times.clone());
        StrangerFigures {
            protection: self.protection,
            seed: self.seed,
            frames: self.frames,
            bursts: self.recoveries.len(),
            kinds,
            cells_changed: self.cells_changed,
            cells_relayed: self.cells_relayed,
            invalid_changes: self.invalid_changes,
            divergences: self.divergences,
            erased_maps: self.erased_maps,
            orders_applied: self.orders[0],
            foreign_orders: self.orders[1],
            repeated_orders: self.orders[2],
            authentic_frames,
            authentic: named(&self.authentic[0]),
            hellos: named(&self.authentic[1]),
            authentic_refused,
            authentic_refused_control: refused(&control.authentic[0]).1,
            recovery_mean_s: mean(&times),
            recovery_p95_s: sorted.p95(),
            recovery_max_s: sorted.quantile(1.0),
            late_recoveries,
            failed_recoveries: self.recoveries.iter().filter(|time| time.is_infinite()).count(),
            recovery_control_s: mean(&finite(&control.recoveries)),
        }
    }
}

fn named(judged: &Judged) -> BTreeMap<String, u64> {
    judged.iter().map(|(judgement, count)| (judgement.name(), *count)).collect()
}

/// The number of frames, and the share of them that was refused. A duplicate is none of these: its content is here.
fn refused(judged: &Judged) -> (u64, f64) {
    let all: u64 = judged.values().sum();
    let refused: u64 = judged.iter().filter(|(judgement, _)| !judgement.is_kept()).map(|(_, count)| count).sum();
    (all, refused as f64 / all.max(1) as f64)
}

/// The number of cells with different labels.
fn difference(before: &LabelGrid, after: &LabelGrid) -> u64 {
    let changed = before.iter().filter(|&(cell, label)| after.get(cell) != label).count();
    let is_new = |cell: Cell| before.get(cell) == 0;
    (changed + after.iter().filter(|&(cell, _)| is_new(cell)).count()) as u64
}

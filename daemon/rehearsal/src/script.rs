//! The scripted operator of a rehearsal.

use scenecast_core::Area;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_surface::{FenceOrder, LimitsOrder, RequestKind, Surface};
use std::collections::BTreeMap;
use std::collections::VecDeque;

/// An act of the scripted operator.
#[derive(Debug, Clone, PartialEq)]
enum Act {
    /// Favours the label with this rank by area (0 = the largest) and avoids the largest one.
    Favour(usize),
    /// Requests an image of the label with this rank by area.
    Show(usize),
    Fence(FenceOrder),
    Limits(LimitsOrder),
}

/// Acts at set times; an act that needs a label waits until the operator's map has it.
#[derive(Debug)]
pub struct Script {
    acts: VecDeque<(Instant, Act)>,
}

impl Script {
    /// Favours two labels and requests three images during a survey of `duration_s`.
    pub fn of_survey(duration_s: f64) -> Self {
        let acts = [
            (0.20, Act::Show(0)),
            (0.25, Act::Favour(1)),
            (0.40, Act::Show(1)),
            (0.55, Act::Show(2)),
            (0.60, Act::Favour(2)),
        ];
        Self { acts: acts.map(|(share, act)| (Instant::from_secs_f64(share * duration_s), act)).into() }
    }

    /// The same acts, a fence a tenth inside of `area` with a keep-out in its middle, and a distance limit
    /// of half the survey's path.
    pub fn fenced(duration_s: f64, area: Area, speed_m_s: f64) -> Self {
        let mut script = Self::of_survey(duration_s);
        let (w, h) = area.size_m();
        let at = |x: f64, y: f64| [area.west + x * w, area.south + y * h];
        let inside = vec![at(0.0, 0.0), at(0.9, 0.0), at(0.9, 0.6), at(0.6, 0.9), at(0.0, 0.9)];
        let wreck = vec![at(0.4, 0.4), at(0.55, 0.4), at(0.5, 0.55)];
        let fence = FenceOrder { fence: Some(inside), keep_outs: vec![wreck], return_point: Some(at(0.2, 0.2)) };
        let limits = LimitsOrder {
            distance_m: Some((0.5 * duration_s * speed_m_s).max(1.0)),
            silence_s: Some(600.0),
            on_silence: Some("return".to_owned()),
            ..LimitsOrder::default()
        };
        script.acts.push_front((Instant::from_secs_f64(0.04 * duration_s), Act::Limits(limits)));
        script.acts.push_front((Instant::from_secs_f64(0.02 * duration_s), Act::Fence(fence)));
        script
    }

    /// The script of an operator without acts.
    pub fn none() -> Self {
        Self { acts: VecDeque::new() }
    }

    /// The time of the next act.
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.acts.front().map(|(at, _)| *at)
    }

    /// Performs the acts that are due; an act whose label is not on the map yet is retried ten seconds later.
    pub fn handle_timeout(&mut self, surface: &mut Surface, vehicle: Address, now: Instant) {
        while self.acts.front().is_some_and(|(at, _)| *at <= now) {
            let Some((at, act)) = self.acts.pop_front() else { return };
            if !perform(&act, surface, vehicle, now) {
                let later = at.max(now) + std::time::Duration::from_secs(10);
                self.acts.push_back((later, act));
                self.acts.make_contiguous().sort_by_key(|(at, _)| *at);
            }
        }
    }
}

fn perform(act: &Act, surface: &mut Surface, vehicle: Address, now: Instant) -> bool {
    let labels = surface.labels(vehicle).unwrap_or_default();
    let mut by_area: Vec<(u8, u32)> = labels.into_iter().collect();
    by_area.sort_by_key(|&(label, cells)| (std::cmp::Reverse(cells), label));
    let ranked = |rank: usize| by_area.get(rank).map(|&(label, _)| label);
    match act {
        Act::Fence(fence) => surface.set_fence(vehicle, fence, now).is_ok(),
        Act::Limits(limits) => surface.set_limits(vehicle, limits, now).is_ok(),
        Act::Favour(rank) => {
            let (Some(favoured), Some(largest)) = (ranked(*rank), ranked(0)) else { return false };
            let weights = BTreeMap::from([(largest, -0.3), (favoured, 0.8)]);
            surface.set_utility(vehicle, &weights, (0.2, 0.0), now).is_ok()
        }
        Act::Show(rank) => {
            let Some(label) = ranked(*rank) else { return false };
            surface.request_exemplar(vehicle, label, RequestKind::Another, now).is_ok()
        }
    }
}

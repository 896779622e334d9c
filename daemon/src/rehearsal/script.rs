//! The scripted operator of a rehearsal.

use crate::asv::Surface;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use std::collections::BTreeMap;
use std::collections::VecDeque;

/// What the scripted operator does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Act {
    /// Favours the label with this rank by area (0 = the largest) and turns from the largest.
    Favour(usize),
    /// Asks for an image of the label with this rank.
    Show(usize),
}

/// Acts at set times, each as soon as the operator's map lets him.
#[derive(Debug)]
pub struct Script {
    acts: VecDeque<(Instant, Act)>,
}

impl Script {
    /// Favours two labels and asks for three images in the course of a survey of `duration_s`.
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

    /// An operator who only looks.
    pub fn none() -> Self {
        Self { acts: VecDeque::new() }
    }

    /// When the next act is due.
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.acts.front().map(|(at, _)| *at)
    }

    /// Does what is due; what the map does not allow yet is tried again ten seconds later.
    pub fn handle_timeout(&mut self, surface: &mut Surface, vehicle: Address, now: Instant) {
        while let Some(&(at, act)) = self.acts.front().filter(|(at, _)| *at <= now) {
            self.acts.pop_front();
            if !perform(act, surface, vehicle, now) {
                let later = at.max(now) + std::time::Duration::from_secs(10);
                self.acts.push_back((later, act));
                self.acts.make_contiguous().sort_by_key(|(at, _)| *at);
            }
        }
    }
}

fn perform(act: Act, surface: &mut Surface, vehicle: Address, now: Instant) -> bool {
    let labels = surface.labels(vehicle).unwrap_or_default();
    let mut by_area: Vec<(u8, u32)> = labels.into_iter().collect();
    by_area.sort_by_key(|&(label, cells)| (std::cmp::Reverse(cells), label));
    let ranked = |rank: usize| by_area.get(rank).map(|&(label, _)| label);
    match act {
        Act::Favour(rank) => {
            let (Some(favoured), Some(largest)) = (ranked(rank), ranked(0)) else { return false };
            let weights = BTreeMap::from([(largest, -0.3), (favoured, 0.8)]);
            surface.set_utility(vehicle, &weights, (0.2, 0.0), now).is_ok()
        }
        Act::Show(rank) => {
            let Some(label) = ranked(rank) else { return false };
            surface.request_exemplar(vehicle, label, now).is_ok()
        }
    }
}

//! What a planned path is for, by the operator's map: the reason of each leg, and the cells that it leads to.

use crate::state::{FavouredTime, FirstTarget, LegReason, PlanAims, PlanLeg};
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::wire::Intent;
use std::collections::BTreeMap;

/// A place in the map frame, metres.
pub type Place = (f64, f64);

/// What the vehicle says of a leg.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// The purpose of an adaptive plan; `None` for the legs of a survey.
    Survey(Option<Intent>),
    Return,
}

/// The sea floor as the operator's map has it, and what is favoured on it.
pub struct Ground<'a> {
    pub map: &'a LabelGrid,
    pub cell_m: f64,
    /// The weight of each label, -1 to 1.
    pub weight: &'a dyn Fn(u8) -> f64,
    /// Metres around the vehicle that its camera sees at any heading.
    pub reach_m: f64,
}

/// Reason and label; `None` if a stretch gains nothing by itself.
type Reason = Option<(LegReason, Option<u8>)>;

/// A short straight part of a path.
struct Stretch {
    to: Place,
    /// Metres along the path at its end.
    along_m: f64,
    reason: Reason,
}

/// The part of what the camera sees from which a favoured label is a reason.
const FAVOURED: f64 = 0.15;
/// The part of what the camera sees from which unseen floor is a reason.
const UNSEEN: f64 = 0.4;
/// Cells along each side of a view that are looked at.
const SAMPLES: i32 = 9;
/// Cells along each side of a view that are lit at most, and rows of them.
const MAX_CELLS: i32 = 256;
const MAX_ROWS: usize = 256;
/// The longest path that is looked at, metres: a plan is as long as its seven legs.
const MAX_M: f64 = 2000.0;

/// The least time over which the part of it over favoured floor is told, seconds.
const MIN_SPAN_S: f64 = 30.0;

impl Ground<'_> {
    /// The part of the time of a track, after `since_s` and before, that the vehicle was over floor of a favoured label. `track` has
    /// seconds, metres east and metres north.
    pub fn favoured_time(&self, track: impl Iterator<Item = (f64, f64, f64)>, since_s: f64) -> Option<FavouredTime> {
        let is_favoured = |at: Place| (self.weight)(self.map.get(self.cell(at))) > 0.0;
        let mut spans = [[0.0; 2]; 2];
        let mut last: Option<(f64, Place)> = None;
        for (at_s, east, north) in track {
            if let Some((from_s, from)) = last.replace((at_s, (east, north))) {
                let middle = ((from.0 + east) / 2.0, (from.1 + north) / 2.0);
                let span = &mut spans[usize::from(from_s < since_s)];
                span[0] += at_s - from_s;
                span[1] += if is_favoured(middle) { at_s - from_s } else { 0.0 };
            }
        }
        let share = |[all, favoured]: [f64; 2]| (all >= MIN_SPAN_S).then(|| (favoured / all * 1000.0).round() / 1000.0);
        let [since, before] = spans.map(share);
        Some(FavouredTime { since_s, share: since?, before })
    }

    fn cell(&self, (east, north): Place) -> Cell {
        let index = |metres: f64| (metres / self.cell_m).floor() as i32;
        Cell::new(index(east), index(north))
    }

    /// What a path is for, of which each leg has an end and a purpose. The vehicle leaves `from` at `since_s` with `speed_m_s`.
    pub fn aims(&self, from: Place, legs: &[(Place, Purpose)], since_s: f64, speed_m_s: f64) -> PlanAims {
        let mut stretches = self.stretches(from, legs);
        let first = first_target(from, &stretches);
        let targets = first.as_ref().map_or_else(Vec::new, |(reason, at, _)| self.targets(*reason, *at, &stretches));
        follow_to_reason(&mut stretches, legs);
        let first = first.map(|((reason, label), at, along_m)| FirstTarget {
            reason,
            label,
            at: rounded(at),
            along_m: tenths(along_m),
            arrival_s: tenths(since_s + along_m / speed_m_s.max(0.01)),
        });
        PlanAims { legs: joined(from, &stretches), first, targets }
    }

    fn stretches(&self, from: Place, legs: &[(Place, Purpose)]) -> Vec<Stretch> {
        let step_m = self.reach_m.max(self.cell_m);
        let (mut at, mut along_m) = (from, 0.0);
        let mut stretches = Vec::new();
        for &(to, purpose) in legs {
            let (metres, start) = (distance(at, to), at);
            let parts = ((metres / step_m).round().max(1.0)) as usize;
            if along_m + metres > MAX_M {
                break;
            }
            for part in 1..=parts {
                let share = part as f64 / parts as f64;
                at = (start.0 + share * (to.0 - start.0), start.1 + share * (to.1 - start.1));
                along_m += metres / parts as f64;
                stretches.push(Stretch { to: at, along_m, reason: self.reason(at, purpose) });
            }
        }
        stretches
    }

    /// Why the vehicle looks at a place.
    fn reason(&self, at: Place, purpose: Purpose) -> Reason {
        let intent = match purpose {
            Purpose::Return => return Some((LegReason::Return, None)),
            Purpose::Survey(Some(Intent::Destination)) => return Some((LegReason::Destination, None)),
            Purpose::Survey(None) => return Some((LegReason::Survey, None)),
            Purpose::Survey(Some(intent)) => intent,
        };
        let (mut unseen, mut all) = (0.0, 0.0);
        let mut favoured: BTreeMap<u8, f64> = BTreeMap::new();
        for cell in self.view(at, SAMPLES) {
            let label = self.map.get(cell);
            all += 1.0;
            unseen += f64::from(u8::from(label == 0));
            if label != 0 && (self.weight)(label) > 0.0 {
                *favoured.entry(label).or_default() += 1.0;
            }
        }
        let worth = |(label, cells): (u8, f64)| (cells * (self.weight)(label), label, cells);
        let best = favoured.into_iter().map(worth).max_by(|a, b| a.0.total_cmp(&b.0));
        match (best, intent) {
            (Some((_, label, cells)), _) if cells >= FAVOURED * all => Some((LegReason::Label, Some(label))),
            (_, Intent::Curiosity) => Some((LegReason::Unusual, None)),
            (_, Intent::Area(_)) => Some((LegReason::Area, None)),
            _ if unseen < UNSEEN * all => None,
            (_, Intent::Label(label) | Intent::LabelAgain(label)) => Some((LegReason::Expected, Some(label))),
            _ => Some((LegReason::Unseen, None)),
        }
    }

    /// The cells that the camera sees from a place, at most `most` along each side.
    fn view(&self, at: Place, most: i32) -> impl Iterator<Item = Cell> {
        let span = |middle: f64| {
            let edge = |metres: f64| (metres / self.cell_m - 0.5).clamp(-1e9, 1e9);
            (edge(middle - self.reach_m).ceil() as i32, edge(middle + self.reach_m).floor() as i32)
        };
        let ((west, east), (south, north)) = (span(at.0), span(at.1));
        let step = ((east - west) / most + 1).max(1) as usize;
        (south..=north).step_by(step).flat_map(move |y| (west..=east).step_by(step).map(move |x| Cell::new(x, y)))
    }

    /// The cells of the label that a path leads to first, in rows: those that are seen until another reason follows.
    fn targets(&self, (reason, label): (LegReason, Option<u8>), at: Place, path: &[Stretch]) -> Vec<(i32, i32, i32)> {
        let Some(label) = label.filter(|_| reason == LegReason::Label) else { return Vec::new() };
        let is_there = |s: &&Stretch| s.reason.is_none_or(|(_, to)| to == Some(label));
        let stretches = path.iter().skip_while(|s| s.to != at && s.reason != Some((reason, Some(label))));
        let mut cells: Vec<(i32, i32)> = Vec::new();
        for stretch in stretches.take_while(is_there) {
            let seen = self.view(stretch.to, MAX_CELLS).filter(|&cell| self.map.get(cell) == label);
            cells.extend(seen.map(|cell| (cell.y, cell.x)));
        }
        cells.sort_unstable();
        cells.dedup();
        let mut rows: Vec<(i32, i32, i32)> = Vec::new();
        for (y, x) in cells {
            match rows.last_mut() {
                Some(last) if last.0 == y && last.2 + 1 == x => last.2 = x,
                _ => rows.push((y, x, x)),
            }
        }
        rows.truncate(MAX_ROWS);
        rows
    }
}

/// The first place of the path at which a favoured label lies, or else is expected, or else anything is gained.
fn first_target(from: Place, path: &[Stretch]) -> Option<((LegReason, Option<u8>), Place, f64)> {
    let is_goal = |reason: LegReason| !matches!(reason, LegReason::Return | LegReason::Survey);
    let found = |wanted: Option<LegReason>| {
        let is_wanted = |s: &Stretch| s.reason.is_some_and(|(r, _)| is_goal(r) && wanted.is_none_or(|w| w == r));
        let index = path.iter().position(is_wanted)?;
        let (at, along_m) = index.checked_sub(1).map_or((from, 0.0), |i| (path[i].to, path[i].along_m));
        Some((path[index].reason?, at, along_m))
    };
    found(Some(LegReason::Label)).or_else(|| found(Some(LegReason::Expected))).or_else(|| found(None))
}

/// Stretches that gain nothing have the reason of what they lead to, and behind that the purpose of the plan.
fn follow_to_reason(stretches: &mut [Stretch], legs: &[(Place, Purpose)]) {
    let mut next = match legs.last() {
        Some((_, Purpose::Survey(Some(Intent::Label(label) | Intent::LabelAgain(label))))) => {
            Some((LegReason::Label, Some(*label)))
        }
        _ => Some((LegReason::Unseen, None)),
    };
    for stretch in stretches.iter_mut().rev() {
        stretch.reason = stretch.reason.or(next);
        next = stretch.reason;
    }
}

/// Legs of one reason each, with straight ones joined.
fn joined(from: Place, stretches: &[Stretch]) -> Vec<PlanLeg> {
    let mut legs: Vec<(Place, &Stretch)> = Vec::new();
    for stretch in stretches {
        let start = match legs.last() {
            Some(&(start, last)) if last.reason == stretch.reason && is_straight(start, last.to, stretch.to) => {
                legs.pop();
                start
            }
            last => last.map_or(from, |(_, last)| last.to),
        };
        legs.push((start, stretch));
    }
    let leg = |(_, s): (Place, &Stretch)| s.reason.map(|(reason, label)| PlanLeg { to: rounded(s.to), reason, label });
    legs.into_iter().filter_map(leg).collect()
}

fn is_straight(a: Place, b: Place, c: Place) -> bool {
    let ((x, y), (u, v)) = (step(a, b), step(b, c));
    x * u + y * v > 0.0 && (x * v - y * u).abs() < 0.01 * x.hypot(y) * u.hypot(v)
}

fn step(a: Place, b: Place) -> Place {
    (b.0 - a.0, b.1 - a.1)
}

fn distance(a: Place, b: Place) -> f64 {
    (b.0 - a.0).hypot(b.1 - a.1)
}

fn tenths(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

fn rounded((x, y): Place) -> Place {
    (tenths(x), tenths(y))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Label 1 west of 10 m, coral of label 4 from 20 to 26 m, unseen floor from 40 m on.
    fn floor() -> LabelGrid {
        let label = |x: i32| if (80..104).contains(&x) { 4 } else { 1 };
        (-40..40).flat_map(|y| (0..160).map(move |x| (Cell::new(x, y), label(x)))).collect()
    }

    fn aims(to: &[Place], purpose: Purpose) -> PlanAims {
        let (map, weight) = (floor(), |label: u8| if label == 4 { 0.8 } else { 0.0 });
        let ground = Ground { map: &map, cell_m: 0.25, weight: &weight, reach_m: 2.0 };
        let legs: Vec<(Place, Purpose)> = to.iter().map(|&place| (place, purpose)).collect();
        ground.aims((0.0, 0.0), &legs, 100.0, 0.5)
    }

    #[test]
    fn a_leg_through_seen_floor_has_the_reason_that_it_leads_to() {
        let aims = aims(&[(10.0, 0.0), (60.0, 0.0)], Purpose::Survey(Some(Intent::LabelAgain(4))));
        let reasons: Vec<_> = aims.legs.iter().map(|leg| (leg.reason, leg.label)).collect();
        assert_eq!(reasons, [(LegReason::Label, Some(4)), (LegReason::Expected, Some(4))], "{:?}", aims.legs);
        assert!((24.0..32.0).contains(&aims.legs[0].to.0) && aims.legs[1].to == (60.0, 0.0), "{:?}", aims.legs);
        assert!(aims.targets.iter().all(|&(row, first, last)| (-9..9).contains(&row) && (first, last) == (80, 103)));
        assert!(aims.targets.len() >= 15, "{:?}", aims.targets);
    }

    #[test]
    fn the_arrival_follows_from_the_way_and_the_speed() {
        let first = aims(&[(0.0, 8.0), (40.0, 8.0)], Purpose::Survey(Some(Intent::Label(4)))).first.unwrap();
        assert_eq!((first.reason, first.label), (LegReason::Label, Some(4)));
        assert!((24.0..28.1).contains(&first.along_m), "{first:?}");
        assert!((first.arrival_s - 100.0 - first.along_m / 0.5).abs() < 0.2, "{first:?}");
    }

    #[test]
    fn unseen_floor_may_have_the_label_that_is_looked_for() {
        let reason = |intent| aims(&[(60.0, 0.0)], Purpose::Survey(intent)).legs.pop().map(|leg| leg.reason);
        assert_eq!(reason(Some(Intent::Label(4))), Some(LegReason::Expected));
        assert_eq!(reason(Some(Intent::Unseen)), Some(LegReason::Unseen));
        assert_eq!(reason(None), Some(LegReason::Survey), "before the first weights");
    }

    #[test]
    fn the_time_over_favoured_floor_is_told_around_an_order() {
        let (map, weight) = (floor(), |label: u8| if label == 4 { 0.8 } else { 0.0 });
        let ground = Ground { map: &map, cell_m: 0.25, weight: &weight, reach_m: 2.0 };
        // Half a metre a second to the east: label 4 from 40 s to 52 s, then it stays there until 100 s.
        let track = |to: u32| (0..=to).map(|s| (f64::from(s), (f64::from(s) / 2.0).min(23.0), 0.0));
        let told = ground.favoured_time(track(100), 50.0).unwrap();
        assert_eq!((told.since_s, told.share, told.before), (50.0, 1.0, Some(0.2)));
        assert_eq!(ground.favoured_time(track(100), 10.0).unwrap().before, None, "10 s are too few");
        assert_eq!(ground.favoured_time(track(60), 50.0), None, "the order is 10 s old");
    }

    #[test]
    fn a_return_path_leads_to_no_target() {
        let aims = aims(&[(24.0, 0.0)], Purpose::Return);
        assert_eq!((aims.legs.len(), aims.legs[0].reason, aims.first), (1, LegReason::Return, None));
        assert!(aims.targets.is_empty());
    }
}

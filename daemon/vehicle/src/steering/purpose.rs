//! The purpose of a plan: the part of the operator's interest that gains most along it.

use super::worth::Gain;
use crate::planning::Interest;
use scenecast_protocol::directive::{Utility, WeightedArea};
use scenecast_protocol::wire::Intent;

/// Labels that a purpose can name: those with the largest weights, since each costs a valuation of the map.
const MAX_LABELS: usize = 4;

/// The part of `interest` with the greatest `gain`; `None` if no part gains anything.
pub(super) fn purpose(interest: Interest<'_>, gain: impl Fn(Interest<'_>) -> Gain) -> Option<Intent> {
    let parts = parts(interest);
    let gain_of = |(_, utility, areas): &Part<'_>| gain(Interest { utility, areas });
    if let [only] = &parts[..] {
        return Some(after_looks(only.0, || gain_of(only)));
    }
    let gains: Vec<Gain> = parts.iter().map(gain_of).collect();
    let best = (0..parts.len()).max_by(|&a, &b| gains[a].whole.total_cmp(&gains[b].whole).then(b.cmp(&a)))?;
    (gains[best].whole > 0.0).then(|| after_looks(parts[best].0, || gains[best]))
}

/// The intent in view of the looks so far: a label is revisited if more than half of what it gains is on seen floor.
fn after_looks(intent: Intent, gain: impl FnOnce() -> Gain) -> Intent {
    let Intent::Label(label) = intent else { return intent };
    let Gain { whole, on_seen } = gain();
    if on_seen > 0.5 * whole { Intent::LabelAgain(label) } else { intent }
}

/// A part of an interest, as an interest of its own.
type Part<'a> = (Intent, Utility, &'a [WeightedArea]);

/// The parts with a positive weight.
fn parts<'a>(Interest { utility, areas }: Interest<'a>) -> Vec<Part<'a>> {
    const NOWHERE: &[WeightedArea] = &[];
    let none = Utility { epoch: utility.epoch, ..Utility::default() };
    let mut labels: Vec<(u8, i8)> = utility.weights.iter().map(|(&l, &w)| (l, w)).filter(|&(_, w)| w > 0).collect();
    labels.sort_by_key(|&(label, weight)| (std::cmp::Reverse(weight), label));
    labels.truncate(MAX_LABELS);
    let of_label = |(label, weight)| {
        (Intent::Label(label), Utility { weights: [(label, weight)].into(), ..none.clone() }, NOWHERE)
    };
    let mut parts: Vec<_> = labels.into_iter().map(of_label).collect();
    if utility.exploration > 0 {
        parts.push((Intent::Unseen, Utility { exploration: utility.exploration, ..none.clone() }, NOWHERE));
    }
    if utility.curiosity > 0 {
        parts.push((Intent::Curiosity, Utility { curiosity: utility.curiosity, ..none.clone() }, NOWHERE));
    }
    let favoured = (1..).zip(areas.chunks(1)).filter(|(_, area)| area.iter().all(|area| area.weight > 0));
    parts.extend(favoured.map(|(number, area)| (Intent::Area(number), none.clone(), area)));
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::directive::Polygon;

    #[test]
    fn the_part_that_gains_most_is_the_purpose() {
        let utility = Utility { exploration: 10, weights: [(3, 80), (5, -20), (7, 40)].into(), ..Utility::default() };
        let weigh = |by: [f64; 4]| {
            move |Interest { utility, areas }: Interest<'_>| {
                let labels = by[0] * utility.weight(3) + by[1] * utility.weight(7);
                let whole = labels + by[2] * f64::from(utility.exploration) / 100.0 + by[3] * areas.len() as f64;
                Gain { whole, on_seen: 0.0 }
            }
        };
        let in_labels = Interest::in_labels(&utility);
        assert_eq!(purpose(in_labels, weigh([1.0, 1.0, 1.0, 9.0])), Some(Intent::Label(3)));
        assert_eq!(purpose(in_labels, weigh([1.0, 3.0, 1.0, 9.0])), Some(Intent::Label(7)));
        assert_eq!(purpose(in_labels, weigh([1.0, 1.0, 20.0, 9.0])), Some(Intent::Unseen));
        assert_eq!(purpose(in_labels, weigh([0.0; 4])), None);
        let areas = [-50, 60].map(|weight| WeightedArea { outline: Polygon::default(), weight });
        let in_places = Interest { areas: &areas, ..in_labels };
        assert_eq!(purpose(in_places, weigh([1.0, 1.0, 1.0, 9.0])), Some(Intent::Area(2)));
        let again = |intent, on_seen| after_looks(intent, || Gain { whole: 1.0, on_seen });
        assert_eq!(again(Intent::Label(3), 0.4), Intent::Label(3));
        assert_eq!(again(Intent::Label(3), 0.6), Intent::LabelAgain(3));
        assert_eq!(again(Intent::Unseen, 1.0), Intent::Unseen);
        let only = Utility { curiosity: 5, ..Utility::default() };
        let unreachable = |_: Interest<'_>| unreachable!("one part needs no gain");
        assert_eq!(purpose(Interest::in_labels(&only), unreachable), Some(Intent::Curiosity));
        assert_eq!(purpose(Interest::in_labels(&Utility::default()), |_| Gain { whole: 1.0, on_seen: 0.0 }), None);
    }
}

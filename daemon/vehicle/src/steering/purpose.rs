//! The purpose of a plan: the part of the utility that gains most along it.

use scenecast_protocol::directive::Utility;
use scenecast_protocol::wire::Intent;

/// Labels that a purpose can name: those with the largest weights, since each costs a valuation of the map.
const MAX_LABELS: usize = 4;

/// The part of `utility` with the greatest `gain`; `None` if no part gains anything.
pub(super) fn purpose(utility: &Utility, gain: impl Fn(&Utility) -> f64) -> Option<Intent> {
    let mut parts = parts(utility);
    if let [(intent, _)] = parts[..] {
        return Some(intent);
    }
    let gains: Vec<f64> = parts.iter().map(|(_, part)| gain(part)).collect();
    let best = (0..parts.len()).max_by(|&a, &b| gains[a].total_cmp(&gains[b]).then(b.cmp(&a)))?;
    (gains[best] > 0.0).then(|| parts.swap_remove(best).0)
}

/// The parts with a positive weight, each as a utility of its own.
fn parts(utility: &Utility) -> Vec<(Intent, Utility)> {
    let none = Utility { epoch: utility.epoch, ..Utility::default() };
    let mut labels: Vec<(u8, i8)> = utility.weights.iter().map(|(&l, &w)| (l, w)).filter(|&(_, w)| w > 0).collect();
    labels.sort_by_key(|&(label, weight)| (std::cmp::Reverse(weight), label));
    labels.truncate(MAX_LABELS);
    let of_label =
        |(label, weight)| (Intent::Label(label), Utility { weights: [(label, weight)].into(), ..none.clone() });
    let mut parts: Vec<_> = labels.into_iter().map(of_label).collect();
    if utility.exploration > 0 {
        parts.push((Intent::Unseen, Utility { exploration: utility.exploration, ..none.clone() }));
    }
    if utility.curiosity > 0 {
        parts.push((Intent::Curiosity, Utility { curiosity: utility.curiosity, ..none }));
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_that_gains_most_is_the_purpose() {
        let utility = Utility { exploration: 10, weights: [(3, 80), (5, -20), (7, 40)].into(), ..Utility::default() };
        let weigh = |by: [f64; 3]| {
            move |part: &Utility| {
                by[0] * part.weight(3) + by[1] * part.weight(7) + by[2] * f64::from(part.exploration) / 100.0
            }
        };
        assert_eq!(purpose(&utility, weigh([1.0, 1.0, 1.0])), Some(Intent::Label(3)));
        assert_eq!(purpose(&utility, weigh([1.0, 3.0, 1.0])), Some(Intent::Label(7)));
        assert_eq!(purpose(&utility, weigh([1.0, 1.0, 20.0])), Some(Intent::Unseen));
        assert_eq!(purpose(&utility, weigh([0.0, 0.0, 0.0])), None);
        let only = Utility { curiosity: 5, ..Utility::default() };
        assert_eq!(purpose(&only, |_| unreachable!("one part needs no gain")), Some(Intent::Curiosity));
        assert_eq!(purpose(&Utility::default(), |_| 1.0), None);
    }
}

//! Drift: whether a cell looks different because it was seen early.

use scene_model::habitats::{MEASURES, MeasuredValues};
use std::collections::BTreeMap;

/// Fewest cells of a class that were seen early, and fewest that were seen late.
const MIN_CELLS: usize = 24;

/// The share of the variance of a measure between cells of one class that is explained by whether a cell was seen early, mean over the
/// measures that vary. Each cell has its class, whether it was seen early, and its measures. `None` without a class that has enough of both.
pub(super) fn drift(cells: impl Iterator<Item = (u32, bool, MeasuredValues)>) -> Option<f64> {
    let mut classes: BTreeMap<u32, [Vec<MeasuredValues>; 2]> = BTreeMap::new();
    for (class, is_early, values) in cells {
        classes.entry(class).or_default()[usize::from(is_early)].push(values);
    }
    classes.retain(|_, both| both.iter().all(|cells| cells.len() >= MIN_CELLS));
    let share = |measure: usize| {
        let (mut all, mut explained) = (0.0, 0.0);
        for both in classes.values() {
            let mean = mean(both.iter().flatten(), measure);
            all += both.iter().flatten().map(|values| (values[measure] - mean).powi(2)).sum::<f64>();
            let of =
                |cells: &Vec<MeasuredValues>| cells.len() as f64 * (self::mean(cells.iter(), measure) - mean).powi(2);
            explained += both.iter().map(of).sum::<f64>();
        }
        (all > 0.0).then(|| explained / all)
    };
    let shares: Vec<f64> = (0..MEASURES).filter_map(share).collect();
    (!shares.is_empty()).then(|| shares.iter().sum::<f64>() / shares.len() as f64)
}

fn mean<'a>(cells: impl Iterator<Item = &'a MeasuredValues>, measure: usize) -> f64 {
    let (sum, count) = cells.fold((0.0, 0.0), |(sum, count), values| (sum + values[measure], count + 1.0));
    sum / f64::max(count, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Forty cells of two classes each, of which the first half was seen early.
    fn cells(value: impl Fn(u32, usize) -> f64) -> impl Iterator<Item = (u32, bool, MeasuredValues)> {
        let values = move |class, index| [value(class, index); MEASURES];
        (0..160).map(move |i| (i as u32 % 2, i < 80, values(i as u32 % 2, i)))
    }

    #[test]
    fn only_differences_by_time_within_a_class_are_drift() {
        let (by_class, by_place) = (drift(cells(|class, _| class.into())), drift(cells(|_, i| (i / 2 % 4) as f64)));
        assert_eq!(by_class, None, "nothing varies within a class");
        assert!(by_place.unwrap() < 1e-9, "{by_place:?}");
        assert!(drift(cells(|_, i| if i < 80 { 1.0 } else { 2.0 })).unwrap() > 0.999);
        assert_eq!(drift(cells(|_, i| i as f64).take(90)), None, "too few are late");
    }
}

//! The agreement of two maps over time, and the delay of changes.

use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;

/// Seconds for which a cell of the two maps differed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Delays(Vec<f32>);

impl Delays {
    pub fn push(&mut self, seconds: f64) {
        self.0.push(seconds as f32);
    }

    /// Median, 95th percentile and maximum; zeros without any delay.
    pub fn summary(&self) -> [f64; 3] {
        let mut sorted = self.0.clone();
        sorted.sort_by(f32::total_cmp);
        let at = |share: f64| {
            sorted.get(((sorted.len().max(1) - 1) as f64 * share) as usize).copied().map_or(0.0, f64::from)
        };
        [at(0.5), at(0.95), at(1.0)]
    }
}

/// Compares the two maps once a second.
#[derive(Debug, Default)]
pub struct Meter {
    differing: BTreeMap<Cell, Instant>,
    delays: Delays,
    seen: Option<(u64, u64)>,
    agreement: f64,
    /// Explored cells of the vehicle's map.
    explored: u32,
    integral: f64,
    seconds: f64,
    last: Option<Instant>,
    survey_mean: Option<f64>,
}

impl Meter {
    /// Integrates the agreement up to `now`, and compares the maps again if `versions` differ from the last ones.
    pub fn look(&mut self, vehicle: &LabelGrid, operator: &LabelGrid, versions: (u64, u64), now: Instant) {
        if let Some(last) = self.last.replace(now) {
            // Agreement is undefined before the vehicle has a map.
            let passed = if self.explored > 0 { now.since(last).as_secs_f64() } else { 0.0 };
            self.integral += self.agreement * passed;
            self.seconds += passed;
        }
        if self.seen == Some(versions) {
            return;
        }
        self.seen = Some(versions);
        let mut explored = 0u32;
        let mut still = BTreeMap::new();
        for (cell, label) in vehicle.iter() {
            explored += 1;
            if operator.get(cell) != label {
                still.insert(cell, self.differing.remove(&cell).unwrap_or(now));
            }
        }
        self.explored = explored;
        self.agreement = if explored == 0 { 1.0 } else { 1.0 - still.len() as f64 / f64::from(explored) };
        for since in std::mem::replace(&mut self.differing, still).into_values() {
            self.delays.push(now.since(since).as_secs_f64());
        }
    }

    /// Share of explored cells on which the maps agree, at the last comparison.
    pub fn agreement(&self) -> f64 {
        self.agreement
    }

    /// Seconds for which the labels have differed, mean over the explored cells; 0 where the maps agree.
    pub fn age_s(&self, now: Instant) -> f64 {
        let sum: f64 = self.differing.values().map(|since| now.since(*since).as_secs_f64()).sum();
        // The sum of no numbers is -0.
        (sum + 0.0) / f64::from(self.explored.max(1))
    }

    /// Mean over time of [`Self::agreement`].
    pub fn agreement_mean(&self) -> f64 {
        if self.seconds > 0.0 { self.integral / self.seconds } else { 0.0 }
    }

    /// Ends the survey: later changes do not count for the mean.
    pub fn end_survey(&mut self) {
        self.survey_mean = Some(self.agreement_mean());
    }

    pub fn agreement_mean_of_survey(&self) -> f64 {
        self.survey_mean.unwrap_or_else(|| self.agreement_mean())
    }

    /// Delays of all changes so far; those still open count up to `now`.
    pub fn delays(&self, now: Instant) -> Delays {
        let mut delays = self.delays.clone();
        for since in self.differing.values() {
            delays.push(now.since(*since).as_secs_f64());
        }
        delays
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agreement_and_delay_follow_a_cell_until_it_agrees() {
        let at = |s: f64| Instant::from_secs_f64(s);
        let (mut vehicle, mut operator) = (LabelGrid::default(), LabelGrid::default());
        let mut meter = Meter::default();
        vehicle.set(Cell::new(0, 0), 1);
        vehicle.set(Cell::new(1, 0), 2);
        meter.look(&vehicle, &operator, (1, 0), at(0.0));
        operator.set(Cell::new(0, 0), 1);
        meter.look(&vehicle, &operator, (1, 1), at(4.0));
        assert_eq!((meter.agreement(), meter.age_s(at(6.0))), (0.5, 3.0));
        operator.set(Cell::new(1, 0), 2);
        meter.look(&vehicle, &operator, (1, 2), at(10.0));
        assert_eq!(meter.delays(at(10.0)).summary(), [4.0, 4.0, 10.0]);
        assert!((meter.agreement_mean() - 0.3).abs() < 1e-9);
    }
}

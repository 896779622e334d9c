//! Maps values to positions along an axis, with round ticks.

/// An axis from a lowest to a highest value between two positions, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    low: f64,
    high: f64,
    step: f64,
    from: f64,
    to: f64,
}

const TICKS: f64 = 5.0;

impl Axis {
    /// An axis over all of the values; it starts at 0 unless they are close to each other.
    pub fn over(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let low = if low >= 0.0 && low < 0.5 * high { 0.0 } else { low };
        let span = if high - low > 1e-9 { high - low } else { high.abs().max(1e-3) };
        let step = round_step(span / TICKS);
        let (first, last) = ((low / step).floor(), (high / step + 1e-9).floor() + 1.0);
        Self { low: first * step, high: last * step, step, from, to }
    }

    pub fn place(&self, value: f64) -> f64 {
        self.from + (self.to - self.from) * (value - self.low) / (self.high - self.low)
    }

    /// Position and text of each tick.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        let decimals = (-self.step.log10().floor()).max(0.0) as usize;
        let count = ((self.high - self.low) / self.step).round() as u32;
        let tick = |i| {
            let value = self.low + f64::from(i) * self.step;
            (self.place(value), format!("{value:.decimals$}"))
        };
        (0..=count).map(tick).collect()
    }
}

/// The smallest of 1, 2, 5 times a power of ten that is at least `least`.
fn round_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0].into_iter().map(|digit| digit * power).find(|&step| step >= least * (1.0 - 1e-9));
    step.unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_cover_all_values() {
        let axis = Axis::over([0.12, 0.29].into_iter(), 0.0, 100.0);
        let texts: Vec<String> = axis.ticks().into_iter().map(|tick| tick.1).collect();
        assert_eq!(texts, ["0.0", "0.1", "0.2", "0.3"]);
        assert!((0.0..=100.0).contains(&axis.place(0.29)));
        let bytes = Axis::over([2100.0, 2300.0].into_iter(), 0.0, 1.0);
        assert_eq!(bytes.ticks()[0].1, "2100");
    }
}

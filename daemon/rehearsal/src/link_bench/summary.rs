//! Order statistics of a sample.

#[derive(Debug, Clone)]
pub struct Summary(Vec<f64>);

impl Summary {
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        Self(values)
    }

    /// The smallest value that a `share` of the sample does not exceed; 0 for an empty sample.
    pub fn quantile(&self, share: f64) -> f64 {
        let rank = (share * self.0.len() as f64).ceil() as usize;
        self.0.get(rank.max(1) - 1).copied().unwrap_or_default()
    }

    pub fn median(&self) -> f64 {
        self.quantile(0.5)
    }

    pub fn p95(&self) -> f64 {
        self.quantile(0.95)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_of_the_sample() {
        let s = Summary::of((1..=20).rev().map(f64::from).collect());
        assert_eq!([s.median(), s.p95(), s.quantile(1.0)], [10.0, 19.0, 20.0]);
        assert_eq!(Summary::of(Vec::new()).median(), 0.0);
    }
}

//! What the levels of a plane mean.

use super::{MAX_LABEL, UNEXPLORED};

/// Which quantity a plane holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PlaneKind {
    /// How sure the model is of the label.
    Confidence,
    /// Depth of the sea floor below the surface.
    Depth,
    /// How badly the model explains what the cell shows.
    Curiosity,
}

impl PlaneKind {
    /// Every plane, in the order of their numbers on the wire.
    pub const ALL: [Self; 3] = [Self::Confidence, Self::Depth, Self::Curiosity];

    /// Name for people and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Confidence => "confidence",
            Self::Depth => "depth",
            Self::Curiosity => "curiosity",
        }
    }

    pub(super) fn number(self) -> u8 {
        match self {
            Self::Confidence => 1,
            Self::Depth => 2,
            Self::Curiosity => 3,
        }
    }
}

/// What the levels of a plane mean; level 0 is not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaneScale {
    /// Level 1 to 4: quarters of 0..=1.
    Confidence,
    /// Level 1 to 254: level n is from `(first + n - 1) * step` to one step more.
    Depth {
        /// Decimetres, 1 to 255.
        step_dm: u8,
        /// Steps from the surface to where level 1 begins.
        first: u16,
    },
    /// Level 1 to 16: level n is from `n - 1` to `n` bits of mean surprise of a word, the binary logarithm of the
    /// perplexity; level 16 is more, too.
    Curiosity,
}

impl PlaneScale {
    /// A quantity has to leave its level by this share of a step before it has another one.
    const HYSTERESIS: f64 = 0.2;

    /// Depths in steps of about `step_m` metres with `middle_m` in the middle of the scale, or as near as it gets.
    pub fn depth_around(middle_m: f64, step_m: f64) -> Self {
        let step_dm = (step_m * 10.0).round().clamp(1.0, 255.0) as u8;
        let middle = middle_m * 10.0 / f64::from(step_dm);
        Self::Depth { step_dm, first: (middle - f64::from(MAX_LABEL) / 2.0).round().clamp(0.0, 65_535.0) as u16 }
    }

    /// Which quantity it is of.
    pub fn kind(self) -> PlaneKind {
        match self {
            Self::Confidence => PlaneKind::Confidence,
            Self::Depth { .. } => PlaneKind::Depth,
            Self::Curiosity => PlaneKind::Curiosity,
        }
    }

    /// The highest level.
    pub fn levels(self) -> u8 {
        match self {
            Self::Confidence => 4,
            Self::Depth { .. } => MAX_LABEL,
            Self::Curiosity => 16,
        }
    }

    /// Where level 1 begins, and how much a level spans: of 1, metres or bits.
    fn origin_and_step(self) -> (f64, f64) {
        match self {
            Self::Confidence => (0.0, 0.25),
            Self::Depth { step_dm, first } => {
                let step = f64::from(step_dm) / 10.0;
                (f64::from(first) * step, step)
            }
            Self::Curiosity => (0.0, 1.0),
        }
    }

    /// The bounds of a level: of 1, metres or bits; `None` if it means "not known".
    pub fn bounds(self, level: u8) -> Option<(f64, f64)> {
        let (origin, step) = self.origin_and_step();
        let above = f64::from(level.checked_sub(1)?) * step + origin;
        (level <= self.levels()).then_some((above, above + step))
    }

    /// The level of a quantity for a cell that has been of level `held`; 0 if it lies off the scale.
    pub fn level(self, quantity: f64, held: u8) -> u8 {
        let (origin, step) = self.origin_and_step();
        let margin = step * Self::HYSTERESIS;
        if self.bounds(held).is_some_and(|(low, high)| (low - margin..high + margin).contains(&quantity)) {
            return held;
        }
        let most = f64::from(self.levels());
        let steps = (quantity - origin) / step;
        match self {
            Self::Confidence if (0.0..=most).contains(&steps) => (steps.min(most - 1.0) + 1.0) as u8,
            Self::Depth { .. } if (0.0..most).contains(&steps) => (steps + 1.0) as u8,
            Self::Curiosity if steps >= 0.0 => (steps.min(most - 1.0) + 1.0) as u8,
            _ => UNEXPLORED,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DEPTH: PlaneScale = PlaneScale::Depth { step_dm: 5, first: 24 };

    #[test]
    fn levels_are_quarters_of_confidence_steps_of_depth_and_bits_of_curiosity() {
        let levels = |scale: PlaneScale, quantities: &[f64]| -> Vec<u8> {
            quantities.iter().map(|&quantity| scale.level(quantity, 0)).collect()
        };
        assert_eq!(levels(PlaneScale::Confidence, &[0.0, 0.24, 0.25, 0.74, 0.75, 1.0]), [1, 1, 2, 3, 4, 4]);
        assert_eq!(levels(PlaneScale::Confidence, &[-0.1, 1.1, f64::NAN]), [0, 0, 0]);
        assert_eq!(levels(DEPTH, &[12.0, 12.49, 12.5, 138.99]), [1, 1, 2, 254]);
        assert_eq!(levels(DEPTH, &[11.9, 139.0, f64::INFINITY]), [0, 0, 0]);
        assert_eq!(levels(PlaneScale::Curiosity, &[0.0, 0.99, 1.0, 6.5, 15.9, 16.0, 40.0]), [1, 1, 2, 7, 16, 16, 16]);
        assert_eq!(levels(PlaneScale::Curiosity, &[-0.1, f64::NAN]), [0, 0]);
        assert_eq!((DEPTH.bounds(2), PlaneScale::Curiosity.bounds(7)), (Some((12.5, 13.0)), Some((6.0, 7.0))));
        assert_eq!((DEPTH.bounds(0), DEPTH.bounds(255), PlaneScale::Confidence.bounds(5)), (None, None, None));
    }

    #[test]
    fn the_scale_of_depths_reaches_as_far_up_as_down_or_begins_at_the_surface() {
        assert_eq!(PlaneScale::depth_around(1000.0, 0.5), PlaneScale::Depth { step_dm: 5, first: 1873 });
        assert_eq!(PlaneScale::depth_around(20.0, 0.5), PlaneScale::Depth { step_dm: 5, first: 0 });
        assert_eq!(PlaneScale::depth_around(11_000.0, 0.1), PlaneScale::Depth { step_dm: 1, first: 65_535 });
    }

    #[test]
    fn a_quantity_at_the_edge_of_a_level_does_not_go_to_and_fro() {
        let mut level = 0;
        let mut changes = 0;
        for i in 0..100 {
            let next = PlaneScale::Confidence.level(if i % 2 == 0 { 0.73 } else { 0.77 }, level);
            changes += u32::from(next != level);
            level = next;
        }
        assert_eq!((changes, level), (1, 3));
        assert_eq!(PlaneScale::Confidence.level(0.81, level), 4);
        assert_eq!([6.9, 7.1, 7.25].map(|bits| PlaneScale::Curiosity.level(bits, 7)), [7, 7, 8]);
    }

    proptest! {
        #[test]
        fn a_level_holds_the_quantity_or_nearly(quantity in 0.0f64..200.0, held in 0u8..=255) {
            let level = DEPTH.level(quantity, held);
            if let Some((low, high)) = DEPTH.bounds(level) {
                prop_assert!((low - 0.11..high + 0.11).contains(&quantity));
            } else {
                prop_assert!(!(12.0..139.0).contains(&quantity));
            }
        }
    }
}

//! The similarity that most tiles of a frame agree on, with relief along the parallax.

use crate::refine::Fit;
use crate::similarity::Similarity;
use crate::tiles::TileMatch;
use nalgebra::{Matrix2, Matrix2x4, Matrix4, Vector2, Vector4};

/// The least number of tiles.
const MIN_TILES: usize = 4;
const STEPS: usize = 8;
/// Residuals beyond so many standard deviations count less.
const HUBER: f64 = 1.5;
/// Errors of a tile besides the noise of its pixels, pixels.
const FLOOR_PX: f64 = 0.12;
/// The largest variance of a tile's errors beyond the expected one.
const MAX_EXCESS_PX2: f64 = 4.0;
/// Neighbouring tiles have about the same height, so this many tiles count as one.
const TILES_ALIKE: f64 = 5.0;

/// A similarity in pixels of the new and the old plane, and its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Agreed {
    pub(crate) similarity: Similarity,
    /// The middle of the tiles in the new frame.
    pub(crate) anchor: Vector2<f64>,
    pub(crate) turn_sigma: f64,
    pub(crate) log_scale_sigma: f64,
    /// Direction of the parallax in the old frame.
    pub(crate) along: Vector2<f64>,
    /// Standard deviations of the shift at the anchor along and across the parallax.
    pub(crate) along_sigma: f64,
    pub(crate) across_sigma: f64,
    /// Variance of the heights, in squares of the altitude.
    pub(crate) relief: f64,
}

/// What is known before the tiles are looked at.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Before {
    /// Standard deviation of turn and log scale.
    pub(crate) spread: f64,
    pub(crate) relief: ExpectedRelief,
}

/// The heights of the floor before a match.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ExpectedRelief {
    /// Variance of the heights, in squares of the altitude.
    pub(crate) variance: f64,
    /// The number of tiles that it counts for.
    tiles: f64,
}

impl ExpectedRelief {
    /// The relief that earlier matches showed; it counts for `TILES_ALIKE` tiles.
    pub(crate) fn known(variance: f64) -> Self {
        Self { variance, tiles: TILES_ALIKE }
    }

    /// The relief before any match, which counts for a fifth of a tile.
    pub(crate) fn guessed(variance: f64) -> Self {
        Self { variance, tiles: 0.2 }
    }
}

impl Agreed {
    /// The fit of a whole frame, where tiles are too few.
    pub(crate) fn of_fit(fit: &Fit, before: &Before) -> Self {
        let baseline = fit.similarity.shift().norm();
        Self {
            similarity: fit.similarity,
            anchor: fit.anchor,
            turn_sigma: fit.spread_sigma.hypot(before.relief.variance.sqrt()),
            log_scale_sigma: fit.spread_sigma.hypot(before.relief.variance.sqrt()),
            along: fit.similarity.shift().try_normalize(1.0).unwrap_or(Vector2::new(1.0, 0.0)),
            along_sigma: fit.shift_sigma.hypot(FLOOR_PX).hypot(before.relief.variance.sqrt() * baseline),
            across_sigma: fit.shift_sigma.hypot(FLOOR_PX),
            relief: before.relief.variance,
        }
    }
}

/// Fits a similarity near `start`; `None` if too few tiles agree.
pub(crate) fn agree(tiles: &[TileMatch], start: &Similarity, before: &Before) -> Option<Agreed> {
    if tiles.len() < MIN_TILES {
        return None;
    }
    let anchor = tiles.iter().map(|tile| tile.new).sum::<Vector2<f64>>() / tiles.len() as f64;
    let baseline = start.shift().norm();
    let along = if baseline > 1.0 { start.shift() / baseline } else { Vector2::new(1.0, 0.0) };
    let projector = along * along.transpose();
    let mut now = *start;
    let mut relief = before.relief.variance;
    // Variance of the tiles' errors beyond the expected one, as slopes distort tiles; seen across the parallax.
    let mut excess2 = 0.0;
    let mut normal = Matrix4::identity();
    for _ in 0..STEPS {
        let height2 = relief * baseline * baseline;
        normal = Matrix4::zeros();
        let mut right = Vector4::zeros();
        let spread = start.inverse().after(&now);
        for (i, off) in [spread.turn_rad(), spread.scale().ln()].into_iter().enumerate() {
            normal[(i, i)] += before.spread.powi(-2);
            right[i] -= before.spread.powi(-2) * off;
        }
        let (mut along_squares, mut across_squares, mut weights) = (0.0, 0.0, 0.0);
        for tile in tiles {
            let arm = now.apply(tile.new) - now.apply(anchor);
            let off = tile.old - now.apply(tile.new);
            let expected2 = tile.sigma * tile.sigma + FLOOR_PX * FLOOR_PX;
            let covariance = Matrix2::identity() * expected2 + projector * height2;
            let distance = off.dot(&(covariance.try_inverse()? * off)).sqrt();
            let inverse = (covariance + Matrix2::identity() * excess2).try_inverse()?;
            let weight = (HUBER / distance.max(1e-9)).min(1.0);
            let slopes = Matrix2x4::new(-arm.y, arm.x, 1.0, 0.0, arm.x, arm.y, 0.0, 1.0);
            normal += slopes.transpose() * inverse * slopes * weight;
            right += slopes.transpose() * inverse * off * weight;
            let part = off.dot(&along);
            along_squares += weight * (part * part - expected2);
            across_squares += weight * (off.norm_squared() - part * part - expected2);
            weights += weight;
        }
        let change = normal.cholesky()?.solve(&right);
        let turned = Similarity::new(change[0], change[1].exp(), Vector2::zeros());
        let at = now.apply(anchor) + Vector2::new(change[2], change[3]);
        now = turned.after(&now).through(anchor, at);
        excess2 = (across_squares / weights).clamp(0.0, MAX_EXCESS_PX2);
        if baseline > 1.0 {
            // Heights are learnt from the difference of both directions: other errors have none.
            let seen = (along_squares - across_squares.max(0.0)).max(0.0) / weights / (baseline * baseline);
            let ExpectedRelief { variance, tiles } = before.relief;
            relief = (variance * tiles + seen * weights) / (tiles + weights);
        }
        if !now.is_finite() {
            return None;
        }
    }
    let covariance = normal.try_inverse()?;
    let shift = covariance.fixed_view::<2, 2>(2, 2).into_owned();
    let across = Vector2::new(-along.y, along.x);
    let count = tiles.len() as f64;
    let height2 = relief * baseline * baseline * (TILES_ALIKE / count).min(1.0);
    Some(Agreed {
        similarity: now,
        anchor,
        turn_sigma: covariance[(0, 0)].max(0.0).sqrt(),
        log_scale_sigma: (covariance[(1, 1)].max(0.0) + relief * (TILES_ALIKE / count).min(1.0)).sqrt(),
        along,
        along_sigma: (along.dot(&(shift * along)) + height2).max(0.0).sqrt(),
        across_sigma: across.dot(&(shift * across)).max(0.0).sqrt(),
        relief,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tiles of a frame over a floor with heights, moved by a similarity.
    fn tiles(truth: &Similarity, height: impl Fn(Vector2<f64>) -> f64) -> Vec<TileMatch> {
        let place = |i: usize| Vector2::new((i % 6) as f64 * 26.0 - 65.0, (i / 6) as f64 * 24.0 - 48.0);
        let tile = |i: usize| {
            let new = place(i);
            let old = truth.apply(new) + truth.shift() * height(new);
            TileMatch { new, old, sigma: 0.1 }
        };
        (0..30).map(tile).collect()
    }

    const BEFORE: Before = Before { spread: 0.012, relief: ExpectedRelief { variance: 1e-5, tiles: TILES_ALIKE } };

    #[test]
    fn a_flat_floor_gives_an_exact_similarity() {
        let truth = Similarity::new(0.01, 1.01, Vector2::new(3.0, 60.0));
        let agreed =
            agree(&tiles(&truth, |_| 0.0), &Similarity::new(0.0, 1.0, Vector2::new(2.0, 59.0)), &BEFORE).unwrap();
        assert!((agreed.similarity.turn_rad() - 0.01).abs() < 1e-3, "{agreed:?}");
        assert!((agreed.similarity.apply(agreed.anchor) - truth.apply(agreed.anchor)).norm() < 0.05);
        assert!(agreed.along_sigma < 0.2 && agreed.relief < 1e-5, "{agreed:?}");
    }

    #[test]
    fn relief_disturbs_only_along_the_parallax() {
        let truth = Similarity::new(0.0, 1.0, Vector2::new(0.0, 100.0));
        let bumps = |at: Vector2<f64>| 0.06 * (at.x / 20.0).sin() + 0.05 * (at.y / 25.0).cos();
        let start = Similarity::new(0.005, 1.0, Vector2::new(0.5, 101.0));
        let agreed = agree(&tiles(&truth, bumps), &start, &BEFORE).unwrap();
        let off = agreed.similarity.apply(agreed.anchor) - truth.apply(agreed.anchor);
        assert!(off.x.abs() < 0.1 && off.y.abs() < 3.0 * agreed.along_sigma, "{off} {agreed:?}");
        assert!(agreed.along_sigma > 1.0 && agreed.across_sigma < 0.2, "{agreed:?}");
        assert!(agreed.similarity.turn_rad().abs() < 2e-3 && agreed.relief.sqrt() > 0.03, "{agreed:?}");
    }

    #[test]
    fn wrong_tiles_are_outvoted() {
        let truth = Similarity::new(0.0, 1.0, Vector2::new(10.0, 40.0));
        let mut tiles = tiles(&truth, |_| 0.0);
        for tile in tiles.iter_mut().step_by(6) {
            tile.old += Vector2::new(5.0, -4.0);
        }
        let agreed = agree(&tiles, &truth, &BEFORE).unwrap();
        assert!((agreed.similarity.apply(agreed.anchor) - truth.apply(agreed.anchor)).norm() < 0.1, "{agreed:?}");
        assert_eq!(agree(&tiles[..3], &truth, &BEFORE), None);
    }
}

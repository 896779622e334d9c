//! One attempt to match a new frame with an earlier one, and where the match places it.

use crate::camera_image::Scales;
use crate::consensus::{Agreed, Before, ExpectedRelief, agree};
use crate::correlate::{Correlator, Peak};
use crate::refine::{Fit, Reference};
use crate::similarity::{FramePose, Similarity};
use crate::tiles::match_tiles;
use nalgebra::{Matrix2, Rotation2, Vector2};
use scenecast_protocol::coordinates::MapPoint;

/// Limits of an accepted match; see [`Gates::default`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gates {
    /// Least distance of the peak to the second one, times the root of the overlapping pixels.
    pub(crate) confidence: f32,
    pub(crate) correlation: f32,
    /// Least share of the frame that overlaps.
    pub(crate) overlap: f32,
    /// Least correlation after the refinement, and least product with the root of the overlapping pixels.
    pub(crate) refined: f64,
    pub(crate) refined_strength: f64,
}

impl Default for Gates {
    /// No wrong match passed them in thousands of pairs; the worst wrong one had a confidence of 3.
    fn default() -> Self {
        Self { confidence: 7.0, correlation: 0.15, overlap: 0.08, refined: 0.3, refined_strength: 18.0 }
    }
}

/// The expectation of a match, in metres and radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Expected {
    /// From the new frame to the earlier one, metres to the right and ahead in both.
    pub(crate) similarity: Similarity,
    /// The largest error of the shift that is searched.
    pub(crate) window_m: f64,
    /// Standard deviation of the turn and of the log scale.
    pub(crate) spread: f64,
    pub(crate) relief: ExpectedRelief,
}

/// A match between a new frame and an earlier one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Match {
    /// From the new frame to the earlier one, metres to the right and ahead in both.
    pub(crate) similarity: Similarity,
    /// The point of the new frame at which the shift is most certain.
    pub(crate) anchor: Vector2<f64>,
    pub(crate) turn_sigma: f64,
    pub(crate) log_scale_sigma: f64,
    /// Direction of the parallax in the earlier frame, and the standard deviation of the shift along it, metres.
    pub(crate) along: Vector2<f64>,
    pub(crate) along_sigma_m: f64,
    pub(crate) across_sigma_m: f64,
    /// Variance of the heights of the floor, in squares of the altitude.
    pub(crate) relief: f64,
}

/// A new frame, prepared for several attempts.
pub(crate) struct Attempts<'a> {
    new: &'a Scales,
    fine: Reference<'a>,
    coarse: Reference<'a>,
    correlator: Correlator,
    gates: Gates,
}

/// Steps of the refinement at both scales.
const COARSE_STEPS: usize = 10;
const FINE_STEPS: usize = 8;
/// The refinement may move the middle of the overlap by so many coarse pixels from the peak.
const MAX_REFINED_PX: f64 = 4.0;
/// Tiles are searched up to so many standard deviations of the height, within these bounds in pixels.
const MAX_HEIGHT_SIGMAS: f64 = 2.5;
const MIN_REACH_PX: f64 = 2.0;
const MAX_REACH_PX: f64 = 16.0;
/// Turn and log scale may be off by so many times the expected spread.
const MAX_SPREAD: f64 = 6.0;
/// Turns in radians and log scales that are tried below the gate, in units of the expected spread.
const SMALL_SEARCH: [[f64; 2]; 4] = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
/// A confidence from which the small search is worth its time.
const MIN_SEARCHED: f32 = 2.5;

impl<'a> Attempts<'a> {
    /// Prepares a frame for shifts up to `window_m`.
    pub(crate) fn new(new: &'a Scales, window_m: f64, gates: Gates) -> Self {
        let most = new.coarse.columns().max(new.coarse.rows()) as f64 * 0.75;
        let margin = (window_m / (2.0 * new.pitch_m) + 2.0).clamp(8.0, most) as usize;
        let (fine, coarse) = (Reference::new(&new.fine), Reference::new(&new.coarse));
        Self { new, fine, coarse, correlator: Correlator::new(&new.coarse, margin), gates }
    }

    /// Tries to match one earlier frame; `None` if the evidence is too weak.
    pub(crate) fn attempt(&mut self, old: &Scales, expected: &Expected) -> Option<Match> {
        let (start, peak) = self.search(old, expected)?;
        if peak.confidence < self.gates.confidence || peak.correlation < self.gates.correlation {
            return None;
        }
        let (coarse_px, old_px) = (2.0 * self.new.pitch_m, 2.0 * old.pitch_m);
        let to_coarse = |metres: &Similarity| between_pixels(metres, coarse_px, old_px);
        let tightness = 1.0 / expected.spread.powi(2);
        let coarse = self.coarse.fit(&old.coarse, &to_coarse(&start), tightness, COARSE_STEPS)?;
        let refined = from_pixels(&coarse.similarity, coarse_px, old_px);
        let fine_start = between_pixels(&refined, self.new.pitch_m, old.pitch_m);
        let fine = self.fine.fit(&old.fine, &fine_start, tightness, FINE_STEPS)?;
        let found = self.accepted(&fine, old, expected)?;
        let moved = (found.similarity.apply(found.anchor) - start.apply(found.anchor)).norm();
        let spread = expected.similarity.inverse().after(&found.similarity);
        let is_near = moved < MAX_REFINED_PX * coarse_px
            && spread.turn_rad().abs() < MAX_SPREAD * expected.spread
            && spread.scale().ln().abs() < MAX_SPREAD * expected.spread;
        (is_near && !self.is_still(&found.similarity, &expected.similarity)).then_some(found)
    }

    /// Whether the frames match as if neither had moved, although a displacement is expected: dirt on the lens.
    fn is_still(&self, found: &Similarity, expected: &Similarity) -> bool {
        let extent = self.new.fine.columns().min(self.new.fine.rows()) as f64 * self.new.pitch_m;
        let displacement = |s: &Similarity| s.shift().norm() + 0.3 * extent * s.turn_rad().abs();
        displacement(found) < 3.0 * self.new.pitch_m && displacement(expected) > 8.0 * self.new.pitch_m
    }

    /// The best peak, and the similarity at it in metres.
    fn search(&mut self, old: &Scales, expected: &Expected) -> Option<(Similarity, Peak)> {
        let mut best = self.peak(old, &expected.similarity, expected.window_m);
        let needs_search =
            best.is_some_and(|(_, peak)| (MIN_SEARCHED..self.gates.confidence).contains(&peak.confidence));
        if needs_search {
            for [turn, scale] in SMALL_SEARCH {
                let change = Similarity::new(turn * expected.spread, (scale * expected.spread).exp(), Vector2::zeros());
                // The middle of the new frame stays where it is in the earlier one.
                let middle = expected.similarity.shift();
                let changed = expected.similarity.after(&change).through(Vector2::zeros(), middle);
                let found = self.peak(old, &changed, expected.window_m);
                let confidence = |found: &Option<(Similarity, Peak)>| found.map_or(0.0, |(_, peak)| peak.confidence);
                best = if confidence(&found) > confidence(&best) { found } else { best };
            }
        }
        best
    }

    fn peak(&mut self, old: &Scales, start: &Similarity, window_m: f64) -> Option<(Similarity, Peak)> {
        let (new_px, old_px) = (2.0 * self.new.pitch_m, 2.0 * old.pitch_m);
        let pixels = between_pixels(start, new_px, old_px);
        let (turned, shift) = (pixels.turned(), pixels.shift());
        let (cos, sin) = (turned.x as f32, turned.y as f32);
        let half = |pixels: usize| pixels as f32 / 2.0 - 0.5;
        let (half_x, half_y) = (half(self.new.coarse.columns()), half(self.new.coarse.rows()));
        let (mid_x, mid_y) = (half(old.coarse.columns()) + shift.x as f32, half(old.coarse.rows()) - shift.y as f32);
        let canvas = self.correlator.canvas(|column, row| {
            let (x, y) = (column as f32 - half_x, half_y - row as f32);
            old.coarse.at(mid_x + cos * x - sin * y, mid_y - sin * x - cos * y)
        });
        let peak = self.correlator.peak(canvas, (window_m / new_px) as f32, self.gates.overlap)?;
        let by = Vector2::new(f64::from(peak.shift_px[0]), -f64::from(peak.shift_px[1])) * new_px;
        let at_peak = start.through(Vector2::zeros(), start.apply(by));
        Some((at_peak, peak))
    }

    fn accepted(&self, fit: &Fit, old: &Scales, expected: &Expected) -> Option<Match> {
        let pixels = self.new.fine.values().len() as f64;
        let strength = fit.correlation * fit.pixels.sqrt();
        let is_good = fit.correlation >= self.gates.refined
            && strength >= self.gates.refined_strength
            && fit.pixels >= f64::from(self.gates.overlap) * 0.8 * pixels;
        if !is_good {
            return None;
        }
        let baseline = fit.similarity.shift().norm();
        let reach = (MAX_HEIGHT_SIGMAS * expected.relief.variance.sqrt() * baseline).clamp(MIN_REACH_PX, MAX_REACH_PX);
        let tiles = match_tiles(&self.fine, &old.fine, &fit.similarity, reach);
        let before = Before { spread: expected.spread, relief: expected.relief };
        let agreed = agree(&tiles, &fit.similarity, &before).unwrap_or_else(|| Agreed::of_fit(fit, &before));
        Some(Match {
            similarity: from_pixels(&agreed.similarity, self.new.pitch_m, old.pitch_m),
            anchor: agreed.anchor * self.new.pitch_m,
            turn_sigma: agreed.turn_sigma,
            log_scale_sigma: agreed.log_scale_sigma,
            along: agreed.along,
            along_sigma_m: agreed.along_sigma * old.pitch_m,
            across_sigma_m: agreed.across_sigma * old.pitch_m,
            relief: agreed.relief,
        })
    }
}

/// A similarity in metres as one from pixels of the new to pixels of the old plane.
fn between_pixels(metres: &Similarity, new_px: f64, old_px: f64) -> Similarity {
    Similarity::new(metres.turn_rad(), metres.scale() * new_px / old_px, metres.shift() / old_px)
}

fn from_pixels(pixels: &Similarity, new_px: f64, old_px: f64) -> Similarity {
    Similarity::new(pixels.turn_rad(), pixels.scale() * old_px / new_px, pixels.shift() * old_px)
}

/// Standard deviation of a frame's heading and log scale once it is placed.
pub(crate) const PLACED_SPREAD: f64 = 0.001;
/// Slopes distort tiles, so that heights also shift frames across the parallax: by this share of the variance along it.
const DISTORTED: f64 = 0.1;

/// A match with a frame that is placed.
pub(crate) struct Link {
    pub(crate) found: Match,
    pub(crate) pose: FramePose,
}

impl Link {
    pub(crate) fn heading_rad(&self) -> f64 {
        self.pose.heading_rad - self.found.similarity.turn_rad()
    }

    pub(crate) fn log_scale(&self) -> f64 {
        self.pose.log_scale + self.found.similarity.scale().ln()
    }

    /// The place of a new frame with a heading and a scale.
    pub(crate) fn place(&self, heading_rad: f64, log_scale: f64) -> Vector2<f64> {
        let on_map = self.pose.to_map().apply(self.found.similarity.apply(self.found.anchor));
        on_map - direction(heading_rad, log_scale).to_map().apply(self.found.anchor)
    }

    /// Covariance of the place on the map, where the heading and the scale of both frames are uncertain, square metres.
    /// The mean height of the floor is not in it.
    pub(crate) fn covariance_m2(&self) -> Matrix2<f64> {
        let lever2 = self.found.anchor.norm_squared() + self.found.similarity.apply(self.found.anchor).norm_squared();
        Matrix2::identity() * (self.found.across_sigma_m.powi(2) + PLACED_SPREAD.powi(2) * lever2)
    }

    /// The share of the variance of heights by which their mean over the overlap varies.
    pub(crate) fn alike(&self) -> f64 {
        let found = &self.found;
        let height2 = (found.along_sigma_m.powi(2) - found.across_sigma_m.powi(2)).max(0.0);
        height2 / (found.relief * found.similarity.shift().norm_squared()).max(1e-12)
    }

    /// The covariance of the place by the mean height of the floor, square metres. `relief` is the variance of heights in
    /// all frames: by that of a single link, links over low ground would count more than those over high ground.
    pub(crate) fn parallax_m2(&self, relief: f64) -> Matrix2<f64> {
        let along = Rotation2::new(-self.pose.heading_rad) * self.found.along;
        (along * along.transpose() + Matrix2::identity() * DISTORTED)
            * (relief * self.alike() * self.found.similarity.shift().norm_squared())
    }
}

/// A pose at the origin.
fn direction(heading_rad: f64, log_scale: f64) -> FramePose {
    FramePose::new(MapPoint::new(0.0, 0.0), heading_rad, log_scale)
}

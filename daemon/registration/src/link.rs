//! A match of a new frame with one that is placed, and where it places the new frame.

use crate::pair::Match;
use crate::pose::FramePose;
use nalgebra::{Matrix2, Rotation2, Vector2};
use scenecast_protocol::coordinates::MapPoint;

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

//! The track of the last minutes, and its corners.

use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Trail, TrailCorner};
use std::collections::VecDeque;
use std::time::Duration;

/// The longest time before a pose that a trail can name.
const MEMORY: Duration = Duration::from_secs(255);
/// The least distance and the least time between two places that are kept.
const SPACING: (f64, Duration) = (0.15, Duration::from_millis(250));
/// Between two corners the track is straight within this distance, metres.
const TOLERANCE_M: f64 = 0.2;

/// The places of the last minutes in the map frame, the earliest first.
#[derive(Debug, Default)]
pub(crate) struct RecentTrack(VecDeque<(Instant, MapPoint)>);

impl RecentTrack {
    /// The vehicle is at `place`.
    pub(crate) fn handle_place(&mut self, place: MapPoint, now: Instant) {
        let is_near = |&(at, last): &(Instant, MapPoint)| last.distance_m(place) < SPACING.0 || now < at + SPACING.1;
        if !self.0.back().is_some_and(is_near) {
            self.0.push_back((now, place));
        }
        let is_old = |&(at, _): &(Instant, MapPoint)| now.since(at) > MEMORY;
        while self.0.front().is_some_and(is_old) {
            self.0.pop_front();
        }
    }

    /// The corners of the track to `position`, the latest first.
    pub(crate) fn corners(&self, position: MapPoint, now: Instant) -> Vec<TrailCorner> {
        let track: Vec<_> = self.0.iter().copied().chain([(now, position)]).collect();
        let corner = |(at, place): (Instant, MapPoint)| {
            let ago_s = now.since(at).as_secs_f64().round().min(255.0) as u8;
            TrailCorner { ago_s, place }
        };
        corners_of(&track, TOLERANCE_M).into_iter().rev().take(Trail::MAX_CORNERS).map(corner).collect()
    }
}

/// The corners between the ends of a track, in their order.
///
/// D. H. Douglas, T. K. Peucker, "Algorithms for the reduction of the number of points required to represent a digitized line
/// or its caricature", Cartographica 10 (1973) 112-122.
fn corners_of(track: &[(Instant, MapPoint)], tolerance_m: f64) -> Vec<(Instant, MapPoint)> {
    let mut corners = Vec::new();
    // Parts of the track whose corners are still to be found, the last one first; the depth of a recursion could be the
    // length of the track.
    let mut parts = vec![(0, track.len().saturating_sub(1), false)];
    while let Some((first, last, is_split)) = parts.pop() {
        if is_split {
            corners.push(track[first]);
            continue;
        }
        let distance = |i: &usize| off_line(track[*i].1, track[first].1, track[last].1);
        let farthest = (first + 1..last).max_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(split) = farthest.filter(|i| distance(i) > tolerance_m) {
            parts.extend([(split, last, false), (split, split, true), (first, split, false)]);
        }
    }
    corners
}

/// The distance of a place from the line between two others, metres.
fn off_line(place: MapPoint, from: MapPoint, to: MapPoint) -> f64 {
    let (dx, dy) = (to.x_m - from.x_m, to.y_m - from.y_m);
    let (px, py) = (place.x_m - from.x_m, place.y_m - from.y_m);
    let squared = dx * dx + dy * dy;
    let along = if squared > 0.0 { ((px * dx + py * dy) / squared).clamp(0.0, 1.0) } else { 0.0 };
    (px - along * dx).hypot(py - along * dy)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half a metre each second through places.
    fn travel(places: &[(f64, f64)]) -> (RecentTrack, MapPoint, Instant) {
        let (mut track, mut now) = (RecentTrack::default(), Instant::ZERO);
        let mut at = MapPoint::new(places[0].0, places[0].1);
        for &(x_m, y_m) in &places[1..] {
            let to = MapPoint::new(x_m, y_m);
            let steps = (at.distance_m(to) / 0.05).round() as u32;
            for step in 1..=steps {
                let t = f64::from(step) / f64::from(steps);
                now = now + Duration::from_millis(100);
                track.handle_place(MapPoint::new(at.x_m + t * (to.x_m - at.x_m), at.y_m + t * (to.y_m - at.y_m)), now);
            }
            at = to;
        }
        (track, at, now)
    }

    #[test]
    fn a_lawnmower_has_the_corners_of_its_legs() {
        let (track, at, now) = travel(&[(0.0, 0.0), (20.0, 0.0), (20.0, 4.0), (0.0, 4.0)]);
        let corners = track.corners(at, now);
        assert_eq!(corners.len(), 2, "{corners:?}");
        for (corner, (ago_s, x, y)) in corners.iter().zip([(40, 20.0, 4.0), (48, 20.0, 0.0)]) {
            assert!(corner.place.distance_m(MapPoint::new(x, y)) < 0.2, "{corner:?}");
            assert!(corner.ago_s.abs_diff(ago_s) <= 1, "{corner:?}");
        }
    }

    #[test]
    fn a_straight_track_and_a_vehicle_that_stays_have_no_corner() {
        let (track, at, now) = travel(&[(0.0, 0.0), (300.0, 40.0)]);
        assert_eq!(track.corners(at, now), []);
        assert!(track.0.len() <= 1020, "{}", track.0.len());
        let mut still = RecentTrack::default();
        for second in 0..1000 {
            still.handle_place(MapPoint::new(3.0, 3.0), Instant::from_secs_f64(f64::from(second)));
        }
        assert_eq!(still.corners(MapPoint::new(3.0, 3.0), Instant::from_secs_f64(1000.0)), []);
    }

    #[test]
    fn a_winding_track_has_no_more_corners_than_a_trail() {
        let places: Vec<_> = (0..40).map(|i| (f64::from(i), f64::from(i % 2) * 2.5)).collect();
        let (track, at, now) = travel(&places);
        let corners = track.corners(at, now);
        assert_eq!(corners.len(), Trail::MAX_CORNERS);
        assert!(corners.is_sorted_by_key(|corner| corner.ago_s), "{corners:?}");
    }
}

//! The outlines that limit where the vehicle may go.

use scenecast_core::Area;
use scenecast_protocol::directive::{Fence, Polygon};

/// East and north of the origin, metres.
pub type Point = (f64, f64);

/// Fence and keep-outs in metres, and the clearance that the vehicle keeps from them for its size and its turns.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bounds {
    fence: Option<Vec<Point>>,
    keep_outs: Vec<Vec<Point>>,
    clearance_m: f64,
}

impl Bounds {
    /// Takes a fence that has passed [`Fence::check`].
    pub fn new(fence: &Fence, clearance_m: f64) -> Self {
        let metres = |p: &Polygon| p.0.iter().map(|v| v.to_world().xy()).collect();
        Self {
            fence: fence.fence.as_ref().map(metres),
            keep_outs: fence.keep_outs.iter().map(metres).collect(),
            clearance_m,
        }
    }

    /// The number of outlines.
    pub fn outlines(&self) -> usize {
        self.keep_outs.len() + usize::from(self.fence.is_some())
    }

    /// The smallest rectangle around all places within the fence that a plan may contain; `None` without a fence.
    pub fn extent(&self) -> Option<Area> {
        let corners = self.fence.as_ref()?;
        let edge = |of: fn(&Point) -> f64, pick: fn(f64, f64) -> f64| corners.iter().map(of).reduce(pick);
        let [west, south] = [edge(|p| p.0, f64::min)?, edge(|p| p.1, f64::min)?];
        let [east, north] = [edge(|p| p.0, f64::max)?, edge(|p| p.1, f64::max)?];
        Some(Area { west, south, east, north }.shrunk(self.clearance_m))
    }

    /// Whether the vehicle may be at a place. The clearance does not count.
    pub fn holds(&self, at: Point) -> bool {
        self.fence.as_ref().is_none_or(|f| contains(f, at)) && !self.keep_outs.iter().any(|k| contains(k, at))
    }

    /// Whether a plan may contain a place. The clearance counts.
    pub fn allows(&self, at: Point) -> bool {
        self.holds(at) && self.is_clear(at, at)
    }

    /// Whether a plan may contain the straight line between two places. The clearance counts.
    pub fn allows_leg(&self, from: Point, to: Point) -> bool {
        self.holds(from) && self.holds(to) && self.is_clear(from, to)
    }

    /// Whether the straight line from a place within the clearance to an allowed place meets no outline.
    pub fn allows_exit(&self, from: Point, to: Point) -> bool {
        self.holds(from) && self.allows(to) && !self.edges().any(|(a, b)| segments_meet(from, to, a, b))
    }

    fn is_clear(&self, from: Point, to: Point) -> bool {
        self.edges().all(|(a, b)| distance_of_segments(from, to, a, b) >= self.clearance_m)
    }

    fn edges(&self) -> impl Iterator<Item = (Point, Point)> + '_ {
        self.fence.iter().chain(&self.keep_outs).flat_map(|o| o.iter().copied().zip(o.iter().copied().cycle().skip(1)))
    }
}

pub fn distance(a: Point, b: Point) -> f64 {
    (a.0 - b.0).hypot(a.1 - b.1)
}

fn contains(outline: &[Point], (x, y): Point) -> bool {
    let edges = outline.iter().zip(outline.iter().cycle().skip(1));
    edges.fold(false, |inside, (a, b)| {
        let spans = (a.1 > y) != (b.1 > y);
        inside ^ (spans && x < (b.0 - a.0) * (y - a.1) / (b.1 - a.1) + a.0)
    })
}

fn distance_of_segments(a: Point, b: Point, c: Point, d: Point) -> f64 {
    if segments_meet(a, b, c, d) {
        return 0.0;
    }
    let ends = [to_segment(a, c, d), to_segment(b, c, d), to_segment(c, a, b), to_segment(d, a, b)];
    ends.into_iter().fold(f64::INFINITY, f64::min)
}

fn segments_meet(a: Point, b: Point, c: Point, d: Point) -> bool {
    let side = |p: Point, q: Point, r: Point| (q.0 - p.0) * (r.1 - p.1) - (q.1 - p.1) * (r.0 - p.0);
    side(a, b, c) * side(a, b, d) <= 0.0 && side(c, d, a) * side(c, d, b) <= 0.0 && boxes_meet(a, b, c, d)
}

fn boxes_meet(a: Point, b: Point, c: Point, d: Point) -> bool {
    let meet = |p: f64, q: f64, r: f64, s: f64| p.min(q) <= r.max(s) && r.min(s) <= p.max(q);
    meet(a.0, b.0, c.0, d.0) && meet(a.1, b.1, c.1, d.1)
}

/// The distance in metres between a place and a segment.
pub(super) fn to_segment(p: Point, a: Point, b: Point) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let length = dx * dx + dy * dy;
    let t = if length > 0.0 { (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / length).clamp(0.0, 1.0) } else { 0.0 };
    distance(p, (a.0 + t * dx, a.1 + t * dy))
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::coordinates::DecimetrePoint;

    fn square(x: i32, y: i32, side: i32) -> Polygon {
        let place = |x, y| DecimetrePoint::new(10 * x, 10 * y);
        Polygon(vec![place(x, y), place(x + side, y), place(x + side, y + side), place(x, y + side)])
    }

    #[test]
    fn the_vehicle_keeps_clear_of_fence_and_keep_outs() {
        let fence = Fence { fence: Some(square(0, 0, 100)), keep_outs: vec![square(40, 40, 20)], return_point: None };
        let bounds = Bounds::new(&fence, 2.0);
        assert!(bounds.allows((10.0, 10.0)) && bounds.allows((38.0, 50.0)));
        assert!(!bounds.allows((1.0, 50.0)) && bounds.holds((1.0, 50.0)), "within the margin");
        assert!(!bounds.holds((50.0, 50.0)) && !bounds.holds((-1.0, 50.0)));
        assert!(bounds.allows_leg((10.0, 30.0), (90.0, 30.0)));
        assert!(!bounds.allows_leg((10.0, 39.0), (90.0, 39.0)), "one metre from the keep-out");
        assert!(!bounds.allows_leg((10.0, 50.0), (90.0, 50.0)), "through the keep-out");
        assert!(bounds.allows_exit((1.0, 50.0), (5.0, 50.0)) && !bounds.allows_exit((39.0, 50.0), (70.0, 50.0)));
        assert!(Bounds::default().allows_leg((-1e6, 0.0), (1e6, 0.0)));
    }
}

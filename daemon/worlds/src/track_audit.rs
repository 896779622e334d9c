//! An audit of a vehicle's track against a fence. It shares no code with the planners, so that it finds their errors.

use scenecast_protocol::directive::{Fence, Polygon};

/// Distance between two samples of a track, metres.
const SAMPLE_M: f64 = 0.05;

/// Number of samples of a track, at most 5 cm apart, that are outside the fence or in a keep-out.
pub fn stretches_outside(track: &[(f64, f64)], fence: &Fence) -> usize {
    let mut outside = 0;
    for leg in track.windows(2) {
        let ((ax, ay), (bx, by)) = (leg[0], leg[1]);
        let parts = ((bx - ax).hypot(by - ay) / SAMPLE_M).ceil().max(1.0) as u32;
        let place = |i: u32| {
            let t = f64::from(i) / f64::from(parts);
            (ax + t * (bx - ax), ay + t * (by - ay))
        };
        outside += (0..=parts).map(place).filter(|&p| is_forbidden(p, fence)).count();
    }
    outside
}

pub fn length_m(track: &[(f64, f64)]) -> f64 {
    track.windows(2).map(|leg| (leg[1].0 - leg[0].0).hypot(leg[1].1 - leg[0].1)).sum()
}

fn is_forbidden(p: (f64, f64), fence: &Fence) -> bool {
    fence.fence.as_ref().is_some_and(|f| winding(f, p) == 0) || fence.keep_outs.iter().any(|k| winding(k, p) != 0)
}

/// Winding number of an outline around a point, by the sum of the angles that its edges subtend.
fn winding(outline: &Polygon, (x, y): (f64, f64)) -> i32 {
    let angle = |place: &scenecast_protocol::coordinates::DecimetrePoint| {
        (place.to_world().north_m - y).atan2(place.to_world().east_m - x)
    };
    let turns = outline.0.iter().zip(outline.0.iter().cycle().skip(1)).map(|(a, b)| {
        let turn = angle(b) - angle(a);
        turn - std::f64::consts::TAU * (turn / std::f64::consts::TAU).round()
    });
    (turns.sum::<f64>() / std::f64::consts::TAU).round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::coordinates::DecimetrePoint;

    #[test]
    fn positions_outside_or_in_a_keep_out_are_counted() {
        let square = |x: i32, side: i32| {
            let place = |x, y| DecimetrePoint::new(10 * x, 10 * y);
            Polygon(vec![place(x, x), place(x + side, x), place(x + side, x + side), place(x, x + side)])
        };
        let fence = Fence { fence: Some(square(0, 20)), keep_outs: vec![square(8, 4)], return_point: None };
        assert_eq!(stretches_outside(&[(1.0, 1.0), (19.0, 1.0), (19.0, 19.0)], &fence), 0);
        assert!(stretches_outside(&[(1.0, 10.0), (19.0, 10.0)], &fence) > 70, "four metres through the keep-out");
        assert!(stretches_outside(&[(1.0, 1.0), (-1.0, 1.0)], &fence) > 15);
        assert!((length_m(&[(0.0, 0.0), (3.0, 4.0), (3.0, 5.0)]) - 6.0).abs() < 1e-9);
    }
}

//! Goals for a surface vehicle that stays above the vehicle.

/// Keeps a surface vehicle near the point above the vehicle.
///
/// It keeps a stand-off, because directly above the vehicle a USBL head measures the direction worst and the
/// noise of the ship is loudest. It moves only when the distance leaves a dead band, so that the engines are
/// silent most of the time.
#[derive(Debug, Clone)]
pub struct Follow {
    stand_off_m: f64,
    dead_band_m: f64,
    ordered: Option<(f64, f64)>,
}

impl Follow {
    /// Seconds by which the vehicle's motion is extrapolated.
    const AHEAD_S: f64 = 20.0;

    /// Keeps `stand_off_m` metres from the point above the vehicle, within `dead_band_m` metres.
    pub fn new(stand_off_m: f64, dead_band_m: f64) -> Self {
        Self { stand_off_m, dead_band_m, ordered: None }
    }

    /// The next goal of the surface vehicle, if it differs from the last one.
    pub fn next(&mut self, own: (f64, f64), vehicle: (f64, f64), velocity: (f64, f64)) -> Option<(f64, f64)> {
        let below = (vehicle.0 + velocity.0 * Self::AHEAD_S, vehicle.1 + velocity.1 * Self::AHEAD_S);
        let off = |at: (f64, f64)| ((at.0 - below.0).hypot(at.1 - below.1) - self.stand_off_m).abs();
        if off(self.ordered.unwrap_or(own)) <= self.dead_band_m {
            return None;
        }
        let (dx, dy) = (own.0 - below.0, own.1 - below.1);
        let distance = dx.hypot(dy);
        // Directly above the vehicle every direction is equally good.
        let (ux, uy) = if distance > 0.1 { (dx / distance, dy / distance) } else { (0.0, 1.0) };
        let target = (below.0 + ux * self.stand_off_m, below.1 + uy * self.stand_off_m);
        self.ordered = Some(target);
        Some(target)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ship_moves_only_when_the_vehicle_is_far() {
        let mut follow = Follow::new(20.0, 10.0);
        assert_eq!(follow.next((25.0, 0.0), (0.0, 0.0), (0.0, 0.0)), None, "within the dead band");
        assert_eq!(follow.next((100.0, 0.0), (0.0, 0.0), (0.0, 0.0)), Some((20.0, 0.0)));
        assert_eq!(follow.next((90.0, 0.0), (1.0, 0.0), (0.0, 0.0)), None, "it is on its way there");
        assert_eq!(follow.next((20.0, 0.0), (-40.0, 0.0), (0.0, 0.0)), Some((-20.0, 0.0)));
        assert_eq!(follow.next((-20.0, 0.0), (-20.0, 0.0), (0.0, 0.0)), Some((-20.0, 20.0)), "too near");
    }

    #[test]
    fn the_goal_lies_ahead_of_a_moving_vehicle() {
        let mut follow = Follow::new(10.0, 5.0);
        assert_eq!(follow.next((0.0, 0.0), (100.0, 0.0), (1.0, 0.0)), Some((110.0, 0.0)));
    }
}

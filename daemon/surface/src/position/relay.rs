//! The relay estimates the position of the surface and of the vehicles, and gives goals to a surface vehicle that stays above
//! one.

use super::filter::{Estimate, MeasurementVerdict, PlaneFilter};
use super::usbl::{Mounting, UsblFault, UsblSighting, offset};
use scenecast_core::gps::{Gps, GpsFix, GpsLanguage};
use scenecast_core::{LatLon, TangentPlane};
use scenecast_protocol::coordinates::WorldPoint;
use scenecast_protocol::directive::Fix;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use std::collections::BTreeMap;
use std::time::Duration;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelayConfig {
    /// Origin of the world frame; `None`: the first good position.
    pub origin: Option<LatLon>,
    pub language: GpsLanguage,
    pub mounting: Mounting,
    /// Maximum standard deviation of a fix that is sent, metres.
    pub max_sigma_m: f64,
    /// Minimum time between two fixes of a vehicle.
    pub period: Duration,
}

/// The reason why a measurement gave no fix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum RelayFault {
    /// The measurement gives no position.
    Usbl(UsblFault),
    /// The position of the surface is unknown, or was at that time.
    NoGps,
    /// It is too far from the estimate.
    Outlier,
    /// Its standard deviation is too large.
    TooVague,
    TooOld,
}

impl RelayFault {
    pub fn name(self) -> &'static str {
        match self {
            Self::Usbl(fault) => fault.name(),
            Self::NoGps => "no_gps",
            Self::Outlier => "outlier",
            Self::TooVague => "too_uncertain",
            Self::TooOld => "too_old",
        }
    }
}

/// The estimate of a vehicle.
#[derive(Debug)]
struct TrackedVehicle {
    filter: PlaneFilter,
    depth: Option<(f64, Instant)>,
    sighted: Option<Instant>,
    fixed: Option<Instant>,
}

/// Turns GPS, heading and USBL measurements into fixes. All times are of one clock.
#[derive(Debug)]
pub struct Relay {
    config: RelayConfig,
    plane: Option<TangentPlane>,
    /// The position since which all agree with it, while there is no origin.
    first: Option<GpsFix>,
    gps: Gps,
    compass: Gps,
    own: PlaneFilter,
    own_at: Option<Instant>,
    gps_outliers: u64,
    vehicles: BTreeMap<Address, TrackedVehicle>,
    faults: BTreeMap<RelayFault, u64>,
    fixes: u64,
}

impl Relay {
    /// Without a GPS position for this time there are no fixes.
    const GPS_TIMEOUT: Duration = Duration::from_secs(10);
    /// Maximum age of a measurement. The vehicle refuses fixes older than 120 s, and the link needs time too.
    const MAX_AGE: Duration = Duration::from_secs(60);
    /// Positions must agree for this time before one of them is the origin: the first ones of a receiver may be anywhere.
    const ORIGIN_AFTER: Duration = Duration::from_secs(5);
    /// Maximum age of a reported depth.
    const DEPTH_TIMEOUT: Duration = Duration::from_secs(60);

    pub fn new(config: RelayConfig) -> Self {
        Self {
            config,
            plane: config.origin.map(TangentPlane::new),
            first: None,
            gps: Gps::new(config.language),
            compass: Gps::new(GpsLanguage::Nmea),
            own: PlaneFilter::new(0.3),
            own_at: None,
            gps_outliers: 0,
            vehicles: BTreeMap::new(),
            faults: BTreeMap::new(),
            fixes: 0,
        }
    }

    /// The world frame, once its origin is known.
    pub fn plane(&self) -> Option<&TangentPlane> {
        self.plane.as_ref()
    }

    /// The GPS receiver, for its status.
    pub fn gps(&self) -> &Gps {
        &self.gps
    }

    /// GPS positions that the filter refused.
    pub fn gps_outliers(&self) -> u64 {
        self.gps_outliers
    }

    /// Measurements that gave no fix, by reason.
    pub fn faults(&self) -> impl Iterator<Item = (RelayFault, u64)> + '_ {
        self.faults.iter().map(|(&f, &n)| (f, n))
    }

    pub fn fixes(&self) -> u64 {
        self.fixes
    }

    /// The position of the surface in the world frame; `None` without a fresh GPS position.
    pub fn own(&self, at: Instant) -> Option<Estimate> {
        let last = self.own_at?;
        let is_fresh = at.since(last) < Self::GPS_TIMEOUT;
        is_fresh.then(|| self.own.predict(at.as_secs_f64())).flatten()
    }

    /// The heading of the surface clockwise from true north, radians.
    pub fn heading_rad(&self, now: Instant) -> Option<f64> {
        self.compass.heading_rad(now).or_else(|| self.gps.heading_rad(now))
    }

    /// The position of a vehicle, and its velocity east and north in m/s; `None` without a
    /// measurement within the last minute.
    pub fn vehicle(&self, vehicle: Address, now: Instant) -> Option<(Estimate, (f64, f64))> {
        let seen = self.vehicles.get(&vehicle)?;
        let is_fresh = now.since(seen.sighted?) < Self::MAX_AGE;
        let estimate = seen.filter.predict(now.as_secs_f64()).filter(|_| is_fresh)?;
        Some((estimate, seen.filter.velocity()?))
    }

    /// The connection to the GPS was opened. Returns the bytes to send to the receiver.
    pub fn handle_gps_open(&mut self) -> &'static [u8] {
        self.gps.handle_open()
    }

    pub fn handle_gps(&mut self, bytes: &[u8], now: Instant) {
        for fix in self.gps.handle_bytes(bytes, now) {
            let Some(plane) = self.plane_at(&fix) else { continue };
            let (x, y) = plane.to_plane(fix.place);
            match self.own.update(&Estimate::round(x, y, fix.sigma_m), now.as_secs_f64()) {
                MeasurementVerdict::Outlier => self.gps_outliers += 1,
                MeasurementVerdict::Used | MeasurementVerdict::Restarted => self.own_at = Some(now),
            }
        }
    }

    /// What people should read about the receiver.
    pub fn poll_gps_note(&mut self) -> Option<String> {
        self.gps.poll_note()
    }

    /// The world frame; a position of the surface becomes its origin once it agrees with those before.
    fn plane_at(&mut self, fix: &GpsFix) -> Option<TangentPlane> {
        if self.plane.is_none() {
            let first = *self.first.get_or_insert(*fix);
            // It is open which place is right while another one returns.
            if !first.leads_to(fix) || self.gps.is_contested() {
                self.first = Some(*fix);
            } else if fix.at.since(first.at) >= Self::ORIGIN_AFTER {
                self.plane = Some(TangentPlane::new(fix.place));
            }
        }
        self.plane
    }

    /// Takes bytes of a separate compass.
    pub fn handle_compass(&mut self, bytes: &[u8], now: Instant) {
        self.compass.handle_bytes(bytes, now);
    }

    /// Takes the reported depth of a vehicle, metres below the surface.
    pub fn handle_depth(&mut self, vehicle: Address, depth_m: f64, now: Instant) {
        if depth_m.is_finite() {
            self.tracked(vehicle).depth = Some((depth_m, now));
        }
    }

    fn tracked(&mut self, vehicle: Address) -> &mut TrackedVehicle {
        let new = || TrackedVehicle { filter: PlaneFilter::new(0.05), depth: None, sighted: None, fixed: None };
        self.vehicles.entry(vehicle).or_insert_with(new)
    }

    /// Takes a USBL measurement of a vehicle. Returns the fix to send, if one is due.
    ///
    /// The fix is the single measurement and not the filter's estimate, because the vehicle has its own filter, and its
    /// odometry is better than any prediction from here.
    pub fn handle_usbl(
        &mut self,
        vehicle: Address,
        sighting: &UsblSighting,
        now: Instant,
    ) -> Result<Option<Fix>, RelayFault> {
        let fix = self.fuse(vehicle, sighting, now);
        match fix {
            Err(fault) => *self.faults.entry(fault).or_default() += 1,
            Ok(fix) => self.fixes += u64::from(fix.is_some()),
        }
        fix
    }

    fn fuse(&mut self, vehicle: Address, sighting: &UsblSighting, now: Instant) -> Result<Option<Fix>, RelayFault> {
        let age_s = if sighting.age_s.is_finite() { sighting.age_s.max(0.0) } else { f64::MAX };
        if age_s > Self::MAX_AGE.as_secs_f64() {
            return Err(RelayFault::TooOld);
        }
        let taken = now - Duration::from_secs_f64(age_s);
        let own = self.own(now).ok_or(RelayFault::NoGps)?;
        let (vx, vy) = self.own.velocity().unwrap_or_default();
        let heading = self.heading_rad(now);
        let mounting = self.config.mounting;
        let seen = self.tracked(vehicle);
        let depth = seen.depth.filter(|(_, at)| now.since(*at) < Self::DEPTH_TIMEOUT).map(|(d, _)| d);
        let away = offset(sighting, &mounting, heading, depth).map_err(RelayFault::Usbl)?;
        let [xx, xy, yy] = away.cov_m2;
        let [own_xx, _, own_yy] = own.cov_m2;
        let place = Estimate {
            x_m: own.x_m - vx * age_s + away.x_m,
            y_m: own.y_m - vy * age_s + away.y_m,
            cov_m2: [xx + own_xx, xy, yy + own_yy],
        };
        if seen.filter.update(&place, taken.as_secs_f64()) == MeasurementVerdict::Outlier {
            return Err(RelayFault::Outlier);
        }
        seen.sighted = Some(now);
        let is_due = seen.fixed.is_none_or(|at| now.since(at) + Duration::from_millis(100) >= self.config.period);
        if place.sigma_m() > self.config.max_sigma_m {
            return Err(RelayFault::TooVague);
        }
        if !is_due {
            return Ok(None);
        }
        self.tracked(vehicle).fixed = Some(now);
        let position = WorldPoint { east_m: place.x_m, north_m: place.y_m };
        Ok(Some(Fix { position, sigma_m: place.sigma_m(), age_s }))
    }
}

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
    use proptest::prelude::*;
    use scenecast_core::nmea;

    const ORIGIN: LatLon = LatLon { lat_deg: 29.5, lon_deg: 34.92 };

    fn relay() -> Relay {
        Relay::new(RelayConfig {
            origin: Some(ORIGIN),
            language: GpsLanguage::Nmea,
            mounting: Mounting::default(),
            max_sigma_m: 50.0,
            period: Duration::from_secs(10),
        })
    }

    fn vehicle() -> Address {
        Address::vehicle(1).unwrap()
    }

    fn at(s: f64) -> Instant {
        Instant::from_secs_f64(1000.0 + s)
    }

    /// A GPS at `(x, y)` that stays for `seconds`, long enough to be trusted.
    fn anchored(relay: &mut Relay, x: f64, y: f64, seconds: u32) {
        let place = TangentPlane::new(ORIGIN).to_place(x, y);
        for s in 0..seconds {
            let body = format!("GPGGA,1200{s:02}.00,{},4,08,0.5,0,M,0,M,,", nmea::place_fields(place));
            relay.handle_gps(nmea::line(&body).as_bytes(), at(f64::from(s)));
        }
    }

    fn sighting(east: f64, north: f64, down: f64) -> UsblSighting {
        UsblSighting {
            range_m: (east * east + north * north + down * down).sqrt(),
            bearing_rad: east.atan2(north),
            elevation_rad: (-down).atan2(east.hypot(north)),
            accuracy_m: 1.0,
            age_s: 0.8,
        }
    }

    #[test]
    fn gps_and_usbl_give_a_fix_with_its_age_and_its_uncertainty() {
        let mut relay = relay();
        assert_eq!(relay.handle_usbl(vehicle(), &sighting(30.0, 40.0, 20.0), at(0.0)), Err(RelayFault::NoGps));
        anchored(&mut relay, 100.0, -50.0, 30);
        let fix = relay.handle_usbl(vehicle(), &sighting(30.0, 40.0, 20.0), at(29.0)).unwrap().unwrap();
        assert!((fix.position.east_m - 130.0).abs() < 0.5 && (fix.position.north_m + 10.0).abs() < 0.5, "{fix:?}");
        assert!((1.0..2.0).contains(&fix.sigma_m) && fix.age_s == 0.8, "{fix:?}");
        assert_eq!(relay.handle_usbl(vehicle(), &sighting(30.0, 40.0, 20.0), at(30.0)), Ok(None), "one in 10 s");
    }

    #[test]
    fn echoes_and_a_lost_gps_are_counted_and_give_no_fix() {
        let mut relay = relay();
        anchored(&mut relay, 0.0, 0.0, 30);
        relay.handle_depth(vehicle(), 21.0, at(29.0));
        for s in 0..10 {
            let _ = relay.handle_usbl(vehicle(), &sighting(30.0, 40.0, 20.0), at(29.0 + f64::from(s) * 0.1));
        }
        let echo = sighting(-40.0, 30.0, 20.0);
        assert_eq!(relay.handle_usbl(vehicle(), &echo, at(30.5)), Err(RelayFault::Outlier));
        let from_above = sighting(30.0, 40.0, -20.0);
        assert_eq!(relay.handle_usbl(vehicle(), &from_above, at(30.6)), Err(RelayFault::Usbl(UsblFault::Depth)));
        let old = UsblSighting { age_s: 300.0, ..sighting(30.0, 40.0, 20.0) };
        assert_eq!(relay.handle_usbl(vehicle(), &old, at(31.0)), Err(RelayFault::TooOld));
        assert_eq!(relay.handle_usbl(vehicle(), &sighting(30.0, 40.0, 20.0), at(60.0)), Err(RelayFault::NoGps));
        let counted: Vec<_> = relay.faults().map(|(f, n)| (f.name(), n)).collect();
        assert_eq!(counted, [("depth", 1), ("no_gps", 1), ("outlier", 1), ("too_old", 1)]);
    }

    #[test]
    fn the_origin_is_where_positions_agree_not_the_first_position() {
        let mut relay = Relay::new(RelayConfig { origin: None, ..relay().config });
        let report = |relay: &mut Relay, lat_deg: f64, s: u32| {
            let place = nmea::place_fields(LatLon { lat_deg, lon_deg: 34.92 });
            let body = format!("GPGGA,1200{s:02}.00,{place},1,08,1.0,0,M,0,M,,");
            relay.handle_gps(nmea::line(&body).as_bytes(), at(f64::from(s)));
            relay.plane().map(|plane| (plane.origin().lat_deg * 10.0).round())
        };
        // The first two positions are those of the last harbour.
        let origins: Vec<_> = (0..30).map(|s| report(&mut relay, if s < 2 { 30.0 } else { 29.5 }, s)).collect();
        let first = origins.iter().position(Option::is_some).unwrap();
        assert!((10..20).contains(&first) && origins[first..].iter().all(|lat| *lat == Some(295.0)), "{origins:?}");
    }

    proptest! {
        #[test]
        fn any_sighting_gives_a_finite_fix_or_a_fault(numbers: [f64; 5]) {
            let mut relay = relay();
            anchored(&mut relay, 0.0, 0.0, 5);
            let [range_m, bearing_rad, elevation_rad, accuracy_m, age_s] = numbers;
            let s = UsblSighting { range_m, bearing_rad, elevation_rad, accuracy_m, age_s };
            if let Ok(Some(fix)) = relay.handle_usbl(vehicle(), &s, at(5.0)) {
                prop_assert!(fix.position.east_m.is_finite() && fix.position.north_m.is_finite() && fix.sigma_m.is_finite());
            }
        }
    }

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

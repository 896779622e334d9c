//! NMEA sentences of a simulated GPS receiver and a simulated compass.

use scenecast_core::{LatLon, TangentPlane, nmea};
use sim_channel::RandomStream;

/// Standard deviation of the compass, degrees.
const COMPASS_SIGMA_DEG: f64 = 0.5;

#[derive(Debug, Clone, Copy)]
pub struct Receiver {
    /// Origin of the world frame.
    pub origin: LatLon,
    /// Standard deviation of the white noise, and of an error that changes over minutes, metres.
    pub sigma_m: f64,
    /// Reported quality: dilution of precision, and whether the receiver uses corrections.
    pub hdop: f64,
    pub is_corrected: bool,
}

/// Writes sentences, with random errors of its own.
#[derive(Debug)]
pub struct Instruments {
    receiver: Receiver,
    plane: TangentPlane,
    rng: RandomStream,
    slow_error: (f64, f64),
}

impl Instruments {
    pub fn new(receiver: Receiver, seed: u64) -> Self {
        let plane = TangentPlane::new(receiver.origin);
        Self { receiver, plane, rng: RandomStream::new(seed, &[9]), slow_error: (0.0, 0.0) }
    }

    /// Position and heading as NMEA 0183, once a second; `astray` is an additional error of the receiver, metres.
    pub fn report(&mut self, at: (f64, f64), heading_rad: f64, astray: (f64, f64), second: u32) -> String {
        let [a, b, c, d, e] = [(); 5].map(|()| self.rng.normal());
        let Receiver { sigma_m, hdop, is_corrected, .. } = self.receiver;
        let slow = |error: f64, draw: f64| error * 0.99 + sigma_m * 0.14 * draw;
        self.slow_error = (slow(self.slow_error.0, a), slow(self.slow_error.1, b));
        let x = at.0 + self.slow_error.0 + sigma_m * c + astray.0;
        let y = at.1 + self.slow_error.1 + sigma_m * d + astray.1;
        let place = nmea::place_fields(self.plane.to_place(x, y));
        let (h, m, s) = (second / 3600 % 24, second / 60 % 60, second % 60);
        let quality = if is_corrected { 4 } else { 1 };
        let gga = nmea::line(&format!("GPGGA,{h:02}{m:02}{s:02}.00,{place},{quality},09,{hdop:.1},0.0,M,0.0,M,,"));
        let heading = (heading_rad.to_degrees() + COMPASS_SIGMA_DEG * e).rem_euclid(360.0);
        gga + &nmea::line(&format!("HEHDT,{heading:.2},T"))
    }
}

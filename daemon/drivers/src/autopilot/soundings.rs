//! The depth of a vehicle of NMEA 0183: that of the water less its height above the sea floor.

use super::Outbox;
use super::lasting::Lasting;
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// A height, or a depth of the water, counts for this long.
const LASTS: Duration = Duration::from_secs(2);

/// A depth of which a part is missing for this long is named.
const UNKNOWN_AFTER: Duration = Duration::from_secs(3);

/// A height above the sea floor that is greater than the depth of the water by more is false, metres.
const MARGIN_M: f64 = 1.0;
const FOOT_M: f64 = 0.3048;
const FATHOM_M: f64 = 1.8288;

/// The last soundings, and what is wrong with them.
#[derive(Debug, Default)]
pub(super) struct Soundings {
    /// The last depth of the vehicle, metres.
    depth_m: Option<f64>,
    /// Depth of the water, metres.
    water: Option<(f64, Instant)>,
    /// Height of the transducer above the sea floor, metres.
    height: Option<(f64, Instant)>,
    /// One of both is missing while the other is heard, or was.
    depth_absence: Lasting,
    /// A height is greater than the depth of the water.
    height_trouble: Lasting,
}

/// A length that was measured not long ago.
fn fresh(length: Option<(f64, Instant)>, now: Instant) -> Option<f64> {
    length.filter(|(_, at)| now.since(*at) < LASTS).map(|(m, _)| m)
}

impl Soundings {
    /// DBS, from the surface to the sea floor, and DBT: feet, f, metres, M, fathoms, F. DPT: metres, offset of the transducer.
    pub(super) fn handle(&mut self, formatter: &str, fields: &[&str], outbox: &mut Outbox, now: Instant) {
        let number = |index: usize| fields.get(index)?.parse::<f64>().ok();
        let length = |index: usize, metres: f64| number(index).map(|n| n * metres);
        // Sounders without a bottom send 0 or nothing; some send feet alone.
        let sounding = || length(3, 1.0).or_else(|| length(1, FOOT_M)).or_else(|| length(5, FATHOM_M));
        let known = |m: Option<f64>| m.filter(|m| *m > 0.0 && *m < 12_000.0).map(|m| (m, now));
        match formatter {
            "DBS" => self.set_water(known(sounding()), outbox, now),
            "DBT" => self.set_height(known(sounding()), outbox, now),
            "DPT" => self.set_height(known(number(1)), outbox, now),
            _ => {}
        }
    }

    fn set_water(&mut self, water: Option<(f64, Instant)>, outbox: &mut Outbox, now: Instant) {
        self.water = water.or(self.water);
        if self.is_above_water(self.height, outbox, now) {
            self.height = None;
        }
    }

    fn set_height(&mut self, height: Option<(f64, Instant)>, outbox: &mut Outbox, now: Instant) {
        if !self.is_above_water(height, outbox, now) {
            self.height = height;
            self.height_trouble.end();
        }
    }

    /// Whether a height is greater than the depth of the water, which is named.
    fn is_above_water(&mut self, height: Option<(f64, Instant)>, outbox: &mut Outbox, now: Instant) -> bool {
        let Some((height_m, water_m)) = fresh(height, now).zip(fresh(self.water, now)) else { return false };
        if height_m <= water_m + MARGIN_M {
            return false;
        }
        outbox.count("heights_refused");
        if self.height_trouble.is_news(Duration::ZERO, now) {
            outbox.note(format!(
                "the height above the sea floor (DBT or DPT), {height_m:.1} m, is greater than the depth of the water (DBS), {water_m:.1} \
                 m: it is not used; check the sounders"
            ));
        }
        true
    }

    /// The height above the sea floor, metres.
    pub(super) fn height_m(&self, now: Instant) -> Option<f64> {
        fresh(self.height, now)
    }

    /// The depth of the vehicle, metres; one that is not known, or not any more, is named.
    pub(super) fn depth_m(&mut self, outbox: &mut Outbox, now: Instant) -> Option<f64> {
        let both = fresh(self.water, now).zip(fresh(self.height, now));
        let depth_m = both.map(|(water_m, height_m)| (water_m - height_m).max(0.0));
        if depth_m.is_some() {
            self.depth_m = depth_m;
            self.depth_absence.end();
        } else if self.water.is_some() || self.height.is_some() {
            self.say_unknown_depth(outbox, now);
        }
        depth_m
    }

    /// Says once that the depth is not known, when one of its two parts has been missing for a while.
    fn say_unknown_depth(&mut self, outbox: &mut Outbox, now: Instant) {
        if !self.depth_absence.is_news(UNKNOWN_AFTER, now) {
            return;
        }
        let missing = match fresh(self.water, now).is_none() {
            true => "the depth of the water (DBS)",
            false => "the height above the sea floor (DBT or DPT)",
        };
        outbox.count("depths_unknown");
        outbox.note(format!(
            "the depth of the vehicle is not known, since {missing} is missing: {:.1} m is used",
            self.depth_m.unwrap_or(0.0)
        ));
    }
}

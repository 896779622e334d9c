//! Fourteen vehicles that share one medium and are all unknown at the start.

use super::bench::{LinkBench, LinkSetting};
use super::figures::{budget_use, round};
use crate::virtual_time::VirtualTime;
use scenecast_protocol::time::Instant;
use serde::Serialize;
use sim_channel::LossModel;
use std::time::Duration;

const VEHICLES: u8 = 14;
const LOAD: usize = 20_000;

/// Number of vehicles that share the medium.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FleetRow {
    pub vehicles: u8,
    pub range_km: f64,
    /// Maximum length of a frame, bytes.
    pub frame_bytes: usize,
    /// Share of frames lost in each direction, without collisions.
    pub loss: f64,
    /// Time until the surface knew all vehicles, seconds.
    pub discovered_s: f64,
    /// Time of one turn of each vehicle with its turn-around, seconds.
    pub fair_share_s: f64,
    /// Maximum age of any vehicle's map after each was received once, seconds.
    pub max_age_s: f64,
    /// Ratio of `max_age_s` to `fair_share_s`.
    pub max_age_shares: f64,
    /// Ratio of all useful payload to the channel's capacity for it.
    pub efficiency: f64,
    /// Ratio of the fullest window of any transmitter to the budget plus one transmission.
    pub budget_use: f64,
}

/// Ages of the maps, sampled each second.
struct Ages {
    oldest: Duration,
}

impl Ages {
    /// Time since the last frame of a vehicle's state, or since the state was known to be equal.
    fn sample(&mut self, bench: &LinkBench) {
        for vehicle in &bench.vehicles {
            let taken = bench.surface.end().vehicle(vehicle.address).and_then(|v| v.replica().taken());
            let converged = bench.surface.end().vehicle(vehicle.address).is_some() && vehicle.host.end().is_converged();
            let age = bench.now.since(taken.unwrap_or(Instant::ZERO));
            self.oldest = self.oldest.max(if converged { Duration::ZERO } else { age });
        }
    }
}

/// Measures the row over `time`; all random numbers are drawn from `seed`.
pub fn measure_fleet(time: Duration, seed: u64) -> FleetRow {
    let loss = 0.1;
    let mut setting = LinkSetting::new(1000.0, 256, LossModel::Independent { probability: loss });
    setting.vehicles = VEHICLES;
    setting.discovery_period = Some(Duration::from_secs(60));
    let mut bench = LinkBench::new(&setting, seed);
    bench.vehicles.iter_mut().for_each(|v| v.load = Some(LOAD));
    let began = bench.now;
    let is_known = |w: &LinkBench| {
        w.vehicles.iter().all(|v| w.surface.end().vehicle(v.address).is_some_and(|p| p.replica().taken().is_some()))
    };
    bench.run_until(began + Duration::from_secs(3600), is_known);
    let found = bench.now.since(began);
    bench.run(Duration::from_secs(120));
    let useful = |w: &LinkBench| -> f64 {
        w.vehicles.iter().filter_map(|v| w.surface.end().vehicle(v.address)).map(|v| v.replica().useful_bytes()).sum()
    };
    let (from, before) = (bench.now, useful(&bench));
    bench.grants = Default::default();
    let mut ages = Ages { oldest: Duration::ZERO };
    while bench.now < from + time {
        bench.run(Duration::from_secs(1));
        ages.sample(&bench);
    }
    let useful_bps = (useful(&bench) - before) * 8.0 / bench.now.since(from).as_secs_f64();
    let fair_share_s = fair_share(&bench).as_secs_f64();
    FleetRow {
        vehicles: VEHICLES,
        range_km: 1.0,
        frame_bytes: 256,
        loss,
        discovered_s: round(found.as_secs_f64()),
        fair_share_s: round(fair_share_s),
        max_age_s: round(ages.oldest.as_secs_f64()),
        max_age_shares: round(ages.oldest.as_secs_f64() / fair_share_s),
        efficiency: round(useful_bps / (10_000.0 * (1.0 - loss))),
        budget_use: round(budget_use(&bench)),
    }
}

/// Mean granted turn with its propagation, turn-around and grant, summed over the vehicles.
fn fair_share(bench: &LinkBench) -> Duration {
    let (grants, granted) = bench.grants;
    let setting = bench.setting();
    let modem = setting.modem();
    let hands = setting.round_trip() + modem.turn_around * 2 + modem.airtime(GRANT_BYTES);
    (granted / grants.max(1) as u32 + hands) * u32::from(setting.vehicles)
}

/// Bytes of a grant with its acknowledgement.
const GRANT_BYTES: usize = 22;

//! Channel conditions named by the situation they stand for.
//!
//! Each preset states the source of its numbers. The presets are for rehearsal; they do not predict a place.
//!
//! ```
//! use sim_channel::{LossModel, presets};
//!
//! let lake = presets::by_name("calm_lake").unwrap();
//! assert_eq!(lake.loss, LossModel::Independent { probability: 0.03 });
//! let names: Vec<_> = presets::ALL.iter().map(|(name, _)| *name).collect();
//! assert!(names.contains(&"under_ice"));
//! ```

use crate::acoustics::wind_of_sea_state;
use crate::channel::{ChannelConfig, Outage};
use crate::loss::{GilbertElliott, LossModel, Snr, ThreeState};
use std::time::Duration;

/// A function that makes the conditions of a preset.
pub type Preset = fn() -> ChannelConfig;

/// Every preset by name, for configuration files and help texts.
pub const ALL: [(&str, Preset); 8] = [
    ("calm_lake", calm_lake),
    ("shallow_harbour", shallow_harbour),
    ("busy_port", busy_port),
    ("edge_of_range", edge_of_range),
    ("open_sea_spring", open_sea_spring),
    ("open_sea_winter", open_sea_winter),
    ("storm", storm),
    ("under_ice", under_ice),
];

/// The conditions of the preset `name`; `None` if there is no such preset.
pub fn by_name(name: &str) -> Option<ChannelConfig> {
    ALL.iter().find(|(known, _)| *known == name).map(|(_, preset)| preset())
}

/// Still fresh water close to a gateway: 3 % independent loss, 1447 m/s.
///
/// Source: 97 % delivery next to a gateway in the FRONT sea trials (2002); speed of sound in fresh water at 10 degrees.
#[must_use]
pub fn calm_lake() -> ChannelConfig {
    ChannelConfig {
        sound_speed_m_s: 1447.0,
        loss: LossModel::Independent { probability: 0.03 },
        ..ChannelConfig::default()
    }
}

/// Echoes from quays and hulls in bursts of about ten seconds: about one frame in five is lost.
///
/// Source: rounded medians of three-state fits to a harbour trial, with 5 s for a step of one packet.
pub fn shallow_harbour() -> ChannelConfig {
    let model = ThreeState {
        dwell: [25, 14, 18].map(Duration::from_secs),
        loss: [0.03, 0.19, 0.53],
        good_to_medium: 0.5,
        medium_to_good: 0.5,
        bad_to_good: 0.5,
    };
    ChannelConfig { loss: model.into(), ..ChannelConfig::default() }
}

/// The shallow harbour with a ship that masks all signals for 90 s every 15 minutes of the first day.
///
/// Source: `shallow_harbour`; the timetable is assumed.
#[must_use]
pub fn busy_port() -> ChannelConfig {
    const SHIP_INTERVAL: Duration = Duration::from_secs(15 * 60);
    const SHIP_PASSAGE: Duration = Duration::from_secs(90);
    let outage = |ship| Outage::all(SHIP_INTERVAL * ship, SHIP_INTERVAL * ship + SHIP_PASSAGE);
    let outages = (1..=96u32).map(outage).collect();
    ChannelConfig { outages, ..shallow_harbour() }
}

/// An 18-34 kHz modem on a noisy hull in sea state 3: at 5 km about half of the instant messages get through.
///
/// Source: the sonar equation with Thorp absorption and Wenz noise; the source level and 8 dB of own noise are assumed.
#[must_use]
pub fn edge_of_range() -> ChannelConfig {
    let model = Snr { wind_m_s: wind_of_sea_state(3), extra_noise_db: 8.0, fading_std_db: 4.0, ..Snr::default() };
    ChannelConfig { loss: model.into(), ..ChannelConfig::default() }
}

/// A good season at 5 km: 86 % delivery, loss in bursts.
///
/// Source: FRONT sea trials (2002), delivery in spring; the dwell of about a minute is assumed.
#[must_use]
pub fn open_sea_spring() -> ChannelConfig {
    bursts(0.86, Duration::from_secs(90))
}

/// A bad season at 5 km: 25 % delivery, loss in bursts.
///
/// Source: FRONT sea trials (2002), delivery in winter; the dwell of about a minute is assumed.
#[must_use]
pub fn open_sea_winter() -> ChannelConfig {
    bursts(0.25, Duration::from_secs(90))
}

/// Sea state 6 over a short link: wind noise and deep, fast fading.
///
/// Source: Wenz noise at a wind of 19 m/s; fading of 6 dB over 3 s is assumed for a moving surface.
#[must_use]
pub fn storm() -> ChannelConfig {
    let model = Snr {
        wind_m_s: wind_of_sea_state(6),
        fading_std_db: 6.0,
        fading_coherence: Duration::from_secs(3),
        ..Snr::default()
    };
    ChannelConfig { loss: model.into(), ..ChannelConfig::default() }
}

/// Cold, quiet water under rough ice: 1439 m/s, long good states, long shadows, and frames that arrive twice or late.
///
/// Source: Mackenzie sound speed at -1.8 degrees Celsius and 34 ppt; the shadows (40 s in 160 s, 70 % loss) are assumed.
#[must_use]
pub fn under_ice() -> ChannelConfig {
    let model = GilbertElliott {
        dwell_good: Duration::from_secs(120),
        dwell_bad: Duration::from_secs(40),
        loss_good: 0.05,
        loss_bad: 0.7,
    };
    ChannelConfig {
        sound_speed_m_s: 1439.0,
        loss: model.into(),
        duplication: 0.02,
        reordering: 0.02,
        ..ChannelConfig::default()
    }
}

/// A good and a bad state with the long-run `delivery`; one stay in both lasts `period` on average.
fn bursts(delivery: f64, period: Duration) -> ChannelConfig {
    const LOSS_GOOD: f64 = 0.03;
    const LOSS_BAD: f64 = 0.95;
    let bad = (1.0 - delivery - LOSS_GOOD) / (LOSS_BAD - LOSS_GOOD);
    let model = GilbertElliott {
        dwell_good: period.mul_f64(1.0 - bad),
        dwell_bad: period.mul_f64(bad),
        loss_good: LOSS_GOOD,
        loss_bad: LOSS_BAD,
    };
    ChannelConfig { loss: model.into(), ..ChannelConfig::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acoustics::mackenzie_m_s;
    use crate::channel::{Channel, ReceptionOutcome};
    use crate::nodes::{NodeId, NodePosition};

    /// Share of 64-byte frames, one every 3 s, that are lost over `range_m`.
    fn measured_loss(config: ChannelConfig, range_m: f64) -> f64 {
        let (a, b) = (NodeId(1), NodeId(2));
        let mut channel = Channel::new(config, 3);
        channel.place(a, NodePosition::default());
        channel.place(b, NodePosition::new(range_m, 0.0, 0.0));
        let (mut frames, mut lost) = (0, 0);
        for n in 0..28_000 {
            let now = Duration::from_secs(3 * n);
            channel.transmit(a, vec![0; 64], Duration::from_millis(860), now);
            while let Some(arrival) = channel.poll_arrival(now) {
                frames += 1u32;
                lost += u32::from(matches!(arrival.outcome, ReceptionOutcome::Lost { .. }));
            }
        }
        f64::from(lost) / f64::from(frames)
    }

    fn expect(config: ChannelConfig, range_m: f64, loss: f64) {
        let found = measured_loss(config, range_m);
        assert!((found - loss).abs() < 0.025, "{found} {loss}");
    }

    #[test]
    fn lake_loss_matches_its_description() {
        expect(calm_lake(), 500.0, 0.03);
    }

    #[test]
    fn harbour_loses_about_one_frame_in_five() {
        let LossModel::ThreeState(model) = shallow_harbour().loss else { panic!("three states") };
        // All three states are entered equally often, so that the shares of time are those of the dwells.
        let closed = (25.0 * 0.03 + 14.0 * 0.19 + 18.0 * 0.53) / 57.0;
        assert!((model.loss_rate() - closed).abs() < 1e-9 && (0.15..0.3).contains(&closed));
        expect(shallow_harbour(), 1000.0, closed);
    }

    #[test]
    fn ships_add_their_share_of_outage() {
        let LossModel::ThreeState(model) = shallow_harbour().loss else { panic!("three states") };
        let masked = (90.0 + 0.86) / 900.0;
        expect(busy_port(), 1000.0, masked + (1.0 - masked) * model.loss_rate());
    }

    #[test]
    fn half_the_frames_get_through_at_the_edge_of_range() {
        let LossModel::Snr(model) = edge_of_range().loss else { panic!("snr") };
        let loss = |range| model.loss_rate(range, 64, Duration::from_millis(860));
        assert!(loss(2500.0) < 0.01, "{}", loss(2500.0));
        assert!((0.35..0.65).contains(&loss(5000.0)), "{}", loss(5000.0));
        assert!(loss(8000.0) > 0.95, "{}", loss(8000.0));
        expect(edge_of_range(), 5000.0, loss(5000.0));
    }

    #[test]
    fn open_sea_delivery_matches_the_sea_trials() {
        expect(open_sea_spring(), 5000.0, 0.14);
        expect(open_sea_winter(), 5000.0, 0.75);
    }

    #[test]
    fn storm_loses_more_than_calm_water_at_one_range() {
        let LossModel::Snr(model) = storm().loss else { panic!("snr") };
        let rate = |model: Snr| model.loss_rate(2500.0, 64, Duration::from_millis(860));
        assert!(rate(model) > 2.0 * rate(Snr::default()));
        expect(storm(), 2500.0, rate(model));
    }

    #[test]
    fn ice_loss_and_sound_speed_match_their_sources() {
        expect(under_ice(), 1000.0, 0.75 * 0.05 + 0.25 * 0.7);
        assert!((mackenzie_m_s(-1.8, 34.0, 10.0) - under_ice().sound_speed_m_s).abs() < 1.0);
    }

    #[test]
    fn presets_are_found_by_name() {
        for (name, preset) in ALL {
            assert_eq!(by_name(name), Some(preset()));
        }
        assert_eq!(by_name("atlantis"), None);
    }
}

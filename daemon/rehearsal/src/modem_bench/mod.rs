//! Throughput and latency through drivers and emulated modems, in virtual time.

mod load;

pub use load::{ModemBench, ModemSetting, push};

use crate::mission::{Mission, MissionOptions};
use crate::report::report;
use crate::world::World;
use scenecast_config::Config;
use scenecast_core::UserError;
use serde::Serialize;
use std::time::Duration;

/// An S2C modem in burst mode under load.
#[derive(Debug, Clone, Serialize)]
pub struct BurstRow {
    pub range_m: f64,
    /// Share of frames that the channel loses in each direction.
    pub loss: f64,
    /// Throughput of the modem for a host that only keeps its pool full, bit/s.
    pub raw_bps: f64,
    /// Useful payload that reaches the replica, bit/s.
    pub useful_bps: f64,
    /// Ratio of `useful_bps` to `raw_bps`.
    pub share: f64,
    /// Time from issue to application of a directive with a full bulk queue, median, s.
    pub directive_median_s: f64,
    /// 95th percentile of the same time, s.
    pub directive_p95_s: f64,
    /// Ratio of the vehicle's bits in the fullest window to the budget.
    pub budget_use: f64,
}

#[derive(Debug, Clone, Serialize)]
pub struct SurveyRow {
    pub modem: String,
    /// Duration of the survey, s.
    pub survey_s: f64,
    /// Share of cells on the operator's map that agree with the vehicle's, mean over the survey.
    pub agreement_mean: f64,
    /// The same share once the link has drained: 1 if the maps are equal.
    pub agreement_final: f64,
    /// Time that the link took after the survey, s.
    pub drain_s: f64,
}

#[derive(Debug, Clone, Serialize)]
pub struct ModemTable {
    pub seed: u64,
    pub burst: BurstRow,
    pub surveys: Vec<SurveyRow>,
}

/// Range between the modems in every row, m.
const RANGE_M: f64 = 1000.0;
const LOSS: f64 = 0.1;

/// Measures all rows, in about a minute.
pub fn modem_table(seed: u64, progress: &mut dyn FnMut(f64)) -> Result<ModemTable, UserError> {
    progress(0.0);
    let burst = measure_burst(seed, Duration::from_secs(1200), 60)?;
    let mut surveys = Vec::new();
    let modems = [
        ("s2c, instant messages only", vec!["modem.kind=s2c", "modem.s2c_mode=im"]),
        ("micromodem, rate 1", vec!["modem.kind=micromodem", "modem.rate=1"]),
        ("micromodem, rate 5", vec!["modem.kind=micromodem", "modem.rate=5", "modem.baud=115200"]),
        ("s2c, bursts", vec!["modem.kind=s2c"]),
        ("transparent", vec!["modem.kind=transparent", "modem.baud=9600", "modem.bit_rate=9600"]),
    ];
    let count = modems.len() as f64 + 1.0;
    for (i, (name, sets)) in modems.into_iter().enumerate() {
        progress((i as f64 + 1.0) / count);
        surveys.push(survey(name, &sets, seed, 1200.0)?);
    }
    progress(1.0);
    Ok(ModemTable { seed, burst, surveys })
}

/// The default scenario at the range and loss of every row, changed by `sets`.
pub fn scenario(sets: &[&str]) -> Result<Config, UserError> {
    let mut all = vec![format!("channel.loss={LOSS}"), format!("channel.range_m={RANGE_M}")];
    all.extend(sets.iter().map(|s| (*s).to_owned()));
    scenecast_config::load(None, &all)
}

/// Throughput against a raw pusher, and latency of `directives` directives meanwhile.
pub fn measure_burst(seed: u64, time: Duration, directives: usize) -> Result<BurstRow, UserError> {
    // A budget above the modem's rate, so that the modem is the limit.
    let config = scenario(&["modem.kind=s2c", "link.budget_bps=40000"])?;
    let setting = ModemSetting { config, range_m: RANGE_M, loss: LOSS };
    let raw_bps = push(&setting, seed, time);
    let mut bench = ModemBench::under_load(&setting, seed)?;
    let useful_bps = bench.measure_flow(time);
    let latency = bench.measure_directives(directives, seed);
    Ok(BurstRow {
        range_m: RANGE_M,
        loss: LOSS,
        raw_bps: raw_bps.round(),
        useful_bps: useful_bps.round(),
        share: thousandths(useful_bps / raw_bps),
        directive_median_s: thousandths(latency.median()),
        directive_p95_s: thousandths(latency.p95()),
        budget_use: thousandths(bench.budget_use()),
    })
}

/// A survey of `duration_s` through modems, and the time that the link takes to drain after it.
pub fn survey(name: &str, sets: &[&str], seed: u64, duration_s: f64) -> Result<SurveyRow, UserError> {
    let mut config = scenario(sets)?;
    config.survey.duration_s = duration_s;
    let options = MissionOptions { world: World::patches(seed, config.camera.metres_per_pixel), seed, record: None };
    let mut mission = Mission::new(config, options)?;
    mission.run(Duration::from_secs(7200), &mut |_| Ok(()))?;
    let report = report(&mission, name);
    let value = |key: &str| report.json["map"][key].as_f64().unwrap_or_default();
    Ok(SurveyRow {
        modem: name.to_owned(),
        survey_s: duration_s,
        agreement_mean: value("agreement_mean"),
        agreement_final: value("agreement_final"),
        drain_s: thousandths(mission.now().as_secs_f64() - duration_s),
    })
}

fn thousandths(x: f64) -> f64 {
    (x * 1000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bursts_fill_the_modem_and_directives_overtake_them() {
        let row = measure_burst(2, Duration::from_secs(1200), 60).unwrap();
        assert!(row.share >= 0.8, "{row:?}");
        assert!(row.directive_p95_s < 25.0, "{row:?}");
    }

    #[test]
    fn a_survey_through_slow_modems_ends_with_equal_maps() {
        let im = ["modem.kind=s2c", "modem.s2c_mode=im"];
        let rate_1 = ["modem.kind=micromodem", "modem.rate=1"];
        // In a short survey the first minutes, in which the map has yet to arrive, weigh more.
        let is_full = std::env::var_os("SCENECAST_FULL").is_some();
        let (duration_s, least) = if is_full { (1200.0, 0.9) } else { (400.0, 0.7) };
        // An area of which such a modem can keep up with the map.
        let small = ["camera.width_px=320", "camera.height_px=240", "survey.area_m=[0.5, 0.5, 19.4, 19.4]"];
        for sets in [rate_1, im].into_iter().take(if is_full { 2 } else { 1 }) {
            let row = survey(&sets.join(" "), &[&sets[..], &small].concat(), 1, duration_s).unwrap();
            assert_eq!(row.agreement_final, 1.0, "{row:?}");
            assert!(row.agreement_mean >= least, "{row:?}");
        }
    }
}

//! What the link achieves: the golden table and the figures it has to reach.

use scenecast_rehearsal::link_bench::{
    LinkCase, LinkEffort, LinkRow, Pattern, link_cases, link_table, measure_budgets, measure_fleet, measure_ranging,
};
use scenecast_tests::is_full;
use serde_json::Value;
use std::sync::OnceLock;
use std::time::Duration;

/// Stops of each row by which the bound of convergence is judged. The 40 of the golden table decide by chance: the share of a row
/// that is within the bound 19 times of 20 comes out below 0.95 at about every second seed.
const STOPS: LinkEffort = LinkEffort { saturated: Duration::from_secs(60), directives: 1, stops: 200 };

/// At least 95 % of the stops are to be within the bound. One sample of 200 in twenty comes out below this by chance.
const MIN_WITHIN: f64 = 0.95 - 1.65 * 0.0154;

/// Rows that miss the bound of convergence, as range, bytes, loss; this list may only get shorter.
///
/// At 3 km a grant and its answer are 4 s on the way: what was lost twice is past a bound that allows 10 s or 20 s. The row of 1000 bytes
/// and a loss of 0.3 has .92: one stop of 200 less than the least.
const LATE: &[(f64, usize, f64)] = &[(3.0, 64, 0.3), (3.0, 1000, 0.1), (3.0, 1000, 0.3)];

/// Rows of the golden table by their place in it: every one in `.ci/full`, otherwise one in five, over all settings.
fn measured() -> &'static [(usize, LinkRow)] {
    static ROWS: OnceLock<Vec<(usize, LinkRow)>> = OnceLock::new();
    ROWS.get_or_init(|| sample().map(|(i, case)| (i, row(case, &LinkEffort::TABLE))).collect())
}

fn sample() -> impl Iterator<Item = (usize, LinkCase)> {
    let cases = link_cases().into_iter().enumerate();
    // Five losses for each range and frame size: another one for each.
    cases.filter(|(i, _)| is_full() || i % 5 == i / 5 % 5)
}

fn row(case: LinkCase, effort: &LinkEffort) -> LinkRow {
    case.measure(effort, 1).expect("directives can be issued")
}

/// The virtual time of a measurement beside the rows.
fn measuring_time() -> Duration {
    Duration::from_secs(if is_full() { 7200 } else { 1200 })
}

fn rows(range_km: f64) -> impl Iterator<Item = &'static LinkRow> {
    let rows = measured().iter().map(|(_, row)| row).filter(|r| matches!(r.pattern, Pattern::Independent));
    rows.filter(move |r| r.range_km == range_km)
}

fn golden() -> String {
    let file = scenecast_tests::workspace().join("tests/golden/link_table.json");
    std::fs::read_to_string(file).expect("the golden table can be read")
}

#[test]
fn the_rows_of_the_link_are_unchanged() {
    let golden: Value = serde_json::from_str(&golden()).unwrap();
    for (i, row) in measured() {
        assert_eq!(golden["rows"][i], serde_json::to_value(row).unwrap(), "row {i}; see the test of the whole table");
    }
}

#[test]
fn the_table_of_the_link_is_unchanged() {
    if !is_full() {
        return;
    }
    let golden = golden();
    let now = serde_json::to_string_pretty(&link_table(1, &mut |_| ()).unwrap()).unwrap();
    let differs = golden.trim_end().lines().zip(now.lines()).find(|(was, is)| was != is);
    assert!(
        golden.trim_end() == now,
        "the link is not as it was, first here (before, now): {differs:?}. If that is wanted:\n\
         cargo run --release -- bench link --json > tests/golden/link_table.json"
    );
}

#[test]
fn the_channel_is_used_well() {
    for row in rows(1.0) {
        let least = if row.frame_bytes == 64 { 0.65 } else { 0.80 };
        assert!(row.efficiency >= least, "below {least}: {row:?}");
    }
    for row in rows(0.1).filter(|r| r.frame_bytes >= 256) {
        assert!(row.efficiency >= 0.85, "below 0.85: {row:?}");
    }
}

#[test]
fn directives_are_applied_soon_under_load() {
    for row in rows(1.0) {
        if row.loss <= 0.1 {
            assert!(row.directive_median_s <= 10.0, "median above 10 s: {row:?}");
            assert!(row.directive_p95_s <= 20.0, "p95 above 20 s: {row:?}");
        }
        assert!(row.directive_p95_s <= 60.0, "p95 above 60 s: {row:?}");
    }
}

#[test]
fn the_replica_is_equal_soon_after_the_last_change() {
    let rows: Vec<_> = sample().map(|(_, case)| row(case, &STOPS)).collect();
    let place = |r: &LinkRow| (r.range_km, r.frame_bytes, r.loss);
    let late: Vec<_> =
        rows.iter().filter(|r| r.pattern == Pattern::Independent && r.converge_within < MIN_WITHIN).collect();
    let places: Vec<_> = late.iter().map(|r| place(r)).collect();
    let expected: Vec<_> = LATE.iter().copied().filter(|late| rows.iter().any(|r| place(r) == *late)).collect();
    assert_eq!(places, expected, "fewer than 95 % of the stops within {{10, 20, 60}} s + 1.5 x rest: {late:#?}");
}

#[test]
fn no_map_of_fourteen_vehicles_grows_old() {
    let fleet = measure_fleet(measuring_time() / 2, 1);
    assert_eq!(fleet.vehicles, 14);
    assert!(fleet.max_age_shares <= 3.0, "older than 3 fair shares: {fleet:?}");
    assert!(fleet.budget_use <= 1.0, "{fleet:?}");
}

#[test]
fn a_fix_each_ten_seconds_costs_little() {
    for row in measure_ranging(measuring_time(), 1).unwrap() {
        assert!(row.cost <= 0.03, "costs more than 3 %: {row:?}");
    }
}

#[test]
fn no_budget_is_exceeded_by_more_than_one_transmission() {
    for (_, row) in measured() {
        assert!(row.budget_use <= 1.0, "more than the budget: {row:?}");
    }
}

#[test]
fn a_scarce_budget_is_used_well() {
    for row in measure_budgets(measuring_time(), 1).unwrap() {
        assert!(row.budget_use <= 1.0, "more than the budget: {row:?}");
        let least = if row.frame_bytes == 64 { 0.5 } else { 0.7 };
        assert!(row.efficiency >= least, "below {least} of the budget: {row:?}");
    }
}

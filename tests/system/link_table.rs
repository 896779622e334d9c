//! What the link achieves: the golden table and the figures it has to reach.

use scenecast_rehearsal::link_bench::{LinkEffort, LinkRow, LinkTable, Pattern, link_cases, link_table};
use std::sync::OnceLock;
use std::time::Duration;

/// Stops of each row by which the bound of convergence is judged. The 40 of the golden table decide by chance: the share of a row
/// that is within the bound 19 times of 20 comes out below 0.95 at about every second seed.
const STOPS: LinkEffort = LinkEffort { saturated: Duration::from_secs(60), directives: 1, stops: 200 };

/// Rows that miss the bound of convergence, as range, bytes, loss; this list may only get shorter.
///
/// At 3 km a grant and its answer are 4 s on the way: what was lost twice is past a bound that allows 10 s or 20 s.
const LATE: &[(f64, usize, f64)] = &[(3.0, 64, 0.1), (3.0, 64, 0.3), (3.0, 1000, 0.1), (3.0, 1000, 0.3)];

fn table() -> &'static LinkTable {
    static TABLE: OnceLock<LinkTable> = OnceLock::new();
    TABLE.get_or_init(|| link_table(1, &mut |_| ()).expect("directives can be issued"))
}

fn rows(range_km: f64) -> impl Iterator<Item = &'static LinkRow> {
    let rows = table().rows.iter().filter(|r| matches!(r.pattern, Pattern::Independent));
    rows.filter(move |r| r.range_km == range_km)
}

#[test]
fn the_table_of_the_link_is_as_it_was() {
    let file = scenecast_tests::workspace().join("tests/golden/link_table.json");
    let golden = std::fs::read_to_string(&file).unwrap_or_default();
    let now = serde_json::to_string_pretty(table()).unwrap();
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
    let rows = link_cases().into_iter().map(|case| case.measure(&STOPS, 1).expect("directives can be issued"));
    let late: Vec<_> = rows.filter(|r| matches!(r.pattern, Pattern::Independent) && r.converge_within < 0.95).collect();
    let places: Vec<_> = late.iter().map(|r| (r.range_km, r.frame_bytes, r.loss)).collect();
    assert_eq!(places, LATE, "fewer than 95 % of the stops within {{10, 20, 60}} s + 1.5 x rest: {late:#?}");
}

#[test]
fn no_map_of_fourteen_vehicles_grows_old() {
    let fleet = &table().fleet;
    assert_eq!(fleet.vehicles, 14);
    assert!(fleet.max_age_shares <= 3.0, "older than 3 fair shares: {fleet:?}");
}

#[test]
fn a_fix_each_ten_seconds_costs_little() {
    for row in &table().ranging {
        assert!(row.cost <= 0.03, "costs more than 3 %: {row:?}");
    }
}

#[test]
fn no_budget_is_exceeded_by_more_than_one_transmission() {
    let table = table();
    let rows = table.rows.iter().map(|r| (r.budget_use, format!("{r:?}")));
    let budgets = table.budgets.iter().map(|r| (r.budget_use, format!("{r:?}")));
    let fleet = [(table.fleet.budget_use, format!("{:?}", table.fleet))];
    for (used, row) in rows.chain(budgets).chain(fleet) {
        assert!(used <= 1.0, "{used} of the budget: {row}");
    }
}

#[test]
fn a_scarce_budget_is_used_well() {
    for row in &table().budgets {
        let least = if row.frame_bytes == 64 { 0.5 } else { 0.7 };
        assert!(row.efficiency >= least, "below {least} of the budget: {row:?}");
    }
}

//! Whether one habitat has one label: whenever, in whatever order and on whichever path it was seen.

mod command;
mod drift;
mod flight;
mod picture;
mod site;

pub(crate) use command::LabelsBench;

use flight::{Flight, Labelled, Path};
use scenecast_worlds::scoring::{MutualInformation, Seams, mutual_information_nats};
use serde::Serialize;
use site::{Sight, Site};
use std::collections::BTreeMap;

/// The figures of one sea floor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LabelRow {
    pub site: String,
    /// When all has been seen, and after a rest, in which the map is corrected.
    pub under_way: MapFigures,
    pub rested: MapFigures,
    /// Share of the variance between cells of one class that the time of their first sight explains.
    pub drift: Option<f64>,
    /// Share of the cells of five minutes before that have another label, mean over the second half of the survey.
    pub relabelled: f64,
    /// Share of the cells whose label the rest corrects.
    pub corrected: f64,
    /// Time of the processor for a second of mission: measures, labels and tree.
    pub cpu: f64,
    /// Mutual information with the true classes under way, nats, by the name of the sight: the floor itself, and worse sights of it.
    pub sights: BTreeMap<&'static str, f64>,
}

/// How well the maps of one floor agree with the true classes and with each other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MapFigures {
    pub labels: usize,
    /// V-measure against the true classes: of all labels, and with the tree cut at 8.
    pub v_measure: f64,
    pub v_measure_at_8: f64,
    /// Agreement (normalised mutual information) of the maps of the same frames in two orders, and of two paths: of all labels, and with
    /// both trees cut at 8.
    pub orders: f64,
    pub orders_at_8: f64,
    pub paths: f64,
    pub paths_at_8: f64,
    /// Shares of neighbours of one class that have one label, first seen together, and far apart in time.
    pub within: Option<f64>,
    pub across: Option<f64>,
}

impl MapFigures {
    fn of(site: &Site, flights: &[Flight; 3], map: impl Fn(&Flight) -> &Labelled) -> Self {
        let [along, back, across] = flights.each_ref().map(&map);
        let truth = |count| compare(along.labels(count), |place| site.class(place)).v_measure();
        let seams = Seams::of(&flights[0].timed(along, |place| site.class(place)));
        Self {
            labels: along.count(),
            v_measure: truth(usize::MAX),
            v_measure_at_8: truth(8),
            orders: agreement(along, back, usize::MAX),
            orders_at_8: agreement(along, back, 8),
            paths: agreement(along, across, usize::MAX),
            paths_at_8: agreement(along, across, 8),
            within: seams.within,
            across: seams.across,
        }
    }
}

/// The labels of one map against other names for the same cells.
fn compare(
    cells: impl Iterator<Item = ((i32, i32), u32)>,
    others: impl Fn((i32, i32)) -> Option<u32>,
) -> MutualInformation {
    mutual_information_nats(cells.filter_map(|(place, label)| Some((label, others(place)?))))
}

fn agreement(a: &Labelled, b: &Labelled, count: usize) -> f64 {
    compare(a.labels(count), |place| b.label(place, count)).agreement()
}

/// Flies over a floor in each order and on each path, and over each other sight of it.
pub fn measure(site: &Site, progress: &mut dyn FnMut()) -> (LabelRow, [Flight; 3]) {
    let mut fly = |image: &image::RgbImage, path| {
        let flight = Flight::over(site, image, path);
        progress();
        flight
    };
    let flights = [Path::Along, Path::Back, Path::Across].map(|path| fly(&site.image, path));
    let nats = |flight: &Flight| compare(flight.under_way.labels(usize::MAX), |place| site.class(place)).nats;
    let sights = Sight::OTHERS.map(|sight| (sight.name(), nats(&fly(&sight.of(&site.image), Path::Along))));
    let row = LabelRow {
        site: site.name.clone(),
        under_way: MapFigures::of(site, &flights, |flight| &flight.under_way),
        rested: MapFigures::of(site, &flights, |flight| &flight.rested),
        drift: flights[0].drift(|place| site.class(place)),
        relabelled: flights[0].relabelled,
        corrected: flights[0].corrected(),
        cpu: flights[0].cpu,
        sights: [("clear", nats(&flights[0]))].into_iter().chain(sights).collect(),
    };
    (row, flights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_grounds_keep_their_labels_in_any_order_and_on_any_path() {
        let site = Site::two_grounds();
        let (row, flights) = measure(&site, &mut || ());
        for map in [&row.under_way, &row.rested] {
            assert!(map.v_measure > 0.8 && map.orders > 0.8 && map.paths > 0.8, "{row:?}");
        }
        assert!(row.rested.orders > 0.999 && row.rested.orders_at_8 > 0.999, "{row:?}");
        // Cells on the border show both grounds and have labels of their own.
        assert!(flights.iter().all(|flight| (2..=6).contains(&flight.under_way.count())), "{row:?}");
        let again = Flight::over(&site, &site.image, Path::Along);
        assert!(again.rested.labels(usize::MAX).eq(flights[0].rested.labels(usize::MAX)));
        assert!(picture::of(&site, &flights).width() > 0);
    }
}

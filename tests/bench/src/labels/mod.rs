//! Whether one habitat has one label: whenever, in whatever order and on whichever path it was seen.

mod command;
mod flight;
mod picture;
mod site;

pub(crate) use command::LabelsBench;

use flight::{Flight, Path};
use scenecast_scoring::{MutualInformation, Seams, mutual_information_nats};
use serde::Serialize;
use site::{Sight, Site};
use std::collections::BTreeMap;

/// The figures of one sea floor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LabelRow {
    pub site: String,
    /// Labels at the end.
    pub labels: usize,
    /// V-measure against the true classes: of all labels, and with the tree cut at 8.
    pub v_measure: f64,
    pub v_measure_at_8: f64,
    /// Mutual information with the true classes over the annotated cells, nats.
    pub information_nats: f64,
    /// Agreement (normalised mutual information) of the maps of the same frames in two orders, and of two paths: of all labels, and with
    /// both trees cut at 8.
    pub orders: f64,
    pub orders_at_8: f64,
    pub paths: f64,
    pub paths_at_8: f64,
    /// Shares of neighbours of one class that have one label, first seen together, and far apart in time.
    pub within: Option<f64>,
    pub across: Option<f64>,
    /// Share of the cells of five minutes before that have another label, mean over the second half of the survey.
    pub relabelled: f64,
    /// Time of the processor for a second of mission: measures, labels and tree.
    pub cpu: f64,
    /// Mutual information with other sights of the same floor, nats, by the name of the sight.
    pub sights: BTreeMap<&'static str, f64>,
}

/// The labels of one map against other names for the same cells.
fn compare(
    cells: impl Iterator<Item = ((i32, i32), u32)>,
    others: impl Fn((i32, i32)) -> Option<u32>,
) -> MutualInformation {
    mutual_information_nats(cells.filter_map(|(place, label)| Some((label, others(place)?))))
}

fn agreement(a: &Flight, b: &Flight, count: usize) -> f64 {
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
    let sights = Sight::OTHERS.map(|sight| {
        let flight = fly(&sight.of(&site.image), Path::Along);
        (sight.name(), compare(flight.labels(usize::MAX), |place| site.class(place)).nats)
    });
    let [along, back, across] = &flights;
    let truth = |count| compare(along.labels(count), |place| site.class(place));
    let seams = Seams::of(&along.timed(|place| site.class(place)));
    let row = LabelRow {
        site: site.name.clone(),
        labels: along.count(),
        v_measure: truth(usize::MAX).v_measure(),
        v_measure_at_8: truth(8).v_measure(),
        information_nats: truth(usize::MAX).nats,
        orders: agreement(along, back, usize::MAX),
        orders_at_8: agreement(along, back, 8),
        paths: agreement(along, across, usize::MAX),
        paths_at_8: agreement(along, across, 8),
        within: seams.within,
        across: seams.across,
        relabelled: along.relabelled,
        cpu: along.cpu,
        sights: sights.into(),
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
        assert!(row.v_measure > 0.8 && row.orders > 0.8 && row.paths > 0.8, "{row:?}");
        // Cells on the border show both grounds and have labels of their own.
        assert!(flights.iter().all(|flight| (2..=6).contains(&flight.count())), "{row:?}");
        let again = Flight::over(&site, &site.image, Path::Along);
        assert!(again.labels(usize::MAX).eq(flights[0].labels(usize::MAX)));
        assert!(picture::of(&site, &flights).width() > 0);
    }
}

//! The quality of the maps over time, as a table and as charts.

mod plot;

pub use plot::{Curve, Line, Panel, quality_plot};

use crate::mission::{MapInformation, MapQuality};
use std::fmt::Write;

const COLUMNS: &str = "t_s,vehicle_rigid_nats,vehicle_placed_nats,operator_rigid_nats,operator_placed_nats,agreement,\
                       age_s,error_rigid_cells,error_placed_cells,relabelled";

/// A table of samples, comma separated, with one line a sample; a value that is not known is empty.
pub fn quality_csv(samples: &[MapQuality]) -> String {
    let mut text = format!("{COLUMNS}\n");
    let or_empty = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.4}"));
    for s in samples {
        let both = |map: Option<MapInformation>| {
            format!("{},{}", or_empty(map.map(|i| i.rigid_nats)), or_empty(map.map(|i| i.placed_nats)))
        };
        let (vehicle, operator) = (both(s.vehicle), both(s.operator));
        let (rigid, placed) = (or_empty(s.error_rigid_cells), or_empty(s.error_placed_cells));
        let relabelled = or_empty(s.relabelled);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{:.0},{vehicle},{operator},{:.4},{:.2},{rigid},{placed},{relabelled}",
            s.t_s, s.agreement, s.age_s
        );
    }
    text
}

/// The charts of a mission: the information of both maps, and the errors of the frames' places.
pub fn mission_panels(samples: &[MapQuality]) -> Vec<Panel> {
    let rigid = |map: Option<MapInformation>| map.map(|i| i.rigid_nats);
    let placed = |map: Option<MapInformation>| map.map(|i| i.placed_nats);
    let curve = |name: &str, line, of: &dyn Fn(&MapQuality) -> Option<f64>| Curve::new(name, line, samples, of);
    let information = vec![
        curve("vehicle's map, rigid", Line::REFERENCE, &|s| rigid(s.vehicle)),
        curve("vehicle's map, placed", Line::REFERENCE.thin(), &|s| placed(s.vehicle)),
        curve("operator's map, rigid", Line::OURS, &|s| rigid(s.operator)),
        curve("operator's map, placed", Line::OURS.thin(), &|s| placed(s.operator)),
    ];
    let errors = vec![
        curve("rigid", Line::REFERENCE, &|s| s.error_rigid_cells),
        curve("placed", Line::REFERENCE.thin(), &|s| s.error_placed_cells),
    ];
    vec![
        Panel { title: "Mutual information with the true classes".to_owned(), unit: "nats", curves: information },
        Panel { title: "Error of the frames' places".to_owned(), unit: "cells", curves: errors },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(t_s: f64, nats: Option<f64>) -> MapQuality {
        let map = nats.map(|rigid_nats| MapInformation { rigid_nats, placed_nats: rigid_nats / 2.0 });
        let (agreement, age_s) = (0.5, 12.0);
        MapQuality {
            t_s,
            vehicle: map,
            operator: map,
            agreement,
            age_s,
            relabelled: None,
            error_rigid_cells: None,
            error_placed_cells: Some(1.0),
        }
    }

    #[test]
    fn an_unknown_value_is_an_empty_field() {
        let text = quality_csv(&[sample(0.0, Some(0.5)), sample(30.0, None)]);
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(lines, ["0,0.5000,0.2500,0.5000,0.2500,0.5000,12.00,,1.0000,", "30,,,,,0.5000,12.00,,1.0000,"]);
    }

    #[test]
    fn curves_without_values_are_not_drawn() {
        let samples = [sample(0.0, Some(0.1)), sample(30.0, Some(0.5))];
        let svg = quality_plot(&mission_panels(&samples), "a mission").unwrap();
        let known = samples.map(|sample| MapQuality { error_rigid_cells: Some(0.5), ..sample });
        let whole = quality_plot(&mission_panels(&known), "a mission").unwrap();
        let lines = |svg: &str| svg.matches("<polyline").count();
        assert!(lines(&svg) < lines(&whole), "the error after a rigid fit is unknown");
        assert!(quality_plot(&mission_panels(&[]), "no sample").is_ok());
    }
}

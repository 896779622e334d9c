//! Weighted areas, and the destination.

use super::constraints::{OrderView, degrees, send, slot};
use super::session::Session;
use scenecast_core::UserError;
use scenecast_files::{AreaShape, CoordinateFrame, read_areas};
use scenecast_surface::{AreaOrder, AreasOrder, DestinationOrder};
use std::fmt::Write;
use std::path::Path;

/// How to read a file of weighted areas.
#[derive(Debug, Clone, Copy)]
pub struct AreasFile<'a> {
    pub path: &'a Path,
    /// The coordinates are metres east and north of the origin.
    pub in_metres: bool,
}

/// Prints the last weighted areas sent and those in force.
pub async fn show_areas(session: &Session) -> Result<(), UserError> {
    let state = session.state().await?;
    let v = session.choose(&state)?;
    let view = OrderView { sent: &v.orders.areas, slot: slot(v, "areas"), in_force: &v.orders.areas_in_force };
    session.print(&view, || view.text(state.now_s, areas_text))
}

/// Sends the weighted areas of a GeoJSON file, or removes them all.
pub async fn set_areas(session: &Session, file: Option<AreasFile<'_>>) -> Result<(), UserError> {
    let state = session.state().await?;
    let v = session.choose(&state)?;
    let order = match file {
        Some(file) => {
            let frame = if file.in_metres { CoordinateFrame::Metres } else { degrees(&state)? };
            let area = |AreaShape { outline, weight }| AreaOrder { outline, weight };
            let order = AreasOrder { areas: read_areas(file.path, frame)?.into_iter().map(area).collect() };
            order.read().map_err(|line| UserError::file(file.path, line))?;
            order
        }
        None => AreasOrder::default(),
    };
    send(session, v, "areas", &order).await
}

/// Sends the vehicle to a place, metres in the world frame, or withdraws that order.
pub async fn go(session: &Session, place: Option<[f64; 2]>) -> Result<(), UserError> {
    let state = session.state().await?;
    let order = DestinationOrder { place };
    order.read().map_err(UserError::Input)?;
    send(session, session.choose(&state)?, "destination", &order).await
}

fn areas_text(order: &AreasOrder) -> String {
    let mut out = String::new();
    for (number, area) in (1..).zip(&order.areas) {
        let corners: Vec<String> = area.outline.iter().map(|[x, y]| format!(" E {x:.1} N {y:.1}")).collect();
        let _ = writeln!(out, "  area {number}  {:+.2} {}", area.weight, corners.join(","));
    }
    if out.is_empty() { "  no weighted areas\n".to_owned() } else { out }
}

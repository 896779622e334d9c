//! What people write on the map, which stays at the surface: names, colours and merging of labels, markers, notes.

use super::constraints::{ask_of, ask_surface};
use super::names;
use super::session::Session;
use scenecast_core::{UserError, one_line};
use scenecast_surface::state::VehicleMarker;
use scenecast_surface::{LabelOrder, MarkerOrder, NoteOrder, RemoveMarkerOrder};

/// What is to be changed of a label; `None` stays as it is, an empty text is removed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LabelChange {
    pub name: Option<String>,
    /// Red, green and blue in hexadecimal digits, as in `#a0b1c2`.
    pub colour: Option<String>,
    /// Number or name of the label that it is shown as a part of.
    pub merged_into: Option<String>,
}

/// Changes name, colour or merging of a label, which is given by number or by name.
pub async fn edit_label(session: &Session, label: &str, change: LabelChange) -> Result<(), UserError> {
    let state = session.state().await?;
    let vehicle = session.choose(&state)?;
    let book = &vehicle.label_book;
    let label = names::label(book, label)?;
    let before = book.get(&label).cloned().unwrap_or_default();
    let merged_into = match change.merged_into.as_deref() {
        None => before.merged_into,
        Some("") => None,
        Some(other) => Some(names::label(book, other)?),
    };
    let changed = |new: Option<String>, old| new.map_or(old, |text| Some(text).filter(|text| !text.is_empty()));
    let (name, colour) = (changed(change.name, before.name), changed(change.colour, before.colour));
    ask_of(session, vehicle, "labels", &LabelOrder { label, name, colour, merged_into }).await
}

/// Sets a marker at a place in the world frame, metres east and north.
pub async fn mark(session: &Session, [x_m, y_m]: [f64; 2], text: String) -> Result<(), UserError> {
    ask_surface(session, "markers", &MarkerOrder { x_m, y_m, text }).await
}

/// Removes the marker with this number.
pub async fn remove_mark(session: &Session, number: u32) -> Result<(), UserError> {
    let state = session.state().await?;
    let vehicle = session.choose(&state)?;
    if vehicle.markers.iter().all(|marker| marker.number != number) {
        let known: Vec<String> = vehicle.markers.iter().map(|marker| marker.number.to_string()).collect();
        let known = if known.is_empty() { "there are none".to_owned() } else { known.join(", ") };
        return Err(UserError::Input(format!("marker {number}: there is no such marker; known: {known}")));
    }
    ask_of(session, vehicle, "markers/remove", &RemoveMarkerOrder { number }).await
}

/// Prints the markers of the chosen vehicle: number, place in metres east and north, text and author.
pub async fn show_marks(session: &Session) -> Result<(), UserError> {
    let state = session.state().await?;
    let markers = &session.choose(&state)?.markers;
    session.print(markers, || match &markers[..] {
        [] => "no marker\n".to_owned(),
        markers => {
            let line = |m: &VehicleMarker| {
                format!(
                    "{}: {:.1} m east, {:.1} m north: {} ({})\n",
                    m.number,
                    m.x_m,
                    m.y_m,
                    one_line(&m.text),
                    one_line(&m.author)
                )
            };
            markers.iter().map(line).collect()
        }
    })
}

/// Adds a note about the vehicle to the log.
pub async fn note(session: &Session, text: String) -> Result<(), UserError> {
    ask_surface(session, "notes", &NoteOrder { text }).await
}

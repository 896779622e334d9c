//! Maps and images as files.

use super::names;
use super::session::{Session, follow};
use scenecast_core::UserError;
use scenecast_files::write_whole;
use scenecast_surface::state::{AcceptedOrder, ExemplarProgress, ExemplarStage, MissionState};
use scenecast_surface::{ExemplarAction, ExemplarOrder};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The first that fits counts.
const MAP_FORMATS: [&str; 11] =
    ["png", "geojson", "ply", "labels.csv", "csv", "coco.json", "taglab.json", "json", "utm.tif", "wgs84.tif", "tif"];
const IMAGE_TIMEOUT: Duration = Duration::from_secs(600);

/// Writes the map of a vehicle in the format of the extension, with `labels` labels or all of them.
pub async fn save_map(session: &Session, out: &Path, labels: Option<u8>) -> Result<(), UserError> {
    let name = out.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let Some(format) = MAP_FORMATS.into_iter().find(|format| name.ends_with(&format!(".{format}"))) else {
        return Err(UserError::file(out, format!("the name must end in one of .{}", MAP_FORMATS.join(", ."))));
    };
    if format == "json" && labels.is_some() {
        return Err(UserError::file(out, "a map as JSON has all labels, and their tree to cut: leave out --labels"));
    }
    let state = session.state().await?;
    let base = format!("/api/v2/vehicles/{}/map", session.choose(&state)?.id);
    let cut = labels.map_or_else(String::new, |count| format!("?labels={count}"));
    let file = |extension: &str| format!("{base}.{extension}{cut}");
    let files: Vec<(String, PathBuf)> = match format {
        "json" => vec![(base, out.to_owned())],
        "png" => vec![
            (file("png"), out.to_owned()),
            (file("pgw"), out.with_extension("pgw")),
            (file("png.aux.xml"), out.with_extension("png.aux.xml")),
        ],
        "tif" | "utm.tif" | "wgs84.tif" => {
            let classes = out.with_file_name(format!("{name}.aux.xml"));
            vec![(file(format), out.to_owned()), (file(&format!("{format}.aux.xml")), classes)]
        }
        _ => vec![(file(format), out.to_owned())],
    };
    for ((_, path), bytes) in files.iter().zip(of_one_version(session, &files).await?) {
        write_whole(path, &bytes)?;
    }
    let written: Vec<String> = files.iter().map(|(_, path)| path.display().to_string()).collect();
    session.print(&written, || format!("{}\n", written.join("\n")))
}

/// Files of the same version of the map.
async fn of_one_version(session: &Session, files: &[(String, PathBuf)]) -> Result<Vec<Vec<u8>>, UserError> {
    const MAX_TRIES: usize = 10;
    for _ in 0..MAX_TRIES {
        let (mut all, mut tags) = (Vec::new(), Vec::new());
        for (path, _) in files {
            let (bytes, tag) = session.client.get(path).await?;
            all.push(bytes.to_vec());
            tags.push(tag);
        }
        tags.dedup();
        if tags.len() <= 1 {
            return Ok(all);
        }
    }
    Err(UserError::Failed(format!("the map changed {MAX_TRIES} times during the download; try again")))
}

/// Writes an image of a label, by number or by name. Requests it from the vehicle if `action` is given or the surface has no image.
pub async fn save_exemplar(
    session: &Session,
    label: &str,
    out: &Path,
    action: Option<ExemplarAction>,
) -> Result<(), UserError> {
    let state = session.state().await?;
    let vehicle = session.choose(&state)?;
    let (vehicle, label) = (vehicle.id, names::label(&vehicle.label_book, label)?);
    let latest = find(&state, vehicle, label).and_then(|e| e.images.last()).map(|i| i.at_s);
    if action.is_some() || latest.is_none() {
        let accepted = request(session, vehicle, label, action.unwrap_or_default()).await?;
        let version = accepted.versions.get(&vehicle).copied().unwrap_or(0);
        wait_for_image(session, (vehicle, label), version, latest).await?;
    }
    let (webp, _) = session.client.get(&format!("/api/v2/vehicles/{vehicle}/exemplars/{label}.webp")).await?;
    write_whole(out, &webp)?;
    let written = out.display().to_string();
    session.print(&written, || format!("{written}\n"))
}

/// Cancels the request for an image of a label.
pub async fn cancel_exemplar(session: &Session, label: &str) -> Result<(), UserError> {
    let state = session.state().await?;
    let vehicle = session.choose(&state)?;
    let label = names::label(&vehicle.label_book, label)?;
    let accepted = request(session, vehicle.id, label, ExemplarAction::Cancel).await?;
    follow(session, accepted).await
}

async fn request(
    session: &Session,
    vehicle: u8,
    label: u8,
    action: ExemplarAction,
) -> Result<AcceptedOrder, UserError> {
    let order = ExemplarOrder { label, action, image: None };
    session.client.post(&format!("/api/v2/vehicles/{vehicle}/exemplars"), &order).await
}

/// Waits for an image other than the one of mission time `before`.
async fn wait_for_image(
    session: &Session,
    (vehicle, label): (u8, u8),
    version: u16,
    before: Option<f64>,
) -> Result<(), UserError> {
    let wait = session.wait.unwrap_or(IMAGE_TIMEOUT);
    let mut last = String::from("requested");
    let arrival = async {
        let mut events = session.client.events().await?;
        loop {
            let state = events.state().await?;
            let slots = state.vehicles.iter().find(|v| v.id == vehicle).map(|v| &v.orders.directive.slots);
            let slot = slots.and_then(|slots| slots.iter().find(|s| s.slot == "requests"));
            if slot.is_none_or(|s| s.version < version) {
                continue;
            }
            let Some(exemplar) = find(&state, vehicle, label) else {
                return Err(UserError::Failed(format!("label {label} is no longer on the map")));
            };
            match exemplar.state {
                ExemplarStage::Received if exemplar.images.last().map(|i| i.at_s) != before => return Ok(()),
                ExemplarStage::Refused => {
                    let reason = slot.and_then(|s| s.reason.clone()).unwrap_or_default();
                    return Err(UserError::Failed(format!("refused: {reason}")));
                }
                ExemplarStage::Receiving => {
                    session.note(&mut last, format!("receiving, {:.0} %", 100.0 * exemplar.progress));
                }
                ExemplarStage::NotAvailable => session.note(&mut last, "the vehicle has none yet".to_owned()),
                ExemplarStage::OnAir => session.note(&mut last, "on air".to_owned()),
                ExemplarStage::Queued => session.note(&mut last, "queued".to_owned()),
                ExemplarStage::None | ExemplarStage::Received => {
                    return Err(UserError::Failed("the request was cancelled".to_owned()));
                }
            }
        }
    };
    match tokio::time::timeout(wait, arrival).await {
        Ok(ended) => ended,
        Err(_) => Err(UserError::Failed(format!(
            "the image of label {label} has not arrived after {:.0} s ({last}); the request continues, try again later",
            wait.as_secs_f64()
        ))),
    }
}

fn find(state: &MissionState, vehicle: u8, label: u8) -> Option<&ExemplarProgress> {
    let vehicle = state.vehicles.iter().find(|v| v.id == vehicle)?;
    vehicle.labels.iter().find(|l| l.id == label).map(|l| &l.exemplar)
}

//! Maps and images as files.

use super::Ctl;
use crate::orders::{ExemplarOrder, ExemplarWish};
use crate::state::{Accepted, Exemplar, ExemplarState, State};
use scenecast_core::UserError;
use scenecast_files::write_whole;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The formats of a map.
const FORMATS: [&str; 5] = ["png", "geojson", "ply", "csv", "json"];
/// How long to wait for an image unless it is said.
const IMAGE: Duration = Duration::from_secs(600);

impl Ctl {
    /// Writes the map of a vehicle; the end of the name says in which format.
    pub async fn map(&self, out: &Path) -> Result<(), UserError> {
        let format = out.extension().and_then(|e| e.to_str()).unwrap_or_default();
        if !FORMATS.contains(&format) {
            return Err(UserError::file(out, format!("the name ends in one of .{}", FORMATS.join(", ."))));
        }
        let state = self.state().await?;
        let base = format!("/api/v1/vehicles/{}/map", self.choose(&state)?.id);
        let files: Vec<(String, PathBuf)> = match format {
            "json" => vec![(base, out.to_owned())],
            "png" => vec![
                (format!("{base}.png"), out.to_owned()),
                (format!("{base}.pgw"), out.with_extension("pgw")),
                (format!("{base}.png.aux.xml"), out.with_extension("png.aux.xml")),
            ],
            _ => vec![(format!("{base}.{format}"), out.to_owned())],
        };
        for ((_, path), bytes) in files.iter().zip(self.alike(&files).await?) {
            write_whole(path, &bytes)?;
        }
        let written: Vec<String> = files.iter().map(|(_, path)| path.display().to_string()).collect();
        self.tell(&written, || format!("{}\n", written.join("\n")))
    }

    /// Files of one version of the map.
    async fn alike(&self, files: &[(String, PathBuf)]) -> Result<Vec<Vec<u8>>, UserError> {
        const TRIES: usize = 10;
        for _ in 0..TRIES {
            let (mut all, mut tags) = (Vec::new(), Vec::new());
            for (path, _) in files {
                let (bytes, tag) = self.client.get(path).await?;
                all.push(bytes.to_vec());
                tags.push(tag);
            }
            tags.dedup();
            if tags.len() <= 1 {
                return Ok(all);
            }
        }
        Err(UserError::Failed(format!("the map has changed {TRIES} times while it was fetched; try again")))
    }

    /// Writes an image of a label. The vehicle is asked for it if there is none here, or for the one that is wished for.
    pub async fn exemplar(&self, label: u8, out: &Path, wish: Option<ExemplarWish>) -> Result<(), UserError> {
        let state = self.state().await?;
        let vehicle = self.choose(&state)?.id;
        let newest = find(&state, vehicle, label).and_then(|e| e.pictures.last()).map(|p| p.at_s);
        if wish.is_some() || newest.is_none() {
            let accepted = self.ask(vehicle, label, wish.unwrap_or_default()).await?;
            let version = accepted.versions.get(&vehicle).copied().unwrap_or(0);
            self.await_image((vehicle, label), version, newest).await?;
        }
        let (webp, _) = self.client.get(&format!("/api/v1/vehicles/{vehicle}/exemplars/{label}.webp")).await?;
        write_whole(out, &webp)?;
        let written = out.display().to_string();
        self.tell(&written, || format!("{written}\n"))
    }

    /// Takes back what is asked of a label.
    pub async fn cancel_exemplar(&self, label: u8) -> Result<(), UserError> {
        let state = self.state().await?;
        let accepted = self.ask(self.choose(&state)?.id, label, ExemplarWish::Cancel).await?;
        self.follow(accepted).await
    }

    async fn ask(&self, vehicle: u8, label: u8, what: ExemplarWish) -> Result<Accepted, UserError> {
        let order = ExemplarOrder { label, what, picture: None };
        self.client.post(&format!("/api/v1/vehicles/{vehicle}/exemplars"), &order).await
    }

    /// Waits for an image that is newer than the one of `before`.
    async fn await_image(
        &self,
        (vehicle, label): (u8, u8),
        version: u16,
        before: Option<f64>,
    ) -> Result<(), UserError> {
        let wait = self.wait.unwrap_or(IMAGE);
        let mut last = String::from("asked for");
        let coming = async {
            let mut events = self.client.events().await?;
            loop {
                let state = events.state().await?;
                let slots = state.vehicles.iter().find(|v| v.id == vehicle).map(|v| &v.directive.slots);
                let request = slots.and_then(|slots| slots.iter().find(|s| s.slot == "requests"));
                if request.is_none_or(|r| r.version < version) {
                    continue;
                }
                let Some(image) = find(&state, vehicle, label) else {
                    return Err(UserError::Failed(format!("label {label} is not on the map any more")));
                };
                match image.state {
                    ExemplarState::Here if image.pictures.last().map(|p| p.at_s) != before => return Ok(()),
                    ExemplarState::Refused => {
                        let why = request.and_then(|r| r.reason.clone()).unwrap_or_default();
                        return Err(UserError::Failed(format!("refused: {why}")));
                    }
                    ExemplarState::Coming => self.note(&mut last, format!("coming, {:.0} %", 100.0 * image.progress)),
                    ExemplarState::NoneYet => self.note(&mut last, "the vehicle has none yet".to_owned()),
                    ExemplarState::OnAir => self.note(&mut last, "on air".to_owned()),
                    ExemplarState::None | ExemplarState::Here => {
                        return Err(UserError::Failed("it was cancelled".to_owned()));
                    }
                    ExemplarState::Queued => self.note(&mut last, "queued".to_owned()),
                }
            }
        };
        match tokio::time::timeout(wait, coming).await {
            Ok(ended) => ended,
            Err(_) => Err(UserError::Failed(format!(
                "the image of label {label} is not here after {:.0} s ({last}); it goes on coming, ask again later",
                wait.as_secs_f64()
            ))),
        }
    }

    /// Shows progress to people, once each step.
    pub(super) fn note(&self, last: &mut String, now: String) {
        if *last != now {
            if !self.json {
                eprintln!("{now}");
            }
            *last = now;
        }
    }
}

fn find(state: &State, vehicle: u8, label: u8) -> Option<&Exemplar> {
    let vehicle = state.vehicles.iter().find(|v| v.id == vehicle)?;
    vehicle.labels.iter().find(|l| l.id == label).map(|l| &l.exemplar)
}

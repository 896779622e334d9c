//! The operator's maps as files. They are made and written beside the loop of the link, which only hands over shared tiles.

use scenecast_console::MapFormat;
use scenecast_core::UserError;
use scenecast_core::WGS84_AUX_XML;
use scenecast_core::label_picture::MAX_CELLS;
use scenecast_files::write_whole;
use scenecast_surface::MapCells;
use scenecast_surface::state::Origin;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tokio::sync::watch;
use tokio::task::JoinHandle;

/// Files take at most the tenth part of a core: after each round the writer pauses nine times as long as it took.
const PAUSE_FACTOR: u32 = 9;
const MAX_PAUSE: Duration = Duration::from_secs(60);

/// A map to be written.
#[derive(Debug, Clone)]
pub(crate) struct MapFile {
    pub(crate) cells: MapCells,
    /// The world file of the picture; `None` while the place of the map on the Earth is unknown.
    pub(crate) world_file: Option<String>,
    pub(crate) origin: Option<Origin>,
}

/// The latest map of each vehicle by address, with a number that grows with each.
type Waiting = BTreeMap<u8, (u64, MapFile)>;

/// Hands maps to a writer, which skips those that a later one has replaced.
#[derive(Debug)]
pub(crate) struct MapFiles {
    waiting: watch::Sender<Waiting>,
    writer: JoinHandle<()>,
}

impl MapFiles {
    /// Starts a writer of files in `dir`. It needs a runtime of tokio.
    pub(crate) fn start(dir: PathBuf) -> Self {
        let (waiting, receiver) = watch::channel(Waiting::new());
        Self { waiting, writer: tokio::spawn(write_all(dir, receiver)) }
    }

    /// Hands over the latest map of a vehicle.
    pub(crate) fn write(&self, vehicle: u8, file: MapFile) {
        self.waiting.send_modify(|waiting| {
            let number = waiting.get(&vehicle).map_or(0, |(number, _)| number + 1);
            waiting.insert(vehicle, (number, file));
        });
    }

    /// Waits until the last maps are on disk.
    pub(crate) async fn finish(self) {
        drop(self.waiting);
        let _ = self.writer.await;
    }
}

async fn write_all(dir: PathBuf, mut receiver: watch::Receiver<Waiting>) {
    let mut written: BTreeMap<u8, u64> = BTreeMap::new();
    let mut is_failing = false;
    // The last change is also seen after its sender has ended.
    while receiver.changed().await.is_ok() {
        let latest = receiver.borrow_and_update().clone();
        let began = Instant::now();
        for (vehicle, (number, file)) in latest {
            if written.insert(vehicle, number) == Some(number) {
                continue;
            }
            let dir = dir.clone();
            let made = tokio::task::spawn_blocking(move || write(&dir, vehicle, &file)).await;
            // A full disk or received data must not end the run.
            match made {
                Ok(Err(reason)) if !is_failing => {
                    is_failing = true;
                    tracing::warn!(
                        "the map of vehicle {vehicle} is not written: {reason}; further failures are not logged"
                    );
                }
                Ok(Ok(())) => is_failing = false,
                _ => {}
            }
        }
        let pause = (began.elapsed() * PAUSE_FACTOR).min(MAX_PAUSE);
        tokio::select! {
            () = tokio::time::sleep(pause) => {}
            () = closed(&receiver) => {}
        }
    }
}

/// Waits until no more maps can come.
async fn closed(receiver: &watch::Receiver<Waiting>) {
    let mut receiver = receiver.clone();
    while receiver.changed().await.is_ok() {}
}

/// A picture with its world file, or a GeoTIFF where a picture would have too many pixels. The other kind is removed, since it
/// would be out of date.
fn write(dir: &Path, vehicle: u8, map: &MapFile) -> Result<(), UserError> {
    let path = |extension: &str| dir.join(format!("operator-map-{vehicle}.{extension}"));
    let put = |extension: &str, bytes: &[u8]| write_whole(&path(extension), bytes);
    let remove = |extension: &str| match std::fs::remove_file(path(extension)) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(UserError::failed(e)),
        _ => Ok(()),
    };
    let export = |format: MapFormat| format.export(&map.cells, map.origin).map_err(UserError::failed);
    if map.cells.bounds.is_some_and(|b| b.area() > MAX_CELLS) {
        put("tif", &export(MapFormat::Tiff)?)?;
        remove("pgw")?;
        remove("png.aux.xml")?;
        return remove("png");
    }
    if let Some(text) = &map.world_file {
        put("pgw", text.as_bytes())?;
        put("png.aux.xml", WGS84_AUX_XML.as_bytes())?;
    }
    put("png", &export(MapFormat::Png)?)?;
    remove("tif")
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::{Cell, LabelGrid};

    fn file(cells: &[(i32, i32)]) -> MapFile {
        let grid: LabelGrid = cells.iter().map(|&(x, y)| (Cell::new(x, y), 3)).collect();
        MapFile { cells: MapCells::of_labels(&grid, 0.25), world_file: Some("1".to_owned()), origin: None }
    }

    #[test]
    fn the_last_map_is_on_disk_when_the_writer_has_finished() {
        let dir = std::env::temp_dir().join(format!("scenecast-map-files-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let names = || {
            let mut names: Vec<_> = std::fs::read_dir(&dir).unwrap().map(|e| e.unwrap().file_name()).collect();
            names.sort();
            names.into_iter().map(|name: std::ffi::OsString| name.into_string().unwrap()).collect::<Vec<_>>()
        };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
        let run = |maps: &[(u8, MapFile)]| {
            runtime.block_on(async {
                let files = MapFiles::start(dir.clone());
                maps.iter().for_each(|(vehicle, map)| files.write(*vehicle, map.clone()));
                files.finish().await;
            });
        };
        run(&[(2, file(&[(0, 0), (80_000, 80_000)])), (1, file(&[(0, 0)])), (2, file(&[(0, 0), (1, 1)]))]);
        let files = |vehicle: u8| ["pgw", "png", "png.aux.xml"].map(|kind| format!("operator-map-{vehicle}.{kind}"));
        assert_eq!(names(), [files(1), files(2)].concat());
        run(&[(1, file(&[(0, 0), (80_000, 80_000)]))]);
        assert_eq!(names(), [&["operator-map-1.tif".to_owned()][..], &files(2)].concat());
        run(&[(1, file(&[(5, 5)]))]);
        assert_eq!(names()[..3], files(1));
        std::fs::remove_dir_all(&dir).unwrap();
    }
}

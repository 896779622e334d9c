//! Records of missions over a link with losses: what a replay shows, what a power cut takes, what recording costs.

mod command;

pub(crate) use command::RecordBench;

use scenecast::mission_record::{MissionRecord, UnseenPage};
use scenecast_config::Config;
use scenecast_console::report::Dive;
use scenecast_console::{Recording, Replay};
use scenecast_core::UserError;
use scenecast_files::{read_record, recover};
use scenecast_protocol::map::LabelGrid;
use scenecast_rehearsal::{Mission, MissionOptions, World};
use scenecast_surface::state::{ReplayOrder, ReplaySide};
use scenecast_surface::{ClientRequest, Reply, SurfaceRequest};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Mission time between two syncs, as of the recorder of a process.
const SYNC_INTERVAL: Duration = Duration::from_millis(1500);
/// How long a link that has lost frames goes on after the survey.
const DRAIN: Duration = Duration::from_secs(300);

/// What the record of one mission is worth.
#[derive(Debug, Default, Serialize)]
pub(crate) struct RecordFigures {
    pub(crate) seed: u64,
    /// Share of frames that the channel lost.
    pub(crate) loss: f64,
    pub(crate) mission_s: f64,
    /// Maps that were compared: that of each side at each second; and those that differ.
    pub(crate) compared: usize,
    pub(crate) differing: usize,
    /// Cuts, and the most seconds that one took.
    pub(crate) cuts: usize,
    pub(crate) worst_lost_s: f64,
    /// Bytes of the records of the surface and of the vehicle.
    pub(crate) bytes: [u64; 2],
    /// Time of the recorder on one core for each second of the mission.
    pub(crate) recorder_share: f64,
    pub(crate) open_s: f64,
    pub(crate) worst_seek_s: f64,
    pub(crate) report_s: f64,
    pub(crate) report_bytes: usize,
}

/// The maps of a mission at one of its seconds: that of the operator and that of the vehicle.
struct Moment {
    at_s: f64,
    maps: [LabelGrid; 2],
    /// Bytes of both records that were durable then.
    durable: [u64; 2],
}

/// Flies a mission, records it in `dir`, and judges the record. `cuts` is the number of power cuts of each end.
pub(crate) fn judge(config: &Config, seed: u64, cuts: usize, dir: &Path) -> Result<RecordFigures, UserError> {
    let _ = std::fs::remove_dir_all(dir);
    let folders = ["surface", "vehicle"].map(|end| dir.join(end));
    let (moments, recorder) = fly(config, seed, &folders)?;
    let mission_s = moments.last().map_or(0.0, |moment| moment.at_s);
    let mut figures = RecordFigures {
        seed,
        loss: config.channel.loss,
        mission_s,
        bytes: [part(&folders[0]), part(&folders[1])].map(|file| size(&file)),
        recorder_share: recorder.as_secs_f64() / mission_s.max(1.0),
        ..RecordFigures::default()
    };
    compare(&folders, &moments, &mut figures)?;
    cut(&folders, &moments, cuts, seed, &mut figures)?;
    let began = Instant::now();
    figures.report_bytes = Dive::read(folders.as_slice())?.html().len();
    figures.report_s = began.elapsed().as_secs_f64();
    std::fs::remove_dir_all(dir).map_err(|e| UserError::file(dir, e))?;
    Ok(figures)
}

fn fly(config: &Config, seed: u64, folders: &[PathBuf; 2]) -> Result<(Vec<Moment>, Duration), UserError> {
    let world = World::procedural(config, seed);
    let mut mission = Mission::new(config.clone(), MissionOptions { world, seed, record: None })?;
    let mut record = MissionRecord::create(&mut mission, [&folders[0], &folders[1]], SYNC_INTERVAL)?;
    let mut page = UnseenPage::new(&mission, seed);
    let vehicle = scenecast_config::vehicle_address(config)?;
    let (mut moments, mut recorder) = (Vec::new(), Duration::ZERO);
    let mut observe = |mission: &mut Mission, record: &mut MissionRecord| {
        // The page makes the state whether or not it is recorded.
        let snapshot = page.snapshot(mission);
        let began = Instant::now();
        record.observe(mission, &snapshot)?;
        recorder += began.elapsed();
        let operator = mission.surface().map(vehicle).cloned().unwrap_or_default();
        let maps = [operator, mission.vehicle().map().clone()];
        let durable = [0, 1].map(|end| size(&part(&folders[end])));
        moments.push(Moment { at_s: mission.now().as_secs_f64(), maps, durable });
        Ok(())
    };
    mission.run(DRAIN, &mut |mission| observe(mission, &mut record))?;
    observe(&mut mission, &mut record)?;
    record.finish(&mission)?;
    Ok((moments, recorder))
}

/// Seeks each second, in an order that jumps, and compares the maps of both sides with those of the mission.
fn compare(folders: &[PathBuf; 2], moments: &[Moment], figures: &mut RecordFigures) -> Result<(), UserError> {
    let began = Instant::now();
    let mut replay = Replay::new(Recording::read(folders.as_slice())?, 1.0);
    let first = replay.snapshot().state;
    // The moment at which the mission began.
    let began_utc_s = first.replay.map_or(0.0, |replay| replay.from_utc_s) - first.now_s;
    figures.open_s = began.elapsed().as_secs_f64();
    let sides = [ReplaySide::Operator, ReplaySide::Vehicle];
    // Forwards in steps of several seconds, from several beginnings: each second is sought once, and seeks go back as well.
    const STRIDE: usize = 7;
    for moment in (0..STRIDE).flat_map(|from| moments.iter().skip(from).step_by(STRIDE)) {
        for (side, map) in sides.into_iter().zip(&moment.maps) {
            // A float rounds times of today to a fraction of a microsecond.
            let at_utc_s = Some(began_utc_s + moment.at_s + 1e-4);
            let order = ReplayOrder { at_utc_s, side: Some(side), ..ReplayOrder::default() };
            let began = Instant::now();
            let moved = replay.handle_request(reading(SurfaceRequest::Replay(order)));
            let state = replay.snapshot().state;
            figures.worst_seek_s = figures.worst_seek_s.max(began.elapsed().as_secs_f64());
            let shown = state.vehicles.first().map_or(0, |vehicle| vehicle.map.explored_cells) as usize;
            let is_same = match replay.handle_request(reading(SurfaceRequest::Map(1))) {
                Reply::Map(cells) => {
                    map.iter().all(|(cell, label)| cells.label(cell) == label) && shown == map.explored()
                }
                _ => map.explored() == 0,
            };
            figures.compared += 1;
            figures.differing += usize::from(!is_same || !matches!(moved, Reply::Replay(_)));
        }
    }
    Ok(())
}

fn reading(request: SurfaceRequest) -> ClientRequest {
    ClientRequest { by: None, request }
}

/// Cuts the records at moments, with some of what the disk had not promised yet, makes them whole, and finds the last message.
fn cut(
    folders: &[PathBuf; 2],
    moments: &[Moment],
    cuts: usize,
    seed: u64,
    figures: &mut RecordFigures,
) -> Result<(), UserError> {
    let mut random = seed;
    for number in 0..cuts {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let (at, end) = ((random >> 33) as usize % moments.len().max(1), number % 2);
        let Some(moment) = moments.get(at).filter(|moment| moment.durable[end] > 0) else { continue };
        let whole = std::fs::read(part(&folders[end])).map_err(|e| UserError::file(&folders[end], e))?;
        // A part of the next chunk may be on the disk, too.
        let durable = moment.durable[end] as usize;
        let next = moments.iter().map(|moment| moment.durable[end] as usize).find(|next| *next > durable);
        let more = (random >> 8) as usize % next.unwrap_or(whole.len()).saturating_sub(durable).max(1);
        let bytes = whole.get(..durable + more).unwrap_or(&whole);
        let folder = folders[end].with_extension("cut");
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir(&folder).map_err(|e| UserError::file(&folder, e))?;
        std::fs::write(part(&folder), bytes).map_err(|e| UserError::file(&folder, e))?;
        recover(&folder)?;
        let mut written = Vec::new();
        read_record(&folders[end], |message| written.push(message.nanos()))?;
        let begin_s = moments.first().map_or(0.0, |moment| moment.at_s);
        let begin = written.iter().min().copied().unwrap_or_default();
        let cut = begin + ((moment.at_s - begin_s).max(0.0) * 1e9) as u64;
        // While nothing happens, nothing is lost.
        let last = written.into_iter().filter(|nanos| *nanos <= cut).max().unwrap_or(begin);
        // A cut in the first seconds may leave no message: what is lost is then all since the begin.
        let mut kept = begin;
        if let Some(damage) = read_record(&folder, |message| kept = kept.max(message.nanos()))? {
            return Err(UserError::file(&folder, format!("after recover: {damage}")));
        }
        figures.cuts += 1;
        figures.worst_lost_s = figures.worst_lost_s.max(last.saturating_sub(kept) as f64 / 1e9);
        std::fs::remove_dir_all(&folder).map_err(|e| UserError::file(&folder, e))?;
    }
    Ok(())
}

/// The only file of a record.
fn part(folder: &Path) -> PathBuf {
    let stem = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    folder.join(format!("{stem}_0.mcap"))
}

fn size(file: &Path) -> u64 {
    std::fs::metadata(file).map_or(0, |file| file.len())
}

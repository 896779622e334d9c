//! A wide survey at the surface: the cost of an update, of loading the whole map, of exports, and of memory.

mod command;
mod survey;

pub(crate) use command::WideBench;

use crate::cpu_meter::{CpuMeter, resident_bytes};
use scenecast_config::Config;
use scenecast_console::{MapFormat, TiledMap, gzip, page_files};
use scenecast_core::UserError;
use scenecast_surface::state::Origin;
use scenecast_surface::{
    ClientRequest, LinkMeter, MapCells, MissionFacts, Reply, SurfaceRequest, handle_request, snapshot,
};
use serde::Serialize;
use std::time::Duration;
use survey::WideSurvey;

/// The size of the survey and of its updates.
#[derive(Debug, Clone, Copy)]
pub struct WideSetting {
    pub cells: usize,
    /// Side of the square that the survey spans, metres.
    pub box_m: f64,
    pub update: usize,
    /// Number of updates that are measured.
    pub updates: usize,
    /// Whether the map also has depths.
    pub depth: bool,
}

/// Where a survey was made: any place, far from the middle of its UTM zone.
const ORIGIN: Origin = Origin { lat_deg: 60.17, lon_deg: -10.25 };

/// Keeps an export, by its extension.
type Keep<'a> = dyn FnMut(&str, &[u8]) -> Result<(), UserError> + 'a;

/// The medians of the updates.
#[derive(Debug, Clone, Serialize)]
pub struct UpdateCost {
    pub cells: f64,
    /// CPU time in the loop of the link: the state and the list of tiles, milliseconds.
    pub link_loop_ms: f64,
    /// CPU time beside the loop: comparing, encoding and packing the changed tiles, milliseconds.
    pub tiles_ms: f64,
    /// Bytes of the packed tiles.
    pub tiles_bytes: f64,
    /// Bytes of the state, which is sent after each change and each second.
    pub state_bytes: f64,
}

/// An export of the whole map.
#[derive(Debug, Clone, Serialize)]
pub struct ExportCost {
    pub format: &'static str,
    pub cpu_ms: f64,
    pub bytes: usize,
    /// Why the format does not hold this map.
    pub refused: Option<String>,
}

#[derive(Debug, Clone, Serialize)]
pub struct WideFigures {
    pub explored_cells: usize,
    pub box_m: f64,
    pub layers: usize,
    /// Bytes of the page in gzip.
    pub page_bytes: usize,
    /// Bytes of all tiles in gzip.
    pub map_bytes: usize,
    /// CPU time for all tiles, milliseconds.
    pub map_ms: f64,
    pub update: UpdateCost,
    pub exports: Vec<ExportCost>,
    /// Growth of the process while the surface received the map; null where the system does not report it.
    pub surface_bytes: Option<u64>,
}

/// Measures a survey. `progress` receives the share of the cells that have arrived, `keep` the extension and the bytes of each
/// export.
///
/// # Errors
///
/// A configuration that is not valid, or a map that does not arrive.
pub fn wide(
    config: &Config,
    setting: WideSetting,
    seed: u64,
    progress: &mut dyn FnMut(f64),
    keep: &mut Keep<'_>,
) -> Result<WideFigures, UserError> {
    let mut survey = WideSurvey::new(config, setting, seed)?;
    let before = resident_bytes();
    survey.receive(setting.cells, progress)?;
    let surface_bytes = resident_bytes().zip(before).map(|(after, before)| after.saturating_sub(before));
    let mut view = View::new(config, &mut survey)?;
    let meter = CpuMeter::start();
    let map_bytes = packed(&view.map, None);
    let map_ms = meter.ms();
    let mut costs = Vec::new();
    for _ in 0..setting.updates {
        survey.receive(setting.update, &mut |_| ())?;
        costs.push(view.update(&mut survey)?);
    }
    let cells = view.map.cells();
    let exports = MapFormat::ALL.into_iter().map(|format| export(cells, format, keep)).collect::<Result<_, _>>()?;
    Ok(WideFigures {
        explored_cells: survey.explored(),
        box_m: setting.box_m,
        layers: usize::from(setting.depth),
        page_bytes: page_files().filter_map(|(_, bytes)| gzip(bytes)).map(|packed| packed.len()).sum(),
        map_bytes,
        map_ms,
        update: median(&costs),
        exports,
        surface_bytes,
    })
}

/// The console's view of the survey.
struct View {
    facts: MissionFacts,
    meter: LinkMeter,
    map: TiledMap,
    explored: usize,
}

impl View {
    fn new(config: &Config, survey: &mut WideSurvey) -> Result<Self, UserError> {
        let facts = MissionFacts::new(config, &survey.modem, 1, 1.0);
        let map = TiledMap::first(cells(survey, facts.cell_m)?, 1);
        let meter = LinkMeter::new(
            Duration::from_secs_f64(config.link.budget_window_s),
            scenecast_protocol::time::Instant::ZERO,
        );
        Ok(Self { facts, meter, map, explored: survey.explored() })
    }

    /// What one page costs after a change of the map.
    fn update(&mut self, survey: &mut WideSurvey) -> Result<UpdateCost, UserError> {
        let cpu = CpuMeter::start();
        let state = snapshot(&survey.surface, &self.facts, &self.meter, survey.now);
        let cells = cells(survey, self.facts.cell_m)?;
        let link_loop_ms = cpu.ms();
        let cpu = CpuMeter::start();
        let tag = self.map.tag();
        self.map = self.map.next(cells);
        let tiles_bytes = packed(&self.map, Some(&tag));
        let arrived = survey.explored() - std::mem::replace(&mut self.explored, survey.explored());
        Ok(UpdateCost {
            cells: arrived as f64,
            link_loop_ms,
            tiles_ms: cpu.ms(),
            tiles_bytes: tiles_bytes as f64,
            state_bytes: state.json.len() as f64,
        })
    }
}

fn packed(map: &TiledMap, since: Option<&str>) -> usize {
    gzip(&map.tiles_since(since)).map_or(0, |packed| packed.len())
}

fn cells(survey: &mut WideSurvey, cell_m: f64) -> Result<MapCells, UserError> {
    let request = ClientRequest { by: None, request: SurfaceRequest::Map(survey.vehicle.number()) };
    match handle_request(&mut survey.surface, request, cell_m, survey.now) {
        Reply::Map(cells) => Ok(cells),
        _ => Err(UserError::Failed("the surface has no map".to_owned())),
    }
}

fn export(cells: &MapCells, format: MapFormat, keep: &mut Keep<'_>) -> Result<ExportCost, UserError> {
    let meter = CpuMeter::start();
    let made = format.export(cells, Some(ORIGIN));
    let cpu_ms = meter.ms();
    let bytes = made.as_ref().map_or(0, Vec::len);
    if let Ok(bytes) = &made {
        keep(format.extension(), bytes)?;
    }
    Ok(ExportCost { format: format.extension(), cpu_ms, bytes, refused: made.err().map(|refusal| refusal.to_string()) })
}

fn median(costs: &[UpdateCost]) -> UpdateCost {
    let middle =
        |of: fn(&UpdateCost) -> f64| scenecast_worlds::scoring::median(&costs.iter().map(of).collect::<Vec<f64>>());
    UpdateCost {
        cells: middle(|c| c.cells),
        link_loop_ms: middle(|c| c.link_loop_ms),
        tiles_ms: middle(|c| c.tiles_ms),
        tiles_bytes: middle(|c| c.tiles_bytes),
        state_bytes: middle(|c| c.state_bytes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wide_survey_of_few_cells_loads_and_updates_in_few_bytes() {
        let setting = WideSetting { cells: 20_000, box_m: 20_000.0, update: 500, updates: 3, depth: true };
        let config = scenecast_config::load(None, &[]).unwrap();
        let run = || wide(&config, setting, 1, &mut |_| (), &mut |_, _| Ok(())).unwrap();
        let found = run();
        assert!(found.explored_cells >= 21_500, "{found:?}");
        // A million cells in less than 3 MB, the page among them, are less than 2.8 bytes a cell.
        assert!(found.map_bytes < 56_000 && found.page_bytes < 200_000, "{found:?}");
        assert!(found.update.tiles_bytes < 20_000.0 && found.update.cells >= 500.0, "{found:?}");
        let refused: Vec<&str> = found.exports.iter().filter(|e| e.refused.is_some()).map(|e| e.format).collect();
        assert_eq!(refused, ["png", "coco.json"], "a PNG has no empty tiles, and COCO annotates it");
        let tiff = found.exports.iter().find(|e| e.format == "utm.tif").unwrap();
        assert!(tiff.bytes < 2_000_000, "{tiff:?}");
        let again = run();
        assert_eq!((found.map_bytes, found.update.tiles_bytes), (again.map_bytes, again.update.tiles_bytes));
    }
}

//! A vehicle whose folder is gone: it holds or has a fence of its own, and its surface gives the orders again.

use super::ends::{Disk, End, Ends, MoreSettings, Stop, failed};
use super::page::{Page, is_decided};
use crate::process::free_port;
use scenecast_core::UserError;
use scenecast_surface::LimitsOrder;
use scenecast_surface::state::{OrderStatus, ReportedMode, VehicleState};
use serde_json::json;
use std::path::Path;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(60);
/// The content of the vehicle's fence file, in metres.
const OWN_FENCE: &str =
    r#"{"type":"Polygon","coordinates":[[[-400,-400],[400,-400],[400,400],[-400,400],[-400,-400]]]}"#;

/// What vehicle and surface are set to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Setting {
    /// The vehicle holds, and the operator confirms that the orders are given again.
    Ask,
    /// The vehicle has a fence of its own, and the operator confirms.
    OwnFence,
    /// The vehicle holds, and the surface gives the orders again by itself.
    Automatic,
}

/// A vehicle that has lost its folder.
#[derive(Debug)]
pub(super) struct Forgotten {
    pub(super) setting: &'static str,
    /// Seconds from the start of the vehicle until the page shows what it does without orders, and until its orders are in force again.
    pub(super) safe_s: f64,
    pub(super) restored_s: f64,
}

/// Runs the mission of this number in `dir`.
///
/// # Errors
///
/// A promise is broken, or a process cannot be started.
pub(super) fn run(program: &Path, dir: &Path, recording: &Path, number: u32) -> Result<Forgotten, UserError> {
    let setting = [Setting::Ask, Setting::OwnFence, Setting::Automatic][number as usize % 3];
    let fence = dir.with_extension("geojson");
    std::fs::write(&fence, OWN_FENCE).map_err(failed("writing a fence"))?;
    let more = MoreSettings {
        vehicle: match setting {
            Setting::OwnFence => format!("[survey]\nfence_file = {:?}\n", fence.display().to_string()),
            _ => String::new(),
        },
        surface: match setting {
            Setting::Automatic => "[surface]\nrestore = \"auto\"\n".to_owned(),
            _ => String::new(),
        },
    };
    let ports = [free_port()?, free_port()?];
    let mut ends = Ends::new(program, dir, recording, ports, &more).map_err(failed("preparing a run"))?;
    let page = Page::new(ends.page())?;
    for end in [End::Surface, End::Vehicle] {
        ends.start(end, Disk::Sound).map_err(failed("starting a process"))?;
    }
    page.wait("a status", LIMIT, |v| v.status.is_some())?;
    page.order("constraints", &json!({"action": "resume"}))?;
    page.begin()?;
    page.wait("the orders", LIMIT, |v| {
        is_decided(v) && v.orders.directive.slots.len() >= 3 && mode(v) != Some(ReportedMode::Hold)
    })?;
    let ordered = page.vehicle().as_ref().map(limits).unwrap_or_default();
    ends.stop(End::Vehicle, Stop::Kill).map_err(failed("ending a process"))?;
    std::fs::remove_dir_all(ends.state_dir(End::Vehicle)).map_err(failed("removing a folder"))?;

    let began = Instant::now();
    ends.start(End::Vehicle, Disk::Sound).map_err(failed("starting a process"))?;
    let is_safe = |v: &VehicleState| match setting {
        Setting::OwnFence => v.orders.fence_in_force.as_ref().is_some_and(|fence| fence.version == 0),
        _ => mode(v) == Some(ReportedMode::Hold),
    };
    page.wait("a vehicle without orders that is safe", LIMIT, is_safe)?;
    let safe_s = began.elapsed().as_secs_f64();
    if setting != Setting::Automatic {
        page.wait("a surface that names the loss", LIMIT, |v| status(v, "fence") == Some(OrderStatus::Withdrawn))?;
        // A change of a part keeps the rest of what was lost.
        page.order("limits", &json!({"time_s": 9000}))?;
        page.order("orders/restore", &json!({}))?;
    }
    let is_restored =
        |v: &VehicleState| ["fence", "limits"].iter().all(|slot| status(v, slot) == Some(OrderStatus::Applied));
    page.wait("the orders again", LIMIT, is_restored)?;
    page.wait("the whole limits", LIMIT, |v| limits(v).silence_s == ordered.silence_s)?;
    Ok(Forgotten { setting: name(setting), safe_s, restored_s: began.elapsed().as_secs_f64() })
}

fn mode(vehicle: &VehicleState) -> Option<ReportedMode> {
    vehicle.status.as_ref().map(|status| status.mode)
}

/// The limits that the vehicle reported last as in force; the default ones where they are unknown.
fn limits(vehicle: &VehicleState) -> LimitsOrder {
    vehicle.orders.limits_in_force.as_ref().map(|applied| applied.order.clone()).unwrap_or_default()
}

fn status(vehicle: &VehicleState, slot: &str) -> Option<OrderStatus> {
    vehicle.orders.directive.slots.iter().find(|s| s.slot == slot).map(|s| s.state)
}

fn name(setting: Setting) -> &'static str {
    match setting {
        Setting::Ask => "holds, after a confirmation",
        Setting::OwnFence => "own fence, after a confirmation",
        Setting::Automatic => "holds, restored by itself",
    }
}

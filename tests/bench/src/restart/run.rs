//! One run: a mission with random restarts, and the check of its promises.

use super::ends::{Disk, End, Ends, MoreSettings, Stop, failed};
use super::page::{Page, Shown, is_decided};
use super::{RestartRun, RestartSetting};
use crate::process::free_port;
use scenecast_core::UserError;
use serde_json::json;
use sim_channel::RandomStream;
use std::collections::BTreeMap;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

const RESTARTS: usize = 3;
/// Cells on the map before the first restart.
const FIRST_CELLS: u32 = 20;
const LIMIT: Duration = Duration::from_secs(60);
/// For the page of a restarted surface, before the run is given up.
const PAGE_TIMEOUT: Duration = Duration::from_secs(20);
/// Time without a change, of the clock and of the mission, after which the map counts as complete.
const QUIET: Duration = Duration::from_secs(2);

struct Run<'a> {
    ends: Ends,
    page: Page,
    rng: RandomStream,
    figures: &'a mut RestartRun,
    page_limit_s: f64,
}

/// Does one run in `dir`. Broken promises are in the figures; the error is for a machine on which nothing can be run.
pub(super) fn run(
    setting: &RestartSetting,
    dir: &Path,
    recording: &Path,
    rng: RandomStream,
) -> Result<RestartRun, UserError> {
    let mut figures = RestartRun::default();
    let ports = [free_port()?, free_port()?];
    let more = MoreSettings::default();
    let ends = Ends::new(&setting.program, dir, recording, ports, &more).map_err(failed("preparing a run"))?;
    let page = Page::new(ends.page())?;
    let mut run = Run { ends, page, rng, figures: &mut figures, page_limit_s: setting.page_limit_s };
    run.start(End::Surface, Disk::Sound)?;
    run.start(End::Vehicle, Disk::Sound)?;
    if let Err(error) = run.mission() {
        figures.faults.push(error.to_string());
    }
    Ok(figures)
}

impl Run<'_> {
    fn mission(&mut self) -> Result<(), UserError> {
        self.page.wait("a first map", LIMIT, |v| v.map.explored_cells >= FIRST_CELLS)?;
        self.page.begin()?;
        for number in 0..RESTARTS {
            self.pause(1.0);
            self.restart()?;
            self.page.limits(&json!([0, 400 + number]))?;
        }
        self.page.wait("a decision on every order", LIMIT, is_decided)?;
        self.wait_quiet()?;
        self.check_once()?;
        self.check_maps()
    }

    /// Ends one end at a random instant and starts it again.
    fn restart(&mut self) -> Result<(), UserError> {
        let end = [End::Vehicle, End::Surface][self.rng.below(2)];
        let stop = [Stop::Kill, Stop::Terminate][self.rng.below(2)];
        let (is_removed, disk) = match self.rng.below(5) {
            0 => (false, Disk::Full),
            1 => (false, Disk::ReadOnly),
            2 if end == End::Surface => (true, Disk::Sound),
            _ => (false, Disk::Sound),
        };
        let folder = if is_removed { ", folder removed before" } else { "" };
        self.figures.steps.push(format!("{end:?} {stop:?}, disk {disk:?}{folder}"));
        if is_removed {
            self.remove_folder()?;
        }
        let before = self.page.shown();
        self.stop(end, stop)?;
        self.pause(0.5);
        if disk != Disk::Sound {
            self.start(end, disk)?;
            self.pause(1.0);
            self.stop(end, Stop::Kill)?;
        }
        let began = Instant::now();
        self.start(end, Disk::Sound)?;
        match before {
            Some(before) if end == End::Surface => self.check_page(&before, began),
            _ => Ok(()),
        }
    }

    /// Removes the folder of the surface and waits until the surface has written it again.
    fn remove_folder(&mut self) -> Result<(), UserError> {
        let dir = self.ends.state_dir(End::Surface);
        // The surface writes into it meanwhile, so it is moved away first.
        let removed = dir.with_extension("removed");
        std::fs::rename(&dir, &removed).map_err(failed("moving a folder"))?;
        std::fs::remove_dir_all(&removed).map_err(failed("removing a folder"))?;
        let (began, store) = (Instant::now(), dir.join("surface.store"));
        while !store.exists() {
            if began.elapsed() > LIMIT {
                return Err(UserError::Failed("the surface does not write its removed files again".into()));
            }
            sleep(Duration::from_millis(20));
        }
        Ok(())
    }

    /// Waits for the page of a restarted surface, and compares it with the one before.
    fn check_page(&mut self, before: &Shown, began: Instant) -> Result<(), UserError> {
        let mut gone = "no page".to_owned();
        while began.elapsed() < PAGE_TIMEOUT {
            match self.page.shown().map(|now| now.lacks(before)) {
                Some(None) => {
                    let page_s = began.elapsed().as_secs_f64();
                    self.figures.page_s.push(page_s);
                    if page_s > self.page_limit_s {
                        self.figures.faults.push(format!("the full page came after {page_s:.1} s; before: {gone}"));
                    }
                    return Ok(());
                }
                Some(Some(fact)) => gone = fact,
                None => {}
            }
            sleep(Duration::from_millis(5));
        }
        Err(UserError::Failed(format!("gone after a restart of the surface: {gone}")))
    }

    /// Waits until the mission has ended and the operator's map does not change any more.
    fn wait_quiet(&mut self) -> Result<(), UserError> {
        let (mut last, mut since, mut heard_s) = (None, Instant::now(), 0.0);
        self.page.wait("the end of the mission", LIMIT * 2, |vehicle| {
            let backlog = vehicle.link.backlog.as_ref().map(|b| b.bits);
            let now = Some((vehicle.map.version, vehicle.map.earlier.is_some(), backlog));
            if std::mem::replace(&mut last, now) != now {
                (since, heard_s) = (Instant::now(), vehicle.last_received_s.unwrap_or_default());
            }
            // On a busy machine the vehicle itself may pause.
            let is_heard = vehicle.last_received_s.is_some_and(|at_s| at_s >= heard_s + QUIET.as_secs_f64());
            vehicle.map.earlier.is_none() && backlog == Some(0) && since.elapsed() > QUIET && is_heard
        })
    }

    /// No version of an order was applied twice.
    fn check_once(&mut self) -> Result<(), UserError> {
        let log = self.ends.log(End::Vehicle).map_err(failed("reading the vehicle's log"))?;
        let mut applied: BTreeMap<&str, usize> = BTreeMap::new();
        for line in log.lines().filter(|line| line.ends_with(": Applied")) {
            let order = line.trim_end_matches(": Applied").rsplit("  ").next().unwrap_or_default();
            let order = order.rsplit_once(": ").map_or(order, |(_, order)| order);
            *applied.entry(order).or_default() += 1;
        }
        self.figures.applied = applied.len();
        if applied.is_empty() {
            self.figures.faults.push("the vehicle has applied no order".into());
        }
        let twice = applied.into_iter().filter(|(_, times)| *times > 1);
        self.figures.faults.extend(twice.map(|(order, times)| format!("{order} was applied {times} times")));
        Ok(())
    }

    /// A surface without a past receives the same map from the vehicle.
    fn check_maps(&mut self) -> Result<(), UserError> {
        let operator = self.page.cells()?;
        self.figures.cells = operator.len().saturating_sub(1);
        self.stop(End::Surface, Stop::Kill)?;
        self.ends.forget_surface().map_err(failed("removing a folder"))?;
        self.start(End::Surface, Disk::Sound)?;
        self.page.wait("the map at a new surface", LIMIT, |v| v.map.explored_cells > 0)?;
        self.wait_quiet()?;
        let received = self.page.cells()?;
        if operator != received {
            let differing = operator.iter().filter(|cell| !received.contains(cell)).count();
            let sizes = (operator.len(), received.len());
            self.figures.faults.push(format!("the maps differ in {differing} cells, of {sizes:?}"));
        }
        Ok(())
    }

    fn start(&mut self, end: End, disk: Disk) -> Result<(), UserError> {
        self.ends.start(end, disk).map_err(failed("starting a process"))
    }

    fn stop(&mut self, end: End, how: Stop) -> Result<(), UserError> {
        self.ends.stop(end, how).map_err(failed("ending a process"))
    }

    /// Waits for a random time up to `max_s`.
    fn pause(&mut self, max_s: f64) {
        sleep(Duration::from_secs_f64(max_s * self.rng.uniform()));
    }
}

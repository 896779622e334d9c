//! What every page shows.

use super::link_meter::LinkMeter;
use super::place;
use crate::asv::{Desk, ExemplarState, Surface};
use crate::config::Config;
use crate::figures::dropped;
use scenecast_protocol::directive::{
    Band, Fence, LifeLine, Limits, PlannerKind, Polygon, Reaction, SlotId, SlotProgress,
};
use scenecast_protocol::link::{Goodput, LinkStats, Loss, PeerView};
use scenecast_protocol::mac::{ClockMap, ModemProfile};
use scenecast_protocol::schedule::Class;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, Stamp, VehicleMode, VehicleStatus};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Facts of the mission that the surface itself does not know.
#[derive(Debug, Clone, PartialEq)]
pub struct MissionFacts {
    /// Name for people.
    pub name: String,
    /// Different for each run, so that what a browser remembers of labels is not shown on other ones.
    pub run: String,
    /// Mission seconds a second.
    pub speed: f64,
    /// Whether the survey is over.
    pub ended: bool,
    /// Edge of a cell, metres.
    pub cell_m: f64,
    /// Longest pause between two turns while nothing is to be said, seconds.
    pub idle_s: f64,
    /// Interval to expect between two contacts before one was measured, seconds.
    pub first_interval_s: f64,
    /// Bits on air of a full frame.
    pub frame_bits: u64,
}

impl MissionFacts {
    /// A mission that has just begun; `run` is random for each run.
    pub fn new(config: &Config, modem: &ModemProfile, run: u64, speed: f64) -> Self {
        Self {
            name: config.mission.name.clone(),
            run: format!("{:08x}", run as u32),
            speed,
            ended: false,
            cell_m: crate::auv::cell_m(config),
            idle_s: config.link.max_idle_s,
            first_interval_s: config.link.max_idle_s + config.link.max_turn_s,
            frame_bits: modem.bits_on_air(modem.frame_bytes),
        }
    }
}

/// The state at a moment and the versions of the maps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Snapshot {
    /// The state as JSON text.
    pub state: String,
    /// Version of each vehicle's map.
    pub maps: BTreeMap<u8, u64>,
}

/// The state of the surface.
pub fn snapshot(surface: &Surface, facts: &MissionFacts, meter: &LinkMeter, now: Instant) -> Snapshot {
    let vehicles: Vec<Value> =
        surface.vehicles().filter_map(|(a, desk)| vehicle(surface, a, desk, facts, now)).collect();
    let state = json!({
        "now_s": seconds(now),
        "mission": {
            "name": facts.name,
            "id": facts.run,
            "speed": facts.speed,
            "ended": facts.ended,
            "origin": place::origin(surface),
        },
        "vehicles": vehicles,
        "position": place::position(surface, now),
        "link": link(surface, meter, now),
    });
    let maps = surface.vehicles().filter_map(|(a, _)| Some((a.number(), surface.view(a)?.map_version())));
    Snapshot { state: state.to_string(), maps: maps.collect() }
}

fn seconds(at: Instant) -> f64 {
    (at.as_secs_f64() * 100.0).round() / 100.0
}

fn vehicle(surface: &Surface, address: Address, desk: &Desk, facts: &MissionFacts, now: Instant) -> Option<Value> {
    let view = surface.view(address)?;
    let labels = surface.labels(address).unwrap_or_default();
    let bounds = surface.map(address).and_then(|m| m.bounds());
    Some(json!({
        "id": address.number(),
        "name": desk.name,
        "heard_s": view.heard().map(seconds),
        "expected_interval_s": expected_interval_s(surface, &view, desk, facts),
        "next_contact_s": view.next_contact(now).map(seconds),
        "status": view.status().map(|(s, at)| status(s, *at)),
        "track": desk.track.iter().map(|(at, x, y)| json!([seconds(*at), x, y])).collect::<Vec<_>>(),
        "map": {
            "version": view.map_version(),
            "cell_m": facts.cell_m,
            "x0": bounds.map_or(0, |b| b.x),
            "y0": bounds.map_or(0, |b| b.y),
            "width": bounds.map_or(0, |b| b.width),
            "height": bounds.map_or(0, |b| b.height),
            "explored_cells": labels.values().sum::<u32>(),
            "updated_s": view.replica().updated().map(seconds),
            "epoch": desk.epoch,
            "placement": place::placement(view.status().and_then(|(s, _)| s.placement)),
        },
        "utility": {
            "exploration": f64::from(desk.utility.exploration) / 100.0,
            "curiosity": f64::from(desk.utility.curiosity) / 100.0,
        },
        "fence": desk.fence.as_ref().map(fence),
        "limits": desk.limits.as_ref().map(limits),
        "planner": desk.settings.planner.map(PlannerKind::name),
        "labels": labels.iter().map(|(&l, &n)| label(l, n, desk, &view, address, facts)).collect::<Vec<_>>(),
        "link": link_of(&view, now),
        "usbl": desk.found.map(|(line, at)| json!({
            "at_s": seconds(at) - line.age_s,
            "range_m": line.range_m,
            "bearing_rad": line.direction_rad.map(|(bearing, _)| bearing),
            "elevation_rad": line.direction_rad.map(|(_, elevation)| elevation),
            "accuracy": line.accuracy,
        })),
        "directive": { "slots": view.slots().map(slot).collect::<Vec<_>>() },
    }))
}

/// The silence that is nothing to wonder at: what is usual, or what an idle link and the smaller budget make of it.
fn expected_interval_s(surface: &Surface, view: &PeerView<'_>, desk: &Desk, facts: &MissionFacts) -> f64 {
    let theirs = view.status().map_or(u32::MAX, |(s, _)| s.budget_bps);
    let budget_bps = surface.budget_bps().min(theirs).max(1);
    let least = facts.idle_s + facts.frame_bits as f64 / f64::from(budget_bps);
    desk.pauses.expected().map_or(facts.first_interval_s, |d| d.as_secs_f64()).max(least)
}

/// What was measured of the water to one vehicle.
fn link_of(view: &PeerView<'_>, now: Instant) -> Value {
    let stats = view.stats();
    let direction = |loss: &Loss, goodput: &Goodput| json!({ "loss": loss.share(), "goodput_bps": goodput.bits_per_s(now).round() });
    json!({
        "up": direction(&stats.loss_in, &stats.goodput_in),
        "down": direction(&stats.loss_out, &stats.goodput_out),
        "round_trip_s": view.round_trip().map(|d| d.as_secs_f64()),
        "one_way_s": view.round_trip().map(|d| d.as_secs_f64() / 2.0),
        "clock_ahead_s": view.clock().map(|c| clock_ahead_s(c, now)),
        "dropped": dropped(stats),
    })
}

/// How far the vehicle's clock is ahead of ours; clocks on the wire come round after 4 h 39 min.
fn clock_ahead_s(clock: &ClockMap, now: Instant) -> f64 {
    let ahead_ms = clock.to_theirs(now).wrapping_sub(Stamp::clock(now)) << 8;
    f64::from(ahead_ms as i32 >> 8) / 1000.0
}

fn status(s: &VehicleStatus, at: Instant) -> Value {
    let mode = match s.mode {
        VehicleMode::Survey => "survey",
        VehicleMode::Hold => "hold",
        VehicleMode::Return => "return",
        VehicleMode::Surface => "surface",
        VehicleMode::Abort => "abort",
        VehicleMode::Done => "done",
    };
    json!({
        "at_s": seconds(at),
        "x_m": s.x_m,
        "y_m": s.y_m,
        "z_m": -s.depth_m,
        "heading_deg": s.heading_deg,
        "sigma_m": s.sigma_m,
        "mode": mode,
        "autopilot_silent": s.autopilot_silent,
        "reason": s.reason.name(),
        "doing": doing(s),
        "waypoint": s.waypoint.map(|(x, y)| json!([x, y])),
        "cells": s.explored_cells,
        "labels": s.labels,
        "fix_age_s": s.fix_age_s,
        "budget_bps": s.budget_bps,
        "refused_frames": s.refused_frames,
    })
}

/// Mode and reason as people say it.
fn doing(s: &VehicleStatus) -> String {
    let mode = match s.mode {
        VehicleMode::Survey => "surveying",
        VehicleMode::Hold => "holding",
        VehicleMode::Return => "returning",
        VehicleMode::Surface => "surfacing",
        VehicleMode::Abort => "aborted",
        VehicleMode::Done => "done",
    };
    s.reason.name().map_or(mode.to_owned(), |why| format!("{mode}: {why}"))
}

fn fence(f: &Fence) -> Value {
    let outline = |p: &Polygon| p.0.iter().map(|v| json!([v.metres().0, v.metres().1])).collect::<Vec<_>>();
    json!({
        "fence": f.fence.as_ref().map(outline),
        "keep_outs": f.keep_outs.iter().map(outline).collect::<Vec<_>>(),
        "return_point": f.return_point.map(|p| json!([p.metres().0, p.metres().1])),
    })
}

fn limits(l: &Limits) -> Value {
    let band = |b: Band| json!([f64::from(b.low_dm) / 10.0, f64::from(b.high_dm) / 10.0]);
    json!({
        "depth_m": l.depth.map(band),
        "altitude_m": l.altitude.map(band),
        "distance_m": l.distance_m,
        "time_s": l.time_s,
        "silence_s": l.silence_s,
        "on_silence": l.on_silence.map(Reaction::name),
        "on_breach": l.on_breach.map(Reaction::name),
        "on_abort": l.on_abort.map(Reaction::name),
    })
}

fn label(id: u8, cells: u32, desk: &Desk, view: &PeerView<'_>, address: Address, facts: &MissionFacts) -> Value {
    json!({
        "id": id,
        "cells": cells,
        "area_m2": f64::from(cells) * facts.cell_m * facts.cell_m,
        "weight": desk.utility.weight(id),
        "exemplar": exemplar(id, desk, view, address),
    })
}

fn exemplar(id: u8, desk: &Desk, view: &PeerView<'_>, address: Address) -> Value {
    let Some(e) = desk.exemplars.get(&id) else {
        return json!({ "state": "none", "progress": 0.0, "bytes": null, "url": null, "at_s": null });
    };
    let request = view.slots().find(|s| s.id == SlotId::Requests).map(|s| s.life);
    let (state, progress, bytes, here) = match &e.state {
        ExemplarState::Asked => match request {
            Some(LifeLine::Queued) | None => ("queued", 0.0, None, false),
            Some(LifeLine::Refused(_)) => ("refused", 0.0, None, false),
            Some(_) => ("on_air", 0.0, None, false),
        },
        ExemplarState::Coming(held, total) => ("coming", *held as f64 / (*total).max(1) as f64, Some(*total), false),
        ExemplarState::Here(webp) => ("here", 1.0, Some(webp.len()), true),
    };
    let url = here.then(|| format!("/api/v1/vehicles/{}/exemplars/{id}.webp", address.number()));
    json!({ "state": state, "progress": progress, "bytes": bytes, "url": url, "at_s": seconds(e.changed) })
}

fn slot(s: &SlotProgress) -> Value {
    let (state, reason) = match s.life {
        LifeLine::Queued => ("queued", None),
        LifeLine::OnAir => ("on_air", None),
        LifeLine::Heard => ("heard", None),
        LifeLine::Applied => ("applied", None),
        LifeLine::Refused(reason) => ("refused", Some(reason.explain())),
    };
    json!({
        "slot": s.id.name(),
        "version": s.version,
        "state": state,
        "reason": reason,
        "issued_s": seconds(s.issued),
        "changed_s": seconds(s.changed),
    })
}

fn link(surface: &Surface, meter: &LinkMeter, now: Instant) -> Value {
    let stats: Vec<(&LinkStats, PeerView<'_>)> =
        surface.vehicles().filter_map(|(a, _)| surface.view(a)).map(|v| (v.stats(), v)).collect();
    let sum = |of: &dyn Fn(&LinkStats) -> u64| stats.iter().map(|(s, _)| of(s)).sum::<u64>();
    let round_trip = stats.iter().find_map(|(_, v)| v.round_trip());
    let heard = sum(&|s| s.frames_heard);
    let numbered = sum(&|s| s.frames_numbered);
    let (lost, delivered) = (sum(&|s| s.frames_lost), sum(&|s| s.frames_delivered));
    let elapsed = now.as_secs_f64().max(1.0);
    let direction = |i: usize, frames: u64, lost: u64, class: &dyn Fn(&LinkStats, Class) -> u64| {
        let bytes: BTreeMap<&str, u64> = Class::ALL.into_iter().map(|c| (c.name(), sum(&|s| class(s, c)))).collect();
        let useful: u64 = bytes.iter().filter(|(name, _)| **name != "overhead").map(|(_, n)| n).sum();
        json!({
            "bps_1min": meter.bps_1min(i, now).round(),
            "worst_window_bps": meter.worst_window_bps(i),
            "loss": if frames > 0 { lost as f64 / frames as f64 } else { 0.0 },
            "frames": frames,
            "lost": lost,
            "goodput_bps": (useful as f64 * 8.0 / elapsed).round(),
            "bytes_by_class": bytes,
        })
    };
    json!({
        "budget_bps": surface.budget_bps(),
        "budget_window_s": meter.window_s(),
        "shares": Class::SHARED.iter().zip(surface.shares().0).map(|(c, s)| (c.name(), s)).collect::<BTreeMap<_, _>>(),
        "strangers": surface.strangers(),
        "up": direction(0, numbered, numbered.saturating_sub(heard), &|s, c| s.heard_by_class.get(&c).copied().unwrap_or(0)),
        "down": direction(1, lost + delivered, lost, &|s, c| s.bytes_by_class.get(&c).copied().unwrap_or(0)),
        "round_trip_s": round_trip.map(|d| d.as_secs_f64()),
        "backlog_bits": null,
        "history": meter.history(),
    })
}

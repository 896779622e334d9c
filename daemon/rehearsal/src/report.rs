//! The report of a mission.

use super::fidelity::mean_share;
use super::frames_log::{Repeats, Uplink};
use super::mission::{MapInformation, MapQuality, Mission};
use scenecast_config::cell_m;
use scenecast_core::drop_counts::dropped;
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::directive::{SlotId, SlotState};
use scenecast_protocol::map::{Cell, LabelGrid, LayerSource};
use scenecast_protocol::schedule::Class;
use scenecast_worlds::scoring::MutualInformation;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// The measurements of a mission that has ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// `report.json` without the member `wall`: the same for the same arguments and seed.
    pub json: Value,
}

/// Makes the report of a mission that has ended.
pub fn report(mission: &Mission, scenario: &str) -> Report {
    let json = json!({
        "format": 1,
        "mission": {
            "duration_s": round(mission.ended().unwrap_or(mission.now()).as_secs_f64()),
            "drain_s": round(mission.now().since(mission.ended().unwrap_or(mission.now())).as_secs_f64()),
            "seed": mission.seed,
            "scenario": scenario,
        },
        "scene": scene(mission),
        "registration": registration(mission),
        "map": map(mission),
        "quality": quality(mission),
        "link": link(mission),
        "directives": directives(mission),
        "exemplars": exemplars(mission),
        "fixes": { "sent": mission.surface().relay().map_or(0, |r| r.fixes()), "applied": mission.vehicle().fixes_applied() },
        "survey": survey(mission),
    });
    Report { json }
}

/// Rounds to six digits, so that every machine prints the same.
fn round(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

/// As [`round`], to nine digits.
fn round_small(x: f64) -> f64 {
    (x * 1e9).round() / 1e9
}

fn summary([median, p95, max]: [f64; 3]) -> Value {
    json!({ "median": round(median), "p95": round(p95), "max": round(max) })
}

impl Mission {
    pub fn operator_map(&self) -> LabelGrid {
        self.surface().map(self.address()).cloned().unwrap_or_default()
    }
}

fn scene(m: &Mission) -> Value {
    let vehicle = m.class_agreement(m.vehicle().map());
    let of = |value: fn(&MutualInformation) -> f64| vehicle.as_ref().map(|agreement| round(value(agreement)));
    let (seams, relabelled) = (m.seams(), relabelled(m));
    json!({
        "cells": if m.has_foreign_labels() { m.vehicle().map().explored() } else { m.mapper.cells() },
        "words": m.mapper.words(),
        "labels": m.logbook.map.highest,
        "perplexity": round(m.mapper.perplexity()),
        "mutual_information_nats": of(|a| a.nats),
        "normalised_mutual_information": of(|a| a.normalised),
        "homogeneity": of(MutualInformation::homogeneity),
        "completeness": of(MutualInformation::completeness),
        "v_measure": of(MutualInformation::v_measure),
        "equal_neighbours": { "within": seams.within.map(round), "across": seams.across.map(round) },
        "relabelled": { "mean": relabelled.map(|r| round(r.0)), "max": relabelled.map(|r| round(r.1)) },
        "operator_mutual_information_nats": m.class_agreement(&m.operator_map()).map(|a| round(a.nats)),
    })
}

/// Mean and maximum over the samples of the survey of the share of cells that changed their label within five minutes.
fn relabelled(m: &Mission) -> Option<(f64, f64)> {
    let shares: Vec<f64> = m.quality_series().iter().filter_map(|sample| sample.relabelled).collect();
    let most = shares.iter().copied().reduce(f64::max)?;
    Some((shares.iter().sum::<f64>() / shares.len() as f64, most))
}

/// The evidence by which frames were placed, and their errors where the truth is known.
fn registration(m: &Mission) -> Value {
    let Some(tally) = m.mapper.registration() else { return json!({ "enabled": false }) };
    let error = m.registration_error_m();
    json!({
        "enabled": true,
        "frames": tally.frames,
        "chained": tally.chained,
        "looped": tally.looped,
        "loops": tally.loops,
        "contradicted": tally.contradicted,
        "unseen": tally.unseen,
        "error_rigid_m": error.map(|e| round(e.rigid_m)),
        "error_placed_m": error.map(|e| round(e.placed_m)),
        "closed_at_m": closed_at_m(m),
        "error_solved_m": m.solved_error_m().map(round),
    })
}

/// The places on the map at which frames closed a loop, metres east and north, the last 500.
fn closed_at_m(m: &Mission) -> Vec<[f64; 2]> {
    let closing: BTreeSet<usize> = m.logbook.graph.loops().map(|(newer, _)| newer).collect();
    let places = closing.iter().filter_map(|&frame| m.logbook.poses.get(frame)).map(|poses| poses.mapped_at);
    places.skip(closing.len().saturating_sub(500)).map(|(x, y)| [round(x), round(y)]).collect()
}

/// How true both maps were at the last sample before the end of the survey, and on the mean over it.
fn quality(m: &Mission) -> Value {
    let end = m.ended().unwrap_or(m.now()).as_secs_f64();
    let survey: Vec<MapQuality> = m.quality_series().iter().copied().filter(|s| s.t_s <= end).collect();
    let last = survey.last().copied().unwrap_or_else(|| m.quality());
    let information = |map: Option<MapInformation>| {
        map.map(|i| json!({ "rigid_nats": round(i.rigid_nats), "placed_nats": round(i.placed_nats) }))
    };
    json!({
        "t_s": round(last.t_s),
        "vehicle": information(last.vehicle),
        "operator": information(last.operator),
        "operator_share": last.operator_share().map(round),
        "operator_share_mean": mean_share(&survey).map(round),
        "agreement": round(last.agreement),
        "age_s": round(last.age_s),
        "error_rigid_cells": last.error_rigid_cells.map(round),
        "error_placed_cells": last.error_placed_cells.map(round),
    })
}

fn map(m: &Mission) -> Value {
    let bounds = m.vehicle().map().bounds();
    let stats = m.vehicle().stats();
    json!({
        "width": bounds.map_or(0, |b| b.width),
        "height": bounds.map_or(0, |b| b.height),
        "cell_m": m.cell_m(),
        "codec": m.config.map.codec.to_string(),
        "versions": m.vehicle().map_version(),
        "updates_sent": stats.chunks_sent,
        "flips_suppressed": m.vehicle().flips_suppressed(),
        "payload_bytes": stats.bytes_by_class.get(&Class::Map).copied().unwrap_or(0),
        "png_full_bytes": m.logbook.map.png_full_bytes,
        "agreement_final": round(m.meters.labels.agreement()),
        "agreement_mean": round(m.meters.labels.agreement_mean_of_survey()),
        "age_s": summary(m.meters.labels.delays(m.now()).summary()),
        "layers": m.vehicle().layers().map(|p| layer(m, p)).collect::<BTreeMap<_, _>>(),
    })
}

/// A layer by its name: cells with a level, agreement and delay of the operator's copy, and its bytes.
fn layer(m: &Mission, layer: &LayerSource) -> (String, Value) {
    let id = layer.id();
    let bytes = m.vehicle().stats().bytes_by_class.get(&Class::Layer(id)).copied().unwrap_or(0);
    let mut report = json!({ "payload_bytes": bytes, "cells": layer.target().explored() });
    if let (Some(meter), Some(report)) = (m.meters.layers.get(&id), report.as_object_mut()) {
        report.insert("agreement_final".into(), round(meter.agreement()).into());
        report.insert("agreement_mean".into(), round(meter.agreement_mean_of_survey()).into());
        report.insert("age_s".into(), summary(meter.delays(m.now()).summary()));
    }
    (layer.descriptor().name.clone().into_owned(), report)
}

fn by_class(m: &Mission) -> BTreeMap<String, u64> {
    let layers = m.surface().view(m.address()).map(|v| v.layers().clone()).unwrap_or_default();
    let mut sums: BTreeMap<String, u64> = Class::all(&layers).map(|class| (class.name_in(&layers), 0)).collect();
    let surface = m.surface().view(m.address()).map(|v| v.stats().bytes_by_class.clone()).unwrap_or_default();
    for (class, bytes) in m.vehicle().stats().bytes_by_class.iter().chain(&surface) {
        *sums.entry(class.name_in(&layers)).or_default() += bytes;
    }
    sums
}

fn link(m: &Mission) -> Value {
    let seconds = m.now().as_secs_f64().max(1e-9);
    let delivered = |stats: &scenecast_protocol::link::LinkStats| stats.delivered_by_class.values().sum::<u64>();
    let down = m.surface().view(m.address()).map_or(0, |v| delivered(v.stats()));
    let goodput = (delivered(m.vehicle().stats()) + down) as f64 * 8.0 / seconds;
    let [up_audit, down_audit] = m.audits();
    let worst = up_audit.worst_window_bps().max(down_audit.worst_window_bps());
    let view = m.surface().view(m.address());
    let at_surface = view.as_ref().map(|v| v.stats().clone()).unwrap_or_default();
    let one = |i: usize| {
        let audit = m.audits()[i];
        let receiver = [&at_surface, m.vehicle().stats()][i];
        let (loss, goodput) = (&receiver.incoming.loss, &receiver.incoming.goodput);
        json!({
            "sent_bps": round(audit.total_bits() as f64 / seconds),
            "energy_j": m.energy_j().map(|joules| round(joules[i])),
            "max_window_bps": round(audit.worst_window_bps()),
            "largest_transmission_bits": audit.largest_bits(),
            "frames_sent": m.frames().sent[i],
            "frames_lost": m.frames().lost[i],
            "loss_measured": round(loss.share()),
            "goodput_last_minute_bps": round(goodput.bits_per_s(m.now())),
            "dropped": dropped(receiver),
        })
    };
    json!({
        "capacity_bps": m.modem().bit_rate_bps,
        "budget_bps": m.config.link.budget_bps,
        "budget_window_s": m.config.link.budget_window_s,
        "frame_bytes": m.modem().frame_bytes,
        "sent_bps": round((up_audit.total_bits() + down_audit.total_bits()) as f64 / seconds),
        "max_window_bps": round(worst),
        "frames_sent": m.frames().sent.iter().sum::<u64>(),
        "frames_lost": m.frames().lost.iter().sum::<u64>(),
        "goodput_bps": round(goodput),
        "bytes_by_class": by_class(m),
        "energy_per_map_bit_j": m.energy_per_map_bit_j().map(round_small),
        "uplink_bytes": Uplink::of(m.vehicle().stats()),
        "repeats": Repeats::of(view, m.frames()),
        "round_trip_s": view.and_then(|v| v.round_trip()).map(|d| round(d.as_secs_f64())),
        "up": one(0),
        "down": one(1),
    })
}

fn directives(m: &Mission) -> Value {
    let issued = m.logbook.issued.keys().filter(|(id, _)| *id != SlotId::Fix).count();
    let applied: Vec<_> =
        m.logbook.applied.iter().filter(|a| a.id != SlotId::Fix && a.state == SlotState::Applied).collect();
    let mut delays = super::Delays::default();
    let mut seen = BTreeMap::<(SlotId, u16), u32>::new();
    for a in &applied {
        *seen.entry((a.id, a.version)).or_default() += 1;
        if let Some(&issued) = m.logbook.issued.get(&(a.id, a.version)) {
            delays.push(a.at.since(issued).as_secs_f64());
        }
    }
    json!({
        "issued": issued,
        "applied": seen.len(),
        "applied_twice": seen.values().filter(|&&n| n > 1).count(),
        "refused": m.logbook.applied.iter().filter(|a| a.id != SlotId::Fix && matches!(a.state, SlotState::Refused(_))).count(),
        "latency_s": summary(delays.summary()),
    })
}

fn exemplars(m: &Mission) -> Value {
    let pages = || m.surface().record(m.address()).into_iter().flat_map(|d| d.exemplars.labels()).map(|(_, page)| page);
    let pictures = || pages().flat_map(|page| &page.stored);
    let delivered = pictures().filter(|p| p.requested).count();
    json!({
        "requested": delivered + pages().filter(|page| page.request.is_some()).count(),
        "delivered": delivered,
        "unrequested": pictures().filter(|p| !p.requested).count(),
        "bytes": pictures().map(|p| p.sent_bytes).sum::<usize>(),
    })
}

fn survey(m: &Mission) -> Value {
    json!({
        "distance_m": round(m.motion.distance_m),
        "planner": m.config.survey.planner.name(),
        "waypoints": m.logbook.legs.len(),
        "waypoints_outside_fence": m.legs_outside_fence(),
        "explored_cells": m.vehicle().map().explored(),
        "area_seen": m.area_seen().map(round),
        "utility_collected": round(m.utility_collected()),
    })
}

impl Mission {
    /// The newest image of each label that has one at the surface, as WebP files.
    pub fn exemplars(&self) -> impl Iterator<Item = (u8, &[u8])> {
        let record = self.surface().record(self.address());
        let pages = record.into_iter().flat_map(|d| d.exemplars.labels());
        pages.filter_map(|(label, page)| Some((label, page.exemplar(None)?.webp.as_slice())))
    }

    /// Number of legs chosen after the fence took effect that leave it, cross a keep-out, or do not lead back inside
    /// after a fix has placed the vehicle outside.
    pub fn legs_outside_fence(&self) -> usize {
        let Some(fence) = self.surface().record(self.address()).and_then(|d| d.orders.fence.sent.as_ref()) else {
            return 0;
        };
        let outside = |from, to| scenecast_worlds::stretches_outside(&[from, to], fence) > 0;
        let is_out = |&&(from, to): &&super::mission::Leg| {
            if outside(from, from) { outside(to, to) } else { outside(from, to) }
        };
        self.logbook.legs.iter().skip(self.logbook.legs_before_fence).filter(is_out).count()
    }

    /// The share of the survey's area that the vehicle's map shows, 0 to 1.
    pub fn area_seen(&self) -> Option<f64> {
        let (area, cell_m) = (self.camera.survey_area(&self.config).ok()?, cell_m(&self.config));
        let middle = |cell: Cell| MapPoint::new((f64::from(cell.x) + 0.5) * cell_m, (f64::from(cell.y) + 0.5) * cell_m);
        let place = |cell: Cell| self.vehicle().navigator().to_world(middle(cell)).xy();
        Some(area.covered(self.vehicle().cells().map(|(cell, _)| place(cell)), cell_m))
    }

    /// Explored cells, each weighted by its label's value in the operator's last utility.
    pub fn utility_collected(&self) -> f64 {
        let Some(utility) = self.vehicle().utility() else { return 0.0 };
        self.vehicle().cells().map(|(_, label)| utility.weight(label)).sum()
    }
}

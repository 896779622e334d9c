//! The acoustic link: budget, rates, losses, backlogs.

use super::facts::MissionFacts;
use crate::Surface;
use crate::link_meter::LinkMeter;
use crate::state::{ChannelQuality, LinkDirection, LinkSummary, ReportedBacklog, VehicleChannel, seconds};
use scenecast_core::drop_counts::dropped;
use scenecast_protocol::link::{Goodput, LinkStats, Loss, PeerView};
use scenecast_protocol::schedule::Class;
use scenecast_protocol::time::{ClockMap, Instant};
use scenecast_protocol::wire::{Backlog, Stamp};
use std::collections::BTreeMap;

/// The link to all vehicles together.
pub(super) fn summary(surface: &Surface, facts: &MissionFacts, meter: &LinkMeter, now: Instant) -> LinkSummary {
    let views: Vec<PeerView<'_>> = surface.vehicles().filter_map(|(a, _)| surface.view(a)).collect();
    let sum = |of: &dyn Fn(&LinkStats) -> u64| views.iter().map(|v| of(v.stats())).sum::<u64>();
    let received = sum(&|s| s.frames_received);
    let numbered = sum(&|s| s.frames_numbered);
    let (lost, delivered) = (sum(&|s| s.frames_lost), sum(&|s| s.frames_delivered));
    let elapsed = meter.elapsed_s(now).max(1.0);
    let none: BTreeMap<String, u64> =
        Class::all(&surface.layers()).map(|c| (c.name_in(&surface.layers()), 0)).collect();
    let direction = |i: usize, frames: u64, lost: u64, by_class: fn(&LinkStats) -> &BTreeMap<Class, u64>| {
        let (mut bytes_by_class, mut useful) = (none.clone(), 0);
        for view in &views {
            for (&class, &bytes) in by_class(view.stats()) {
                *bytes_by_class.entry(class.name_in(view.layers())).or_default() += bytes;
                useful += if class == Class::Overhead { 0 } else { bytes };
            }
        }
        let loss = if frames > 0 { lost as f64 / frames as f64 } else { 0.0 };
        // Frames of the vehicles are counted where they arrive.
        let unseen = if i == 0 { loss.min(0.99) } else { 0.0 };
        let energy_j = facts.joules_per_bit.map(|joules| meter.total_bits(i) as f64 * joules / (1.0 - unseen));
        LinkDirection {
            bps_1min: meter.bps_1min(i, now).round(),
            max_window_bps: meter.max_window_bps(i),
            loss,
            frames,
            lost,
            goodput_bps: (useful as f64 * 8.0 / elapsed).round(),
            energy_j,
            bytes_by_class,
        }
    };
    let up = direction(0, numbered, numbered.saturating_sub(received), |s| &s.received_by_class);
    let map_bits = up.bytes_by_class.get(Class::Map.name()).copied().unwrap_or(0) * 8;
    LinkSummary {
        budget_bps: surface.budget_bps(),
        budget_window_s: meter.window_s(),
        shares: Class::SHARED.iter().zip(surface.shares().0).map(|(c, s)| (c.name().to_owned(), s)).collect(),
        background: surface.background().names(&surface.layers()),
        unknown_senders: surface.unknown_senders(),
        energy_per_map_bit_j: up.energy_j.filter(|_| map_bits > 0).map(|joules| joules / map_bits as f64),
        up,
        down: direction(1, lost + delivered, lost, |s| &s.bytes_by_class),
        round_trip_s: views.iter().find_map(PeerView::round_trip).map(|d| d.as_secs_f64()),
        backlog_bits: total_bits(views.iter().filter_map(PeerView::backlog)),
        history: meter.history(),
    }
}

/// The bits of all backlogs; `None` before the first report.
fn total_bits(backlogs: impl Iterator<Item = (Backlog, Instant)>) -> Option<u64> {
    backlogs.map(|(b, _)| (u64::from(b.map_bytes) + u64::from(b.other_bytes)) * 8).reduce(|a, b| a + b)
}

/// Measurements of the channel to one vehicle.
pub(super) fn channel(view: &PeerView<'_>, now: Instant) -> VehicleChannel {
    let stats = view.stats();
    let quality = |loss: &Loss, goodput: &Goodput| ChannelQuality {
        loss: loss.share(),
        goodput_bps: goodput.bits_per_s(now).round(),
    };
    VehicleChannel {
        up: quality(&stats.incoming.loss, &stats.incoming.goodput),
        down: quality(&stats.outgoing.loss, &stats.outgoing.goodput),
        round_trip_s: view.round_trip().map(|d| d.as_secs_f64()),
        one_way_s: view.round_trip().map(|d| d.as_secs_f64() / 2.0),
        clock_offset_s: view.clock().map(|c| clock_offset_s(c, now)),
        mismatch: view.mismatch(now).map(|mismatch| mismatch.to_string()),
        dropped: dropped(stats).into_iter().map(|(reason, n)| (reason.to_owned(), n)).collect(),
        backlog: view.backlog().map(|(b, at)| backlog(b, at, stats.incoming.goodput.bits_per_s(now), now)),
    }
}

/// A backlog that was reported at `at`, and when it will be empty at a goodput in bit/s.
fn backlog(backlog: Backlog, at: Instant, goodput: f64, now: Instant) -> ReportedBacklog {
    let map_bits = u64::from(backlog.map_bytes) * 8;
    let bits = map_bits + u64::from(backlog.other_bytes) * 8;
    // Less than 1 bit/s is the decaying rest of earlier frames.
    let duration_s = |bits: u64| (bits == 0 || goodput >= 1.0).then(|| bits as f64 / goodput.max(1.0));
    ReportedBacklog {
        at_s: seconds(at),
        bits,
        empty_s: duration_s(bits).map(|s| seconds(now) + s),
        map_bits,
        map_lag_s: duration_s(map_bits).map(|s| now.since(at).as_secs_f64() + s),
    }
}

/// The clock of the vehicle minus ours. Clocks on the wire wrap around after 4 h 39 min.
fn clock_offset_s(clock: &ClockMap, now: Instant) -> f64 {
    let offset_ms = clock.to_theirs(now).wrapping_sub(Stamp::clock(now)) << 8;
    f64::from(offset_ms as i32 >> 8) / 1000.0
}

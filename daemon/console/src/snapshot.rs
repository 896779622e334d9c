//! What every page shows.

use super::link_meter::LinkMeter;
use super::{place, state};
use axum::body::Bytes;
use scenecast_config::Config;
use scenecast_core::LatLon;
use scenecast_core::drop_counts::dropped;
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::directive::{OrderStatus, PlannerKind, SlotId, SlotProgress};
use scenecast_protocol::exemplar::edge_px;
use scenecast_protocol::link::{Goodput, LinkStats, Loss, PeerView};
use scenecast_protocol::mac::{ClockMap, ModemProfile};
use scenecast_protocol::schedule::Class;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, Backlog, Stamp, VehicleMode, VehicleStatus};
use scenecast_surface::{Album, AskState, Desk, Picture, Surface};
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
    /// Where x = y = 0 lies on the Earth, if anybody has said so.
    pub origin: Option<state::Origin>,
}

impl MissionFacts {
    /// A mission that has just begun; `run` is random for each run.
    pub fn new(config: &Config, modem: &ModemProfile, run: u64, speed: f64) -> Self {
        Self {
            name: config.mission.name.clone(),
            run: format!("{:08x}", run as u32),
            speed,
            ended: false,
            cell_m: scenecast_config::cell_m(config),
            idle_s: config.link.max_idle_s,
            first_interval_s: config.link.max_idle_s + config.link.max_turn_s,
            frame_bits: modem.bits_on_air(modem.frame_bytes),
            origin: origin(config),
        }
    }
}

/// The origin that is configured, if any is.
fn origin(config: &Config) -> Option<state::Origin> {
    // At a pole there is no east.
    let LatLon { lat_deg, lon_deg } = scenecast_config::origin(config).ok()?.filter(|o| o.lat_deg.abs() < 90.0)?;
    Some(state::Origin { lat_deg, lon_deg })
}

/// The state at a moment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Snapshot {
    /// The state.
    pub state: state::State,
    /// The same as JSON text; empty before the first.
    pub json: Bytes,
}

impl Snapshot {
    fn new(state: state::State) -> Self {
        // The types have no map with keys that JSON cannot have, so this cannot fail.
        let json = serde_json::to_vec(&state).unwrap_or_default().into();
        Self { state, json }
    }

    /// A vehicle.
    pub fn vehicle(&self, id: u8) -> Option<&state::Vehicle> {
        self.state.vehicles.iter().find(|v| v.id == id)
    }
}

/// The state of the surface.
pub fn snapshot(surface: &Surface, facts: &MissionFacts, meter: &LinkMeter, now: Instant) -> Snapshot {
    Snapshot::new(state::State {
        now_s: seconds(now),
        mission: state::Mission {
            name: facts.name.clone(),
            id: facts.run.clone(),
            speed: facts.speed,
            ended: facts.ended,
            origin: place::origin(surface).or(facts.origin),
        },
        vehicles: surface.vehicles().filter_map(|(a, desk)| vehicle(surface, a, desk, facts, now)).collect(),
        position: place::position(surface, now),
        link: link(surface, meter, now),
    })
}

/// Mission time as the API tells it: to the hundredth of a second.
pub(super) fn seconds(at: Instant) -> f64 {
    (at.as_secs_f64() * 100.0).round() / 100.0
}

fn vehicle(
    surface: &Surface,
    address: Address,
    desk: &Desk,
    facts: &MissionFacts,
    now: Instant,
) -> Option<state::Vehicle> {
    let view = surface.view(address)?;
    let labels = surface.labels(address).unwrap_or_default();
    Some(state::Vehicle {
        id: address.number(),
        name: desk.name.clone(),
        heard_s: view.last_received().map(seconds),
        expected_interval_s: expected_interval_s(surface, &view, desk, facts),
        next_contact_s: view.next_contact(now).map(seconds),
        status: view.status().map(|(s, at)| status(s, *at)),
        track: desk.track.iter().map(|&(at, x, y)| (seconds(at), x, y)).collect(),
        map: map(surface, address, desk, &view, labels.values().sum(), facts),
        utility: state::Utility {
            exploration: f64::from(desk.utility.exploration) / 100.0,
            curiosity: f64::from(desk.utility.curiosity) / 100.0,
        },
        fence: desk.fence.as_ref().map(Into::into),
        limits: desk.limits.as_ref().map(Into::into),
        fence_in_force: in_force(&desk.fence_in_force),
        limits_in_force: in_force(&desk.limits_in_force),
        planner: desk.settings.asked().planner.value().map(|p| PlannerKind::name(p).to_owned()),
        settings: state::VehicleSettings {
            asked: desk.settings.asked().into(),
            in_force: desk.settings.in_force().map(Into::into),
        },
        labels: labels.iter().map(|(&l, &n)| label(l, n, desk, &view, address, facts)).collect(),
        link: link_of(&view, now),
        usbl: desk.found.as_ref().map(|(line, at)| state::Usbl {
            at_s: seconds(*at) - line.age_s,
            range_m: line.range_m,
            bearing_rad: line.direction_rad.map(|(bearing, _)| bearing),
            elevation_rad: line.direction_rad.map(|(_, elevation)| elevation),
            accuracy: line.accuracy,
        }),
        directive: state::Directive { slots: view.slots().map(slot).collect() },
    })
}

fn map(
    surface: &Surface,
    address: Address,
    desk: &Desk,
    view: &PeerView<'_>,
    explored_cells: u32,
    facts: &MissionFacts,
) -> state::MapSummary {
    let bounds = surface.map(address).and_then(|m| m.bounds());
    state::MapSummary {
        version: surface.map_version(address),
        cell_m: facts.cell_m,
        x0: bounds.map_or(0, |b| b.x),
        y0: bounds.map_or(0, |b| b.y),
        width: bounds.map_or(0, |b| b.width),
        height: bounds.map_or(0, |b| b.height),
        explored_cells,
        updated_s: view.replica().updated().map(seconds),
        epoch: desk.epoch,
        placement: view.status().and_then(|(s, _)| s.placement).map(place::placement),
    }
}

/// The silence that is nothing to wonder at: what is usual, or what an idle link and the smaller budget make of it.
fn expected_interval_s(surface: &Surface, view: &PeerView<'_>, desk: &Desk, facts: &MissionFacts) -> f64 {
    let theirs = view.status().map_or(u32::MAX, |(s, _)| s.budget_bps);
    let budget_bps = surface.budget_bps().min(theirs).max(1);
    let least = facts.idle_s + facts.frame_bits as f64 / f64::from(budget_bps);
    desk.pauses.expected().map_or(facts.first_interval_s, |d| d.as_secs_f64()).max(least)
}

/// What was measured of the water to one vehicle.
fn link_of(view: &PeerView<'_>, now: Instant) -> state::VehicleLink {
    let stats = view.stats();
    let water = |loss: &Loss, goodput: &Goodput| state::Water {
        loss: loss.share(),
        goodput_bps: goodput.bits_per_s(now).round(),
    };
    state::VehicleLink {
        up: water(&stats.loss_in, &stats.goodput_in),
        down: water(&stats.loss_out, &stats.goodput_out),
        round_trip_s: view.round_trip().map(|d| d.as_secs_f64()),
        one_way_s: view.round_trip().map(|d| d.as_secs_f64() / 2.0),
        clock_ahead_s: view.clock().map(|c| clock_ahead_s(c, now)),
        dropped: dropped(stats).into_iter().map(|(reason, n)| (reason.to_owned(), n)).collect(),
        backlog: view.backlog().map(|(backlog, at)| waiting(backlog, at, stats.goodput_in.bits_per_s(now), now)),
    }
}

/// What a vehicle has still to send, and when it will have at `goodput` bits a second.
fn waiting(backlog: Backlog, at: Instant, goodput: f64, now: Instant) -> state::Backlog {
    let map_bits = u64::from(backlog.map_bytes) * 8;
    let bits = map_bits + u64::from(backlog.other_bytes) * 8;
    // Less than a bit a second is what fades of earlier frames.
    let takes_s = |bits: u64| (bits == 0 || goodput >= 1.0).then(|| bits as f64 / goodput.max(1.0));
    state::Backlog {
        at_s: seconds(at),
        bits,
        empty_s: takes_s(bits).map(|s| seconds(now) + s),
        map_bits,
        map_lag_s: takes_s(map_bits).map(|s| now.since(at).as_secs_f64() + s),
    }
}

fn in_force<T, O: for<'a> From<&'a T>>(applied: &Option<(u16, T)>) -> Option<state::InForce<O>> {
    let (version, order) = applied.as_ref()?;
    Some(state::InForce { version: *version, order: order.into() })
}

/// How far the vehicle's clock is ahead of ours; clocks on the wire come round after 4 h 39 min.
fn clock_ahead_s(clock: &ClockMap, now: Instant) -> f64 {
    let ahead_ms = clock.to_theirs(now).wrapping_sub(Stamp::clock(now)) << 8;
    f64::from(ahead_ms as i32 >> 8) / 1000.0
}

fn status(s: &VehicleStatus, at: Instant) -> state::Status {
    state::Status {
        at_s: seconds(at),
        x_m: s.position.x_m,
        y_m: s.position.y_m,
        z_m: -s.depth_m,
        heading_deg: s.heading_deg,
        sigma_m: s.sigma_m,
        mode: match s.mode {
            VehicleMode::Survey => state::Mode::Survey,
            VehicleMode::Hold => state::Mode::Hold,
            VehicleMode::Return => state::Mode::Return,
            VehicleMode::Surface => state::Mode::Surface,
            VehicleMode::Abort => state::Mode::Abort,
            VehicleMode::Done => state::Mode::Done,
        },
        autopilot_silent: s.autopilot_silent,
        reason: s.reason.name().map(str::to_owned),
        doing: doing(s),
        waypoint: s.waypoint.map(MapPoint::xy),
        path: s.path.points.iter().copied().map(MapPoint::xy).collect(),
        path_goes_on: s.path.continues,
        cells: s.explored_cells,
        labels: u32::from(s.labels),
        fix_age_s: s.fix_age_s,
        budget_bps: s.budget_bps,
        refused_frames: u32::from(s.refused_frames),
    }
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

fn label(id: u8, cells: u32, desk: &Desk, view: &PeerView<'_>, address: Address, facts: &MissionFacts) -> state::Label {
    state::Label {
        id,
        cells,
        area_m2: f64::from(cells) * facts.cell_m * facts.cell_m,
        weight: desk.utility.weight(id),
        exemplar: exemplar(id, desk, view, address),
    }
}

fn exemplar(id: u8, desk: &Desk, view: &PeerView<'_>, address: Address) -> state::Exemplar {
    use state::ExemplarState as Told;
    let page = desk.album.page(id);
    let base = format!("/api/v1/vehicles/{}/exemplars/{id}", address.number());
    let pictures: Vec<state::Picture> =
        page.into_iter().flat_map(|page| &page.pictures).map(|p| picture(p, &base)).collect();
    let newest = pictures.last();
    let (state, progress, bytes) = match page.and_then(|page| page.asked) {
        None => (if newest.is_some() { Told::Here } else { Told::None }, f64::from(u8::from(newest.is_some())), None),
        Some(asked) => match asked.state {
            AskState::Asked if is_waiting(view) => (Told::Queued, 0.0, None),
            AskState::Asked => (Told::OnAir, 0.0, None),
            AskState::NoneYet => (Told::NoneYet, 0.0, None),
            AskState::Refused => (Told::Refused, 0.0, None),
            AskState::Coming(held, total) => (Told::Coming, held as f64 / total.max(1) as f64, Some(total)),
        },
    };
    state::Exemplar {
        state,
        progress,
        bytes: bytes.or(newest.map(|p| p.bytes)),
        url: newest.map(|_| format!("{base}.webp")),
        at_s: page.and_then(|page| page.asked).map(|a| seconds(a.changed)).or(newest.map(|p| p.at_s)),
        pictures,
    }
}

fn picture(p: &Picture, base: &str) -> state::Picture {
    state::Picture {
        picture: p.number,
        edge_px: edge_px(p.size),
        can_grow: p.size < Album::MAX_SIZE,
        bytes: p.sent_bytes,
        url: format!("{base}-{}.webp", p.number),
        at_s: seconds(p.came),
        asked: p.asked,
    }
}

/// Whether the requests have not been sent yet.
fn is_waiting(view: &PeerView<'_>) -> bool {
    let request = view.slots().find(|s| s.id == SlotId::Requests).map(|s| s.status);
    matches!(request, Some(OrderStatus::Queued) | None)
}

fn slot(s: &SlotProgress) -> state::Slot {
    let (life, reason) = match s.status {
        OrderStatus::Queued => (state::LifeLine::Queued, None),
        OrderStatus::OnAir => (state::LifeLine::OnAir, None),
        OrderStatus::Received => (state::LifeLine::Heard, None),
        OrderStatus::Applied => (state::LifeLine::Applied, None),
        OrderStatus::Refused(reason) => (state::LifeLine::Refused, Some(reason.explain().to_owned())),
    };
    state::Slot {
        slot: s.id.name().to_owned(),
        version: s.version,
        state: life,
        reason,
        issued_s: seconds(s.issued),
        changed_s: seconds(s.changed),
    }
}

fn link(surface: &Surface, meter: &LinkMeter, now: Instant) -> state::Link {
    let views: Vec<PeerView<'_>> = surface.vehicles().filter_map(|(a, _)| surface.view(a)).collect();
    let sum = |of: &dyn Fn(&LinkStats) -> u64| views.iter().map(|v| of(v.stats())).sum::<u64>();
    let heard = sum(&|s| s.frames_received);
    let numbered = sum(&|s| s.frames_numbered);
    let (lost, delivered) = (sum(&|s| s.frames_lost), sum(&|s| s.frames_delivered));
    let elapsed = now.as_secs_f64().max(1.0);
    let direction = |i: usize, frames: u64, lost: u64, class: &dyn Fn(&LinkStats, Class) -> u64| {
        let bytes = |c: Class| sum(&|s| class(s, c));
        let useful: u64 = Class::ALL.into_iter().filter(|&c| c != Class::Overhead).map(bytes).sum();
        state::Direction {
            bps_1min: meter.bps_1min(i, now).round(),
            worst_window_bps: meter.worst_window_bps(i),
            loss: if frames > 0 { lost as f64 / frames as f64 } else { 0.0 },
            frames,
            lost,
            goodput_bps: (useful as f64 * 8.0 / elapsed).round(),
            bytes_by_class: Class::ALL.into_iter().map(|c| (c.name().to_owned(), bytes(c))).collect(),
        }
    };
    state::Link {
        budget_bps: surface.budget_bps(),
        budget_window_s: meter.window_s(),
        shares: Class::SHARED.iter().zip(surface.shares().0).map(|(c, s)| (c.name().to_owned(), s)).collect(),
        background: surface.background().names(),
        strangers: surface.strangers(),
        up: direction(0, numbered, numbered.saturating_sub(heard), &|s, c| of_class(&s.received_by_class, c)),
        down: direction(1, lost + delivered, lost, &|s, c| of_class(&s.bytes_by_class, c)),
        round_trip_s: views.iter().find_map(PeerView::round_trip).map(|d| d.as_secs_f64()),
        backlog_bits: total(views.iter().filter_map(PeerView::backlog)),
        history: meter.history(),
    }
}

/// Bits of all backlogs; nothing where nobody has told of one.
fn total(backlogs: impl Iterator<Item = (Backlog, Instant)>) -> Option<u64> {
    backlogs.map(|(b, _)| (u64::from(b.map_bytes) + u64::from(b.other_bytes)) * 8).reduce(|a, b| a + b)
}

fn of_class(bytes: &BTreeMap<Class, u64>, class: Class) -> u64 {
    bytes.get(&class).copied().unwrap_or(0)
}

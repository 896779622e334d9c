//! Vehicles as the surface knows them.

use super::facts::MissionFacts;
use super::{exemplar, facts, link};
use crate::record::{StoredDraft, StoredMarker, StoredNote};
use crate::reported_orders::why_refused;
use crate::state::{
    AppliedOrder, DirectiveSlots, EarlierMap, FavouredTime, FloorSummary, InForceKnowledge, MapLabel, MapLabelTree,
    MapSummary, OrderProgress, OrderStatus, OtherSurface, PlanAims, PlannedPath, ReportedDisk, ReportedFault,
    ReportedPose, ReportedRegistration, ReportedTie, StatusReport, UsblMeasurement, UtilityTerms, VehicleMarker,
    VehicleNote, VehicleOrders, VehicleSettings, VehicleState, WeightDraft, seconds,
};
use crate::{Ground, Purpose, SettingsOrder, Surface, Track, VehicleRecord, order_name};
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::directive::{self, PlannerKind, REPORTED_SLOTS, SlotId, SlotProgress};
use scenecast_protocol::link::{InForce, PeerView};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, DiskReport, FrameTie, Intent, RegistrationReport, VehicleMode, VehicleStatus};

pub(super) fn vehicles(surface: &Surface, facts: &MissionFacts, now: Instant) -> Vec<VehicleState> {
    let all = surface.vehicles();
    all.filter_map(|(address, record)| vehicle(surface, address, record, facts, now)).collect()
}

fn vehicle(
    surface: &Surface,
    address: Address,
    record: &VehicleRecord,
    facts: &MissionFacts,
    now: Instant,
) -> Option<VehicleState> {
    let view = surface.view(address)?;
    let labels = surface.labels(address).unwrap_or_default();
    let weight = |label| record.weight(label);
    // Weights and plan belong to the current map.
    let current = surface.map(address).filter(|_| record.earlier_map().is_none());
    let cell_m = view.cell_m().unwrap_or(facts.cell_m);
    let ground = current.map(|map| Ground { map, cell_m, weight: &weight, reach_m: facts.reach_m });
    Some(VehicleState {
        id: address.number(),
        name: record.name.clone(),
        last_received_s: record.last_received(&view).map(seconds),
        expected_interval_s: expected_interval_s(surface, &view, record, facts),
        next_contact_s: view.next_contact(now).map(seconds),
        other_surface: other_surface(&view, now),
        status: record.status(&view).map(|(s, at)| status(s, record, &view, *at)),
        aims: ground.as_ref().and_then(|ground| aims(ground, record, &view, facts)),
        favoured_time: ground.as_ref().and_then(|ground| favoured_time(ground, record, &view)),
        track: track(&record.track),
        registration: record.registration.latest().map(registration),
        closed_loops: track(record.registration.closures()),
        map: map(surface, address, record, &view, labels.values().sum(), facts),
        labels: labels.iter().map(|(&l, &n)| label(l, n, record, &view, address, facts)).collect(),
        label_book: record.labels_in_view().clone(),
        label_tree: record.tree_in_view().map(MapLabelTree::of),
        floor: FloorSummary {
            images: record.floor.count(),
            bytes: record.floor.bytes(),
            version: record.floor.version(),
            epoch: record.floor.epoch(),
        },
        link: link::channel(&view, now),
        usbl: record.found.as_ref().map(|(line, at)| UsblMeasurement {
            at_s: seconds(*at) - line.age_s,
            range_m: line.range_m,
            bearing_rad: line.direction_rad.map(|(bearing, _)| bearing),
            elevation_rad: line.direction_rad.map(|(_, elevation)| elevation),
            accuracy: line.accuracy,
        }),
        notes: record.annotations.notes.iter().map(note).collect(),
        markers: record.annotations.markers.values().map(marker).collect(),
        draft: draft(&record.annotations.draft),
        orders: orders(record, &view),
    })
}

fn other_surface(view: &PeerView<'_>, now: Instant) -> Option<OtherSurface> {
    let holder = view.holder();
    let other = holder.or_else(|| view.caller(now))?;
    Some(OtherSurface {
        name: other.name.as_str().to_owned(),
        holds: holder.is_some(),
        heard_s: seconds(other.heard),
        is_silent: other.is_silent(now),
        is_taken_over: view.takes_over(),
    })
}

pub(crate) fn marker(marker: &StoredMarker) -> VehicleMarker {
    let StoredMarker { number, x_m, y_m, at, author, text } = marker.clone();
    VehicleMarker { number, x_m, y_m, at_s: seconds(Instant::from_micros(at)), author, text }
}

fn draft(draft: &StoredDraft) -> WeightDraft {
    let StoredDraft { number, weights, exploration, curiosity, at, author } = draft.clone();
    WeightDraft { number, weights, exploration, curiosity, at_s: seconds(Instant::from_micros(at)), author }
}

fn note(note: &StoredNote) -> VehicleNote {
    let at_s = seconds(Instant::from_micros(note.at));
    VehicleNote { at_s, author: note.author.clone(), text: note.text.clone() }
}

fn orders(record: &VehicleRecord, view: &PeerView<'_>) -> VehicleOrders {
    VehicleOrders {
        utility: UtilityTerms {
            exploration: f64::from(record.orders.utility.exploration) / 100.0,
            curiosity: f64::from(record.orders.utility.curiosity) / 100.0,
            weights: record
                .orders
                .utility
                .weights
                .keys()
                .map(|&label| (label, record.orders.utility.weight(label)))
                .collect(),
        },
        fence: record.orders.fence.sent.as_ref().map(Into::into),
        limits: record.orders.limits.sent.as_ref().map(Into::into),
        fence_in_force: in_force(&record.orders.fence.in_force),
        limits_in_force: in_force(&record.orders.limits.in_force),
        areas: record.orders.areas.sent.as_ref().map(Into::into),
        areas_in_force: in_force(&record.orders.areas.in_force),
        destination: record.orders.destination.sent.as_ref().map(Into::into),
        destination_in_force: in_force(&record.orders.destination.in_force),
        planner: record.orders.settings.requested().planner.value().map(|p| PlannerKind::name(p).to_owned()),
        settings: VehicleSettings {
            requested: SettingsOrder::of(record.orders.settings.requested(), view.layers()),
            in_force: record.orders.settings.in_force().map(|settings| SettingsOrder::of(settings, view.layers())),
        },
        in_force: REPORTED_SLOTS.map(|id| (id.name().to_owned(), knowledge(view.in_force(id)))).into(),
        directive: DirectiveSlots { slots: view.slots().map(|slot| order_progress(slot, record)).collect() },
    }
}

fn knowledge(in_force: InForce<'_>) -> InForceKnowledge {
    match in_force {
        InForce::NotReported => InForceKnowledge::NotReported,
        InForce::None => InForceKnowledge::None,
        InForce::Known(_) => InForceKnowledge::Known,
        InForce::Unknown => InForceKnowledge::Unknown,
    }
}

fn map(
    surface: &Surface,
    address: Address,
    record: &VehicleRecord,
    view: &PeerView<'_>,
    explored_cells: u32,
    facts: &MissionFacts,
) -> MapSummary {
    let bounds = surface.map_bounds(address);
    MapSummary {
        version: surface.map_version(address),
        cell_m: view.cell_m().unwrap_or(facts.cell_m),
        x0: bounds.map_or(0, |b| b.x),
        y0: bounds.map_or(0, |b| b.y),
        width: bounds.map_or(0, |b| b.width),
        height: bounds.map_or(0, |b| b.height),
        explored_cells,
        updated_s: surface.replica(address).and_then(|r| r.updated()).map(seconds),
        epoch: record.earlier_map().map_or(record.epoch, |earlier| earlier.epoch),
        earlier: record.earlier_map().map(|earlier| EarlierMap {
            run: earlier.run,
            current_run: record.run,
            current_epoch: record.epoch,
            current_cells: surface.current_cells(address) as u32,
        }),
        placement: match record.earlier_map() {
            Some(earlier) => earlier.placement(),
            None => record.status(view).and_then(|(s, _)| s.placement),
        }
        .map(facts::placement),
    }
}

/// The longest usual pause between two frames. An idle link or the smaller of both budgets can make it
/// longer than the measured pauses.
fn expected_interval_s(surface: &Surface, view: &PeerView<'_>, record: &VehicleRecord, facts: &MissionFacts) -> f64 {
    let vehicle_bps = record.status(view).map_or(u32::MAX, |(s, _)| s.budget_bps);
    let budget_bps = surface.budget_bps().min(vehicle_bps).max(1);
    let idle_s = facts.idle_s + facts.frame_bits as f64 / f64::from(budget_bps);
    record.pauses.expected().map_or(facts.first_interval_s, |d| d.as_secs_f64()).max(idle_s)
}

fn in_force<T, O: for<'a> From<&'a T>>(applied: &Option<(u16, T)>) -> Option<AppliedOrder<O>> {
    let (version, order) = applied.as_ref()?;
    Some(AppliedOrder { version: *version, order: order.into() })
}

fn status(s: &VehicleStatus, record: &VehicleRecord, view: &PeerView<'_>, at: Instant) -> StatusReport {
    StatusReport {
        at_s: seconds(at),
        pose: ReportedPose {
            x_m: s.position.x_m,
            y_m: s.position.y_m,
            z_m: -s.depth_m,
            heading_deg: s.heading_deg,
            sigma_m: s.sigma_m,
            fix_age_s: s.fix_age_s,
        },
        mode: s.mode.into(),
        autopilot_silent: s.autopilot_silent,
        reason: s.reason.name().map(str::to_owned),
        activity: activity(s, record, view),
        plan: PlannedPath {
            waypoint: s.waypoint.map(MapPoint::xy),
            path: s.path.points.iter().copied().map(MapPoint::xy).collect(),
            path_continues: s.path.continues,
        },
        cells: s.explored_cells,
        labels: u32::from(s.labels),
        budget_bps: s.budget_bps,
        refused_frames: u32::from(s.refused_frames),
        disk: s.disk.map(disk),
        faults: s.faults.iter().map(|(text, is_grave)| ReportedFault { text: text.to_owned(), is_grave }).collect(),
    }
}

/// What the reported plan is for.
fn aims(ground: &Ground<'_>, record: &VehicleRecord, view: &PeerView<'_>, facts: &MissionFacts) -> Option<PlanAims> {
    let (status, at) = record.status(view)?;
    let purpose = match status.mode {
        VehicleMode::Return => Purpose::Return,
        _ => Purpose::Survey(status.intent),
    };
    let legs: Vec<_> = status.ahead().map(|to| (to.xy(), purpose)).collect();
    let speed_m_s = record.track.speed_m_s().unwrap_or(facts.survey_m_s);
    (!legs.is_empty()).then(|| ground.aims(status.position.xy(), &legs, seconds(*at), speed_m_s))
}

/// What has come of the weights in force.
fn favoured_time(ground: &Ground<'_>, record: &VehicleRecord, view: &PeerView<'_>) -> Option<FavouredTime> {
    let is_applied =
        |slot: &&SlotProgress| slot.id == SlotId::Utility && slot.status == directive::OrderStatus::Applied;
    let since_s = view.slots().find(is_applied).map(|slot| seconds(slot.changed))?;
    let favours = record.orders.utility.weights.values().any(|weight| *weight > 0);
    let track = record.track.iter().map(|(at, east_m, north_m)| (seconds(at), east_m, north_m));
    favours.then(|| ground.favoured_time(track, since_s)).flatten()
}

fn track(track: &Track) -> Vec<(f64, f64, f64)> {
    track.iter().map(|(at, x, y)| (seconds(at), x, y)).collect()
}

fn registration((report, at): (RegistrationReport, Instant)) -> ReportedRegistration {
    let tie = match report.tie {
        FrameTie::Odometry => ReportedTie::Odometry,
        FrameTie::FrameBefore => ReportedTie::FrameBefore,
        FrameTie::EarlierTrack => ReportedTie::EarlierTrack,
        FrameTie::Off => ReportedTie::Off,
    };
    let RegistrationReport { share, sigma_m, closed, .. } = report;
    ReportedRegistration { at_s: seconds(at), tie, share, sigma_m, closed }
}

fn disk(disk: DiskReport) -> ReportedDisk {
    let DiskReport { journal_refused, checkpoint_refused, free_bytes } = disk;
    ReportedDisk { journal_refused, checkpoint_refused, free_bytes }
}

/// Mode with its reason or purpose as a text.
fn activity(s: &VehicleStatus, record: &VehicleRecord, view: &PeerView<'_>) -> String {
    match s.intent.filter(|_| !s.has_arrived()) {
        Some(intent) => format!("{}: {}", s.mode.name(), purpose(intent, record)),
        None => record.mode_text(s, view),
    }
}

fn purpose(intent: Intent, record: &VehicleRecord) -> String {
    let name = |label| record.label_name(label).map_or_else(|| format!("label {label}"), str::to_owned);
    match intent {
        Intent::Unseen => "looking at unseen floor".to_owned(),
        Intent::Curiosity => "looking at unusual places".to_owned(),
        Intent::Destination => "going to the destination".to_owned(),
        Intent::Area(number) => format!("looking at weighted area {number}"),
        Intent::Label(label) => format!("looking for {}", name(label)),
        Intent::LabelAgain(label) => format!("revisiting {}", name(label)),
    }
}

fn label(
    id: u8,
    cells: u32,
    record: &VehicleRecord,
    view: &PeerView<'_>,
    address: Address,
    facts: &MissionFacts,
) -> MapLabel {
    // Weights and images belong to the labels of the current epoch.
    let is_current = record.earlier_map().is_none_or(|earlier| earlier.epoch == record.epoch);
    let cell_m = view.cell_m().unwrap_or(facts.cell_m);
    let placement = record.status(view).and_then(|(status, _)| status.placement).map(facts::placement);
    let shift_m = placement.map_or((0.0, 0.0), |placement| (placement.east_m, placement.north_m));
    MapLabel {
        id,
        cells,
        area_m2: f64::from(cells) * cell_m * cell_m,
        gained_m2: if is_current { record.labels.gains.gained(id, cells) as f64 * cell_m * cell_m } else { 0.0 },
        weight: if is_current { record.weight(id) } else { 0.0 },
        exemplar: match is_current {
            true => exemplar::progress(id, record, view, address, shift_m),
            false => exemplar::none(),
        },
        book: record.label_book(id).cloned().unwrap_or_default(),
    }
}

fn order_progress(s: &SlotProgress, record: &VehicleRecord) -> OrderProgress {
    let (state, reason) = match s.status {
        directive::OrderStatus::Queued => (OrderStatus::Queued, None),
        directive::OrderStatus::OnAir => (OrderStatus::OnAir, None),
        directive::OrderStatus::Received => (OrderStatus::Received, None),
        directive::OrderStatus::Applied => (OrderStatus::Applied, None),
        directive::OrderStatus::Refused(reason) => (OrderStatus::Refused, Some(why_refused(record, &s.slot, reason))),
        directive::OrderStatus::Withdrawn(why) => (OrderStatus::Withdrawn, Some(why.explain().to_owned())),
    };
    let asks = matches!(s.status, directive::OrderStatus::Withdrawn(why) if why.asks());
    OrderProgress {
        slot: s.id.name().to_owned(),
        name: order_name(&s.slot).to_owned(),
        version: s.version,
        state,
        reason,
        asks: asks && !matches!(s.id, SlotId::Fix | SlotId::Requests),
        issued_s: seconds(s.issued),
        changed_s: seconds(s.changed),
    }
}

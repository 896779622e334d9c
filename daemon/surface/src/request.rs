//! Requests of clients that only the surface can handle.

mod described;
mod maps;
mod refused;

use crate::fit::{self, Fit};
use crate::floor_views::{FloorPlace, floor_list};
use crate::map_cells::MapCells;
use crate::orders::{
    BudgetOrder, ExemplarAction, ExemplarOrder, LabelOrder, MarkerOrder, NoteOrder, OrderChanges, RemoveMarkerOrder,
};
use crate::record::StoredLabel;
use crate::snapshot::command_state;
use crate::state::{
    AcceptedOrder, ArchivedMap, CellHistory, CommandState, DryRun, FloorList, ReplayEventList, ReplayOrder, ReplayState,
};
use crate::{
    AreasOrder, CommandAction, DestinationOrder, FenceOrder, Giver, LimitsOrder, LogEntry, OrderKind, OrderRefusal,
    RequestKind, SettingsOrder, Surface, order_name,
};
use described::describe;
pub use maps::{archived_cells, cell_layers, former_labels};
use scenecast_core::tuning_table::NoRow;
use scenecast_protocol::coordinates::WorldPoint;
use scenecast_protocol::directive::{Constraints, Slot, SlotId};
use scenecast_protocol::map::Cell;
use scenecast_protocol::schedule::{BackgroundOrder, Shares};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use std::collections::BTreeMap;
use std::error::Error;

/// A request and who makes it.
#[derive(Debug, Clone, PartialEq)]
pub struct ClientRequest {
    /// `None` is enough for a reading only.
    pub by: Option<Giver>,
    pub request: SurfaceRequest,
}

/// A reading or an order. The first number is the address of the vehicle.
#[derive(Debug, Clone, PartialEq)]
pub enum SurfaceRequest {
    /// Read the map: its tiles with the time of each cell.
    Map(u8),
    /// Read the labels that a cell had before. The owner of the files handles this request.
    FormerLabels(u8, Cell),
    /// Read an image of a label: the one with this number, or the latest.
    Exemplar(u8, u8, Option<u8>),
    /// Read which images of the sea floor have arrived after a version.
    Floor(u8, u64),
    /// Read the image of the sea floor with this middle.
    FloorImage(u8, FloorPlace),
    /// Read the settings that fit a budget in bit/s, by default the share of the map.
    Fit(u8, Option<f64>),
    /// Plan what the vehicle would do by weights of labels, of unexplored cells and of curiosity, which are not sent. The owner
    /// of the vehicle's planner handles this request.
    DryRun(u8, BTreeMap<u8, f64>, (f64, f64), Option<FenceOrder>),
    /// Send the weights of labels, and those of unexplored cells and of curiosity.
    Utility(u8, BTreeMap<u8, f64>, (f64, f64)),
    /// Request an image of a label, or cancel the request.
    ExemplarOrder(u8, ExemplarOrder),
    Constraints(u8, Constraints),
    /// Hold or continue, and leave an abort as it is.
    Hold(u8, bool),
    Fence(u8, OrderChanges<FenceOrder>),
    Limits(u8, OrderChanges<LimitsOrder>),
    Areas(u8, AreasOrder),
    Destination(u8, DestinationOrder),
    Settings(u8, SettingsOrder),
    /// Give the withdrawn order of this name again: that of its slot, or hold, resume or abort.
    Again(u8, SlotId, String),
    /// Send the orders again that the vehicle has lost.
    Restore(u8),
    /// Take the vehicle over from another surface.
    TakeOver(u8),
    /// Change the bit budget, the shares and the background streams.
    Budget(BudgetOrder),
    /// Set name, colour and merging of a label.
    Label(u8, LabelOrder),
    /// Keep the weights that the person or program with this name has set and not sent: of labels, of unexplored cells, of
    /// curiosity.
    Draft(u8, String, BTreeMap<u8, f64>, (Option<f64>, Option<f64>)),
    /// Add a note of the person or program with this name.
    Note(u8, String, NoteOrder),
    /// Set a marker of the person or program with this name.
    Marker(u8, String, MarkerOrder),
    RemoveMarker(u8, RemoveMarkerOrder),
    /// Take the earlier map out of view.
    DismissEarlierMap(u8),
    /// Read the log of the mission.
    Log,
    /// List the archived maps. The owner of the files handles this request and the next one.
    Archives,
    /// Read an archived map by its name.
    ArchivedMap(String),
    /// Request command, hand it over, take it or give it up.
    Command(CommandAction),
    /// Show another moment of a record. A surface that is live handles neither this request nor the next one.
    Replay(ReplayOrder),
    ReplayEvents,
    /// Read the report of the dive so far. The owner of the record handles this request.
    Report,
    /// Note in the log what was refused to a principal by its role, before it was read; of a vehicle, or of the surface.
    Barred(Option<u8>, String),
}

impl SurfaceRequest {
    /// Whether it changes nothing, so that it needs no principal.
    pub fn is_reading(&self) -> bool {
        self.order_kind().is_none() && !matches!(self, Self::Command(_) | Self::Barred(..))
    }

    /// The kind of an order; `None` for readings, and for changes of command, which have rules of their own.
    pub fn order_kind(&self) -> Option<OrderKind> {
        match self {
            Self::Map(_) | Self::FormerLabels(..) | Self::Exemplar(..) | Self::Fit(..) | Self::Command(_) => None,
            Self::Floor(..) | Self::FloorImage(..) | Self::DryRun(..) => None,
            Self::Log | Self::Archives | Self::ArchivedMap(_) | Self::Replay(_) | Self::ReplayEvents => None,
            Self::Report | Self::Barred(..) => None,
            Self::Label(..)
            | Self::Draft(..)
            | Self::Note(..)
            | Self::Marker(..)
            | Self::RemoveMarker(..)
            | Self::DismissEarlierMap(_) => Some(OrderKind::Record),
            Self::Constraints(_, order) if order.stops() => Some(OrderKind::Stop),
            Self::Hold(_, true) => Some(OrderKind::Stop),
            Self::Utility(..)
            | Self::ExemplarOrder(..)
            | Self::Constraints(..)
            | Self::Hold(..)
            | Self::Fence(..)
            | Self::Limits(..)
            | Self::Areas(..)
            | Self::Destination(..)
            | Self::Again(..)
            | Self::Restore(_)
            | Self::TakeOver(_)
            | Self::Budget(_) => Some(OrderKind::Order),
            Self::Settings(..) => Some(OrderKind::Settings),
        }
    }
}

/// The reply of the surface.
#[derive(Debug, Clone)]
pub enum Reply {
    /// The cells of a map.
    Map(MapCells),
    /// The content type and the bytes of a file.
    File(&'static str, Vec<u8>),
    /// Settings that fit a budget.
    Fit(Box<Fit>),
    DryRun(Box<DryRun>),
    /// The order was accepted and waits for its turn.
    Accepted(AcceptedOrder),
    /// The surface has done what was requested.
    Done,
    Archives(Vec<ArchivedMap>),
    Floor(FloorList),
    /// The labels that a cell had before.
    FormerLabels(CellHistory),
    /// The entries of the log, the oldest first.
    Log(Vec<LogEntry>),
    /// Who has command after a change.
    Command(CommandState),
    /// The moment of a record that is shown.
    Replay(Box<ReplayState>),
    ReplayEvents(ReplayEventList),
    /// The role of the principal does not allow it: the reason in one line.
    Forbidden(String),
    /// Another principal has command: the reason and the remedy in one line.
    NotInCommand(String),
    /// There is no such vehicle, label or image.
    NotFound,
    /// The order is not allowed: the reason in one line.
    Refused(String),
}

/// Handles a request between two steps of the surface.
pub fn handle_request(surface: &mut Surface, request: ClientRequest, cell_m: f64, now: Instant) -> Reply {
    let ClientRequest { by, request } = request;
    let Some(by) = by else {
        let anonymous = || Reply::Forbidden("an order needs a principal".to_owned());
        return if request.is_reading() { reply(surface, request, cell_m, now) } else { anonymous() };
    };
    if let SurfaceRequest::Command(action) = &request {
        return match surface.change_command(&by, action, now) {
            Ok(()) => Reply::Command(command_state(surface.command(), now)),
            Err(refusal) => {
                if !matches!(action, CommandAction::Keep) {
                    refused::log(surface, None, by.name(), &format!("{}: refused: {refusal}", action.told()), now);
                }
                refused::refused(&refusal)
            }
        };
    }
    if let SurfaceRequest::Barred(vehicle, what) = &request {
        refused::log(surface, vehicle.and_then(Address::vehicle), by.name(), what, now);
        return Reply::Done;
    }
    let Some(kind) = request.order_kind() else { return reply(surface, request, cell_m, now) };
    let stored =
        |id, label| Address::vehicle(id).and_then(|id| surface.record(id)?.annotations.labels.get(&label).cloned());
    let name =
        |id, slot: SlotId| Address::vehicle(id).map_or(slot.name(), |vehicle| name_of_order(surface, vehicle, slot));
    let entry = describe(&request, name, stored);
    let reply = admitted(surface, request, kind, (&by, cell_m), now);
    if matches!(reply, Reply::Accepted(_)) {
        surface.handle_accepted(&by, kind, now);
    }
    let Some((vehicle, logged, text)) = entry else { return reply };
    match (&reply, refused::why(&reply)) {
        (Reply::Accepted(_) | Reply::Done, _) => surface.log_action(vehicle, logged, by.name(), &text, now),
        (_, Some(why)) if kind != OrderKind::Record => {
            refused::log(surface, vehicle, by.name(), &format!("{text}: not sent: {why}"), now)
        }
        _ => {}
    }
    reply
}

/// The reply to an order of a principal, if that may give it.
fn admitted(
    surface: &mut Surface,
    request: SurfaceRequest,
    kind: OrderKind,
    (by, cell_m): (&Giver, f64),
    now: Instant,
) -> Reply {
    if let Err(refusal) = surface.command().check(by, kind, now) {
        return refused::refused(&refusal);
    }
    if let SurfaceRequest::TakeOver(id) = request
        && let Some(holder) = Address::vehicle(id).and_then(|vehicle| surface.view(vehicle)?.holder())
        && let Some(reason) = refused::why_not_taken_over(&holder, by.role(), now)
    {
        return Reply::Forbidden(reason);
    }
    reply(surface, request, cell_m, now)
}

fn reply(surface: &mut Surface, request: SurfaceRequest, cell_m: f64, now: Instant) -> Reply {
    handle(surface, request, cell_m, now).unwrap_or(Reply::NotFound)
}

fn handle(surface: &mut Surface, request: SurfaceRequest, cell_m: f64, now: Instant) -> Option<Reply> {
    let known = |surface: &Surface, id: u8| Address::vehicle(id).filter(|&a| surface.record(a).is_some());
    Some(match request {
        SurfaceRequest::Map(id) => maps::map(surface, known(surface, id)?, cell_m, now)?,
        SurfaceRequest::Exemplar(id, label, number) => {
            let record = surface.record(known(surface, id)?)?;
            Reply::File("image/webp", record.exemplars.label(label)?.exemplar(number)?.webp.clone())
        }
        SurfaceRequest::Floor(id, since) => {
            Reply::Floor(floor_list(id, &surface.record(known(surface, id)?)?.floor, since))
        }
        SurfaceRequest::FloorImage(id, place) => {
            let record = surface.record(known(surface, id)?)?;
            Reply::File("image/webp", record.floor.get(place)?.webp.clone())
        }
        SurfaceRequest::Fit(id, bits_per_s) => match fit(surface, known(surface, id)?, cell_m, bits_per_s) {
            Ok(fit) => Reply::Fit(Box::new(fit)),
            Err(error) => Reply::Refused(error.to_string()),
        },
        SurfaceRequest::Utility(id, weights, terms) => {
            let vehicle = known(surface, id)?;
            accepted(vehicle, SlotId::Utility, surface.set_utility(vehicle, &weights, terms, now))
        }
        SurfaceRequest::ExemplarOrder(id, order) => {
            let vehicle = known(surface, id)?;
            accepted(vehicle, SlotId::Requests, order_exemplar(surface, vehicle, &order, now))
        }
        SurfaceRequest::Constraints(id, order) => {
            let vehicle = known(surface, id)?;
            let name = order_name(&Slot::Constraints(order));
            accepted_as(SlotId::Constraints, name, vehicle, surface.set_order(vehicle, order, now))
        }
        SurfaceRequest::Hold(id, hold) => {
            let vehicle = known(surface, id)?;
            let name = if hold { "hold" } else { "resume" };
            accepted_as(SlotId::Constraints, name, vehicle, surface.change_hold(vehicle, hold, now))
        }
        SurfaceRequest::Fence(id, order) => {
            let vehicle = known(surface, id)?;
            let fence = order.applied_to(|| surface.present_fence(vehicle));
            accepted(vehicle, SlotId::Fence, fence.and_then(|fence| surface.set_fence(vehicle, &fence, now)))
        }
        SurfaceRequest::Limits(id, order) => {
            let vehicle = known(surface, id)?;
            let limits = order.applied_to(|| surface.present_limits(vehicle));
            accepted(vehicle, SlotId::Limits, limits.and_then(|limits| surface.set_limits(vehicle, &limits, now)))
        }
        SurfaceRequest::Areas(id, order) => {
            let vehicle = known(surface, id)?;
            accepted(vehicle, SlotId::Areas, surface.set_areas(vehicle, &order, now))
        }
        SurfaceRequest::Destination(id, order) => {
            let vehicle = known(surface, id)?;
            accepted(vehicle, SlotId::Destination, surface.set_destination(vehicle, &order, now))
        }
        SurfaceRequest::Settings(id, order) => {
            let vehicle = known(surface, id)?;
            accepted(vehicle, SlotId::Settings, surface.set_settings(vehicle, &order, now))
        }
        SurfaceRequest::Again(id, slot, name) => {
            let vehicle = known(surface, id)?;
            let own_name = name_of_order(surface, vehicle, slot);
            if name != slot.name() && name != own_name {
                return Some(Reply::Refused(format!(
                    "no {name} is withdrawn: the last order of its kind is {own_name}"
                )));
            }
            accepted_as(slot, own_name, vehicle, surface.give_again(vehicle, slot, now))
        }
        SurfaceRequest::Restore(id) => done(surface.restore_lost(known(surface, id)?, now).map(drop)),
        SurfaceRequest::TakeOver(id) => done(surface.take_over(known(surface, id)?, now)),
        SurfaceRequest::Budget(order) => budget(surface, order, now),
        SurfaceRequest::Label(id, LabelOrder { label, name, colour, merged_into }) => {
            let book = StoredLabel { name, colour, merged_into };
            done(surface.record_mut(Address::vehicle(id)?)?.set_label(label, book))
        }
        SurfaceRequest::Draft(id, by, weights, terms) => {
            done(surface.record_mut(Address::vehicle(id)?)?.annotations.set_draft(&by, weights, terms, now))
        }
        SurfaceRequest::Note(id, by, order) => {
            let record = surface.record_mut(Address::vehicle(id)?)?;
            done(record.annotations.add_note(&by, &order.text, now))
        }
        SurfaceRequest::Marker(id, by, MarkerOrder { x_m, y_m, text }) => {
            let place = WorldPoint { east_m: x_m, north_m: y_m };
            done(surface.record_mut(Address::vehicle(id)?)?.annotations.add_marker(&by, &text, place, now))
        }
        SurfaceRequest::RemoveMarker(id, RemoveMarkerOrder { number }) => {
            done(surface.record_mut(Address::vehicle(id)?)?.annotations.remove_marker(number))
        }
        SurfaceRequest::DismissEarlierMap(id) => {
            surface.record_mut(Address::vehicle(id)?)?.dismiss_earlier_map();
            Reply::Done
        }
        SurfaceRequest::Log => Reply::Log(surface.log().entries().cloned().collect()),
        SurfaceRequest::Archives => Reply::Archives(Vec::new()),
        SurfaceRequest::FormerLabels(..) | SurfaceRequest::ArchivedMap(_) | SurfaceRequest::DryRun(..) => {
            return None;
        }
        SurfaceRequest::Replay(_) | SurfaceRequest::ReplayEvents | SurfaceRequest::Report => return None,
        // Handled with their principal, before.
        SurfaceRequest::Command(_) | SurfaceRequest::Barred(..) => return None,
    })
}

fn done(result: Result<(), impl Error>) -> Reply {
    result.map_or_else(|refusal| Reply::Refused(refusal.to_string()), |()| Reply::Done)
}

/// What the latest order in a slot is called.
fn name_of_order(surface: &Surface, vehicle: Address, slot: SlotId) -> &'static str {
    let order = surface.view(vehicle).and_then(|view| view.slots().find(|order| order.id == slot));
    order.map_or(slot.name(), |order| order_name(&order.slot))
}

fn accepted(vehicle: Address, slot: SlotId, issued: Result<u16, OrderRefusal>) -> Reply {
    accepted_as(slot, slot.name(), vehicle, issued)
}

fn accepted_as(slot: SlotId, name: &str, vehicle: Address, issued: Result<u16, OrderRefusal>) -> Reply {
    match issued {
        Ok(version) => Reply::Accepted(AcceptedOrder {
            slot: slot.name().to_owned(),
            name: name.to_owned(),
            version: Some(version),
            versions: BTreeMap::from([(vehicle.number(), version)]),
        }),
        Err(refusal) => Reply::Refused(refusal.to_string()),
    }
}

fn order_exemplar(
    surface: &mut Surface,
    vehicle: Address,
    order: &ExemplarOrder,
    now: Instant,
) -> Result<u16, OrderRefusal> {
    let ExemplarOrder { label, action, image } = *order;
    if action != ExemplarAction::Larger && image.is_some() {
        return Err(OrderRefusal::OnlyForLarger);
    }
    match action {
        ExemplarAction::Another => surface.request_exemplar(vehicle, label, RequestKind::Another, now),
        ExemplarAction::Larger => surface.request_exemplar(vehicle, label, RequestKind::Larger(image), now),
        ExemplarAction::Cancel => surface.cancel_exemplar(vehicle, label, now),
    }
}

fn budget(surface: &mut Surface, order: BudgetOrder, now: Instant) -> Reply {
    let shares = order.shares.map(|s| Shares([s.directive, s.status, s.fix, s.map, s.exemplar]));
    let background =
        order.background.as_deref().map(|names| BackgroundOrder::from_names(names, &surface.layers())).transpose();
    let changed = background
        .map_err(OrderRefusal::from)
        .and_then(|background| surface.set_budget(order.budget_bps, shares, background, now));
    if let Err(refusal) = changed {
        return Reply::Refused(refusal.to_string());
    }
    let issued = |a: Address| surface.view(a)?.slots().find(|s| s.id == SlotId::Budget).map(|s| s.version);
    let versions = surface.vehicles().filter_map(|(a, _)| Some((a.number(), issued(a)?))).collect();
    let slot = SlotId::Budget.name();
    Reply::Accepted(AcceptedOrder { slot: slot.to_owned(), name: slot.to_owned(), version: None, versions })
}

/// The settings that fit a budget, for the cells of the vehicle.
fn fit(surface: &Surface, vehicle: Address, cell_m: f64, bits_per_s: Option<f64>) -> Result<Fit, NoRow> {
    let cell_m = surface.view(vehicle).and_then(|view| view.cell_m()).unwrap_or(cell_m);
    fit::fit(surface, vehicle, cell_m, bits_per_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hold_needs_no_command_and_its_end_does() {
        assert_eq!(SurfaceRequest::Hold(1, true).order_kind(), Some(OrderKind::Stop));
        assert_eq!(SurfaceRequest::Hold(1, false).order_kind(), Some(OrderKind::Order));
    }
}

//! What a browser may ask of the surface.

use super::export::Cells;
use super::fit;
use super::layers;
use super::orders::{BudgetOrder, ExemplarOrder, ExemplarWish};
use super::snapshot::seconds;
use super::state::Accepted;
use scenecast_core::label_picture::MAX_CELLS;
use scenecast_protocol::directive::{Constraints, SlotId};
use scenecast_protocol::map::Rect;
use scenecast_protocol::schedule::{BackgroundOrder, Shares};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_surface::{FenceOrder, LimitsOrder, SettingsOrder, Surface, Wish};
use std::collections::BTreeMap;

/// A question or an order.
#[derive(Debug, Clone, PartialEq)]
pub enum Ask {
    /// A vehicle's map with the age of its cells.
    Map(u8),
    /// An image of a label: the one of this number, or the newest.
    Exemplar(u8, u8, Option<u8>),
    /// Send weights of labels, and of unseen cells and perplexity.
    Utility(u8, BTreeMap<u8, f64>, (f64, f64)),
    /// Ask the vehicle for an image of a label, or for none any more.
    Request(u8, ExemplarOrder),
    /// Tell the vehicle to stay, to abort, or to go on.
    Order(u8, Constraints),
    /// Send a fence.
    Fence(u8, FenceOrder),
    /// Send limits.
    Limits(u8, LimitsOrder),
    /// Change settings.
    Settings(u8, SettingsOrder),
    /// Which settings fit so many bits a second, or the map's share of the budget.
    Fit(u8, Option<f64>),
    /// Change the bit budget, and shares and left-over bits if they are given.
    Budget(BudgetOrder),
}

/// An answer.
#[derive(Debug, Clone, PartialEq)]
pub enum Reply {
    /// The cells of a map.
    Map(Cells),
    /// A file with its content type.
    File(&'static str, Vec<u8>),
    /// Taken; on its way.
    Accepted(Accepted),
    /// Settings that fit.
    Fit(Box<fit::Fit>),
    /// There is no such thing.
    NotFound,
    /// Not allowed, and why.
    Refused(String),
}

/// Answers an ask.
pub fn answer(surface: &mut Surface, ask: Ask, cell_m: f64, now: Instant) -> Reply {
    let address = |id: u8| Address::vehicle(id).filter(|&a| surface.desk(a).is_some());
    match ask {
        Ask::Map(id) => match address(id).and_then(|a| cells(surface, a, cell_m, now)) {
            Some(cells) if cells.bounds.area() != cells.labels.len() as u64 => {
                let Rect { width, height, .. } = cells.bounds;
                Reply::Refused(format!("the map spans {width} x {height} cells: at most {MAX_CELLS} are told"))
            }
            found => found.map_or(Reply::NotFound, Reply::Map),
        },
        Ask::Exemplar(id, label, number) => {
            let page = address(id).and_then(|a| surface.desk(a)).and_then(|d| d.album.page(label));
            let picture = page.and_then(|page| page.picture(number));
            picture.map_or(Reply::NotFound, |p| Reply::File("image/webp", p.webp.clone()))
        }
        Ask::Budget(order) => budget(surface, order, now),
        Ask::Utility(id, weights, others) => match address(id) {
            Some(a) => accepted(a, SlotId::Utility, surface.set_utility(a, &weights, others, now)),
            None => Reply::NotFound,
        },
        Ask::Request(id, order) => match address(id) {
            Some(a) => accepted(a, SlotId::Requests, request(surface, a, &order, now)),
            None => Reply::NotFound,
        },
        Ask::Order(id, order) => match address(id) {
            Some(a) => accepted(a, SlotId::Constraints, surface.set_order(a, order, now)),
            None => Reply::NotFound,
        },
        Ask::Fence(id, fence) => match address(id) {
            Some(a) => accepted(a, SlotId::Fence, surface.set_fence(a, &fence, now)),
            None => Reply::NotFound,
        },
        Ask::Limits(id, limits) => match address(id) {
            Some(a) => accepted(a, SlotId::Limits, surface.set_limits(a, &limits, now)),
            None => Reply::NotFound,
        },
        Ask::Settings(id, settings) => match address(id) {
            Some(a) => accepted(a, SlotId::Settings, surface.set_settings(a, &settings, now)),
            None => Reply::NotFound,
        },
        Ask::Fit(id, bits_per_s) => match address(id).map(|a| fit::fit(surface, a, cell_m, bits_per_s)) {
            Some(Ok(fit)) => Reply::Fit(Box::new(fit)),
            Some(Err(why)) => Reply::Refused(why),
            None => Reply::NotFound,
        },
    }
}

fn accepted(vehicle: Address, slot: SlotId, issued: Result<u16, String>) -> Reply {
    match issued {
        Ok(version) => Reply::Accepted(Accepted {
            slot: slot.name().to_owned(),
            version: Some(version),
            versions: BTreeMap::from([(vehicle.number(), version)]),
        }),
        Err(why) => Reply::Refused(why),
    }
}

fn request(surface: &mut Surface, vehicle: Address, order: &ExemplarOrder, now: Instant) -> Result<u16, String> {
    let ExemplarOrder { label, what, picture } = *order;
    match what {
        ExemplarWish::Another => surface.request_exemplar(vehicle, label, Wish::Another, now),
        ExemplarWish::Larger => surface.request_exemplar(vehicle, label, Wish::Larger(picture), now),
        ExemplarWish::Cancel => surface.cancel_exemplar(vehicle, label, now),
    }
}

fn budget(surface: &mut Surface, order: BudgetOrder, now: Instant) -> Reply {
    let shares = order.shares.map(|s| Shares([s.directive, s.status, s.fix, s.map, s.exemplar]));
    let background = order.background.as_deref().map(BackgroundOrder::from_names).transpose();
    if let Err(why) = background.and_then(|background| surface.set_budget(order.budget_bps, shares, background, now)) {
        return Reply::Refused(why);
    }
    let issued = |a: Address| surface.view(a)?.slots().find(|s| s.id == SlotId::Budget).map(|s| s.version);
    let versions = surface.vehicles().filter_map(|(a, _)| Some((a.number(), issued(a)?))).collect();
    Reply::Accepted(Accepted { slot: SlotId::Budget.name().to_owned(), version: None, versions })
}

/// The cells of a map; none where it spans more than can be told.
fn cells(surface: &Surface, address: Address, cell_m: f64, now: Instant) -> Option<Cells> {
    let grid = surface.map(address)?;
    let view = surface.view(address)?;
    let bounds = grid.bounds().unwrap_or(Rect { x: 0, y: 0, width: 0, height: 0 });
    let told = if bounds.area() <= MAX_CELLS { bounds } else { Rect { width: 0, ..bounds } };
    Some(Cells {
        version: surface.map_version(address),
        at_s: seconds(now),
        bounds,
        cell_m,
        moved_m: (0.0, 0.0),
        labels: told.cells().map(|cell| grid.get(cell)).collect(),
        age_s: layers::ages(view.replica(), told, now),
        layers: layers::layers(&view, told, now),
    })
}

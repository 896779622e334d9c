//! What a browser may ask of the surface.

use super::base64;
use crate::asv::{ExemplarState, FenceOrder, LimitsOrder, Surface};
use crate::picture;
use scenecast_protocol::directive::{Constraints, SlotId};
use scenecast_protocol::map::{Rect, StateReplica};
use scenecast_protocol::schedule::Shares;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// A question or an order.
#[derive(Debug, Clone, PartialEq)]
pub enum Ask {
    /// A vehicle's map with the age of its cells.
    Map(u8),
    /// A vehicle's map as an indexed PNG.
    MapPng(u8),
    /// The image of a label.
    Exemplar(u8, u8),
    /// Send weights of labels, and of unseen cells and perplexity.
    Utility(u8, BTreeMap<u8, f64>, (f64, f64)),
    /// Ask the vehicle for an image of a label.
    Request(u8, u8),
    /// Tell the vehicle to stay, to abort, or to go on.
    Order(u8, Constraints),
    /// Send a fence.
    Fence(u8, FenceOrder),
    /// Send limits.
    Limits(u8, LimitsOrder),
    /// Change planner and refinement.
    Settings(u8, Option<String>, Option<u32>),
    /// Change the bit budget, and the least shares if there are any.
    Budget(u32, Option<Shares>),
}

/// An answer.
#[derive(Debug, Clone, PartialEq)]
pub enum Reply {
    /// Found.
    Json(Value),
    /// A file with its content type.
    File(&'static str, Vec<u8>),
    /// Taken; on its way.
    Accepted(Value),
    /// There is no such thing.
    NotFound,
    /// Not allowed, and why.
    Refused(String),
}

/// Answers an ask.
pub fn answer(surface: &mut Surface, ask: Ask, cell_m: f64, now: Instant) -> Reply {
    let accepted = |slot: SlotId, result: Result<u16, String>| match result {
        Ok(version) => Reply::Accepted(json!({ "slot": slot.name(), "version": version })),
        Err(why) => Reply::Refused(why),
    };
    let address = |id: u8| Address::vehicle(id).filter(|&a| surface.desk(a).is_some());
    match ask {
        Ask::Map(id) => address(id).and_then(|a| map(surface, a, cell_m, now)).map_or(Reply::NotFound, Reply::Json),
        Ask::MapPng(id) => {
            let png = address(id).and_then(|a| surface.map(a)).and_then(|m| picture::encode(m).ok());
            png.map_or(Reply::NotFound, |png| Reply::File("image/png", png))
        }
        Ask::Exemplar(id, label) => {
            let desk = address(id).and_then(|a| surface.desk(a)).and_then(|d| d.exemplars.get(&label));
            match desk.map(|e| &e.state) {
                Some(ExemplarState::Here(webp)) => Reply::File("image/webp", webp.clone()),
                _ => Reply::NotFound,
            }
        }
        Ask::Budget(bps, shares) => match surface.set_budget(bps, shares, now) {
            Ok(()) => Reply::Accepted(json!({ "slot": SlotId::Budget.name() })),
            Err(why) => Reply::Refused(why),
        },
        Ask::Utility(id, weights, others) => match address(id) {
            Some(a) => accepted(SlotId::Utility, surface.set_utility(a, &weights, others, now)),
            None => Reply::NotFound,
        },
        Ask::Request(id, label) => match address(id) {
            Some(a) => accepted(SlotId::Requests, surface.request_exemplar(a, label, now)),
            None => Reply::NotFound,
        },
        Ask::Order(id, order) => match address(id) {
            Some(a) => accepted(SlotId::Constraints, surface.set_order(a, order, now)),
            None => Reply::NotFound,
        },
        Ask::Fence(id, fence) => match address(id) {
            Some(a) => accepted(SlotId::Fence, surface.set_fence(a, &fence, now)),
            None => Reply::NotFound,
        },
        Ask::Limits(id, limits) => match address(id) {
            Some(a) => accepted(SlotId::Limits, surface.set_limits(a, &limits, now)),
            None => Reply::NotFound,
        },
        Ask::Settings(id, planner, words) => match address(id) {
            Some(a) => accepted(SlotId::Settings, surface.set_settings(a, planner.as_deref(), words, now)),
            None => Reply::NotFound,
        },
    }
}

fn map(surface: &Surface, address: Address, cell_m: f64, now: Instant) -> Option<Value> {
    let grid = surface.map(address)?;
    let replica = surface.view(address)?.replica();
    let empty = Rect { x: 0, y: 0, width: 0, height: 0 };
    let bounds = grid.bounds().unwrap_or(empty);
    let mut labels = Vec::with_capacity(bounds.area() as usize);
    let mut ages = Vec::with_capacity(bounds.area() as usize * 2);
    for cell in bounds.cells() {
        labels.push(grid.get(cell));
        let age = replica.heard(cell).map_or(u16::MAX, |at| now.since(at).as_secs().min(65_534) as u16);
        ages.extend_from_slice(&age.to_le_bytes());
    }
    Some(json!({
        "version": replica.version(),
        "x0": bounds.x,
        "y0": bounds.y,
        "width": bounds.width,
        "height": bounds.height,
        "cell_m": cell_m,
        "labels": base64::encode(&labels),
        "age_s": base64::encode(&ages),
    }))
}

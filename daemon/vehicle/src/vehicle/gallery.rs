//! Pictures of labels: what the vehicle has, what the surface was shown of it, and what is asked for.

use crate::SharedExemplars;
use crate::exemplar::{GOOD_SSIM, compress_to, middle};
use image::RgbImage;
use scene_model::exemplars::ExemplarPatch;
use scenecast_protocol::directive::{ExemplarRequest, ExemplarRequests};
use scenecast_protocol::exemplar::{Exemplar, max_bytes};
use scenecast_protocol::link::VehicleLink;
use scenecast_protocol::object::ObjectId;
use scenecast_protocol::schedule::BackgroundStream;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Pictures of a label that were shown and are remembered.
const MAX_SHOWN: usize = 8;

/// A picture that the surface was shown.
#[derive(Debug)]
struct Shown {
    number: u8,
    picture: ExemplarPatch,
}

/// What was answered to a request.
#[derive(Debug)]
struct Reply {
    request: ExemplarRequest,
    /// The number of the picture; 0: that there is none.
    number: u8,
    /// While it is on its way.
    object: Option<ObjectId>,
}

/// A picture that nobody asked for, on its way.
#[derive(Debug, Clone, Copy)]
struct Unrequested {
    label: u8,
    number: u8,
    object: ObjectId,
}

/// Pictures of labels of one epoch.
#[derive(Debug, Default)]
pub(super) struct Gallery {
    /// By label, the best first.
    exemplars: SharedExemplars,
    requests: ExemplarRequests,
    /// The run of the surface that asks.
    series: Option<u16>,
    replies: Vec<Reply>,
    /// By label, the last shown last.
    shown: BTreeMap<u8, Vec<Shown>>,
    /// Labels of which the surface was shown a picture in this run of the link.
    seen: BTreeSet<u8>,
    unrequested: Option<Unrequested>,
}

impl Gallery {
    /// Most requests at a time.
    pub(super) const MAX_REQUESTS: usize = 8;

    /// The exemplars of each label from now on, the best first.
    pub(super) fn set_exemplars(&mut self, exemplars: SharedExemplars) {
        self.exemplars = exemplars;
    }

    pub(super) fn exemplars(&self) -> &SharedExemplars {
        &self.exemplars
    }

    /// What is wanted from now on, by the surface's run `series`; what is not wanted any more is not sent to its end, and what
    /// nobody asked for gives way.
    pub(super) fn replace_requests(&mut self, requests: ExemplarRequests, series: Option<u16>, link: &mut VehicleLink) {
        if self.series.is_some() && series != self.series {
            // Another run of the surface was shown nothing.
            self.shown.clear();
            self.seen.clear();
        }
        self.series = series;
        let (kept, dropped) =
            std::mem::take(&mut self.replies).into_iter().partition(|a| requests.wanted.contains(&a.request));
        self.replies = kept;
        for Reply { request, number, object } in dropped {
            self.withdraw(request.label, number, object, link);
        }
        self.requests = requests;
        if self.has_open_request()
            && let Some(Unrequested { label, number, object }) = self.unrequested.take()
        {
            self.withdraw(label, number, Some(object), link);
        }
    }

    /// What was on its way was never shown.
    fn withdraw(&mut self, label: u8, number: u8, object: Option<ObjectId>, link: &mut VehicleLink) {
        let Some(object) = object else { return };
        link.cancel_object(object);
        if let Some(shown) = self.shown.get_mut(&label) {
            shown.retain(|s| s.number != number);
            if shown.is_empty() {
                self.seen.remove(&label);
            }
        }
    }

    /// Whether something is asked for that the surface does not have.
    fn has_open_request(&self) -> bool {
        let is_met = |r: &ExemplarRequest| self.replies.iter().any(|a| a.request == *r && a.object.is_none());
        !self.requests.wanted.iter().all(is_met)
    }

    /// Sends what is asked for and can be had, or else a picture of a label of which the surface has none, those that weigh
    /// most first.
    pub(super) fn serve(&mut self, epoch: u8, weight: impl Fn(u8) -> f64, link: &mut VehicleLink) {
        for request in self.requests.wanted.clone() {
            self.reply(request, epoch, link);
        }
        if self.unrequested.is_none() && !self.has_open_request() && link.background().has(BackgroundStream::Exemplars)
        {
            self.show_unrequested(epoch, weight, link);
        }
    }

    fn reply(&mut self, request: ExemplarRequest, epoch: u8, link: &mut VehicleLink) {
        let before = self.replies.iter().position(|a| a.request == request);
        let was_none = before.and_then(|at| self.replies.get(at)).map(|a| a.number == 0);
        let chosen = if was_none == Some(false) { None } else { self.choose(request) };
        if was_none.is_some() && chosen.is_none() {
            return;
        }
        if let Some(at) = before {
            let Reply { object, .. } = self.replies.remove(at);
            object.into_iter().for_each(|id| link.cancel_object(id));
        }
        let head = Exemplar { epoch, label: request.label, serial: request.serial, size: 0, picture: 0, bytes: vec![] };
        let exemplar =
            chosen.as_ref().and_then(|(n, p)| fill(head.clone(), *n, &p.patch, request.size)).unwrap_or(head);
        let Some(object) = link.push_object(exemplar.encode()) else { return };
        self.replies.push(Reply { request, number: exemplar.picture, object: Some(object) });
        if let Some((number, picture)) = chosen {
            self.note_shown(request.label, number, picture);
        }
    }

    fn show_unrequested(&mut self, epoch: u8, weight: impl Fn(u8) -> f64, link: &mut VehicleLink) {
        let unseen = self.exemplars.keys().filter(|label| !self.seen.contains(label));
        let Some(label) = unseen.copied().max_by(|&a, &b| weight(a).total_cmp(&weight(b)).then(b.cmp(&a))) else {
            return;
        };
        let Some((number, picture)) = self.choose(ExemplarRequest { label, ..ExemplarRequest::default() }) else {
            return;
        };
        let head = Exemplar { epoch, label, serial: 0, size: 0, picture: 0, bytes: Vec::new() };
        let Some(exemplar) = fill(head, number, &picture.patch, 0) else { return };
        self.note_shown(label, number, picture);
        let object = link.push_background_object(exemplar.encode());
        self.unrequested = object.map(|object| Unrequested { label, number, object });
    }

    /// The picture that a request means: the one that it names while it is known, else the best that was not shown.
    fn choose(&self, request: ExemplarRequest) -> Option<(u8, ExemplarPatch)> {
        let shown = self.shown.get(&request.label).map_or(&[][..], Vec::as_slice);
        let exemplars = self.exemplars.get(&request.label).map_or(&[][..], Vec::as_slice);
        if request.picture != 0 {
            let known = shown.iter().find(|s| s.number == request.picture).map(|s| &s.picture);
            let named = known.or_else(|| exemplars.iter().find(|p| number_of(p) == request.picture));
            if let Some(picture) = named {
                return Some((request.picture, picture.clone()));
            }
        }
        let is_shown = |p: &&ExemplarPatch| shown.iter().any(|s| is_same(&s.picture, p));
        let new = exemplars.iter().find(|p| !is_shown(p))?;
        let is_taken = |n: &u8| shown.iter().any(|s| s.number == *n);
        let numbers =
            (0..ExemplarRequest::MAX_PICTURE).map(|i| (number_of(new) - 1 + i) % ExemplarRequest::MAX_PICTURE + 1);
        Some((numbers.into_iter().find(|n| !is_taken(n))?, new.clone()))
    }

    fn note_shown(&mut self, label: u8, number: u8, picture: ExemplarPatch) {
        self.seen.insert(label);
        let shown = self.shown.entry(label).or_default();
        shown.retain(|s| s.number != number);
        shown.push(Shown { number, picture });
        if shown.len() > MAX_SHOWN {
            shown.remove(0);
        }
    }

    /// The surface has all of an object.
    pub(super) fn handle_delivered(&mut self, id: ObjectId) {
        self.replies.iter_mut().filter(|a| a.object == Some(id)).for_each(|a| a.object = None);
        self.unrequested = self.unrequested.filter(|u| u.object != id);
    }

    /// A new run of the link: what is on its way is to be sent again, and the surface may have no picture any more.
    pub(super) fn handle_restart(&mut self, link: &mut VehicleLink) {
        let (met, open) = std::mem::take(&mut self.replies).into_iter().partition(|a| a.object.is_none());
        self.replies = met;
        for Reply { request, number, object } in open {
            self.withdraw(request.label, number, object, link);
        }
        if let Some(Unrequested { label, number, object }) = self.unrequested.take() {
            self.withdraw(label, number, Some(object), link);
        }
        self.seen.clear();
    }
}

/// A name for a picture that outlives a restart: of the place and time it was taken at.
fn number_of(picture: &ExemplarPatch) -> u8 {
    let bits =
        picture.t_s.to_bits() ^ picture.place.0.to_bits().rotate_left(21) ^ picture.place.1.to_bits().rotate_left(42);
    let mixed = (bits ^ bits >> 31).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32;
    (mixed % u64::from(ExemplarRequest::MAX_PICTURE)) as u8 + 1
}

fn is_same(a: &ExemplarPatch, b: &ExemplarPatch) -> bool {
    (a.t_s, a.place) == (b.t_s, b.place)
}

/// The object of a picture, as large as asked for and there is; `None` if it cannot be compressed.
fn fill(head: Exemplar, picture: u8, patch: &Arc<RgbImage>, size: u8) -> Option<Exemplar> {
    let (size, image) = middle(patch, size)?;
    let bytes = compress_to(&image, GOOD_SSIM, max_bytes(size))?.bytes;
    Some(Exemplar { size, picture, bytes, ..head })
}

//! The exemplars of the vehicle: those that it has, those that it has sent, and those that the surface requests.

use super::evidence::FrameClock;
use crate::SharedExemplars;
use crate::exemplar::{GOOD_SSIM, compress_to, middle, middle_size};
use scene_model::exemplars::ExemplarPatch;
use scenecast_protocol::directive::{ExemplarRequest, ExemplarRequests, Series};
use scenecast_protocol::exemplar::{Exemplar, ExemplarView, edge_px, max_bytes};
use scenecast_protocol::link::VehicleLink;
use scenecast_protocol::object::ObjectId;
use scenecast_protocol::schedule::BackgroundStream;
use scenecast_protocol::time::Instant;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

/// Sent exemplars of a label that are remembered.
const MAX_SHOWN: usize = 8;
/// Exemplars of a label that are sent without a request: fewer than are kept, so that a request finds another one.
const MAX_UNREQUESTED: usize = 3;
/// The size class of the largest exemplars.
const LARGEST: u8 = 3;

/// An exemplar that was sent to the surface.
#[derive(Debug)]
struct Shown {
    number: u8,
    size: u8,
    picture: ExemplarPatch,
}

/// The reply to a request.
#[derive(Debug)]
struct Reply {
    request: ExemplarRequest,
    /// The number of the exemplar; 0: there is none.
    number: u8,
    /// The object that carries it, while it is in flight.
    object: Option<ObjectId>,
}

/// An exemplar in flight that was not requested.
#[derive(Debug, Clone, Copy)]
struct Unrequested {
    label: u8,
    number: u8,
    object: ObjectId,
    /// The size class in which the surface has it already.
    had: Option<u8>,
}

/// An exemplar to be sent without a request.
struct Offer {
    label: u8,
    number: u8,
    picture: ExemplarPatch,
    size: u8,
    had: Option<u8>,
}

/// The exemplars of the labels of one epoch.
#[derive(Debug, Default)]
pub(super) struct Gallery {
    /// For each label, the best first.
    exemplars: SharedExemplars,
    requests: ExemplarRequests,
    /// The series of the requests.
    series: Option<Series>,
    replies: Vec<Reply>,
    /// For each label, the latest last.
    shown: BTreeMap<u8, Vec<Shown>>,
    /// Labels of which an exemplar was sent in this run of the link.
    seen: BTreeSet<u8>,
    unrequested: Option<Unrequested>,
    /// The times of camera frames.
    frames: FrameClock,
}

impl Gallery {
    pub(super) fn set_frames(&mut self, frames: FrameClock) {
        self.frames = frames;
    }

    /// Maximum number of requests at a time.
    pub(super) const MAX_REQUESTS: usize = 8;

    /// Replaces the exemplars of all labels, the best first.
    pub(super) fn set_exemplars(&mut self, exemplars: SharedExemplars) {
        self.exemplars = exemplars;
    }

    pub(super) fn exemplars(&self) -> &SharedExemplars {
        &self.exemplars
    }

    /// Replaces the requests by those of the surface's run `series`. Replies in flight that are no longer requested are
    /// cancelled, and an unrequested exemplar gives way.
    pub(super) fn replace_requests(
        &mut self,
        requests: ExemplarRequests,
        series: Option<Series>,
        link: &mut VehicleLink,
    ) {
        self.follow(series);
        let (kept, dropped) =
            std::mem::take(&mut self.replies).into_iter().partition(|a| requests.wanted.contains(&a.request));
        self.replies = kept;
        for Reply { request, number, object } in dropped {
            self.withdraw(request.label, number, object, link);
        }
        self.requests = requests;
        if self.has_open_request() {
            self.withdraw_unrequested(link);
        }
    }

    /// The surface of this series is heard; another one has no exemplar yet.
    fn follow(&mut self, series: Option<Series>) {
        if self.series.is_some() && series != self.series {
            self.shown.clear();
            self.seen.clear();
        }
        self.series = series;
    }

    fn withdraw_unrequested(&mut self, link: &mut VehicleLink) {
        let Some(Unrequested { label, number, object, had }) = self.unrequested.take() else { return };
        let mut shown = self.shown.get_mut(&label).into_iter().flatten();
        match (had, shown.find(|s| s.number == number)) {
            // The surface has the smaller one.
            (Some(size), Some(shown)) => {
                shown.size = size;
                link.cancel_object(object);
            }
            _ => self.withdraw(label, number, Some(object), link),
        }
    }

    /// Cancels an object in flight, and forgets that its exemplar was sent.
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

    /// Whether a request is open, so that its exemplar has not arrived yet.
    fn has_open_request(&self) -> bool {
        let is_met = |r: &ExemplarRequest| self.replies.iter().any(|a| a.request == *r && a.object.is_none());
        !self.requests.wanted.iter().all(is_met)
    }

    /// Sends the requested exemplars that exist. Without a request it sends one of a label of which the surface has none, the
    /// label with the greatest weight first; when it has one of each, larger and further ones.
    pub(super) fn serve(&mut self, epoch: u8, weight: impl Fn(u8) -> f64, link: &mut VehicleLink, now: Instant) {
        self.follow(link.persistent_state().series());
        for request in self.requests.wanted.clone() {
            self.reply(request, epoch, link, now);
        }
        if self.unrequested.is_none() && !self.has_open_request() && link.background().has(BackgroundStream::Exemplars)
        {
            self.show_unrequested(epoch, weight, link, now);
        }
    }

    fn reply(&mut self, request: ExemplarRequest, epoch: u8, link: &mut VehicleLink, now: Instant) {
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
        let head = head(epoch, request.label, request.serial);
        let exemplar =
            chosen.as_ref().and_then(|(n, p)| self.fill(head.clone(), *n, p, request.size, now)).unwrap_or(head);
        self.withdraw_unrequested(link);
        let Some(object) = link.push_object(exemplar.encode()) else { return };
        self.replies.push(Reply { request, number: exemplar.picture, object: Some(object) });
        if let Some((number, picture)) = chosen {
            self.note_shown(request.label, number, exemplar.size, picture);
        }
    }

    fn show_unrequested(&mut self, epoch: u8, weight: impl Fn(u8) -> f64, link: &mut VehicleLink, now: Instant) {
        let unseen = self.exemplars.keys().filter(|label| !self.seen.contains(label));
        let by_weight = |a: &u8, b: &u8| weight(*a).total_cmp(&weight(*b)).then(b.cmp(a));
        let first =
            unseen.copied().filter_map(|label| self.new_offer(label)).max_by(|a, b| by_weight(&a.label, &b.label));
        let is_further = first.is_none();
        let Some(Offer { label, number, picture, size, had }) = first.or_else(|| self.further_offer(by_weight)) else {
            return;
        };
        let Some(exemplar) = self.fill(head(epoch, label, 0), number, &picture, size, now) else { return };
        let bytes = exemplar.encode();
        let object = if is_further { link.push_last_object(bytes) } else { link.push_background_object(bytes) };
        let Some(object) = object else { return };
        self.note_shown(label, number, exemplar.size, picture);
        self.unrequested = Some(Unrequested { label, number, object, had });
    }

    /// The best exemplar of a label that was not sent.
    fn new_offer(&self, label: u8) -> Option<Offer> {
        let (number, picture) = self.choose(ExemplarRequest { label, ..ExemplarRequest::default() })?;
        Some(Offer { label, number, picture, size: 0, had: None })
    }

    /// The next exemplar of a label that has some: each is first sent small, then in its full size. The label that has got the
    /// least comes first.
    fn further_offer(&self, by_weight: impl Fn(&u8, &u8) -> Ordering) -> Option<Offer> {
        let steps = |label: &u8| {
            self.shown.get(label).into_iter().flatten().map(|s| 1 + usize::from(s.size > 0)).sum::<usize>()
        };
        let offer = |label: &u8| {
            let shown = self.shown.get(label).map_or(&[][..], Vec::as_slice);
            let current = self.exemplars.get(label).map_or(&[][..], Vec::as_slice);
            let larger = shown.iter().filter(|s| current.iter().any(|p| is_same(p, &s.picture))).find_map(|s| {
                let full = middle_size(&s.picture.patch, LARGEST).filter(|full| *full > s.size)?;
                let (picture, had) = (s.picture.clone(), Some(s.size));
                Some(Offer { label: *label, number: s.number, picture, size: full, had })
            });
            let is_new = shown.len() < MAX_UNREQUESTED;
            larger.or_else(|| self.new_offer(*label).filter(|_| is_new))
        };
        let labels = self.exemplars.keys().filter_map(|label| Some((steps(label), offer(label)?)));
        let order = |a: &(usize, Offer), b: &(usize, Offer)| a.0.cmp(&b.0).then(by_weight(&b.1.label, &a.1.label));
        labels.min_by(order).map(|(_, offer)| offer)
    }

    /// The object of an exemplar in at most the requested size class; `None` if it cannot be compressed.
    fn fill(&self, head: Exemplar, number: u8, picture: &ExemplarPatch, size: u8, now: Instant) -> Option<Exemplar> {
        let (size, image) = middle(&picture.patch, size)?;
        let bytes = compress_to(&image, GOOD_SSIM, max_bytes(size))?.bytes;
        let width_m = f64::from(edge_px(size)) * picture.pixel_m;
        let view = ExemplarView::new(width_m, picture.place, self.frames.taken(picture.t_s), now);
        Some(Exemplar { size, picture: number, view, bytes, ..head })
    }

    /// The exemplar that a request asks for: the named one while it is known, otherwise the best one that was not sent.
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

    fn note_shown(&mut self, label: u8, number: u8, size: u8, picture: ExemplarPatch) {
        self.seen.insert(label);
        let shown = self.shown.entry(label).or_default();
        shown.retain(|s| s.number != number);
        shown.push(Shown { number, size, picture });
        if shown.len() > MAX_SHOWN {
            shown.remove(0);
        }
    }

    /// The surface has an object completely.
    pub(super) fn handle_delivered(&mut self, id: ObjectId) {
        self.replies.iter_mut().filter(|a| a.object == Some(id)).for_each(|a| a.object = None);
        self.unrequested = self.unrequested.filter(|u| u.object != id);
    }

    /// A new run of the link has begun: objects in flight are cancelled. A surface of another series has no exemplar; one without
    /// a series may have lost them.
    pub(super) fn handle_restart(&mut self, link: &mut VehicleLink) {
        let (met, open) = std::mem::take(&mut self.replies).into_iter().partition(|a| a.object.is_none());
        self.replies = met;
        for Reply { request, number, object } in open {
            self.withdraw(request.label, number, object, link);
        }
        self.withdraw_unrequested(link);
        if self.series.is_none() {
            self.seen.clear();
        }
    }
}

/// The number of an exemplar, from 1. It depends on place and time of the frame only, so that it survives a restart.
fn number_of(picture: &ExemplarPatch) -> u8 {
    let bits =
        picture.t_s.to_bits() ^ picture.place.0.to_bits().rotate_left(21) ^ picture.place.1.to_bits().rotate_left(42);
    let mixed = (bits ^ bits >> 31).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32;
    (mixed % u64::from(ExemplarRequest::MAX_PICTURE)) as u8 + 1
}

fn is_same(a: &ExemplarPatch, b: &ExemplarPatch) -> bool {
    (a.t_s, a.place) == (b.t_s, b.place)
}

/// An exemplar of a label without an image, which answers a request with this serial number.
fn head(epoch: u8, label: u8, serial: u8) -> Exemplar {
    Exemplar { epoch, label, serial, size: 0, picture: 0, view: ExemplarView::default(), bytes: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::default_link as link;
    use image::{Rgb, RgbImage};

    fn patch(edge: u32, place: f64) -> ExemplarPatch {
        let image = RgbImage::from_fn(edge, edge, |x, y| Rgb([(x * 7 % 250) as u8, (y * 5 % 250) as u8, 90]));
        ExemplarPatch { patch: image.into(), score: 0.9, t_s: place, place: (place, 0.0), pixel_m: 0.01 }
    }

    /// Label, size class, and the size class that the surface had, of what is sent without requests.
    fn sent(gallery: &mut Gallery, link: &mut VehicleLink, most: usize) -> Vec<(u8, u8, Option<u8>)> {
        let mut sent = Vec::new();
        while sent.len() < most {
            gallery.serve(0, f64::from, link, Instant::ZERO);
            let Some(Unrequested { label, number, object, had }) = gallery.unrequested else { break };
            let shown = gallery.shown[&label].iter().find(|s| s.number == number).unwrap();
            sent.push((label, shown.size, had));
            gallery.handle_delivered(object);
        }
        sent
    }

    #[test]
    fn each_label_gets_an_image_before_any_gets_a_larger_one() {
        let (mut gallery, mut link) = (Gallery::default(), link());
        let all = (1..=4).map(|n| patch(128, f64::from(n))).collect();
        gallery.set_exemplars(SharedExemplars::new([(1, all), (2, vec![patch(64, 9.0)])].into()));
        let larger = [(1, 1, Some(0)), (1, 0, None), (1, 1, Some(0)), (1, 0, None), (1, 1, Some(0))];
        let expected = [&[(2, 0, None), (1, 0, None)][..], &larger].concat();
        assert_eq!(sent(&mut gallery, &mut link, 99), expected, "one is left for a request");
    }

    #[test]
    fn an_image_that_shows_another_label_by_now_is_not_enlarged() {
        let (mut gallery, mut link) = (Gallery::default(), link());
        gallery.set_exemplars(SharedExemplars::new([(1, vec![patch(128, 1.0)])].into()));
        assert_eq!(sent(&mut gallery, &mut link, 1), [(1, 0, None)]);
        gallery.set_exemplars(SharedExemplars::new([(1, vec![patch(128, 2.0)])].into()));
        assert_eq!(sent(&mut gallery, &mut link, 9), [(1, 0, None), (1, 1, Some(0))]);
        assert_eq!(gallery.shown[&1].iter().map(|s| s.size).collect::<Vec<_>>(), [0, 1]);
    }

    #[test]
    fn a_request_ends_a_larger_image_and_keeps_the_smaller_one() {
        let (mut gallery, mut link) = (Gallery::default(), link());
        gallery.set_exemplars(SharedExemplars::new([(1, vec![patch(128, 1.0)]), (2, vec![patch(64, 3.0)])].into()));
        assert_eq!(sent(&mut gallery, &mut link, 2).len(), 2);
        gallery.serve(0, f64::from, &mut link, Instant::ZERO);
        assert_eq!(gallery.unrequested.unwrap().had, Some(0));
        let wanted = vec![ExemplarRequest { label: 2, serial: 1, ..ExemplarRequest::default() }];
        gallery.replace_requests(ExemplarRequests { epoch: 0, wanted }, None, &mut link);
        assert!(gallery.unrequested.is_none());
        gallery.replace_requests(ExemplarRequests::default(), None, &mut link);
        assert_eq!(sent(&mut gallery, &mut link, 9), [(1, 1, Some(0))], "it is not sent small again");
    }
}

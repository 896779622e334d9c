//! The exemplars of a vehicle's labels that have arrived, and the requests for more.

use super::refusal::OrderRefusal;
use scenecast_protocol::directive::{ExemplarRequest, ExemplarRequests};
use scenecast_protocol::exemplar::{Exemplar, ExemplarView, edge_px};
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;

/// The kind of exemplar that the operator requests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RequestKind {
    /// The best one that has not arrived yet.
    Another,
    /// An exemplar that has arrived, with twice its edge: the one of this number, or the latest.
    Larger(Option<u8>),
}

/// The progress of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RequestState {
    /// The request was ordered. Its order status is that of the directive's slot.
    Ordered,
    /// The vehicle has no such exemplar yet and sends it later.
    NoneYet,
    /// Bytes received, of bytes in all.
    Arriving(usize, usize),
    Refused,
}

/// A request that has no exemplar yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OpenRequest {
    /// The request as it is sent.
    pub request: ExemplarRequest,
    pub state: RequestState,
    pub changed: Instant,
}

/// An exemplar that has arrived.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredExemplar {
    /// The number by which the vehicle knows it among those of the label.
    pub number: u8,
    /// The size class: an edge of 64 << `size` pixels.
    pub size: u8,
    pub webp: Vec<u8>,
    /// Bytes that the link carried for it.
    pub sent_bytes: usize,
    pub received: Instant,
    pub requested: bool,
    /// How wide it is on the sea floor, and where it was taken.
    pub view: ExemplarView,
    /// When it was taken; `None` where that is not known.
    pub taken: Option<Instant>,
}

impl StoredExemplar {
    /// How wide it is on the sea floor, metres; `None` where that is not known.
    pub fn width_m(&self) -> Option<f64> {
        (self.view.width_mm > 0).then(|| f64::from(self.view.width_mm) / 1000.0)
    }

    /// Its middle in the world frame, from which the vehicle's map lies `shift_m` away, metres.
    pub fn place_m(&self, shift_m: (f64, f64)) -> Option<(f64, f64)> {
        let (east_m, north_m) = self.view.middle_m();
        self.width_m().map(|_| (east_m + shift_m.0, north_m + shift_m.1))
    }
}

/// The exemplars of a label.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LabelExemplars {
    /// In the order of arrival.
    pub stored: Vec<StoredExemplar>,
    /// The open request, if there is one.
    pub request: Option<OpenRequest>,
    serial: u8,
}

/// The exemplars of a vehicle's labels in one epoch.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ExemplarCache {
    labels: BTreeMap<u8, LabelExemplars>,
}

impl ExemplarCache {
    /// Maximum number of open requests; a vehicle takes no more.
    const MAX_REQUESTS: usize = 8;
    /// Maximum number of exemplars of a label.
    const MAX_OF_LABEL: usize = 8;
    /// Maximum number of bytes. Beyond it the oldest exemplar is dropped.
    const MAX_BYTES: usize = 1 << 20;
    /// The largest size class that can be requested.
    pub const MAX_SIZE: u8 = 1;

    /// The exemplars of a label and its request.
    pub fn label(&self, label: u8) -> Option<&LabelExemplars> {
        self.labels.get(&label)
    }

    /// Labels that have an exemplar or a request.
    pub fn labels(&self) -> impl Iterator<Item = (u8, &LabelExemplars)> {
        self.labels.iter().map(|(&label, entry)| (label, entry))
    }

    /// Puts an exemplar back that an earlier run of the surface has received.
    pub(super) fn restore_image(&mut self, label: u8, exemplar: StoredExemplar) {
        self.labels.entry(label).or_default().stored.push(exemplar);
    }

    /// Puts a label's request back, and the serial number of its requests.
    pub(super) fn restore_request(&mut self, label: u8, serial: u8, open: Option<OpenRequest>) {
        let entry = self.labels.entry(label).or_default();
        (entry.serial, entry.request) = (serial, open);
    }

    /// Requests an exemplar of a label. It replaces the label's open request.
    pub fn request(&mut self, label: u8, kind: RequestKind, now: Instant) -> Result<(), OrderRefusal> {
        let others = self.labels.iter().filter(|(l, p)| **l != label && p.is_open()).count();
        if others >= Self::MAX_REQUESTS {
            return Err(OrderRefusal::ManyImages(others));
        }
        let mut request = ExemplarRequest { label, ..ExemplarRequest::default() };
        let entry = self.labels.get(&label);
        if let RequestKind::Larger(number) = kind {
            let picture = entry.and_then(|p| p.exemplar(number)).ok_or(match number {
                Some(number) => OrderRefusal::NoPicture { label, number },
                None => OrderRefusal::NoImage(label),
            })?;
            if picture.size >= Self::MAX_SIZE {
                let (number, edge_px) = (picture.number, edge_px(picture.size));
                return Err(OrderRefusal::FullSize { label, number, edge_px });
            }
            (request.picture, request.size) = (picture.number, picture.size + 1);
        }
        let entry = self.labels.entry(label).or_default();
        entry.serial = entry.serial % u8::MAX + 1;
        request.serial = entry.serial;
        entry.request = Some(OpenRequest { request, state: RequestState::Ordered, changed: now });
        Ok(())
    }

    /// Withdraws the request of a label.
    pub fn cancel(&mut self, label: u8) -> Result<(), OrderRefusal> {
        let asked = self.labels.get_mut(&label).and_then(|entry| entry.request.take());
        asked.map(drop).ok_or(OrderRefusal::NotAsked(label))
    }

    /// The open requests, as they are sent.
    pub fn wanted(&self, epoch: u8) -> ExemplarRequests {
        let open = self.labels.values().filter(|entry| entry.is_open());
        ExemplarRequests { epoch, wanted: open.filter_map(|entry| Some(entry.request?.request)).collect() }
    }

    /// The vehicle has refused the requests.
    pub fn handle_refusal(&mut self, now: Instant) {
        let asked = self.labels.values_mut().filter_map(|entry| entry.request.as_mut());
        asked
            .filter(|a| a.state == RequestState::Ordered)
            .for_each(|a| (a.state, a.changed) = (RequestState::Refused, now));
    }

    /// Part of an exemplar came in. `head` are its first bytes.
    pub fn handle_progress(&mut self, head: [u8; 4], (held, total): (usize, usize), now: Instant) {
        let [_, label, serial, _] = head;
        let asked = self.labels.get_mut(&label).and_then(|entry| entry.request.as_mut());
        if let Some(asked) = asked.filter(|a| a.request.serial == serial) {
            (asked.state, asked.changed) = (RequestState::Arriving(held, total), now);
        }
    }

    /// Takes a complete object, whose image was `taken` then. Returns whether the operator has something new to see.
    pub fn handle_exemplar(&mut self, exemplar: &Exemplar, taken: Option<Instant>, now: Instant) -> bool {
        let is_meant = |asked: &OpenRequest| asked.request.serial == exemplar.serial;
        let entry = self.labels.entry(exemplar.label).or_default();
        let asked = entry.request.is_some_and(|a| is_meant(&a));
        let Some(webp) = exemplar.webp() else {
            let none_yet = asked && exemplar.bytes.is_empty();
            if let Some(open) = entry.request.as_mut().filter(|_| none_yet) {
                (open.state, open.changed) = (RequestState::NoneYet, now);
            }
            return none_yet;
        };
        entry.request = entry.request.filter(|_| !asked);
        let Exemplar { picture: number, size, view, .. } = *exemplar;
        let sent_bytes = exemplar.encode().len();
        if entry.stored.iter().any(|p| p.number == number && p.size > size) {
            // A vehicle that was restarted does not know that the larger one is here.
            return asked;
        }
        let was_requested = entry.stored.iter().any(|p| p.number == number && p.requested);
        entry.stored.retain(|p| p.number != number);
        let (received, requested) = (now, asked || was_requested);
        entry.stored.push(StoredExemplar { number, size, webp, sent_bytes, received, requested, view, taken });
        if entry.stored.len() > Self::MAX_OF_LABEL {
            entry.stored.remove(0);
        }
        self.make_room();
        true
    }

    fn make_room(&mut self) {
        let bytes = |labels: &BTreeMap<u8, LabelExemplars>| {
            labels.values().flat_map(|p| &p.stored).map(|p| p.webp.len()).sum::<usize>()
        };
        while bytes(&self.labels) > Self::MAX_BYTES {
            let with_some = self.labels.values_mut().filter(|entry| !entry.stored.is_empty());
            let Some(entry) = with_some.min_by_key(|entry| entry.stored.first().map(|p| p.received)) else { return };
            entry.stored.remove(0);
        }
    }
}

impl LabelExemplars {
    /// The exemplar of a number, or the latest one.
    pub fn exemplar(&self, number: Option<u8>) -> Option<&StoredExemplar> {
        match number {
            Some(number) => self.stored.iter().find(|p| p.number == number),
            None => self.stored.last(),
        }
    }

    /// The serial number of the last request, and the open request.
    pub(super) fn open_request(&self) -> (u8, Option<OpenRequest>) {
        (self.serial, self.request)
    }

    fn is_open(&self) -> bool {
        self.request.is_some_and(|a| a.state != RequestState::Refused)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Instant = Instant::ZERO;

    fn come(label: u8, serial: u8, size: u8, picture: u8) -> Exemplar {
        Exemplar { epoch: 0, label, serial, size, picture, view: ExemplarView::default(), bytes: vec![0x10, 0, 0, 9] }
    }

    #[test]
    fn a_request_takes_its_own_reply_and_a_larger_image_replaces() {
        let mut cache = ExemplarCache::default();
        let refused = |asked: Result<(), OrderRefusal>| asked.unwrap_err().to_string();
        let none = cache.request(5, RequestKind::Larger(None), NOW);
        assert_eq!(refused(none), "no image of label 5 is here yet: ask for one first");
        cache.request(5, RequestKind::Another, NOW).unwrap();
        assert_eq!(
            cache.wanted(3),
            ExemplarRequests { epoch: 3, wanted: vec![ExemplarRequest { label: 5, serial: 1, size: 0, picture: 0 }] }
        );
        cache.handle_progress([3, 5, 1, 0x09], (60, 500), NOW);
        assert_eq!(cache.label(5).unwrap().request.unwrap().state, RequestState::Arriving(60, 500));
        assert!(cache.handle_exemplar(&come(5, 1, 0, 9), None, NOW));
        assert!(cache.wanted(3).wanted.is_empty());
        cache.request(5, RequestKind::Larger(None), NOW).unwrap();
        assert_eq!(cache.wanted(3).wanted, [ExemplarRequest { label: 5, serial: 2, size: 1, picture: 9 }]);
        assert!(cache.handle_exemplar(&come(5, 2, 1, 9), None, NOW));
        assert!(!cache.handle_exemplar(&come(5, 0, 0, 9), None, NOW), "the larger one stays");
        let sizes: Vec<(u8, u8)> = cache.label(5).unwrap().stored.iter().map(|p| (p.number, p.size)).collect();
        assert_eq!(sizes, [(9, 1)]);
        let full = cache.request(5, RequestKind::Larger(Some(9)), NOW);
        assert_eq!(refused(full), "picture 9 of label 5 has its full size already: 128 pixels");
        let missing = cache.request(5, RequestKind::Larger(Some(4)), NOW);
        assert_eq!(refused(missing), "picture 4 of label 5 is not here");
    }

    #[test]
    fn cancelled_and_refused_requests_end_and_images_stay() {
        let mut cache = ExemplarCache::default();
        assert!(cache.handle_exemplar(&come(5, 0, 0, 9), None, NOW), "nobody had to ask");
        assert!(!cache.label(5).unwrap().stored[0].requested);
        cache.request(5, RequestKind::Another, NOW).unwrap();
        cache.cancel(5).unwrap();
        assert!(cache.wanted(0).wanted.is_empty() && cache.label(5).unwrap().stored.len() == 1);
        assert_eq!(cache.cancel(5), Err(OrderRefusal::NotAsked(5)));
        cache.handle_progress([0, 5, 1, 0], (1, 2), NOW);
        assert_eq!(cache.label(5).unwrap().request, None, "a late part of what was cancelled");
        cache.request(6, RequestKind::Another, NOW).unwrap();
        cache.handle_refusal(NOW);
        assert!(cache.wanted(0).wanted.is_empty());
        cache.request(6, RequestKind::Another, NOW).unwrap();
        assert_eq!(cache.wanted(0).wanted[0].serial, 2);
    }

    #[test]
    fn a_request_without_an_image_stays_open() {
        let mut cache = ExemplarCache::default();
        cache.request(5, RequestKind::Another, NOW).unwrap();
        let none = Exemplar { bytes: Vec::new(), ..come(5, 1, 0, 0) };
        assert!(cache.handle_exemplar(&none, None, NOW));
        assert_eq!(cache.label(5).unwrap().request.unwrap().state, RequestState::NoneYet);
        assert_eq!(cache.wanted(0).wanted.len(), 1);
        assert!(!cache.handle_exemplar(&Exemplar { serial: 7, ..none }, None, NOW), "an answer to what was not asked");
    }

    #[test]
    fn requests_and_images_are_bounded() {
        let mut cache = ExemplarCache::default();
        (1..=8).for_each(|label| cache.request(label, RequestKind::Another, NOW).unwrap());
        assert_eq!(cache.request(9, RequestKind::Another, NOW), Err(OrderRefusal::ManyImages(8)));
        cache.request(8, RequestKind::Another, NOW).unwrap();
        let large = |label, picture| Exemplar {
            bytes: [vec![0x10, 0, 0], vec![9; 16_000]].concat(),
            ..come(label, 0, 0, picture)
        };
        for picture in 1..=20 {
            for label in 1..=20 {
                cache.handle_exemplar(&large(label, picture), None, Instant::from_secs_f64(f64::from(picture)));
            }
        }
        let kept: Vec<&StoredExemplar> = cache.labels().flat_map(|(_, entry)| &entry.stored).collect();
        assert!(kept.iter().map(|p| p.webp.len()).sum::<usize>() <= ExemplarCache::MAX_BYTES);
        assert!(kept.len() > 60 && kept.iter().all(|p| p.number > 15), "the newest are kept");
        assert!(cache.labels().all(|(_, entry)| entry.stored.len() <= ExemplarCache::MAX_OF_LABEL));
    }
}

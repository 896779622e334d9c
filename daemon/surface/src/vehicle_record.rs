//! The operator's data about one vehicle.

use super::annotations::AnnotationRefusal;
use super::annotations::Annotations;
use super::exemplar_cache::ExemplarCache;
use super::floor_views::FloorViews;
use super::given_orders::GivenOrders;
use super::label_book::LabelBook;
use super::map_changes::{Corrections, LabelGains};
use super::record::{EarlierMap, StoredLabel};
use super::track::{Pauses, RegistrationRecord, Track};
use scenecast_core::UsblLine;
use scenecast_protocol::directive::{ExemplarRequests, SlotId};
use scenecast_protocol::exemplar::Exemplar;
use scenecast_protocol::link::PeerView;
use scenecast_protocol::map::{ClassEntry, ClassReplica, LabelTree};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{ModeReason, VehicleMode, VehicleStatus};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// The map of an earlier run, or of an earlier run of the surface, which stays in view until the
/// current one has as many cells.
#[derive(Debug, Default)]
pub struct EarlierView {
    pub map: Option<Arc<EarlierMap>>,
    /// The operator does not need it any more.
    pub is_dismissed: bool,
    /// Added to the version of the current map, so that each map in view has another version.
    pub version_base: u64,
}

/// Facts from before the start of the surface, until the vehicle reports newer ones.
#[derive(Debug, Default)]
struct RestoredContact {
    status: Option<(VehicleStatus, Instant)>,
    last_received: Option<Instant>,
}

/// What the vehicle has reported of the labels of its run.
#[derive(Debug, Default)]
pub struct RunLabels {
    pub gains: LabelGains,
    /// The last tree of the labels of this epoch.
    pub tree: Option<LabelTree>,
    /// The names and colours that the vehicle has given its labels in this run.
    classes: BTreeMap<u8, ClassEntry>,
}

impl RunLabels {
    fn begin_run(&mut self) {
        self.gains = LabelGains::default();
        self.classes.clear();
    }
}

/// The last orders to a vehicle, and its last reports.
#[derive(Debug)]
pub struct VehicleRecord {
    pub name: String,
    pub orders: GivenOrders,
    pub exemplars: ExemplarCache,
    pub floor: FloorViews,
    /// Reported positions in the map frame.
    pub track: Track,
    /// How its camera frames were placed on the map.
    pub registration: RegistrationRecord,
    /// Counts the runs of the vehicle that this surface has met, from 1.
    pub run: u32,
    pub epoch: u8,
    pub labels: RunLabels,
    pub(crate) corrections: Corrections,
    pub earlier: EarlierView,
    /// The usual length of its silence.
    pub pauses: Pauses,
    /// The last measurement of the surface's modem, and its time.
    pub found: Option<(UsblLine, Instant)>,
    pub annotations: Annotations,
    restored: RestoredContact,
}

impl VehicleRecord {
    /// The mode of a vehicle with its reason, for people.
    pub fn mode_text(&self, status: &VehicleStatus, view: &PeerView<'_>) -> String {
        let is_ours = || view.slots().any(|order| order.id == SlotId::Constraints);
        let reason = match (status.mode, status.reason) {
            (VehicleMode::Hold, ModeReason::Survey) => Some(self.orders.end_of_survey()),
            (VehicleMode::Hold, ModeReason::Order) if !is_ours() => {
                Some("by an earlier order, by one of another surface, or because it has no record of its orders")
            }
            (_, reason) => reason.name(),
        };
        let mode = status.mode.name();
        reason.map_or_else(|| mode.to_owned(), |reason| format!("{mode}: {reason}"))
    }

    pub fn new(name: String) -> Self {
        Self {
            name,
            orders: GivenOrders::default(),
            exemplars: ExemplarCache::default(),
            floor: FloorViews::default(),
            track: Track::default(),
            registration: RegistrationRecord::default(),
            run: 1,
            epoch: 0,
            labels: RunLabels::default(),
            corrections: Corrections::default(),
            earlier: EarlierView::default(),
            pauses: Pauses::default(),
            found: None,
            annotations: Annotations::default(),
            restored: RestoredContact::default(),
        }
    }

    /// The vehicle has begun another run, with a map of its own.
    pub fn begin_run(&mut self) {
        self.run += 1;
        self.labels.begin_run();
    }

    /// The last status and when its pose came in, perhaps before the start of the surface.
    pub fn status<'a>(&'a self, view: &PeerView<'a>) -> Option<&'a (VehicleStatus, Instant)> {
        view.status().or(self.restored.status.as_ref())
    }

    /// When a frame was last accepted, perhaps before the start of the surface.
    pub fn last_received(&self, view: &PeerView<'_>) -> Option<Instant> {
        view.last_received().or(self.restored.last_received)
    }

    /// Puts facts from before the start of the surface back.
    pub fn restore_contact(
        &mut self,
        status: Option<(VehicleStatus, Instant)>,
        last_received: Option<Instant>,
        pause: Option<Duration>,
    ) {
        self.restored = RestoredContact { status, last_received };
        self.pauses = Pauses::restored(pause);
    }

    /// The earlier map that is in view in place of the current one.
    pub fn earlier_map(&self) -> Option<&EarlierMap> {
        self.earlier.map.as_deref()
    }

    /// The operator's name of a label of the map in view.
    pub fn label_name(&self, label: u8) -> Option<&str> {
        self.label_book(label)?.name.as_deref()
    }

    /// Name, colour and merging of a label of the map in view.
    pub fn label_book(&self, label: u8) -> Option<&StoredLabel> {
        self.labels_in_view().get(&label)
    }

    /// Names, colours and merges of the labels of the map in view.
    pub fn labels_in_view(&self) -> &LabelBook {
        let of_earlier = self.earlier_map().filter(|earlier| earlier.epoch != self.epoch).map(|e| &e.names);
        of_earlier.unwrap_or(&self.annotations.labels)
    }

    /// Takes the names and colours that the vehicle has given its labels.
    pub fn handle_names(&mut self, classes: &ClassReplica) {
        for entry in classes.iter().filter(|entry| !self.labels.classes.contains_key(&entry.label())) {
            self.annotations.label_by_default(entry);
        }
        self.labels.classes = classes.iter().map(|entry| (entry.label(), entry.clone())).collect();
    }

    /// The tree of the labels of the map in view, if one is known.
    pub fn tree_in_view(&self) -> Option<&LabelTree> {
        match self.earlier_map().filter(|earlier| earlier.epoch != self.epoch) {
            Some(earlier) => earlier.tree.as_ref(),
            None => self.labels.tree.as_ref(),
        }
    }

    /// The weight of a label: the one that was sent, or that of the nearest relative of a label that the vehicle assigned later.
    pub fn weight(&self, label: u8) -> f64 {
        self.orders
            .utility
            .weight(self.labels.tree.as_ref().map_or(label, |tree| tree.weighed_as(label, self.orders.weighed)))
    }

    /// Sets name, colour and merging of a label in the current epoch; without a name or a colour it has those that the
    /// vehicle gives it.
    pub fn set_label(&mut self, label: u8, book: StoredLabel) -> Result<(), AnnotationRefusal> {
        if self.earlier_map().is_some_and(|earlier| earlier.epoch != self.epoch) {
            return Err(AnnotationRefusal::EarlierMap);
        }
        self.annotations.set_label(label, book)?;
        self.labels.classes.get(&label).into_iter().for_each(|entry| self.annotations.label_by_default(entry));
        Ok(())
    }

    /// Takes the earlier map out of view, although the current one has fewer cells. The map stays in the archive.
    pub fn dismiss_earlier_map(&mut self) {
        self.earlier.is_dismissed = self.earlier.map.is_some();
    }

    /// Shows an earlier map in place of the current one, or the current one.
    pub fn show_earlier(&mut self, map: Option<Arc<EarlierMap>>) {
        self.earlier = EarlierView { map, is_dismissed: false, version_base: self.earlier.version_base + 1 };
    }

    /// A number that grows with each change of the map in view.
    pub fn map_version(&self, view: &PeerView<'_>) -> u64 {
        self.earlier.version_base + view.map_version()
    }

    /// Takes a status, of which the pose came in at `at`. A new epoch voids everything that refers to labels.
    pub fn handle_status(&mut self, status: &VehicleStatus, at: Instant) {
        self.restored = RestoredContact::default();
        if status.epoch != self.epoch {
            self.epoch = status.epoch;
            self.floor.follow(status.epoch);
            self.orders.begin_epoch(status.epoch);
            self.exemplars = ExemplarCache::default();
            self.annotations.handle_epoch();
            self.labels = RunLabels::default();
        }
        self.track.handle_pose(status, at);
        self.registration.handle_status(status, at);
    }

    /// Part of an exemplar came in. `head` are its first bytes, once they have arrived.
    pub fn handle_progress(&mut self, head: Option<&[u8]>, held: usize, total: usize, now: Instant) {
        let head = head.and_then(|h| h.first_chunk::<4>()).filter(|h| h[0] == self.epoch);
        head.into_iter().for_each(|head| self.exemplars.handle_progress(*head, (held, total), now));
    }

    /// Takes a complete exemplar. Returns whether the operator has something new to see.
    pub fn handle_exemplar(&mut self, exemplar: &Exemplar, taken: Option<Instant>, now: Instant) -> bool {
        exemplar.epoch == self.epoch && self.exemplars.handle_exemplar(exemplar, taken, now)
    }

    /// The open requests for exemplars.
    pub fn wanted(&self) -> ExemplarRequests {
        self.exemplars.wanted(self.epoch)
    }
}

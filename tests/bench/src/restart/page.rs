//! The operator's page of a run: what it shows, and the orders of its operator.

use scenecast_console::client::{Client, block_on};
use scenecast_core::{ClientName, UserError};
use scenecast_surface::state::{MissionState, OrderStatus, VehicleState};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time between two looks at the page.
const LOOK: Duration = Duration::from_millis(20);

/// The page of a surface.
pub(super) struct Page(Client);

/// The facts on the page that a restart must not take away.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shown {
    cells: u32,
    track: bool,
    /// The names of the labels, in their epoch.
    names: (u8, BTreeMap<u8, String>),
    notes: Vec<String>,
    /// Fence and limits as last ordered, and those in force.
    constraints: [Value; 4],
    /// Version and status of the latest order of each slot.
    orders: BTreeMap<String, (u16, OrderStatus)>,
    /// The exemplars, by label and number.
    images: BTreeMap<(u8, u8), Vec<u8>>,
}

/// The exemplars that the surface keeps of a label.
const MAX_IMAGES: usize = 8;

impl Shown {
    fn of(vehicle: &VehicleState, images: BTreeMap<(u8, u8), Vec<u8>>) -> Self {
        let orders = &vehicle.orders;
        let value = |order: Result<Value, serde_json::Error>| order.unwrap_or_default();
        Self {
            cells: vehicle.map.explored_cells,
            track: !vehicle.track.is_empty(),
            names: (
                vehicle.map.epoch,
                vehicle.labels.iter().filter_map(|l| Some((l.id, l.book.name.clone()?))).collect(),
            ),
            notes: vehicle.notes.iter().map(|note| note.text.clone()).collect(),
            constraints: [
                value(serde_json::to_value(&orders.fence)),
                value(serde_json::to_value(&orders.limits)),
                value(serde_json::to_value(&orders.fence_in_force)),
                value(serde_json::to_value(&orders.limits_in_force)),
            ],
            orders: orders.directive.slots.iter().map(|s| (s.slot.clone(), (s.version, s.state))).collect(),
            images,
        }
    }

    /// The first fact of `before` that is gone from this page.
    pub(super) fn lacks(&self, before: &Self) -> Option<String> {
        if self.cells < before.cells {
            return Some(format!("cells: {} instead of {}", self.cells, before.cells));
        }
        if before.track && !self.track {
            return Some("track".into());
        }
        // The labels on the map in view have names; a map that is back in view may have more of them.
        let is_named = |(label, name): (&u8, &String)| self.names.1.get(label) == Some(name);
        if self.names.0 == before.names.0 && !before.names.1.iter().all(is_named) {
            return Some(format!("names: {:?} instead of {:?}", self.names, before.names));
        }
        if self.notes != before.notes {
            return Some(format!("notes: {:?} instead of {:?}", self.notes, before.notes));
        }
        for (now, then) in self.constraints.iter().zip(&before.constraints) {
            if now.is_null() && !then.is_null() {
                return Some(format!("order: {then}"));
            }
        }
        if let Some((label, number)) = self.lost_image(before) {
            return Some(format!("image {number} of label {label}"));
        }
        let is_kept = |slot: &String, then: &(u16, OrderStatus)| {
            self.orders.get(slot).is_some_and(|now| now.0 > then.0 || now.0 == then.0 && is_not_before(now.1, then.1))
        };
        let gone = before.orders.iter().find(|(slot, then)| !is_kept(slot, then));
        gone.map(|(slot, then)| format!("order {slot}: {:?} instead of {then:?}", self.orders.get(slot)))
    }

    /// The first image of the same epoch that is gone or another, and was not replaced by newer ones of its label.
    fn lost_image(&self, before: &Self) -> Option<(u8, u8)> {
        let is_full = |label: u8| self.images.keys().filter(|(of, _)| *of == label).count() >= MAX_IMAGES;
        let is_kept = |at: &(u8, u8), image: &Vec<u8>| self.images.get(at) == Some(image) || is_full(at.0);
        let lost = before.images.iter().find(|(at, image)| !is_kept(at, image));
        lost.filter(|_| self.names.0 == before.names.0).map(|(at, _)| *at)
    }
}

/// An order that the vehicle has received is sent again after a restart of the vehicle.
fn is_not_before(now: OrderStatus, then: OrderStatus) -> bool {
    !now.is_pending() || then.is_pending()
}

impl Page {
    pub(super) fn new(port: u16) -> Result<Self, UserError> {
        Client::new(&format!("http://127.0.0.1:{port}"), None, ClientName::default()).map(Self)
    }

    /// The state of the only vehicle; `None` while nobody answers.
    pub(super) fn vehicle(&self) -> Option<VehicleState> {
        let mut vehicle = None;
        let read = block_on(async {
            let state: MissionState = self.0.read("/api/v2/state").await?;
            vehicle = state.vehicles.into_iter().next();
            Ok(())
        });
        read.ok().and(vehicle)
    }

    pub(super) fn shown(&self) -> Option<Shown> {
        let vehicle = self.vehicle()?;
        Some(Shown::of(&vehicle, self.images(&vehicle)))
    }

    /// The exemplars that the page shows and the surface serves.
    fn images(&self, vehicle: &VehicleState) -> BTreeMap<(u8, u8), Vec<u8>> {
        let mut images = BTreeMap::new();
        for (label, image) in vehicle.labels.iter().flat_map(|l| l.exemplar.images.iter().map(|image| (l.id, image))) {
            // An image that is not served is missing from the page.
            let _ = block_on(async {
                images.insert((label, image.number), self.0.read_bytes(&image.url).await?.to_vec());
                Ok(())
            });
        }
        images
    }

    /// The label of each cell of the map in view, as lines of east, north and label.
    pub(super) fn cells(&self) -> Result<Vec<String>, UserError> {
        let mut bytes = Vec::new();
        block_on(async {
            bytes = self.0.read_bytes("/api/v2/vehicles/1/map.csv").await?.to_vec();
            Ok(())
        })?;
        let text = String::from_utf8_lossy(&bytes);
        Ok(text.lines().map(|line| line.split(',').take(3).collect::<Vec<_>>().join(",")).collect())
    }

    /// Gives an order; it is durable once this returns.
    pub(super) fn order(&self, path: &str, order: &Value) -> Result<(), UserError> {
        block_on(self.0.send_order(&format!("/api/v2/vehicles/1/{path}"), order))
    }

    /// Orders limits whole, since a restarted surface may not know yet which ones the vehicle obeys.
    pub(super) fn limits(&self, depth_m: &Value) -> Result<(), UserError> {
        let limits = json!({
            "depth_m": depth_m, "altitude_m": null, "distance_m": null, "time_s": null, "silence_s": 3600, "on_silence": "hold",
            "on_breach": null, "on_abort": null
        });
        self.order("limits", &limits)
    }

    /// The orders and records of an operator at the beginning of a mission.
    pub(super) fn begin(&self) -> Result<(), UserError> {
        let label = self.vehicle().and_then(|v| v.labels.first().map(|l| l.id));
        // The whole fence, since a vehicle may have one of its own that the surface does not know yet.
        let fence = [[-500, -500], [500, -500], [500, 500], [-500, 500]];
        self.order("fence", &json!({"fence": fence, "keep_outs": null, "return_point": null}))?;
        self.limits(&Value::Null)?;
        self.order("notes", &json!({"text": "a wreck"}))?;
        match label {
            Some(label) => {
                self.order("labels", &json!({"label": label, "name": "sand"}))?;
                self.order("exemplars", &json!({"label": label}))
            }
            None => Ok(()),
        }
    }

    /// Waits until `is_so` holds for the state of the vehicle.
    pub(super) fn wait(
        &self,
        what: &str,
        limit: Duration,
        mut is_so: impl FnMut(&VehicleState) -> bool,
    ) -> Result<(), UserError> {
        let began = Instant::now();
        while !self.vehicle().is_some_and(|vehicle| is_so(&vehicle)) {
            if began.elapsed() > limit {
                return Err(UserError::Failed(format!("{what}: not within {limit:?}")));
            }
            sleep(LOOK);
        }
        Ok(())
    }
}

/// Whether the vehicle has decided about every order.
pub(super) fn is_decided(vehicle: &VehicleState) -> bool {
    let slots = &vehicle.orders.directive.slots;
    slots.iter().all(|s| !s.state.is_pending())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown() -> Shown {
        Shown {
            cells: 40,
            track: true,
            names: (2, BTreeMap::from([(3, "sand".to_owned())])),
            notes: vec!["a wreck".to_owned()],
            constraints: [json!([[0, 0]]), Value::Null, Value::Null, Value::Null],
            orders: BTreeMap::from([
                ("fence".to_owned(), (2, OrderStatus::Applied)),
                ("hold".to_owned(), (1, OrderStatus::Received)),
            ]),
            images: BTreeMap::from([((3, 1), vec![7]), ((3, 2), vec![8])]),
        }
    }

    #[test]
    fn a_page_that_shows_as_much_or_more_lacks_no_fact() {
        let before = shown();
        assert_eq!(before.lacks(&before), None);
        let mut more = shown();
        more.cells = 41;
        more.constraints[1] = json!({"silence_s": 60});
        more.orders.insert("hold".to_owned(), (1, OrderStatus::Queued));
        more.orders.insert("fence".to_owned(), (3, OrderStatus::Queued));
        assert_eq!(more.lacks(&before), None, "an order that was received is sent again after a restart");
        let mut renamed = shown();
        renamed.names = (3, BTreeMap::new());
        renamed.images.clear();
        assert_eq!(renamed.lacks(&before), None, "another epoch has other names and images");
        let mut replaced = shown();
        replaced.images = (2..10).map(|number| ((3, number), vec![number])).collect();
        assert_eq!(replaced.lacks(&before), None, "newer images have replaced the first");
    }

    /// Whether a page lacks this fact after a change.
    fn is_missed(named: &str, change: impl Fn(&mut Shown)) -> bool {
        let mut page = shown();
        change(&mut page);
        page.lacks(&shown()).is_some_and(|lacks| lacks.starts_with(named))
    }

    #[test]
    fn each_fact_that_a_page_lacks_is_named() {
        assert!(is_missed("cells: 39 instead of 40", |page| page.cells = 39));
        assert!(is_missed("track", |page| page.track = false));
        assert!(is_missed("names: ", |page| page.names.1.clear()));
        assert!(is_missed("notes: [] instead of [\"a wreck\"]", |page| page.notes.clear()));
        assert!(is_missed("order: [[0,0]]", |page| page.constraints[0] = Value::Null));
        assert!(is_missed("image 2 of label 3", |page| drop(page.images.remove(&(3, 2)))));
        assert!(is_missed("image 1 of label 3", |page| page.images.extend([((3, 1), vec![])])));
        assert!(is_missed("order hold: None", |page| page.orders.retain(|slot, _| slot != "hold")));
        let fence = |order| move |page: &mut Shown| page.orders.extend([("fence".to_owned(), order)]);
        assert!(is_missed("order fence: ", fence((1, OrderStatus::Applied))));
        assert!(is_missed("order fence: ", fence((2, OrderStatus::Received))));
    }
}

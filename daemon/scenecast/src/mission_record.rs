//! The records of both ends of a rehearsal in virtual time.

use scenecast_core::UserError;
use scenecast_files::{RecordEntry, RecordWriter};
use scenecast_protocol::time::Instant;
use scenecast_rehearsal::{EndEvent, Mission};
use scenecast_runtime::record::{IMAGES_INTERVAL_S, Stamps, SurfaceRecorder, VehicleRecorder, limits};
use scenecast_surface::{LinkMeter, MissionFacts, Snapshot, snapshot};
use std::path::Path;
use std::time::Duration;

/// The time of day at which missions in virtual time begin, so that the same seed gives the same record: 2000-01-01.
const BEGINS_NANOS: i64 = 946_684_800_000_000_000;

fn stamps(now: Instant) -> Stamps {
    let now_s = now.as_secs_f64();
    Stamps::new(now_s, 1.0, BEGINS_NANOS + (now_s * 1e9) as i64)
}

/// Records both ends of a mission.
pub struct MissionRecord {
    surface: (RecordWriter, SurfaceRecorder),
    vehicle: (RecordWriter, VehicleRecorder),
    /// Files begun so far: of the surface, of the vehicle.
    parts: [u32; 2],
    /// Mission time between two syncs, and of the last one.
    sync: (Duration, Instant),
}

impl MissionRecord {
    /// Begins both records in these new folders. After each `sync_interval` of mission time they are made durable.
    pub fn create(
        mission: &mut Mission,
        [surface, vehicle]: [&Path; 2],
        sync_interval: Duration,
    ) -> Result<Self, UserError> {
        let limits = limits(mission.config());
        mission.keep_end_events();
        let (config, seed) = (mission.settings(), Some(mission.seed()));
        Ok(Self {
            surface: (RecordWriter::create(surface, limits)?, SurfaceRecorder::new(&config, seed)),
            vehicle: (RecordWriter::create(vehicle, limits)?, VehicleRecorder::new(&config, seed)),
            parts: [1; 2],
            sync: (sync_interval, mission.now()),
        })
    }

    /// Records what has changed since the last call.
    pub fn observe(&mut self, mission: &mut Mission, snapshot: &Snapshot) -> Result<(), UserError> {
        for (at, event) in mission.take_end_events() {
            let stamps = stamps(at);
            match &event {
                EndEvent::Vehicle(event) => write(&mut self.vehicle.0, self.vehicle.1.handle_event(event, &stamps))?,
                EndEvent::Surface(event) => write(&mut self.surface.0, self.surface.1.frame(event, &stamps))?,
            }
        }
        let stamps = stamps(mission.now());
        let entries = self.surface.1.observe(self.parts[0], mission.surface(), snapshot, &stamps);
        write(&mut self.surface.0, entries)?;
        let entries = self.vehicle.1.observe(self.parts[1], mission.vehicle(), &stamps);
        write(&mut self.vehicle.0, entries)?;
        let images = self.vehicle.1.images(mission.images(), IMAGES_INTERVAL_S, &stamps);
        write(&mut self.vehicle.0, images)?;
        let (interval, synced) = &mut self.sync;
        if mission.now().since(*synced) >= *interval {
            *synced = mission.now();
            self.parts[0] += u32::from(self.surface.0.sync()?);
            self.parts[1] += u32::from(self.vehicle.0.sync()?);
        }
        Ok(())
    }

    /// Adds the last account of the images and the last state, and ends both records.
    pub fn finish(mut self, mission: &Mission) -> Result<(), UserError> {
        let images = self.vehicle.1.images(mission.images(), 0.0, &stamps(mission.now()));
        write(&mut self.vehicle.0, images)?;
        write(&mut self.surface.0, self.surface.1.last_state())?;
        self.surface.0.finish()?;
        self.vehicle.0.finish()
    }
}

fn write(writer: &mut RecordWriter, entries: impl IntoIterator<Item = RecordEntry>) -> Result<(), UserError> {
    entries.into_iter().try_for_each(|entry| writer.write(&entry))
}

/// The state that the page of a rehearsal without a page would show.
pub struct UnseenPage {
    facts: MissionFacts,
    meter: LinkMeter,
    counted: [u64; 2],
}

impl UnseenPage {
    pub fn new(mission: &Mission, id: u64) -> Self {
        let window = Duration::from_secs_f64(mission.config().link.budget_window_s);
        let facts = MissionFacts::new(mission.config(), mission.modem(), id, 1.0);
        Self { facts, meter: LinkMeter::new(window, mission.now()), counted: [0; 2] }
    }

    /// Counts the bits on air since the last call, and returns the state of the mission now.
    pub fn snapshot(&mut self, mission: &Mission) -> Snapshot {
        count(&mut self.meter, &mut self.counted, mission);
        self.meter.handle_budgets(mission.surface());
        self.facts.ended_s = mission.ended().map(Instant::as_secs_f64);
        self.facts.stamps = stamps(mission.now());
        snapshot(mission.surface(), &self.facts, &self.meter, mission.now())
    }
}

/// Counts the bits that the surface received and sent, beyond those that were counted.
pub fn count(meter: &mut LinkMeter, counted: &mut [u64; 2], mission: &Mission) {
    let now = mission.now();
    let totals = [mission.received_bits(), mission.audits()[1].total_bits()];
    if totals[0] > counted[0] {
        meter.received(totals[0] - counted[0], now);
    }
    if totals[1] > counted[1] {
        meter.sent(totals[1] - counted[1], now);
    }
    *counted = totals;
}

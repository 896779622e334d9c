//! Both ends of a link without their roles, in virtual time.

use crate::carrier::Carrier;
use crate::frames_log::FramesLog;
use crate::modem_rig::{SURFACE, VEHICLE};
use crate::virtual_time::VirtualTime;
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_host::LinkHost;
use scenecast_protocol::directive::SlotState;
use scenecast_protocol::link::{PeerView, SlotInboxState, SurfaceLink, VehicleEvent, VehicleLink};
use scenecast_protocol::map::{StateReplica, StateSource};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, VehicleStatus};
use sim_channel::NodePosition;
use std::collections::BTreeMap;
use std::time::Duration;

/// The configured ends, modems and channel, which replicate any state. The vehicle applies every order.
pub struct LinkRig<S: StateSource, R: StateReplica> {
    pub now: Instant,
    /// The acoustic address of the vehicle.
    pub address: Address,
    pub vehicle: LinkHost<VehicleLink<S>>,
    pub surface: LinkHost<SurfaceLink<R>>,
    /// The status that the vehicle reports.
    pub status: VehicleStatus,
    /// When the vehicle applied each version of an order.
    pub applied: BTreeMap<u16, Instant>,
    carrier: Carrier,
    /// When the last status was written that the surface has.
    status_at: Option<Instant>,
}

impl<S: StateSource, R: StateReplica> LinkRig<S, R> {
    /// Ends before their handshake, `channel.range_m` apart.
    pub fn new(config: &Config, source: S, seed: u64) -> Result<Self, UserError> {
        let now = Instant::ZERO;
        let (mut carrier, [at_vehicle, at_surface]) = Carrier::new(config, seed, now)?;
        carrier.place(VEHICLE, NodePosition::default());
        carrier.place(SURFACE, NodePosition::new(config.channel.range_m, 0.0, 0.0));
        let authenticity = scenecast_config::authenticity(config, Address::SURFACE)?;
        let vehicle = scenecast_vehicle::link_config(config, authenticity.clone(), *at_vehicle.profile())?;
        let surface = scenecast_surface::link_config(config, authenticity, *at_surface.profile())?;
        let address = vehicle.address;
        let vehicle = VehicleLink::with_source(vehicle, source, seed ^ 1, SlotInboxState::default(), now);
        let surface = SurfaceLink::new(surface, seed ^ 2, now);
        Ok(Self {
            now,
            address,
            vehicle: LinkHost::new(vehicle, at_vehicle),
            surface: LinkHost::new(surface, at_surface),
            status: VehicleStatus::default(),
            applied: BTreeMap::new(),
            carrier,
            status_at: None,
        })
    }

    /// The surface's view of the vehicle, which it may not know yet.
    pub fn view(&self) -> Option<PeerView<'_, R>> {
        self.surface.end().vehicle(self.address)
    }

    /// Age of the operator's status; 0 before the first.
    pub fn status_age_s(&self) -> f64 {
        self.status_at.map_or(0.0, |at| self.now.since(at).as_secs_f64())
    }

    /// Bits on air of vehicle and surface, repeats of the modems themselves included.
    pub fn bits_on_air(&self) -> [u64; 2] {
        let (vehicle, surface) = (&self.vehicle, &self.surface);
        [vehicle.audit().total_bits() + vehicle.repeated_bits(), surface.audit().total_bits() + surface.repeated_bits()]
    }

    /// Time that vehicle and surface have computed for frames in a bare channel.
    pub fn computed(&self) -> [Duration; 2] {
        self.carrier.computed
    }

    /// The log of the frames.
    pub fn frames(&self) -> &FramesLog {
        &self.carrier.log
    }

    fn apply_orders(&mut self) {
        let link = self.vehicle.end_mut();
        while let Some(event) = link.poll_event() {
            if let VehicleEvent::Slot { id, version, .. } = event {
                link.decide(id, SlotState::Applied, self.now);
                link.handle_persisted();
                self.applied.insert(version, self.now);
            }
        }
    }
}

impl<S: StateSource, R: StateReplica> VirtualTime for LinkRig<S, R> {
    fn now(&self) -> Instant {
        self.now
    }

    fn set_now(&mut self, now: Instant) {
        self.now = now;
    }

    fn next_event(&self) -> Instant {
        let hosts = [self.vehicle.poll_timeout(self.now), self.surface.poll_timeout(self.now)];
        let all = hosts.into_iter().chain([self.carrier.poll_timeout()]).flatten();
        all.min().unwrap_or(self.now + Duration::from_millis(200))
    }

    fn handle_events(&mut self) {
        self.carrier.deliver(&mut self.vehicle, &mut self.surface, self.now);
        while self.surface.end_mut().poll_event().is_some() {}
        let status = self.view().and_then(|view| view.status().map(|(_, at)| *at));
        self.status_at = status.or(self.status_at);
    }

    fn pump(&mut self) {
        self.apply_orders();
        if self.vehicle.end().wants_status(self.now) {
            self.vehicle.end_mut().set_status(self.status.clone());
        }
        self.carrier.write(SURFACE, || self.surface.poll_output(self.now), self.now);
        self.carrier.write(VEHICLE, || self.vehicle.poll_output(self.now), self.now);
        while let Some(event) = self.surface.poll_event() {
            self.carrier.log_event(SURFACE, &event, self.now);
        }
        while let Some(event) = self.vehicle.poll_event() {
            self.carrier.log_event(VEHICLE, &event, self.now);
        }
    }
}

//! What a vehicle may do: fence, limits, hold and abort.

use super::geojson::{self, Frame};
use super::{Ctl, figures};
use crate::orders::ConstraintsOrder;
use crate::state::{InForce, LifeLine, Slot, State, Vehicle};
use scenecast_core::UserError;
use scenecast_core::{LatLon, TangentPlane};
use scenecast_surface::{FenceOrder, LimitsOrder};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// What was sent last, how far it has come, and what is in force meanwhile.
#[derive(Debug, Serialize)]
struct Told<'a, T> {
    sent: &'a Option<T>,
    slot: Option<&'a Slot>,
    in_force: &'a Option<InForce<T>>,
}

impl Ctl {
    /// Prints the fence that was sent last, and the one in force.
    pub async fn fence(&self) -> Result<(), UserError> {
        let state = self.state().await?;
        let v = self.choose(&state)?;
        let told = Told { sent: &v.fence, slot: slot(v, "fence"), in_force: &v.fence_in_force };
        self.tell(&told, || told.text(state.now_s, fence_text))
    }

    /// Sends the fence, keep-outs and return point of a GeoJSON file in place of the last.
    pub async fn set_fence(&self, file: &Path, metres: bool) -> Result<(), UserError> {
        let state = self.state().await?;
        let v = self.choose(&state)?;
        let frame = if metres { Frame::Metres } else { frame(&state) };
        self.order(v, "fence", &geojson::read_fence(file, frame)?).await
    }

    /// Sends that there is no fence, no keep-out and no return point.
    pub async fn clear_fence(&self) -> Result<(), UserError> {
        let state = self.state().await?;
        self.order(self.choose(&state)?, "fence", &FenceOrder::default()).await
    }

    /// Moves the return point, in metres of the world, or takes it away; fence and keep-outs stay as sent last.
    pub async fn set_return_point(&self, at: Option<[f64; 2]>) -> Result<(), UserError> {
        let state = self.state().await?;
        let v = self.choose(&state)?;
        let order = FenceOrder { return_point: at, ..v.fence.clone().unwrap_or_default() };
        order.read().map_err(UserError::Input)?;
        self.order(v, "fence", &order).await
    }

    /// Prints the limits that were sent last, and those in force.
    pub async fn limits(&self) -> Result<(), UserError> {
        let state = self.state().await?;
        let v = self.choose(&state)?;
        let told = Told { sent: &v.limits, slot: slot(v, "limits"), in_force: &v.limits_in_force };
        self.tell(&told, || told.text(state.now_s, limits_text))
    }

    /// Sends limits in place of the last; with `keep` those that are not named stay as they were sent last.
    pub async fn set_limits(&self, named: LimitsOrder, keep: bool) -> Result<(), UserError> {
        let state = self.state().await?;
        let v = self.choose(&state)?;
        let before = v.limits.clone().filter(|_| keep).unwrap_or_default();
        let order = LimitsOrder {
            depth_m: named.depth_m.or(before.depth_m),
            altitude_m: named.altitude_m.or(before.altitude_m),
            distance_m: named.distance_m.or(before.distance_m),
            time_s: named.time_s.or(before.time_s),
            silence_s: named.silence_s.or(before.silence_s),
            on_silence: named.on_silence.or(before.on_silence),
            on_breach: named.on_breach.or(before.on_breach),
            on_abort: named.on_abort.or(before.on_abort),
        };
        order.read().map_err(UserError::Input)?;
        self.order(v, "limits", &order).await
    }

    /// Tells the vehicle to stay, to abort, or to go on.
    pub async fn constrain(&self, order: ConstraintsOrder) -> Result<(), UserError> {
        let state = self.state().await?;
        self.order(self.choose(&state)?, "constraints", &order).await
    }

    async fn order(&self, vehicle: &Vehicle, what: &str, order: &impl Serialize) -> Result<(), UserError> {
        let accepted = self.client.post(&format!("/api/v1/vehicles/{}/{what}", vehicle.id), order).await?;
        self.follow(accepted).await
    }
}

/// Longitude and latitude where the mission is on the Earth, as in the files that `ctl map` writes.
fn frame(state: &State) -> Frame {
    let origin = state.mission.origin.and_then(|o| LatLon::new(o.lat_deg, o.lon_deg));
    origin.map_or(Frame::Metres, |origin| Frame::Wgs84(TangentPlane::new(origin)))
}

fn slot<'a>(vehicle: &'a Vehicle, name: &str) -> Option<&'a Slot> {
    vehicle.directive.slots.iter().find(|s| s.slot == name)
}

impl<T: PartialEq> Told<'_, T> {
    fn text(&self, now_s: f64, text: fn(&T) -> String) -> String {
        let Some((sent, slot)) = self.sent.as_ref().zip(self.slot) else {
            return "nothing was sent since the surface started; the vehicle keeps what it has\n".to_owned();
        };
        let age = figures::span(now_s - slot.changed_s);
        let mut out = format!("{}, {age} ago\n{}", figures::slot(slot), text(sent));
        if slot.state != LifeLine::Applied {
            match self.in_force {
                Some(f) => out += &format!("in force: version {}\n{}", f.version, text(&f.order)),
                None => out += "in force: not known here\n",
            }
        }
        out
    }
}

fn fence_text(order: &FenceOrder) -> String {
    let corner = |[x, y]: &[f64; 2]| format!(" E {x:.1} N {y:.1}");
    let outline = |points: &[[f64; 2]]| points.iter().map(corner).collect::<Vec<_>>().join(",");
    let mut out = order.fence.as_ref().map_or("  no fence\n".to_owned(), |f| format!("  fence       {}\n", outline(f)));
    for keep_out in &order.keep_outs {
        let _ = writeln!(out, "  keep-out    {}", outline(keep_out));
    }
    if let Some(at) = &order.return_point {
        let _ = writeln!(out, "  return point{}", corner(at));
    }
    out
}

fn limits_text(order: &LimitsOrder) -> String {
    let mut out = String::new();
    let mut line = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            let _ = writeln!(out, "  {name:<11} {value}");
        }
    };
    let band = |b: Option<[f64; 2]>| b.map(|[low, high]| format!("{low:.1} to {high:.1} m"));
    line("depth", band(order.depth_m));
    line("altitude", band(order.altitude_m));
    line("distance", order.distance_m.map(|m| format!("{m:.0} m")));
    line("time", order.time_s.map(figures::span));
    line("silence", order.silence_s.map(figures::span));
    for (name, reaction) in
        [("on silence", &order.on_silence), ("on breach", &order.on_breach), ("on abort", &order.on_abort)]
    {
        line(name, reaction.clone());
    }
    if out.is_empty() { "  no limits\n".to_owned() } else { out }
}

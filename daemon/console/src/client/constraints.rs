//! Fence, limits, hold and abort.

use super::session::{Session, follow};
use super::text;
use scenecast_core::{LatLon, TangentPlane, UserError};
use scenecast_files::{CoordinateFrame, FenceShapes, read_fence};
use scenecast_surface::state::{AppliedOrder, MissionState, OrderProgress, OrderStatus, VehicleState};
use scenecast_surface::{AgainOrder, ConstraintsOrder, FenceOrder, LimitsOrder, RestoreOrder, TakeOverOrder};
use serde::Serialize;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// The last order sent, its progress, and the order in force.
#[derive(Debug, Serialize)]
pub(super) struct OrderView<'a, T> {
    pub(super) sent: &'a Option<T>,
    pub(super) slot: Option<&'a OrderProgress>,
    pub(super) in_force: &'a Option<AppliedOrder<T>>,
}

/// Prints the last fence sent and the one in force.
pub async fn show_fence(session: &Session) -> Result<(), UserError> {
    let state = session.state().await?;
    let v = session.choose(&state)?;
    let view = OrderView { sent: &v.orders.fence, slot: slot(v, "fence"), in_force: &v.orders.fence_in_force };
    session.print(&view, || view.text(state.now_s, fence_text))
}

/// How to read a file of outlines.
#[derive(Debug, Clone, Copy)]
pub struct FenceFile<'a> {
    pub path: &'a Path,
    /// The coordinates are metres east and north of the origin.
    pub in_metres: bool,
    /// A file without a fence is accepted: it removes the present one.
    pub without_fence: bool,
    /// A file without keep-outs removes the present ones.
    pub without_keep_outs: bool,
}

/// Sends the fence, the keep-outs and the return point of a GeoJSON file. What the file does not have stays.
pub async fn set_fence(session: &Session, file: FenceFile<'_>) -> Result<(), UserError> {
    let state = session.state().await?;
    let v = session.choose(&state)?;
    let frame = if file.in_metres { CoordinateFrame::Metres } else { degrees(&state)? };
    let FenceShapes { fence, keep_outs, return_point } = read_fence(file.path, frame)?;
    let order = FenceOrder { fence, keep_outs, return_point };
    if order.fence.is_none() && !file.without_fence {
        let line = "it has no fence, and an order replaces the present one; --without-fence removes it on purpose";
        return Err(UserError::file(file.path, line));
    }
    let is_named = |name: &str, _: &Value| match name {
        "keep_outs" => !order.keep_outs.is_empty() || file.without_keep_outs,
        "return_point" => order.return_point.is_some(),
        _ => true,
    };
    send(session, v, "fence", &named(&order, is_named)).await
}

/// The members of an order that are to be named.
fn named(order: &impl Serialize, is_named: impl Fn(&str, &Value) -> bool) -> Value {
    let mut members = json!(order);
    if let Some(members) = members.as_object_mut() {
        members.retain(|name, value| is_named(name, value));
    }
    members
}

/// Removes the fence, the keep-outs and the return point.
pub async fn clear_fence(session: &Session) -> Result<(), UserError> {
    let state = session.state().await?;
    send(session, session.choose(&state)?, "fence", &FenceOrder::default()).await
}

/// Moves the return point, in metres in the world frame, or removes it. Fence and keep-outs stay.
pub async fn set_return_point(session: &Session, at: Option<[f64; 2]>) -> Result<(), UserError> {
    FenceOrder { return_point: at, ..FenceOrder::default() }.read().map_err(UserError::input)?;
    let state = session.state().await?;
    send(session, session.choose(&state)?, "fence", &json!({ "return_point": at })).await
}

/// Prints the last limits sent and those in force.
pub async fn show_limits(session: &Session) -> Result<(), UserError> {
    let state = session.state().await?;
    let v = session.choose(&state)?;
    let view = OrderView { sent: &v.orders.limits, slot: slot(v, "limits"), in_force: &v.orders.limits_in_force };
    session.print(&view, || view.text(state.now_s, limits_text))
}

/// Sends limits. Those that are not given stay.
pub async fn set_limits(session: &Session, given: &LimitsOrder) -> Result<(), UserError> {
    given.read().map_err(UserError::input)?;
    let state = session.state().await?;
    send(session, session.choose(&state)?, "limits", &named(given, |_, value| !value.is_null())).await
}

/// The names of limits and reactions for people, and the members of their order. `all` stands for all of them.
pub const LIMITS: [(&str, &str); 9] = [
    ("depth", "depth_m"),
    ("altitude", "altitude_m"),
    ("distance", "distance_m"),
    ("time", "time_s"),
    ("silence", "silence_s"),
    ("on-silence", "on_silence"),
    ("on-breach", "on_breach"),
    ("on-abort", "on_abort"),
    ("all", ""),
];

/// Removes limits and reactions by their names in [`LIMITS`].
pub async fn clear_limits(session: &Session, names: &[String]) -> Result<(), UserError> {
    let is_named = |member: &str| {
        let is_it = |(name, of): &(&str, &str)| names.iter().any(|n| n == name) && (*of == member || *name == "all");
        LIMITS.iter().any(is_it)
    };
    let state = session.state().await?;
    let removed = named(&LimitsOrder::default(), |member, _| is_named(member));
    send(session, session.choose(&state)?, "limits", &removed).await
}

/// Orders the vehicle to hold, to abort, or to resume its survey.
pub async fn send_constraints(session: &Session, order: ConstraintsOrder) -> Result<(), UserError> {
    let state = session.state().await?;
    send(session, session.choose(&state)?, "constraints", &order).await
}

/// Gives a withdrawn order again.
pub async fn give_again(session: &Session, slot: String) -> Result<(), UserError> {
    let state = session.state().await?;
    send(session, session.choose(&state)?, "orders/again", &AgainOrder { slot }).await
}

/// Sends the orders again that the vehicle has lost.
pub async fn restore_orders(session: &Session) -> Result<(), UserError> {
    ask_surface(session, "orders/restore", &RestoreOrder {}).await
}

/// Takes the vehicle over from another surface.
pub async fn take_over(session: &Session) -> Result<(), UserError> {
    ask_surface(session, "take-over", &TakeOverOrder {}).await
}

/// Has the surface do something with the vehicle at once, which no version follows.
pub(super) async fn ask_surface(session: &Session, resource: &str, order: &impl Serialize) -> Result<(), UserError> {
    let state = session.state().await?;
    ask_of(session, session.choose(&state)?, resource, order).await
}

/// The same with a vehicle that is known.
pub(super) async fn ask_of(
    session: &Session,
    vehicle: &VehicleState,
    resource: &str,
    order: &impl Serialize,
) -> Result<(), UserError> {
    session.client.send_order(&format!("/api/v2/vehicles/{}/{resource}", vehicle.id), order).await
}

pub(super) async fn send(
    session: &Session,
    vehicle: &VehicleState,
    resource: &str,
    order: &impl Serialize,
) -> Result<(), UserError> {
    let accepted = session.client.post(&format!("/api/v2/vehicles/{}/{resource}", vehicle.id), order).await?;
    follow(session, accepted).await
}

/// Longitude and latitude if the mission has an origin, as in the files of `ctl map`.
/// Degrees can be read only around the mission's origin.
pub(super) fn degrees(state: &MissionState) -> Result<CoordinateFrame, UserError> {
    let origin = state.mission.origin.and_then(|o| LatLon::new(o.lat_deg, o.lon_deg));
    let origin = origin.ok_or(UserError::Input(
        "the mission has no origin (mission.origin_deg), so degrees cannot be read; --metres reads metres east and north"
            .to_owned(),
    ))?;
    Ok(CoordinateFrame::Wgs84(TangentPlane::new(origin)))
}

pub(super) fn slot<'a>(vehicle: &'a VehicleState, name: &str) -> Option<&'a OrderProgress> {
    vehicle.orders.directive.slots.iter().find(|s| s.slot == name)
}

impl<T: PartialEq> OrderView<'_, T> {
    pub(super) fn text(&self, now_s: f64, describe: fn(&T) -> String) -> String {
        let Some((sent, slot)) = self.sent.as_ref().zip(self.slot) else {
            return "none sent since the surface started; the vehicle keeps those that it has\n".to_owned();
        };
        let age = text::span(now_s - slot.changed_s);
        let mut out = format!("{}, {age} ago\n{}", text::order(slot), describe(sent));
        if slot.state != OrderStatus::Applied {
            match self.in_force {
                Some(f) => out += &format!("in force: version {}\n{}", f.version, describe(&f.order)),
                None => out += "in force: unknown to this surface\n",
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
    line("time", order.time_s.map(text::span));
    line("silence", order.silence_s.map(text::span));
    for (name, reaction) in
        [("on silence", &order.on_silence), ("on breach", &order.on_breach), ("on abort", &order.on_abort)]
    {
        line(name, reaction.clone());
    }
    if out.is_empty() { "  no limits\n".to_owned() } else { out }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_member_of_the_limits_has_a_name() {
        let order = json!(LimitsOrder::default());
        let members: Vec<&String> = order.as_object().unwrap().keys().collect();
        assert_eq!(members.len(), LIMITS.len() - 1);
        assert!(members.into_iter().all(|member| LIMITS.iter().any(|(_, of)| of == member)));
    }
}

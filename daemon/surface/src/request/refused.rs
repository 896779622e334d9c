//! Orders that the surface refuses itself.

use super::Reply;
use crate::{CommandRefusal, LogEntry, LogKind, Role, Surface};
use scenecast_protocol::link::OtherSurface;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use std::time::Duration;

/// The log has at most so many refusals of a principal in [`LOG_SPAN`].
const MAX_LOGGED: usize = 10;
const LOG_SPAN: Duration = Duration::from_secs(10);

/// Why a principal of a role may not take a vehicle over from its holder, one line.
pub(super) fn why_not_taken_over(holder: &OtherSurface, role: Role, now: Instant) -> Option<String> {
    let is_allowed = holder.is_silent(now) || role == Role::Administrator;
    (!is_allowed).then(|| {
        let (name, idle) = (holder.name, now.since(holder.heard).as_secs());
        format!(
            "the surface {:?} holds the vehicle and was heard {idle} s ago: an administrator may take it over, or an operator \
             after 120 s without a sign of that surface",
            name.as_str()
        )
    })
}

pub(super) fn refused(refusal: &CommandRefusal) -> Reply {
    let line = refusal.to_string();
    match refusal {
        CommandRefusal::Role { .. } => Reply::Forbidden(line),
        CommandRefusal::Held { .. } | CommandRefusal::Elsewhere { .. } => Reply::NotInCommand(line),
        _ => Reply::Refused(line),
    }
}

/// Why a reply refuses an order; `None` if it does not.
pub(super) fn why(reply: &Reply) -> Option<&str> {
    match reply {
        Reply::Forbidden(why) | Reply::NotInCommand(why) | Reply::Refused(why) => Some(why),
        Reply::NotFound => Some("there is no such vehicle"),
        _ => None,
    }
}

/// Logs that an order was refused, unless many of the principal just were.
pub(super) fn log(surface: &mut Surface, vehicle: Option<Address>, by: &str, text: &str, now: Instant) {
    if !are_many(surface.log().entries().rev(), by, now) {
        surface.log_action(vehicle, LogKind::Refused, by, text, now);
    }
}

fn are_many<'a>(newest_first: impl Iterator<Item = &'a LogEntry>, by: &str, now: Instant) -> bool {
    let recent = newest_first.take_while(|entry| now.since(entry.at) < LOG_SPAN);
    recent.filter(|entry| entry.kind == LogKind::Refused && entry.by.as_deref() == Some(by)).count() >= MAX_LOGGED
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::directive::Series;
    use scenecast_protocol::wire::SurfaceName;

    #[test]
    fn only_an_administrator_takes_over_from_a_surface_still_heard() {
        let now = Instant::from_secs_f64(1000.0);
        let refused = |role, idle_s| {
            let heard = now - Duration::from_secs(idle_s);
            let holder = OtherSurface { series: Series::from_random(1), name: SurfaceName::from_text("ship"), heard };
            why_not_taken_over(&holder, role, now)
        };
        let reason = refused(Role::Operator, 119).unwrap();
        assert!(reason.contains("\"ship\"") && reason.contains("119 s ago"), "{reason}");
        assert_eq!(refused(Role::Operator, 120), None);
        assert_eq!(refused(Role::Administrator, 0), None);
    }

    #[test]
    fn refusals_of_one_principal_do_not_fill_the_log() {
        let mut entries: Vec<LogEntry> = Vec::new();
        let mut logged = |seconds: std::ops::Range<u32>, by: &str| {
            for at in seconds.map(|second| Instant::from_secs_f64(f64::from(second) / 10.0)) {
                if !are_many(entries.iter().rev(), by, at) {
                    let (kind, by, text) = (LogKind::Refused, Some(by.to_owned()), "hold: not sent".to_owned());
                    entries.push(LogEntry { number: 0, at, vehicle: None, kind, by, text });
                }
            }
            entries.iter().filter(|entry| entry.by.as_deref() == Some(by)).count()
        };
        assert_eq!(logged(0..90, "victor"), MAX_LOGGED);
        assert_eq!(logged(90..91, "bob"), 1);
        assert_eq!(logged(91..300, "victor"), 3 * MAX_LOGGED);
    }
}

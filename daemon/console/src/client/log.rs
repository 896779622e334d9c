//! The log of the mission, as lines or as a table in a file.

use super::session::Session;
use super::text::span;
use crate::state::{LogLine, LogList};
use scenecast_core::UserError;
use std::path::Path;

/// The wanted entries of the log.
#[derive(Debug, Clone, Default)]
pub struct LogSelection {
    /// order, answer, contact, mode, label, image, record or command.
    pub kind: Option<String>,
    /// Only entries with a higher number.
    pub since: Option<u64>,
}

impl LogSelection {
    fn query(&self, vehicle: Option<u8>) -> String {
        let vehicle = vehicle.map(|id| format!("vehicle={id}"));
        let kind = self.kind.as_ref().map(|kind| format!("kind={kind}"));
        let since = self.since.map(|number| format!("since={number}"));
        let members: Vec<String> = [vehicle, kind, since].into_iter().flatten().collect();
        if members.is_empty() { String::new() } else { format!("?{}", members.join("&")) }
    }
}

/// Prints the entries of the log, the oldest first.
pub async fn show_log(session: &Session, selection: &LogSelection) -> Result<(), UserError> {
    let (bytes, _) = session.client.get(&format!("/api/v2/log{}", selection.query(session.vehicle))).await?;
    let log: LogList = serde_json::from_slice(&bytes).map_err(|e| session.client.unreadable(&e))?;
    session.print(&log, || match log.entries.is_empty() {
        true => "no entry\n".to_owned(),
        false => log.entries.iter().map(|entry| line(entry) + "\n").collect(),
    })
}

/// Writes the entries of the log to a file, as a table for a spreadsheet.
pub async fn save_log(session: &Session, selection: &LogSelection, out: &Path) -> Result<(), UserError> {
    let (bytes, _) = session.client.get(&format!("/api/v2/log.csv{}", selection.query(session.vehicle))).await?;
    std::fs::write(out, bytes).map_err(|e| UserError::file(out, e))
}

fn line(entry: &LogLine) -> String {
    let vehicle = entry.vehicle.map_or(String::new(), |id| format!("vehicle {id}: "));
    let by = entry.by.as_ref().map_or(String::new(), |by| format!(" (by {by})"));
    let LogLine { number, at_s, utc, kind, text, .. } = entry;
    format!("{number:>5}  {utc}  {:>10}  {kind:<8} {vehicle}{text}{by}", span(*at_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_number_times_kind_vehicle_text_and_author() {
        let entry = LogLine {
            number: 7,
            at_s: 65.0,
            utc: "2026-11-23T10:00:00Z".to_owned(),
            vehicle: Some(2),
            kind: "order".to_owned(),
            by: Some("anna".to_owned()),
            text: "hold".to_owned(),
        };
        assert_eq!(line(&entry), "    7  2026-11-23T10:00:00Z  1 min 05 s  order    vehicle 2: hold (by anna)");
    }

    #[test]
    fn the_query_has_what_was_selected() {
        assert_eq!(LogSelection::default().query(None), "");
        let selection = LogSelection { kind: Some("order".to_owned()), since: Some(7) };
        assert_eq!(selection.query(Some(2)), "?vehicle=2&kind=order&since=7");
    }
}

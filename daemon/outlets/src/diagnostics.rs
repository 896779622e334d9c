//! The state of the parts as `diagnostic_msgs/msg/DiagnosticArray`.

use scenecast_messages::Byte;
use scenecast_messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use scenecast_messages::std_msgs::Header;

/// The state of one part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Health {
    /// `DiagnosticStatus::OK`, `WARN`, `ERROR` or `STALE`.
    pub level: u8,
    /// The part, such as `link`.
    pub part: &'static str,
    /// The state of the part, in one line for people.
    pub message: String,
    pub values: Vec<(&'static str, String)>,
}

/// The states of the parts of a vehicle.
pub fn diagnostics(parts: impl IntoIterator<Item = Health>, vehicle: &str, header: Header) -> DiagnosticArray {
    let status = |Health { level, part, message, values }: Health| DiagnosticStatus {
        level: Byte(level),
        name: format!("scenecast/{vehicle}: {part}"),
        message,
        hardware_id: vehicle.to_owned(),
        values: values.into_iter().map(|(key, value)| KeyValue { key: key.to_owned(), value }).collect(),
    };
    DiagnosticArray { header, status: parts.into_iter().map(status).collect() }
}

//! The lines of the process's log, as messages of `/rosout` for its record.

use super::{RecordEntry, Stamps, unix_nanos};
use scenecast_messages::builtin_interfaces::Time;
use scenecast_messages::rcl_interfaces::Log;
use std::collections::VecDeque;
use std::fmt::{Debug, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::layer::Context;

/// Lines that wait for the record; without one, the oldest leave.
const MAX_WAITING: usize = 1000;
/// The longest text of a line, bytes.
const MAX_TEXT: usize = 2000;

static WAITING: Mutex<VecDeque<Log>> = Mutex::new(VecDeque::new());

fn waiting() -> MutexGuard<'static, VecDeque<Log>> {
    WAITING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Keeps each line of a level from INFO on for the record.
pub(crate) struct LogLines;

impl<S: Subscriber> Layer<S> for LogLines {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let level = match *event.metadata().level() {
            Level::ERROR => Log::ERROR,
            Level::WARN => Log::WARN,
            Level::INFO => Log::INFO,
            _ => return,
        };
        let mut text = LineText::default();
        event.record(&mut text);
        let name = event.metadata().target().to_owned();
        let log = Log { stamp: Time::from_nanos(unix_nanos()), level, name, msg: text.0, ..Log::default() };
        let mut waiting = waiting();
        waiting.push_back(log);
        if waiting.len() > MAX_WAITING {
            waiting.pop_front();
        }
    }
}

/// The message of a line, then its other fields.
#[derive(Default)]
struct LineText(String);

impl Visit for LineText {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if self.0.len() > MAX_TEXT {
            return;
        }
        // A write into a String does not fail.
        _ = match field.name() {
            "message" => write!(self.0, "{value:?}"),
            name => write!(self.0, " {name}={value:?}"),
        };
    }
}

/// The lines since the last call.
pub(super) fn log_entries(stamps: &Stamps) -> Vec<RecordEntry> {
    let nanos = stamps.now().nanos().max(0) as u64;
    waiting().drain(..).map(|line| RecordEntry::new("/rosout".to_owned(), nanos, &line)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tracing_subscriber::layer::SubscriberExt;

    #[test]
    fn lines_from_info_on_are_kept_with_their_level_and_fields() {
        let subscriber = tracing_subscriber::registry().with(LogLines);
        tracing::subscriber::with_default(subscriber, || {
            tracing::debug!("unwanted");
            tracing::warn!(frames = 3, "the modem is {}", "silent");
        });
        let entries = log_entries(&Stamps::new(0.0, 1.0, 5));
        let lines = entries.iter().map(|entry| scenecast_messages::decode::<Log>(&entry.data).unwrap());
        let lines: Vec<_> = lines.filter(|line| line.name.ends_with("record::log::tests")).collect();
        assert_eq!(
            lines.iter().map(|line| (line.level, line.msg.as_str())).collect::<Vec<_>>(),
            [(Log::WARN, "the modem is silent frames=3")]
        );
    }
}

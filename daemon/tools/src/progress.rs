//! What commands print: progress of long work on the standard error output, and figures as lines for people or as JSON.

use clap::ValueEnum;
use indicatif::{FormattedDuration, ProgressBar, ProgressState, ProgressStyle};
use scenecast_core::{UserError, errln, out, outln};
use serde::Serialize;
use serde_json::Value;
use std::io::IsTerminal;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The form in which the commands of this process show their progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum ProgressForm {
    /// A bar, where the standard error output is a terminal
    #[default]
    Auto,
    /// A line of JSON each second
    Json,
    /// No progress
    None,
}

static FORM: OnceLock<ProgressForm> = OnceLock::new();

impl ProgressForm {
    /// Chooses the form for this process; the first choice holds.
    pub fn choose(self) {
        let _ = FORM.set(self);
    }
}

/// The progress of one task.
pub struct Progress(Shown);

enum Shown {
    Bar(ProgressBar),
    Lines(Lines),
    Hidden,
}

/// Steps of a bar from empty to full.
const STEPS: u64 = 1000;
/// The task, the bar, the share of the work, the time since the start and the time that is left.
const TEMPLATE: &str = "{prefix} {wide_bar} {percent:>3} %  {elapsed_precise} gone{left}";

impl Progress {
    /// Shows that `task` begins, in the form that this process chose.
    pub fn new(task: &'static str) -> Self {
        Self(match FORM.get().copied().unwrap_or_default() {
            ProgressForm::Auto => Shown::Bar(bar(task)),
            ProgressForm::Json => Shown::Lines(Lines::new(task)),
            ProgressForm::None => Shown::Hidden,
        })
    }

    /// Shows a share of the work, 0..=1.
    pub fn show(&mut self, share: f64) {
        let share = share.clamp(0.0, 1.0);
        match &self.0 {
            Shown::Bar(bar) => bar.set_position((share * STEPS as f64) as u64),
            Shown::Lines(lines) => lines.show(share),
            Shown::Hidden => {}
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Shown::Bar(bar) = &self.0 {
            bar.abandon();
        }
    }
}

/// A bar; it is hidden where the standard error output is no terminal.
fn bar(task: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template(TEMPLATE).unwrap_or_else(|_| ProgressStyle::default_bar());
    let style = style.with_key("left", |state: &ProgressState, out: &mut dyn std::fmt::Write| {
        // Before the first step nothing is known; a text that cannot be written is left out.
        if state.pos() > 0 {
            let _ = write!(out, ", {} left", FormattedDuration(state.eta()));
        }
    });
    let bar = ProgressBar::new(STEPS).with_style(style.progress_chars("=> ")).with_prefix(task);
    bar.enable_steady_tick(Duration::from_secs(1));
    bar
}

/// A line of JSON each second, from a thread of its own, and one at the end.
struct Lines {
    share: Arc<Mutex<f64>>,
    /// Ends the thread when it is dropped.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Lines {
    fn new(task: &'static str) -> Self {
        let share = Arc::new(Mutex::new(0.0));
        let (end, ended) = channel();
        let (shared, began) = (share.clone(), Instant::now());
        let thread = std::thread::spawn(move || {
            loop {
                let is_over = ended.recv_timeout(Duration::from_secs(1)) != Err(RecvTimeoutError::Timeout);
                let share = *shared.lock().unwrap_or_else(PoisonError::into_inner);
                errln!("{}", line(task, share, began.elapsed()));
                if is_over {
                    return;
                }
            }
        });
        Self { share, end: Some(end), thread: Some(thread) }
    }

    fn show(&self, share: f64) {
        *self.share.lock().unwrap_or_else(PoisonError::into_inner) = share;
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        drop(self.end.take());
        // A thread that has panicked has nothing to show.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// One line: the task, the share of the work, and the seconds that are gone and left; `null` while they are not known.
fn line(task: &str, share: f64, gone: Duration) -> String {
    let gone_s = gone.as_secs_f64();
    let left_s = (share > 0.0).then(|| tenths(gone_s * (1.0 - share) / share));
    let share = (share * 1e4).round() / 1e4;
    serde_json::json!({ "task": task, "share": share, "gone_s": tenths(gone_s), "left_s": left_s }).to_string()
}

fn tenths(seconds: f64) -> f64 {
    (seconds * 10.0).round() / 10.0
}

/// Prints figures: lines at a terminal, one line of JSON in a pipe or a file, or with `json` anywhere.
pub fn print_figures(figures: &impl Serialize, json: bool) -> Result<(), UserError> {
    let as_json = json || !std::io::stdout().is_terminal();
    if as_json {
        // A struct keeps the order of its members only if it is written at once.
        outln!("{}", serde_json::to_string(figures).map_err(UserError::failed)?);
    } else {
        out!("{}", lines(&serde_json::to_value(figures).map_err(UserError::failed)?));
    }
    Ok(())
}

/// One line for each member with its name in words.
fn lines(figures: &Value) -> String {
    let members: Vec<(String, String)> = match figures.as_object() {
        Some(object) => object.iter().map(|(name, value)| (name.replace('_', " "), text(value))).collect(),
        None => vec![(String::new(), text(figures))],
    };
    let width = members.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    members.iter().map(|(name, value)| format!("{name:<width$}  {value}\n")).collect()
}

fn text(value: &Value) -> String {
    match value {
        Value::Null => "not known".to_owned(),
        Value::String(text) => text.clone(),
        Value::Number(number) if number.is_f64() => format!("{:.4}", number.as_f64().unwrap_or_default()),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_the_share_and_the_seconds_that_are_left() {
        let value: serde_json::Value = serde_json::from_str(&line("frames", 0.25, Duration::from_secs(10))).unwrap();
        assert_eq!(value, serde_json::json!({ "task": "frames", "share": 0.25, "gone_s": 10.0, "left_s": 30.0 }));
        let value: serde_json::Value = serde_json::from_str(&line("frames", 0.0, Duration::from_secs(2))).unwrap();
        assert_eq!(value["left_s"], serde_json::Value::Null);
    }

    #[test]
    fn people_read_one_line_for_each_figure() {
        let figures =
            serde_json::json!({ "bytes": 70, "png_full_bytes": 1200, "nats": 0.5, "codec": "ours", "score": null });
        let expected = "bytes           70\ncodec           ours\nnats            0.5000\npng full bytes  1200\nscore           not known\n";
        assert_eq!(lines(&figures), expected);
    }
}

//! A source on a thread of its own, which opens it again when it is lost; the pixels of an image and the time at which it came
//! in.

use image::RgbImage;
use scenecast_sensors::{BitDepth, Calibration, CameraFault, DecodeError, DepthMessage, SensorPose, Stamp, decode};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use tokio::sync::mpsc;

/// A camera that is lost or cannot be opened, as one line for people.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SourceError(pub String);

/// An image of a source.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceImage {
    /// The time at which the image was taken, if the source knows it.
    pub stamp: Option<Stamp>,
    /// The time at which the image came in.
    pub arrival: Stamp,
    pub picture: Picture,
    /// The calibration that its source gives.
    pub calibration: Option<Arc<Calibration>>,
}

/// The distances that a source has measured at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceDepth {
    /// The time at which they were measured, if the source knows it.
    pub stamp: Option<Stamp>,
    /// The time at which they came in.
    pub arrival: Stamp,
    pub message: DepthMessage,
}

/// A measurement of a sensor.
#[derive(Debug, Clone, PartialEq)]
pub enum Reading {
    Image(SourceImage),
    /// The pose of the vehicle at a time.
    Pose(Stamp, SensorPose),
    Depth(SourceDepth),
}

/// The sensor that a source is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorKind {
    Camera,
    /// It measures the distances of the camera's pixels.
    Depth,
    /// It measures the pose of the vehicle.
    Navigation,
}

impl SensorKind {
    fn lost(self) -> CameraFault {
        match self {
            Self::Camera => CameraFault::SourceLost,
            Self::Depth => CameraFault::DepthLost,
            Self::Navigation => CameraFault::PosesLost,
        }
    }

    /// Reports that wait for the vehicle at most: each of a camera may be an image of many megabytes.
    fn max_reports(self) -> usize {
        match self {
            Self::Camera | Self::Depth => 8,
            Self::Navigation => 512,
        }
    }

    fn stalled(self) -> CameraFault {
        match self {
            Self::Camera => CameraFault::Stalled,
            Self::Depth => CameraFault::DepthStalled,
            Self::Navigation => CameraFault::PosesStalled,
        }
    }
}

/// A live sensor, which is opened again when it is lost.
pub trait SensorSource: Send + 'static {
    fn kind(&self) -> SensorKind;

    /// Opens the sensor, again if it was open.
    fn open(&mut self) -> Result<(), SourceError>;

    /// Waits for the next reading, at most for `timeout`; `None` if there is none until then. Readings that cannot be used are
    /// passed to `fault` with one line for people.
    fn next(
        &mut self,
        timeout: Duration,
        fault: &mut dyn FnMut(CameraFault, String),
    ) -> Result<Option<Reading>, SourceError>;

    /// Whether a sensor that has stalled is opened again.
    fn is_reopened_after_stall(&self) -> bool;

    /// Closes the sensor, as far as there is something to close.
    fn close(&mut self) {}
}

/// A report of a source to the vehicle.
#[derive(Debug, Clone, PartialEq)]
pub enum SourceReport {
    /// The source is open, at first or again.
    Open,
    Reading(Reading),
    /// Something that a person should read, counted by its kind.
    Fault(CameraFault, String),
}

/// Longest wait for an image before the stop flag is looked at.
const POLL: Duration = Duration::from_millis(200);

/// First and longest time before a lost source is opened again.
const BACK_OFF: (Duration, Duration) = (Duration::from_millis(250), Duration::from_secs(4));

/// A source that stayed open for this long is opened again at once when it is lost.
const HEALTHY: Duration = Duration::from_secs(10);

/// A source that runs on a thread of its own.
pub struct LiveSource {
    reports: mpsc::Receiver<SourceReport>,
    is_stopped: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl LiveSource {
    /// Starts the thread of a source. Without a reading for `stall`, the source counts as stalled.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub fn start(source: impl SensorSource, stall: Duration) -> std::io::Result<Self> {
        let (sender, reports) = mpsc::channel(source.kind().max_reports());
        let is_stopped = Arc::new(AtomicBool::new(false));
        let outlet = Outlet { reports: sender, is_stopped: is_stopped.clone(), waiting: BTreeMap::new() };
        let mut supervisor = Supervisor { source, stall, outlet };
        let thread = std::thread::Builder::new().name("sensor".to_owned()).spawn(move || supervisor.run())?;
        Ok(Self { reports, is_stopped, thread: Some(thread) })
    }

    /// The next report; never returns after the end of the source's thread. Cancel-safe.
    pub async fn next(&mut self) -> SourceReport {
        match self.reports.recv().await {
            Some(report) => report,
            None => std::future::pending().await,
        }
    }
}

impl LiveSource {
    /// The next report of a source; without one it never returns. Cancel-safe.
    pub async fn next_of(source: &mut Option<Self>) -> SourceReport {
        match source {
            Some(source) => source.next().await,
            None => std::future::pending().await,
        }
    }
}

impl Drop for LiveSource {
    fn drop(&mut self) {
        self.is_stopped.store(true, Ordering::Relaxed);
        self.reports.close();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

struct Supervisor<S> {
    source: S,
    stall: Duration,
    outlet: Outlet,
}

/// Hands reports to the vehicle, and never waits for it.
struct Outlet {
    reports: mpsc::Sender<SourceReport>,
    is_stopped: Arc<AtomicBool>,
    /// Faults for which the channel had no room yet, with their numbers and their last texts.
    waiting: BTreeMap<CameraFault, (u64, String)>,
}

impl Outlet {
    fn is_stopped(&self) -> bool {
        self.is_stopped.load(Ordering::Relaxed)
    }

    /// Passes a report on. A fault without room waits; an image is dropped, and counted as overtaken.
    fn report(&mut self, report: SourceReport) {
        self.report_waiting();
        match self.reports.try_send(report) {
            Ok(()) => {}
            Err(mpsc::error::TrySendError::Closed(_)) => self.is_stopped.store(true, Ordering::Relaxed),
            Err(mpsc::error::TrySendError::Full(SourceReport::Reading(Reading::Image(_)))) => {
                self.wait_with(CameraFault::Overtaken, "the vehicle was busy".to_owned());
            }
            Err(mpsc::error::TrySendError::Full(SourceReport::Fault(fault, text))) => self.wait_with(fault, text),
            Err(mpsc::error::TrySendError::Full(_)) => {}
        }
    }

    fn wait_with(&mut self, fault: CameraFault, text: String) {
        let waiting = self.waiting.entry(fault).or_default();
        *waiting = (waiting.0 + 1, text);
    }

    fn report_waiting(&mut self) {
        while let Some(mut entry) = self.waiting.first_entry() {
            let (fault, (_, text)) = (*entry.key(), entry.get().clone());
            if self.reports.try_send(SourceReport::Fault(fault, text)).is_err() {
                return;
            }
            entry.get_mut().0 -= 1;
            if entry.get().0 == 0 {
                entry.remove();
            }
        }
    }
}

impl<S: SensorSource> Supervisor<S> {
    fn run(&mut self) {
        let mut back_off = BACK_OFF.0;
        let mut last_error = None;
        while !self.outlet.is_stopped() {
            let opened = Instant::now();
            let error = match self.source.open() {
                Ok(()) => {
                    last_error = None;
                    self.outlet.report(SourceReport::Open);
                    self.forward()
                }
                Err(error) => Some(error),
            };
            let Some(error) = error else { break };
            if opened.elapsed() >= HEALTHY {
                back_off = BACK_OFF.0;
            }
            // A camera that stays away is named once.
            if last_error.as_ref() != Some(&error) {
                self.outlet.report(SourceReport::Fault(self.source.kind().lost(), error.0.clone()));
                last_error = Some(error);
            }
            self.wait(back_off);
            back_off = (back_off * 2).min(BACK_OFF.1);
        }
        self.source.close();
    }

    /// Passes images on until the source is lost, which is returned, or the vehicle stops.
    fn forward(&mut self) -> Option<SourceError> {
        let (mut last, mut is_stalled) = (Instant::now(), false);
        while !self.outlet.is_stopped() {
            let (outlet, mut has_fault) = (&mut self.outlet, false);
            let mut fault = |fault, text| {
                has_fault = true;
                outlet.report(SourceReport::Fault(fault, text));
            };
            let reading = self.source.next(POLL, &mut fault);
            if has_fault {
                // A sensor whose readings cannot be used is not silent.
                (last, is_stalled) = (Instant::now(), false);
            }
            match reading {
                Ok(Some(reading)) => {
                    (last, is_stalled) = (Instant::now(), false);
                    self.outlet.report(SourceReport::Reading(reading));
                }
                Ok(None) if last.elapsed() >= self.stall && !is_stalled => {
                    is_stalled = true;
                    let text = format!("silent for {:.0} s", last.elapsed().as_secs_f64());
                    self.outlet.report(SourceReport::Fault(self.source.kind().stalled(), text.clone()));
                    if self.source.is_reopened_after_stall() {
                        return Some(SourceError(format!("{text}: it is started again")));
                    }
                }
                Ok(None) => {}
                Err(error) => return Some(error),
            }
        }
        None
    }

    fn wait(&self, time: Duration) {
        let until = Instant::now() + time;
        while !self.outlet.is_stopped() && Instant::now() < until {
            std::thread::sleep(POLL.min(until.saturating_duration_since(Instant::now())));
        }
    }
}

impl SourceImage {
    /// An image of a stream or a file: without a `stamp`, its own one counts, if it has one.
    pub(crate) fn compressed(stamp: Option<Stamp>, arrival: Stamp, bytes: Vec<u8>) -> Self {
        let stamp = stamp.or_else(|| scenecast_sensors::own_stamp(&bytes));
        Self { stamp, arrival, picture: Picture::Compressed(bytes), calibration: None }
    }
}

/// Wall time at the start of the process plus the time since then, so that it never goes back.
#[derive(Debug, Clone, Copy)]
pub struct ArrivalClock {
    start: Stamp,
    began: Instant,
}

impl ArrivalClock {
    /// A clock that shows the wall time now.
    pub fn start() -> Self {
        let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { start: Stamp::from_nanos(0).after(since_epoch), began: Instant::now() }
    }

    pub fn now(&self) -> Stamp {
        self.start.after(self.began.elapsed())
    }

    /// The moment at which the clock shows `stamp`.
    pub fn instant(&self, stamp: Stamp) -> Instant {
        self.began + std::time::Duration::from_secs_f64(stamp.seconds_since(self.start).clamp(0.0, 1e9))
    }
}

/// An image that is decoded where it is mapped, so that a slow decoder does not hold up its source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Picture {
    /// A JPEG, PNG, PPM or TIFF.
    Compressed(Vec<u8>),
    Rgb(RgbImage),
}

impl Picture {
    /// The image with 8 bits a channel; `bits` are those of the levels of a compressed image with 16.
    pub fn into_rgb(self, bits: BitDepth) -> Result<RgbImage, DecodeError> {
        match self {
            Self::Compressed(bytes) => decode(&bytes, bits),
            Self::Rgb(image) => Ok(image),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sensor that does these things in turn, and then says nothing more.
    struct Scripted(std::vec::IntoIter<Step>);

    enum Step {
        Refuse,
        Open,
        Image,
        Lose,
        /// Silence until the source counts as stalled.
        Stall,
    }

    impl SensorSource for Scripted {
        fn kind(&self) -> SensorKind {
            SensorKind::Camera
        }

        fn open(&mut self) -> Result<(), SourceError> {
            match self.0.next() {
                Some(Step::Refuse) => Err(SourceError("no lens".to_owned())),
                _ => Ok(()),
            }
        }

        fn next(
            &mut self,
            _: Duration,
            _: &mut dyn FnMut(CameraFault, String),
        ) -> Result<Option<Reading>, SourceError> {
            match self.0.as_slice().first() {
                Some(Step::Stall) => {
                    std::thread::yield_now();
                    return Ok(None);
                }
                None => {
                    std::thread::park_timeout(POLL);
                    return Ok(None);
                }
                Some(_) => {}
            }
            match self.0.next() {
                Some(Step::Lose) => Err(SourceError("unplugged".to_owned())),
                _ => {
                    let picture = Picture::Compressed(vec![1]);
                    Ok(Some(Reading::Image(SourceImage {
                        stamp: None,
                        arrival: Stamp::default(),
                        picture,
                        calibration: None,
                    })))
                }
            }
        }

        fn is_reopened_after_stall(&self) -> bool {
            true
        }
    }

    /// The names of the first reports of a sensor.
    fn reports(steps: Vec<Step>, stall: Duration, count: usize) -> Vec<String> {
        let mut source = LiveSource::start(Scripted(steps.into_iter()), stall).unwrap();
        let next = || source.reports.blocking_recv().unwrap();
        let name = |report| match report {
            SourceReport::Open => "open".to_owned(),
            SourceReport::Reading(_) => "image".to_owned(),
            SourceReport::Fault(fault, _) => fault.name().to_owned(),
        };
        std::iter::repeat_with(next).take(count).map(name).collect()
    }

    #[test]
    fn a_lost_camera_is_reopened_and_a_missing_one_named_once() {
        let steps = vec![Step::Open, Step::Image, Step::Lose, Step::Refuse, Step::Refuse, Step::Open, Step::Image];
        let names = ["open", "image", "source lost", "source lost", "open", "image"];
        assert_eq!(reports(steps, Duration::from_secs(60), 6), names);
    }

    #[test]
    fn a_stalled_camera_is_named_and_opened_again() {
        let steps = vec![Step::Open, Step::Image, Step::Stall];
        let names = ["open", "image", "camera stalled", "source lost", "open"];
        assert_eq!(reports(steps, Duration::from_millis(20), 5), names);
    }
}

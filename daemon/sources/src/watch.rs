//! A folder into which a camera's program writes its images.

use crate::ArrivalClock;
use crate::live::{Reading, SensorKind, SensorSource, SourceError, SourceImage};
use scenecast_sensors::{CameraFault, MAX_IMAGE_BYTES, Stamp, StampForm, complete_length, is_known_image};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs::DirEntry;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Time between two looks into the folder.
const LOOK: Duration = Duration::from_millis(50);

/// Time between two readings of a folder whose own time of change says nothing new.
const READ: Duration = Duration::from_millis(500);

/// Most complete files that are taken in one look; of more, the last ones.
const MAX_FILES: usize = 8;

/// A file that has not grown for this long is not completed any more.
const ABANDONED: Duration = Duration::from_secs(5);

/// A TIFF, which does not show its own end, is complete when it has not grown for this long.
const SETTLED: Duration = Duration::from_millis(300);

/// Files that were written this long before the folder is opened are live; older ones are not mapped.
const LIVE: Duration = Duration::from_secs(2);

/// A time of an image that is later than this computer's by more is named.
const AHEAD: Duration = Duration::from_secs(600);

/// Images of a folder, each as soon as it is complete. A name that is a number or a date is the time of its image, as in
/// `1305031102.175304.png` (seconds), `1403636579763555584.png` (nanoseconds) and `20261126T185000.250.png` (UTC).
pub struct WatchSource {
    dir: PathBuf,
    clock: ArrivalClock,
    files: BTreeMap<PathBuf, FileState>,
    /// Time of change of the folder when it was last read.
    changed: Option<SystemTime>,
    /// When it was last read.
    read: Option<Instant>,
    ready: VecDeque<SourceImage>,
    told: ToldNames,
}

/// What people were told of the names.
#[derive(Debug, Clone, Default)]
struct ToldNames {
    /// The forms of the times in names so far; `None` for a name without one.
    forms: BTreeSet<Option<StampForm>>,
    is_ahead_told: bool,
    /// Endings of files that are not read.
    endings: BTreeSet<String>,
    is_folder_told: bool,
}

impl ToldNames {
    /// A new name; returns what people should know of its time, once.
    fn handle(&mut self, name: &str, now: SystemTime) -> Option<String> {
        let stem = Path::new(name).file_stem()?.to_string_lossy().into_owned();
        let Some((stamp, form)) = Stamp::of_name(&stem) else {
            let is_number = stem.bytes().all(|b| b.is_ascii_digit());
            let what = if is_number {
                "the number in the name is no time since the year 2000"
            } else {
                "the name has no time"
            };
            let text = format!("{name}: {what}: the time in the image counts, or else its arrival");
            return self.forms.insert(None).then_some(text);
        };
        self.handle_stamp(name, stamp, now)
            .or_else(|| self.forms.insert(Some(form)).then(|| format!("{name}: names are read as {}", form.name())))
    }

    /// The time of an image, by its name or by itself; returns what people should know if it is far ahead of `now`, once.
    fn handle_stamp(&mut self, name: &str, stamp: Stamp, now: SystemTime) -> Option<String> {
        let now = now.duration_since(SystemTime::UNIX_EPOCH).ok()?;
        let now = Stamp::from_nanos(i64::try_from(now.as_nanos()).ok()?);
        let ahead_s = stamp.seconds_since(now);
        if ahead_s <= AHEAD.as_secs_f64() || std::mem::replace(&mut self.is_ahead_told, true) {
            return None;
        }
        Some(format!("{name}: its time is {:.1} hours ahead of the clock of this computer", ahead_s / 3600.0))
    }

    /// A file that is not named as one that is read, or a folder; returns what people should know of it, once for each ending, and for
    /// folders.
    fn handle_other(&mut self, path: &Path) -> Option<String> {
        let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if path.is_dir() && !is_hidden && !std::mem::replace(&mut self.is_folder_told, true) {
            return Some(format!(
                "{}: folders within the folder are not read: name the one with the images",
                path.display()
            ));
        }
        let ending = ending(path).filter(|ending| UNREAD.contains(&ending.as_str()))?;
        let is_new = self.endings.insert(ending);
        is_new.then(|| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            format!("{name}: files of this kind are not read; it takes .{}", EXTENSIONS.join(", ."))
        })
    }
}

#[derive(Debug, Clone, Copy)]
enum FileState {
    Growing {
        length: u64,
        since: Instant,
    },
    /// Taken, or never to be taken.
    Done,
}

impl WatchSource {
    pub fn new(dir: &Path, clock: ArrivalClock) -> Self {
        Self {
            dir: dir.to_owned(),
            clock,
            files: BTreeMap::new(),
            changed: None,
            read: None,
            ready: VecDeque::new(),
            told: ToldNames::default(),
        }
    }

    fn entries(&mut self) -> Result<Vec<DirEntry>, SourceError> {
        let failed = |e: std::io::Error| SourceError(format!("{}: {e}", self.dir.display()));
        let entries = std::fs::read_dir(&self.dir).map_err(failed)?;
        let (images, others): (Vec<DirEntry>, Vec<DirEntry>) =
            entries.filter_map(Result::ok).partition(|entry| is_image(&entry.path()));
        for line in others.iter().filter_map(|entry| self.told.handle_other(&entry.path())) {
            tracing::warn!("camera: {line}");
        }
        Ok(images)
    }

    /// Of many new files at once, only the last ones are read: the others would be overtaken.
    fn skip_all_but_the_newest(&mut self, fault: &mut dyn FnMut(CameraFault, String)) {
        let is_open = |state: &FileState| matches!(state, FileState::Growing { .. });
        let mut open: Vec<(Option<Stamp>, PathBuf)> =
            self.files.iter().filter(|(_, state)| is_open(state)).map(|(p, _)| (stamp_of_name(p), p.clone())).collect();
        open.sort();
        open.truncate(open.len().saturating_sub(MAX_FILES));
        for (_, path) in open {
            fault(CameraFault::Overtaken, format!("more than {MAX_FILES} images came at once"));
            self.files.insert(path, FileState::Done);
        }
    }

    /// Takes new files in, and every file that is complete now.
    fn look(&mut self, fault: &mut dyn FnMut(CameraFault, String)) -> Result<(), SourceError> {
        let changed = std::fs::metadata(&self.dir).and_then(|folder| folder.modified());
        let changed = changed.map_err(|e| SourceError(format!("{}: {e}", self.dir.display())))?;
        // A time of change may hide a file that came later, within its resolution or on a network disk.
        let is_due = self.read.is_none_or(|read| read.elapsed() >= READ);
        if self.changed != Some(changed) || is_due {
            (self.changed, self.read) = (Some(changed), Some(Instant::now()));
            let found = self.entries()?.into_iter().map(|entry| entry.path());
            let mut before = std::mem::take(&mut self.files);
            let begun = FileState::Growing { length: 0, since: Instant::now() };
            self.files = found
                .map(|path| {
                    let state = before.remove(&path).unwrap_or(begun);
                    (path, state)
                })
                .collect();
        }
        self.skip_all_but_the_newest(fault);
        let mut complete: Vec<(Option<Stamp>, PathBuf, Vec<u8>)> = Vec::new();
        for (path, state) in &mut self.files {
            let FileState::Growing { length, since } = state else { continue };
            let now_length = std::fs::metadata(path).map_or(0, |file| file.len());
            let has_grown = std::mem::replace(length, now_length) != now_length;
            if has_grown {
                *since = Instant::now();
            }
            let still = since.elapsed();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if now_length > MAX_IMAGE_BYTES as u64 {
                fault(CameraFault::Unreadable, format!("{name}: larger than {MAX_IMAGE_BYTES} bytes"));
                *state = FileState::Done;
            } else if has_grown || (is_tiff(path) && still >= SETTLED) {
                let Ok(bytes) = std::fs::read(path) else { continue };
                if (is_tiff(path) && !has_grown) || complete_length(&bytes).is_some() {
                    *state = FileState::Done;
                    if let Some(line) = self.told.handle(&name, SystemTime::now()) {
                        tracing::info!("camera: {line}");
                    }
                    complete.push((stamp_of_name(path), path.clone(), bytes));
                }
            } else if still >= ABANDONED {
                match head_of(path) {
                    Some(head) if head.len() > 2 && !is_known_image(&head) => {
                        fault(
                            CameraFault::Unreadable,
                            format!("{name}: not a JPEG, PNG or PPM image, as its name says"),
                        );
                    }
                    Some(_) => {
                        let seconds = ABANDONED.as_secs();
                        fault(CameraFault::CutOff, format!("{name}: not a complete image after {seconds} s"));
                    }
                    // It was removed.
                    None => {}
                }
                *state = FileState::Done;
            }
        }
        complete.sort_by(|a, b| (a.0, &a.1).cmp(&(b.0, &b.1)));
        let arrival = self.clock.now();
        for (stamp, path, bytes) in complete {
            let image = SourceImage::compressed(stamp, arrival, bytes);
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let own = image.stamp.and_then(|own| self.told.handle_stamp(&name, own, SystemTime::now()));
            own.into_iter().for_each(|line| tracing::info!("camera: {line}"));
            self.ready.push_back(image);
        }
        Ok(())
    }
}

impl SensorSource for WatchSource {
    fn kind(&self) -> SensorKind {
        SensorKind::Camera
    }

    fn open(&mut self) -> Result<(), SourceError> {
        self.changed = None;
        let is_old = |entry: &DirEntry| {
            let modified = entry.metadata().and_then(|file| file.modified());
            // A time in the future is that of another clock: it does not say that the file is new.
            let age = |modified: SystemTime| modified.elapsed().unwrap_or_else(|future| future.duration());
            modified.is_ok_and(|modified| age(modified) > LIVE)
        };
        self.files =
            self.entries()?.iter().filter(|entry| is_old(entry)).map(|e| (e.path(), FileState::Done)).collect();
        Ok(())
    }

    fn next(
        &mut self,
        timeout: Duration,
        fault: &mut dyn FnMut(CameraFault, String),
    ) -> Result<Option<Reading>, SourceError> {
        let until = Instant::now() + timeout;
        loop {
            if let Some(image) = self.ready.pop_front() {
                return Ok(Some(Reading::Image(image)));
            }
            self.look(fault)?;
            if self.ready.is_empty() {
                if Instant::now() >= until {
                    return Ok(None);
                }
                std::thread::sleep(LOOK);
            }
        }
    }

    fn is_reopened_after_stall(&self) -> bool {
        false
    }
}

const EXTENSIONS: [&str; 8] = ["jpeg", "jpg", "pgm", "png", "pnm", "ppm", "tif", "tiff"];

/// Images of kinds that are not read.
const UNREAD: [&str; 14] =
    ["arw", "avif", "bmp", "cr2", "cr3", "dng", "gif", "heic", "heif", "jp2", "jxl", "nef", "raw", "webp"];

/// Whether a file is named as an image; hidden files are not.
fn is_image(path: &Path) -> bool {
    let is_hidden = path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
    !is_hidden && ending(path).is_some_and(|ending| EXTENSIONS.contains(&ending.as_str()))
}

fn is_tiff(path: &Path) -> bool {
    ending(path).is_some_and(|ending| ending.starts_with("tif"))
}

fn ending(path: &Path) -> Option<String> {
    path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase())
}

/// The first bytes of a file; `None` if it cannot be read.
fn head_of(path: &Path) -> Option<Vec<u8>> {
    let mut head = Vec::new();
    std::fs::File::open(path).ok()?.take(4).read_to_end(&mut head).ok()?;
    Some(head)
}

fn stamp_of_name(path: &Path) -> Option<Stamp> {
    Stamp::of_name(&path.file_stem()?.to_string_lossy()).map(|(stamp, _)| stamp)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Picture;

    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let dir = std::env::temp_dir().join(format!("scenecast-{}-watch-{name}", std::process::id()));
            let _ = std::fs::remove_dir_all(&dir);
            std::fs::create_dir_all(&dir).unwrap();
            Self(dir)
        }

        fn write(&self, name: &str, bytes: &[u8]) {
            std::fs::write(self.0.join(name), bytes).unwrap();
        }

        fn source(&self) -> WatchSource {
            WatchSource::new(&self.0, ArrivalClock::start())
        }
    }

    const PPM: &[u8] = b"P6 1 1 255\nabc";

    /// The next image of a source; a fault is none.
    fn next(source: &mut WatchSource) -> Option<Picture> {
        let image = source.next(Duration::ZERO, &mut |fault, text| panic!("{fault:?} {text}")).unwrap();
        image.map(|reading| image_of(reading).picture)
    }

    fn image_of(reading: Reading) -> SourceImage {
        match reading {
            Reading::Image(image) => image,
            Reading::Pose(..) | Reading::Depth(_) => panic!("a folder has no poses"),
        }
    }

    #[test]
    fn a_file_is_taken_once_it_is_complete() {
        let folder = Folder::new("partial");
        let mut source = folder.source();
        source.open().unwrap();
        folder.write("a.ppm", &PPM[..12]);
        folder.write("notes.txt", PPM);
        assert_eq!(next(&mut source), None);
        folder.write("a.ppm", PPM);
        assert_eq!(next(&mut source), Some(Picture::Compressed(PPM.to_vec())));
        assert_eq!(next(&mut source), None);
    }

    #[test]
    fn files_are_ordered_by_the_time_in_their_names() {
        let folder = Folder::new("order");
        let mut source = folder.source();
        source.open().unwrap();
        for name in ["10.5.ppm", "9.25.ppm", "100.0.ppm"] {
            folder.write(name, PPM);
        }
        let mut stamp =
            || source.next(Duration::ZERO, &mut |_, _| ()).unwrap().and_then(|reading| image_of(reading).stamp);
        let stamps: Vec<Option<Stamp>> = std::iter::repeat_with(&mut stamp).take(4).collect();
        assert_eq!(stamps, [Stamp::parse("9.25"), Stamp::parse("10.5"), Stamp::parse("100"), None]);
    }

    #[test]
    fn the_form_of_names_and_future_times_are_logged_once() {
        let now = SystemTime::UNIX_EPOCH + Duration::from_secs(1_795_719_000);
        let mut told = ToldNames::default();
        let first = told.handle("1795719000567.jpg", now).unwrap();
        assert_eq!(first, "1795719000567.jpg: names are read as milliseconds since 1970");
        assert_eq!(told.handle("1795719001567.jpg", now), None);
        assert!(told.handle("IMG_0001.jpg", now).unwrap().contains("the name has no time"));
        assert_eq!(told.handle("IMG_0002.jpg", now), None);
        assert!(told.handle("20261126T185000.jpg", now).unwrap().contains("date and time of UTC"));
        let ahead = told.handle("20261127T185000.jpg", now).unwrap();
        assert!(ahead.contains("24.0 hours ahead"), "{ahead}");
        assert_eq!(told.handle("1795719002567.jpg", now), None, "a form is told once");
    }

    #[test]
    fn a_future_time_in_an_image_is_told_as_that_of_a_name() {
        let folder = Folder::new("ahead");
        let mut source = folder.source();
        source.open().unwrap();
        folder.write("a.ppm", b"P6\n# stamp=4000000000.5\n1 1\n255\nabc");
        assert!(next(&mut source).is_some());
        assert!(source.told.is_ahead_told);
    }

    #[test]
    fn images_that_are_only_counted_have_no_time_of_their_own() {
        let folder = Folder::new("counted");
        let mut source = folder.source();
        source.open().unwrap();
        for name in ["0001.ppm", "0002.ppm", "115442.ppm"] {
            folder.write(name, PPM);
        }
        let mut image = || source.next(Duration::ZERO, &mut |_, _| ()).unwrap().map(image_of);
        let stamps: Vec<_> =
            std::iter::repeat_with(&mut image).map_while(|image| image.map(|i| i.stamp)).take(3).collect();
        assert_eq!(stamps, [None; 3]);
        let line = ToldNames::default().handle("0001.jpg", SystemTime::now()).unwrap();
        assert!(line.contains("no time since the year 2000"), "{line}");
    }

    #[test]
    fn a_kind_of_image_that_is_not_read_is_named_once() {
        let mut told = ToldNames::default();
        let line = told.handle_other(Path::new("/frames/0001.BMP")).unwrap();
        assert_eq!(
            line,
            "0001.BMP: files of this kind are not read; it takes .jpeg, .jpg, .pgm, .png, .pnm, .ppm, .tif, .tiff"
        );
        assert_eq!(told.handle_other(Path::new("/frames/0002.bmp")), None);
        assert_eq!(told.handle_other(Path::new("/frames/notes.txt")), None, "it may belong to the camera's program");
        assert!(told.handle_other(Path::new("/frames/0001.dng")).is_some());
        let folders = [(); 2].map(|()| told.handle_other(&std::env::temp_dir()));
        assert!(folders[0].as_ref().unwrap().contains("name the one with the images") && folders[1].is_none());
    }

    #[test]
    fn a_missing_folder_is_named_and_may_come_back() {
        let folder = Folder::new("missing");
        let mut source = folder.source();
        std::fs::remove_dir_all(&folder.0).unwrap();
        let error = source.open().unwrap_err().to_string();
        assert!(error.starts_with(&folder.0.display().to_string()), "{error}");
        std::fs::create_dir_all(&folder.0).unwrap();
        source.open().unwrap();
        folder.write("a.ppm", PPM);
        assert!(next(&mut source).is_some());
    }

    #[test]
    fn files_of_an_earlier_dive_are_not_mapped() {
        let folder = Folder::new("old");
        folder.write("old.ppm", PPM);
        let file = std::fs::File::options().append(true).open(folder.0.join("old.ppm")).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(60)).unwrap();
        folder.write("ahead.ppm", PPM);
        let file = std::fs::File::options().append(true).open(folder.0.join("ahead.ppm")).unwrap();
        file.set_modified(SystemTime::now() + Duration::from_secs(86_400)).unwrap();
        let mut source = folder.source();
        source.open().unwrap();
        assert_eq!(next(&mut source), None);
        folder.write("new.ppm", PPM);
        assert!(next(&mut source).is_some());
    }
}

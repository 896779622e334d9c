//! Labels of another program in a folder: `NAME.json` with its picture `NAME.png` or `NAME.bin`; and a file with names and
//! colours of classes.

use scenecast_core::UserError;
use scenecast_labels::{Content, Item, ItemTime, MAX_HEADER_BYTES, MAX_PICTURE_BYTES, Refusal};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Seconds for which files that cannot be read must stay as they are before they are refused. Until then they count as
/// files that are still being written.
const SETTLE_S: f64 = 2.0;
/// Endings of a picture's name.
const PICTURES: [&str; 2] = ["png", "bin"];

/// The lengths of header and picture.
type Lengths = (usize, Option<usize>);

/// A folder in which another program writes its labels. The files are read in the order of their names and stay where
/// they are.
#[derive(Debug)]
pub struct LabelFolder {
    dir: PathBuf,
    /// Names up to this one belong to an earlier run.
    after: Option<String>,
    done: BTreeSet<String>,
    /// Files that could not be read, with their lengths and since when these have not changed.
    waiting: BTreeMap<String, (Lengths, f64)>,
}

/// An item of a folder, or why it is refused.
#[derive(Debug)]
pub struct FolderItem {
    /// The name without its ending.
    pub name: String,
    pub item: Result<Item, Refusal>,
}

impl LabelFolder {
    /// A folder whose files up to the name `after` belong to an earlier run.
    pub fn new(dir: &Path, after: Option<String>) -> Self {
        Self { dir: dir.to_owned(), after, done: BTreeSet::new(), waiting: BTreeMap::new() }
    }

    /// The names that have not been read, in their order. Names that begin with a dot are left out, and so are those that no
    /// longer exist.
    pub fn scan(&mut self) -> io::Result<Vec<String>> {
        let mut names = BTreeSet::new();
        for entry in std::fs::read_dir(&self.dir)? {
            let file = entry?.file_name();
            let name = file.to_str().and_then(|name| name.strip_suffix(".json"));
            names.extend(name.filter(|name| !name.starts_with('.')).map(str::to_owned));
        }
        self.done.retain(|name| names.contains(name));
        self.waiting.retain(|name, _| names.contains(name));
        let is_new = |name: &String| self.after.as_ref().is_none_or(|after| name > after) && !self.done.contains(name);
        Ok(names.into_iter().filter(is_new).collect())
    }

    /// Reads the item of a name whose files nobody writes any more.
    pub fn read_settled(&mut self, name: &str) -> FolderItem {
        self.done.insert(name.to_owned());
        FolderItem { name: name.to_owned(), item: self.try_read(name).0 }
    }

    /// Reads the item of a name at `now_s`; `None` while its files are still being written.
    pub fn read(&mut self, name: &str, now_s: f64) -> Option<FolderItem> {
        let (item, lengths) = self.try_read(name);
        let is_settled = match &item {
            Ok(_) => true,
            Err(_) => {
                let (last, since) = self.waiting.entry(name.to_owned()).or_insert((lengths, now_s));
                if *last != lengths {
                    (*last, *since) = (lengths, now_s);
                }
                // A picture may come any time after its header.
                lengths.1 != Some(0) && now_s - *since >= SETTLE_S
            }
        };
        is_settled.then(|| {
            self.waiting.remove(name);
            self.done.insert(name.to_owned());
            FolderItem { name: name.to_owned(), item }
        })
    }

    /// How long ago the header of a name was written; `None` if the file system does not tell.
    pub fn age_of(&self, name: &str) -> Option<Duration> {
        let written = std::fs::metadata(self.dir.join(format!("{name}.json"))).ok()?.modified().ok()?;
        Some(written.elapsed().unwrap_or(Duration::ZERO))
    }

    /// The time in the header of a name; that of its arrival if it cannot be read.
    pub fn time_of(&self, name: &str) -> ItemTime {
        let header = self.header(name).ok();
        header.and_then(|header| Item::peek(&header).ok()).map_or(ItemTime::Arrival, |(time, _)| time)
    }

    /// The item of a name, and the lengths of its files; the picture's is `Some(0)` while it is missing.
    fn try_read(&self, name: &str) -> (Result<Item, Refusal>, Lengths) {
        let header = match self.header(name) {
            Ok(header) => header,
            Err(e) => return (Err(Refusal::Header(e.to_string())), (0, None)),
        };
        let has_picture = match Item::peek(&header) {
            Ok((_, has_picture)) => has_picture,
            Err(why) => return (Err(why), (header.len(), None)),
        };
        if !has_picture {
            return (Item::read(&header, &[]), (header.len(), None));
        }
        let paths = PICTURES.map(|ending| self.dir.join(format!("{name}.{ending}")));
        let Some(path) = paths.into_iter().find(|path| path.exists()) else {
            return (Err(Refusal::Missing("the picture")), (header.len(), Some(0)));
        };
        match scenecast_config::read_regular(&path, MAX_PICTURE_BYTES as u64) {
            Ok(picture) => (Item::read(&header, &picture), (header.len(), Some(picture.len().max(1)))),
            Err(e) => (Err(Refusal::Picture(e.to_string())), (header.len(), Some(1))),
        }
    }

    fn header(&self, name: &str) -> Result<Vec<u8>, scenecast_core::UserError> {
        scenecast_config::read_regular(&self.dir.join(format!("{name}.json")), MAX_HEADER_BYTES as u64)
    }
}

/// Reads a file with names of classes: an item of the kind `classes`, without names.
///
/// # Errors
/// The file cannot be read, or it is another item.
pub fn read_class_names(path: &Path) -> Result<Item, UserError> {
    let header = scenecast_config::read_regular(path, MAX_HEADER_BYTES as u64)?;
    let item = Item::read(header.trim_ascii(), &[]).map_err(|why| UserError::file(path, why))?;
    match item.content {
        Content::Classes => Ok(item),
        _ => Err(UserError::file(path, "it takes the kind \"classes\" alone")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: &str = r#"{"kind":"grid","west_m":0,"south_m":0,"cell_m":1,"encoding":"raw","width":2,"height":1}"#;

    fn folder(name: &str) -> PathBuf {
        let dir = std::env::temp_dir().join(format!("scenecast-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        dir
    }

    fn write(dir: &Path, file: &str, bytes: &[u8]) {
        std::fs::write(dir.join(file), bytes).unwrap();
    }

    #[test]
    fn partial_files_wait_and_broken_ones_are_refused() {
        let dir = folder("partial-labels");
        let mut labels = LabelFolder::new(&dir, None);
        write(&dir, "b.json", &GRID.as_bytes()[..40]);
        write(&dir, ".hidden.json", b"x");
        assert_eq!(labels.scan().unwrap(), ["b"]);
        assert!(labels.read("b", 0.0).is_none(), "a part of the header");
        write(&dir, "b.json", GRID.as_bytes());
        assert!(labels.read("b", 9.0).is_none(), "no picture");
        assert!(labels.read("b", 99.0).is_none(), "a picture may come late");
        write(&dir, "b.bin", &[1]);
        assert!(labels.read("b", 100.0).is_none(), "a part of the picture");
        assert!(labels.read("b", 101.9).is_none());
        write(&dir, "b.bin", &[1, 2]);
        assert!(labels.read("b", 102.0).unwrap().item.is_ok());
        write(&dir, "c.json", b"{}");
        write(&dir, "a.json", br#"{"kind":"classes"}"#);
        assert_eq!(labels.scan().unwrap(), ["a", "c"]);
        assert!(labels.read("a", 103.0).unwrap().item.is_ok());
        assert!(labels.read("c", 103.0).is_none());
        let refused = labels.read("c", 105.0).unwrap();
        assert!(refused.item.unwrap_err().to_string().contains("missing field `kind`"));
        assert!(labels.scan().unwrap().is_empty());
        assert_eq!(LabelFolder::new(&dir, Some("b".to_owned())).scan().unwrap(), ["c"]);
        std::fs::remove_dir_all(&dir).unwrap();
        assert!(labels.scan().is_err());
    }

    #[test]
    fn a_file_of_classes_is_read_or_refused_by_name() {
        let path = std::env::temp_dir().join(format!("scenecast-{}-classes.json", std::process::id()));
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            read_class_names(&path).map(|item| item.classes.len()).map_err(|e| e.to_string())
        };
        let named = r#"{"kind":"classes","classes":[{"class":0,"name":"sand"},{"class":1,"name":"rock"}]}"#;
        assert_eq!(read(&format!("{named}\n")), Ok(2));
        let wrong = read(r#"{"kind":"classes","classes":[{"class":0,"name":""}]}"#).unwrap_err();
        assert!(wrong.contains("-classes.json") && wrong.contains("class 0"), "{wrong}");
        assert!(read("[]").is_err());
        std::fs::remove_file(&path).unwrap();
    }
}

//! The files of a bag: which there are, in which order, and which are missing or of another format.

use scenecast_core::UserError;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

pub(super) const ZSTD: &[u8] = b"\x28\xB5\x2F\xFD";

/// The largest `metadata.yaml` that is read, bytes.
const MAX_METADATA: u64 = 1 << 20;

/// The file of this path, or the files `*.mcap` of a folder in the order of their numbers.
pub(crate) fn mcap_files(path: &Path) -> Result<Vec<PathBuf>, UserError> {
    if path.is_dir() { files_of(path) } else { Ok(vec![path.to_owned()]) }
}

/// Refuses a file that is no MCAP file, by name.
pub(super) fn check_format(file: &Path) -> Result<(), UserError> {
    let mut head = Vec::new();
    let mut opened = scenecast_config::open_regular(file, u64::MAX)?.take(16);
    opened.read_to_end(&mut head).map_err(|e| UserError::file(file, e))?;
    match OTHER_FORMATS.iter().find(|other| head.starts_with(other.magic)) {
        Some(other) => Err(UserError::file(file, other.advice)),
        None => Ok(()),
    }
}

/// What is missing among the files of a bag, and what does not belong together, a line each.
pub(super) fn gaps(path: &Path, files: &[PathBuf]) -> Vec<String> {
    let mut lines = Vec::new();
    let mut numbers: BTreeMap<String, Vec<u32>> = BTreeMap::new();
    for file in files.iter().filter(|_| path.is_dir()) {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if let Some((name, number)) = stem.rsplit_once('_').and_then(|(name, n)| Some((name, n.parse().ok()?))) {
            numbers.entry(name.to_owned()).or_default().push(number);
        }
    }
    let listed = if path.is_dir() { listed(path) } else { Vec::new() };
    // What a list of the files says is better than their numbers.
    for (name, mut numbers) in numbers.clone().into_iter().filter(|_| listed.is_empty()) {
        numbers.sort_unstable();
        for pair in numbers.windows(2).filter(|pair| pair[1] - pair[0] > 1) {
            lines.push(format!(
                "a part of the bag is missing: after {name}_{}.mcap comes {name}_{}.mcap",
                pair[0], pair[1]
            ));
        }
    }
    if numbers.len() > 1 {
        let names: Vec<String> = numbers.into_keys().collect();
        lines.push(format!(
            "the folder has parts of several bags, which are read one after the other: {}",
            names.join(", ")
        ));
    }
    let missing = listed.into_iter().filter(|name| !is_there(path, name));
    lines.extend(missing.map(|name| format!("a part of the bag is missing: metadata.yaml lists {name}")));
    lines
}

/// The files that the `metadata.yaml` of a folder lists.
fn listed(dir: &Path) -> Vec<String> {
    let Ok(text) = scenecast_config::read_text(&dir.join("metadata.yaml"), MAX_METADATA) else { return Vec::new() };
    let rest = text.lines().skip_while(|line| line.trim() != "relative_file_paths:").skip(1);
    let items = rest.map_while(|line| line.trim().strip_prefix("- "));
    items.map(|name| name.trim_matches(['"', '\'']).to_owned()).collect()
}

/// Whether a listed file is there, also converted or unpacked.
fn is_there(dir: &Path, name: &str) -> bool {
    let path = dir.join(name);
    path.exists() || path.with_extension("mcap").exists() || path.with_extension("").exists()
}

/// A kind of recordings that are no MCAP file.
struct OtherFormat {
    magic: &'static [u8],
    extensions: &'static [&'static str],
    /// What it is, and the command that converts it.
    advice: &'static str,
}

const OTHER_FORMATS: [OtherFormat; 3] = [
    OtherFormat {
        magic: b"SQLite format 3",
        extensions: &["db3"],
        advice: "it is a bag in SQLite (.db3), and MCAP is read: ros2 bag convert -i BAG -o OPTIONS.yaml converts it, where OPTIONS.yaml is \
                 output_bags: [{uri: NEW, storage_id: mcap, all_topics: true}]",
    },
    OtherFormat {
        magic: b"#ROSBAG V2",
        extensions: &["bag"],
        advice: "it is a bag of ROS 1, and MCAP of ROS 2 is read: rosbags-convert --src OLD.bag --dst NEW --dst-storage mcap converts it \
                 (pip install rosbags)",
    },
    OtherFormat {
        magic: ZSTD,
        extensions: &["zstd", "zst"],
        advice: "it is compressed as a whole: zstd -d *.zstd unpacks it",
    },
];

/// How to convert a part of a bag that is of another format, if it was not converted yet: a recorder that broke down leaves its last
/// file, or all others, uncompressed.
fn unread_part(path: &Path) -> Option<&'static str> {
    let extension = |path: &Path| path.extension().map(|e| e.to_string_lossy().into_owned());
    let own = extension(path)?;
    let format = OTHER_FORMATS.iter().find(|other| other.extensions.contains(&own.as_str()))?;
    let (converted, is_part) = match format.magic {
        ZSTD => (path.with_extension(""), extension(&path.with_extension(""))? == "mcap"),
        _ => (path.with_extension("mcap"), true),
    };
    (is_part && !converted.exists()).then_some(format.advice)
}

fn files_of(dir: &Path) -> Result<Vec<PathBuf>, UserError> {
    let entries = std::fs::read_dir(dir).map_err(|e| UserError::file(dir, e))?;
    let paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    let ends_in = |path: &PathBuf, extension: &str| path.extension().is_some_and(|e| e == extension);
    let mut files: Vec<PathBuf> = paths.iter().filter(|path| ends_in(path, "mcap")).cloned().collect();
    if files.is_empty() {
        let is_there = |extension: &&str| paths.iter().any(|path| ends_in(path, extension));
        let other = OTHER_FORMATS.iter().find(|other| other.extensions.iter().any(is_there));
        return Err(UserError::file(dir, other.map_or("the folder has no file *.mcap", |other| other.advice)));
    }
    if let Some((part, advice)) = paths.iter().find_map(|path| Some((path, unread_part(path)?))) {
        return Err(UserError::file(part, format!("a part of the bag is of another format: {advice}")));
    }
    // The files of a split bag end in _0, _1, ..., _10.
    files.sort_by_key(|path| (path.as_os_str().len(), path.clone()));
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bag::stream::BagStream;

    #[test]
    fn other_recordings_are_refused_with_a_command_to_convert_them() {
        let dir = std::env::temp_dir().join(format!("scenecast-{}-other-bags", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        let refused = |path: &Path| BagStream::open(path).err().unwrap().to_string();
        assert!(refused(&dir).contains("no file *.mcap"));
        for (name, head, command) in [
            ("a.db3", &b"SQLite format 3\0"[..], "ros2 bag convert"),
            ("a.bag", b"#ROSBAG V2.0\n", "rosbags-convert"),
            ("a.mcap.zstd", b"\x28\xB5\x2F\xFD", "zstd -d"),
        ] {
            let file = dir.join(name);
            std::fs::write(&file, head).unwrap();
            assert!(refused(&file).contains(command) && refused(&dir).contains(command), "{name}: {}", refused(&file));
            std::fs::remove_file(file).unwrap();
        }
        std::fs::remove_dir_all(dir).unwrap();
    }

    #[test]
    fn a_bag_with_a_part_of_another_format_is_refused() {
        let dir = std::env::temp_dir().join(format!("scenecast-{}-part-of-a-bag", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        for name in ["bag_0.mcap", "bag_1.mcap.zstd", "notes.zst"] {
            std::fs::write(dir.join(name), b"x").unwrap();
        }
        assert!(files_of(&dir).unwrap_err().to_string().contains("bag_1.mcap.zstd"));
        std::fs::write(dir.join("bag_1.mcap"), b"x").unwrap();
        let both = [dir.join("bag_0.mcap"), dir.join("bag_1.mcap")];
        assert_eq!(files_of(&dir).unwrap(), both);
        std::fs::write(dir.join("bag_1.db3"), b"x").unwrap();
        assert_eq!(files_of(&dir).unwrap(), both, "it was converted");
        std::fs::write(dir.join("bag_2.db3"), b"x").unwrap();
        let refused = files_of(&dir).unwrap_err().to_string();
        assert!(refused.contains("bag_2.db3") && refused.contains("ros2 bag convert"), "{refused}");
        std::fs::remove_dir_all(dir).unwrap();
    }

    #[test]
    fn missing_parts_are_named() {
        let dir = std::env::temp_dir().join(format!("scenecast-{}-missing-parts", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        let found = |names: &[&str]| {
            let files: Vec<PathBuf> = names.iter().map(|name| dir.join(name)).collect();
            gaps(&dir, &files).join("; ")
        };
        assert_eq!(found(&["a_2.mcap", "a_3.mcap", "notes.mcap"]), "", "the first parts may have been removed");
        assert_eq!(found(&["a_1.mcap", "a_3.mcap"]), "a part of the bag is missing: after a_1.mcap comes a_3.mcap");
        assert!(found(&["dive7_0.mcap", "dive8_0.mcap"]).ends_with("one after the other: dive7, dive8"));
        for name in ["a_0.mcap", "a_1.mcap"] {
            std::fs::write(dir.join(name), b"x").unwrap();
        }
        let yaml = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - a_0.mcap\n    - a_1.mcap.zstd\n    - \"a_2.mcap\"\n  duration:\n    - 5\n";
        std::fs::write(dir.join("metadata.yaml"), yaml).unwrap();
        assert_eq!(found(&["a_0.mcap", "a_1.mcap"]), "a part of the bag is missing: metadata.yaml lists a_2.mcap");
        std::fs::remove_dir_all(dir).unwrap();
    }
}

//! The fuzz targets without a fuzzer: every file of the corpora, and mutations of them.

mod seeds;
#[path = "../../fuzz/src/targets/mod.rs"]
mod targets;

use std::fs;
use std::path::{Path, PathBuf};
use targets::{ALL, Target};

fn corpora() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus")
}

/// Files of a corpus in the order of their names.
#[allow(clippy::disallowed_methods, reason = "the corpus is files")]
fn corpus(name: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = fs::read_dir(corpora().join(name)).expect("corpus");
    let mut files: Vec<PathBuf> = folder.map(|entry| entry.expect("entry").path()).collect();
    files.sort();
    files.into_iter().map(|path| (path.clone(), fs::read(path).expect("corpus file"))).collect()
}

#[test]
fn every_file_of_the_corpora_is_taken_or_refused() {
    for (name, target) in ALL {
        let files = corpus(name);
        assert!(files.len() >= 4, "{name} has {} files", files.len());
        files.iter().for_each(|(_, data)| target(data));
    }
}

#[test]
fn scripts_pass_the_seal_in_every_setup() {
    type Events = fn(&[u8]) -> usize;
    let ends: [(&str, Events); 2] =
        [("vehicle_link", targets::vehicle_events), ("surface_link", targets::surface_events)];
    for (name, events) in ends {
        let files = corpus(name);
        let turns: Vec<_> = files.iter().filter(|(path, _)| path.to_string_lossy().ends_with("-turns")).collect();
        assert!(turns.len() >= 6);
        turns.iter().for_each(|(path, data)| assert!(events(data) > 0, "{path:?}"));
    }
}

#[test]
#[ignore = "writes the corpora again; files with other names stay"]
#[allow(clippy::disallowed_methods, reason = "the corpus is files")]
fn write_the_corpora() {
    for (target, name, data) in seeds::all() {
        let folder = corpora().join(target);
        fs::create_dir_all(&folder).expect("folder");
        fs::write(folder.join(name), data).expect("corpus file");
    }
}

#[test]
fn a_long_storm_does_not_grow_an_end() {
    for (name, target) in ALL.into_iter().filter(|(name, _)| name.ends_with("_link")) {
        let scripts: Vec<u8> = corpus(name).into_iter().flat_map(|(_, data)| data.into_iter().skip(1)).collect();
        for setup in [12, 0, 3, 8].into_iter().take(crate::cases(4) as usize) {
            target(&[&[setup], &scripts.repeat(5)[..]].concat());
        }
    }
}

/// Runs a target on `count` mutations of its corpus, the same each time.
fn vary(name: &str, target: Target, count: u64) {
    let files = corpus(name);
    for seed in 0..count {
        let mut chance = CorpusRng(seed ^ (name.len() as u64) << 32);
        let data = chance.varied(&files);
        let shown = data.clone();
        let outcome = std::panic::catch_unwind(move || target(&data));
        assert!(outcome.is_ok(), "{name} fails, seed {seed}: {shown:02x?}");
    }
}

#[test]
fn changed_bytes_are_taken_or_refused_by_every_decoder() {
    for (name, target) in
        ALL.into_iter().filter(|(name, _)| !name.ends_with("_link") && !["map_chunk", "layer_chunk"].contains(name))
    {
        vary(name, target, crate::cases(20_000));
    }
    vary("map_chunk", targets::map_chunk, 400);
    vary("layer_chunk", targets::layer_chunk, 2000);
}

#[test]
fn changed_scripts_do_no_harm_to_a_vehicle() {
    vary("vehicle_link", targets::vehicle_link, crate::cases(1000));
}

#[test]
fn changed_scripts_do_no_harm_to_a_surface() {
    vary("surface_link", targets::surface_link, crate::cases(1000));
}
struct CorpusRng(u64);

impl CorpusRng {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as usize % limit.max(1)
    }

    fn varied(&mut self, files: &[(PathBuf, Vec<u8>)]) -> Vec<u8> {
        let mut data = files[self.below(files.len())].1.clone();
        for _ in 0..=self.below(6) {
            let at = self.below(data.len() + 1);
            match self.below(6) {
                0 => data.truncate(at),
                1 => data.insert(at, self.below(256) as u8),
                2 => {
                    let other = &files[self.below(files.len())].1;
                    let from = self.below(other.len() + 1);
                    data.extend_from_slice(&other[from..]);
                }
                3 => {
                    let end = at + self.below((data.len() - at).min(32));
                    let again = data[at..end].to_vec();
                    data.splice(at..at, again);
                }
                _ => {
                    if let Some(byte) = data.get_mut(at) {
                        *byte = [*byte ^ 1 << self.below(8), self.below(256) as u8, 0, 255][self.below(4)];
                    }
                }
            }
        }
        data.truncate(4096);
        data
    }
}

//! A replicated state of opaque bytes: a map without a codec, so that the link alone is measured.

use scenecast_protocol::map::{StateReplica, StateSource};
use scenecast_protocol::time::Instant;
use std::collections::{BTreeMap, VecDeque};

/// Bytes of the state; an address is two bytes.
pub(super) const CELLS: usize = 1 << 16;
/// Bytes in front of each run of a chunk: address of its first byte, number of bytes.
const RUN_HEAD: usize = 4;

/// Consecutive bytes with their values.
///
/// ```text
/// byte  field
///  0-1  address of the first byte, big-endian
///  2-3  number of bytes 1..=65535, big-endian; 0: the rest of the chunk is padding
///  4..  values
/// ```
#[derive(Debug)]
pub struct ByteRun {
    start: u16,
    values: Vec<u8>,
}

impl ByteRun {
    fn cells(&self) -> impl Iterator<Item = (usize, u8)> + '_ {
        (usize::from(self.start)..).zip(self.values.iter().copied())
    }

    fn write(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.start.to_be_bytes());
        out.extend_from_slice(&(self.values.len() as u16).to_be_bytes());
        out.extend_from_slice(&self.values);
    }

    fn read_all(mut chunk: &[u8]) -> Option<Vec<Self>> {
        let mut runs = Vec::new();
        while let Some((head, rest)) = chunk.split_first_chunk::<RUN_HEAD>() {
            let [a, b, c, d] = *head;
            let (values, rest) = rest.split_at_checked(usize::from(u16::from_be_bytes([c, d])))?;
            if values.is_empty() {
                break;
            }
            let start = u16::from_be_bytes([a, b]);
            if usize::from(start) + values.len() > CELLS {
                return None;
            }
            runs.push(Self { start, values: values.to_vec() });
            chunk = rest;
        }
        Some(runs)
    }
}

/// Progress of a byte toward the peer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ByteState {
    /// The peer is known to have it.
    Held,
    /// It waits for a transmission.
    Waiting,
    /// It is in a frame whose outcome is unknown.
    Flying,
}

/// The sending side: rewrites all bytes in a cycle, as fast as it is read.
///
/// Invariants: a byte that differs from the peer's known copy waits or flies; one that waits
/// is in `queue` exactly once.
#[derive(Debug)]
pub struct OpaqueSource {
    target: Vec<u8>,
    acked: Vec<u8>,
    digest: u64,
    places: Vec<ByteState>,
    /// Waiting ranges, oldest change first: first byte and end.
    queue: VecDeque<(usize, usize)>,
    pub(super) waiting: usize,
    pub(super) flying: usize,
    /// Address of the byte that is rewritten next.
    pen: usize,
}

impl Default for OpaqueSource {
    fn default() -> Self {
        Self {
            target: vec![0; CELLS],
            acked: vec![0; CELLS],
            digest: 0,
            places: vec![ByteState::Held; CELLS],
            queue: VecDeque::new(),
            waiting: 0,
            flying: 0,
            pen: 0,
        }
    }
}

impl OpaqueSource {
    /// The state that the peer should reach.
    pub fn target(&self) -> &[u8] {
        &self.target
    }

    /// Rewrites bytes until `bytes` of them wait, or all that are not in frames whose outcome is unknown.
    pub fn fill(&mut self, bytes: usize) {
        while self.waiting < bytes.min(CELLS - self.flying) {
            let cell = self.pen;
            self.pen = (self.pen + 1) % CELLS;
            self.target[cell] = self.target[cell].wrapping_add(1);
            if self.places[cell] == ByteState::Held {
                self.wait(cell);
            }
        }
    }

    /// Reverts all waiting changes except the `keep` oldest.
    pub fn take_back(&mut self, keep: usize) {
        while self.waiting > keep {
            let Some((start, end)) = self.queue.pop_back() else { return };
            let from = end - (self.waiting - keep).min(end - start);
            for cell in from..end {
                self.target[cell] = self.acked[cell];
                self.places[cell] = ByteState::Held;
            }
            self.waiting -= end - from;
            if from > start {
                self.queue.push_back((start, from));
            }
        }
    }

    fn wait(&mut self, cell: usize) {
        self.places[cell] = ByteState::Waiting;
        self.waiting += 1;
        match self.queue.back_mut() {
            Some((_, end)) if *end == cell => *end += 1,
            _ => self.queue.push_back((cell, cell + 1)),
        }
    }

    /// Puts lost bytes in front of all others that wait.
    fn wait_first(&mut self, start: usize, end: usize) {
        self.waiting += end - start;
        self.places[start..end].fill(ByteState::Waiting);
        match self.queue.front_mut() {
            Some((first, _)) if *first == end => *first = start,
            _ => self.queue.push_front((start, end)),
        }
    }

    fn take(&mut self, most: usize) -> Option<ByteRun> {
        let (start, end) = self.queue.pop_front()?;
        let cut = end.min(start + most);
        if cut < end {
            self.queue.push_front((cut, end));
        }
        self.places[start..cut].fill(ByteState::Flying);
        self.waiting -= cut - start;
        self.flying += cut - start;
        Some(ByteRun { start: start as u16, values: self.target[start..cut].to_vec() })
    }
}

impl StateSource for OpaqueSource {
    type Carried = Vec<ByteRun>;

    fn next_chunk(&mut self, room: usize, _now: Instant) -> Option<(Vec<u8>, Self::Carried)> {
        let mut bytes = Vec::with_capacity(room);
        let mut runs = Vec::new();
        while room - bytes.len() > RUN_HEAD
            && let Some(run) = self.take(room - bytes.len() - RUN_HEAD)
        {
            run.write(&mut bytes);
            runs.push(run);
        }
        if self.waiting > 0 {
            bytes.resize(room, 0);
        }
        (!runs.is_empty()).then_some((bytes, runs))
    }

    fn handle_fate(&mut self, carried: Self::Carried, delivered: bool, _now: Instant) {
        for run in carried.iter().rev() {
            if delivered {
                for (cell, value) in run.cells() {
                    self.digest ^= term(cell, self.acked[cell]) ^ term(cell, value);
                    self.acked[cell] = value;
                }
            }
            let start = usize::from(run.start);
            self.flying -= run.values.len();
            for cell in (start..start + run.values.len()).rev() {
                match self.target[cell] == self.acked[cell] {
                    true => self.places[cell] = ByteState::Held,
                    false => self.wait_first(cell, cell + 1),
                }
            }
        }
    }

    fn handle_peer_restart(&mut self, _now: Instant) {
        self.acked.fill(0);
        self.places.fill(ByteState::Held);
        self.queue.clear();
        (self.digest, self.waiting, self.flying) = (0, 0, 0);
        for cell in (0..CELLS).filter(|&c| self.target[c] != 0).collect::<Vec<_>>() {
            self.wait(cell);
        }
    }

    fn backlog_bytes(&self) -> usize {
        self.waiting + RUN_HEAD * self.queue.len()
    }

    fn is_converged(&self) -> bool {
        self.waiting + self.flying == 0
    }

    fn digest(&self) -> u16 {
        fold(self.digest)
    }
}

/// The receiving side.
///
/// Invariant: `shown` is `base` with the runs of `log` applied in the order of frame numbers.
#[derive(Debug)]
pub struct OpaqueReplica {
    base: Vec<u8>,
    digest: u64,
    log: BTreeMap<u64, Vec<ByteRun>>,
    shown: Vec<u8>,
    /// Number of the last frame with a value of each byte.
    spoken: Vec<u64>,
    version: u64,
    useful_bytes: f64,
    taken: Option<Instant>,
}

impl Default for OpaqueReplica {
    fn default() -> Self {
        Self {
            base: vec![0; CELLS],
            digest: 0,
            log: BTreeMap::new(),
            shown: vec![0; CELLS],
            spoken: vec![0; CELLS],
            version: 0,
            useful_bytes: 0.0,
            taken: None,
        }
    }
}

impl OpaqueReplica {
    pub fn shown(&self) -> &[u8] {
        &self.shown
    }

    /// Bytes of chunks that changed the replica; of a chunk that changed part of its bytes, that share.
    pub fn useful_bytes(&self) -> f64 {
        self.useful_bytes
    }

    /// Time of the last chunk that was applied.
    pub fn taken(&self) -> Option<Instant> {
        self.taken
    }

    /// Number of bytes that differ from the source's state.
    pub fn missing(&self, target: &[u8]) -> usize {
        self.shown.iter().zip(target).filter(|(a, b)| a != b).count()
    }
}

impl StateReplica for OpaqueReplica {
    fn apply(&mut self, number: u64, chunk: &[u8], now: Instant) -> bool {
        let Some(runs) = ByteRun::read_all(chunk) else { return false };
        let (mut cells, mut news) = (0, 0);
        for (cell, value) in runs.iter().flat_map(ByteRun::cells) {
            cells += 1;
            if self.spoken[cell] <= number {
                self.spoken[cell] = number;
                news += u32::from(self.shown[cell] != value);
                self.shown[cell] = value;
            }
        }
        self.version += u64::from(news > 0);
        self.useful_bytes += chunk.len() as f64 * f64::from(news) / f64::from(cells.max(1));
        self.taken = Some(now);
        self.log.entry(number).or_default().extend(runs);
        true
    }

    fn advance_base(&mut self, horizon: u64) {
        let later = self.log.split_off(&(horizon + 1));
        for run in std::mem::replace(&mut self.log, later).into_values().flatten() {
            for (cell, value) in run.cells() {
                self.digest ^= term(cell, self.base[cell]) ^ term(cell, value);
                self.base[cell] = value;
            }
        }
    }

    fn base_digest(&self) -> u16 {
        fold(self.digest)
    }

    fn version(&self) -> u64 {
        self.version
    }

    fn take(&mut self) -> Self {
        let empty = Self { version: self.version + 1, useful_bytes: self.useful_bytes, ..Self::default() };
        std::mem::replace(self, empty)
    }
}

/// Hash of a byte and its address; 0 for the initial value.
fn term(cell: usize, value: u8) -> u64 {
    if value == 0 {
        return 0;
    }
    let mut z =
        (cell as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ u64::from(value).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z ^ z >> 31
}

fn fold(digest: u64) -> u16 {
    (digest ^ digest >> 16 ^ digest >> 32 ^ digest >> 48) as u16
}

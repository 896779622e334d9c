//! The sending side of objects, and the symbols of one object on their way.

use super::layout::{SymbolPlace, add_repair};
use super::part::Supply;
use super::{Layout, MAX_OBJECT, ObjectId, Part};
use std::collections::VecDeque;
use std::ops::Range;

/// What capacity an object may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Priority {
    /// The share of the budget that the class of exemplars has.
    Requested,
    /// The spare capacity, in its place among the background streams.
    Background,
    /// The spare capacity, after all other content.
    Last,
}

/// The objects on their way to the peer, oldest first.
#[derive(Debug, Default)]
pub struct ObjectSender {
    objects: VecDeque<OutgoingObject>,
    next: u64,
    /// Expected share of lost frames.
    loss: f64,
    /// Bytes that a part usually gets.
    usual_room: usize,
}

impl ObjectSender {
    /// The most objects at a time; a further one replaces the oldest.
    const MAX_OBJECTS: usize = 16;
    /// An object is replaced at the latest when this many later ones were pushed, so that its name stays unique.
    const MAX_AGE: u64 = ObjectId::COUNT / 2 - 1;
    /// The largest loss that the code is designed for.
    const MAX_LOSS: f64 = 0.95;

    /// Queues an object; `None` if it is empty or larger than [`MAX_OBJECT`].
    pub fn push(&mut self, bytes: Vec<u8>) -> Option<ObjectId> {
        self.add(bytes, Priority::Requested)
    }

    /// Queues an object that may use only spare capacity.
    pub fn push_background(&mut self, bytes: Vec<u8>) -> Option<ObjectId> {
        self.add(bytes, Priority::Background)
    }

    /// Queues an object that is sent after all other content.
    pub fn push_last(&mut self, bytes: Vec<u8>) -> Option<ObjectId> {
        self.add(bytes, Priority::Last)
    }

    fn add(&mut self, bytes: Vec<u8>, priority: Priority) -> Option<ObjectId> {
        if bytes.is_empty() || bytes.len() > MAX_OBJECT {
            return None;
        }
        let serial = self.next;
        self.next += 1;
        let too_old = |o: &OutgoingObject| serial - o.serial > Self::MAX_AGE;
        if self.objects.len() >= Self::MAX_OBJECTS || self.objects.front().is_some_and(too_old) {
            self.objects.pop_front();
        }
        self.objects.push_back(OutgoingObject::new(serial, bytes, priority));
        Some(ObjectId::of(serial))
    }

    /// Stops sending an object; an unknown one is ignored.
    pub fn cancel(&mut self, id: ObjectId) {
        self.objects.retain(|o| ObjectId::of(o.serial) != id);
    }

    /// Stops sending every object. Names are not used again, because the peer remembers them.
    pub fn cancel_all(&mut self) {
        self.objects.clear();
    }

    /// Whether the peer is known to have every object.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    /// Whether the peer is known to have every object but those that are sent after all other content.
    pub fn has_only_last(&self) -> bool {
        self.objects.iter().all(|o| o.priority == Priority::Last)
    }

    /// Whether those that are sent after all other content are the only ones that wait for spare capacity.
    pub fn waits_only_with_last(&self) -> bool {
        let mut waiting = self.objects.iter().filter(|o| o.is_background() && o.backlog_bytes() > 0);
        waiting.all(|o| o.priority == Priority::Last)
    }

    /// Whether the peer is known to have every object that has a share.
    pub fn has_only_background(&self) -> bool {
        self.objects.iter().all(OutgoingObject::is_background)
    }

    /// Whether the peer is known to have every background object.
    pub fn has_no_background(&self) -> bool {
        !self.objects.iter().any(OutgoingObject::is_background)
    }

    /// Bytes that wait for transmission, repair symbols included, without background objects.
    pub fn backlog_bytes(&self) -> usize {
        self.objects.iter().filter(|o| !o.is_background()).map(OutgoingObject::backlog_bytes).sum()
    }

    /// Bytes of background objects that wait for transmission.
    pub fn background_backlog_bytes(&self) -> usize {
        self.objects.iter().filter(|o| o.is_background()).map(OutgoingObject::backlog_bytes).sum()
    }

    /// Sets the expected share of lost frames, 0..=0.95; the number of repair symbols follows it, none at 0.
    pub fn set_loss(&mut self, loss: f64) {
        let loss = if loss.is_finite() { loss.clamp(0.0, Self::MAX_LOSS) } else { 0.0 };
        if loss != self.loss {
            self.loss = loss;
            self.objects.iter_mut().for_each(|o| o.set_loss(self.usual_room, loss));
        }
    }

    /// The next part of at most `room` bytes, header included, of an object with a share. It stays the same until
    /// it is marked in flight.
    pub fn next_part(&mut self, room: usize) -> Option<(ObjectId, SymbolRun, Vec<u8>)> {
        self.next_part_of(false, room)
    }

    /// The next part of a background object.
    pub fn next_background_part(&mut self, room: usize) -> Option<(ObjectId, SymbolRun, Vec<u8>)> {
        self.next_part_of(true, room)
    }

    fn next_part_of(&mut self, is_background: bool, room: usize) -> Option<(ObjectId, SymbolRun, Vec<u8>)> {
        // The room at the end of a frame is small; an object that begins there is still cut for whole frames.
        self.usual_room = room.max(self.usual_room - self.usual_room.div_ceil(128));
        let (usual, loss) = (self.usual_room, self.loss);
        let (run, part) = {
            // What is sent last gives way within the queue too.
            let mut of_kind: Vec<_> = self.objects.iter_mut().filter(|o| o.is_background() == is_background).collect();
            of_kind.sort_by_key(|o| o.priority == Priority::Last);
            of_kind.into_iter().find_map(|o| o.next_part(room, usual, loss))?
        };
        Some((ObjectId::of(run.serial), run, part))
    }

    /// Notes that a frame with this part was written.
    pub fn mark_in_flight(&mut self, _: ObjectId, run: &SymbolRun) {
        if let Some(object) = self.objects.iter_mut().find(|o| o.serial == run.serial) {
            object.mark_in_flight(run);
        }
    }

    /// Takes the fate of a frame with this part; returns whether its object is now complete at the peer.
    pub fn handle_fate(&mut self, _: ObjectId, run: &SymbolRun, delivered: bool) -> bool {
        let Some(at) = self.objects.iter().position(|o| o.serial == run.serial) else { return false };
        let complete = self.objects.get_mut(at).is_some_and(|o| o.handle_fate(run, delivered));
        if complete {
            self.objects.remove(at);
        }
        complete
    }

    /// Starts every object from the first symbol, because the peer has lost its copies.
    pub fn handle_peer_restart(&mut self) {
        self.objects.iter_mut().for_each(OutgoingObject::handle_peer_restart);
    }
}

/// The symbols of a part, by which its fate is reported.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SymbolRun {
    pub(super) serial: u64,
    attempt: u32,
    symbols: Range<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Symbol {
    /// It waits for its first or next transmission.
    Waiting,
    InFlight,
    Delivered,
    /// It was left out because its block is complete without it.
    Skipped,
}

/// The symbols of a block by their state, and how many should be in flight.
#[derive(Debug, Clone, Copy)]
struct OutgoingBlock {
    sources: usize,
    waiting: usize,
    in_flight: usize,
    delivered: usize,
    target: usize,
}

impl OutgoingBlock {
    fn wanted(&self) -> usize {
        self.target.saturating_sub(self.in_flight).min(self.waiting)
    }

    fn missing(&self) -> usize {
        self.sources.saturating_sub(self.delivered)
    }
}

/// The state of all symbols, once the layout is fixed.
#[derive(Debug)]
struct SymbolProgress {
    layout: Layout,
    supply: Supply,
    symbols: Vec<Symbol>,
    blocks: Vec<OutgoingBlock>,
    /// Lost symbols, which go out again before new ones.
    lost: VecDeque<Range<usize>>,
    /// The first symbol that was not sent yet.
    fresh: usize,
}

/// An object on its way to the peer.
#[derive(Debug)]
pub(super) struct OutgoingObject {
    pub(super) serial: u64,
    priority: Priority,
    attempt: u32,
    /// The object; once the layout is fixed, the bytes of all source symbols.
    bytes: Vec<u8>,
    progress: Option<SymbolProgress>,
}

impl OutgoingObject {
    pub(super) fn new(serial: u64, bytes: Vec<u8>, priority: Priority) -> Self {
        Self { serial, priority, attempt: 0, bytes, progress: None }
    }

    fn is_background(&self) -> bool {
        self.priority != Priority::Requested
    }

    /// Bytes of the symbols that wait for transmission.
    pub(super) fn backlog_bytes(&self) -> usize {
        let wanted = |p: &SymbolProgress| p.blocks.iter().map(OutgoingBlock::wanted).sum::<usize>() * p.layout.symbol();
        self.progress.as_ref().map_or(self.bytes.len() + Layout::TRAILER, wanted)
    }

    /// The next part of at most `room` bytes. A layout is fixed for parts of `usual` bytes.
    pub(super) fn next_part(&mut self, room: usize, usual: usize, loss: f64) -> Option<(SymbolRun, Vec<u8>)> {
        let room = room.checked_sub(Part::HEADER)?;
        if self.progress.is_none() {
            let layout = Layout::choose(self.bytes.len(), usual.checked_sub(Part::HEADER)?)?;
            layout.seal(&mut self.bytes);
            self.progress = Some(SymbolProgress::new(layout, usual, loss));
        }
        let progress = self.progress.as_mut()?;
        let layout = progress.layout;
        let symbols = progress.next_run(room / layout.symbol())?;
        let id = ObjectId::of(self.serial);
        let mut part = Part::header(id, layout, symbols.start, Part::HEADER + symbols.len() * layout.symbol());
        for symbol in symbols.clone() {
            self.write_symbol(layout, symbol, &mut part);
        }
        Some((SymbolRun { serial: self.serial, attempt: self.attempt, symbols }, part))
    }

    fn write_symbol(&self, layout: Layout, symbol: usize, out: &mut Vec<u8>) {
        match layout.place(symbol) {
            SymbolPlace::Source(..) => {
                let at = symbol * layout.symbol();
                out.extend_from_slice(self.bytes.get(at..at + layout.symbol()).unwrap_or_default());
            }
            SymbolPlace::Repair(block, repair) => {
                let at = out.len();
                out.resize(at + layout.symbol(), 0);
                let to = out.get_mut(at..).unwrap_or_default();
                add_repair(to, repair, layout.sources_of(block, &self.bytes));
            }
        }
    }

    pub(super) fn mark_in_flight(&mut self, run: &SymbolRun) {
        if let Some(progress) = self.of_attempt(run) {
            progress.mark(run.symbols.clone(), Symbol::Waiting, Symbol::InFlight);
        }
    }

    /// Takes the fate of a part; returns whether the object is complete at the peer.
    pub(super) fn handle_fate(&mut self, run: &SymbolRun, delivered: bool) -> bool {
        let Some(progress) = self.of_attempt(run) else { return false };
        if delivered {
            progress.mark(run.symbols.clone(), Symbol::InFlight, Symbol::Delivered);
            progress.aim();
        } else {
            progress.mark(run.symbols.clone(), Symbol::InFlight, Symbol::Waiting);
            progress.lost.push_back(run.symbols.clone());
        }
        progress.blocks.iter().all(|b| b.missing() == 0)
    }

    pub(super) fn set_loss(&mut self, usual: usize, loss: f64) {
        if let Some(progress) = &mut self.progress {
            progress.supply = supply_of(progress.layout, usual, loss);
            progress.aim();
        }
    }

    /// Starts from the first symbol, because the peer has lost its copy.
    pub(super) fn handle_peer_restart(&mut self) {
        self.attempt += 1;
        if let Some(progress) = &mut self.progress {
            let supply = progress.supply;
            *progress = SymbolProgress::with_supply(progress.layout, supply);
        }
    }

    fn of_attempt(&mut self, run: &SymbolRun) -> Option<&mut SymbolProgress> {
        self.progress.as_mut().filter(|_| run.attempt == self.attempt)
    }
}

fn supply_of(layout: Layout, usual: usize, loss: f64) -> Supply {
    Supply::new(loss, usual.saturating_sub(Part::HEADER) / layout.symbol(), layout.blocks())
}

impl SymbolProgress {
    fn new(layout: Layout, usual: usize, loss: f64) -> Self {
        Self::with_supply(layout, supply_of(layout, usual, loss))
    }

    fn with_supply(layout: Layout, supply: Supply) -> Self {
        let block = |b| OutgoingBlock {
            sources: layout.block_sources(b),
            waiting: layout.block_symbols(b),
            in_flight: 0,
            delivered: 0,
            target: 0,
        };
        let mut progress = Self {
            layout,
            supply,
            symbols: vec![Symbol::Waiting; layout.symbols()],
            blocks: (0..layout.blocks()).map(block).collect(),
            lost: VecDeque::new(),
            fresh: 0,
        };
        progress.aim();
        progress
    }

    /// Decides how many symbols of each block should be in flight.
    fn aim(&mut self) {
        for block in &mut self.blocks {
            block.target = self.supply.in_flight(block.missing());
        }
    }

    /// The next consecutive symbols to send, at most `most`.
    fn next_run(&mut self, most: usize) -> Option<Range<usize>> {
        if most == 0 || self.blocks.iter().all(|b| b.wanted() == 0) {
            return None;
        }
        while let Some(range) = self.lost.front().cloned() {
            let start = self.skip_unwanted(range.clone());
            if start < range.end {
                self.lost.front_mut()?.start = start;
                return Some(self.wanted_run(start..range.end, most));
            }
            self.lost.pop_front();
        }
        self.fresh = self.skip_unwanted(self.fresh..self.symbols.len());
        (self.fresh < self.symbols.len()).then(|| self.wanted_run(self.fresh..self.symbols.len(), most))
    }

    /// The first symbol of `range` to send. Those before it are skipped: either they do not wait, or enough of their
    /// block is in flight; they wait again if that is lost.
    fn skip_unwanted(&mut self, range: Range<usize>) -> usize {
        let end = range.end;
        for symbol in range {
            let Some(block) = self.blocks.get_mut(self.layout.place(symbol).block()) else { return end };
            let Some(state) = self.symbols.get_mut(symbol).filter(|s| **s == Symbol::Waiting) else { continue };
            if block.wanted() > 0 {
                return symbol;
            }
            *state = Symbol::Skipped;
            block.waiting -= 1;
        }
        end
    }

    /// The part of `range` to send at once; a few unneeded symbols are sent where another header would cost more.
    fn wanted_run(&self, range: Range<usize>, most: usize) -> Range<usize> {
        let mut wanted: Vec<usize> = self.blocks.iter().map(OutgoingBlock::wanted).collect();
        let mut end = range.start;
        for symbol in range.clone().take(most) {
            if self.symbols.get(symbol) != Some(&Symbol::Waiting)
                || (symbol - end) * self.layout.symbol() > Part::HEADER + 1
            {
                break;
            }
            if let Some(wanted) = wanted.get_mut(self.layout.place(symbol).block()).filter(|w| **w > 0) {
                *wanted -= 1;
                end = symbol + 1;
            }
        }
        range.start..end
    }

    fn mark(&mut self, symbols: Range<usize>, from: Symbol, to: Symbol) {
        for symbol in symbols {
            let Some(state) = self.symbols.get_mut(symbol).filter(|s| **s == from) else { continue };
            *state = to;
            let Some(block) = self.blocks.get_mut(self.layout.place(symbol).block()) else { continue };
            for (state, sign) in [(from, -1), (to, 1)] {
                let count = match state {
                    Symbol::Waiting => &mut block.waiting,
                    Symbol::InFlight => &mut block.in_flight,
                    Symbol::Delivered => &mut block.delivered,
                    Symbol::Skipped => continue,
                };
                *count = count.saturating_add_signed(sign);
            }
        }
    }
}

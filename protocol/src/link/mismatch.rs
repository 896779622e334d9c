//! Settings of the other end that do not fit.

use crate::time::Instant;
use crate::wire::{Address, Introduction, SessionId, UtcHours, WIRE_VERSION};
use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

/// A setting of the other end that does not fit, so that its frames are refused, wasteful or those of two. It is found in a frame
/// with a valid CRC or tag, apart from [`Self::Tag`], [`Self::Key`], [`Self::Foreign`], [`Self::OwnAddress`] and [`Self::NotCalled`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum Mismatch {
    /// The other end has this wire version.
    #[error("it has wire version {0}, this end has {WIRE_VERSION}: install the same release at both ends")]
    Version(u8),
    /// Its frames have no tag, and this end has a key.
    #[error("its frames have no tag: set the same link.key_file and link.authenticate at both ends")]
    NoTag,
    /// Its frames have a tag, and this end expects none.
    #[error(
        "its frames have a tag and none is expected: set the same link.key_file and link.authenticate at both ends"
    )]
    Tag,
    /// Its hellos do not verify.
    #[error(
        "its hellos fit neither the key nor the mission number here: set the same link.key_file and mission.id at both ends"
    )]
    Key,
    /// Only at the surface: the vehicle says that no hello of this end verifies there. Everybody can say so.
    #[error(
        "it hears this end, whose hellos fit neither its key nor its mission number: set the same link.key_file and mission.id \
         at both ends"
    )]
    Unverified,
    /// Only at the surface: many frames from its address do not verify, and none does.
    #[error(
        "its frames do not verify here: they are of before a restart, another surface holds it, or link.key_file, link.authenticate \
         or mission.id differ between the ends"
    )]
    Foreign,
    /// Its frames have up to so many bytes, and those of this end another number. They are read all the same.
    #[error("its frames have up to {0} bytes, those of this end {1}: set the same link.frame_bytes at both ends")]
    Length(usize, usize),
    /// What is on at one end is off at the other: who has it, and the key of the configuration. Where encryption or tags differ,
    /// frames of vehicles are not read.
    #[error("{0}: set the same {1} at both ends")]
    Switch(&'static str, &'static str),
    /// The origin of its map is so many metres from that of this end. Its frames are read all the same.
    #[error(
        "the origin of its map is {0} m from the one here, so that places in degrees are as far off: set the same \
         mission.origin_deg at both ends"
    )]
    Origin(u32),
    /// Only at a vehicle without a run: a surface has called the vehicle of this number for long, and not this one.
    #[error(
        "a surface calls vehicle {0} and has not called this one for ten minutes: set the vehicle.address here that asv.vehicles has at the surface"
    )]
    NotCalled(u8),
    /// Its clock and that of this end are apart by so many days, rounded down. Its frames are read all the same.
    #[error(
        "its clock and the clock of this end are {0} days apart: set both to UTC, or the times of files and logs do not fit"
    )]
    Clock(u32),
    /// Two vehicles have its address.
    #[error(
        "another vehicle answers at its address, and only one obeys: set a vehicle.address of its own at each vehicle"
    )]
    Twin,
    /// Only at a vehicle: another vehicle that sends from its address is heard, while this one has no run.
    #[error(
        "frames from the address of this vehicle are heard, and another one sent them: set a vehicle.address of its own at \
         each vehicle"
    )]
    OwnAddress,
}

/// Reports each mismatch once, so that no stranger can fill a log with them.
#[derive(Debug, Default)]
pub(super) struct MismatchReport {
    found: VecDeque<Mismatch>,
    /// The last one since a frame was accepted.
    current: Option<Mismatch>,
    /// Frames of the peer are longer or shorter than ours.
    length: Option<Mismatch>,
    /// By the last hello that verified: three switches and the origin.
    introduced: [Option<Mismatch>; 4],
    /// The clock in that hello, and the own one at its time, which the steps of the own clock since have moved.
    clocks: Option<(UtcHours, UtcHours)>,
    clock: Option<Mismatch>,
    reported: BTreeSet<Mismatch>,
    /// Frames with an unexpected tag, which may also be damaged frames, since the last accepted one.
    tagged: u32,
    /// Numbered frames that do not verify, since the last accepted one.
    foreign: u32,
    /// Frames from the address of this end that it has not sent, or that noise has made.
    from_own_address: u32,
    /// The vehicle that the surface called first since its last frame to this one, when that was, and frames to others since.
    calls_of_others: Option<(Address, Instant, u32)>,
    /// Hellos of one session that do not verify, which may also be damaged ones, since the last one that does.
    untrue: Option<(SessionId, u32)>,
}

impl MismatchReport {
    /// Frames with an unexpected tag after which the other end is taken to write tags.
    const MIN_TAGGED: u32 = 3;
    /// Frames without one between them that verifies: on a channel that damages every second one these are rarer than 1 in 4000.
    const MIN_FOREIGN: u32 = 12;
    /// Hellos of one session after which the other end is taken to have another key or mission number.
    const MIN_UNTRUE: u32 = 3;
    /// Frames from the address of this end after which they are taken for those of another vehicle. None of them is verified.
    const MIN_FROM_OWN_ADDRESS: u32 = 3;
    /// Frames to other vehicles, and the time for which they are heard and none to this one, after which it is taken as not called.
    const MIN_CALLS_OF_OTHERS: u32 = 8;
    const UNCALLED: Duration = Duration::from_secs(600);
    /// Four steps in which origins are told.
    const MIN_ORIGIN_M: f64 = 10.0;
    /// Found mismatches that wait for the host at most.
    const MAX_FOUND: usize = 16;

    pub(super) fn note(&mut self, mismatch: Mismatch) {
        if self.is_explained(mismatch) {
            return;
        }
        self.tagged += u32::from(mismatch == Mismatch::Tag);
        let is_certain = mismatch != Mismatch::Tag || self.tagged >= Self::MIN_TAGGED;
        if is_certain {
            self.current = Some(mismatch);
        }
        if is_certain && self.reported.insert(mismatch) {
            self.tell(mismatch);
        }
    }

    /// Whether a setting that the peer has introduced is why its frames are refused.
    fn is_explained(&self, mismatch: Mismatch) -> bool {
        let [encryption, tags, ..] = self.introduced;
        match mismatch {
            Mismatch::Tag | Mismatch::NoTag => tags.is_some(),
            Mismatch::Foreign => encryption.or(tags).is_some(),
            _ => false,
        }
    }

    fn tell(&mut self, mismatch: Mismatch) {
        if self.found.len() < Self::MAX_FOUND {
            self.found.push_back(mismatch);
        }
    }

    /// A hello of a session does not verify. Noise seldom leaves the session as it was in several hellos.
    pub(super) fn note_untrue_hello(&mut self, session: SessionId) {
        let before = self.untrue.filter(|(of, _)| *of == session).map_or(0, |(_, count)| count);
        self.untrue = Some((session, before + 1));
        if before + 1 >= Self::MIN_UNTRUE {
            self.note(Mismatch::Key);
        }
    }

    /// A numbered frame does not verify: it is damaged, or of another pair of runs.
    pub(super) fn note_foreign(&mut self) {
        self.foreign = self.foreign.saturating_add(1);
        if self.foreign >= Self::MIN_FOREIGN && self.current.is_none() {
            self.note(Mismatch::Foreign);
        }
    }

    /// A frame from the address of this end is heard, while it sends none.
    pub(super) fn note_own_address(&mut self) {
        self.from_own_address += 1;
        if self.from_own_address >= Self::MIN_FROM_OWN_ADDRESS {
            self.note(Mismatch::OwnAddress);
        }
    }

    /// A frame of so many bytes was accepted; those of this end have `own`.
    pub(super) fn note_length(&mut self, bytes: usize, own: usize) {
        if bytes > own && self.length.is_none() {
            self.find_length(Mismatch::Length(bytes, own));
        }
    }

    fn find_length(&mut self, length: Mismatch) {
        if self.length.replace(length).is_none() {
            self.tell(length);
        }
    }

    /// A hello has verified, so both ends have the same key.
    pub(super) fn handle_true_hello(&mut self) {
        self.untrue = None;
        self.current.take_if(|mismatch| *mismatch == Mismatch::Key);
    }

    /// A frame of the surface to another vehicle is heard.
    pub(super) fn note_call_of(&mut self, other: Address, now: Instant) {
        let (called, since, count) = self.calls_of_others.unwrap_or((other, now, 0));
        self.calls_of_others = Some((called, since, count.saturating_add(1)));
        if count >= Self::MIN_CALLS_OF_OTHERS && now.since(since) >= Self::UNCALLED {
            self.note(Mismatch::NotCalled(called.number()));
        }
    }

    /// A frame of the peer to this end is heard, whether or not it verifies.
    pub(super) fn handle_called(&mut self) {
        self.calls_of_others = None;
        self.current.take_if(|mismatch| matches!(mismatch, Mismatch::NotCalled(_)));
    }

    /// A hello that has verified says this of the peer, and this end says `own`.
    pub(super) fn note_introduction(&mut self, peer: &Introduction, own: &Introduction) {
        let switch =
            |of: fn(&Introduction) -> bool, [it_has, this_has]: [&'static str; 2], key| match (of(peer), of(own)) {
                (true, false) => Some(Mismatch::Switch(it_has, key)),
                (false, true) => Some(Mismatch::Switch(this_has, key)),
                _ => None,
            };
        let encryption = ["it encrypts and this end does not", "this end encrypts and it does not"];
        let tags = [
            "it has tags on frames of vehicles and this end has none",
            "this end has tags on frames of vehicles and it has none",
        ];
        let duplex =
            ["its modem is full duplex and the one here is not", "the modem here is full duplex and its is not"];
        let lengths = (usize::from(peer.frame_bytes), usize::from(own.frame_bytes));
        let is_other_length = lengths.0 != lengths.1 && lengths.0.min(lengths.1) > 0;
        let off_m = peer.origin.zip(own.origin).map_or(0.0, |(origin, own)| origin.distance_m(own));
        self.length = self.length.filter(|_| is_other_length);
        if is_other_length {
            self.find_length(Mismatch::Length(lengths.0, lengths.1));
        }
        let introduced = [
            switch(|end| end.encrypts, encryption, "link.encrypt"),
            switch(|end| end.tags_all, tags, "link.authenticate"),
            switch(|end| end.is_full_duplex, duplex, "modem.full_duplex"),
            (off_m >= Self::MIN_ORIGIN_M).then_some(Mismatch::Origin(off_m.round() as u32)),
        ];
        let before = std::mem::replace(&mut self.introduced, introduced);
        let new = introduced.into_iter().zip(before).filter(|(_, before)| before.is_none());
        new.filter_map(|(now, _)| now).for_each(|mismatch| self.tell(mismatch));
        self.clocks = peer.clock.zip(own.clock);
        self.compare_clocks();
    }

    /// The own clock says another hour than before. One that goes back was set; one that goes on by more than an hour was set, too, if it
    /// fits that of the peer better afterwards, and else the computer may have slept.
    pub(super) fn handle_clock(&mut self, before: UtcHours, now: UtcHours) {
        let Some((peer, own)) = self.clocks.filter(|_| now.apart(before) > 1) else { return };
        let moved = own.moved(before, now);
        if now.hours() < before.hours() || peer.apart(moved) < peer.apart(own) {
            self.clocks = Some((peer, moved));
            self.compare_clocks();
        }
    }

    fn compare_clocks(&mut self) {
        let hours = self.clocks.map_or(0, |(peer, own)| peer.apart(own));
        let clock = (hours > 24).then_some(Mismatch::Clock(hours / 24));
        let before = std::mem::replace(&mut self.clock, clock);
        clock.filter(|_| before.is_none()).into_iter().for_each(|clock| self.tell(clock));
    }

    pub(super) fn handle_accepted(&mut self) {
        (self.tagged, self.foreign, self.from_own_address, self.current, self.untrue) = (0, 0, 0, None, None);
    }

    pub(super) fn current(&self) -> Option<Mismatch> {
        let [encryption, tags, duplex, origin] = self.introduced;
        self.current
            .filter(|found| !self.is_explained(*found))
            .or(encryption)
            .or(tags)
            .or(duplex)
            .or(self.length)
            .or(origin)
            .or(self.clock)
    }

    pub(super) fn poll(&mut self) -> Option<Mismatch> {
        self.found.pop_front()
    }
}

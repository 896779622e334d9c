//! The knowledge of an end's true peer, with which any frame can be sealed.

use super::raw::{self, Covered, Script};
use scenecast_protocol::directive::Series;
use scenecast_protocol::link::{Authenticity, Flight};
use scenecast_protocol::mac::Wish;
use scenecast_protocol::seal::{Direction, HeldKey, MissionKey};
use scenecast_protocol::wire::{
    AckForm, AckStatement, Address, CellEdge, Envelope, Header, Introduction, MissionId, Reader, SessionId, Stamp,
};
use std::collections::BTreeSet;
use std::time::Duration;

pub const MISSION: MissionId = MissionId(7);

/// The four ways of sealing frames, by two bits.
pub fn authenticity(choice: u8) -> Option<Authenticity> {
    let key = HeldKey::Mission(MissionKey::from_bytes([9; 16]));
    (choice & 3 != 0).then(|| Authenticity::new(key, choice & 3 > 1, choice & 3 == 3))
}

pub fn vehicle() -> Address {
    Address::vehicle(1).expect("a vehicle")
}

type FuzzRun = (SessionId, u64);

/// Seals frames as the peer of the end under test does.
pub struct FuzzPeer {
    pub us: Address,
    pub end: Address,
    authenticity: Option<Authenticity>,
    own: FuzzRun,
    theirs: FuzzRun,
    /// The end's last discovery call.
    call: Option<FuzzRun>,
    /// Our frames; the end's statements judge them.
    flight: Flight<()>,
    /// Highest number of the end's frames.
    heard: u64,
    /// Frames that a holder of the key has sealed.
    sealed: BTreeSet<Vec<u8>>,
}

impl FuzzPeer {
    pub fn new(us: Address, end: Address, authenticity: Option<Authenticity>) -> Self {
        let nobody = (SessionId::from_random(1), 0);
        let (flight, sealed) = (Flight::default(), BTreeSet::new());
        Self { us, end, authenticity, own: nobody, theirs: nobody, call: None, flight, heard: 0, sealed }
    }

    /// Notes a frame that the true peer has sent, before this one replaced it.
    pub fn note_sent(&mut self, bytes: &[u8]) {
        self.sealed.insert(bytes.to_vec());
        let Ok(envelope) = Envelope::decode(bytes, |_| true) else { return };
        if envelope.header.to == Address::EVERYBODY {
            return;
        }
        match envelope.header.session {
            Some(session) => self.begin_run((session, envelope.header.nonce.unwrap_or_default())),
            None => self.flight.push(()),
        }
    }

    /// Notes a frame that the end has sent.
    pub fn note_heard(&mut self, bytes: &[u8]) {
        let ours = |to| to == self.us || to == Address::EVERYBODY;
        let envelope = Envelope::decode(bytes, ours).expect("a frame for its peer");
        let header = &envelope.header;
        let Some(session) = header.session else {
            let number = header.number_near(self.heard);
            self.heard = self.heard.max(number);
            return header.ack.iter().for_each(|ack| drop(self.flight.handle_statement(ack, Some(number))));
        };
        let run = (session, header.nonce.unwrap_or_default());
        if header.to == Address::EVERYBODY {
            self.call = Some(run);
        } else if run != self.theirs && session != self.own.0 {
            (self.theirs, self.flight, self.heard) = (run, Flight::default(), 0);
        }
    }

    fn begin_run(&mut self, run: FuzzRun) {
        if run != self.own {
            (self.own, self.flight, self.heard) = (run, Flight::default(), 0);
        }
    }

    /// Whether these bytes come from a holder of the key, or no key is needed.
    pub fn may_be_believed(&self, bytes: &[u8]) -> bool {
        !self.is_keyed(false) || self.sealed.contains(bytes)
    }

    fn is_keyed(&self, hello: bool) -> bool {
        self.authenticity.as_ref().is_some_and(|a| hello || a.all || self.us == Address::SURFACE)
    }

    /// A hello. Bits of `flags` select a new run, and the answer to a discovery call or a frame to everybody.
    pub fn hello(&mut self, flags: u8, script: &mut Script<'_>) -> Vec<u8> {
        let keyed = self.is_keyed(true);
        if flags & 1 != 0 {
            let nonce = if keyed { u64::from(script.u8()) + 1 } else { 0 };
            self.begin_run((SessionId::from_random(script.u16()), nonce));
        }
        let to = if flags & 2 != 0 && self.us == Address::SURFACE { Address::EVERYBODY } else { self.end };
        let (session, nonce) = self.own;
        let header = Header {
            to,
            session: Some(session),
            nonce: keyed.then_some(nonce),
            ack: None,
            keyed,
            ..self.header(flags, script)
        };
        let theirs = self.theirs;
        self.theirs = self.call.filter(|_| flags & 2 != 0).unwrap_or(theirs);
        let bytes = self.seal(&header, &self.introduction(), 0);
        self.theirs = theirs;
        bytes
    }

    /// The chunk with the introduction of a hello.
    fn introduction(&self) -> Vec<u8> {
        const EXTENDED: u8 = 7 << 5;
        let series = (self.us == Address::SURFACE).then(|| Series::from_random(self.own.1 + 1));
        let payload = Introduction { cell_edge: CellEdge::from_metres(0.25), series, ..Introduction::default() }
            .encode(Introduction::MAX_BYTES);
        [&[EXTENDED | (payload.len() as u8 + 1), 0], &payload[..]].concat()
    }

    /// A numbered frame whose header follows `flags` and the script, with a body from the script.
    pub fn numbered(&mut self, flags: u8, script: &mut Script<'_>) -> Vec<u8> {
        let mut header = self.header(flags, script);
        let mut number = self.flight.next_number();
        if flags & 0x10 != 0 {
            let ahead = script.u16() as i16;
            number = number.saturating_add_signed(ahead.into()).max(1);
            (header.number, header.base) = (number as u16, script.u16() % 2048 + 1);
        } else {
            self.flight.push(());
        }
        self.seal(&header, script.bytes(), number)
    }

    /// As [`Self::numbered`], but for another run of the end, or with a CRC where a tag is due.
    pub fn misaddressed(&mut self, flags: u8, script: &mut Script<'_>) -> Vec<u8> {
        let header = Header { keyed: false, ..self.header(flags, script) };
        let mut bytes = raw::head(&header);
        bytes.extend_from_slice(script.bytes());
        let theirs = if flags & 0x10 != 0 { self.theirs.0 } else { SessionId::from_random(0) };
        raw::close_with_crc(&mut bytes, MISSION, Covered::Run(theirs, self.own.0, self.flight.next_number()));
        bytes
    }

    fn header(&self, flags: u8, script: &mut Script<'_>) -> Header {
        let from = self.us;
        let turn = (flags & 1 == 0).then(|| script.u8());
        let has_wish = turn.is_some() && from.is_vehicle();
        let turn = turn.map(|turn| if has_wish { Wish::of_bits(turn).bits() } else { turn });
        let remaining = script.u8();
        let stamp = (flags & 4 != 0).then(|| {
            let (clock_ms, a) = (u32::from(script.u16()), script.u16());
            let time = Duration::from_millis(a.into());
            match from == Address::SURFACE {
                true => Stamp::Surface { clock_ms, one_way: (a != u16::MAX).then_some(time) },
                false => Stamp::Vehicle { clock_ms, last_received: script.u8(), held: time },
            }
        });
        let form = match flags & 0x10 {
            0 if has_wish => AckForm::InTurn,
            0 => AckForm::Near,
            _ => AckForm::Far,
        };
        let true_ack = AckStatement::new(self.heard, Vec::new(), form);
        let ack = match flags & 0x28 {
            0x08 => Some(true_ack),
            0x28 => AckStatement::decode(&mut Reader::new(script.bytes())).ok(),
            _ => None,
        };
        Header {
            remaining,
            turn,
            stamp,
            ack,
            keyed: self.is_keyed(false),
            ..Header::numbered(from, self.end, self.flight.next_number(), self.flight.base_distance())
        }
    }

    fn seal(&mut self, header: &Header, body: &[u8], number: u64) -> Vec<u8> {
        let mut bytes = raw::head(header);
        let body_at = bytes.len();
        bytes.extend_from_slice(body);
        let (session, nonce) = if self.us == Address::SURFACE { (0, 0) } else { (self.theirs.0.get(), self.theirs.1) };
        match self.authenticity.as_ref().filter(|_| header.keyed) {
            None if header.kind().is_hello() => raw::close_with_crc(&mut bytes, MISSION, Covered::Hello(session)),
            None => raw::close_with_crc(&mut bytes, MISSION, Covered::Run(self.theirs.0, self.own.0, number)),
            Some(a) if header.kind().is_hello() => {
                let (m, s, n) = (MISSION.0.to_be_bytes(), session.to_be_bytes(), nonce.to_be_bytes());
                let tag = a.key.vehicle(self::vehicle().number()).link().hello_tag(&[&m, &s, &n, &bytes]);
                bytes.extend_from_slice(&tag);
            }
            Some(a) => {
                let is_surface = self.us == Address::SURFACE;
                let (surface, vehicle) =
                    if is_surface { (self.own.1, self.theirs.1) } else { (self.theirs.1, self.own.1) };
                let direction = if is_surface { Direction::Down } else { Direction::Up };
                let address = self::vehicle().number();
                let key = a.key.vehicle(address).link().session(MISSION.0, address, surface, vehicle, a.encrypt);
                let (head, body) = bytes.split_at_mut(body_at);
                let tag = key.seal(direction, number, head, body);
                bytes.extend_from_slice(&tag);
            }
        }
        self.sealed.insert(bytes.clone());
        bytes
    }
}

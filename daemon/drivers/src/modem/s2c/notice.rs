//! Unsolicited notices of an S2C modem.

#[derive(Debug, Clone, PartialEq)]
pub enum Notice {
    Heard(Heard),
    /// An acknowledged instant message arrived, or did not.
    InstantDone {
        delivered: bool,
        dst: u8,
    },
    /// Burst data arrived, or did not.
    BurstDone {
        delivered: bool,
        /// The packet counter of the record.
        count: u32,
    },
    /// Instant messages were thrown away.
    InstantCanceled,
    /// Burst bytes were thrown away.
    Dropped,
    /// A transmission has ended: its type, and how long it took in microseconds.
    SendEnd(String, u32),
    /// The bit rate of our data, bit/s.
    LocalRate(u32),
    /// A position or a direction of another modem.
    Usbl(Position),
    Other,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Service {
    /// As a record of a connection.
    Burst,
    Message,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Heard {
    pub service: Service,
    pub src: u8,
    /// For whom: 255 for everybody.
    pub dst: u8,
    pub integrity: i32,
    pub travel_us: Option<u32>,
    pub data: Vec<u8>,
}

/// A line of a USBL head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    pub remote: u8,
    /// East, north, up in metres, with the one-way travel in microseconds; or only bearing and elevation in rad.
    pub place: Place,
    pub accuracy: f64,
    /// Seconds between measuring and telling.
    pub age_s: f64,
}

/// A position measured by the USBL head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    Enu([f64; 3], u32),
    Angles(f64, f64),
}

struct Row {
    keyword: &'static [u8],
    service: Service,
    /// Fields before the payload, without the protocol id.
    fields: usize,
    /// Which of them is the integrity, and which the travel time.
    integrity: usize,
    travel: Option<usize>,
}

const fn row(keyword: &'static [u8], service: Service, fields: usize, integrity: usize, travel: Option<usize>) -> Row {
    Row { keyword, service, fields, integrity, travel }
}

const RECEPTIONS: [Row; 4] = [
    row(b"RECVIMS,", Service::Message, 8, 6, None),
    row(b"RECVIM,", Service::Message, 8, 6, None),
    row(b"RECVPBM,", Service::Message, 7, 5, None),
    row(b"RECV,", Service::Burst, 8, 5, Some(6)),
];
const MAX: usize = 1024;

/// The fields in front of the payload.
struct Head<'a> {
    row: &'static Row,
    fields: Vec<&'a str>,
    bytes: usize,
}

/// For a line that carries payload: bytes before it, and its length. `None` also while the fields are incomplete.
pub(super) fn payload_length(line: &[u8]) -> Option<(usize, usize)> {
    let head = head(line)?;
    let length = head.fields.first()?.parse().ok().filter(|n| (1..=MAX).contains(n))?;
    Some((head.bytes, length))
}

fn head(line: &[u8]) -> Option<Head<'_>> {
    const FIELD: usize = 16;
    let row = RECEPTIONS.iter().find(|row| line.starts_with(row.keyword))?;
    let (mut fields, mut at) = (Vec::new(), row.keyword.len());
    let mut wanted = row.fields;
    while fields.len() < wanted {
        let rest = line.get(at..)?;
        let comma = rest.iter().take(FIELD).position(|b| *b == b',')?;
        let field = std::str::from_utf8(rest.get(..comma)?).ok()?;
        at += comma + 1;
        // The protocol id of extended networking.
        if fields.is_empty() && field.starts_with('p') && wanted == row.fields {
            wanted = row.fields + 1;
            fields.push("");
            continue;
        }
        fields.push(field);
    }
    if wanted > row.fields {
        fields.remove(0);
    }
    Some(Head { row, fields, bytes: at })
}

/// Parses a notification without its line end; `None` for a possible reply.
pub(super) fn parse_notice(line: &[u8]) -> Option<Notice> {
    if let Some((bytes, length)) = payload_length(line) {
        let data = line.get(bytes..bytes + length)?.to_vec();
        return head(line).and_then(|head| heard(&head, data)).map(Notice::Heard);
    }
    let text = std::str::from_utf8(line).ok()?;
    let (keyword, rest) = text.split_once(',').unwrap_or((text, ""));
    let fields: Vec<&str> = rest.split(',').collect();
    let number = |i: usize| fields.get(i).and_then(|f| f.parse::<u32>().ok());
    let address = |i: usize| fields.get(i).and_then(|f| f.parse::<u8>().ok());
    // `?DI` may answer with one of these as a bare word: without a comma it is a reply.
    let told = text.contains(',');
    Some(match keyword {
        "DELIVEREDIM" | "FAILEDIM" if told => {
            Notice::InstantDone { delivered: keyword == "DELIVEREDIM", dst: address(0)? }
        }
        "DELIVERED" | "FAILED" if told => Notice::BurstDone { delivered: keyword == "DELIVERED", count: number(0)? },
        "CANCELEDIM" | "CANCELLEDIM" => Notice::InstantCanceled,
        "DROPCNT" => Notice::Dropped,
        "SENDEND" => Notice::SendEnd(fields.get(1).copied().unwrap_or_default().to_owned(), number(3).unwrap_or(0)),
        "BITRATE" if fields.first() == Some(&"local") => Notice::LocalRate(number(1)?),
        "USBLLONG" => position(&fields).map_or(Notice::Other, Notice::Usbl),
        "USBLANGLES" => angles(&fields).map_or(Notice::Other, Notice::Usbl),
        "PHYON" | "PHYOFF" | "RECVSTART" => Notice::Other,
        "ERROR EFAULT" | "ERROR OVERLOAD" => Notice::Other,
        _ if is_notice(keyword, told) => Notice::Other,
        _ => return None,
    })
}

/// Keywords that never are replies.
fn is_notice(keyword: &str, told: bool) -> bool {
    const ALWAYS: [&str; 12] =
        ["RECV", "SEND", "USBL", "CANCEL", "EXPIREDIMS", "BITRATE", "SRCLEVEL", "RADDR", "STATUS", "ECLK", "RTO", "%"];
    told && (ALWAYS.iter().any(|word| keyword.starts_with(word)))
}

fn heard(head: &Head<'_>, data: Vec<u8>) -> Option<Heard> {
    let Row { service, integrity, travel, .. } = *head.row;
    let travel = travel.and_then(|i| head.fields.get(i)).and_then(|f| f.parse().ok());
    Some(Heard {
        service,
        src: head.fields.get(1)?.parse().ok()?,
        dst: head.fields.get(2)?.parse().ok()?,
        integrity: head.fields.get(integrity)?.parse().ok()?,
        travel_us: travel,
        data,
    })
}

/// Numbers that are not finite are refused: a head without a solution writes `nan`.
fn finite(fields: &[&str], i: usize) -> Option<f64> {
    fields.get(i)?.parse().ok().filter(|x: &f64| x.is_finite())
}

fn position(f: &[&str]) -> Option<Position> {
    let enu = [finite(f, 6)?, finite(f, 7)?, finite(f, 8)?];
    let place = Place::Enu(enu, f.get(12)?.parse().ok()?);
    let age_s = finite(f, 0)? - finite(f, 1)?;
    Some(Position { remote: f.get(2)?.parse().ok()?, place, accuracy: finite(f, 15)?, age_s })
}

fn angles(f: &[&str]) -> Option<Position> {
    let place = Place::Angles(finite(f, 5)?, finite(f, 6)?);
    let age_s = finite(f, 0)? - finite(f, 1)?;
    Some(Position { remote: f.get(2)?.parse().ok()?, place, accuracy: finite(f, 12)?, age_s })
}

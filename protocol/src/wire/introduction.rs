//! The content of a hello: the facts about its sender that the other end cannot measure.

use crate::bytes::{Reader, Truncated, put24};
use crate::directive::Series;
use std::time::Duration;

/// The edge of a map cell in tenths of a millimetre, up to 1677 m; 0 if the sender has no map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CellEdge(u32);

impl CellEdge {
    const MAX: u32 = 0xFF_FFFF;

    /// The edge of `metres`, rounded to a tenth of a millimetre. A value out of range becomes the nearest one.
    pub fn from_metres(metres: f64) -> Self {
        Self((metres * 1e4).round().clamp(0.0, f64::from(Self::MAX)) as u32)
    }

    /// The edge in metres; `None` if the sender has no map.
    pub fn metres(self) -> Option<f64> {
        (self.0 > 0).then(|| f64::from(self.0) / 1e4)
    }
}

/// The origin of the map frame on the earth, in steps of 1.1e-5 degrees of latitude and 2.1e-5 of longitude, at most 2.4 m.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MapOrigin {
    lat: u32,
    lon: u32,
}

impl MapOrigin {
    const STEPS: f64 = 16_777_216.0;
    const METRES_PER_DEG: f64 = 111_195.0;

    /// The nearest step to degrees of WGS 84.
    pub fn from_degrees(lat_deg: f64, lon_deg: f64) -> Self {
        let steps = |share: f64| (share * Self::STEPS).round().clamp(0.0, Self::STEPS - 1.0) as u32;
        Self { lat: steps((lat_deg + 90.0) / 180.0), lon: steps((lon_deg + 180.0).rem_euclid(360.0) / 360.0) }
    }

    /// Latitude and longitude in degrees of WGS 84.
    pub fn degrees(self) -> (f64, f64) {
        let share = |steps: u32| f64::from(steps) / Self::STEPS;
        (share(self.lat) * 180.0 - 90.0, share(self.lon) * 360.0 - 180.0)
    }

    /// Metres to another origin on a sphere; exact to 1 % where they are less than a degree apart and no pole is near.
    pub fn distance_m(self, other: Self) -> f64 {
        let ((lat, lon), (other_lat, other_lon)) = (self.degrees(), other.degrees());
        let apart = (lon - other_lon).abs();
        let east = apart.min(360.0 - apart) * ((lat + other_lat) / 2.0).to_radians().cos();
        (lat - other_lat).hypot(east) * Self::METRES_PER_DEG
    }

    fn decode(r: &mut Reader<'_>) -> Option<Self> {
        let (lat, lon) = (r.u24().ok()?, r.u24().ok()?);
        (lat != 0 || lon != 0).then_some(Self { lat, lon })
    }
}

/// The name of a surface for people: letters, digits, and ` `, `-`, `_`, `.` between them; at most 12 bytes of UTF-8.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
pub struct SurfaceName {
    bytes: [u8; Self::MAX_BYTES],
    length: u8,
}

impl SurfaceName {
    /// Bytes of the longest name.
    pub const MAX_BYTES: usize = 12;

    /// The beginning of a text, as far as it fits, without the characters that no name has.
    pub fn from_text(text: &str) -> Self {
        let mut name = Self::default();
        for character in text.chars().filter(|c| c.is_alphanumeric() || " -_.".contains(*c)) {
            let end = usize::from(name.length) + character.len_utf8();
            let Some(place) = name.bytes.get_mut(usize::from(name.length)..end) else { break };
            character.encode_utf8(place);
            name.length = end as u8;
        }
        name
    }

    /// The name; empty if the surface has none.
    pub fn as_str(&self) -> &str {
        let bytes = self.bytes.get(..usize::from(self.length)).unwrap_or_default();
        std::str::from_utf8(bytes).unwrap_or_default()
    }
}

impl std::fmt::Debug for SurfaceName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        std::fmt::Debug::fmt(self.as_str(), f)
    }
}

/// The time of a computer's clock in whole hours since 1970, UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UtcHours(u32);

impl UtcHours {
    /// The hour of a time since the beginning of 1970, UTC. `None` before its second hour, and after the year 3883.
    pub fn from_unix(since: Duration) -> Option<Self> {
        u32::try_from(since.as_secs() / 3600).ok().filter(|hours| (1..1 << 24).contains(hours)).map(Self)
    }

    /// Hours since the beginning of 1970.
    pub fn hours(self) -> u32 {
        self.0
    }

    /// This one moved by as much as it is from one time to another.
    pub(crate) fn moved(self, from: Self, to: Self) -> Self {
        Self((self.0 + to.0).saturating_sub(from.0))
    }

    /// Hours from one to the other.
    pub fn apart(self, other: Self) -> u32 {
        self.0.abs_diff(other.0)
    }
}

/// The payload of an introduction, a chunk of every hello between two ends.
///
/// ```text
/// byte  bits  field          unit, range
///  0-2  24    edge of a cell tenths of a millimetre; 0: the sender has no map
///  3-8  48    series         from a surface: of its orders; from a vehicle that refuses: of those of the surface that holds it;
///                            else 0
///  9    1     takes over     from a surface: the vehicle shall leave another surface that holds it
///  9    1     refuses        from a vehicle: another surface holds it, and the run of the called surface has ended
///  9    1     no memory      from a vehicle: it knows no order from before its start
///  9    5     silence        from a vehicle that refuses: time since it has heard that surface, 8 s; 31: 248 s or more
/// 10-12 24    clock          hours since 1970, UTC; 0: not known
/// 13    1     plain          from a surface: it reads map chunks with the body `png` alone
/// 13    1     encrypts       with a key: it encrypts the content of authenticated frames
/// 13    1     tags all       with a key: its frames have a tag if it is a vehicle, and those of vehicles must if it is a surface
/// 13    1     full duplex    its modem transmits and receives at the same time
/// 13    4     name's length  bytes, 0..12
/// 14..        name           of the surface that the series belongs to, UTF-8
///  ..   16    frame length   bytes of the longest frame of the sender; 0 or missing: not known
///  ..   24    latitude       of the origin of its map, from -90 degrees, 180 / 2^24 degrees; missing, or 0 in both: not known
///  ..   24    longitude      from -180 degrees, 360 / 2^24 degrees
///  ..         reserved for later versions; skipped
/// ```
///
/// ```
/// use scenecast_protocol::directive::Series;
/// use scenecast_protocol::wire::{CellEdge, Introduction, SurfaceName};
///
/// let (series, name) = (Some(Series::from_random(0xABCD)), SurfaceName::from_text("tug"));
/// let surface = Introduction { cell_edge: CellEdge::from_metres(0.25), series, name, ..Introduction::default() };
/// assert_eq!(surface.encode(26), [0x00, 0x09, 0xC4, 0, 0, 0, 0, 0xAB, 0xCD, 0, 0, 0, 0, 3, b't', b'u', b'g', 0, 0]);
/// assert_eq!(Introduction::decode(&surface.encode(26)), Ok(surface));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Introduction {
    /// The edge of a cell on the sender's map.
    pub cell_edge: CellEdge,
    /// The series of the surface's orders. From a vehicle: only if it refuses, and then of the surface that holds it.
    pub series: Option<Series>,
    /// From a surface: the vehicle shall leave another surface that holds it.
    pub takes_over: bool,
    /// From a vehicle: another surface holds it.
    pub refuses: bool,
    /// From a vehicle: it knows no order from before its start.
    pub has_no_memory: bool,
    /// From a vehicle that refuses: seconds since it has heard the surface that holds it, rounded down to multiples of 8.
    pub silence_s: u8,
    /// From a surface: it reads map and layer chunks with the body `png` alone.
    pub is_plain: bool,
    /// It encrypts the content of authenticated frames.
    pub encrypts: bool,
    /// With a key: frames of vehicles have a tag too.
    pub tags_all: bool,
    /// Its modem transmits and receives at the same time.
    pub is_full_duplex: bool,
    /// The origin of its map.
    pub origin: Option<MapOrigin>,
    /// Bytes of the longest frame of the sender; 0: not known.
    pub frame_bytes: u16,
    /// The clock of the sender's computer.
    pub clock: Option<UtcHours>,
    /// The name of the surface that the series belongs to.
    pub name: SurfaceName,
}

impl Introduction {
    /// Bytes of the longest introduction.
    pub const MAX_BYTES: usize = Self::HEAD + SurfaceName::MAX_BYTES + 2 + 6;
    /// Bytes of the fixed fields, which are before the name.
    const HEAD: usize = 14;
    const PLAIN: u8 = 0x80;
    const ENCRYPTS: u8 = 0x40;
    const TAGS_ALL: u8 = 0x20;
    const FULL_DUPLEX: u8 = 0x10;

    /// The bytes of the payload: 14, the name as far as it fits into `room`, then the frame length and the origin if they fit too.
    #[must_use]
    pub fn encode(&self, room: usize) -> Vec<u8> {
        let mut out = Vec::new();
        put24(&mut out, self.cell_edge.0);
        let flags = [(self.takes_over, 0x80), (self.refuses, 0x40), (self.has_no_memory, 0x20)];
        let flags = flags.iter().filter(|(is_set, _)| *is_set).fold(0, |all, (_, bit)| all | bit);
        let series = self.series.map_or(0, Series::get);
        out.extend_from_slice(series.to_be_bytes().get(2..).unwrap_or_default());
        out.push(flags | (self.silence_s / 8));
        put24(&mut out, self.clock.map_or(0, |clock| clock.0));
        let name = self.name.as_str();
        let mut length = name.len().min(room.saturating_sub(Self::HEAD));
        while !name.is_char_boundary(length) {
            length -= 1;
        }
        let flags = [
            (self.is_plain, Self::PLAIN),
            (self.encrypts, Self::ENCRYPTS),
            (self.tags_all, Self::TAGS_ALL),
            (self.is_full_duplex, Self::FULL_DUPLEX),
        ];
        let flags = flags.iter().filter(|(is_set, _)| *is_set).fold(0, |all, (_, bit)| all | bit);
        out.push(length as u8 | flags);
        out.extend_from_slice(name.as_bytes().get(..length).unwrap_or_default());
        if out.len() + 2 <= room {
            out.extend_from_slice(&self.frame_bytes.to_be_bytes());
        }
        if let Some(origin) = self.origin.filter(|_| out.len() + 6 <= room) {
            put24(&mut out, origin.lat);
            put24(&mut out, origin.lon);
        }
        out
    }

    /// Reads a payload; bytes after the known fields are skipped.
    pub fn decode(bytes: &[u8]) -> Result<Self, Truncated> {
        let mut r = Reader::new(bytes);
        let edge = r.u24()?;
        let series = u64::from(r.u24()?) << 24 | u64::from(r.u24()?);
        let flags = r.u8()?;
        let refuses = flags & 0x40 != 0;
        let hours = r.u24()?;
        let name = r.u8()?;
        let length = usize::from(name & 0x0F).min(SurfaceName::MAX_BYTES);
        Ok(Self {
            cell_edge: CellEdge(edge),
            series: (series != 0).then(|| Series::from_random(series)),
            takes_over: flags & 0x80 != 0,
            refuses,
            has_no_memory: flags & 0x20 != 0,
            silence_s: if refuses { (flags & 0x1F) * 8 } else { 0 },
            is_plain: name & Self::PLAIN != 0,
            encrypts: name & Self::ENCRYPTS != 0,
            tags_all: name & Self::TAGS_ALL != 0,
            is_full_duplex: name & Self::FULL_DUPLEX != 0,
            clock: (hours != 0).then_some(UtcHours(hours)),
            name: SurfaceName::from_text(&String::from_utf8_lossy(r.take(length)?)),
            frame_bytes: r.u16().unwrap_or(0),
            origin: MapOrigin::decode(&mut r),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn an_introduction_reads_back(
            edge in 0u32..=CellEdge::MAX,
            bits in 1u64..,
            [is_surface, takes_over, refuses, has_no_memory, is_plain, encrypts, tags_all, is_full_duplex]: [bool; 8],
            origin: Option<(u8, u8)>,
            frame_bytes: u16,
            silence in 0u8..32,
            hours in 0u32..1 << 24,
            name: String,
            tail: Vec<u8>,
        ) {
            let series = is_surface.then(|| Series::from_random(bits | 1));
            let silence_s = if refuses { silence * 8 } else { 0 };
            let name = if is_surface { SurfaceName::from_text(&name) } else { SurfaceName::default() };
            let cell_edge = CellEdge(edge);
            let origin = origin.map(|(lat, lon)| MapOrigin::from_degrees(f64::from(lat) - 89.0, f64::from(lon) - 179.0));
            let clock = UtcHours::from_unix(Duration::from_secs(3600 * u64::from(hours)));
            let sent = Introduction {
                cell_edge, series, takes_over, refuses, has_no_memory, silence_s, is_plain, encrypts, tags_all, is_full_duplex,
                frame_bytes, origin, clock, name,
            };
            let mut bytes = sent.encode(Introduction::MAX_BYTES);
            prop_assert!(bytes.len() <= Introduction::MAX_BYTES);
            prop_assert_eq!(Introduction::decode(&bytes), Ok(sent));
            bytes.extend(if origin.is_some() { tail } else { Vec::new() });
            prop_assert_eq!(Introduction::decode(&bytes), Ok(sent), "of a later version");
            for room in 14..Introduction::MAX_BYTES {
                let cut = sent.encode(room);
                prop_assert!(cut.len() <= room);
                let read = Introduction::decode(&cut).unwrap();
                prop_assert!(name.as_str().starts_with(read.name.as_str()));
                prop_assert_eq!(Introduction { name, frame_bytes, origin, ..read }, sent);
            }
        }

        #[test]
        fn any_bytes_decode_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..40)) {
            if let Ok(read) = Introduction::decode(&bytes) {
                prop_assert!(read.name.as_str().chars().all(|c| c.is_alphanumeric() || " -_.".contains(c)));
            }
        }
    }

    #[test]
    fn origins_are_as_far_apart_as_on_the_earth() {
        let origin = MapOrigin::from_degrees(43.2, 5.1);
        assert!(origin.distance_m(MapOrigin::from_degrees(43.2, 5.1)) < 1e-9);
        assert!((origin.distance_m(MapOrigin::from_degrees(43.3, 5.1)) - 11_119.0).abs() < 20.0);
        assert!((origin.distance_m(MapOrigin::from_degrees(43.2, 5.2)) - 8_106.0).abs() < 20.0);
        let (west, east) = (MapOrigin::from_degrees(0.0, 179.999), MapOrigin::from_degrees(0.0, -179.999));
        assert!((west.distance_m(east) - 222.0).abs() < 5.0, "across the date line");
    }

    #[test]
    fn edges_keep_a_tenth_of_a_millimetre() {
        for metres in [0.0001, 0.08, 0.25, 1.0, 1000.0] {
            assert_eq!(CellEdge::from_metres(metres).metres(), Some(metres));
        }
        assert_eq!(CellEdge::from_metres(0.0).metres(), None);
        assert_eq!(CellEdge::from_metres(f64::NAN).metres(), None);
    }
}

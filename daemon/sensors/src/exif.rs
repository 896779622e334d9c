//! The time in the EXIF data of an image (CIPA DC-008, Exif 2.31): JPEG, PNG and TIFF.

use crate::Stamp;
use image::metadata::Orientation;

/// Bytes at the head of a JPEG or PNG among which its EXIF data begin.
const HEAD_BYTES: usize = 1 << 16;

const ORIENTATION: u16 = 0x0112;
const EXIF_DATA: u16 = 0x8769;
const DATE_TIME_ORIGINAL: u16 = 0x9003;
const OFFSET_TIME_ORIGINAL: u16 = 0x9011;
const SUB_SEC_TIME_ORIGINAL: u16 = 0x9291;

/// The time at which an image was taken; `None` unless the EXIF data have its fraction of a second and its time zone. A whole second
/// is too coarse for a moving vehicle, and most cameras without a zone have local time.
pub(crate) fn exif_stamp(bytes: &[u8]) -> Option<Stamp> {
    let data = ExifData::of(bytes)?;
    let fields = data.number(data.long(4)?, EXIF_DATA)?;
    let text = |tag| data.text(fields, tag);
    let seconds = text(DATE_TIME_ORIGINAL)?.replace(':', "");
    let local = Stamp::parse(&format!("{seconds}.{}", text(SUB_SEC_TIME_ORIGINAL).filter(|s| !s.is_empty())?))?;
    Some(local.shifted(-zone_s(text(OFFSET_TIME_ORIGINAL)?)?))
}

/// How an image is to be turned, by its EXIF data or its TIFF, if they say so. Some programs write it as a byte or a long.
pub(crate) fn exif_orientation(bytes: &[u8]) -> Option<Orientation> {
    let data = ExifData::of(bytes)?;
    let number = data.number(data.long(4)?, ORIENTATION)?;
    Orientation::from_exif(u8::try_from(number).ok()?)
}

/// Seconds that the time of a zone is ahead of UTC, of a text such as `+05:30`.
fn zone_s(zone: &str) -> Option<f64> {
    if zone == "Z" {
        return Some(0.0);
    }
    let (hours, minutes) = zone.get(1..)?.split_once(':')?;
    let (hours, minutes) = (hours.parse::<u8>().ok()?, minutes.parse::<u8>().ok()?);
    let ahead_s = f64::from(hours) * 3600.0 + f64::from(minutes) * 60.0;
    match zone.get(..1)? {
        _ if hours > 14 || minutes > 59 => None,
        "+" => Some(ahead_s),
        "-" => Some(-ahead_s),
        _ => None,
    }
}

/// The fields of an image, in the form of a TIFF.
pub(crate) struct ExifData<'a> {
    bytes: &'a [u8],
    is_little_endian: bool,
}

impl<'a> ExifData<'a> {
    fn of(bytes: &'a [u8]) -> Option<Self> {
        let head = &bytes[..bytes.len().min(HEAD_BYTES)];
        let after = |key: &[u8]| Some(&bytes[head.windows(key.len()).position(|w| w == key)? + key.len()..]);
        let bytes = match () {
            () if head.starts_with(b"\xFF\xD8") => after(b"Exif\0\0")?,
            () if head.starts_with(b"\x89PNG") => after(b"eXIf")?,
            () => bytes,
        };
        Self::of_tiff(bytes)
    }

    /// The fields of a TIFF; `None` of anything else, and of BigTIFF.
    pub(crate) fn of_tiff(bytes: &'a [u8]) -> Option<Self> {
        let is_little_endian = bytes.starts_with(b"II*\0");
        (is_little_endian || bytes.starts_with(b"MM\0*")).then_some(Self { bytes, is_little_endian })
    }

    pub(crate) fn is_little_endian(&self) -> bool {
        self.is_little_endian
    }

    fn array<const N: usize>(&self, at: usize) -> Option<[u8; N]> {
        let mut bytes = *self.bytes.get(at..)?.first_chunk()?;
        if self.is_little_endian {
            bytes.reverse();
        }
        Some(bytes)
    }

    fn short(&self, at: usize) -> Option<u16> {
        self.array(at).map(u16::from_be_bytes)
    }

    pub(crate) fn long(&self, at: usize) -> Option<usize> {
        self.array(at).map(|bytes| u32::from_be_bytes(bytes) as usize)
    }

    /// Where the entry of a tag is, in the directory at `directory`: tag, type, count and value, 12 bytes.
    pub(crate) fn entry(&self, directory: usize, tag: u16) -> Option<usize> {
        let first = directory.checked_add(2)?;
        let entries = usize::from(self.short(directory)?);
        (0..entries).map(|i| first + 12 * i).find(|&at| self.short(at) == Some(tag))
    }

    /// The number of a field, the first if it has several; `None` if its type is none of whole numbers.
    pub(crate) fn number(&self, directory: usize, tag: u16) -> Option<usize> {
        let entry = self.entry(directory, tag)?;
        match self.short(entry + 2)? {
            1 => self.array(entry + 8).map(|[byte]| usize::from(byte)),
            3 => self.short(entry + 8).map(usize::from),
            4 | 13 => self.long(entry + 8),
            _ => None,
        }
    }

    /// The whole numbers of a field.
    pub(crate) fn numbers(&self, directory: usize, tag: u16) -> Option<Vec<usize>> {
        let entry = self.entry(directory, tag)?;
        let count = self.long(entry + 4)?;
        let size = if self.short(entry + 2)? == 3 { 2 } else { 4 };
        let at = if count.checked_mul(size)? <= 4 { entry + 8 } else { self.long(entry + 8)? };
        let number = |i: usize| {
            let at = at.checked_add(i * size)?;
            if size == 2 { self.short(at).map(usize::from) } else { self.long(at) }
        };
        // A count that is not true ends at the end of the file.
        Some((0..count).map_while(number).collect())
    }

    /// A number of a field of 64-bit floats, the first one being 0.
    pub(crate) fn double(&self, directory: usize, tag: u16, nth: usize) -> Option<f64> {
        let entry = self.entry(directory, tag).filter(|entry| self.short(entry + 2) == Some(12))?;
        self.long(entry + 4).filter(|count| nth < *count)?;
        self.array(self.long(entry + 8)?.checked_add(8 * nth)?).map(f64::from_be_bytes)
    }

    /// Whether all these bytes are in the file.
    pub(crate) fn has(&self, at: usize, length: usize) -> bool {
        at.checked_add(length).is_some_and(|end| end <= self.bytes.len())
    }

    /// Where the next directory of a file is.
    pub(crate) fn next_directory(&self, directory: usize) -> Option<usize> {
        let entries = usize::from(self.short(directory)?);
        self.long(directory.checked_add(2 + 12 * entries)?).filter(|next| *next > 0)
    }

    /// A field of ASCII, without what follows its end. Up to four bytes stand in the entry itself.
    pub(crate) fn text(&self, directory: usize, tag: u16) -> Option<&'a str> {
        let entry = self.entry(directory, tag)?;
        let length = self.long(entry + 4)?;
        let at = if length <= 4 { entry + 8 } else { self.long(entry + 8)? };
        let text = self.bytes.get(at..at.checked_add(length)?)?.split(|b| *b == 0).next()?;
        Some(std::str::from_utf8(text).ok()?.trim())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// EXIF data with these texts in their second directory.
    pub(crate) fn exif(texts: &[(u16, &str)]) -> Vec<u8> {
        let mut data =
            [&b"MM\0*\0\0\0\x08\0\x01"[..], &[0x87, 0x69, 0, 4, 0, 0, 0, 1, 0, 0, 0, 26, 0, 0, 0, 0]].concat();
        let mut after = 26 + 2 + 12 * texts.len() + 4;
        data.extend((texts.len() as u16).to_be_bytes());
        let mut values = Vec::new();
        for (tag, text) in texts {
            let text = [text.as_bytes(), &[0]].concat();
            data.extend([&tag.to_be_bytes()[..], &[0, 2], &(text.len() as u32).to_be_bytes()].concat());
            if text.len() <= 4 {
                data.extend([&text[..], &[0; 4]].concat()[..4].iter());
            } else {
                data.extend((after as u32).to_be_bytes());
                after += text.len();
                values.extend(text);
            }
        }
        [data, vec![0; 4], values].concat()
    }

    const TAKEN: (u16, &str) = (DATE_TIME_ORIGINAL, "2026:11:26 20:50:00");

    #[test]
    fn the_time_is_read_where_it_has_a_fraction_and_a_zone() {
        let fraction = (SUB_SEC_TIME_ORIGINAL, "25");
        for (zone, utc) in
            [("+02:00", "20261126T185000.25"), ("-05:30", "20261127T022000.25"), ("Z", "20261126T205000.25")]
        {
            let data = exif(&[TAKEN, (OFFSET_TIME_ORIGINAL, zone), fraction]);
            for image in [
                data.clone(),
                [b"\xFF\xD8\xFF\xE1\0\x80Exif\0\0", &data[..]].concat(),
                [b"\x89PNG\r\n\x1A\n\0\0\0\x80eXIf", &data[..]].concat(),
            ] {
                assert_eq!(exif_stamp(&image), Stamp::parse(utc), "{zone}");
            }
        }
        for incomplete in [vec![TAKEN, fraction], vec![TAKEN, (OFFSET_TIME_ORIGINAL, "+02:00")], vec![fraction]] {
            assert_eq!(exif_stamp(&exif(&incomplete)), None);
        }
        for zone in ["02:00", "+99:00", "+2", ""] {
            assert_eq!(exif_stamp(&exif(&[TAKEN, (OFFSET_TIME_ORIGINAL, zone), fraction])), None, "{zone:?}");
        }
    }

    #[test]
    fn an_orientation_is_read_whatever_its_type_of_number() {
        let of = |kind: u8, value: [u8; 4]| {
            let entry = [&[1, 0x12, 0, kind, 0, 0, 0, 1][..], &value, &[0; 4]].concat();
            exif_orientation(&[&b"MM\0*\0\0\0\x08\0\x01"[..], &entry].concat())
        };
        for (kind, value) in [(1, [6, 0, 0, 0]), (3, [0, 6, 0, 0]), (4, [0, 0, 0, 6])] {
            assert_eq!(of(kind, value), Some(Orientation::Rotate90), "type {kind}");
        }
        assert_eq!((of(3, [0, 9, 0, 0]), of(5, [0, 0, 0, 6]), of(4, [0, 0, 1, 6])), (None, None, None));
    }

    #[test]
    fn cut_data_have_no_time() {
        let data = exif(&[TAKEN, (OFFSET_TIME_ORIGINAL, "+02:00"), (SUB_SEC_TIME_ORIGINAL, "123456")]);
        assert!(exif_stamp(&data).is_some());
        for length in 0..data.len() - 1 {
            assert_eq!(exif_stamp(&data[..length]), None, "{length}");
        }
    }
}

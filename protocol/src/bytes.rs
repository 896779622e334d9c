//! Reading and writing of single bytes, bits and numbers, which every format on the wire shares.

#[derive(Debug, Clone, Default)]
pub(crate) struct BitWriter {
    bytes: Vec<u8>,
    /// Used bits of the last byte; 0 if it is full.
    partial: u32,
}

impl BitWriter {
    /// Appends the `count` low bits of `value`, highest first.
    pub(crate) fn put(&mut self, value: u64, count: u32) {
        for i in (0..count).rev() {
            self.bit(value >> i & 1 == 1);
        }
    }

    pub(crate) fn bit(&mut self, bit: bool) {
        if self.partial == 0 {
            self.bytes.push(0);
        }
        if let Some(last) = self.bytes.last_mut() {
            *last |= u8::from(bit) << (7 - self.partial);
        }
        self.partial = (self.partial + 1) % 8;
    }

    /// The number of bits written.
    pub(crate) fn len(&self) -> usize {
        self.bytes.len() * 8 - (8 - self.partial as usize) % 8
    }

    /// Adds one to the number that the written bits make; a carry out of the first bit is lost.
    pub(crate) fn increment(&mut self) {
        let mut carry = 1u8 << ((8 - self.partial) % 8);
        for byte in self.bytes.iter_mut().rev() {
            let (sum, over) = byte.overflowing_add(carry);
            *byte = sum;
            carry = u8::from(over);
        }
    }

    /// The bytes written; unused bits of the last one are zero.
    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}

#[derive(Debug, Clone)]
pub(crate) struct BitReader<'a> {
    bytes: &'a [u8],
    position: usize,
}

impl<'a> BitReader<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, position: 0 }
    }

    pub(crate) fn position(&self) -> usize {
        self.position
    }

    /// The length of the whole string in bytes.
    pub(crate) fn total_bytes(&self) -> usize {
        self.bytes.len()
    }

    /// The next bit; `None` past the end.
    pub(crate) fn bit(&mut self) -> Option<bool> {
        let byte = *self.bytes.get(self.position / 8)?;
        let bit = byte >> (7 - self.position % 8) & 1 == 1;
        self.position += 1;
        Some(bit)
    }

    /// The next `count` bits as a number, highest first.
    pub(crate) fn take(&mut self, count: u32) -> Option<u64> {
        (0..count).try_fold(0, |value, _| Some(value << 1 | u64::from(self.bit()?)))
    }

    /// The bytes after the one being read, if its unread bits are all zero.
    pub(crate) fn rest_of_bytes(mut self) -> Option<&'a [u8]> {
        while !self.position.is_multiple_of(8) {
            if self.bit()? {
                return None;
            }
        }
        self.bytes.get(self.position / 8..)
    }
}

/// Metres as whole decimetres, clamped to 24 bits in two's complement.
pub(crate) fn decimetres(metres: f64) -> i32 {
    (metres * 10.0).round().clamp(-8_388_608.0, 8_388_607.0) as i32
}

/// Appends the low 24 bits, big-endian.
pub(crate) fn put24(out: &mut Vec<u8>, value: u32) {
    out.extend_from_slice(value.to_be_bytes().get(1..).unwrap_or_default());
}

/// The bytes ended before the value did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the bytes end too early")]
pub struct Truncated;

/// Reads received bytes; it fails at their end and never panics. Multi-byte integers are big-endian.
#[derive(Debug, Clone)]
pub struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    /// A reader at the beginning of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// The bytes that are not yet read.
    pub fn rest(&self) -> &'a [u8] {
        self.0
    }

    /// The next `n` bytes, unchanged.
    pub fn take(&mut self, n: usize) -> Result<&'a [u8], Truncated> {
        let (head, tail) = self.0.split_at_checked(n).ok_or(Truncated)?;
        self.0 = tail;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Truncated> {
        let (head, tail) = self.0.split_first_chunk::<N>().ok_or(Truncated)?;
        self.0 = tail;
        Ok(*head)
    }

    /// The next byte as an unsigned number.
    pub fn u8(&mut self) -> Result<u8, Truncated> {
        self.array::<1>().map(|[b]| b)
    }

    /// The next byte in two's complement.
    pub fn i8(&mut self) -> Result<i8, Truncated> {
        self.u8().map(|b| b as i8)
    }

    /// The next two bytes as an unsigned number.
    pub fn u16(&mut self) -> Result<u16, Truncated> {
        self.array().map(u16::from_be_bytes)
    }

    /// The next two bytes in two's complement.
    pub fn i16(&mut self) -> Result<i16, Truncated> {
        self.array().map(i16::from_be_bytes)
    }

    /// The next three bytes as an unsigned number.
    pub fn u24(&mut self) -> Result<u32, Truncated> {
        self.array().map(|[a, b, c]| u32::from_be_bytes([0, a, b, c]))
    }

    /// The next three bytes in two's complement, sign-extended.
    pub fn i24(&mut self) -> Result<i32, Truncated> {
        self.u24().map(|v| ((v << 8) as i32) >> 8)
    }

    /// The next four bytes as an unsigned number.
    pub fn u32(&mut self) -> Result<u32, Truncated> {
        self.array().map(u32::from_be_bytes)
    }

    /// The next eight bytes as an unsigned number.
    pub fn u64(&mut self) -> Result<u64, Truncated> {
        self.array().map(u64::from_be_bytes)
    }
}

/// A point or a difference of points, in decimetres.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct DecimetreStep {
    pub(crate) x_dm: i32,
    pub(crate) y_dm: i32,
}

impl DecimetreStep {
    /// The difference from `from` to `self`.
    pub(crate) fn since(self, from: Self) -> Self {
        Self { x_dm: self.x_dm.wrapping_sub(from.x_dm), y_dm: self.y_dm.wrapping_sub(from.y_dm) }
    }

    pub(crate) fn plus(self, step: Self) -> Self {
        Self { x_dm: self.x_dm.wrapping_add(step.x_dm), y_dm: self.y_dm.wrapping_add(step.y_dm) }
    }

    /// Appends both coordinates in two's complement, `width` bits each.
    pub(crate) fn put(self, bits: &mut BitWriter, width: u32) {
        for v in [self.x_dm, self.y_dm] {
            bits.put(v as u32 as u64, width);
        }
    }

    pub(crate) fn take(bits: &mut BitReader<'_>, width: u32) -> Option<Self> {
        let mut signed = || bits.take(width).map(|v| ((v as u32) << (32 - width)) as i32 >> (32 - width));
        Some(Self { x_dm: signed()?, y_dm: signed()? })
    }
}

/// Reads the width that precedes differences of this width.
pub(crate) fn take_width(bits: &mut BitReader<'_>) -> Option<u32> {
    let width = bits.take(5)? as u32;
    (1..=25).contains(&width).then_some(width)
}

/// The bits of the largest number in two's complement, 1 to 25.
pub(crate) fn width_of(steps: impl IntoIterator<Item = DecimetreStep>) -> u32 {
    let bits = |v: i32| 33 - (v ^ (v >> 31)).leading_zeros();
    steps.into_iter().map(|s| bits(s.x_dm).max(bits(s.y_dm))).max().unwrap_or(1).min(25)
}

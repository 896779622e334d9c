//! Bit strings, most significant bit first.

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

//! Lines in an untrusted stream of bytes.

/// Collects the lines of a stream; longer lines than allowed are dropped and counted.
#[derive(Debug)]
pub struct Lines {
    collected: Vec<u8>,
    most: usize,
    is_overlong: bool,
    overlong: u64,
}

impl Lines {
    /// Lines of at most `most` bytes.
    pub fn new(most: usize) -> Self {
        Self { collected: Vec::new(), most, is_overlong: false, overlong: 0 }
    }

    /// Lines that were too long.
    pub fn overlong(&self) -> u64 {
        self.overlong
    }

    /// Drops a half line, for a stream that begins again.
    pub fn clear(&mut self) {
        self.collected.clear();
        self.is_overlong = false;
    }

    /// Takes bytes; calls `found` with each line, without its end.
    pub fn push(&mut self, bytes: &[u8], mut found: impl FnMut(&[u8])) {
        for &byte in bytes {
            if byte != b'\n' && byte != b'\r' {
                if self.collected.len() < self.most {
                    self.collected.push(byte);
                } else {
                    self.is_overlong = true;
                }
                continue;
            }
            if self.is_overlong {
                self.overlong += 1;
            } else if !self.collected.is_empty() {
                found(&self.collected);
            }
            self.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_out_whole_and_overlong_ones_are_counted() {
        let mut lines = Lines::new(5);
        let mut found = Vec::new();
        for piece in [&b"ab"[..], b"c\r\n\r\n123456", b"7\nxyz\n", b"half"] {
            lines.push(piece, |l| found.push(l.to_vec()));
        }
        assert_eq!(found, [b"abc".to_vec(), b"xyz".to_vec()]);
        assert_eq!(lines.overlong(), 1);
        lines.clear();
        lines.push(b"ok\n", |l| found.push(l.to_vec()));
        assert_eq!(found.last().unwrap(), b"ok");
    }
}

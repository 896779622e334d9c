//! The division of an object into symbols and blocks, and the erasure code of one block: any K of its symbols yield the K source
//! symbols.
//!
//! Systematic, maximum distance separable: I. S. Reed, G. Solomon, "Polynomial codes over certain finite fields", 1960.
//! Repair symbols are the rows of a Cauchy matrix; each square submatrix has an inverse in closed form:
//! J. Blömer et al., "An XOR-based erasure-resilient coding scheme", ICSI TR-95-048, 1995.

use super::MAX_OBJECT;
use super::gf256::{add_multiple, inverse, product};
use crc::{CRC_32_ISCSI, Crc};

static CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// The number and the size of the source symbols.
///
/// The source symbols in order are the object, 0 to 63 bytes of 0, a byte that counts them, and a CRC-32/ISCSI of all
/// that. Symbols are dealt to the blocks in turn, like cards: a lost run of symbols then takes the same number from
/// each block, and many blocks are as good as one large one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    sources: u16,
    symbol: u8,
}

/// The position of a symbol: its block, and its index among the block's source or repair symbols.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SymbolPlace {
    /// A piece of the object.
    Source(usize, u8),
    /// A combination of all source symbols of its block.
    Repair(usize, u8),
}

impl SymbolPlace {
    pub(super) fn block(self) -> usize {
        match self {
            Self::Source(block, _) | Self::Repair(block, _) => block,
        }
    }
}

impl Layout {
    /// Bytes after the object: the count of padding, and the CRC.
    pub(super) const TRAILER: usize = 5;
    pub(super) const MAX_SOURCES: usize = 2048;
    pub(super) const MAX_SYMBOL: usize = 64;
    /// The most source symbols of a block; this leaves at least as many repair symbols less one.
    const MAX_BLOCK_SOURCES: usize = 128;

    /// A layout; `None` if no object of 1..=[`MAX_OBJECT`] bytes has it.
    pub(super) fn new(sources: usize, symbol: usize) -> Option<Self> {
        let sound = (1..=Self::MAX_SOURCES).contains(&sources)
            && (1..=Self::MAX_SYMBOL).contains(&symbol)
            && sources * symbol > Self::TRAILER
            && (sources - 1) * symbol < MAX_OBJECT + Self::TRAILER;
        sound.then_some(Self { sources: sources as u16, symbol: symbol as u8 })
    }

    /// The layout for an object of `len` bytes in parts with `room` bytes of data; `None` if the room is too small.
    ///
    /// A part gets about 6 to 16 symbols, so that little is lost where a later frame has less room; of these sizes, the
    /// one that needs the fewest parts is chosen.
    pub(super) fn choose(len: usize, room: usize) -> Option<Self> {
        let total = len + Self::TRAILER;
        let part = room.min(total);
        let least = total.div_ceil(Self::MAX_SOURCES).max(part / 16).clamp(1, Self::MAX_SYMBOL);
        let most = (part / 6).max(least + 4).min(Self::MAX_SYMBOL).min(room);
        let cost = |&symbol: &usize| {
            let sources = total.div_ceil(symbol);
            (sources.div_ceil(room / symbol), sources * symbol, usize::MAX - symbol)
        };
        let symbol = (least..=most).min_by_key(cost)?;
        Self::new(total.div_ceil(symbol), symbol)
    }

    /// The number of source symbols, 1..=2048.
    pub fn sources(self) -> usize {
        usize::from(self.sources)
    }

    /// The size of a symbol in bytes, 1..=64.
    pub fn symbol(self) -> usize {
        usize::from(self.symbol)
    }

    /// The total size of the source symbols in bytes.
    pub(super) fn bytes(self) -> usize {
        self.sources() * self.symbol()
    }

    pub(super) fn blocks(self) -> usize {
        self.sources().div_ceil(Self::MAX_BLOCK_SOURCES)
    }

    pub(super) fn block_sources(self, block: usize) -> usize {
        (self.sources() + self.blocks() - 1 - block) / self.blocks()
    }

    fn block_repairs(self) -> usize {
        MAX_BLOCK - self.block_sources(0)
    }

    /// The number of symbols, source and repair, 255..=4080.
    pub fn symbols(self) -> usize {
        self.sources() + self.blocks() * self.block_repairs()
    }

    pub(super) fn block_symbols(self, block: usize) -> usize {
        self.block_sources(block) + self.block_repairs()
    }

    /// The position of a symbol; source symbols are numbered first.
    pub(super) fn place(self, symbol: usize) -> SymbolPlace {
        let blocks = self.blocks();
        match symbol.checked_sub(self.sources()) {
            None => SymbolPlace::Source(symbol % blocks, (symbol / blocks) as u8),
            Some(repair) => SymbolPlace::Repair(repair % blocks, (repair / blocks) as u8),
        }
    }

    /// The source symbols of a block in the bytes of all, each with its index in the block.
    pub(super) fn sources_of(self, block: usize, bytes: &[u8]) -> impl Iterator<Item = (u8, &[u8])> + Clone {
        let mine = bytes.chunks_exact(self.symbol()).skip(block).step_by(self.blocks());
        mine.enumerate().map(|(place, symbol)| (place as u8, symbol))
    }

    /// The least length of an object with this layout.
    pub(super) fn least_len(self) -> usize {
        (self.bytes() + 1).saturating_sub(Self::TRAILER + self.symbol()).max(1)
    }

    /// The greatest length of an object with this layout.
    pub(super) fn most_len(self) -> usize {
        (self.bytes() - Self::TRAILER).min(MAX_OBJECT)
    }

    /// Appends padding and CRC, so that the object has the bytes of all source symbols.
    pub(super) fn seal(self, object: &mut Vec<u8>) {
        let padding = self.bytes() - Self::TRAILER - object.len();
        object.resize(object.len() + padding, 0);
        object.push(padding as u8);
        let crc = CRC32.checksum(object);
        object.extend_from_slice(&crc.to_be_bytes());
    }

    /// The object in the bytes of all source symbols; `None` if the CRC does not match.
    pub(super) fn open(self, mut bytes: Vec<u8>) -> Option<Vec<u8>> {
        let crc = bytes.split_off(bytes.len().checked_sub(4)?);
        if crc != CRC32.checksum(&bytes).to_be_bytes() {
            return None;
        }
        let padding = usize::from(bytes.pop()?);
        let len = bytes.len().checked_sub(padding)?;
        bytes.truncate(len);
        (self.least_len()..=self.most_len()).contains(&len).then_some(bytes)
    }
}

/// The most symbols of a block, source and repair together.
pub(super) const MAX_BLOCK: usize = 255;

/// A symbol of a block with its index among the source symbols or among the repair symbols.
pub(super) type Placed<T> = (u8, T);

/// The coefficient of a source symbol in a repair symbol: 1 / (x + y) with x = 255 - `repair` and y = `source`, which
/// differ in a block of at most [`MAX_BLOCK`] symbols.
fn share(repair: u8, source: u8) -> u8 {
    inverse((255 - repair) ^ source)
}

/// Adds the repair symbol of `sources` to `to`.
pub(super) fn add_repair<'a>(to: &mut [u8], repair: u8, sources: impl Iterator<Item = Placed<&'a [u8]>>) {
    for (place, source) in sources {
        add_multiple(to, share(repair, place), source);
    }
}

/// The source symbols with the indices `missing`, in that order, from as many repair symbols
/// and all `known` source symbols.
pub(super) fn recover<'a>(
    missing: &[u8],
    mut repairs: Vec<Placed<Vec<u8>>>,
    known: impl Iterator<Item = Placed<&'a [u8]>> + Clone,
) -> Vec<Vec<u8>> {
    for (repair, symbol) in &mut repairs {
        add_repair(symbol, *repair, known.clone());
    }
    let rows: Vec<u8> = repairs.iter().map(|(repair, _)| 255 - repair).collect();
    let of_rows = factors(&rows, missing);
    let of_columns = factors(missing, &rows);
    let solve = |(&y, &v): (&u8, &u8)| {
        let mut source = vec![0; repairs.first().map_or(0, |(_, symbol)| symbol.len())];
        for ((&x, &u), (_, symbol)) in rows.iter().zip(&of_rows).zip(&repairs) {
            add_multiple(&mut source, product(product(u, v), inverse(x ^ y)), symbol);
        }
        source
    };
    missing.iter().zip(&of_columns).map(solve).collect()
}

/// For each of `these`, the product of its distances to all `others`, divided by those to the rest of `these`. The
/// inverse of the Cauchy matrix 1 / (x + y) has the elements u(x) v(y) / (x + y) of such factors.
fn factors(these: &[u8], others: &[u8]) -> Vec<u8> {
    let times = |a, b| product(a, b);
    let factor = |&this: &u8| {
        let over = others.iter().map(|other| this ^ other).fold(1, times);
        let under = these.iter().filter(|&&t| t != this).map(|t| this ^ t).fold(1, times);
        product(over, inverse(under))
    };
    these.iter().map(factor).collect()
}

#[cfg(test)]
#[allow(clippy::indexing_slicing, clippy::unwrap_used)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_small_image_fills_the_frames_it_takes() {
        let layout = |room| Layout::choose(700, room).map(|l| (l.sources(), l.symbol())).unwrap();
        assert_eq!(layout(9), (235, 3));
        assert_eq!(layout(44), (235, 3));
        assert_eq!(layout(240), (47, 15));
        assert_eq!(layout(995), (15, 47));
    }

    #[test]
    fn the_largest_object_fits_the_smallest_frame() {
        let layout = Layout::choose(MAX_OBJECT, 9).unwrap();
        assert_eq!((layout.symbol(), layout.blocks()), (9, 15));
        assert_eq!(Layout::choose(MAX_OBJECT, 8), None);
        assert_eq!(Layout::choose(1, 0), None);
    }

    proptest! {
        #[test]
        fn an_object_comes_back_from_its_symbols(object in proptest::collection::vec(any::<u8>(), 1..3000), room in 9usize..1100) {
            let layout = Layout::choose(object.len(), room).unwrap();
            let mut bytes = object.clone();
            layout.seal(&mut bytes);
            prop_assert_eq!(bytes.len(), layout.bytes());
            prop_assert_eq!(layout.open(bytes.clone()), Some(object));
            bytes[room % layout.bytes()] ^= 1;
            prop_assert_eq!(layout.open(bytes), None);
        }

        #[test]
        fn each_symbol_has_a_place_of_its_own(sources in 1usize..=2048, symbol in 8usize..=8) {
            let layout = Layout::new(sources, symbol);
            prop_assume!(layout.is_some());
            let layout = layout.unwrap();
            let mut seen = vec![0; layout.blocks()];
            for place in (0..layout.symbols()).map(|i| layout.place(i)) {
                let at = match place {
                    SymbolPlace::Source(block, place) => (block, usize::from(place)),
                    SymbolPlace::Repair(block, place) => (block, layout.block_sources(block) + usize::from(place)),
                };
                prop_assert_eq!(seen[at.0], at.1);
                seen[at.0] += 1;
            }
            for (block, &n) in seen.iter().enumerate() {
                prop_assert_eq!(n, layout.block_symbols(block));
                prop_assert!(n <= MAX_BLOCK && layout.block_sources(block) <= 128);
            }
            prop_assert!(layout.symbols() <= 4080);
        }
    }

    fn placed(sources: &[Vec<u8>]) -> impl Iterator<Item = Placed<&[u8]>> + Clone {
        sources.iter().enumerate().map(|(place, s)| (place as u8, s.as_slice()))
    }

    fn repair(sources: &[Vec<u8>], row: u8) -> Vec<u8> {
        let mut symbol = vec![0; sources[0].len()];
        add_repair(&mut symbol, row, placed(sources));
        symbol
    }

    /// Whether the block is recovered from these of its symbols, source symbols counted first.
    fn comes_back(sources: &[Vec<u8>], held: &[usize]) -> bool {
        let k = sources.len();
        let missing: Vec<u8> = (0..k).filter(|i| !held.contains(i)).map(|i| i as u8).collect();
        let rows = held.iter().filter(|&&i| i >= k).map(|i| (i - k) as u8);
        let repairs: Vec<_> = rows.map(|row| (row, repair(sources, row))).collect();
        let known = placed(sources).filter(|(place, _)| !missing.contains(place));
        let recovered = recover(&missing, repairs, known);
        missing.iter().zip(&recovered).all(|(&place, symbol)| sources[usize::from(place)] == *symbol)
            && missing.len() == recovered.len()
    }

    #[test]
    fn any_k_symbols_of_a_small_block_give_it_back() {
        for k in 1..=6usize {
            let sources: Vec<Vec<u8>> = (0..k).map(|i| vec![i as u8 * 37 + 1, 255 - i as u8, 0x5A]).collect();
            for n in k..=k + 5 {
                let choices = (0u32..1 << n).filter(|bits| bits.count_ones() as usize == k);
                for bits in choices {
                    let held: Vec<usize> = (0..n).filter(|i| bits >> i & 1 != 0).collect();
                    assert!(comes_back(&sources, &held), "{held:?} of {k}");
                }
            }
        }
    }

    #[test]
    fn golden_repair_symbols() {
        let sources = [vec![1, 0], vec![0, 1], vec![2, 3]];
        assert_eq!([repair(&sources, 0), repair(&sources, 1)], [[30, 98], [128, 124]]);
    }

    proptest! {
        #[test]
        fn any_k_symbols_of_a_large_block_give_it_back(
            k in 1usize..=200,
            order in Just((0..MAX_BLOCK).collect::<Vec<_>>()).prop_shuffle(),
            seed: u8,
        ) {
            let sources: Vec<Vec<u8>> = (0..k).map(|i| vec![seed.wrapping_add(i as u8), (i as u8).wrapping_mul(91)]).collect();
            prop_assert!(comes_back(&sources, &order[..k]));
        }
    }
}

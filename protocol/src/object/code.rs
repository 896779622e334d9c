//! The erasure code of one block: any K of its symbols yield the K source symbols.
//!
//! Systematic, maximum distance separable: I. S. Reed, G. Solomon, "Polynomial codes over certain finite fields", 1960.
//! Repair symbols are the rows of a Cauchy matrix; each square submatrix has an inverse in closed form:
//! J. Blömer et al., "An XOR-based erasure-resilient coding scheme", ICSI TR-95-048, 1995.

use super::gf256::{add_multiple, inverse, product};

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

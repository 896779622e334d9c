//! The tree of labels: which two become one at each coarser cut.

use super::parts::{TextAssembly, TextPart, TextSender};
use crate::bytes::{BitReader, BitWriter};
use crate::map::MAX_LABEL;
use std::collections::BTreeMap;

/// Merges of labels, the closest first, and the cut that separates best.
///
/// ```text
///    5      3      5       2w for each merge   0 to 7
/// +------+-----+---------+-------------------+-------
/// | n    | w-1 | clearest|  into, joins      | zeros
/// +------+-----+---------+-------------------+-------
/// ```
/// * n: merges, 1 to 31.
/// * w: bits of a label, the fewest that hold all.
/// * clearest: number of labels at the cut that separates best, 2 to n; 0: the finest does.
/// * into, joins: the label `joins`, 1 to 254, becomes one with the label `into`, which stands for both from then on. Neither has joined
///   another before.
///
/// Source: vehicle, whenever the tree has changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LabelTree {
    merges: Vec<(u8, u8)>,
    clearest: u8,
}

impl LabelTree {
    /// Most merges in a tree.
    pub const MAX_MERGES: usize = 31;

    /// A tree of merges, the closest first: the second label of each pair joins the first. `None` if they make no tree.
    pub fn new(merges: Vec<(u8, u8)>, clearest: Option<u8>) -> Option<Self> {
        let tree = Self { merges, clearest: clearest.unwrap_or(0) };
        tree.is_sound().then_some(tree)
    }

    fn is_sound(&self) -> bool {
        let mut has_joined = [false; 256];
        let mut joins = |&(into, joins): &(u8, u8)| {
            let are_labels = [into, joins].iter().all(|label| (1..=MAX_LABEL).contains(label));
            let stand = [into, joins].iter().all(|&label| has_joined.get(usize::from(label)) == Some(&false));
            if let Some(joined) = has_joined.get_mut(usize::from(joins)) {
                *joined = true;
            }
            are_labels && stand && into != joins
        };
        let counts = 2..=self.merges.len();
        let is_count = self.clearest == 0 || counts.contains(&usize::from(self.clearest));
        (1..=Self::MAX_MERGES).contains(&self.merges.len()) && self.merges.iter().all(&mut joins) && is_count
    }

    /// The merges, the closest first: the second label of each pair joins the first.
    pub fn merges(&self) -> &[(u8, u8)] {
        &self.merges
    }

    /// The number of labels at the cut that separates best, unless that is the finest one.
    pub fn clearest(&self) -> Option<u8> {
        (self.clearest > 0).then_some(self.clearest)
    }

    /// The label that stands for `label` when `count` of the labels of the tree are left, at least one.
    pub fn group_of(&self, label: u8, count: usize) -> u8 {
        let merged = (self.merges.len() + 1).saturating_sub(count.max(1));
        self.merges.iter().take(merged).fold(label, |label, &(into, joins)| if label == joins { into } else { label })
    }

    /// The label whose weight `label` has under an order that was applied when `highest` was the highest label: itself, or if it was
    /// assigned later the one of that time which it first becomes one with, the lowest of several.
    pub fn weighed_as(&self, label: u8, highest: u8) -> u8 {
        if label <= highest { label } else { self.nearest(label, highest).unwrap_or(label) }
    }

    /// The first label up to `highest` that `label` joins or is joined by; the lowest of several.
    fn nearest(&self, label: u8, highest: u8) -> Option<u8> {
        let mut own = vec![label];
        let mut groups: BTreeMap<u8, Vec<u8>> = BTreeMap::new();
        for &(into, joins) in &self.merges {
            let mut members = |of: u8| groups.remove(&of).unwrap_or_else(|| vec![of]);
            let [into_group, joined_group] = [members(into), members(joins)];
            if into_group.contains(&label) || joined_group.contains(&label) {
                let others = into_group.iter().chain(&joined_group).filter(|other| !own.contains(other));
                let found = others.copied().filter(|&other| other <= highest).min();
                if found.is_some() {
                    return found;
                }
            }
            let group = [into_group, joined_group].concat();
            if group.contains(&label) {
                own.clone_from(&group);
            }
            groups.insert(into, group);
        }
        None
    }

    /// The bytes on the wire.
    pub fn to_bytes(&self) -> Vec<u8> {
        let highest = self.merges.iter().flat_map(|&(into, joins)| [into, joins]).max().unwrap_or(1);
        let width = u8::BITS - highest.leading_zeros();
        let mut bits = BitWriter::default();
        bits.put(self.merges.len() as u64, 5);
        bits.put(u64::from(width) - 1, 3);
        bits.put(self.clearest.into(), 5);
        for &(into, joins) in &self.merges {
            bits.put(into.into(), width);
            bits.put(joins.into(), width);
        }
        bits.into_bytes()
    }

    /// Reads [`Self::to_bytes`]; `None` if they make no tree. Each tree has exactly one encoding.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut bits = BitReader::new(bytes);
        let (n, width, clearest) = (bits.take(5)?, bits.take(3)? as u32 + 1, bits.take(5)? as u8);
        let mut label = || Some(bits.take(width)? as u8);
        let merges = (0..n).map(|_| Some((label()?, label()?))).collect::<Option<_>>()?;
        let tree = Self { merges, clearest };
        (tree.is_sound() && tree.to_bytes() == bytes).then_some(tree)
    }
}

/// The vehicle's side: the newest tree, sent until it is known to have arrived.
#[derive(Debug, Default)]
pub struct TreeSource {
    tree: Option<(LabelTree, TextSender)>,
    version: u32,
}

impl TreeSource {
    /// Sets the tree; returns whether it is another one.
    pub fn set(&mut self, tree: &LabelTree) -> bool {
        let is_new = self.tree.as_ref().is_none_or(|(last, _)| last != tree);
        if is_new {
            let bytes = tree.to_bytes();
            (self.tree, self.version) = (Some((tree.clone(), TextSender::new(bytes))), self.version + 1);
        }
        is_new
    }

    /// Forgets the tree, because labels change their meaning.
    pub fn clear(&mut self) {
        self.tree = None;
    }

    /// The next chunk of at most `room` bytes, the version of its tree, and how many bytes of it the chunk has.
    pub fn next_chunk(&mut self, room: usize) -> Option<(Vec<u8>, (u32, usize))> {
        let (chunk, bytes) = self.tree.as_mut()?.1.next_part(room)?;
        Some((chunk, (self.version, bytes)))
    }

    /// The fate of a chunk is known.
    pub fn handle_fate(&mut self, (version, bytes): (u32, usize), delivered: bool) {
        if let Some((_, sender)) = self.tree.as_mut().filter(|_| version == self.version) {
            sender.handle_fate(bytes, delivered);
        }
    }

    /// The surface does not hold the tree any more.
    pub fn handle_peer_restart(&mut self) {
        self.version += 1;
        if let Some((_, sender)) = &mut self.tree {
            sender.handle_peer_restart();
        }
    }

    /// Bytes that may be sent now.
    pub fn backlog_bytes(&self) -> usize {
        self.tree.as_ref().map_or(0, |(_, sender)| sender.backlog_bytes())
    }

    /// Whether the surface is known to hold the tree.
    pub fn is_converged(&self) -> bool {
        self.tree.as_ref().is_none_or(|(_, sender)| sender.is_complete())
    }
}

/// The surface's side: the newest tree that has arrived.
#[derive(Debug, Default)]
pub struct TreeReplica {
    tree: Option<LabelTree>,
    parts: TextAssembly,
    /// The highest number of a frame with a part.
    number: u64,
}

impl TreeReplica {
    /// The newest tree; `None` until one has arrived.
    pub fn tree(&self) -> Option<&LabelTree> {
        self.tree.as_ref()
    }

    /// Takes a chunk of the frame `number`. `None` if it makes no sense, or does not continue the parts that are here; else whether a tree
    /// is complete with it. A chunk of an earlier frame than the last one has no effect.
    pub fn handle_chunk(&mut self, number: u64, chunk: &[u8]) -> Option<bool> {
        let part = TextPart::decode(chunk)?;
        if number < self.number {
            return Some(false);
        }
        self.number = number;
        let Some(bytes) = self.parts.take(&part, TextPart::SHORT_TEXT)? else { return Some(false) };
        self.tree = Some(LabelTree::from_bytes(&bytes)?);
        Some(true)
    }
}

// The largest tree is a text that can be sent.
const _: () = assert!((5 + 3 + 5 + 16 * LabelTree::MAX_MERGES).div_ceil(8) <= TextPart::SHORT_TEXT);

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn tree(merges: &[(u8, u8)], clearest: Option<u8>) -> LabelTree {
        LabelTree::new(merges.to_vec(), clearest).unwrap()
    }

    #[test]
    fn golden_bytes_of_a_tree() {
        // 00011 010 00010, then 001 100, 010 011, 001 010.
        let golden = tree(&[(1, 4), (2, 3), (1, 2)], Some(2));
        let bytes = [0x1A, 0x11, 0x89, 0x94];
        assert_eq!(golden.to_bytes(), bytes, "{:02X?}", golden.to_bytes());
        assert_eq!(LabelTree::from_bytes(&bytes), Some(golden));
    }

    #[test]
    fn labels_become_one_merge_by_merge() {
        let tree = tree(&[(1, 4), (2, 3), (1, 2)], None);
        let cut = |count| [1, 2, 3, 4, 9].map(|label| tree.group_of(label, count));
        assert_eq!((cut(4), cut(3)), ([1, 2, 3, 4, 9], [1, 2, 3, 1, 9]));
        assert_eq!((cut(2), cut(1), cut(0)), ([1, 2, 2, 1, 9], [1, 1, 1, 1, 9], [1, 1, 1, 1, 9]));
    }

    #[test]
    fn the_nearest_relative_is_the_one_that_is_joined_first() {
        let tree = tree(&[(1, 4), (5, 6), (2, 5), (1, 3), (1, 2)], None);
        let nearest = |label| tree.nearest(label, 3);
        assert_eq!([4, 5, 6, 1, 9].map(nearest), [Some(1), Some(2), Some(2), Some(3), None]);
        assert_eq!([4, 5, 6, 1, 9].map(|label| tree.weighed_as(label, 3)), [1, 2, 2, 1, 9]);
    }

    #[test]
    fn merges_that_make_no_tree_are_refused() {
        let many: Vec<(u8, u8)> = (2..=33).map(|label| (1, label)).collect();
        for merges in [&[][..], &[(1, 1)], &[(0, 1)], &[(1, 255)], &[(1, 2), (3, 2)], &[(1, 2), (2, 3)], &many] {
            assert_eq!(LabelTree::new(merges.to_vec(), None), None, "{merges:?}");
        }
        assert_eq!(LabelTree::new(vec![(1, 2), (1, 3)], Some(3)), None);
        assert!(LabelTree::new(many[1..].to_vec(), Some(31)).is_some());
    }

    #[test]
    fn a_later_tree_replaces_an_earlier_one_but_never_the_reverse() {
        let (mut source, mut replica) = (TreeSource::default(), TreeReplica::default());
        let [first, second] = [tree(&[(1, 2)], None), tree(&[(1, 3), (1, 2)], None)];
        assert!(source.set(&first) && !source.set(&first));
        let (early, carried) = source.next_chunk(60).unwrap();
        assert!(source.next_chunk(60).is_none() && source.set(&second));
        let (late, of_second) = source.next_chunk(60).unwrap();
        source.handle_fate(carried, true);
        assert!(!source.is_converged(), "the first tree is not the second");
        assert_eq!((replica.handle_chunk(9, &late), replica.handle_chunk(8, &early)), (Some(true), Some(false)));
        assert_eq!(replica.tree(), Some(&second));
        source.handle_fate(of_second, true);
        assert!(source.is_converged());
        source.handle_peer_restart();
        assert!(!source.is_converged() && source.backlog_bytes() > 0);
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..70)) {
            if let Some(tree) = LabelTree::from_bytes(&bytes) {
                prop_assert_eq!(tree.to_bytes(), bytes);
            }
        }

        #[test]
        fn a_tree_reads_back(labels in proptest::collection::btree_set(1u8..=254, 2..=32), choices in proptest::collection::vec(any::<u16>(), 64)) {
            let (mut left, mut merges) = (labels.into_iter().collect::<Vec<_>>(), Vec::new());
            for choice in choices.chunks(2) {
                if left.len() > 1 {
                    let joins = left.remove(usize::from(choice[0]) % left.len());
                    merges.push((left[usize::from(choice[1]) % left.len()], joins));
                }
            }
            let tree = LabelTree::new(merges, None).unwrap();
            let bytes = tree.to_bytes();
            prop_assert!(bytes.len() <= TextPart::SHORT_TEXT);
            prop_assert_eq!(LabelTree::from_bytes(&bytes), Some(tree));
        }
    }
}

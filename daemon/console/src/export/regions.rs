//! Label regions as polygons: the outlines of 4-connected patches of equal cells, with their holes.

use std::collections::BTreeMap;

/// Corners, in columns and rows from the south-west, the first one again at the end.
pub(super) type Ring = Vec<(u32, u32)>;
/// An outer ring, anticlockwise, then the holes, clockwise.
pub(super) type Polygon = Vec<Ring>;

/// East, north, west, south.
const STEPS: [(i64, i64); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];
const NONE: u32 = u32::MAX;

/// The polygons of each label but 0.
pub(super) fn regions(labels: &[u8], width: u32, height: u32) -> BTreeMap<u8, Vec<Polygon>> {
    let (patch, label) = patches(labels, width, height);
    let mut outlines = Outlines::new(&patch, width, height);
    let mut polygons: Vec<Polygon> = vec![Polygon::new(); label.len()];
    for start in 0..outlines.left.len() * 4 {
        if let Some((patch, ring)) = outlines.follow(start / 4, start % 4) {
            let at = if twice_area(&ring) > 0 { 0 } else { polygons[patch as usize].len() };
            polygons[patch as usize].insert(at, ring);
        }
    }
    let mut by_label: BTreeMap<u8, Vec<Polygon>> = BTreeMap::new();
    for (polygon, label) in polygons.into_iter().zip(label) {
        by_label.entry(label).or_default().push(polygon);
    }
    by_label
}

/// The patch of each cell, and the label of each patch.
fn patches(labels: &[u8], width: u32, height: u32) -> (Vec<u32>, Vec<u8>) {
    let (mut patch, mut label) = (vec![NONE; labels.len()], Vec::new());
    let mut open = Vec::new();
    for start in 0..labels.len() {
        if labels[start] == 0 || patch[start] != NONE {
            continue;
        }
        let id = label.len() as u32;
        label.push(labels[start]);
        patch[start] = id;
        open.push(start);
        while let Some(at) = open.pop() {
            for to in neighbours(at, width, height) {
                if patch[to] == NONE && labels[to] == labels[start] {
                    patch[to] = id;
                    open.push(to);
                }
            }
        }
    }
    (patch, label)
}

fn neighbours(at: usize, width: u32, height: u32) -> impl Iterator<Item = usize> {
    let (x, y) = ((at % width as usize) as i64, (at / width as usize) as i64);
    let inside = move |(dx, dy)| {
        let (x, y) = (x + dx, y + dy);
        let is_inside = (0..i64::from(width)).contains(&x) && (0..i64::from(height)).contains(&y);
        is_inside.then_some((y * i64::from(width) + x) as usize)
    };
    STEPS.into_iter().filter_map(inside)
}

/// The edges between patches, by the corner where each begins and its direction.
struct Outlines {
    /// The patch on the left of each edge.
    left: Vec<[u32; 4]>,
    taken: Vec<[bool; 4]>,
    corners: usize,
}

impl Outlines {
    fn new(patch: &[u32], width: u32, height: u32) -> Self {
        let corners = width as usize + 1;
        let count = corners * (height as usize + 1);
        let mut left = vec![[NONE; 4]; count];
        let of = |x: i64, y: i64| {
            let is_inside = (0..i64::from(width)).contains(&x) && (0..i64::from(height)).contains(&y);
            if is_inside { patch[y as usize * width as usize + x as usize] } else { NONE }
        };
        for (at, &id) in patch.iter().enumerate().filter(|(_, id)| **id != NONE) {
            let (x, y) = (at % width as usize, at / width as usize);
            // South, east, north and west side of the cell, walked anticlockwise.
            let begins = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
            let beyond = [(0, -1), (1, 0), (0, 1), (-1, 0)];
            for (step, ((cx, cy), (dx, dy))) in begins.into_iter().zip(beyond).enumerate() {
                if of(x as i64 + dx, y as i64 + dy) != id {
                    left[cy * corners + cx][step] = id;
                }
            }
        }
        Self { left, taken: vec![[false; 4]; count], corners }
    }

    /// Follows the ring from an edge that no other ring contains. Where two edges of the patch leave a corner, it takes the right
    /// turn, so that a ring never touches itself.
    fn follow(&mut self, corner: usize, step: usize) -> Option<(u32, Ring)> {
        let patch = self.left[corner][step];
        if patch == NONE || self.taken[corner][step] {
            return None;
        }
        let (mut at, mut to) = (corner, step);
        let mut ring = Ring::new();
        loop {
            self.taken[at][to] = true;
            let (dx, dy) = STEPS[to];
            at = (at as i64 + dy * self.corners as i64 + dx) as usize;
            let next = [3, 0, 1].map(|turn| (to + turn) % 4).into_iter().find(|&s| self.left[at][s] == patch)?;
            if next != to {
                ring.push(((at % self.corners) as u32, (at / self.corners) as u32));
            }
            to = next;
            if (at, to) == (corner, step) {
                break;
            }
        }
        ring.extend(ring.first().copied());
        Some((patch, ring))
    }
}

fn twice_area(ring: &Ring) -> i64 {
    let cross = |(a, b): (&(u32, u32), &(u32, u32))| i64::from(a.0) * i64::from(b.1) - i64::from(b.0) * i64::from(a.1);
    ring.iter().zip(ring.iter().skip(1)).map(cross).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_hole_that_touches_the_edge_stays_a_hole() {
        #[rustfmt::skip]
        let labels = [1, 1, 1,
                      1, 0, 1,
                      0, 1, 1];
        let regions = regions(&labels, 3, 3);
        let [polygon] = &regions[&1][..] else { panic!("one patch") };
        assert_eq!(polygon.len(), 2);
        assert_eq!((twice_area(&polygon[0]), twice_area(&polygon[1])), (16, -2));
    }

    proptest! {
        #[test]
        fn outlines_have_the_area_of_their_cells_and_are_simple(
            labels in proptest::collection::vec(0u8..4, 12 * 9)
        ) {
            for (label, polygons) in regions(&labels, 12, 9) {
                let area: i64 = polygons.iter().flatten().map(twice_area).sum();
                prop_assert_eq!(area, 2 * labels.iter().filter(|l| **l == label).count() as i64);
                for polygon in &polygons {
                    prop_assert!(twice_area(&polygon[0]) > 0 && polygon[1..].iter().all(|h| twice_area(h) < 0));
                    for ring in polygon {
                        let mut corners = ring[1..].to_vec();
                        corners.sort_unstable();
                        corners.dedup();
                        prop_assert_eq!(corners.len(), ring.len() - 1);
                    }
                }
            }
        }
    }
}

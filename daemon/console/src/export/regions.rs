//! Label regions as polygons: the outlines of 4-connected patches of equal cells, with their holes.

use scenecast_protocol::map::{Cell, REPLICA_TILE};
use std::collections::{BTreeMap, HashMap};

/// Corners, in columns and rows from the origin of the map, the first one again at the end.
pub(super) type Ring = Vec<(i64, i64)>;
/// An outer ring, anticlockwise, then the holes, clockwise.
pub(super) type Polygon = Vec<Ring>;

/// One cell to the east, north, west and south.
const STEPS: [(i64, i64); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];
const NONE: u32 = u32::MAX;
const TILE: i64 = REPLICA_TILE as i64;

/// Values by place, in tiles, so that their memory grows with the number of places and not with their extent.
struct Sparse<T> {
    tiles: BTreeMap<(i64, i64), Vec<T>>,
    none: T,
}

impl<T: Copy> Sparse<T> {
    fn new(none: T) -> Self {
        Self { tiles: BTreeMap::new(), none }
    }

    fn get(&self, x: i64, y: i64) -> T {
        let tile = self.tiles.get(&(y.div_euclid(TILE), x.div_euclid(TILE)));
        tile.map_or(self.none, |tile| tile[(y.rem_euclid(TILE) * TILE + x.rem_euclid(TILE)) as usize])
    }

    fn at(&mut self, x: i64, y: i64) -> &mut T {
        let none = self.none;
        let tile = self.tiles.entry((y.div_euclid(TILE), x.div_euclid(TILE)));
        let tile = tile.or_insert_with(|| vec![none; (TILE * TILE) as usize]);
        &mut tile[(y.rem_euclid(TILE) * TILE + x.rem_euclid(TILE)) as usize]
    }
}

/// The polygons of each label. Each cell is given once.
pub(super) fn regions(cells: impl Iterator<Item = (Cell, u8)>) -> BTreeMap<u8, Vec<Polygon>> {
    let cells: Vec<(i64, i64, u8)> = cells.map(|(c, label)| (i64::from(c.x), i64::from(c.y), label)).collect();
    let (patch, label) = patches(&cells);
    let mut outlines = Outlines::new(&cells, &patch);
    let mut polygons: Vec<Polygon> = vec![Polygon::new(); label.len()];
    for &(x, y, _) in &cells {
        // Each ring has a south or a north side of a cell, which begins at one of these corners.
        for (corner, step) in [((x, y), 0), ((x + 1, y + 1), 2)] {
            if let Some((patch, ring)) = outlines.follow(corner, step) {
                let at = if twice_area(&ring) > 0 { 0 } else { polygons[patch as usize].len() };
                polygons[patch as usize].insert(at, ring);
            }
        }
    }
    let mut by_label: BTreeMap<u8, Vec<Polygon>> = BTreeMap::new();
    for (polygon, label) in polygons.into_iter().zip(label) {
        by_label.entry(label).or_default().push(polygon);
    }
    by_label
}

/// The patch of each cell, and the label of each patch.
fn patches(cells: &[(i64, i64, u8)]) -> (Sparse<u32>, Vec<u8>) {
    let (mut patch, mut label) = (Sparse::new(NONE), Vec::new());
    let mut labels = Sparse::new(0u8);
    cells.iter().for_each(|&(x, y, label)| *labels.at(x, y) = label);
    let mut open = Vec::new();
    for &(x, y, own) in cells {
        if own == 0 || patch.get(x, y) != NONE {
            continue;
        }
        let id = label.len() as u32;
        label.push(own);
        *patch.at(x, y) = id;
        open.push((x, y));
        while let Some((x, y)) = open.pop() {
            for (dx, dy) in STEPS {
                let (x, y) = (x + dx, y + dy);
                if labels.get(x, y) == own && patch.get(x, y) == NONE {
                    *patch.at(x, y) = id;
                    open.push((x, y));
                }
            }
        }
    }
    (patch, label)
}

/// The edges that begin at a corner, by direction.
#[derive(Clone, Copy)]
struct Corner {
    /// The patch on the left of each edge.
    left: [u32; 4],
    taken: [bool; 4],
}

/// The edges between patches, by the corner where each begins and its direction.
struct Outlines {
    corners: HashMap<(i64, i64), Corner>,
}

impl Outlines {
    fn new(cells: &[(i64, i64, u8)], patch: &Sparse<u32>) -> Self {
        let mut corners: HashMap<(i64, i64), Corner> = HashMap::new();
        for &(x, y, _) in cells {
            let id = patch.get(x, y);
            // South, east, north and west side of the cell, walked anticlockwise.
            let begins = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
            let beyond = [(0, -1), (1, 0), (0, 1), (-1, 0)];
            for (step, (corner, (dx, dy))) in begins.into_iter().zip(beyond).enumerate() {
                if id != NONE && patch.get(x + dx, y + dy) != id {
                    let none = Corner { left: [NONE; 4], taken: [false; 4] };
                    corners.entry(corner).or_insert(none).left[step] = id;
                }
            }
        }
        Self { corners }
    }

    /// Follows the ring from an edge that no other ring contains. Where two edges of the patch leave a corner, it takes the right
    /// turn, so that a ring never touches itself.
    fn follow(&mut self, corner: (i64, i64), step: usize) -> Option<(u32, Ring)> {
        let first = self.corners.get(&corner)?;
        let patch = first.left[step];
        if patch == NONE || first.taken[step] {
            return None;
        }
        let (mut at, mut to) = (corner, step);
        let mut ring = Ring::new();
        loop {
            self.corners.get_mut(&at)?.taken[to] = true;
            let (dx, dy) = STEPS[to];
            at = (at.0 + dx, at.1 + dy);
            let left = self.corners.get(&at)?.left;
            let next = [3, 0, 1].map(|turn| (to + turn) % 4).into_iter().find(|&s| left[s] == patch)?;
            if next != to {
                ring.push(at);
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
    let cross = |(a, b): (&(i64, i64), &(i64, i64))| a.0 * b.1 - b.0 * a.1;
    // Relative to the first corner, since products of far corners are large.
    let (x, y) = ring.first().copied().unwrap_or_default();
    let ring: Ring = ring.iter().map(|&(cx, cy)| (cx - x, cy - y)).collect();
    ring.iter().zip(ring.iter().skip(1)).map(cross).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Rows of labels from a corner, without the cells of label 0.
    fn cells(labels: &[u8], width: i32, (x, y): (i32, i32)) -> impl Iterator<Item = (Cell, u8)> {
        let cell = move |at: i32| Cell::new(x + at % width, y + at / width);
        (0i32..).zip(labels).map(move |(at, &label)| (cell(at), label)).filter(|(_, label)| *label != 0)
    }

    #[test]
    fn a_hole_that_touches_the_edge_stays_a_hole() {
        #[rustfmt::skip]
        let labels = [1, 1, 1,
                      1, 0, 1,
                      0, 1, 1];
        let regions = regions(cells(&labels, 3, (62, -2)));
        let [polygon] = &regions[&1][..] else { panic!("one patch") };
        assert_eq!(polygon.len(), 2);
        assert_eq!((twice_area(&polygon[0]), twice_area(&polygon[1])), (16, -2));
    }

    proptest! {
        #[test]
        fn outlines_have_the_area_of_their_cells_and_are_simple(
            labels in proptest::collection::vec(0u8..4, 12 * 9)
        ) {
            for (label, polygons) in regions(cells(&labels, 12, (-5, 60))) {
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

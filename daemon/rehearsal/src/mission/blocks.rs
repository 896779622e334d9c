//! Blocks of coarse cells, as the operator's page shows them.

use scenecast_protocol::map::{Cell, LabelGrid, UNEXPLORED};

/// Cells of a block in each direction: a vehicle with a long backlog sends every fourth cell first.
const SIDE: i32 = 4;

/// A map as the page shows it: a coarse cell stands for the block of which only that cell was received. Where the finely sent
/// map may just end beside such a cell, another such block has to adjoin (`page/js/map/coarse.js`).
pub(super) fn with_blocks(map: &LabelGrid) -> LabelGrid {
    let is_known = |cell: Cell| map.get(cell) != UNEXPLORED;
    let shifted = |cell: Cell, (dx, dy): (i32, i32)| Cell::new(cell.x + dx, cell.y + dy);
    let is_coarse = |cell: Cell| cell.x.rem_euclid(SIDE) == 0 && cell.y.rem_euclid(SIDE) == 0;
    let block = || (0..SIDE).flat_map(|dy| (0..SIDE).map(move |dx| (dx, dy)));
    let is_alone = |cell: Cell| is_known(cell) && block().skip(1).all(|by| !is_known(shifted(cell, by)));
    let may_be_edge =
        |cell: Cell| [(-1, -1), (0, -1), (1, -1), (-1, 0), (-1, 1)].iter().any(|&by| is_known(shifted(cell, by)));
    let is_block = |cell: Cell| {
        let beside = || [(SIDE, 0), (-SIDE, 0), (0, SIDE), (0, -SIDE)].map(|by| shifted(cell, by));
        !may_be_edge(cell) || beside().into_iter().any(|other| is_alone(other) && !may_be_edge(other))
    };
    let mut shown = map.clone();
    for (cell, label) in map.iter().filter(|&(cell, _)| is_coarse(cell) && is_alone(cell) && is_block(cell)) {
        block().for_each(|by| _ = shown.set(shifted(cell, by), label));
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(cells: &[(i32, i32)]) -> LabelGrid {
        let mut map = LabelGrid::default();
        cells.iter().for_each(|&(x, y)| _ = map.set(Cell::new(x, y), 7));
        map
    }

    #[test]
    fn a_lone_coarse_cell_stands_for_its_block() {
        let shown = with_blocks(&labels(&[(-4, 8)]));
        assert_eq!(shown.iter().count(), 16);
        assert_eq!((shown.get(Cell::new(-1, 11)), shown.get(Cell::new(0, 8))), (7, UNEXPLORED));
    }

    #[test]
    fn a_cell_of_a_finely_sent_map_stands_for_itself() {
        for cells in [&[(1, 0)][..], &[(0, 0), (3, 2)], &[(0, 0), (-1, 0)]] {
            assert_eq!(with_blocks(&labels(cells)).iter().count(), cells.len(), "{cells:?}");
        }
    }
}

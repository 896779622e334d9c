//! The places of cells, with their neighbours.

/// Cells sorted by (y, x), numbered in this order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CellMap {
    places: Vec<(i32, i32)>,
    /// The first cell of each row, by y.
    rows: Vec<(i32, usize)>,
}

impl CellMap {
    /// `places` are (y, x), sorted.
    pub(crate) fn new(places: &[(i32, i32)]) -> Self {
        let mut rows: Vec<(i32, usize)> = Vec::new();
        for (cell, &(y, _)) in places.iter().enumerate() {
            if rows.last().is_none_or(|&(last, _)| last != y) {
                rows.push((y, cell));
            }
        }
        Self { places: places.to_vec(), rows }
    }

    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// Pairs of cells that share an edge, each once.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = (usize, usize)> {
        self.offset(0, 1).chain(self.offset(1, 0))
    }

    /// Pairs of each cell with the one `dy` rows and `dx` columns further, where both exist.
    pub(crate) fn offset(&self, dy: i32, dx: i32) -> impl Iterator<Item = (usize, usize)> {
        self.rows.iter().enumerate().flat_map(move |(row, &(y, first))| {
            let end = |row: usize| self.rows.get(row + 1).map_or(self.places.len(), |&(_, cell)| cell);
            let there = self.rows.binary_search_by_key(&y.saturating_add(dy), |&(y, _)| y).ok();
            let mut others = there.map_or(0..0, |row| self.rows[row].1..end(row)).peekable();
            (first..end(row)).filter_map(move |cell| {
                let x = self.places[cell].1.saturating_add(dx);
                while others.next_if(|&other| self.places[other].1 < x).is_some() {}
                others.next_if(|&other| self.places[other].1 == x).map(|other| (cell, other))
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_found_across_gaps() {
        // Rows 0 and 1, of which (0, 2) is missing; row 5 apart.
        let map = CellMap::new(&[(0, 0), (0, 1), (0, 3), (1, 0), (1, 1), (1, 2), (5, 1)]);
        assert_eq!(map.pairs().collect::<Vec<_>>(), [(0, 1), (3, 4), (4, 5), (0, 3), (1, 4)]);
        assert_eq!(map.offset(-1, 1).collect::<Vec<_>>(), [(3, 1), (5, 2)]);
        assert_eq!(map.len(), 7);
    }
}

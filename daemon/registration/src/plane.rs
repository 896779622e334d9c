//! A small image of numbers.

/// Numbers in rows from the top, with at least one column and one row.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Plane {
    columns: usize,
    values: Vec<f32>,
}

impl Plane {
    pub(crate) fn new(columns: usize, rows: usize) -> Self {
        Self { columns, values: vec![0.0; columns * rows] }
    }

    /// Values row by row; `None` unless they fill whole rows.
    pub(crate) fn from_values(columns: usize, values: Vec<f32>) -> Option<Self> {
        (columns > 0 && !values.is_empty() && values.len().is_multiple_of(columns)).then_some(Self { columns, values })
    }

    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    pub(crate) fn rows(&self) -> usize {
        self.values.len() / self.columns
    }

    pub(crate) fn values(&self) -> &[f32] {
        &self.values
    }

    pub(crate) fn values_mut(&mut self) -> &mut [f32] {
        &mut self.values
    }

    pub(crate) fn row(&self, row: usize) -> &[f32] {
        &self.values[row * self.columns..][..self.columns]
    }

    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [f32] {
        &mut self.values[row * self.columns..][..self.columns]
    }

    /// The root mean square of the values.
    pub(crate) fn rms(&self) -> f32 {
        (self.values.iter().map(|value| value * value).sum::<f32>() / self.values.len() as f32).sqrt()
    }

    /// The value between pixels, where the middle of the first pixel is (0, 0); `None` outside of the middles.
    #[inline]
    pub(crate) fn at(&self, x: f32, y: f32) -> Option<f32> {
        if !(x >= 0.0 && y >= 0.0) {
            return None;
        }
        let (left, top) = (x as usize, y as usize);
        if left + 1 >= self.columns {
            return None;
        }
        let first = top * self.columns + left;
        let upper = self.values.get(first..first + 2)?;
        let lower = self.values.get(first + self.columns..first + self.columns + 2)?;
        let (fx, fy) = (x - left as f32, y - top as f32);
        let upper = upper[0] + fx * (upper[1] - upper[0]);
        let lower = lower[0] + fx * (lower[1] - lower[0]);
        Some(upper + fy * (lower - upper))
    }

    /// The plane in half the columns and half the rows; a last odd one is left out.
    pub(crate) fn halved(&self) -> Self {
        let (columns, rows) = ((self.columns / 2).max(1), (self.rows() / 2).max(1));
        let mut half = Self::new(columns, rows);
        for row in 0..rows {
            let (upper, lower) = (self.row(2 * row), self.row((2 * row + 1).min(self.rows() - 1)));
            for (column, value) in half.row_mut(row).iter_mut().enumerate() {
                let (a, b) = (2 * column, (2 * column + 1).min(upper.len() - 1));
                *value = (upper[a] + upper[b] + lower[a] + lower[b]) / 4.0;
            }
        }
        half
    }

    /// The plane with columns as rows.
    fn transposed(&self) -> Self {
        let rows = self.rows();
        let mut other = Self::new(rows, self.columns);
        for (row, line) in self.values.chunks_exact(self.columns).enumerate() {
            for (column, value) in line.iter().enumerate() {
                other.values[column * rows + row] = *value;
            }
        }
        other
    }

    /// Three means over 2 x `reach` + 1 pixels in each direction: close to a Gaussian. The edges are continued.
    pub(crate) fn blurred(&self, reach: usize) -> Self {
        let mut smooth = self.clone();
        for _ in 0..2 {
            smooth = smooth.transposed();
            for row in 0..smooth.rows() {
                (0..3).for_each(|_| box_mean(smooth.row_mut(row), reach));
            }
        }
        smooth
    }

    /// Half the difference of the neighbours in a row and in a column; 0 at the edges.
    pub(crate) fn gradients(&self) -> [Self; 2] {
        let (columns, rows) = (self.columns, self.rows());
        let mut gradients = [Self::new(columns, rows), Self::new(columns, rows)];
        for y in 1..rows.saturating_sub(1) {
            let (above, line, below) = (self.row(y - 1), self.row(y), self.row(y + 1));
            for x in 1..columns.saturating_sub(1) {
                gradients[0].values[y * columns + x] = (line[x + 1] - line[x - 1]) / 2.0;
                gradients[1].values[y * columns + x] = (below[x] - above[x]) / 2.0;
            }
        }
        gradients
    }
}

fn box_mean(line: &mut [f32], reach: usize) {
    let source = line.to_vec();
    let last = source.len() - 1;
    let at = |i: usize| source[i.saturating_sub(reach).min(last)];
    let mut sum: f32 = (0..=2 * reach).map(at).sum();
    let norm = 1.0 / (2 * reach + 1) as f32;
    for (i, value) in line.iter_mut().enumerate() {
        *value = sum * norm;
        sum += at(i + 2 * reach + 1) - at(i);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slope_is_read_between_pixels_and_keeps_its_gradient() {
        let slope: Vec<f32> = (0..40 * 30).map(|i| 2.0 * (i % 40) as f32 - (i / 40) as f32).collect();
        let plane = Plane::from_values(40, slope).unwrap();
        assert!((plane.at(10.25, 7.5).unwrap() - 13.0).abs() < 1e-5);
        assert_eq!((plane.at(-0.1, 3.0), plane.at(39.5, 3.0), plane.at(3.0, 29.5)), (None, None, None));
        let [across, down] = plane.gradients();
        assert_eq!((across.row(9)[9], down.row(9)[9]), (2.0, -1.0));
        assert!((plane.blurred(3).at(20.0, 15.0).unwrap() - 25.0).abs() < 1e-3);
        assert!((plane.halved().at(5.0, 5.0).unwrap() - plane.at(10.5, 10.5).unwrap()).abs() < 1e-5);
    }

    #[test]
    fn only_whole_rows_make_a_plane() {
        assert!(Plane::from_values(3, vec![0.0; 7]).is_none());
        assert!(Plane::from_values(0, vec![]).is_none());
    }
}

//! A grey image in floating point, and its halvings.

/// Grey values, row by row from the top.
#[derive(Clone, Debug)]
pub(crate) struct GreyPlane {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) grey: Vec<f32>,
}

impl GreyPlane {
    /// The plane at full, half and quarter size.
    pub(crate) fn pyramid(full: GreyPlane) -> [GreyPlane; 3] {
        let half = full.halved();
        let quarter = half.halved();
        [full, half, quarter]
    }

    /// The means of 2 x 2 pixels. An odd last row or column is dropped unless it is the only one.
    fn halved(&self) -> GreyPlane {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let mut grey = Vec::with_capacity(width * height);
        for y in 0..height {
            let upper = &self.grey[2 * y * self.width..][..self.width];
            let lower = &self.grey[(2 * y + 1).min(self.height - 1) * self.width..][..self.width];
            if self.width == 1 {
                grey.push(0.5 * (upper[0] + lower[0]));
                continue;
            }
            let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
            grey.extend(pairs.map(|(a, b)| 0.25 * ((a[0] + a[1]) + (b[0] + b[1]))));
        }
        GreyPlane { width, height, grey }
    }

    /// The `SIDE` x `SIDE` pixels around a position; pixels at the border are repeated.
    pub(crate) fn patch<const SIDE: usize>(&self, x: f32, y: f32) -> [[f32; SIDE]; SIDE] {
        let (left, top) = (x as isize - SIDE as isize / 2, y as isize - SIDE as isize / 2);
        let mut patch = [[0.0; SIDE]; SIDE];
        let inside = left >= 0 && left as usize + SIDE <= self.width;
        for (row, line) in patch.iter_mut().enumerate() {
            let y = (top + row as isize).clamp(0, self.height as isize - 1) as usize;
            let source = &self.grey[y * self.width..][..self.width];
            if inside {
                line.copy_from_slice(&source[left as usize..][..SIDE]);
                continue;
            }
            for (column, pixel) in line.iter_mut().enumerate() {
                *pixel = source[(left + column as isize).clamp(0, self.width as isize - 1) as usize];
            }
        }
        patch
    }
}

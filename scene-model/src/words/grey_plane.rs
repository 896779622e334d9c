//! A grey image in floating point, and its halvings.

use image::RgbImage;

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

    /// The luma of a frame, 0 to 1, with the weights of Rec. 601.
    pub(crate) fn luma(frame: &RgbImage) -> Self {
        let pixels = frame.as_raw().as_chunks::<3>().0;
        let grey = |p: &[u8; 3]| 0.299 * f32::from(p[0]) + 0.587 * f32::from(p[1]) + 0.114 * f32::from(p[2]);
        let grey = pixels.iter().map(|pixel| grey(pixel) / 255.0).collect();
        Self { width: frame.width() as usize, height: frame.height() as usize, grey }
    }

    /// The plane after a symmetric filter in both directions, of which `taps` has the middle and one side; pixels at the border are
    /// repeated.
    pub(crate) fn filtered(&self, taps: &[f32]) -> Self {
        let (width, height) = (self.width, self.height);
        let mut lines = vec![0.0; self.grey.len()];
        for (line, out) in self.grey.chunks_exact(width).zip(lines.chunks_exact_mut(width)) {
            for (x, value) in out.iter_mut().enumerate() {
                let side = |k: usize| line[x.saturating_sub(k)] + line[(x + k).min(width - 1)];
                *value = taps[0] * line[x] + (1..taps.len()).map(|k| taps[k] * side(k)).sum::<f32>();
            }
        }
        let mut grey = vec![0.0; lines.len()];
        for (y, out) in grey.chunks_exact_mut(width).enumerate() {
            let mut add = |row: usize, tap: f32| {
                out.iter_mut().zip(&lines[row * width..][..width]).for_each(|(sum, value)| *sum += tap * value);
            };
            add(y, taps[0]);
            for (k, &tap) in taps.iter().enumerate().skip(1) {
                add(y.saturating_sub(k), tap);
                add((y + k).min(height - 1), tap);
            }
        }
        Self { width, height, grey }
    }

    /// The means of 2 x 2 pixels. An odd last row or column is dropped unless it is the only one.
    pub(crate) fn halved(&self) -> GreyPlane {
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

//! The heights of a made-up sea floor.

/// Heights on a grid, zero beyond it.
pub struct Relief {
    columns: usize,
    /// Metres.
    heights: Vec<f32>,
}

/// The south-west corner of the grid, its extent and its step, metres.
const CORNER_M: f64 = -8.0;
const EXTENT_M: f64 = 48.0;
const STEP_M: f64 = 0.05;

impl Relief {
    /// Smooth heights with a standard deviation of about `sigma_m` and bumps of 3 to 9 m. Each `kind` is another floor.
    pub fn new(sigma_m: f64, kind: u64) -> Self {
        if sigma_m <= 0.0 {
            return Self { columns: 0, heights: Vec::new() };
        }
        let columns = (EXTENT_M / STEP_M) as usize;
        let at = |i: usize| CORNER_M + i as f64 * STEP_M;
        let height = |i: usize| (sigma_m * waves(at(i % columns), at(i / columns), kind)) as f32;
        Self { columns, heights: (0..columns * columns).map(height).collect() }
    }

    pub fn is_flat(&self) -> bool {
        self.heights.is_empty()
    }

    pub fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        let (x, y) = ((x_m - CORNER_M) / STEP_M, (y_m - CORNER_M) / STEP_M);
        let most = (self.columns - 1) as f64;
        if !(0.0..most).contains(&x) || !(0.0..most).contains(&y) {
            return 0.0;
        }
        let (fx, fy) = (x.fract() as f32, y.fract() as f32);
        let lower = &self.heights[y as usize * self.columns + x as usize..];
        let upper = &lower[self.columns..];
        let mixed = |row: &[f32]| row[0] * (1.0 - fx) + row[1] * fx;
        f64::from(mixed(lower) * (1.0 - fy) + mixed(upper) * fy)
    }
}

/// Eight waves with a standard deviation of about 1 together.
fn waves(x_m: f64, y_m: f64, kind: u64) -> f64 {
    const WAVES: [[f64; 3]; 8] = [
        [0.71, 0.12, 0.3],
        [-0.2, 0.93, 1.7],
        [0.55, 0.61, 4.4],
        [1.1, -0.52, 2.9],
        [-0.83, 0.97, 5.1],
        [1.46, 0.7, 0.9],
        [0.4, -1.62, 3.6],
        [-1.3, -1.25, 2.2],
    ];
    let phase = |i: usize, phase: f64| phase + (kind as f64 * 1.7 * (i + 1) as f64) % std::f64::consts::TAU;
    let wave = |(i, [a, b, start]): (usize, &[f64; 3])| (a * x_m + b * y_m + phase(i, *start)).sin();
    WAVES.iter().enumerate().map(wave).sum::<f64>() / 2.0
}

//! A sample of the spatial Chinese Restaurant Process: one label for each patch of a grid.

use scene_model::random::CounterRng;

/// The prior weight of a label that no neighbour has.
const ALPHA: f64 = 0.01;
/// The weight of a new label.
const GAMMA: f64 = 0.06;
/// How often every patch is drawn again. With more sweeps the largest label would take over the grid.
const SWEEPS: usize = 3;
/// The exponent of the neighbours' count. A patch stands for many words, so a neighbour weighs more than one word does.
const SHARPNESS: i32 = 2;

/// The labels of a grid of patches, row by row.
#[derive(Clone, Debug)]
pub(crate) struct PatchLabels {
    columns: usize,
    rows: usize,
    labels: Vec<u8>,
}

impl PatchLabels {
    pub(crate) fn sample(key: u64, columns: usize, rows: usize, classes: u8) -> Self {
        let mut rng = CounterRng::new(key);
        let mut labels = Self { columns, rows, labels: vec![u8::MAX; columns * rows] };
        let mut sizes = vec![0usize; classes as usize];
        let mut order: Vec<usize> = (0..columns * rows).collect();
        for _ in 0..=SWEEPS {
            for i in (1..order.len()).rev() {
                order.swap(i, rng.below(i + 1));
            }
            for &place in &order {
                labels.draw(place, &mut sizes, &mut rng);
            }
        }
        labels
    }

    /// Draws the label of one patch given its neighbours: a label in use by its count there, a new one by gamma.
    fn draw(&mut self, place: usize, sizes: &mut [usize], rng: &mut CounterRng) {
        if let Some(size) = sizes.get_mut(self.labels[place] as usize) {
            *size -= 1;
        }
        let mut near = vec![0.0; sizes.len()];
        for other in self.neighbours(place) {
            if let Some(count) = near.get_mut(self.labels[other] as usize) {
                *count += 1.0;
            }
        }
        let unused = sizes.iter().position(|&size| size == 0);
        let weight = |label: usize| match sizes[label] {
            0 if unused == Some(label) => GAMMA,
            0 => 0.0,
            _ => f64::powi(near[label], SHARPNESS) + ALPHA,
        };
        let weights: Vec<f64> = (0..sizes.len()).map(weight).collect();
        let mut aim = rng.unit() * weights.iter().sum::<f64>();
        let label = weights.iter().position(|weight| {
            aim -= weight;
            aim < 0.0
        });
        let label = label.unwrap_or(0);
        self.labels[place] = label as u8;
        sizes[label] += 1;
    }

    fn neighbours(&self, place: usize) -> impl Iterator<Item = usize> + use<> {
        let (columns, rows) = (self.columns, self.rows);
        let (x, y) = (place % columns, place / columns);
        let left = (x > 0).then(|| place - 1);
        let right = (x + 1 < columns).then(|| place + 1);
        let above = (y > 0).then(|| place - columns);
        let below = (y + 1 < rows).then(|| place + columns);
        [left, right, above, below].into_iter().flatten()
    }

    /// The label at a position in patch units; beyond the border, the label at the border.
    #[inline]
    pub(crate) fn at(&self, x: f32, y: f32) -> u8 {
        let column = (x.max(0.0) as usize).min(self.columns - 1);
        let row = (y.max(0.0) as usize).min(self.rows - 1);
        self.labels[row * self.columns + column]
    }
}

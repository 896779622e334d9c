//! Transforms of planes.

use scenecast_fourier::{Complex32, PlaneFft};

#[test]
fn two_real_planes_share_a_transform() {
    let mut fft = PlaneFft::new(48, 32);
    let value = |i: usize, k: usize| ((i * k + i / 5) % 17) as f32 - 8.0;
    let both: Vec<Complex32> = (0..48 * 32).map(|i| Complex32::new(value(i, 7), value(i, 3))).collect();
    let mut spectrum = both.clone();
    fft.transform(&mut spectrum);
    for (part, k) in fft.separated(&spectrum).iter_mut().zip([7, 3]) {
        fft.restore(part);
        for (i, number) in part.iter().enumerate() {
            assert!((number.re / (48.0 * 32.0) - value(i, k)).abs() < 1e-3 && number.im.abs() < 1.0, "{i}: {number}");
        }
    }
}

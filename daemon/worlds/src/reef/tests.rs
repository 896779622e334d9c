use super::*;
use std::collections::BTreeMap;

fn view(x_m: f64, y_m: f64, moment: u64) -> View {
    View { x_m, y_m, heading_rad: 0.4, altitude_m: 4.0, width_px: 160, height_px: 120, moment }
}

/// The classes at points a metre apart over the survey's area.
fn surveyed(reef: &Reef) -> BTreeMap<u8, usize> {
    let [west, south, east, north] = Reef::SURVEY_M;
    let mut counts = BTreeMap::new();
    for column in 0..(east - west) as u32 {
        for row in 0..(north - south) as u32 {
            let class = reef.class_of_square(west + f64::from(column), south + f64::from(row), 0.5);
            *counts.entry(class).or_insert(0) += 1;
        }
    }
    counts
}

#[test]
fn the_same_seed_and_moment_give_the_same_frame() {
    let frame = |seed, moment| ReefCamera::new(Reef::new(seed), 0.02).frame(&view(58.0, 41.0, moment));
    assert_eq!(frame(3, 7), frame(3, 7));
    assert_ne!(frame(3, 7), frame(3, 8), "snow and noise differ from moment to moment");
    assert_ne!(frame(3, 7), frame(4, 7));
}

#[test]
fn a_frame_does_not_depend_on_what_was_seen_before() {
    let mut camera = ReefCamera::new(Reef::new(3), 0.02);
    for i in 0..40 {
        camera.frame(&view(20.0 + f64::from(i) * 2.0, 30.0, 0));
    }
    assert_eq!(camera.frame(&view(58.0, 41.0, 7)), ReefCamera::new(Reef::new(3), 0.02).frame(&view(58.0, 41.0, 7)));
}

#[test]
fn overlapping_views_show_the_same_floor() {
    let mut camera = ReefCamera::new(Reef::new(2), 0.02);
    let mut north = |x_m: f64, y_m: f64| {
        camera.clear_frame(&View {
            x_m,
            y_m,
            heading_rad: 0.0,
            altitude_m: 4.0,
            width_px: 160,
            height_px: 120,
            moment: 0,
        })
    };
    // 40 pixels of 2 cm to the east, 20 to the north.
    let (first, second) = (north(60.0, 40.0), north(60.8, 40.4));
    let mut differing = 0;
    for v in 0..100 {
        for u in 0..120 {
            let (a, b) = (first.get_pixel(u + 40, v), second.get_pixel(u, v + 20));
            differing += usize::from((0..3).any(|i| a[i].abs_diff(b[i]) > 1));
        }
    }
    assert!(differing < 12, "{differing} of 12 000 pixels differ");
}

#[test]
fn a_survey_meets_sand_meadow_and_reef() {
    for seed in 1..=20 {
        let counts = surveyed(&Reef::new(seed));
        let share = |classes: &[u8]| classes.iter().filter_map(|c| counts.get(c)).sum::<usize>() as f64 / 750.0;
        let shares = [share(&[SAND]), share(&[SEAGRASS]), share(&[CORAL, THICKET, ROCK])];
        assert!(shares.iter().all(|&share| share > 0.03), "seed {seed}: sand, seagrass, reef {shares:?}");
    }
}

#[test]
fn the_wreck_lies_at_the_edge_of_the_survey() {
    for seed in 1..=20 {
        let reef = Reef::new(seed);
        let [x, y] = reef.wreck_m();
        assert_eq!(reef.class_of_square(x - 0.5, y - 0.5, 1.0), WRECK, "seed {seed}");
        assert!(surveyed(&reef).get(&WRECK).is_some_and(|&n| n >= 5), "seed {seed}");
        let [west, south, east, north] = Reef::SURVEY_M;
        let inside = (x - west).min(east - x).min(y - south).min(north - y);
        assert!((0.0..6.0).contains(&inside), "seed {seed}: {inside} m from the edge");
    }
}

#[test]
fn habitats_are_larger_than_the_cameras_swath() {
    let group = |class: u8| match class {
        CORAL | THICKET | ROCK => CORAL,
        other => other,
    };
    let (mut metres, mut changes) = (0.0, 0);
    for seed in 1..=4 {
        let reef = Reef::new(seed);
        for row in 0..8 {
            let line: Vec<u8> = (0..60)
                .map(|i| group(reef.class_of_square(f64::from(i) * 2.0, f64::from(row) * 10.0 + 4.0, 2.0)))
                .collect();
            metres += 120.0;
            changes += line.windows(2).filter(|pair| pair[0] != pair[1]).count();
        }
    }
    let run = metres / (changes + 32) as f64;
    assert!((5.0..30.0).contains(&run), "mean run {run} m");
}

#[test]
fn the_depth_changes_without_steps() {
    let reef = Reef::new(5);
    let (mut low, mut high) = (f64::MAX, f64::MIN);
    for row in 0..16 {
        let depth = |i: i32| reef.relief_m(f64::from(i) * 0.1, f64::from(row) * 5.0);
        for i in 0..1200 {
            let (here, next) = (depth(i), depth(i + 1));
            assert!((next - here).abs() < 0.25, "{here} to {next} m within 10 cm");
            (low, high) = (low.min(here), high.max(here));
        }
    }
    assert!(high - low > 1.5, "the reef rises and the channel sinks: {low} to {high} m");
}

#[test]
fn classes_look_different() {
    let mut means = BTreeMap::<u8, ([f64; 3], f64)>::new();
    for seed in 1..=3 {
        let reef = Reef::new(seed);
        let [west, south, east, north] = Reef::SURVEY_M;
        let picture = reef.picture(west, south, (4.0 * (east - west)) as u32, (4.0 * (north - south)) as u32, 0.25);
        for (u, v, pixel) in picture.enumerate_pixels().filter(|(u, v, _)| u % 3 == 0 && v % 3 == 0) {
            let class = reef.class_of_square(west + f64::from(u) * 0.25, north - f64::from(v + 1) * 0.25, 0.25);
            let mean = means.entry(class).or_default();
            (0..3).for_each(|i| mean.0[i] += f64::from(pixel[i]));
            mean.1 += 1.0;
        }
    }
    let mean = |class: u8| means[&class].0.map(|sum| sum / means[&class].1);
    for (a, b) in [(SAND, SEAGRASS), (SAND, CORAL), (SEAGRASS, CORAL), (SAND, RUBBLE), (SAND, WRECK), (SEAGRASS, WRECK)]
    {
        let far: f64 = mean(a).iter().zip(mean(b)).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt();
        assert!(far > 15.0, "{} and {}: {:?} {:?}", NAMES[usize::from(a)], NAMES[usize::from(b)], mean(a), mean(b));
    }
}

#[test]
fn pictured_classes_are_those_of_the_places() {
    let reef = Reef::new(6);
    let [west, south] = reef.wreck_m().map(|middle| (middle - 1.0).round());
    let classes = reef.classes(west, south, 300, 200, 0.01);
    assert_eq!(classes.dimensions(), reef.picture(west, south, 300, 200, 0.01).dimensions());
    for (u, v, class) in classes.enumerate_pixels().filter(|(u, v, _)| u % 7 == 0 && v % 7 == 0) {
        let (x, y) = (west + (f64::from(u) + 0.5) * 0.01, south + (199.5 - f64::from(v)) * 0.01);
        assert_eq!(class[0], reef.class_at(x, y), "at {x} m east, {y} m north");
    }
}

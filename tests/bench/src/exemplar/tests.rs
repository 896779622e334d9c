//! Exemplars between a vehicle and a surface on a lossy link.

use super::arrival::{ArrivalSetting, ExemplarBench, LABELS};
use image::RgbImage;
use scenecast_protocol::directive::Budget;
use scenecast_protocol::schedule::{BackgroundOrder, Class, Shares};
use scenecast_protocol::time::Instant;
use scenecast_rehearsal::VirtualTime;
use scenecast_surface::{RequestKind, RequestState};

const IDLE: ArrivalSetting = ArrivalSetting { requests: 0, loss: 0.1, loaded: false, larger: false };

fn patch(i: u32) -> RgbImage {
    let grain = |x: u32, y: u32| (x * 7919 + y * 104_729 + x * y * (31 + i)) % 97 / 3;
    RgbImage::from_fn(128, 128, |x, y| {
        let shade = |c: u32| (60 + 20 * (i % 5) + c * x / 3 + grain(x, y)) as u8;
        image::Rgb([shade(0), shade(1), shade(2)])
    })
}

/// Ends after their handshake, with all background streams off.
fn bench(setting: ArrivalSetting, seed: u64) -> ExemplarBench {
    let patches: Vec<RgbImage> = (0..30).map(patch).collect();
    let mut bench = ExemplarBench::new(setting, &patches, seed).unwrap();
    let budget =
        Budget { bits_per_s: 10_000, shares: Shares::default(), background: BackgroundOrder::new(&[]).unwrap() };
    bench.vehicle.handle_budget(budget, bench.now);
    bench.run_until(Instant::from_secs_f64(60.0), |_| false);
    assert_eq!(exemplar_bytes(&bench), 0);
    bench
}

/// The operator orders background streams.
fn background(bench: &mut ExemplarBench, names: &[&str]) {
    let background = BackgroundOrder::from_names(names, &scenecast_protocol::map::LayerSet::default()).unwrap();
    bench.surface.surface_mut().set_budget(10_000, None, Some(background), bench.now).unwrap();
}

fn wait(bench: &mut ExemplarBench, seconds: f64) {
    let until = bench.now + std::time::Duration::from_secs_f64(seconds);
    bench.run_until(until, |_| false);
}

fn exemplar_bytes(bench: &ExemplarBench) -> u64 {
    bench.vehicle.vehicle().stats().bytes_by_class.get(&Class::Exemplar).copied().unwrap_or(0)
}

fn state(bench: &ExemplarBench, label: u8) -> Option<RequestState> {
    Some(bench.page(label)?.request?.state)
}

#[test]
fn a_small_image_grows_and_another_follows_after_the_survey() {
    let mut bench = bench(IDLE, 1);
    let (_, small) = bench.get(3, RequestKind::Another).unwrap().unwrap();
    let first = bench.page(3).unwrap().exemplar(None).unwrap().clone();
    assert!(small <= 700 && first.size == 0 && first.requested, "{small} bytes");
    let (_, large) = bench.get(3, RequestKind::Larger(None)).unwrap().unwrap();
    let pictures = &bench.page(3).unwrap().stored;
    assert!(large <= 2800 && large > small, "{large} bytes");
    assert_eq!(pictures.iter().map(|p| (p.number, p.size)).collect::<Vec<_>>(), [(first.number, 1)]);
    bench.get(3, RequestKind::Another).unwrap().unwrap();
    let numbers: Vec<u8> = bench.page(3).unwrap().stored.iter().map(|p| p.number).collect();
    assert!(numbers.len() == 2 && numbers[0] != numbers[1], "{numbers:?}");
}

#[test]
fn a_cancelled_image_costs_no_more_bits() {
    let loaded = ArrivalSetting { loaded: true, ..IDLE };
    // With this seed the first part of the image, which names its label, is not lost.
    let mut bench = bench(loaded, 1);
    bench.get(4, RequestKind::Another).unwrap().unwrap();
    bench.surface.surface_mut().request_exemplar(bench.address, 4, RequestKind::Larger(None), bench.now).unwrap();
    let until = bench.now + std::time::Duration::from_secs(120);
    assert!(bench.run_until(until, |w| matches!(state(w, 4), Some(RequestState::Arriving(..)))));
    let version = bench.surface.surface_mut().cancel_exemplar(bench.address, 4, bench.now).unwrap();
    let received =
        |w: &ExemplarBench| w.vehicle.vehicle().durable().inbox.records.iter().any(|r| r.versions[4] == Some(version));
    assert!(bench.run_until(until, received), "the vehicle receives the order");
    let then = exemplar_bytes(&bench);
    wait(&mut bench, 60.0);
    assert_eq!(exemplar_bytes(&bench), then);
    let page = bench.page(4).unwrap();
    assert_eq!((page.request, page.stored.len()), (None, 1), "the small one stays");
}

#[test]
fn a_vehicle_without_an_image_reports_so_and_sends_it_later() {
    let mut bench = bench(IDLE, 3);
    let gallery = bench.vehicle.vehicle().exemplars().clone();
    bench.vehicle.handle_exemplars(Default::default(), bench.now);
    bench.surface.surface_mut().request_exemplar(bench.address, 2, RequestKind::Another, bench.now).unwrap();
    let until = bench.now + std::time::Duration::from_secs(120);
    assert!(bench.run_until(until, |w| state(w, 2) == Some(RequestState::NoneYet)));
    wait(&mut bench, 60.0);
    assert_eq!(state(&bench, 2), Some(RequestState::NoneYet));
    bench.vehicle.handle_exemplars(gallery, bench.now);
    assert!(bench.run_until(until, |w| w.page(2).unwrap().stored.len() == 1));
    assert_eq!(state(&bench, 2), None);
}

#[test]
fn spare_capacity_shows_each_label_first_and_yields_to_requests() {
    let mut bench = bench(IDLE, 4);
    background(&mut bench, &["exemplars"]);
    let until = bench.now + std::time::Duration::from_secs(120);
    assert!(bench.run_until(until, |w| w.page(1).is_some_and(|p| !p.stored.is_empty())));
    let (seconds, _) = bench.get(LABELS, RequestKind::Another).unwrap().unwrap();
    assert!(seconds < 30.0, "{seconds} s");
    // Size class, and whether it was requested, of each image of a label.
    let shown = |w: &ExemplarBench, label: u8| {
        w.page(label).map_or(Vec::new(), |p| p.stored.iter().map(|p| (p.size, p.requested)).collect::<Vec<_>>())
    };
    let is_further = |w: &ExemplarBench| (1..LABELS).any(|n| !matches!(shown(w, n)[..], [] | [(0, false)]));
    assert!(bench.run_until(bench.now + std::time::Duration::from_secs(300), is_further));
    assert!((1..LABELS).all(|label| !shown(&bench, label).is_empty()), "each label before a further image of any");
    assert_eq!(shown(&bench, LABELS), [(0, true)]);
    wait(&mut bench, 600.0);
    for label in 1..=LABELS {
        let mut all = shown(&bench, label);
        all.sort();
        assert_eq!(all, [(1, false), (1, false), (1, label == LABELS)], "label {label}");
    }
    let then = exemplar_bytes(&bench);
    wait(&mut bench, 300.0);
    assert_eq!(exemplar_bytes(&bench), then, "three of each in their full size, no more");
}

#[test]
fn while_the_map_waits_background_images_get_only_frame_ends() {
    let loaded = ArrivalSetting { loaded: true, ..IDLE };
    let map_bytes = |names: &[&str]| {
        let mut bench = bench(loaded, 5);
        background(&mut bench, names);
        wait(&mut bench, 60.0);
        let map = bench.vehicle.vehicle().stats().bytes_by_class.get(&Class::Map).copied().unwrap_or(0);
        assert!(exemplar_bytes(&bench) < map / 100, "{} beside {map}", exemplar_bytes(&bench));
        map
    };
    let (without, with) = (map_bytes(&[]), map_bytes(&["exemplars"]));
    assert!(without > 50_000 && with.abs_diff(without) < without / 100, "{with} with, {without} without");
}

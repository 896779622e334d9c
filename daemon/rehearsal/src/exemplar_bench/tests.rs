//! Images of labels between a vehicle and a surface on a lossy link.

use super::arrival::{LABELS, Setting, Water};
use crate::VirtualTime;
use image::RgbImage;
use scenecast_protocol::directive::Budget;
use scenecast_protocol::schedule::{BackgroundOrder, Class, Shares};
use scenecast_protocol::time::Instant;
use scenecast_surface::{RequestKind, RequestState};

const IDLE: Setting = Setting { requests: 0, loss: 0.1, loaded: false, larger: false };

fn patch(i: u32) -> RgbImage {
    let grain = |x: u32, y: u32| (x * 7919 + y * 104_729 + x * y * (31 + i)) % 97 / 3;
    RgbImage::from_fn(128, 128, |x, y| {
        let shade = |c: u32| (60 + 20 * (i % 5) + c * x / 3 + grain(x, y)) as u8;
        image::Rgb([shade(0), shade(1), shade(2)])
    })
}

/// Ends that know each other; of what is left over nothing is spent.
fn water(setting: Setting, seed: u64) -> Water {
    let patches: Vec<RgbImage> = (0..30).map(patch).collect();
    let mut water = Water::new(setting, &patches, seed).unwrap();
    let budget =
        Budget { bits_per_s: 10_000, shares: Shares::default(), background: BackgroundOrder::new(&[]).unwrap() };
    water.vehicle.handle_budget(budget, water.now);
    water.run_until(Instant::from_secs_f64(120.0), |_| false);
    assert_eq!(exemplar_bytes(&water), 0);
    water
}

/// The operator says what left-over bits are spent on.
fn background(water: &mut Water, names: &[&str]) {
    let background = BackgroundOrder::from_names(names, &scenecast_protocol::map::LayerSet::default()).unwrap();
    water.surface.surface_mut().set_budget(10_000, None, Some(background), water.now).unwrap();
}

fn wait(water: &mut Water, seconds: f64) {
    let until = water.now + std::time::Duration::from_secs_f64(seconds);
    water.run_until(until, |_| false);
}

fn exemplar_bytes(water: &Water) -> u64 {
    water.vehicle.vehicle().stats().bytes_by_class.get(&Class::Exemplar).copied().unwrap_or(0)
}

fn state(water: &Water, label: u8) -> Option<RequestState> {
    Some(water.page(label)?.request?.state)
}

#[test]
fn a_small_image_grows_and_another_follows_after_the_survey() {
    let mut water = water(IDLE, 1);
    let (_, small) = water.get(3, RequestKind::Another).unwrap().unwrap();
    let first = water.page(3).unwrap().exemplar(None).unwrap().clone();
    assert!(small <= 700 && first.size == 0 && first.requested, "{small} bytes");
    let (_, large) = water.get(3, RequestKind::Larger(None)).unwrap().unwrap();
    let pictures = &water.page(3).unwrap().stored;
    assert!(large <= 2800 && large > small, "{large} bytes");
    assert_eq!(pictures.iter().map(|p| (p.number, p.size)).collect::<Vec<_>>(), [(first.number, 1)]);
    water.get(3, RequestKind::Another).unwrap().unwrap();
    let numbers: Vec<u8> = water.page(3).unwrap().stored.iter().map(|p| p.number).collect();
    assert!(numbers.len() == 2 && numbers[0] != numbers[1], "{numbers:?}");
}

#[test]
fn what_is_cancelled_costs_no_more_bits() {
    let loaded = Setting { loaded: true, ..IDLE };
    let mut water = water(loaded, 2);
    water.get(4, RequestKind::Another).unwrap().unwrap();
    water.surface.surface_mut().request_exemplar(water.address, 4, RequestKind::Larger(None), water.now).unwrap();
    let until = water.now + std::time::Duration::from_secs(120);
    assert!(water.run_until(until, |w| matches!(state(w, 4), Some(RequestState::Arriving(..)))));
    let version = water.surface.surface_mut().cancel_exemplar(water.address, 4, water.now).unwrap();
    let heard = |w: &Water| w.vehicle.vehicle().durable().inbox.versions[4] == Some(version);
    assert!(water.run_until(until, heard), "the vehicle hears of it");
    let then = exemplar_bytes(&water);
    wait(&mut water, 120.0);
    assert_eq!(exemplar_bytes(&water), then);
    let page = water.page(4).unwrap();
    assert_eq!((page.request, page.stored.len()), (None, 1), "the small one stays");
}

#[test]
fn a_vehicle_without_an_image_reports_so_and_sends_it_later() {
    let mut water = water(IDLE, 3);
    let gallery = water.vehicle.vehicle().exemplars().clone();
    water.vehicle.handle_exemplars(Default::default());
    water.surface.surface_mut().request_exemplar(water.address, 2, RequestKind::Another, water.now).unwrap();
    let until = water.now + std::time::Duration::from_secs(120);
    assert!(water.run_until(until, |w| state(w, 2) == Some(RequestState::NoneYet)));
    wait(&mut water, 60.0);
    assert_eq!(state(&water, 2), Some(RequestState::NoneYet));
    water.vehicle.handle_exemplars(gallery);
    assert!(water.run_until(until, |w| w.page(2).unwrap().stored.len() == 1));
    assert_eq!(state(&water, 2), None);
}

#[test]
fn spare_capacity_shows_every_label_once_and_yields_to_requests() {
    let mut water = water(IDLE, 4);
    background(&mut water, &["exemplars"]);
    let until = water.now + std::time::Duration::from_secs(120);
    assert!(water.run_until(until, |w| w.page(1).is_some_and(|p| !p.stored.is_empty())));
    let (seconds, _) = water.get(LABELS, RequestKind::Another).unwrap().unwrap();
    assert!(seconds < 30.0, "{seconds} s");
    wait(&mut water, 300.0);
    let shown = |label: u8| water.page(label).unwrap().stored.iter().map(|p| p.requested).collect::<Vec<_>>();
    assert!((1..LABELS).all(|label| shown(label) == [false]), "{:?}", (1..LABELS).map(shown).collect::<Vec<_>>());
    assert_eq!(shown(LABELS), [true]);
    let then = exemplar_bytes(&water);
    wait(&mut water, 300.0);
    assert_eq!(exemplar_bytes(&water), then, "each once");
}

#[test]
fn while_the_map_waits_background_images_get_only_frame_ends() {
    let loaded = Setting { loaded: true, ..IDLE };
    let map_bytes = |names: &[&str]| {
        let mut water = water(loaded, 5);
        background(&mut water, names);
        wait(&mut water, 120.0);
        let map = water.vehicle.vehicle().stats().bytes_by_class.get(&Class::Map).copied().unwrap_or(0);
        assert!(exemplar_bytes(&water) < map / 100, "{} beside {map}", exemplar_bytes(&water));
        map
    };
    let (without, with) = (map_bytes(&[]), map_bytes(&["exemplars"]));
    assert!(without > 100_000 && with.abs_diff(without) < without / 100, "{with} with, {without} without");
}

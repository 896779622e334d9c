//! The images of the sea floor that the operator gets show it, each at its place.

use super::tuned_tests::mission;
use image::RgbImage;
use image::imageops::{FilterType, resize};
use scenecast_protocol::time::Instant;
use scenecast_worlds::View;

/// Mean squared difference of the colours.
fn error(a: &RgbImage, b: &RgbImage) -> f64 {
    let squared = |(a, b): (&u8, &u8)| f64::from(a.abs_diff(*b)).powi(2);
    a.as_raw().iter().zip(b.as_raw()).map(squared).sum::<f64>() / a.as_raw().len() as f64
}

#[test]
fn the_images_of_the_floor_show_it_at_their_places() {
    let mut mission = mission(&["channel.loss=0.1"]);
    mission.advance(Instant::from_secs_f64(200.0)).unwrap();
    let views = &mission.surface().record(mission.address).unwrap().floor;
    let mut world = mission.world().clone();
    let pixel_m = mission.config().camera.metres_per_pixel;
    // The map lies on the world but for the drift of the first fixes.
    let placement = mission.surface().view(mission.address).unwrap().status().unwrap().0.placement;
    let (east_m, north_m) = placement.map_or((0.0, 0.0), |placement| placement.origin.xy());
    let (mut here, mut beside, mut whole) = (0.0, 0.0, 0);
    for (_, _, view) in views.iter() {
        let decoded = webp::Decoder::new(&view.webp).decode().unwrap();
        let image = RgbImage::from_raw(decoded.width(), decoded.height(), decoded.to_vec()).unwrap();
        let (x_m, y_m) = view.view.middle_m();
        let edge_px = (view.width_m().unwrap() / pixel_m).round() as u32;
        let mut truth = |east_m: f64| {
            let (x_m, y_m) = (x_m + east_m, y_m + north_m);
            let seen =
                View { x_m, y_m, heading_rad: 0.0, altitude_m: 3.0, width_px: edge_px, height_px: edge_px, moment: 0 };
            resize(&world.view(&seen), image.width(), image.height(), FilterType::Triangle)
        };
        here += error(&image, &truth(east_m));
        beside += error(&image, &truth(east_m + 0.5));
        whole += u32::from(image.width() == 128);
    }
    let count = views.count() as f64;
    assert!(views.count() > 30 && whole > 5, "{} views, {whole} whole", views.count());
    assert!(here / count < 0.5 * beside / count, "{} against {} half a metre beside", here / count, beside / count);
}

//! Map coding on procedural surveys.

use scenecast_protocol::map::{Cell, MapSource, Replica, StateReplica, StateSource};
use scenecast_protocol::map_codec::{ChunkFile, ChunkFileError, Codec, LabelRaster, decode, encode_all};
use scenecast_protocol::time::Instant;
use scenecast_training::{Flips, MapRng, MapScene, Survey, sampler_noise};
use std::time::Duration;

/// Maps of a small survey, one for each step.
fn survey(scene: MapScene) -> Vec<LabelRaster> {
    let scene = scene.draw(&mut MapRng::new(42), 96, 96, 8);
    let mut survey = Survey::new(7, scene, Flips { border: 10_000, anywhere: 2000, settling: 0 }, 12);
    let mut maps = vec![survey.map().clone()];
    for _ in 0..12 {
        survey.advance();
        maps.push(survey.map().clone());
    }
    maps
}

fn bytes(codec: Codec, maps: &[LabelRaster], room: usize) -> usize {
    let mut bytes = 0;
    for pair in maps.windows(2) {
        let (base, target) = (pair[0].to_grid(), pair[1].to_grid());
        let mut replica = base.clone();
        for chunk in encode_all(codec, &base, &target, room).expect("room for a cell") {
            assert!(chunk.bytes.len() <= room);
            bytes += chunk.bytes.len();
            for (cell, label) in decode(&base, &chunk.bytes).expect("own chunk") {
                assert_eq!(replica.set(cell, label), base.get(cell), "a cell was sent twice");
            }
        }
        assert_eq!(replica, target);
    }
    bytes
}

#[test]
fn a_survey_takes_far_fewer_bytes_than_with_png_chunks() {
    for scene in MapScene::ALL {
        let maps = survey(scene);
        for (room, most) in [(64, 60), (256, 60), (1000, 60)] {
            let (context, png) = (bytes(Codec::Auto, &maps, room), bytes(Codec::Png, &maps, room));
            assert!(context * 100 <= png * most, "{scene:?}, {room} bytes: {context} against {png}");
        }
    }
}

fn maps() -> (LabelRaster, LabelRaster) {
    let mut rng = MapRng::new(3);
    let before = MapScene::Colonies.draw(&mut rng, 60, 40, 6);
    let mut after = before.clone();
    sampler_noise(&mut rng, &mut after, 50_000, 10_000);
    (before, after)
}

#[test]
fn a_file_of_any_codec_turns_base_into_target() {
    let (before, after) = maps();
    for codec in [Codec::Auto, Codec::Png, Codec::Context] {
        let (file, changed) = ChunkFile::encode(codec, &before, &after, 64).unwrap();
        assert!(changed > 0 && file.chunks.len() > 1);
        let file = ChunkFile::from_bytes(&file.to_bytes()).unwrap();
        assert_eq!(file.apply(Some(&before)).unwrap(), after);
        let (still, _) = ChunkFile::encode(codec, &LabelRaster::uniform(60, 40, 0), &after, 200).unwrap();
        assert_eq!(still.apply(None).unwrap(), after);
    }
}

#[test]
fn files_cut_off_or_for_another_base_are_refused() {
    let (before, after) = maps();
    let bytes = ChunkFile::encode(Codec::Auto, &before, &after, 100).unwrap().0.to_bytes();
    for length in 0..bytes.len() {
        assert!(ChunkFile::from_bytes(bytes.get(..length).unwrap()).is_err());
    }
    let longer: Vec<u8> = bytes.iter().copied().chain([0]).collect();
    assert_eq!(ChunkFile::from_bytes(&longer), Err(ChunkFileError::Length));
    let file = ChunkFile::from_bytes(&bytes).unwrap();
    assert!(matches!(file.apply(Some(&LabelRaster::uniform(9, 9, 1))), Err(ChunkFileError::Size { .. })));
    assert_eq!(file.apply(Some(&LabelRaster::uniform(60, 40, 1))), Err(ChunkFileError::OtherBase));
    assert_eq!(file.apply(None), Err(ChunkFileError::OtherBase));
    for i in 0..bytes.len() * 8 {
        let mut damaged = bytes.clone();
        damaged[i / 8] ^= 1 << (i % 8);
        assert!(ChunkFile::from_bytes(&damaged).is_err(), "bit {i}");
    }
    let tiny = ChunkFile::encode(Codec::Auto, &before, &after, 3);
    assert_eq!(tiny, Err(ChunkFileError::Room(3)));
}

/// Bytes until the replica's painted map agrees with `share` of the target, and until it is equal.
fn bytes_until(share: f64, side: i32, coarse_after: Option<usize>, room: usize, scene: usize) -> (usize, usize) {
    let raster = MapScene::ALL[scene].draw(&mut MapRng::new(5), side as usize, side as usize, 8);
    let (mut source, mut replica, mut number) = (MapSource::new(Codec::Context), Replica::default(), 0);
    source.set_debounce(Duration::ZERO);
    source.set_coarse_limit(coarse_after);
    let label = |i: i32| raster.get((i % side) as usize, (i / side) as usize).max(1);
    source.set((0..side * side).map(|i| (Cell::new(i % side - 20, i / side), label(i))), Instant::ZERO);
    let (mut bytes, mut early) = (0, None);
    while let Some((chunk, carried)) = source.next_chunk(room, Instant::from_secs_f64(bytes as f64 / 125.0)) {
        bytes += chunk.len();
        number += 1;
        assert!(replica.apply(number, &chunk, Instant::ZERO));
        replica.advance_base(number);
        source.handle_fate(carried, true, Instant::ZERO);
        let painted = |&(cell, label): &(Cell, u8)| replica.painted(cell).is_some_and(|(l, _)| l == label);
        let agree = source.target().iter().filter(painted).count();
        if early.is_none() && agree as f64 >= share * f64::from(side * side) {
            early = Some(bytes);
        }
    }
    assert!(replica.shown() == source.target() && source.is_converged());
    (early.expect("equal in the end"), bytes)
}

#[test]
fn coarse_cells_first_show_the_whole_early_at_little_cost() {
    let mut total = (0, 0);
    for scene in 0..4 {
        let fine = bytes_until(0.6, 192, None, 256, scene);
        let coarse = bytes_until(0.6, 192, Some(3000), 256, scene);
        println!("scene {scene}: {fine:?} {coarse:?}");
        assert!(coarse.0 * 100 <= fine.0 * 90, "scene {scene}: {coarse:?} against {fine:?}");
        total = (total.0 + fine.1, total.1 + coarse.1);
    }
    assert!(total.1 * 100 <= total.0 * 115, "{total:?}");
}

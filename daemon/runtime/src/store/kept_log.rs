//! The log of the mission across restarts.

use super::refusing::{at, auv, start};
use crate::journal::disk::Disk;
use scenecast_protocol::time::Instant;
use scenecast_surface::{LogKind, MissionLog, Surface};

fn texts(surface: &Surface) -> Vec<(u64, String, Option<String>)> {
    surface.log().entries().map(|e| (e.number, e.text.clone(), e.by.clone())).collect()
}

#[test]
fn the_log_is_kept_and_continues_after_a_restart() {
    let disk = Disk::default();
    let (mut store, mut surface) = start(&disk, 0);
    let say = |surface: &mut Surface, text: &str| {
        surface.log_action(Some(auv()), LogKind::Order, "ann", text, Instant::ZERO);
    };
    say(&mut surface, "hold");
    store.commit(&mut surface, Some("ann"), at(1));
    say(&mut surface, "resume");
    store.commit(&mut surface, Some("ann"), at(2));
    drop(store);
    let (mut store, mut surface) = start(&disk, 3);
    let by = Some("ann".to_owned());
    assert_eq!(texts(&surface), [(1, "hold".to_owned(), by.clone()), (2, "resume".to_owned(), by)]);
    for number in 0..MissionLog::MAX {
        say(&mut surface, &number.to_string());
    }
    store.commit(&mut surface, Some("ann"), at(4));
    drop(store);
    let (_, surface) = start(&disk, 5);
    assert_eq!(surface.log().entries().next().map(|entry| entry.number), Some(3), "the oldest have gone");
    assert_eq!(surface.log().last(), MissionLog::MAX as u64 + 2);
}

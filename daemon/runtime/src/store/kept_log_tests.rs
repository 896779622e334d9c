//! The log of the mission and command across restarts.

use super::refusing_disk_tests::{at, auv, start};
use crate::journal::disk::Disk;
use scenecast_core::{ClientName, Giver, Principal, Role};
use scenecast_protocol::time::Instant;
use scenecast_surface::{CommandAction, LogKind, MissionLog, OrderKind, Surface};

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

fn operator(name: &str) -> Giver {
    Principal::new(name, Role::Operator).unwrap().into()
}

fn local(client: &str) -> Giver {
    Giver { principal: Principal::local(), client: ClientName::new(client).unwrap() }
}

/// Holder, requests and the number of changes.
fn shown(surface: &Surface, now: Instant) -> (Option<String>, Vec<String>, usize) {
    let command = surface.command();
    let holder = command.holder().map(|holder| holder.principal.name().to_owned());
    let requests = command.requests(now).map(|request| request.principal.name().to_owned()).collect();
    (holder, requests, command.changes().count())
}

#[test]
fn command_its_requests_and_its_history_survive_a_restart() {
    let (disk, now) = (Disk::default(), Instant::from_secs_f64(1.0));
    let (mut store, mut surface) = start(&disk, 0);
    surface.handle_accepted(&local("page-1"), OrderKind::Order, now);
    store.commit(&mut surface, Some("local"), at(1));
    surface.change_command(&operator("bo"), &CommandAction::Request, now).unwrap();
    store.commit(&mut surface, Some("bo"), at(2));
    assert_eq!(shown(&surface, now), (Some("local".to_owned()), vec!["bo".to_owned()], 2));
    drop(store);
    let (store, mut surface) = start(&disk, 3);
    let is_held = surface.command().check(&operator("bo"), OrderKind::Order, now).is_err();
    // Without tokens there is no principal "bo" any more.
    assert_eq!((is_held, shown(&surface, now)), (true, (Some("local".to_owned()), vec![], 2)));
    let release = |surface: &mut Surface, client| surface.change_command(&local(client), &CommandAction::Release, now);
    assert!(release(&mut surface, "page-2").is_err(), "it belongs to the client that took it");
    release(&mut surface, "page-1").unwrap();
    let mut store = store;
    store.commit(&mut surface, Some("local"), at(4));
    drop(store);
    assert_eq!(shown(&start(&disk, 5).1, now), (None, vec![], 3));
}

//! Layout of the status, and its refusals.

use super::*;
use crate::coordinates::WorldPoint;
use crate::directive::{InForceDigests, RefusalReason};
use proptest::prelude::*;

#[test]
fn golden_bytes_of_a_status() {
    let mut slots = [SlotReport::default(); SLOTS];
    slots[0] = SlotReport { version_low: 7, state: SlotState::Applied };
    slots[5] = SlotReport { version_low: 2, state: SlotState::Refused(RefusalReason::Malformed) };
    let status = VehicleStatus {
        mode: VehicleMode::Hold,
        autopilot_silent: false,
        reason: ModeReason::Fence,
        position: MapPoint::new(1.5, -0.1),
        depth_m: 18.0,
        heading_deg: 90.0,
        sigma_m: 1.25,
        fix_age_s: Some(8.0),
        waypoint: None,
        path: PlannedPath::default(),
        registration: None,
        faults: EquipmentFaults::default(),
        intent: None,
        trail: Vec::new(),
        explored_cells: 4000,
        epoch: 1,
        labels: 9,
        base_digest: 0xBEEF,
        budget_bps: 10_000,
        refused_frames: 3,
        backlog: Backlog { map_bytes: 448, other_bytes: 15 },
        slots,
        in_force: None,
        placement: None,
        disk: None,
    };
    let (pose, (report, _)) = (status.encode_pose(99), status.encode_report(99, 0).unwrap());
    assert_eq!(pose, [0x22, 0, 0, 15, 0xFF, 0xFF, 0xFF, 0, 180, 64, 5, 8, 0, 0x0F, 0xA0]);
    assert_eq!(report, [1, 9, 0xBE, 0xEF, 0x9C, 0x42, 3, 0xE5, 0xF0, 0b1000_0100, 0, 7, 2, 0x12]);
    let mut back = VehicleStatus { waypoint: Some(MapPoint::new(1.0, 2.0)), ..VehicleStatus::default() };
    back.read_pose(&pose).unwrap();
    back.read_report(&report).unwrap();
    assert_eq!(back, status);
    let helpless = VehicleStatus { autopilot_silent: true, ..status.clone() }.encode_pose(99);
    assert_eq!((helpless[0], &helpless[1..]), (0x2A, &pose[1..]));
    back.read_pose(&helpless).unwrap();
    assert!(std::mem::take(&mut back.autopilot_silent));
    let path = PlannedPath { points: vec![MapPoint::new(3.0, 2.0), MapPoint::new(3.0, 9.5)], continues: true };
    let going = VehicleStatus { waypoint: Some(MapPoint::new(1.0, -2.0)), path, ..status.clone() };
    let way = going.encode_pose(99);
    let (place, then) = ([0, 0, 10, 0xFF, 0xFF, 0xEC], [0xA4, 0x0A, 0x14, 0x00, 0x25, 0x80]);
    assert_eq!(way, [&[0x32], &pose[1..], &place, &then].concat());
    assert_eq!(going.encode_pose(24), [&way[..21], &[0x93, 0x94, 0x50]].concat(), "room for one");
    assert_eq!(going.encode_pose(22), [&way[..21], &[0x80]].concat(), "room to say that there is more");
    assert_eq!(going.encode_pose(21), way[..21], "no room for it");
    assert_eq!(VehicleStatus { waypoint: None, ..going.clone() }.encode_pose(99), pose, "no path to nowhere");
    back.read_pose(&way).unwrap();
    assert_eq!(back, going);
    assert_eq!(back.read_pose(&[&way[..], &[0]].concat()), Err(StatusError::BadField));
    back.read_pose(&pose).unwrap();
    assert_eq!(back, status, "it is not kept without its waypoint");
    // The report with these bits of its parts and the parts.
    let with = |bits: u8, tail: &[u8]| [&report[..10], &[report[10] | bits], &report[11..], tail].concat();
    let moved = [2, 0, 0, 125, 0xFF, 0xFF, 0xFF];
    let placement = Some(Placement { version: 2, origin: WorldPoint::new(12.5, -0.1) });
    let placed = VehicleStatus { placement, ..status.clone() };
    let (long, _) = placed.encode_report(99, 0).unwrap();
    assert_eq!(long, with(2, &moved));
    back.read_report(&long).unwrap();
    assert_eq!(back, placed);
    assert_eq!(placed.encode_report(long.len() - 1, 0).unwrap(), (report.clone(), SLOTS + 1), "no room for it");
    back.read_report(&placed.encode_report(18, SLOTS + 1).unwrap().0).unwrap();
    assert_eq!(back, placed);
    back.read_report(&report).unwrap();
    assert_eq!(back.placement, placement, "it has not moved back");
    let in_force = Some(InForceDigests::default().summary());
    let summed = VehicleStatus { in_force, ..placed.clone() };
    let (longest, _) = summed.encode_report(99, 0).unwrap();
    assert_eq!(longest, with(6, &[&[0, 0xA9, 0x6A], &moved[..]].concat()));
    back.read_report(&longest).unwrap();
    assert_eq!(back, summed);
    let (part, next) = summed.encode_report(report.len() + 9, 0).unwrap();
    assert_eq!((part, next), (with(4, &[0, 0xA9, 0x6A]), SLOTS + 1), "the placement waits");
    let disk = Some(DiskReport { journal_refused: true, checkpoint_refused: false, free_bytes: Some(1 << 30) });
    let full = VehicleStatus { disk, ..summed.clone() };
    let whole = with(7, &[&longest[report.len()..], &[0x4C]].concat());
    assert_eq!(full.encode_report(99, 0).unwrap(), (whole.clone(), 0));
    back.read_report(&whole).unwrap();
    assert_eq!(back, full);
    assert_eq!(full.encode_report(longest.len(), 0).unwrap(), (longest.clone(), SLOTS + 2), "the disk waits");
    back.read_report(&full.encode_report(12, SLOTS + 2).unwrap().0).unwrap();
    assert_eq!(back, full);
    back.read_report(&report).unwrap();
    assert_eq!(back.disk, disk, "a report without it changes it not");
    let refusal = |back: &mut VehicleStatus, bytes: &[u8]| back.read_report(bytes).unwrap_err();
    assert_eq!(refusal(&mut back, &with(4, &[0x01, 0, 0])), StatusError::BadField, "a reserved bit of the summary");
    assert_eq!(refusal(&mut back, &with(1, &[0x80])), StatusError::BadField, "that of the disk");
    assert_eq!(refusal(&mut back, &with(0x20, &[])), StatusError::BadField, "an eleventh slot");
    assert_eq!(refusal(&mut back, &with(1, &[])), StatusError::Length);
    assert_eq!(refusal(&mut back, &with(0, &[0])), StatusError::Length);
}

#[test]
fn golden_bytes_of_a_report_on_the_last_slots() {
    let mut status = VehicleStatus::default();
    status.slots[8] = SlotReport { version_low: 5, state: SlotState::Applied };
    status.slots[9] = SlotReport { version_low: 6, state: SlotState::Pending };
    let (report, _) = status.encode_report(99, 0).unwrap();
    assert_eq!(report, [0, 0, 0, 0, 0, 0, 0, 0, 0, 0x00, 0xC0, 5, 6, 0x1F]);
    let mut back = VehicleStatus::default();
    back.read_report(&report).unwrap();
    assert_eq!(back, status);
}

proptest! {
    #[test]
    fn any_bytes_decode_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..40)) {
        let mut status = VehicleStatus::default();
        if status.read_pose(&bytes).is_ok() {
            prop_assert_eq!(status.encode_pose(99), bytes.clone());
        }
        let _ = status.read_report(&bytes);
    }

    #[test]
    fn reports_of_any_size_cover_every_decided_slot(
        decided in proptest::collection::vec((any::<u8>(), 0u8..12), SLOTS),
        room in 0usize..30,
        (moved, summed, with_disk) in any::<(bool, bool, bool)>(),
    ) {
        let placement = moved.then_some(Placement { version: 1, origin: WorldPoint::new(2.5, -7.0) });
        let in_force = summed.then(|| InForceDigests::default().summary());
        let disk = with_disk.then_some(DiskReport { free_bytes: Some(0), ..DiskReport::default() });
        let mut status = VehicleStatus { budget_bps: 100, in_force, placement, disk, ..VehicleStatus::default() };
        for (slot, (version_low, code)) in status.slots.iter_mut().zip(decided) {
            let state = SlotState::from_code(code).unwrap();
            let version_low = if state == SlotState::Unknown { 0 } else { version_low };
            *slot = SlotReport { version_low, state };
        }
        let (mut received, mut first) = (VehicleStatus::default(), 0);
        for _ in 0..=SLOTS + 3 {
            let Some((bytes, next)) = status.encode_report(room, first) else {
                prop_assert!(room < 13);
                return Ok(());
            };
            prop_assert!(bytes.len() <= room.max(11));
            received.read_report(&bytes).unwrap();
            first = next;
            if first == 0 {
                break;
            }
        }
        // An item without room in a report of its own is left out.
        status.in_force = in_force.filter(|_| room >= 14);
        status.placement = placement.filter(|_| room >= 18);
        status.disk = disk.filter(|_| room >= 12);
        prop_assert_eq!((first, received), (0, status));
    }

    #[test]
    fn a_rate_comes_back_within_a_thousandth(rate in 1u32..10_000_000) {
        let back = decode_rate(code_rate(rate));
        prop_assert!(back <= rate && rate - back <= rate / 1000, "{} became {}", rate, back);
    }
}

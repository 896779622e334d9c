//! The parts of a frame: fields of the header, layer chunks, status and slots.

use super::Rows;
use super::files::{assert_file, named};
use super::samples::{auv, clock, crc, frame, header, hold, map_payload, place, status, vehicle_stamp};
use scenecast_protocol::coordinates::{DecimetrePoint, MapPoint, WorldPoint};
use scenecast_protocol::directive::{
    Areas, AtEnd, Band, Budget, CellBand, Change, Constraints, Destination, ExemplarRequest, ExemplarRequests, Fence,
    Fix, InForceDigests, InForcePart, Limits, PlannerKind, Polygon, Reaction, Registration, Settings, ShortDecimal,
    Slot, SlotId, Utility, VersionedSlot, WeightedArea,
};
use scenecast_protocol::map::{
    Cell, ClassChunk, ClassEntry, LabelGrid, LabelTree, LayerChunk, LayerDescriptor, LayerId, LayerMask, LayerSet,
    TextPart, TreeSource,
};
use scenecast_protocol::map_codec;
use scenecast_protocol::schedule::{BackgroundOrder, BackgroundStream, Shares};
use scenecast_protocol::wire::{
    AckForm, AckStatement, Address, ChunkKind, DiskReport, EquipmentFaults, FrameTie, Header, Intent, Placement,
    PlannedPath, PoseDetails, Reader, RegistrationReport, Stamp, Trail, TrailCorner, VehicleStatus,
};

#[test]
fn parts_of_a_frame_are_those_of_the_vectors() {
    let changes = map_codec::decode(&LabelGrid::default(), &map_payload()).expect("a sound chunk");
    assert_eq!(changes, [(Cell::new(-1, 2), 7), (Cell::new(0, 2), 1)]);
    let parts = [header_fields(), layer_chunks(), status_chunks(), orders(), settings_and_budgets()].concat();
    assert_file("parts.json", &named(parts));
    let near = |base: u16, number: u64, highest: u64| {
        Header::numbered(auv(), Address::SURFACE, number, base).number_near(highest)
    };
    assert_eq!((near(9, 3, 250), near(9, 250, 259)), (259, 250));
    assert_eq!((near(128, 3, 65_530), near(128, 65_530, 65_540)), (65_539, 65_530));
}

fn header_fields() -> Rows {
    /// Bytes of a header with a base of up to 3 and nothing optional.
    const HEADER: usize = 3;
    let in_frame = |header: Header, from: usize, to: usize| {
        frame(header.clone(), 2000, true, crc(header.from, 9), &[])[from..to].to_vec()
    };
    let base = |base: u16, bytes: usize| in_frame(Header { base, ..header(auv(), 9) }, 2, 2 + bytes);
    let stamp = |from: Address, stamp: Stamp, bytes: usize| {
        in_frame(Header { stamp: Some(stamp), ..header(from, 9) }, HEADER, HEADER + bytes)
    };
    let statement = |horizon: u64, lost: Vec<u16>, form: AckForm| {
        let (statement, mut bytes) = (AckStatement::new(horizon, lost, form), Vec::new());
        assert!(statement.encode(99, &mut bytes));
        assert_eq!(AckStatement::decode(&mut Reader::new(&bytes)), Ok(statement));
        bytes
    };
    let head = |payload: usize, head: usize, is_full: bool| {
        let size = if is_full { HEADER + head + payload + 4 } else { 1024 };
        // The last chunk of a short frame has no second byte.
        let after = if is_full { None } else { Some((ChunkKind::Map, vec![9])) };
        let chunks: Vec<_> = [(ChunkKind::Map, vec![9; payload])].into_iter().chain(after).collect();
        frame(header(auv(), 9), size, true, crc(auv(), 9), &chunks)[HEADER..HEADER + head].to_vec()
    };
    vec![
        ("base 4", base(4, 1)),
        ("base 127", base(127, 1)),
        ("base 128", base(128, 2)),
        ("base 2048", base(2048, 2)),
        (
            "stamp of the surface: clock 66 051 ms, one way 667 ms",
            stamp(Address::SURFACE, clock(66_051, Some(667)).expect("a stamp"), 5),
        ),
        (
            "stamp of the surface: clock 1 ms, one way not known",
            stamp(Address::SURFACE, clock(1, None).expect("a stamp"), 5),
        ),
        (
            "stamp of a vehicle: clock 16 777 215 ms, frame 9 received 258 ms before",
            stamp(auv(), vehicle_stamp(16_777_215, 9, 258), 6),
        ),
        ("statement: horizon low C, no loss", statement(0xABC, vec![], AckForm::Near)),
        ("statement: horizon 7, lost 6 and 4 (distances 1 and 3)", statement(7, vec![1, 3], AckForm::Near)),
        ("statement: horizon low ABC, no loss, far", statement(0xABC, vec![], AckForm::Far)),
        ("statement: horizon 7, lost 6 and 3 (distances 1 and 4), a bitmap", statement(7, vec![1, 4], AckForm::Near)),
        (
            "statement: horizon 30, lost 10 and 5 (distances 20 and 25), a Rice code",
            statement(30, vec![20, 25], AckForm::Near),
        ),
        ("head of a map chunk that fills the rest of a full frame", head(200, 1, true)),
        ("head of a map chunk of 26 bytes", head(26, 1, false)),
        ("head of a map chunk of 27 bytes", head(27, 2, false)),
        ("head of a map chunk of 300 bytes", head(300, 2, false)),
    ]
}

fn layer_chunks() -> Rows {
    let layer = |chunk: LayerChunk<'_>| {
        let bytes = chunk.encode();
        assert_eq!(LayerChunk::decode(&bytes), Some(chunk));
        bytes
    };
    let built_in = LayerSet::default();
    let [confidence, curiosity] = [LayerId::CONFIDENCE, LayerId::CURIOSITY].map(|id| built_in.get(id).unwrap());
    let depth = LayerDescriptor::depth_around(75.5, 0.5);
    assert_eq!((depth.bounds(1), confidence.bounds(4)), (Some((12.0, 12.5)), Some((0.75, 1.0))));
    let part = |descriptor: &LayerDescriptor, from: usize, to: usize| {
        let bytes = descriptor.to_bytes();
        let part = TextPart {
            digest: descriptor.digest(),
            first: from as u16,
            is_last: to == bytes.len(),
            bytes: &bytes[from..to],
        };
        layer(LayerChunk::Descriptor(built_in.id(&descriptor.name).unwrap(), part))
    };
    let whole = |descriptor: &LayerDescriptor| part(descriptor, 0, descriptor.to_bytes().len());
    let digest = 0x27A6 ^ confidence.digest();
    let named = |label: u8, name: &str, colour: Option<[u8; 3]>, to: Option<usize>| {
        let entry = ClassEntry::new(label, name, colour).unwrap().to_bytes();
        let (digest, is_last) = (TextPart::digest_of(&entry), to.is_none());
        let part = TextPart { digest, first: 0, is_last, bytes: &entry[..to.unwrap_or(entry.len())] };
        let bytes = ClassChunk { label, part }.encode();
        assert_eq!(ClassChunk::decode(&bytes).map(|chunk| chunk.encode()), Some(bytes.clone()));
        bytes
    };
    let mut tree = TreeSource::default();
    tree.set(&LabelTree::new(vec![(1, 4), (2, 3), (1, 2)], Some(2)).unwrap());
    let (tree, _) = tree.next_chunk(60).unwrap();
    vec![
        ("layer chunk: confidence announced, quarters of 0 to 1", whole(confidence)),
        ("layer chunk: depth announced, steps of 0.5 m, level 1 from 12 m on", whole(&depth)),
        ("the same in two chunks, the first", part(&depth, 0, 10)),
        ("the second", part(&depth, 10, 19)),
        ("layer chunk: curiosity announced, whole bits", whole(curiosity)),
        (
            "part of the name of a label: label 3 is \"sand\", colour E0C080",
            named(3, "sand", Some([0xE0, 0xC0, 0x80]), None),
        ),
        ("part of the name of a label: label 254 is \"é\", no colour, the first byte", named(254, "é", None, Some(1))),
        ("part of the tree of labels: 4 joins 1, 3 joins 2, 2 joins 1; two labels separate best", tree),
        ("head of a layer chunk: a patch of confidence", layer(LayerChunk::Patch(LayerId::CONFIDENCE, &[]))),
        (
            "layer chunk: the digest of confidence, of levels with the digest 27A6",
            layer(LayerChunk::Digest(LayerId::CONFIDENCE, digest)),
        ),
    ]
}

fn status_chunks() -> Rows {
    let utility = |id: SlotId| if id == SlotId::Utility { 0xABCD } else { 0 };
    let inquiry = InForceDigests::from_fn(utility).encode();
    let pose = |waypoint: Option<(f64, f64)>, path: &[(f64, f64)], continues: bool| {
        let point = |(x_m, y_m)| MapPoint { x_m, y_m };
        let path = PlannedPath { points: path.iter().copied().map(point).collect(), continues };
        let bytes = VehicleStatus { waypoint: waypoint.map(point), path, ..status() }.encode_pose(99);
        assert_eq!(VehicleStatus::default().read_pose(&bytes), Ok(()));
        bytes
    };
    let (tie, share) = (FrameTie::EarlierTrack, 1.0 / 3.0);
    let registration = RegistrationReport { tie, share, sigma_m: 0.1, closed: 258 };
    let faults = EquipmentFaults { camera_silent: true, autopilot_refuses: true, ..EquipmentFaults::default() };
    let corner = |ago_s, x_m, y_m| TrailCorner { ago_s, place: MapPoint::new(x_m, y_m) };
    let trail = Trail::new(MapPoint::new(1.0, -2.0), &[corner(9, 2.4, -3.4), corner(12, -0.6, -3.4)], 99);
    let intent = |intent| PoseDetails { intent: Some(intent), ..PoseDetails::default() };
    let details = |details: PoseDetails| {
        let bytes = details.encode();
        assert_eq!(PoseDetails::decode(&bytes), Ok(details));
        bytes
    };
    vec![
        (
            "pose: hold by order, x 1.5 m, y -0.1 m, depth 18 m, heading 90 degrees, sigma 1.25 m, fix 8 s ago, 4000 cells",
            pose(None, &[], false),
        ),
        ("the same with a waypoint at (1, -2) m", pose(Some((1.0, -2.0)), &[], false)),
        (
            "the same with a path from there to (2.4, -3.4) and (-0.6, -3.4) m",
            pose(Some((1.0, -2.0)), &[(2.4, -3.4), (-0.6, -3.4)], false),
        ),
        ("the same with an empty path that continues", pose(Some((1.0, -2.0)), &[], true)),
        (
            "the first pose with an autopilot that does not answer",
            VehicleStatus { autopilot_silent: true, ..status() }.encode_pose(99),
        ),
        ("details: more of label 5", details(intent(Intent::Label(5)))),
        ("details: another look at label 7", details(intent(Intent::LabelAgain(7)))),
        ("details: the destination", details(intent(Intent::Destination))),
        ("details: the second weighted area", details(intent(Intent::Area(2)))),
        (
            "details: the last frame placed by an earlier track, a third of the last 32 frames by images, 10 cm, 258 closed loops",
            details(PoseDetails { registration: Some(registration), ..PoseDetails::default() }),
        ),
        (
            "details: no image comes in, the autopilot does not follow",
            details(PoseDetails { faults, ..PoseDetails::default() }),
        ),
        (
            "details: a trail to (1, -2) m: 9 s ago at (2.4, -3.4), 12 s ago at (-0.6, -3.4)",
            details(PoseDetails { trail: trail.clone(), ..PoseDetails::default() }),
        ),
        (
            "details: these faults, more of label 5, this registration and this trail",
            details(PoseDetails { faults, intent: Some(Intent::Label(5)), registration: Some(registration), trail }),
        ),
        (
            "report: epoch 1, 9 labels, digest BEEF, budget 10 000 bit/s (2500 x 2^2), 3 frames refused, 448 bytes of labels (14 x 2^5) \
             and 15 of all else wait, utility version 7 applied, fix version 2 refused (2)",
            status().encode_report(99, 0).unwrap().0,
        ),
        (
            "the same with a summary: no content in force",
            VehicleStatus { in_force: Some(InForceDigests::default().summary()), ..status() }
                .encode_report(99, 0)
                .unwrap()
                .0,
        ),
        ("inquiry of a surface that holds a utility with the digest ABCD", inquiry),
        (
            "part of a content in force: fence, digest BEEF, the last bytes 07 08 at offset 300",
            InForcePart {
                id: SlotId::Fence,
                part: TextPart { digest: 0xBEEF, first: 300, is_last: true, bytes: &[7, 8] },
            }
            .encode(),
        ),
        (
            "the same report with a placement: version 2, 12.5 m east, -0.1 m north",
            VehicleStatus {
                placement: Some(Placement { version: 2, origin: WorldPoint::new(12.5, -0.1) }),
                ..status()
            }
            .encode_report(99, 0)
            .unwrap()
            .0,
        ),
        (
            "the same report with the state of a disk: the journal is refused, 1 to 2 GB are free",
            VehicleStatus {
                disk: Some(DiskReport { journal_refused: true, checkpoint_refused: false, free_bytes: Some(1 << 30) }),
                ..status()
            }
            .encode_report(99, 0)
            .unwrap()
            .0,
        ),
    ]
}

/// A version of a slot ; it must read back.
fn slot(version: u16, content: Slot) -> Vec<u8> {
    let bytes = VersionedSlot::encode(version, &content);
    let read = VersionedSlot { id: content.id(), version, content: Some(content) };
    assert_eq!(VersionedSlot::decode(&bytes), Ok(read));
    bytes
}

fn orders() -> Rows {
    let utility =
        Utility { epoch: 1, exploration: 20, curiosity: 0, weights: [(3, 80), (5, -20)].into_iter().collect() };
    let fix = Fix { position: WorldPoint::new(-12.3, 400.0), sigma_m: 1.5, age_s: 0.82 };
    let requests = ExemplarRequests {
        epoch: 1,
        wanted: vec![
            ExemplarRequest { label: 3, serial: 2, size: 0, picture: 0 },
            ExemplarRequest { label: 5, serial: 1, size: 1, picture: 9 },
        ],
    };
    let limits = Limits {
        depth: Some(Band { low_dm: 50, high_dm: 400 }),
        distance_m: Some(3000),
        silence_s: Some(600),
        on_silence: Some(Reaction::Return),
        ..Limits::default()
    };
    let outline = |vertices: &[(i32, i32)]| Polygon(vertices.iter().map(|&(x, y)| place(x, y)).collect());
    let fence = Fence {
        fence: Some(outline(&[(0, 0), (40, 0), (40, 30), (0, 30)])),
        keep_outs: vec![outline(&[(10, 10), (15, 10), (10, 18)])],
        return_point: Some(place(2, 3)),
    };
    let destination = Destination { place: Some(DecimetrePoint::new(1200, -3)) };
    let areas = Areas(vec![
        WeightedArea { outline: outline(&[(10, 5), (30, 5), (30, 20)]), weight: 60 },
        WeightedArea { outline: outline(&[(0, 0), (4, 0), (0, 4)]), weight: -20 },
    ]);
    vec![
        (
            "slot: version 4, utility: epoch 1, unseen 20, perplexity 0, label 3: 80, label 5: -20",
            slot(4, Slot::Utility(utility)),
        ),
        ("slot: version 1, constraints: hold", hold()),
        ("slot: version 2, constraints: abort", slot(2, Slot::Constraints(Constraints { hold: false, abort: true }))),
        (
            "slot: version 6, limits: depth 5 to 40 m, 3000 m, silence 600 s, on silence return",
            slot(6, Slot::Limits(limits)),
        ),
        ("slot: version 5, destination: (120, -0.3) m", slot(5, Slot::Destination(destination))),
        (
            "slot: version 6, areas: (10, 5), (30, 5), (30, 20) m with weight 60, (0, 0), (4, 0), (0, 4) m with -20",
            slot(6, Slot::Areas(areas)),
        ),
        (
            "slot: version 7, fence: (0, 0), (40, 0), (40, 30), (0, 30) m, keep-out (10, 10), (15, 10), \
             (10, 18) m, return point (2, 3) m",
            slot(7, Slot::Fence(fence)),
        ),
        (
            "slot: version 1, requests: epoch 1, label 3, request 2; label 5, request 1, image 9 with an edge of \
             128 pixels",
            slot(1, Slot::Requests(requests)),
        ),
        ("slot: version 9, fix: x -12.3 m, y 400 m, sigma 1.5 m, age 0.82 s", slot(9, Slot::Fix(fix))),
    ]
}

fn settings_and_budgets() -> Rows {
    let budget = Budget { bits_per_s: 400, shares: Shares([10, 5, 5, 50, 20]), background: BackgroundOrder::default() };
    let curious = BackgroundOrder::new(&[
        BackgroundStream::Layer(LayerId::CURIOSITY),
        BackgroundStream::Finer,
        BackgroundStream::Layer(LayerId::DEPTH),
        BackgroundStream::Exemplars,
        BackgroundStream::Layer(LayerId::CONFIDENCE),
    ]);
    let curious = Budget { background: curious.unwrap(), ..budget };
    let last = BackgroundStream::Layer(LayerId::new(15).unwrap());
    let long = Budget { background: BackgroundOrder::new(&[BackgroundStream::Finer, last]).unwrap(), ..budget };
    let settings = Settings {
        planner: Change::To(PlannerKind::Horizon),
        cells: Change::To(CellBand::Coarse),
        layers: Change::To(LayerMask::from_iter([LayerId::DEPTH])),
        alpha: Change::To(ShortDecimal::new(0.01).unwrap()),
        gamma: Change::Configured,
        frames_per_s: Change::To(ShortDecimal::new(0.25).unwrap()),
        ..Settings::default()
    };
    let labels = Settings { labels: Change::To(8), at_end: Change::Configured, ..Settings::default() };
    vec![
        (
            "slot: version 2, settings: planner horizon, coarse cells, depth alone, alpha 0.01, gamma as \
             configured, 0.25 frames a second",
            slot(2, Slot::Settings(settings)),
        ),
        (
            "slot: version 3, budget: 400 bit/s, shares 10, 5, 5, 50, 20, spare capacity to finer cells, depth, \
             exemplars, confidence",
            slot(3, Slot::Budget(budget)),
        ),
        (
            "slot: version 3, the same budget, spare capacity to curiosity, finer cells, depth, exemplars, \
             confidence",
            slot(3, Slot::Budget(curious)),
        ),
        ("slot: version 3, the same budget, spare capacity to finer cells and layer 15", slot(3, Slot::Budget(long))),
        (
            "slot: version 2, settings: layers 2 and 15 alone",
            slot(2, Slot::Settings(Settings { layers: Change::To(LayerMask(0x8004)), ..Settings::default() })),
        ),
        (
            "slot: version 2, settings: at the end of the survey hold",
            slot(2, Slot::Settings(Settings { at_end: Change::To(AtEnd::Hold), ..Settings::default() })),
        ),
        (
            "slot: version 2, settings: registration off",
            slot(2, Slot::Settings(Settings { registration: Change::To(Registration::Off), ..Settings::default() })),
        ),
        (
            "slot: version 2, settings: at most 8 labels, the end of the survey as configured",
            slot(2, Slot::Settings(labels)),
        ),
    ]
}

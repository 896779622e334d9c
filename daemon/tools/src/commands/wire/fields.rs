//! The fields of the chunks of a frame.

use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::directive::{InForceDigests, InForcePart, Slot, SlotId, SlotState, VersionedSlot};
use scenecast_protocol::map::{ClassChunk, LayerChunk, TextPart};
use scenecast_protocol::map_codec::{Codec, Stride, patch};
use scenecast_protocol::object::Part;
use scenecast_protocol::wire::{
    Chunk, ChunkKind, FrameTie, Intent, Introduction, MapOrigin, PoseDetails, VehicleStatus,
};
use serde_json::{Value, json};

/// Names and values in the order in which they are shown.
pub(super) type Fields = Vec<(&'static str, Value)>;

pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A value without the quotes of JSON.
pub(super) fn text_of(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(values) if values.iter().all(Value::is_string) => {
            values.iter().map(text_of).collect::<Vec<_>>().join(" and ")
        }
        Value::Null => "unknown".to_owned(),
        Value::Bool(yes) => if *yes { "yes" } else { "no" }.to_owned(),
        _ => value.to_string(),
    }
}

/// The name of a kind of chunk.
pub(super) fn kind(kind: ChunkKind) -> &'static str {
    match kind {
        ChunkKind::Map => "map",
        ChunkKind::Pose => "pose",
        ChunkKind::Slot => "slot",
        ChunkKind::Object => "object",
        ChunkKind::Report => "report",
        ChunkKind::Layer => "layer",
        ChunkKind::Introduction => "introduction",
        ChunkKind::InForce => "in force",
        ChunkKind::Inquiry => "inquiry",
        ChunkKind::Details => "details",
        ChunkKind::LabelClass => "label name",
        ChunkKind::LabelTree => "tree of labels",
        ChunkKind::Caller => "caller",
        ChunkKind::NextKey => "next key",
    }
}

/// What a chunk says; a field `error` of one that cannot be read.
pub(super) fn of(chunk: &Chunk<'_>) -> Fields {
    let payload = chunk.payload;
    let fields = match chunk.kind {
        ChunkKind::Map => map(payload),
        ChunkKind::Pose => pose(payload),
        ChunkKind::Slot => slot(payload),
        ChunkKind::Object => object(payload),
        ChunkKind::Report => report(payload),
        ChunkKind::Layer => layer(payload),
        ChunkKind::Introduction | ChunkKind::Caller => introduction(payload),
        ChunkKind::InForce => InForcePart::decode(payload)
            .map(|in_force| [vec![("slot", in_force.id.name().into())], text_part(&in_force.part)].concat()),
        ChunkKind::Inquiry => InForceDigests::decode(payload)
            .ok()
            .map(|digests| digests.iter().map(|(id, digest)| (id.name(), format!("{digest:04x}").into())).collect()),
        ChunkKind::Details => details(payload),
        ChunkKind::LabelClass => ClassChunk::decode(payload)
            .map(|class| [vec![("label", class.label.into())], text_part(&class.part)].concat()),
        ChunkKind::LabelTree => TextPart::decode(payload).map(|part| text_part(&part)),
        ChunkKind::NextKey => payload.split_first_chunk().map(|([part, fingerprint @ ..], _): (&[u8; 5], _)| {
            vec![("part", (*part).into()), ("fingerprint", hex(fingerprint).into())]
        }),
    };
    fields.unwrap_or_else(|| vec![("error", "it cannot be read".into())])
}

fn map(payload: &[u8]) -> Option<Fields> {
    let patch = patch(payload)?;
    let mut fields: Fields = vec![
        ("body", if patch.codec == Codec::Png { "png" } else { "context" }.into()),
        ("x", patch.rect.x.into()),
        ("y", patch.rect.y.into()),
        ("width", patch.rect.width.into()),
        ("height", patch.rect.height.into()),
    ];
    if patch.stride == Stride::Four {
        fields.push(("stride", patch.stride.cells().into()));
    }
    fields.push(("bytes", payload.len().into()));
    Some(fields)
}

fn point(at: MapPoint) -> Value {
    json!([at.x_m, at.y_m])
}

fn pose(payload: &[u8]) -> Option<Fields> {
    let mut status = VehicleStatus::default();
    status.read_pose(payload).ok()?;
    let mut fields: Fields = vec![("mode", status.mode.name().into())];
    fields.extend(status.reason.name().map(|name| ("reason", name.into())));
    if status.autopilot_silent {
        fields.push(("autopilot_silent", true.into()));
    }
    fields.extend([
        ("x_m", status.position.x_m.into()),
        ("y_m", status.position.y_m.into()),
        ("depth_m", status.depth_m.into()),
        ("heading_deg", status.heading_deg.into()),
        ("sigma_m", status.sigma_m.into()),
        ("fix_age_s", status.fix_age_s.map_or(Value::Null, Value::from)),
        ("explored_cells", status.explored_cells.into()),
    ]);
    fields.extend(status.waypoint.map(|waypoint| ("waypoint_m", point(waypoint))));
    if !status.path.points.is_empty() {
        fields.push(("path_m", status.path.points.iter().copied().map(point).collect()));
    }
    if status.path.continues {
        fields.push(("path_continues", true.into()));
    }
    Some(fields)
}

fn details(payload: &[u8]) -> Option<Fields> {
    let details = PoseDetails::decode(payload).ok()?;
    let mut fields = Fields::new();
    let faults: Vec<Value> = details.faults.iter().map(|(name, _)| name.into()).collect();
    if !faults.is_empty() {
        fields.push(("faults", faults.into()));
    }
    fields.extend(details.intent.map(|intent| {
        let text = match intent {
            Intent::Unseen => "unseen floor".to_owned(),
            Intent::Curiosity => "unusual cells".to_owned(),
            Intent::Label(label) => format!("more of label {label}"),
            Intent::Destination => "the destination".to_owned(),
            Intent::Area(area) => format!("weighted area {area}"),
            Intent::LabelAgain(label) => format!("another look at label {label}"),
        };
        ("intent", text.into())
    }));
    if let Some(registration) = &details.registration {
        let placed_by = match registration.tie {
            FrameTie::Odometry => "odometry",
            FrameTie::FrameBefore => "the frame before",
            FrameTie::EarlierTrack => "an earlier track",
            FrameTie::Off => "odometry, as the registration is off",
        };
        fields.extend([
            ("placed_by", placed_by.into()),
            ("placed_share", registration.share.into()),
            ("placed_sigma_m", registration.sigma_m.into()),
            ("loops", registration.closed.into()),
        ]);
    }
    if let Some(trail) = &details.trail {
        // The position is in the pose, another chunk: places count from it here.
        let corners = trail.corners(MapPoint::default());
        let corner = |ago_s: f64, at: MapPoint| json!([ago_s, at.x_m, at.y_m]);
        fields.push(("trail_s_m", corners.iter().map(|c| corner(c.ago_s.into(), c.place)).collect()));
    }
    Some(fields)
}

fn report(payload: &[u8]) -> Option<Fields> {
    let mut status = VehicleStatus::default();
    status.read_report(payload).ok()?;
    let mut fields: Fields = vec![
        ("epoch", status.epoch.into()),
        ("labels", status.labels.into()),
        ("digest", format!("{:04x}", status.base_digest).into()),
        ("budget_bps", status.budget_bps.into()),
        ("refused_frames", status.refused_frames.into()),
        ("backlog_map_bytes", status.backlog.map_bytes.into()),
        ("backlog_other_bytes", status.backlog.other_bytes.into()),
    ];
    let decisions: Vec<Value> = SlotId::ALL.into_iter().filter_map(|id| decision(&status, id)).collect();
    if !decisions.is_empty() {
        fields.push(("slots", decisions.into()));
    }
    if let Some(summary) = &status.in_force {
        let names: Vec<Value> =
            SlotId::ALL.into_iter().filter(|&id| summary.has(id)).map(|id| id.name().into()).collect();
        fields.extend([("in_force", names.into()), ("in_force_digest", format!("{:04x}", summary.digest()).into())]);
    }
    if let Some(placement) = &status.placement {
        fields.push(("placement", placement.version.into()));
        fields.push(("origin_m", json!([placement.origin.east_m, placement.origin.north_m])));
    }
    if let Some(disk) = &status.disk {
        fields.push(("journal_refused", disk.journal_refused.into()));
        fields.push(("checkpoint_refused", disk.checkpoint_refused.into()));
        fields.push(("disk_free_bytes", disk.free_bytes.map_or(Value::Null, Value::from)));
    }
    Some(fields)
}

fn decision(status: &VehicleStatus, id: SlotId) -> Option<Value> {
    let slot = status.slot(id);
    let state = match slot.state {
        SlotState::Unknown => return None,
        SlotState::Applied => "applied".to_owned(),
        SlotState::Pending => "received".to_owned(),
        SlotState::Refused(reason) => format!("refused: {}", reason.explain()),
    };
    Some(format!("{} {} {state}", id.name(), slot.version_low).into())
}

fn slot(payload: &[u8]) -> Option<Fields> {
    let slot = VersionedSlot::decode(payload).ok()?;
    let mut fields: Fields = vec![("slot", slot.id.name().into()), ("version", slot.version.into())];
    match slot.content {
        None => fields.push(("error", "it cannot be read".into())),
        Some(Slot::Constraints(order)) => fields.extend([("hold", order.hold.into()), ("abort", order.abort.into())]),
        Some(Slot::Utility(order)) => {
            let weights: Vec<Value> = order.weights.iter().map(|(label, weight)| json!([label, weight])).collect();
            fields.extend([
                ("epoch", order.epoch.into()),
                ("unseen", order.exploration.into()),
                ("curiosity", order.curiosity.into()),
                ("weights", weights.into()),
            ]);
        }
        Some(Slot::Fix(fix)) => fields.extend([
            ("x_m", fix.position.east_m.into()),
            ("y_m", fix.position.north_m.into()),
            ("sigma_m", fix.sigma_m.into()),
            ("age_s", fix.age_s.into()),
        ]),
        Some(Slot::Budget(budget)) => fields.push(("bits_per_s", budget.bits_per_s.into())),
        // The others are outlines and settings; JSON has their bytes.
        Some(_) => fields.push(("bytes", payload.len().into())),
    }
    Some(fields)
}

fn object(payload: &[u8]) -> Option<Fields> {
    let part = Part::decode(payload).ok()?;
    let symbols = part.data.len() / part.layout.symbol().max(1);
    Some(vec![
        ("object", part.id.number().into()),
        ("sources", part.layout.sources().into()),
        ("symbol_bytes", part.layout.symbol().into()),
        ("first", part.first.into()),
        ("symbols", symbols.into()),
    ])
}

fn layer(payload: &[u8]) -> Option<Fields> {
    let (id, what): (_, Fields) = match LayerChunk::decode(payload)? {
        LayerChunk::Patch(id, chunk) => (id, map(chunk)?),
        LayerChunk::Digest(id, digest) => (id, vec![("digest", format!("{digest:04x}").into())]),
        LayerChunk::Descriptor(id, part) => (id, text_part(&part)),
    };
    Some([vec![("layer", id.index().into())], what].concat())
}

fn introduction(payload: &[u8]) -> Option<Fields> {
    let introduction = Introduction::decode(payload).ok()?;
    let mut fields = Fields::new();
    fields.extend(introduction.cell_edge.metres().map(|metres| ("cell_edge_m", metres.into())));
    fields.extend(introduction.series.map(|series| ("series", format!("{:012x}", series.get()).into())));
    let name = introduction.name.as_str();
    if !name.is_empty() {
        fields.push(("name", name.into()));
    }
    let flags = [
        ("takes_over", introduction.takes_over),
        ("refuses", introduction.refuses),
        ("no_memory", introduction.has_no_memory),
        ("plain", introduction.is_plain),
        ("encrypts", introduction.encrypts),
        ("tags_all", introduction.tags_all),
        ("full_duplex", introduction.is_full_duplex),
    ];
    fields.extend(flags.into_iter().filter(|(_, is_set)| *is_set).map(|(name, _)| (name, true.into())));
    if introduction.refuses {
        fields.push(("silence_s", introduction.silence_s.into()));
    }
    fields.extend(introduction.clock.map(|clock| ("clock_h", clock.hours().into())));
    if introduction.frame_bytes > 0 {
        fields.push(("frame_bytes", introduction.frame_bytes.into()));
    }
    let origin = introduction.origin.map(MapOrigin::degrees);
    fields.extend(
        origin.into_iter().flat_map(|(lat, lon)| [("origin_lat_deg", lat.into()), ("origin_lon_deg", lon.into())]),
    );
    Some(fields)
}

fn text_part(part: &TextPart<'_>) -> Fields {
    vec![
        ("digest", format!("{:04x}", part.digest).into()),
        ("first", part.first.into()),
        ("bytes", part.bytes.len().into()),
        ("last", part.is_last.into()),
    ]
}

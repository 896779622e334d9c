//! Every key that there is: what it means, its unit, what it allows.

/// What a key allows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Allowed {
    /// A number from the first to the second.
    Range(f64, f64),
    /// One of these words.
    Choice(&'static [&'static str]),
    /// Any number of whole numbers from the first to the second, all different.
    List(f64, f64),
    /// Any number of these words, all different.
    Words(&'static [&'static str]),
    /// Any text.
    Text,
    /// `true` or `false`.
    Flag,
}

/// A key of the configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// Section and name.
    pub name: &'static str,
    /// Unit, empty if it has none.
    pub unit: &'static str,
    /// What it allows.
    pub allowed: Allowed,
    /// Who reads it: `a` the vehicle, `s` the surface, `r` the rehearsal.
    pub roles: &'static str,
    /// What it is.
    pub doc: &'static str,
}

const fn key(name: &'static str, unit: &'static str, allowed: Allowed, roles: &'static str, doc: &'static str) -> Key {
    Key { name, unit, allowed, roles, doc }
}

use Allowed::{Choice, Flag, List, Range, Text, Words};

/// What a vehicle may do of its own accord.
const REACTIONS: Allowed = Choice(&["hold", "return", "surface"]);

/// Every key, in the order of the files.
pub const KEYS: &[Key] = &[
    key("mission.name", "", Text, "asr", "name of the mission for people"),
    key(
        "mission.id",
        "",
        Range(0.0, 4_294_967_295.0),
        "asr",
        "number that both ends share: frames of another mission are dropped",
    ),
    key(
        "mission.origin_deg",
        "deg",
        Range(-180.0, 180.0),
        "asr",
        "latitude north and longitude east where x = y = 0 of the world, the same at both ends; both 0: not known",
    ),
    key("vehicle.address", "", Range(1.0, 14.0), "asr", "acoustic address of the vehicle (0 is the surface)"),
    key("vehicle.name", "", Text, "asr", "name of the vehicle for people"),
    key(
        "link.budget_bps",
        "bit/s",
        Range(10.0, 1e7),
        "asr",
        "bits on air that this end may send, mean over the window",
    ),
    key("link.budget_window_s", "s", Range(1.0, 3600.0), "asr", "window over which the budget is kept"),
    key(
        "link.frame_bytes",
        "bytes",
        Range(32.0, 1024.0),
        "asr",
        "size of a full frame, the same at both ends; s2c and micromodem have sizes of their own",
    ),
    key(
        "link.shares",
        "%",
        Range(0.0, 100.0),
        "asr",
        "least shares of directive, status, fix, map and exemplar while each has something to send; together at most 100",
    ),
    key("link.status_period_s", "s", Range(1.0, 3600.0), "ar", "time between two statuses of the vehicle"),
    key("link.max_turn_s", "s", Range(1.0, 60.0), "sr", "longest turn that the surface grants"),
    key("link.max_idle_s", "s", Range(0.5, 600.0), "sr", "longest pause between turns when nothing is to be said"),
    key(
        "link.call_every_s",
        "s",
        Range(0.0, 86_400.0),
        "sr",
        "longest time between two calls for vehicles that are not known; 0: only the configured ones are spoken with",
    ),
    key(
        "link.vehicles",
        "",
        List(1.0, 14.0),
        "s",
        "addresses of the vehicles that the surface speaks with from the beginning; empty: the one of vehicle.address",
    ),
    key(
        "link.max_range_m",
        "m",
        Range(10.0, 20_000.0),
        "sr",
        "range for which an answer is waited before a round trip was measured",
    ),
    key("link.turn_around_s", "s", Range(0.0, 10.0), "asr", "time that a modem needs between receiving and sending"),
    key(
        "link.key_file",
        "",
        Text,
        "asr",
        "file of the mission key (scenecast key new), the same at both ends; empty: frames are not authenticated",
    ),
    key(
        "link.authenticate",
        "",
        Choice(&["down", "all"]),
        "asr",
        "frames that the key authenticates, the same at both ends; down: from the surface to the vehicle; all: both ways",
    ),
    key("link.encrypt", "", Flag, "asr", "whether authentic frames are encrypted too, the same at both ends"),
    key(
        "modem.kind",
        "",
        Choice(&["s2c", "micromodem", "transparent", "tcp", "udp"]),
        "asr",
        "s2c: EvoLogics; micromodem: WHOI; transparent: a byte pipe; tcp, udp: frames to the other end over a network, in a rehearsal the simulated water without modems",
    ),
    key(
        "modem.device",
        "",
        Text,
        "as",
        "serial device of the modem, best from /dev/serial/by-id; empty: over the network by modem.connect or modem.listen",
    ),
    key("modem.baud", "bit/s", Range(300.0, 4_000_000.0), "asr", "speed of the serial device"),
    key("modem.listen", "", Text, "as", "ADDRESS:PORT to listen on, or to receive datagrams at"),
    key("modem.connect", "", Text, "as", "ADDRESS:PORT to connect to, or to send datagrams to"),
    key(
        "modem.bit_rate",
        "bit/s",
        Range(10.0, 1e7),
        "as",
        "bit rate of the modem on air; that of instant messages and of a micromodem's packets is known",
    ),
    key(
        "modem.overhead_bits",
        "bit",
        Range(0.0, 100_000.0),
        "asr",
        "bits on air that a transmission costs besides its bytes; what s2c and micromodem cost is known",
    ),
    key(
        "modem.surface_address",
        "",
        Range(1.0, 127.0),
        "asr",
        "address of the surface's modem (s2c, micromodem), the same at both ends; a vehicle's modem has vehicle.address; a modem with another address is refused",
    ),
    key(
        "modem.s2c_mode",
        "",
        Choice(&["burst", "im"]),
        "asr",
        "burst: bulk in bursts, commands in instant messages; im: everything in instant messages, about 500 bit/s; the same at both ends",
    ),
    key(
        "modem.source_level",
        "",
        Range(0.0, 3.0),
        "as",
        "source level of an s2c: 0 the loudest, 3 the least and the only one that does no harm in air",
    ),
    key(
        "modem.highest_address",
        "",
        Range(2.0, 254.0),
        "as",
        "highest address of an s2c network, the same on all modems: 2, 6, 14, 30, 62, 126 or 254",
    ),
    key(
        "modem.cluster",
        "",
        Range(1.0, 32.0),
        "asr",
        "data packets a train of an s2c; fewer let commands through sooner and carry less",
    ),
    key("modem.packet_ms", "ms", Range(50.0, 1000.0), "asr", "longest data packet of an s2c, the same on all modems"),
    key("modem.rate", "", Range(0.0, 5.0), "asr", "rate of a micromodem's packets, the same at both ends"),
    key("channel.bit_rate", "bit/s", Range(10.0, 1e7), "r", "bit rate of the simulated modems on air"),
    key(
        "channel.range_m",
        "m",
        Range(1.0, 20_000.0),
        "r",
        "distance from the surface vehicle to the middle of the survey",
    ),
    key("channel.loss", "", Range(0.0, 0.99), "r", "probability that a frame is lost"),
    key("channel.duplication", "", Range(0.0, 1.0), "r", "probability that a frame arrives twice"),
    key("channel.reordering", "", Range(0.0, 1.0), "r", "probability that a frame arrives late"),
    key("channel.corruption", "", Range(0.0, 1.0), "r", "probability that a frame arrives with flipped bits"),
    key("channel.half_duplex", "", Flag, "r", "whether a modem is deaf while it speaks"),
    key("channel.sound_speed_m_s", "m/s", Range(1300.0, 1700.0), "r", "speed of sound"),
    key(
        "map.codec",
        "",
        Choice(&["auto", "png", "context"]),
        "ar",
        "codec of map chunks; auto takes the smaller for each",
    ),
    key(
        "map.stream",
        "",
        Choice(&["delta", "whole-png"]),
        "ar",
        "whole-png sends the whole map again whenever it changed: for comparison only",
    ),
    key(
        "map.settle_s",
        "s",
        Range(0.0, 600.0),
        "ar",
        "time that a new label, or level of a plane, of a cell that the operator knows has to stand before it is sent; up to eight times that for a cell that flips again and again; 0: none",
    ),
    key(
        "map.coarse_after_s",
        "s",
        Range(0.0, 86_400.0),
        "ar",
        "a backlog that the budget needs longer for goes out coarse to fine: every fourth cell in both directions first; 0: never",
    ),
    key(
        "map.planes",
        "",
        Words(&["confidence", "depth"]),
        "ar",
        "planes that are sent beside the labels: how sure the model is of a label in quarters, and the depth of the sea floor",
    ),
    key(
        "map.plane_shares",
        "%",
        Range(0.0, 100.0),
        "ar",
        "least shares of confidence and depth in the map's share of link.shares while labels wait too, together at most 100; 0: only what nobody else needs",
    ),
    key(
        "map.depth_step_m",
        "m",
        Range(0.1, 25.5),
        "ar",
        "step of the plane of depths, in tenths of a metre; 254 steps about survey.depth_m are told apart",
    ),
    key("camera.source", "", Text, "ar", "empty: the rehearsal's image; frames:DIR: images with DIR/poses.csv"),
    key("camera.rate_hz", "1/s", Range(0.01, 30.0), "r", "frames a second"),
    key("camera.width_px", "pixel", Range(64.0, 4096.0), "r", "columns of a frame"),
    key("camera.height_px", "pixel", Range(64.0, 4096.0), "r", "rows of a frame"),
    key("camera.metres_per_pixel", "m", Range(0.0001, 10.0), "ar", "size of a pixel on the sea floor"),
    key("scene.cell_m", "m", Range(0.0, 1000.0), "asr", "edge of a map cell; 0: 25 pixels of the camera"),
    key("scene.alpha", "", Range(1e-9, 1e3), "ar", "preference for labels that are used elsewhere"),
    key("scene.beta", "", Range(1e-9, 1e3), "ar", "prior weight of each word in a label"),
    key("scene.gamma", "", Range(1e-12, 1e3), "ar", "weight of a new label"),
    key("scene.birth", "", Choice(&["literal", "collapsed", "rost"]), "ar", "reading of the new-label weight"),
    key("scene.max_labels", "", Range(2.0, 254.0), "ar", "most labels at a time"),
    key("scene.refine_words_per_s", "1/s", Range(0.0, 1e8), "ar", "words resampled a second of mission time"),
    key("scene.max_words_per_cell", "", Range(8.0, 60_000.0), "ar", "words kept a cell"),
    key(
        "scene.vocabulary",
        "",
        Text,
        "ar",
        "file of a vocabulary (scenecast vocabulary train); empty: the one that ships",
    ),
    key(
        "scene.checkpoint_s",
        "s",
        Range(0.0, 86_400.0),
        "a",
        "mission time between two checkpoints of the scene model, from which a restarted vehicle goes on; 0: none",
    ),
    key("survey.duration_s", "s", Range(0.0, 1e7), "ar", "when the survey ends; 0: never"),
    key("survey.speed_m_s", "m/s", Range(0.01, 10.0), "ar", "speed over ground"),
    key("survey.altitude_m", "m", Range(0.1, 100.0), "ar", "height of the camera above the sea floor"),
    key("survey.depth_m", "m", Range(0.0, 11_000.0), "ar", "depth of the sea floor"),
    key(
        "survey.area_m",
        "m",
        Range(-1e6, 1e6),
        "ar",
        "west, south, east and north limits; all 0: the rehearsal's image",
    ),
    key(
        "survey.planner",
        "",
        Choice(&["lawnmower", "greedy", "horizon"]),
        "ar",
        "how the vehicle chooses its way once the operator has said what matters; the operator may choose another",
    ),
    key(
        "survey.clearance_m",
        "m",
        Range(0.0, 1000.0),
        "ar",
        "distance that the vehicle plans to keep from fence and keep-outs, for its size, its turns and its drift",
    ),
    key(
        "survey.max_silence_s",
        "s",
        Range(0.0, 1e6),
        "ar",
        "longest silence of the surface before the vehicle acts by itself, unless the operator sets another; 0: any",
    ),
    key("survey.on_silence", "", REACTIONS, "ar", "what it then does, unless the operator says otherwise"),
    key(
        "survey.on_breach",
        "",
        REACTIONS,
        "ar",
        "what it does outside the fence, in a keep-out or outside a depth band, unless the operator says otherwise",
    ),
    key("survey.on_abort", "", REACTIONS, "ar", "what it does on an abort, unless the operator says otherwise"),
    key("navigation.drift_percent", "%", Range(0.0, 50.0), "ar", "drift of dead reckoning in percent of the distance"),
    key("navigation.fix_period_s", "s", Range(0.0, 3600.0), "r", "time between two position fixes; 0: none"),
    key("navigation.fix_sigma_m", "m", Range(0.0, 100.0), "r", "standard deviation of a fix"),
    key(
        "operator.script",
        "",
        Choice(&["scripted", "fenced", "none"]),
        "r",
        "scripted: two utilities and image requests at fixed times; fenced: the same within a fence and limits",
    ),
    key("console.listen", "", Text, "s", "ADDRESS:PORT of the operator's page; empty: none"),
    key(
        "console.token_file",
        "",
        Text,
        "s",
        "file of the token that the page and scripts must show (scenecast key token); needed for any address but loopback",
    ),
    key(
        "console.host",
        "",
        Text,
        "s",
        "name by which others on the network ask for the page; empty: only by the address",
    ),
    key("runtime.state_dir", "", Text, "as", "folder of what must survive a restart, and of the operator's map"),
    key("runtime.seed", "", Range(0.0, 9e15), "a", "seed of the scene model: the same recording gives the same map"),
    key(
        "runtime.time_scale",
        "",
        Range(0.01, 1000.0),
        "as",
        "seconds of mission time a second, for rehearsals with processes",
    ),
];

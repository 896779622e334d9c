//! One configuration for the sea and for rehearsal.

mod derived;
mod key_file;
mod keys;
mod load;
mod modem;
mod place;
mod print;
mod token_file;

pub use derived::{
    authenticity, background, cell_m, modem_profile, survey_area, survey_depth_m, tuning_table, vehicle_address,
    vehicle_names,
};
pub use key_file::{load_key, read_key};
pub use keys::{Allowed, KEYS, Key};
pub use load::load;
pub use modem::{full_frame_bytes, modem_port};
pub use place::{autopilot_place, is_gpsd, origin, position_places};
pub use print::print;
pub use token_file::{load_token, read_token};

use scenecast_protocol::map::LayerSet;
use scenecast_protocol::schedule::{BackgroundOrder, Shares};
use serde::{Deserialize, Serialize};

/// Every setting; see [`KEYS`] for meaning, unit and range of each.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Config {
    /// The mission.
    pub mission: Mission,
    /// This vehicle, and the ones the surface speaks with.
    pub vehicle: VehicleSection,
    /// The acoustic link.
    pub link: Link,
    /// The modem of a vehicle or of the surface.
    pub modem: Modem,
    /// The simulated water.
    pub channel: Channel,
    /// The stream of the map.
    pub map: Map,
    /// The camera.
    pub camera: Camera,
    /// The scene model.
    pub scene: Scene,
    /// The survey.
    pub survey: Survey,
    /// The vehicle's navigation.
    pub navigation: Navigation,
    /// What flies the vehicle, or the surface vehicle.
    pub autopilot: Autopilot,
    /// The localisation relay of the surface.
    pub position: Position,
    /// The operator of a rehearsal.
    pub operator: Operator,
    /// The operator's page.
    pub console: Console,
    /// The processes.
    pub runtime: Runtime,
}

macro_rules! section {
    ($(#[$doc:meta])* $name:ident { $($(#[$fdoc:meta])* $field:ident: $type:ty = $default:expr,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(default)]
        pub struct $name { $($(#[$fdoc])* pub $field: $type,)* }
        impl Default for $name {
            fn default() -> Self { Self { $($field: $default,)* } }
        }
    };
}

section! {
    /// The mission.
    Mission {
        /// Name for people.
        name: String = "rehearsal".into(),
        /// Number that both ends share; frames of another mission are dropped.
        id: u32 = 1,
        /// Latitude and longitude of the world's origin in degrees; both 0 = not known.
        origin_deg: [f64; 2] = [0.0, 0.0],
    }
}
section! {
    /// Vehicles by their addresses.
    VehicleSection {
        /// Own address of a vehicle; the one the surface speaks with.
        address: u8 = 1,
        /// Name for people.
        name: String = "auv-1".into(),
    }
}
section! {
    /// The acoustic link.
    Link {
        /// Bits on air a second, per transmitter.
        budget_bps: u32 = 10_000,
        /// Window of the budget in seconds.
        budget_window_s: f64 = 10.0,
        /// Bytes of a full frame.
        frame_bytes: u32 = 256,
        /// Least shares in percent of directive, status, fix, map, exemplar.
        shares: [u8; 5] = Shares::default().0,
        /// What left-over bits are spent on, in this order.
        spend: Vec<String> = BackgroundOrder::default().names(&LayerSet::default()),
        /// Seconds between two statuses.
        status_period_s: f64 = 10.0,
        /// Longest turn in seconds.
        max_turn_s: f64 = 14.0,
        /// Longest pause between turns in seconds.
        max_idle_s: f64 = 10.0,
        /// Longest time in seconds between two calls for vehicles that are not known; 0 = no calls.
        call_every_s: f64 = 300.0,
        /// Addresses that the surface speaks with from the beginning; empty = that of `vehicle.address`.
        vehicles: Vec<u8> = Vec::new(),
        /// Greatest range in metres to wait an answer for.
        max_range_m: f64 = 3000.0,
        /// Seconds that a modem needs between receiving and sending.
        turn_around_s: f64 = 0.2,
        /// File of the mission key; empty = frames are not authenticated.
        key_file: String = String::new(),
        /// `down` or `all`.
        authenticate: String = "down".into(),
        /// Whether authentic frames are encrypted too.
        encrypt: bool = false,
    }
}
section! {
    /// The modem.
    Modem {
        /// `s2c`, `micromodem`, `transparent`, `tcp` or `udp`.
        kind: String = "tcp".into(),
        /// Serial device; empty = over the network.
        device: String = String::new(),
        /// Its speed in bits a second.
        baud: u32 = 19_200,
        /// Address to listen on.
        listen: String = String::new(),
        /// Address to connect to.
        connect: String = String::new(),
        /// Bits a second on air.
        bit_rate: f64 = 10_000.0,
        /// Bits on air that a transmission costs besides its bytes.
        overhead_bits: u32 = 0,
        /// Address of the surface's modem; a vehicle's has the vehicle's.
        surface_address: u8 = 10,
        /// `burst` or `im` (S2C).
        s2c_mode: String = "burst".into(),
        /// Source level, 0 is the loudest (S2C).
        source_level: u8 = 3,
        /// Highest address of the network (S2C).
        highest_address: u8 = 14,
        /// Data packets a train (S2C).
        cluster: u8 = 10,
        /// Longest data packet in milliseconds (S2C).
        packet_ms: u16 = 750,
        /// Rate of packets (Micromodem).
        rate: u8 = 1,
    }
}
section! {
    /// The simulated water.
    Channel {
        /// Bits a second on air.
        bit_rate: f64 = 10_000.0,
        /// Horizontal distance between the surface vehicle and the middle of the survey, metres.
        range_m: f64 = 500.0,
        /// Probability that a frame is lost.
        loss: f64 = 0.1,
        /// Probability that a frame arrives twice.
        duplication: f64 = 0.0,
        /// Probability that a frame arrives late.
        reordering: f64 = 0.0,
        /// Probability that a frame arrives with flipped bits.
        corruption: f64 = 0.0,
        /// Whether a modem is deaf while it speaks.
        half_duplex: bool = true,
        /// Speed of sound, metres a second.
        sound_speed_m_s: f64 = 1500.0,
    }
}
section! {
    /// The stream of the map.
    Map {
        /// `auto`, `png` or `context`.
        codec: String = "auto".into(),
        /// `delta` or `whole-png`.
        stream: String = "delta".into(),
        /// Seconds that a new label of a cell that the operator knows has to stand; 0 = none.
        settle_s: f64 = 0.0,
        /// Seconds of the budget that a backlog must exceed to go out coarse to fine; 0 = never.
        coarse_after_s: f64 = 0.0,
        /// `fine` or `coarse`.
        cells: String = "fine".into(),
        /// Layers that are sent beside the labels.
        planes: Vec<String> = LayerSet::default().iter().map(|(_, layer)| layer.name.clone().into_owned()).collect(),
        /// Percent of the map's share for confidence, depth and curiosity; 0 = what nobody else needs.
        layer_shares: [u8; 3] = [0; 3],
        /// Step of the plane of depths, metres.
        depth_step_m: f64 = 0.5,
    }
}

impl Map {
    /// The part of a layer in the map's share, percent.
    pub fn layer_share(&self, name: &str) -> u8 {
        let [confidence, depth, curiosity] = self.layer_shares;
        match name {
            "confidence" => confidence,
            "depth" => depth,
            "curiosity" => curiosity,
            _ => 0,
        }
    }
}

section! {
    /// The camera.
    Camera {
        /// Empty, or `frames:DIR`.
        source: String = String::new(),
        /// Frames a second.
        rate_hz: f64 = 0.5,
        /// Columns of a frame.
        width_px: u32 = 640,
        /// Rows of a frame.
        height_px: u32 = 480,
        /// Size of a pixel on the sea floor.
        metres_per_pixel: f64 = 0.01,
    }
}
section! {
    /// The scene model.
    Scene {
        /// Edge of a cell in metres; 0 = 25 pixels of the camera.
        cell_m: f64 = 0.0,
        /// Preference for labels used elsewhere.
        alpha: f64 = 0.01,
        /// Prior of words in a label.
        beta: f64 = 0.1,
        /// Weight of a new label.
        gamma: f64 = 1e-4,
        /// `literal`, `collapsed` or `rost`.
        birth: String = "literal".into(),
        /// Most labels at a time.
        max_labels: u32 = 16,
        /// Words resampled a second of mission time.
        refine_words_per_s: u32 = 50_000,
        /// Camera frames a second that are seen at most; 0 = every one.
        frames_per_s: f64 = 0.0,
        /// Words kept a cell.
        max_words_per_cell: u32 = 200,
        /// File of a trained vocabulary; empty = the one that ships.
        vocabulary: String = String::new(),
        /// Seconds of mission time between two checkpoints; 0 = none.
        checkpoint_s: f64 = 60.0,
        /// File of a tuning table; empty = the one that ships.
        tuning_table: String = String::new(),
    }
}
section! {
    /// The survey.
    Survey {
        /// Seconds until the survey ends; 0 = at sea: never.
        duration_s: f64 = 1200.0,
        /// Speed over ground.
        speed_m_s: f64 = 0.5,
        /// Height above the sea floor.
        altitude_m: f64 = 4.0,
        /// Depth of the sea floor.
        depth_m: f64 = 20.0,
        /// West, south, east, north limits in metres from the origin; all 0 = the rehearsal's image.
        area_m: [f64; 4] = [0.0; 4],
        /// `lawnmower`, `greedy` or `horizon`.
        planner: String = "horizon".into(),
        /// Metres that the vehicle plans to stay away from fence and keep-outs.
        clearance_m: f64 = 1.0,
        /// Seconds that the surface may be silent; 0 = any.
        max_silence_s: f64 = 0.0,
        /// `hold`, `return` or `surface`.
        on_silence: String = "return".into(),
        /// `hold`, `return` or `surface`.
        on_breach: String = "return".into(),
        /// `hold`, `return` or `surface`.
        on_abort: String = "surface".into(),
    }
}
section! {
    /// The vehicle's navigation.
    Navigation {
        /// Drift of dead reckoning in percent of the distance.
        drift_percent: f64 = 1.0,
        /// Standard deviation of where the survey begins, metres.
        start_sigma_m: f64 = 1.0,
        /// Seconds between two position fixes; 0 = none.
        fix_period_s: f64 = 10.0,
        /// Standard deviation of a fix.
        fix_sigma_m: f64 = 0.5,
    }
}
section! {
    /// What flies the vehicle.
    Autopilot {
        /// `none`, `rehearsal`, `mavlink`, `nmea` or `log`.
        kind: String = "none".into(),
        /// Where it is.
        port: String = String::new(),
        /// System number of MAVLink.
        system: u8 = 1,
        /// Whether to arm it and to switch it to guided mode.
        arm: bool = false,
        /// Seconds of silence after which it counts as gone.
        silence_s: f64 = 5.0,
        /// Turn rate of a simulated vehicle, degrees a second; 0 = on the spot.
        turn_rate_deg_s: f64 = 0.0,
        /// Current that a simulated vehicle does not see, east and north, metres a second.
        current_m_s: [f64; 2] = [0.0, 0.0],
    }
}
section! {
    /// The localisation relay.
    Position {
        /// Where the GPS is.
        gps: String = String::new(),
        /// Where the compass is.
        compass: String = String::new(),
        /// USBL head from the GPS antenna: forward, to starboard, down; metres.
        usbl_lever_m: [f64; 3] = [0.0, 0.0, 0.0],
        /// Depth of the USBL head, metres.
        usbl_depth_m: f64 = 1.0,
        /// Whether bearings count from the bow.
        usbl_from_bow: bool = false,
        /// Turn of the head, degrees clockwise.
        usbl_turn_deg: f64 = 0.0,
        /// Speed of sound to correct ranges to, metres a second; 0 = none.
        sound_speed_m_s: f64 = 0.0,
        /// Least seconds between two fixes of a vehicle.
        fix_period_s: f64 = 10.0,
        /// Greatest standard deviation of a fix, metres.
        most_sigma_m: f64 = 30.0,
        /// Whether the surface vehicle stays above the vehicle.
        follow: bool = false,
        /// Distance that it keeps, metres.
        stand_off_m: f64 = 30.0,
        /// By how much that may be off, metres.
        dead_band_m: f64 = 15.0,
    }
}
section! {
    /// The operator of a rehearsal.
    Operator {
        /// `scripted` or `none`.
        script: String = "scripted".into(),
    }
}
section! {
    /// The operator's page.
    Console {
        /// Address to listen on; empty = no page.
        listen: String = "127.0.0.1:8460".into(),
        /// File of the token that others must show; empty = none, and only loopback addresses are listened on.
        token_file: String = String::new(),
        /// Name of this machine for others; empty = they ask for its address.
        host: String = String::new(),
    }
}
section! {
    /// The processes.
    Runtime {
        /// Folder of what must survive a restart, and of the operator's map.
        state_dir: String = "state".into(),
        /// Seed of the scene model.
        seed: u64 = 1,
        /// Seconds of mission time a second.
        time_scale: f64 = 1.0,
    }
}

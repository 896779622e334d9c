//! The acoustic link, the modem, and the simulated channel between modems.

use super::key::section;
use crate::rule::{ANY, range};
use crate::setting::{Authenticate, HostPort, ModemKind, S2cMode};
use scenecast_core::{FlowControl, SerialFormat};
use scenecast_protocol::schedule::{BackgroundOrder, Shares};
use std::path::PathBuf;

section! {
    /// The modem of this end.
    modem: Modem {
        /// Kind of modem. s2c: EvoLogics S2C; micromodem: WHOI Micromodem; transparent: a modem that
        /// passes bytes on; tcp, udp: frames go to the other end over a network, and in a rehearsal
        /// through the simulated channel without modems.
        kind: ModemKind = ModemKind::Tcp, ANY, [Auv Asv Scenario];
        /// Serial device of the modem, preferably from /dev/serial/by-id. Empty: the modem is reached over the
        /// network, by modem.connect or modem.listen.
        device: Option<PathBuf> = None, ANY, [Auv Asv];
        /// Speed of the serial device.
        baud: u32 = 19_200, range(300.0, 4_000_000.0, "bit/s"), [Auv Asv Scenario];
        /// Data bits, parity and stop bits of the serial device.
        serial_format: SerialFormat = SerialFormat::EightNoneOne, ANY, [Auv Asv];
        /// How the serial device and the modem stop each other from sending. hardware: by the lines RTS and CTS; software: by the
        /// bytes XON and XOFF, which only a modem whose data never has these bytes can use.
        flow_control: FlowControl = FlowControl::None, ANY, [Auv Asv];
        /// Whether the line RTS of the serial device is up, where flow control does not use it. Some modems garble their output while it is.
        rts: bool = false, ANY, [Auv Asv];
        /// Whether the line DTR of the serial device is up. Some adapters and modems restart or sleep when it changes.
        dtr: bool = true, ANY, [Auv Asv];
        /// Address and port to listen on, or to receive datagrams at. Without modem.connect, the sender of the first
        /// datagram that the link accepts is the other end, until 10 s pass without another one.
        listen: Option<HostPort> = None, ANY, [Auv Asv];
        /// Address and port to connect to, or to send datagrams to. Over UDP the end that has this key makes its own address known, so that
        /// the other one needs modem.listen only.
        connect: Option<HostPort> = None, ANY, [Auv Asv];
        /// Bit rate of the modem on air. The rates of S2C instant messages and of Micromodem packets are built in.
        bit_rate: f64 = 10_000.0, range(10.0, 1e7, "bit/s"), [Auv Asv];
        /// Whether the medium carries both directions at once, as a radio or a network does, the same at both ends (tcp, udp):
        /// the ends then transmit without turns, and lost frames are known within a second. Acoustic channels do not.
        full_duplex: bool = false, ANY, [Auv Asv Scenario];
        /// Bits on air that each transmission needs in addition to its bytes. The values for s2c
        /// and micromodem are built in.
        overhead_bits: u32 = 0, range(0.0, 100_000.0, "bit"), [Auv Asv Scenario];
        /// Address of the surface's modem (s2c, micromodem), the same at both ends. A vehicle's modem has
        /// vehicle.address. The program refuses a modem with another address.
        surface_address: u8 = 10, range(1.0, 127.0, ""), [Auv Asv Scenario];
        /// Transfer mode of an S2C modem, the same at both ends. burst: bulk data in bursts, commands in instant
        /// messages; im: all data in instant messages, about 500 bit/s.
        s2c_mode: S2cMode = S2cMode::Burst, ANY, [Auv Asv Scenario];
        /// Source level of an S2C modem. 0 is the loudest. 3 is the quietest, and the only one that is safe in air.
        source_level: u8 = 3, range(0.0, 3.0, ""), [Auv Asv];
        /// Highest address of an S2C network, the same on all modems: 2, 6, 14, 30, 62, 126 or 254.
        highest_address: u8 = 14, range(2.0, 254.0, ""), [Auv Asv];
        /// Data packets in one packet train of an S2C modem. Fewer packets let commands through
        /// sooner, at a lower throughput.
        cluster: u8 = 10, range(1.0, 32.0, ""), [Auv Asv Scenario];
        /// Longest data packet of an S2C modem, the same on all modems.
        packet_ms: u16 = 750, range(50.0, 1000.0, "ms"), [Auv Asv Scenario];
        /// Packet rate of a Micromodem, the same at both ends.
        rate: u8 = 1, range(0.0, 5.0, ""), [Auv Asv Scenario];
        /// Electrical power that a modem draws while it transmits, from which the energy of the link is counted. Data
        /// sheets name 1.5 W (Nanomodem, 2 km), 2.8, 8 or 35 W (S2C R 18/34 at 1, 2 or 3.5 km) and 10 to 50 W
        /// (Micromodem). The surface counts the vehicles' frames with its own value. 0: energy is not counted.
        tx_watts: f64 = 8.0, range(0.0, 10_000.0, "W"), [Auv Asv Scenario];
    }
}

section! {
    /// The simulated channel of a rehearsal.
    channel: Channel {
        /// Bit rate of the simulated modems on air.
        bit_rate: f64 = 10_000.0, range(10.0, 1e7, "bit/s"), [Scenario];
        /// Horizontal distance between the surface vehicle and the middle of the survey.
        range_m: f64 = 500.0, range(1.0, 20_000.0, "m"), [Scenario];
        /// Folder with the records of both ends of a mission: frames that are on air when a recorded one was share its fate, others are
        /// lost as often as those around them, and loss does not count. Empty: no record.
        replay: Option<PathBuf> = None, ANY, [Scenario];
        /// Probability that a frame is lost.
        loss: f64 = 0.1, range(0.0, 0.99, ""), [Scenario];
        /// Probability that a frame arrives twice.
        duplication: f64 = 0.0, range(0.0, 1.0, ""), [Scenario];
        /// Probability that a frame arrives late.
        reordering: f64 = 0.0, range(0.0, 1.0, ""), [Scenario];
        /// Probability that a frame arrives with flipped bits.
        corruption: f64 = 0.0, range(0.0, 1.0, ""), [Scenario];
        /// Whether a modem cannot receive while it transmits.
        half_duplex: bool = true, ANY, [Scenario];
        /// Speed of sound.
        sound_speed_m_s: f64 = 1500.0, range(1300.0, 1700.0, "m/s"), [Scenario];
    }
}

section! {
    /// The acoustic link.
    link: Link {
        /// Bits per second that this end may put on air, as a mean over link.budget_window_s.
        budget_bps: u32 = 10_000, range(10.0, 1e7, "bit/s"), [Auv Asv Scenario];
        /// Length of the window in which the bits on air are limited to the budget.
        budget_window_s: f64 = 10.0, range(1.0, 3600.0, "s"), [Auv Asv Scenario];
        /// Size of a full frame, the same at both ends. The modems s2c and micromodem have frame sizes of their own.
        frame_bytes: u32 = 256, range(32.0, 1024.0, "bytes"), [Auv Asv Scenario];
        /// Minimum share of the budget for each class while several classes have data to send. The shares add up to 100
        /// % or less. A class that is left out keeps its default.
        shares: Shares = Shares::default(), range(0.0, 100.0, "%"), [Auv Asv Scenario];
        /// Background streams: data that is sent with spare capacity only, in this order. finer: the cells between
        /// those of a coarse map; exemplars: images of new labels that nobody requested; floor: images of the sea floor
        /// itself; the name of a layer: that layer, if it has no share. A stream that is not listed is not sent. Without
        /// finer in the list, finer cells are sent before all background streams.
        background: BackgroundOrder = BackgroundOrder::default(), ANY, [Auv Asv Scenario];
        /// Time between two status reports of the vehicle.
        status_period_s: f64 = 10.0, range(1.0, 3600.0, "s"), [Auv Scenario];
        /// Longest turn that the surface grants.
        max_turn_s: f64 = 14.0, range(1.0, 60.0, "s"), [Asv Scenario];
        /// Longest pause between two turns while neither end has data to send.
        max_idle_s: f64 = 10.0, range(0.5, 600.0, "s"), [Asv Scenario];
        /// Longest time between two discovery calls for unknown vehicles. 0: no discovery calls, so the surface works
        /// with the configured vehicles only.
        discovery_period_s: f64 = 300.0, range(0.0, 86_400.0, "s"), [Asv Scenario];
        /// Addresses of the vehicles that the surface works with from the start. Empty: vehicle.address only.
        vehicles: Vec<u8> = Vec::new(), range(1.0, 14.0, ""), [Asv];
        /// Assumed range, from which the wait for a reply follows until the first round trip has been measured.
        max_range_m: f64 = 3000.0, range(10.0, 20_000.0, "m"), [Asv Scenario];
        /// Time that a modem needs between receiving and transmitting.
        turn_around_s: f64 = 0.2, range(0.0, 10.0, "s"), [Auv Asv Scenario];
        /// File of the key of the mission (scenecast key new); on a vehicle, that of its own key (scenecast key derive).
        /// Empty: frames are not authenticated.
        key_file: Option<PathBuf> = None, ANY, [Auv Asv Scenario];
        /// Frames that the key authenticates, the same at both ends. all: both directions;
        /// down: from the surface to the vehicle only, so that anybody can forge the map.
        authenticate: Authenticate = Authenticate::All, ANY, [Auv Asv Scenario];
        /// Whether authenticated frames are encrypted too, the same at both ends.
        encrypt: bool = false, ANY, [Auv Asv Scenario];
    }
}

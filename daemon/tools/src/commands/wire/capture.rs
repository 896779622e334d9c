//! The frames in a capture of a network, or in a text.

use etherparse::{LaxSlicedPacket, TransportSlice};
use pcap_file::pcap::PcapReader;
use pcap_file::pcapng::blocks::interface_description::InterfaceDescriptionOption;
use pcap_file::pcapng::{Block, PcapNgReader};
use pcap_file::{DataLink, PcapError, TsResolution};

/// A frame, and when it was captured.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Captured {
    pub(super) time_s: Option<f64>,
    pub(super) bytes: Vec<u8>,
    /// Whether the capture has only the first bytes of it.
    pub(super) is_cut: bool,
}

/// The frames of an input, and why it could not be read further.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Capture {
    pub(super) frames: Vec<Captured>,
    pub(super) fault: Option<CaptureError>,
}

#[derive(Debug, PartialEq, thiserror::Error)]
pub(super) enum CaptureError {
    #[error("line {line}: neither a capture (pcap, pcapng) nor hexadecimal digits of whole bytes")]
    NoDigits { line: usize },
    #[error("the capture ends within packet {packet}")]
    Ends { packet: usize },
    #[error("packet {packet}: {what}")]
    Broken { packet: usize, what: String },
    #[error("packet {packet}: link type {link} is unknown; known: Ethernet, Linux cooked, raw IP, loopback, User 0")]
    Link { packet: usize, link: u32 },
    #[error("{0}")]
    Record(String),
    #[error("packet {packet}: its interface is not described")]
    Interface { packet: usize },
}

/// The frames of an input; of datagrams those that come from or go to `port`.
pub(super) fn frames(bytes: &[u8], port: Option<u16>) -> Capture {
    let mut reading = Reading { port, packet: 1, frames: Vec::new() };
    let read = match bytes {
        [0x0A, 0x0D, 0x0D, 0x0A, ..] => reading.pcapng(bytes),
        [0xD4 | 0x4D, 0xC3 | 0x3C, 0xB2, 0xA1, ..] | [0xA1, 0xB2, 0xC3 | 0x3C, 0xD4 | 0x4D, ..] => reading.pcap(bytes),
        _ => reading.text(bytes),
    };
    Capture { frames: reading.frames, fault: read.err() }
}

// Link types of captures, https://www.tcpdump.org/linktypes.html
const NULL: u32 = 0;
const ETHERNET: u32 = 1;
/// Raw IP: the number for files, those of older systems, and those for one version of IP alone.
const RAW: [u32; 5] = [101, 12, 14, 228, 229];
const LOOP: u32 = 108;
const LINUX_COOKED: u32 = 113;
const USER_0: u32 = 147;
const LINUX_COOKED_2: u32 = 276;

struct Reading {
    port: Option<u16>,
    /// The number of the packet that is read, from 1.
    packet: usize,
    frames: Vec<Captured>,
}

/// An interface of a capture: its link type, and how many of its ticks make a second.
#[derive(Clone, Copy)]
struct Interface {
    link: DataLink,
    ticks_per_s: f64,
}

impl Reading {
    /// A frame a line: pairs of hexadecimal digits, with or without space or colons between. Empty lines and `#` and what follows
    /// it are skipped.
    fn text(&mut self, bytes: &[u8]) -> Result<(), CaptureError> {
        for (line, text) in (1..).zip(bytes.split(|&byte| byte == b'\n')) {
            let content = text.split(|&byte| byte == b'#').next().unwrap_or_default();
            let digits: Vec<u8> = content.iter().copied().filter(|b| !b.is_ascii_whitespace() && *b != b':').collect();
            let digit = |digit: u8| char::from(digit).to_digit(16);
            let byte = |pair: &[u8]| match *pair {
                [high, low] => Some((digit(high)? << 4 | digit(low)?) as u8),
                _ => None,
            };
            let bytes: Option<Vec<u8>> = digits.chunks(2).map(byte).collect();
            let bytes = bytes.ok_or(CaptureError::NoDigits { line })?;
            if !bytes.is_empty() {
                self.frames.push(Captured { time_s: None, bytes, is_cut: false });
            }
        }
        Ok(())
    }

    fn pcap(&mut self, bytes: &[u8]) -> Result<(), CaptureError> {
        let mut reader = PcapReader::new(bytes).map_err(|e| self.fault(e))?;
        let header = reader.header();
        let ticks_per_s = if header.ts_resolution == TsResolution::NanoSecond { 1e9 } else { 1e6 };
        while let Some(packet) = reader.next_raw_packet() {
            let packet = packet.map_err(|e| self.fault(e))?;
            let time_s = f64::from(packet.ts_sec) + f64::from(packet.ts_frac) / ticks_per_s;
            self.take(header.datalink, &packet.data, Some(time_s), packet.incl_len < packet.orig_len)?;
        }
        Ok(())
    }

    fn pcapng(&mut self, bytes: &[u8]) -> Result<(), CaptureError> {
        let mut reader = PcapNgReader::new(bytes).map_err(|e| self.fault(e))?;
        let mut interfaces = Vec::new();
        while let Some(block) = reader.next_block() {
            let unknown = CaptureError::Interface { packet: self.packet };
            match block.map_err(|e| self.fault(e))? {
                Block::SectionHeader(_) => interfaces.clear(),
                Block::InterfaceDescription(interface) => interfaces
                    .push(Interface { link: interface.linktype, ticks_per_s: ticks_per_s(&interface.options) }),
                Block::EnhancedPacket(packet) => {
                    let interface: Interface = interfaces.get(packet.interface_id as usize).copied().ok_or(unknown)?;
                    // The library takes ticks for nanoseconds.
                    let time_s = packet.timestamp.as_nanos() as f64 / interface.ticks_per_s;
                    let is_cut = packet.data.len() < packet.original_len as usize;
                    self.take(interface.link, &packet.data, Some(time_s), is_cut)?;
                }
                Block::SimplePacket(packet) => {
                    let interface: Interface = interfaces.first().copied().ok_or(unknown)?;
                    let length = packet.original_len as usize;
                    let data = packet.data.get(..length).unwrap_or(&packet.data);
                    self.take(interface.link, data, None, packet.data.len() < length)?;
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn fault(&self, error: PcapError) -> CaptureError {
        let packet = self.packet;
        match error {
            PcapError::IoError(_) | PcapError::IncompleteBuffer => CaptureError::Ends { packet },
            error => CaptureError::Broken { packet, what: error.to_string() },
        }
    }

    /// Takes the frame of a packet, if it has one: the whole packet of the link type User 0, else the content of a UDP datagram.
    fn take(&mut self, link: DataLink, data: &[u8], time_s: Option<f64>, is_cut: bool) -> Result<(), CaptureError> {
        let ip_after = |head: usize| data.get(head..).and_then(|ip| LaxSlicedPacket::from_ip(ip).ok());
        let sliced = match u32::from(link) {
            USER_0 => {
                self.frames.push(Captured { time_s, bytes: data.to_vec(), is_cut });
                None
            }
            ETHERNET => LaxSlicedPacket::from_ethernet(data).ok(),
            link if RAW.contains(&link) => ip_after(0),
            NULL | LOOP => ip_after(4),
            LINUX_COOKED => ip_after(16),
            LINUX_COOKED_2 => ip_after(20),
            link => return Err(CaptureError::Link { packet: self.packet, link }),
        };
        self.packet += 1;
        let Some(TransportSlice::Udp(udp)) = sliced.and_then(|packet| packet.transport) else { return Ok(()) };
        if self.port.is_none_or(|port| [udp.source_port(), udp.destination_port()].contains(&port)) {
            self.frames.push(Captured { time_s, bytes: udp.payload().to_vec(), is_cut });
        }
        Ok(())
    }
}

/// How many ticks of an interface's clock make a second: 10^6, unless it says otherwise.
fn ticks_per_s(options: &[InterfaceDescriptionOption<'_>]) -> f64 {
    let resolution = options.iter().find_map(|option| match option {
        InterfaceDescriptionOption::IfTsResol(resolution) => Some(*resolution),
        _ => None,
    });
    match resolution.unwrap_or(6) {
        binary @ 0x80.. => 2f64.powi(i32::from(binary & 0x7F)),
        decimal => 10f64.powi(i32::from(decimal)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(capture: Capture) -> Vec<Vec<u8>> {
        assert_eq!(capture.fault, None);
        capture.frames.into_iter().map(|frame| frame.bytes).collect()
    }

    #[test]
    fn text_has_a_frame_a_line() {
        assert_eq!(
            bytes(frames(b"# two\n8C0F c0:de\r\n\n  01 # one\n", None)),
            [vec![0x8C, 0x0F, 0xC0, 0xDE], vec![1]]
        );
        let refused = |text: &[u8]| frames(text, None).fault;
        assert_eq!(refused(b"8C\n8C0\n"), Some(CaptureError::NoDigits { line: 2 }));
        assert_eq!(refused(b"time: 8C"), Some(CaptureError::NoDigits { line: 1 }));
        assert_eq!(refused(b"+1"), Some(CaptureError::NoDigits { line: 1 }));
    }

    fn words(words: &[u32]) -> Vec<u8> {
        words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    /// A capture (pcap) with a packet of a link type, 250 ms after the seventh second, of which more bytes were on the line.
    fn pcap(link: u32, packet: &[u8], more: u32) -> Vec<u8> {
        let length = packet.len() as u32;
        let head = [0xA1B2_C3D4, 0x0004_0002, 0, 0, 256, link, 7, 250_000, length, length + more];
        [words(&head), packet.to_vec()].concat()
    }

    /// A capture (pcapng) with a packet of User 0 at this tick; the interface has the resolution, if there is one.
    fn pcapng(resolution: Option<u8>, ticks: u64) -> Vec<u8> {
        let block = |kind: u32, body: &[u8]| {
            let length = 12 + body.len() as u32;
            [words(&[kind, length]), body.to_vec(), words(&[length])].concat()
        };
        let option = resolution.map_or(Vec::new(), |of| words(&[1 << 16 | 9, u32::from(of), 0]));
        let section = block(0x0A0D_0D0A, &words(&[0x1A2B_3C4D, 1, u32::MAX, u32::MAX]));
        let interface = block(1, &[words(&[147, 0]), option].concat());
        let packet = block(6, &words(&[0, (ticks >> 32) as u32, ticks as u32, 3, 3, 0x0003_0201]));
        [section, interface, packet].concat()
    }

    /// An IP packet with a datagram from port 7001 to 7002.
    fn datagram(content: &[u8]) -> Vec<u8> {
        let mut packet = Vec::new();
        let builder = etherparse::PacketBuilder::ipv4([127, 0, 0, 1], [127, 0, 0, 1], 64).udp(7001, 7002);
        builder.write(&mut packet, content).unwrap();
        packet
    }

    #[test]
    fn frames_of_each_link_type_are_found() {
        let ip = datagram(&[1, 2, 3]);
        let ethernet = [&[0; 12][..], &[8, 0], &ip].concat();
        let behind = |head: usize| [vec![8; head], ip.clone()].concat();
        let packets = [
            (147, vec![1, 2, 3]),
            (1, ethernet),
            (0, behind(4)),
            (113, behind(16)),
            (276, behind(20)),
            (101, behind(0)),
        ];
        for (link, packet) in packets {
            let found = frames(&pcap(link, &packet, 0), None);
            let frame = Captured { time_s: Some(7.25), bytes: vec![1, 2, 3], is_cut: false };
            assert_eq!(found, Capture { frames: vec![frame], fault: None }, "link type {link}");
        }
        assert_eq!(frames(&pcap(105, &[1], 0), None).fault, Some(CaptureError::Link { packet: 1, link: 105 }));
    }

    #[test]
    fn the_clock_of_an_interface_is_obeyed() {
        for (resolution, ticks) in [(None, 7_250_000), (Some(9), 7_250_000_000), (Some(0x82), 29)] {
            let capture = frames(&pcapng(resolution, ticks), None);
            assert_eq!(capture.fault, None);
            let [frame] = capture.frames.as_slice() else { panic!("{:?}", capture.frames) };
            assert_eq!((frame.time_s, &frame.bytes[..]), (Some(7.25), &[1, 2, 3][..]), "{resolution:?}");
        }
    }

    #[test]
    fn datagrams_of_other_ports_are_left_out() {
        let capture = pcap(101, &datagram(&[1, 2, 3]), 0);
        let found = |port| frames(&capture, Some(port)).frames.len();
        assert_eq!([7001, 7002, 7003].map(found), [1, 1, 0]);
    }

    #[test]
    fn a_long_packet_is_cut_and_a_truncated_capture_is_read() {
        let long = pcap(147, &[1, 2, 3], 400);
        assert!(frames(&long, None).frames[0].is_cut);
        let two = [pcap(147, &[1, 2, 3], 0), words(&[8, 0, 3, 3]), vec![4]].concat();
        let found = frames(&two, None);
        assert_eq!((found.frames.len(), found.fault), (1, Some(CaptureError::Ends { packet: 2 })));
    }
}

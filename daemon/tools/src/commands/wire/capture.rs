//! The frames in a capture of a network, or in a text.

use etherparse::{LaxSlicedPacket, TransportSlice};
use pcap_file::DataLink;
use pcap_file::pcap::PcapReader;
use pcap_file::pcapng::{Block, PcapNgReader};
use std::time::Duration;

/// A frame, and when it was captured.
#[derive(Debug, PartialEq)]
pub(super) struct Captured {
    pub(super) time_s: Option<f64>,
    pub(super) bytes: Vec<u8>,
}

#[derive(Debug, PartialEq, thiserror::Error)]
pub(super) enum CaptureError {
    #[error("packet {number}: {what}")]
    Packet { number: usize, what: String },
    #[error("line {line}: neither a capture (pcap, pcapng) nor hexadecimal digits of whole bytes")]
    NoDigits { line: usize },
    #[error("packet {number}: link type {link} is unknown; known: Ethernet, Linux cooked, raw IP, loopback, User 0")]
    Link { number: usize, link: u32 },
}

/// The frames of an input; of datagrams those that come from or go to `port`.
pub(super) fn frames(bytes: &[u8], port: Option<u16>) -> Result<Vec<Captured>, CaptureError> {
    match bytes {
        [0x0A, 0x0D, 0x0D, 0x0A, ..] => of_pcapng(bytes, port),
        [0xD4 | 0x4D, 0xC3 | 0x3C, 0xB2, 0xA1, ..] | [0xA1, 0xB2, 0xC3 | 0x3C, 0xD4 | 0x4D, ..] => of_pcap(bytes, port),
        _ => of_text(bytes),
    }
}

/// A frame a line: pairs of hexadecimal digits, with or without space or colons between. Empty lines and `#` and what follows it
/// are skipped.
fn of_text(bytes: &[u8]) -> Result<Vec<Captured>, CaptureError> {
    let mut frames = Vec::new();
    for (line, text) in (1..).zip(bytes.split(|&byte| byte == b'\n')) {
        let content = text.split(|&byte| byte == b'#').next().unwrap_or_default();
        let digits: Vec<u8> = content.iter().copied().filter(|b| !b.is_ascii_whitespace() && *b != b':').collect();
        let byte = |pair: &[u8]| u8::from_str_radix(str::from_utf8(pair).ok().filter(|t| t.len() == 2)?, 16).ok();
        let bytes: Option<Vec<u8>> = digits.chunks(2).map(byte).collect();
        match bytes {
            Some(bytes) if bytes.is_empty() => {}
            Some(bytes) => frames.push(Captured { time_s: None, bytes }),
            None => return Err(CaptureError::NoDigits { line }),
        }
    }
    Ok(frames)
}

fn of_pcap(bytes: &[u8], port: Option<u16>) -> Result<Vec<Captured>, CaptureError> {
    let fault = |number| move |e: pcap_file::PcapError| CaptureError::Packet { number, what: e.to_string() };
    let mut reader = PcapReader::new(bytes).map_err(fault(0))?;
    let link = reader.header().datalink;
    let mut frames = Vec::new();
    let mut number = 0;
    while let Some(packet) = reader.next_packet() {
        number += 1;
        let packet = packet.map_err(fault(number))?;
        frames.extend(frame_of(link, &packet.data, packet.timestamp, port, number)?);
    }
    Ok(frames)
}

fn of_pcapng(bytes: &[u8], port: Option<u16>) -> Result<Vec<Captured>, CaptureError> {
    let fault = |number| move |e: pcap_file::PcapError| CaptureError::Packet { number, what: e.to_string() };
    let mut reader = PcapNgReader::new(bytes).map_err(fault(0))?;
    let mut links = Vec::new();
    let mut frames = Vec::new();
    let mut number = 0;
    while let Some(block) = reader.next_block() {
        match block.map_err(fault(number + 1))? {
            Block::SectionHeader(_) => links.clear(),
            Block::InterfaceDescription(interface) => links.push(interface.linktype),
            Block::EnhancedPacket(packet) => {
                number += 1;
                let link = links.get(packet.interface_id as usize).copied().unwrap_or(DataLink::ETHERNET);
                frames.extend(frame_of(link, &packet.data, packet.timestamp, port, number)?);
            }
            _ => {}
        }
    }
    Ok(frames)
}

// Link types of captures, https://www.tcpdump.org/linktypes.html
const NULL: u32 = 0;
const ETHERNET: u32 = 1;
const RAW: u32 = 101;
const LOOP: u32 = 108;
const LINUX_COOKED: u32 = 113;
const USER_0: u32 = 147;
const LINUX_COOKED_2: u32 = 276;

/// The frame in a packet, if it has one: the whole packet of the link type User 0, else the content of a UDP datagram.
fn frame_of(
    link: DataLink,
    packet: &[u8],
    since: Duration,
    port: Option<u16>,
    number: usize,
) -> Result<Option<Captured>, CaptureError> {
    let time_s = Some(since.as_secs_f64());
    let ip_after = |head: usize| packet.get(head..).and_then(|ip| LaxSlicedPacket::from_ip(ip).ok());
    let sliced = match u32::from(link) {
        USER_0 => return Ok(Some(Captured { time_s, bytes: packet.to_vec() })),
        ETHERNET => LaxSlicedPacket::from_ethernet(packet).ok(),
        RAW | 12 | 14 => ip_after(0),
        NULL | LOOP => ip_after(4),
        LINUX_COOKED => ip_after(16),
        LINUX_COOKED_2 => ip_after(20),
        link => return Err(CaptureError::Link { number, link }),
    };
    let Some(TransportSlice::Udp(udp)) = sliced.and_then(|packet| packet.transport) else { return Ok(None) };
    let is_ours = port.is_none_or(|port| [udp.source_port(), udp.destination_port()].contains(&port));
    Ok(is_ours.then(|| Captured { time_s, bytes: udp.payload().to_vec() }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(frames: Vec<Captured>) -> Vec<Vec<u8>> {
        frames.into_iter().map(|frame| frame.bytes).collect()
    }

    #[test]
    fn text_has_a_frame_a_line() {
        let text = b"# two frames\n8C0F c0:de\r\n\n  01 # one\n";
        assert_eq!(bytes(frames(text, None).unwrap()), [vec![0x8C, 0x0F, 0xC0, 0xDE], vec![1]]);
        assert_eq!(frames(b"8C\n8C0\n", None), Err(CaptureError::NoDigits { line: 2 }));
        assert_eq!(frames(b"time: 8C", None), Err(CaptureError::NoDigits { line: 1 }));
    }

    /// A capture (pcap) with a packet of a link type.
    fn capture(link: u32, packet: &[u8]) -> Vec<u8> {
        let words =
            [0xA1B2_C3D4, 0x0004_0002, 0, 0, 65_535, link, 7, 250_000, packet.len() as u32, packet.len() as u32];
        words.iter().flat_map(|word| word.to_le_bytes()).chain(packet.iter().copied()).collect()
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
        let cooked = [&[0, 0, 3, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 8, 0][..], &ip].concat();
        for (link, packet) in
            [(147, vec![1, 2, 3]), (1, ethernet), (113, cooked), (276, [&[8; 20][..], &ip].concat()), (101, ip)]
        {
            let found = frames(&capture(link, &packet), None).unwrap();
            assert_eq!(found, [Captured { time_s: Some(7.25), bytes: vec![1, 2, 3] }], "link type {link}");
        }
        assert_eq!(frames(&capture(105, &[1]), None), Err(CaptureError::Link { number: 1, link: 105 }));
    }

    #[test]
    fn datagrams_of_other_ports_are_left_out() {
        let capture = capture(101, &datagram(&[1, 2, 3]));
        let found = |port| frames(&capture, Some(port)).unwrap().len();
        assert_eq!([7001, 7002, 7003].map(found), [1, 1, 0]);
    }

    #[test]
    fn a_capture_that_is_cut_is_refused() {
        let mut cut = capture(147, &[1, 2, 3]);
        cut.pop();
        assert!(matches!(frames(&cut, None), Err(CaptureError::Packet { number: 1, .. })));
    }
}

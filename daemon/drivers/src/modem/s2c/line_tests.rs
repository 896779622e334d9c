use super::super::notice::{Heard, Place, Service};
use super::*;

fn lines(ties: bool, bytes: &[u8]) -> Vec<Line> {
    let mut parser = LineParser::default();
    parser.set_ties(ties);
    let mut found = Vec::new();
    for byte in bytes {
        parser.push(&[*byte]);
        found.extend(std::iter::from_fn(|| parser.next_line()));
    }
    found
}

fn reply(text: &str) -> Line {
    Line::Reply(None, text.to_owned())
}

#[test]
fn payload_is_counted_and_never_searched() {
    let data = b"a\r\nOK\r\n+++AT,\0";
    let mut bytes = b"\r\nRECVIM,14,3,2,ack,313200,-60,170,0.0300,".to_vec();
    bytes.extend_from_slice(data);
    bytes.extend_from_slice(b"\r\n[*]OK\r\n");
    let heard =
        Heard { service: Service::Message, src: 3, dst: 2, integrity: 170, travel_us: None, data: data.to_vec() };
    assert_eq!(lines(false, &bytes), [Line::Notice(Notice::Heard(heard)), reply("[*]OK")]);
}

#[test]
fn every_reception_is_known_with_and_without_protocol_id() {
    for (line, service, integrity, travel_us) in [
        ("RECV,2,1,9,13000,-55,175,667000,0.0000,", Service::Burst, 175, Some(667_000)),
        ("RECV,p0,2,1,9,13000,-55,175,667000,-0.0100,", Service::Burst, 175, Some(667_000)),
        ("RECVIM,p3,2,1,9,noack,182272,-40,120,0.1000,", Service::Message, 120, None),
        ("RECVIMS,2,1,9,4000,182272,-40,120,0.1000,", Service::Message, 120, None),
        ("RECVPBM,2,1,9,139000,-40,121,0.1000,", Service::Message, 121, None),
    ] {
        let bytes = [line.as_bytes(), b"\n,\r\n"].concat();
        let heard = Heard { service, src: 1, dst: 9, integrity, travel_us, data: b"\n,".to_vec() };
        assert_eq!(lines(false, &bytes), [Line::Notice(Notice::Heard(heard))], "{line}");
    }
}

#[test]
fn a_real_fix_is_read() {
    let real = b"USBLLONG,10446.991981,10446.534643,3,-0.0604,-1.0888,-0.5851,-0.4233,-1.0020,-0.5901,0.0063,0.0269,-0.3295,825,-36,77,1.2375\r\n";
    let found = lines(false, real);
    let [Line::Notice(Notice::Usbl(position))] = found.as_slice() else { panic!("{found:?}") };
    assert_eq!((position.remote, position.place), (3, Place::Enu([-0.4233, -1.0020, -0.5901], 825)));
    assert!((position.age_s - 0.457338).abs() < 1e-6 && position.accuracy == 1.2375);
}

#[test]
fn notices_are_distinguished_from_replies() {
    let other = Line::Notice(Notice::Other);
    assert_eq!(lines(false, b"FAILED\r\n"), [reply("FAILED")]);
    assert_eq!(
        lines(false, b"FAILED,7,2\r\nBUSY DELIVERING MESSAGE\r\nRECVSTART\r\nPHYON\r\nRECVEND,1,2,-3,4,0.1\r\n"),
        [
            Line::Notice(Notice::BurstDone { delivered: false, count: 7 }),
            reply("BUSY DELIVERING MESSAGE"),
            other.clone(),
            other.clone(),
            other
        ]
    );
}

#[test]
fn wrapped_lines_are_found_between_raw_data() {
    let bytes = b"ab+++AT*SENDIM:2:OK\r\n+++AT:23:SENDSTART,3,im,182272,0\r\n+++AT:13:DELIVEREDIM,3\r\n+cd++";
    let found = lines(true, bytes);
    let raw: Vec<u8> =
        found.iter().filter_map(|l| if let Line::Raw(b) = l { Some(b.clone()) } else { None }).flatten().collect();
    assert_eq!(raw, b"ab+cd");
    assert!(found.contains(&Line::Reply(Some("*SENDIM".to_owned()), "OK".to_owned())));
    assert!(found.contains(&Line::Notice(Notice::InstantDone { delivered: true, dst: 3 })));
}

#[test]
fn a_port_without_data_mode_is_noticed() {
    assert_eq!(lines(true, b"xERROR WRONG FORMAT\r\nNET\r\n").last(), Some(&reply("NET")));
}

#[test]
fn the_line_after_nonsense_is_found() {
    for nonsense in [&b"\xFF\x00,,,\r\n"[..], b"RECVIM,64,1,2,ack,1,-3,4,0.1,short\r\n", b"RECV,9999,1,2,\r\n"] {
        let mut bytes = nonsense.to_vec();
        bytes.extend_from_slice(&[b'x'; 80]);
        bytes.extend_from_slice(b"\r\nOK\r\n");
        assert_eq!(lines(false, &bytes).last(), Some(&reply("OK")), "{nonsense:?}");
    }
}

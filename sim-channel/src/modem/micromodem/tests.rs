//! Behaviour of the Micromodem at the host's port.

use super::*;
use crate::channel::{ChannelConfig, Outage};
use crate::loss::LossModel;
use crate::modem::Emulator;
use crate::modem::tests::rig::{EmulatorRig, SECOND, keywords};
use crate::nodes::NodeId;
use proptest::prelude::*;

fn rig_in(modems: u8, config: ChannelConfig) -> EmulatorRig {
    let modem = |address| MicromodemConfig { baud: Some(115_200), ..MicromodemConfig::new(address) };
    let boxed = |address| (address, Box::new(Micromodem::new(modem(address))) as Box<dyn Emulator>);
    EmulatorRig::join((1..=modems).map(boxed).collect(), 1500.0, config)
}

fn rig(modems: u8) -> EmulatorRig {
    rig_in(modems, ChannelConfig::default())
}

/// Lines without `$` and checksum; each checksum is verified.
fn bodies(rig: &mut EmulatorRig, node: u8) -> Vec<String> {
    let body = |text: String| {
        let (body, sum) = text.strip_prefix('$').and_then(|rest| rest.rsplit_once('*')).expect("sentence");
        assert_eq!(sum, format!("{:02X}", sentence::checksum(body.as_bytes())), "{body}");
        body.to_string()
    };
    rig.lines(node).into_iter().map(body).collect()
}

/// Writes a sentence and returns the lines that come at once.
fn request(rig: &mut EmulatorRig, node: u8, text: &str) -> Vec<String> {
    rig.take(node);
    rig.write(node, format!("${text}\r\n").as_bytes());
    rig.run(Duration::from_millis(150));
    bodies(rig, node)
}

#[test]
fn a_psk_downlink_follows_the_transcript() {
    let mut rig = rig(2);
    let mut received = request(&mut rig, 1, "CCCYC,0,1,2,1,1,3");
    for frame in 1..=3 {
        assert_eq!(received.last().expect("request")[12..], format!(",1,2,1,64,{frame}"));
        received = request(&mut rig, 1, &format!("CCTXD,1,2,1,{}", "aB".repeat(64)));
        assert_eq!(received[0], "CATXD,1,2,1,64");
    }
    assert_eq!(received[1], "CATXP,192");
    rig.run(10 * SECOND);
    let sender = bodies(&mut rig, 1);
    assert_eq!(sender[0], "CATXF,192");
    assert!(sender[1].starts_with("CAXST,6,20250101,0000"), "{}", sender[1]);
    assert!(sender[1].ends_with(",6,0,200,5000,25000,1,1,2,1,3,3,3,192"), "{}", sender[1]);
    assert_eq!(sender[2..6], ["CARXP,1", "CAACK,2,1,1,1", "CAACK,2,1,2,1", "CAACK,2,1,3,1"]);
    assert!(sender[6].starts_with("CACST,6,0,"));
    assert_eq!(sender.len(), 7);
    let peer = bodies(&mut rig, 2);
    assert_eq!(peer[..2], ["CARXP,1", "CACYC,0,1,2,1,0,3"]);
    for frame in 1..=3 {
        assert_eq!(peer[1 + frame], format!("CARXD,1,2,1,{frame},{}", "AB".repeat(64)));
    }
    assert!(peer[5].starts_with("CACST,6,0,2025010100000"));
    assert_eq!(peer.len(), 6);
}

#[test]
fn statistics_have_every_field_of_version_six() {
    let mut rig = rig(2);
    request(&mut rig, 1, "CCCYC,0,1,2,5,0,1");
    request(&mut rig, 1, "CCTXD,1,2,0,01");
    rig.run(10 * SECOND);
    let received = bodies(&mut rig, 2);
    let fields: Vec<_> = received.last().expect("statistics").split(',').skip(1).collect();
    assert_eq!(fields.len(), 30);
    assert_eq!(fields[2].split_once('.').map(|(whole, part)| (whole.len(), part.len())), Some((14, 6)));
    assert_eq!(fields[13..20], ["5", "001", "002", "0", "3", "1", "0"]);
    assert_eq!(fields[28..], ["25000", "5000"]);
    let whole = |index: &usize| fields[*index].parse::<i32>().is_ok();
    assert!([0, 1, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 18, 19, 20, 25, 27].iter().all(whole), "{fields:?}");
    assert!((21..27).all(|index| fields[index].parse::<f64>().is_ok()));
}

#[test]
fn an_fsk_downlink_sends_its_cycle_init_first() {
    let mut rig = rig(2);
    let received = request(&mut rig, 1, "CCCYC,0,1,2,0,1,1");
    assert_eq!(received, ["CACYC,0,1,2,0,1,1", "CATXP,0"]);
    rig.run(SECOND);
    assert_eq!(keywords(&bodies(&mut rig, 1)), ["CATXF", "CAXST", "CADRQ"]);
    assert_eq!(request(&mut rig, 1, "CCTXD,1,2,1,0102"), ["CATXD,1,2,1,2", "CATXP,32"]);
    rig.run(10 * SECOND);
    assert_eq!(keywords(&bodies(&mut rig, 1)), ["CATXF", "CAXST", "CARXP", "CAACK", "CACST"]);
    let peer = bodies(&mut rig, 2);
    assert_eq!(keywords(&peer), ["CARXP", "CACYC", "CACST", "CARXP", "CARXD", "CACST"]);
    assert_eq!(
        (peer[0].as_str(), peer[1].as_str(), peer[4].as_str()),
        ("CARXP,0", "CACYC,0,1,2,0,1,1", "CARXD,1,2,1,1,0102")
    );
}

#[test]
fn uplink_is_requested_by_a_minipacket() {
    let mut rig = rig(2);
    assert_eq!(request(&mut rig, 1, "CCCYC,0,2,1,1,0,1")[0], "CACYC,0,2,1,1,0,1");
    rig.run(3 * SECOND);
    let peer = bodies(&mut rig, 2);
    assert_eq!(keywords(&peer), ["CARXP", "CACYC", "CACST", "CADRQ"]);
    assert!(peer[3].ends_with(",2,1,0,64,1"));
    request(&mut rig, 2, "CCTXD,2,1,0,CAFE");
    rig.run(10 * SECOND);
    let requester = bodies(&mut rig, 1);
    assert_eq!(keywords(&requester), ["CATXF", "CAXST", "CARXP", "CACYC", "CARXD", "CACST"]);
    assert_eq!(requester[4], "CARXD,2,1,0,1,CAFE");
}

#[test]
fn an_empty_frame_ends_the_packet() {
    let mut rig = rig(2);
    request(&mut rig, 1, "CCCYC,0,1,2,2,0,3");
    request(&mut rig, 1, "CCTXD,1,2,0,01");
    assert_eq!(request(&mut rig, 1, "CCTXD,1,2,0,"), ["CATXD,1,2,0,0", "CATXP,64"]);
    rig.run(10 * SECOND);
    assert!(bodies(&mut rig, 1)[1].ends_with(",2,1,2,0,3,1,3,64"));
    assert_eq!(bodies(&mut rig, 2)[1..3], ["CACYC,0,1,2,2,0,1", "CARXD,1,2,0,1,01"]);
}

#[test]
fn slow_host_gets_a_timeout_and_a_partial_packet() {
    let mut rig = rig(2);
    request(&mut rig, 1, "CCCYC,0,1,2,1,0,2");
    rig.run(3 * SECOND);
    let received = bodies(&mut rig, 1);
    assert_eq!(received.len(), 1);
    assert!(received[0].starts_with("CAERR,0000") && received[0].ends_with(",DATA_TIMEOUT,1"));
    request(&mut rig, 1, "CCCYC,0,1,2,1,0,2");
    request(&mut rig, 1, "CCTXD,1,2,0,01");
    rig.run(3 * SECOND);
    let received = bodies(&mut rig, 1);
    assert!(received[0].ends_with(",DATA_TIMEOUT,2") && received[1] == "CATXP,64");
}

#[test]
fn goby_start_up_sequence_is_accepted() {
    let mut rig = rig(1);
    for name in ["ALL,0", "CST,1", "SRC,1", "REV,1", "RXP,1", "psk.packet.mod_hdr_version,0"] {
        assert_eq!(request(&mut rig, 1, &format!("CCCFG,{name}")), [format!("CACFG,{name}")]);
    }
    rig.write(1, b"$CCMSC,1,1,0*41\r\n");
    rig.run(2 * SECOND);
    let received = bodies(&mut rig, 1);
    assert_eq!(received[0], "CAMSC,1,1,0");
    assert!(received[1].starts_with("CAREV,0000") && received[1].ends_with(",INIT,2.0.27087"));
    assert!(received[2].starts_with("CAREV,0000") && received[2].ends_with(",AUV,2.0.27087"));
    assert_eq!(request(&mut rig, 1, "CCCFQ,SRC"), ["CACFG,SRC,1"]);
    assert_eq!(request(&mut rig, 1, "CCTMS,2025-06-06T23:01:03Z,0"), ["CATMS,0,2025-06-06T23:01:03Z"]);
    rig.write(1, b"$CCCFQ,TOP\r\n");
    rig.run(SECOND);
    let listed = bodies(&mut rig, 1);
    assert!(
        listed.len() > 10 && listed.iter().all(|line| line.rsplit(',').next().expect("value").parse::<i32>().is_ok())
    );
    assert_eq!(request(&mut rig, 1, "CCTMQ,0"), Vec::<String>::new());
    rig.run(SECOND);
    assert!(bodies(&mut rig, 1)[0].starts_with("CATMQ,2025-06-06T23:01:0"));
    rig.run(60 * SECOND);
    assert_eq!(keywords(&bodies(&mut rig, 1)), ["CAREV", "CAREV"]);
    assert_eq!(request(&mut rig, 1, "CCCLK,2025,06,06,23,01,03"), ["CACLK,2025,06,06,23,01,03"]);
    assert_eq!(request(&mut rig, 1, "CCALQ,0"), ["CAALQ,MICROMODEM2,16"]);
}

#[test]
fn first_generation_statistics_have_no_version() {
    let modem = |address| MicromodemConfig { baud: None, ..MicromodemConfig::first_generation(address) };
    let boxed = |address| (address, Box::new(Micromodem::new(modem(address))) as Box<dyn Emulator>);
    let mut rig = EmulatorRig::join((1..=2).map(boxed).collect(), 1500.0, ChannelConfig::default());
    request(&mut rig, 1, "CCCYC,0,1,2,2,0,1");
    request(&mut rig, 1, "CCTXD,1,2,0,01");
    rig.run(10 * SECOND);
    assert!(bodies(&mut rig, 1)[1].starts_with("CAXST,20250101,0000"));
    let received = bodies(&mut rig, 2);
    let fields: Vec<_> = received.last().expect("statistics").split(',').skip(1).collect();
    assert_eq!((fields.len(), fields[0]), (29, "0"));
    assert_eq!((fields[1].len(), &fields[1][..4]), (11, "0000"));
    assert_eq!(fields[12..18], ["2", "001", "002", "0", "3", "1"]);
    for newer in ["CCTMS,2025-06-06T23:01:03Z,0", "CCTDP,2,1,0,0,00", "CCFQ,TOP", "CCALQ,0"] {
        assert!(request(&mut rig, 1, newer)[0].contains(",NMEA,"), "{newer}");
    }
    assert_eq!(request(&mut rig, 1, "CCCLK,2025,06,06,23,01,03"), ["CACLK,2025,06,06,23,01,03"]);
    rig.write(1, b"$CCMSC,1,1,0\r\n");
    rig.run(2 * SECOND);
    assert!(bodies(&mut rig, 1)[2].ends_with(",AUV,0.94.0.04"));
}

#[test]
fn ping_reports_the_travel_time() {
    let mut rig = rig(2);
    assert_eq!(request(&mut rig, 1, "CCMPC,1,2"), ["CAMPC,1,2", "CATXP,0"]);
    rig.run(10 * SECOND);
    let received = bodies(&mut rig, 1);
    assert_eq!(keywords(&received), ["CATXF", "CAXST", "CARXP", "CAMPR", "CACST"]);
    assert_eq!(received[3], "CAMPR,2,1,1.0000");
    let peer = bodies(&mut rig, 2);
    assert_eq!(keywords(&peer), ["CARXP", "CAMPA", "CACST"]);
    assert_eq!(peer[1], "CAMPA,1,2");
}

#[test]
fn flexible_data_is_reported_in_triples() {
    let mut rig = rig(2);
    assert_eq!(request(&mut rig, 1, "CCTDP,2,1,0,0,0A0b")[0], "CATDP,0,1,2,1,0,0,2,0");
    rig.run(10 * SECOND);
    let received = bodies(&mut rig, 1);
    assert!(received[1].starts_with("CAXST,6,") && received[1].ends_with(",1,1,5,2"), "{}", received[1]);
    let peer = bodies(&mut rig, 2);
    assert_eq!(peer[1], "CARDP,1,2,1,0,0,1;2;0A0B,");
    assert!(peer[2].contains(",5,1,0,"));
    request(&mut rig, 2, "CCCFG,recv.base64data,1");
    request(&mut rig, 1, &format!("CCTDP,2,3,0,0,{}", "00".repeat(62)));
    rig.run(10 * SECOND);
    assert!(bodies(&mut rig, 2)[1].ends_with("A,1;2;AAA="));
    assert_eq!(request(&mut rig, 1, "CCTDP,2,2,0,0,00"), ["CATDP,1,0,2,2,0,0,0,0"]);
}

#[test]
fn user_bits_arrive() {
    let mut rig = rig(2);
    assert_eq!(request(&mut rig, 1, "CCMUC,1,2,1abc")[0], "CAMUC,1,2,1abc");
    rig.run(10 * SECOND);
    assert_eq!(bodies(&mut rig, 2)[1], "CAMUA,1,2,1ABC");
    assert!(request(&mut rig, 1, "CCMUC,1,2,2000")[0].starts_with("CAERR,"));
}

#[test]
fn third_modem_overhears_without_acknowledging() {
    let mut rig = rig(3);
    request(&mut rig, 1, "CCCYC,0,1,2,1,1,1");
    request(&mut rig, 1, "CCTXD,1,2,1,01");
    rig.run(20 * SECOND);
    let third = bodies(&mut rig, 3);
    assert_eq!(keywords(&third), ["CARXP", "CACYC", "CARXD", "CACST", "CARXP", "CAACK", "CACST"]);
    assert_eq!(bodies(&mut rig, 1).iter().filter(|line| line.starts_with("CAACK,2,1,")).count(), 1);
}

#[test]
fn without_an_address_nothing_is_acknowledged() {
    let mut rig = rig(2);
    request(&mut rig, 2, "CCCFG,SRC,0");
    request(&mut rig, 1, "CCCYC,0,1,0,1,1,1");
    request(&mut rig, 1, "CCTXD,1,0,1,01");
    rig.run(20 * SECOND);
    assert!(!bodies(&mut rig, 1).iter().any(|line| line.starts_with("CAACK")));
    assert!(bodies(&mut rig, 2).iter().any(|line| line.starts_with("CARXD,1,0,1,1,01")));
}

#[test]
fn header_versions_do_not_mix() {
    let mut rig = rig(2);
    request(&mut rig, 1, "CCCFG,psk.packet.mod_hdr_version,1");
    request(&mut rig, 1, "CCTDP,2,1,0,0,00");
    rig.run(10 * SECOND);
    assert_eq!(bodies(&mut rig, 2), Vec::<String>::new());
}

#[test]
fn lost_packet_times_out_and_damaged_frame_fails_its_crc() {
    let lossy = ChannelConfig { loss: LossModel::Independent { probability: 1.0 }, ..Default::default() };
    let damaged = ChannelConfig { corruption: 1.0, ..Default::default() };
    let receive = |config| {
        let mut rig = rig_in(2, config);
        request(&mut rig, 1, "CCCYC,0,1,2,5,0,2");
        request(&mut rig, 1, &format!("CCTXD,1,2,0,{}", "00".repeat(256)));
        request(&mut rig, 1, &format!("CCTXD,1,2,0,{}", "00".repeat(256)));
        rig.run(10 * SECOND);
        bodies(&mut rig, 2)
    };
    let received = receive(lossy);
    assert_eq!(received[..2], ["CARXP,1", "CAMSG,PACKET_TIMEOUT,0"]);
    assert!(received[2].starts_with("CACST,6,2,202501010000"));
    let received = receive(damaged);
    assert!(received.contains(&"CAMSG,BAD_CRC,0".to_string()), "{received:?}");
    assert_eq!(keywords(&received).last(), Some(&"CACST"));
}

#[test]
fn outage_causes_no_report_at_the_receiver() {
    let config = ChannelConfig { outages: vec![Outage::one_way(NodeId(1), NodeId(2))], ..Default::default() };
    let mut rig = rig_in(2, config);
    request(&mut rig, 1, "CCMPC,1,2");
    rig.run(20 * SECOND);
    assert_eq!(bodies(&mut rig, 2), Vec::<String>::new());
    assert_eq!(keywords(&bodies(&mut rig, 1)), ["CATXF", "CAXST"]);
}

#[test]
fn invalid_sentences_are_refused() {
    let mut rig = rig(1);
    let refused = [
        "CCXYZ,1",
        "CCCYC,0,1,2,9,0,1",
        "CCCYC,0,1,2,1,0,4",
        "CCCYC,0,1",
        "CCTXD,1,2,0,0g",
        "CCCFG,SRC",
        "CCCFQ,NOPE",
        "CCCLK,2025,13,01,0,0,0",
        "CCMSC,1,1,x",
        "nonsense",
        "CCCFG,SRC,1*00",
    ];
    for text in refused {
        let received = request(&mut rig, 1, text);
        assert!(
            received.len() == 1 && received[0].starts_with("CAERR,0000") && received[0].contains(",NMEA,"),
            "{text}: {received:?}"
        );
        assert!(received[0].split(',').nth(3).is_some_and(|number| number.parse::<u8>().is_ok()));
    }
}

#[test]
fn faults_change_the_modem_as_described() {
    let mut rig = rig(2);
    let now = rig.basin.now();
    rig.basin.inject(NodeId(1), Fault::Busy(SECOND), now);
    assert!(request(&mut rig, 1, "CCMPC,1,2")[0].ends_with(",MODEM,4,Busy"));
    request(&mut rig, 1, "CCCFG,DTO,9");
    let now = rig.basin.now();
    rig.basin.inject(NodeId(1), Fault::WrongAddress(7), now);
    assert_eq!(request(&mut rig, 1, "CCCFQ,SRC"), ["CACFG,SRC,7"]);
    let now = rig.basin.now();
    rig.basin.inject(NodeId(1), Fault::Reboot, now);
    rig.run(2 * SECOND);
    assert_eq!(keywords(&bodies(&mut rig, 1)), ["CAREV", "CAREV"]);
    assert_eq!(request(&mut rig, 1, "CCCFQ,DTO"), ["CACFG,DTO,2"]);
}

#[test]
fn sleeping_modem_wakes_at_its_time_or_on_host_bytes() {
    let mut rig = rig(1);
    assert_eq!(request(&mut rig, 1, "CCMSC,1,1,1"), ["CAMSC,1,1,1"]);
    assert_eq!(request(&mut rig, 1, "CCCFQ,SRC"), Vec::<String>::new());
    rig.run(62 * SECOND);
    assert_eq!(keywords(&bodies(&mut rig, 1)), ["CAREV", "CAREV"]);
    request(&mut rig, 1, "CCMSC,1,1,-1");
    rig.run(200 * SECOND);
    assert_eq!(bodies(&mut rig, 1), Vec::<String>::new());
    rig.write(1, b"\r\n");
    rig.run(2 * SECOND);
    assert_eq!(keywords(&bodies(&mut rig, 1)), ["CAREV", "CAREV"]);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]
    #[test]
    fn mutated_sentences_are_survived(
        edits in proptest::collection::vec((0usize..9, 0usize..30, any::<u8>(), 0u64..3000), 1..20),
    ) {
        const LINES: [&str; 9] = [
            "$CCCYC,0,1,2,5,1,2\r\n", "$CCTXD,1,2,1,00112233\r\n", "$CCTDP,2,1,0,0,0011\r\n", "$CCMPC,1,2\r\n",
            "$CCMUC,1,2,1FFF\r\n", "$CCMSC,1,1,0\r\n", "$CCCLK,2025,06,06,23,01,03\r\n", "$CCTMS,2025-06-06T23:01:03Z,0\r\n",
            "$CCCFG,SRC,1\r\n$CCCFQ,ALL\r\n",
        ];
        let mut rig = rig_in(2, ChannelConfig { corruption: 0.5, ..Default::default() });
        for (which, at, byte, pause) in edits {
            let mut line = LINES[which].as_bytes().to_vec();
            let at = at % line.len();
            line[at] = byte;
            rig.write(1, &line);
            rig.run(Duration::from_millis(pause));
        }
    }
}

//! Start-up sequences of known clients, line by line.

use super::rig::{EmulatorRig, SECOND};
use crate::channel::ChannelConfig;
use crate::modem::s2c::{Interpreter, S2cConfig};

fn at_port() -> EmulatorRig {
    let config = S2cConfig { interpreter: Interpreter::At, ..S2cConfig::new(1) };
    EmulatorRig::of(vec![config, S2cConfig::new(2)], 1500.0, ChannelConfig::default())
}

#[test]
fn dmac_finds_a_net_port_and_sets_it_up() {
    let mut rig = EmulatorRig::calm(1);
    assert_eq!(rig.request(1, "+++AT?MODE\r"), "ERROR WRONG FORMAT\r\n");
    assert_eq!(rig.request(1, "AT?MODE\r"), "NET\r\n");
    for line in ["AT@CTRL\r", "AT!L3\r", "AT!AL7\r", "AT@ZX1\r"] {
        assert_eq!(rig.request(1, line), "OK\r\n");
    }
    assert_eq!(rig.request(1, "AT?AL\r"), "7\r\n");
}

#[test]
fn dmac_finds_an_at_port_and_sets_it_up() {
    let mut rig = at_port();
    assert_eq!(rig.request(1, "+++AT?MODE\r"), "+++AT?MODE:2:AT\r\n");
    assert_eq!(rig.request(1, "+++ATO\r+++AT@CTRL\r"), "+++AT@CTRL:2:OK\r\n");
    assert_eq!(rig.request(1, "+++AT!L3\r"), "+++AT!L:2:OK\r\n");
    assert_eq!(rig.request(1, "+++AT!AL5\r"), "+++AT!AL:2:OK\r\n");
    assert_eq!(rig.request(1, "+++AT*SENDIM,2,2,noack,hi\r"), "+++AT*SENDIM:2:OK\r\n");
}

#[test]
fn evins_queries_numbers_and_switches_options_on() {
    let mut rig = EmulatorRig::calm(3);
    let replies: Vec<_> = ["?AL", "?AM", "?PID"].map(|query| rig.request(3, &format!("AT{query}\n"))).into();
    assert_eq!(replies, ["3\r\n", "14\r\n", "0\r\n"]);
    for option in ["@ZF1", "@ZX1", "@ZU1", "@ZA1"] {
        assert_eq!(rig.request(3, &format!("AT{option}\n")), "OK\r\n");
    }
    assert_eq!(rig.request(3, "AT*SENDIM,p0,2,1,noack,hi\n"), "OK\r\nSENDSTART,1,im,182800,0\r\n");
}

#[test]
fn dune_reboots_then_sets_everything() {
    let mut rig = EmulatorRig::calm(1);
    assert_eq!(rig.request(1, "ATZ0\n"), "");
    assert_eq!(rig.basin.poll_hang_up(), Some(crate::nodes::NodeId(1)));
    rig.run(5 * SECOND);
    for line in ["ATZ1\n", "ATZ3\n", "ATZ4\n"] {
        assert_eq!(rig.request(1, line), "OK\r\n");
    }
    assert_eq!(rig.request(1, "AT?MODE\n"), "NET\r\n");
    assert_eq!(rig.request(1, "ATI0\n"), "1.9\r\n");
    assert_eq!(rig.request(1, "ATI1\n"), "phy:S2C PHY 0.9, mac:D-MAC v1.8\r\n");
    for line in
        ["@CTRL", "!AL1", "!L3", "!G0", "!RC50", "!RT2000", "!RI0", "!ZI10", "!AM14", "@ZU1", "!RP1", "!C2", "@ZX1"]
    {
        assert_eq!(rig.request(1, &format!("AT{line}\n")), "OK\r\n", "{line}");
    }
    assert!(rig.request(1, "AT?CLOCK\n").trim_end().parse::<u32>().is_ok());
    assert_eq!(rig.request(1, "AT?T\n"), "0\r\n");
    let paths = rig.request(1, "AT?P\n");
    let first_line = paths.split("\r\n").next().expect("line");
    assert_eq!((first_line.len(), paths.len()), (96, 98));
    assert_eq!(first_line.split_whitespace().filter(|word| word.parse::<u32>().is_ok()).count(), 16);
    assert!(paths.ends_with("\n\r\n"));
}

#[test]
fn perl_reads_five_lines_of_status() {
    let mut rig = EmulatorRig::calm(2);
    for line in ["!CA1500", "!LC0", "!AM14", "!RT1500", "!RC1"] {
        assert_eq!(rig.request(2, &format!("AT{line}\r")), "OK\r\n", "{line}");
    }
    assert!(rig.request(2, "AT?BV\r").trim_end().parse::<f64>().is_ok());
    let status = rig.request(2, "AT?S\r");
    let lines: Vec<_> = status.split("\r\n").collect();
    assert_eq!(lines[0], "Local Address: 2");
    assert_eq!(lines[1], "Remote Address: 0");
    assert!(lines[2].starts_with("Acoustic Link") && lines[2].ends_with(": INITIATION LISTEN"));
    assert!(lines[3].starts_with("Pool Status: "));
    assert_eq!(lines[4..], ["Promiscuous Mode: OFF", "", ""]);
}

#[test]
fn rock_reads_ties_in_data_mode() {
    let mut rig = at_port();
    assert_eq!(rig.request(1, "+++ATI0\r"), "+++ATI0:3:1.9\r\n");
    rig.write(1, b"+++AT&V\r");
    rig.run(SECOND);
    let listed = rig.take(1);
    let body = listed.strip_prefix("+++AT&V:").expect("tag");
    let (len, body) = body.split_once(':').expect("length");
    assert_eq!(len.parse::<usize>().expect("number"), body.len() - 2);
    assert!(body.starts_with("Source Level: 3\r\nSource Level Control: 0\r\nGain: 0\r\n"));
    assert!(body.ends_with("Idle Timeout: 120\r\n\r\n"));
    assert_eq!(body.trim_end().lines().count(), 18);
}

#[test]
fn guard_time_leads_to_command_mode_and_ato_back() {
    let mut rig = at_port();
    rig.run(2 * SECOND);
    rig.write(1, b"+++");
    rig.run(2 * SECOND);
    assert_eq!(rig.take(1), "OK\r\n");
    assert_eq!(rig.request(1, "AT?MODE\r"), "AT\r\n");
    assert_eq!(rig.request(1, "nonsense\r"), "ERROR WRONG FORMAT\r\n");
    assert_eq!(rig.request(1, "ATO\r"), "");
    assert_eq!(rig.request(1, "+++AT?MODE\r"), "+++AT?MODE:2:AT\r\n");
    assert_eq!(rig.request(1, "+++ATC\r"), "OK\r\n");
    assert_eq!(rig.request(1, "AT?AL\r"), "1\r\n");
}

#[test]
fn invalid_commands_get_specific_errors() {
    let mut rig = EmulatorRig::calm(1);
    for (line, reply) in [
        ("AT!L9", "ERROR OUT OF RANGE"),
        ("AT!Lx", "ERROR WRONG FORMAT"),
        ("AT!QQ1", "ERROR UNKNOWN COMMAND"),
        ("AT?QQ", "ERROR UNKNOWN COMMAND"),
        ("ATXYZ", "ERROR UNKNOWN COMMAND"),
        ("AT@ZX2", "ERROR OUT OF RANGE"),
        ("AT@ZL100", "ERROR OUT OF RANGE"),
        ("AT*SENDIM,2,1,ack,hi", "ERROR WRONG DESTINATION ADDRESS"),
        ("AT*SENDIM,2,99,ack,hi", "ERROR WRONG DESTINATION ADDRESS"),
        ("AT*SENDIM,2,255,ack,hi", "ERROR WRONG DESTINATION ADDRESS"),
        ("AT*SENDIM,0,2,ack,", "ERROR OUT OF RANGE"),
        ("AT*SENDIM,2,2,perhaps,hi", "ERROR WRONG FORMAT"),
        ("ATA", "INITIATION LISTEN"),
        ("AT", "OK"),
    ] {
        assert_eq!(rig.request(1, &format!("{line}\r")), format!("{reply}\r\n"), "{line}");
    }
}

#[test]
fn settings_need_control_where_the_firmware_requires_it() {
    let config = S2cConfig { needs_control: true, ..S2cConfig::new(1) };
    let mut rig = EmulatorRig::of(vec![config], 0.0, ChannelConfig::default());
    assert_eq!(rig.request(1, "AT!L3\r"), "ERROR NOT ACCEPTED\r\n");
    assert_eq!(rig.request(1, "AT@CTRL\r"), "OK\r\n");
    assert_eq!(rig.request(1, "AT!L3\r"), "OK\r\n");
}

#[test]
fn noise_is_binary_and_counted() {
    let mut rig = EmulatorRig::calm(1);
    let reply = rig.request(1, "AT?NOISE\r");
    let fields: Vec<_> = reply.splitn(6, ',').collect();
    assert_eq!((fields[0], fields[1]), ("NOISE", "64"));
    assert_eq!(fields[5].chars().count(), 66);
    assert!(reply.ends_with("\r\n"));
}

//! The capacity of an emulated S2C modem, measured by a host that only keeps its pool full.

use super::ModemSetting;
use scenecast_drivers::modem::s2c::{Line, LineParser};
use sim_channel::modem::Basin;
use sim_channel::modem::s2c::{S2c, S2cConfig};
use sim_channel::{Channel, NodeId, NodePosition};
use std::time::Duration;

const FROM: NodeId = NodeId(1);
const TO: NodeId = NodeId(2);
const RECORD: usize = 1000;
/// Time between two attempts while the pool is full.
const RETRY_INTERVAL: Duration = Duration::from_millis(500);

/// Payload that the other host receives over `time` after the connection is up, bit/s.
pub fn push(setting: &ModemSetting, seed: u64, time: Duration) -> f64 {
    const WARM_UP: Duration = Duration::from_secs(60);
    let mut basin = Basin::new(Channel::new(setting.channel(), seed));
    for (node, x) in [(FROM, 0.0), (TO, setting.range_m)] {
        basin.channel().place(node, NodePosition::new(x, 0.0, 10.0));
        let baud = Some(setting.config.modem.baud);
        basin.add(node, Box::new(S2c::new(S2cConfig { baud, seed, ..S2cConfig::new(node.0) })));
    }
    let command = [format!("AT*SEND,{RECORD},{},", TO.0).into_bytes(), vec![b'x'; RECORD], b"\r".to_vec()].concat();
    let (mut replies, mut arrivals) = (LineParser::default(), LineParser::default());
    let (mut now, mut next) = (Duration::ZERO, Some(Duration::ZERO));
    let mut carried = 0usize;
    while now < WARM_UP + time {
        now = basin.poll_timeout().into_iter().chain(next).min().unwrap_or(now + RETRY_INTERVAL).max(now);
        basin.advance(now);
        replies.push(&basin.poll_host_bytes(FROM));
        while let Some(line) = replies.next_line() {
            match line {
                Line::Reply(_, text) if text == "OK" => next = Some(now),
                Line::Reply(..) => next = Some(now + RETRY_INTERVAL),
                _ => {}
            }
        }
        arrivals.push(&basin.poll_host_bytes(TO));
        while let Some(line) = arrivals.next_line() {
            let is_data = matches!(line, Line::Notice(_));
            carried += if is_data && now >= WARM_UP { RECORD } else { 0 };
        }
        if next.is_some_and(|at| at <= now) {
            next = None;
            basin.handle_host_bytes(FROM, &command, now);
        }
    }
    carried as f64 * 8.0 / time.as_secs_f64()
}

//! Two nodes exchange frames over a lossy channel in virtual time: stop-and-wait with acknowledgements and repeats.
//!
//! `cargo run -p sim-channel --example lossy_channel`

use sim_channel::{Channel, Duration, NodeId, NodePosition, ReceptionOutcome, presets};

const VEHICLE: NodeId = NodeId(1);
const SHIP: NodeId = NodeId(2);
const FRAME_AIRTIME: Duration = Duration::from_millis(860);
const ACK_AIRTIME: Duration = Duration::from_millis(140);
const ACK_TIMEOUT: Duration = Duration::from_secs(4);
const FRAMES: u8 = 12;

fn main() {
    let mut channel = Channel::new(presets::shallow_harbour(), 8);
    channel.place(VEHICLE, NodePosition::new(0.0, 0.0, 30.0));
    channel.place(SHIP, NodePosition::new(1200.0, 300.0, 2.0));
    let range_m = channel.range_m(VEHICLE, SHIP).unwrap_or_default();
    println!("{FRAMES} frames over {range_m:.0} m of a shallow harbour\n");

    let mut now = Duration::ZERO;
    let mut transmissions = 0;
    for number in 0..FRAMES {
        loop {
            transmissions += 1;
            channel.transmit(VEHICLE, vec![number; 64], FRAME_AIRTIME, now);
            match wait_for_ack(&mut channel, number, &mut now) {
                Ok(()) => break,
                Err(reason) => println!("{:7.2} s  frame {number:2} repeated: {reason}", now.as_secs_f64()),
            }
        }
        println!("{:7.2} s  frame {number:2} acknowledged", now.as_secs_f64());
    }
    let rate = f64::from(FRAMES) * 64.0 * 8.0 / now.as_secs_f64();
    println!("\n{transmissions} transmissions for {FRAMES} frames, {rate:.0} bit/s of payload");
}

/// The host loop: jumps from event to event until the acknowledgement has come or its time is over.
fn wait_for_ack(channel: &mut Channel, number: u8, now: &mut Duration) -> Result<(), String> {
    let deadline = *now + ACK_TIMEOUT;
    let mut failure = "no reply".to_string();
    while let Some(at) = channel.poll_timeout().filter(|at| *at <= deadline) {
        *now = at;
        while let Some(arrival) = channel.poll_arrival(at) {
            match (&arrival.outcome, arrival.to) {
                // The ship acknowledges each frame, also a repeated one.
                (ReceptionOutcome::Delivered { bytes, .. }, SHIP) => {
                    channel.transmit(SHIP, bytes[..1].to_vec(), ACK_AIRTIME, at);
                }
                (ReceptionOutcome::Delivered { bytes, .. }, _) if bytes[..] == [number] => return Ok(()),
                (ReceptionOutcome::Delivered { .. }, _) => {}
                (ReceptionOutcome::Lost { reason, .. }, SHIP) => failure = format!("frame lost ({reason:?})"),
                (ReceptionOutcome::Lost { reason, .. }, _) => failure = format!("acknowledgement lost ({reason:?})"),
            }
        }
    }
    *now = deadline;
    Err(failure)
}

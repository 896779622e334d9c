//! Loss of 64-byte frames against range for three sea states: the formula of the sonar equation beside a simulated
//! channel.
//!
//! `cargo run -p sim-channel --example loss_over_range`

use sim_channel::acoustics::wind_of_sea_state;
use sim_channel::loss::Snr;
use sim_channel::{Channel, ChannelConfig, Duration, LossModel, NodeId, NodePosition, ReceptionOutcome};

const BYTES: usize = 64;
const AIRTIME: Duration = Duration::from_millis(860);
const FRAMES: u32 = 500;

fn main() {
    let sea_states = [1, 3, 6].map(|state| (state, Snr { wind_m_s: wind_of_sea_state(state), ..Snr::default() }));
    println!("Share of frames lost: formula / simulated with {FRAMES} frames\n");
    println!(
        " range   SNR at sea state 3    {}",
        sea_states.map(|(state, _)| format!("sea state {state}")).join("   ")
    );
    for range_m in [500.0, 1000.0, 2000.0, 3000.0, 4000.0, 6000.0, 8000.0] {
        let columns = sea_states.map(|(_, model)| {
            format!("{:4.2} / {:4.2}", model.loss_rate(range_m, BYTES, AIRTIME), simulated_loss(model, range_m))
        });
        println!("{range_m:4.0} m   {:8.1} dB          {}", sea_states[1].1.snr_db(range_m), columns.join("   "));
    }
}

fn simulated_loss(model: Snr, range_m: f64) -> f64 {
    let (sender, receiver) = (NodeId(1), NodeId(2));
    let config = ChannelConfig { loss: LossModel::from(model), ..ChannelConfig::default() };
    let mut channel = Channel::new(config, 17);
    channel.place(sender, NodePosition::new(0.0, 0.0, 10.0));
    channel.place(receiver, NodePosition::new(range_m, 0.0, 10.0));
    // The pause is long against the coherence of the fading, so that the draws are nearly independent.
    for frame in 0..FRAMES {
        channel.transmit(sender, vec![0; BYTES], AIRTIME, Duration::from_secs(30) * frame);
    }
    let arrivals = std::iter::from_fn(|| channel.poll_arrival(Duration::MAX));
    let lost = arrivals.filter(|arrival| matches!(arrival.outcome, ReceptionOutcome::Lost { .. })).count();
    lost as f64 / f64::from(FRAMES)
}

//! `scenecast replay`

use clap::Args;
use scenecast_console::{Console, Recording, Replay as Player, bind, start};
use scenecast_core::{UserError, errln, outln};
use scenecast_runtime::{Stop, block_on, keep_private};
use scenecast_surface::Reply;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between two states while the record is played.
const TICK: Duration = Duration::from_millis(200);
/// Time between two states while it stands still: the page expects a sign of life.
const PUBLISH_INTERVAL: Duration = Duration::from_secs(1);

/// Show a mission from its records on the operator's page, as the operator and the vehicle knew it, with a time line. With the
/// records of both ends, the page shows what each knew, and the difference.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: scenecast replay records/surface-20261129T101500Z records/auv_1-20261129T101500Z, then open \
                        http://127.0.0.1:8460"
)]
pub(super) struct Replay {
    /// Records of the surface, of vehicles, or of both: folders or files
    #[arg(value_name = "RECORD", required = true)]
    records: Vec<PathBuf>,
    /// Port of the page on 127.0.0.1
    #[arg(long, default_value_t = 8460, allow_negative_numbers = true)]
    port: u16,
    /// Recorded seconds for each second, 0.1 to 1000
    #[arg(long, default_value_t = 10.0, allow_negative_numbers = true)]
    speed: f64,
}

impl Replay {
    pub(super) fn run(self) -> Result<(), UserError> {
        if !Player::SPEEDS.contains(&self.speed) {
            return Err(UserError::Input(format!("--speed {} is not allowed; allowed: 0.1 to 1000", self.speed)));
        }
        keep_private();
        let player = Player::new(Recording::read(&self.records)?, self.speed);
        for damage in player.damage() {
            errln!("scenecast: a part of the record could not be read: {damage}");
        }
        block_on(async move {
            let stop = Stop::new()?;
            let listener = bind(&format!("127.0.0.1:{}", self.port), "--port", Vec::new(), "").await?.for_viewers();
            outln!("the page of the record is at http://127.0.0.1:{} (end with Ctrl-C)", self.port);
            play(player, start(listener), stop).await
        })
    }
}

/// Serves the page until the program is interrupted.
async fn play(mut player: Player, mut console: Console, mut stop: Stop) -> Result<(), UserError> {
    let mut tick = tokio::time::interval(TICK);
    tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let (mut before, mut published) = (Instant::now(), None::<Instant>);
    loop {
        tokio::select! {
            () = stop.asked() => return Ok(()),
            Some((request, reply)) = console.requests.recv() => {
                let answer = player.handle_request(request);
                if matches!(answer, Reply::Replay(_)) {
                    // Who reads the state after the reply finds the moment in it.
                    console.snapshots.send_replace(Arc::new(player.snapshot()));
                }
                // A browser that closed its connection needs no reply.
                let _ = reply.send(answer);
            }
            _ = tick.tick() => {
                let passed = before.elapsed();
                before = Instant::now();
                if player.advance(passed) || published.is_none_or(|at| at.elapsed() >= PUBLISH_INTERVAL) {
                    published = Some(before);
                    console.snapshots.send_replace(Arc::new(player.snapshot()));
                }
            }
        }
    }
}

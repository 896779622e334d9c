//! Dry runs beside the loop of the link.

use scenecast_config::Config;
use scenecast_host::DryRunTask;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_surface::{Reply, Surface, SurfaceRequest};
use std::sync::{Arc, Mutex};
use tokio::sync::oneshot;

/// Most dry runs at a time: one is planned, and the others wait.
const MAX_WAITING: usize = 4;

/// Plans dry runs on another thread, one at a time.
pub struct DryRuns {
    config: Arc<Config>,
    /// Each dry run has a reference, and the one that is planned holds the lock.
    one: Arc<Mutex<()>>,
}

impl DryRuns {
    /// Dry runs of vehicles with this survey and camera.
    pub fn new(config: Config) -> Self {
        Self { config: Arc::new(config), one: Arc::default() }
    }

    /// Answers a request for a dry run as soon as it is planned. `cell_m` is the edge of a cell of a vehicle that has not told its own.
    pub fn answer(
        &self,
        surface: &Surface,
        request: &SurfaceRequest,
        cell_m: f64,
        now: Instant,
        reply: oneshot::Sender<Reply>,
    ) {
        let answer = match self.task(surface, request, cell_m, now) {
            Ok(task) => {
                let one = self.one.clone();
                tokio::task::spawn_blocking(move || {
                    let _one = one.lock();
                    // Nobody waits for it any more, so it is not worth the time.
                    if !reply.is_closed() {
                        let _ = reply.send(Reply::DryRun(Box::new(task.run())));
                    }
                });
                return;
            }
            Err(answer) => *answer,
        };
        // A browser that closed its connection needs no reply.
        let _ = reply.send(answer);
    }

    fn task(
        &self,
        surface: &Surface,
        request: &SurfaceRequest,
        cell_m: f64,
        now: Instant,
    ) -> Result<DryRunTask, Box<Reply>> {
        let SurfaceRequest::DryRun(id, weights, terms, fence) = request else { return Err(Box::new(Reply::NotFound)) };
        let vehicle = Address::vehicle(*id).filter(|&vehicle| surface.record(vehicle).is_some());
        let vehicle = vehicle.ok_or(Box::new(Reply::NotFound))?;
        if Arc::strong_count(&self.one) > MAX_WAITING {
            return Err(Box::new(Reply::Refused("too many dry runs at once: try again soon".to_owned())));
        }
        DryRunTask::new(surface, self.config.clone(), vehicle, (weights, *terms, fence.as_ref()), cell_m, now)
            .map_err(|refusal| Box::new(Reply::Refused(refusal.to_string())))
    }
}

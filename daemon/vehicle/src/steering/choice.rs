//! The planner: as configured, as ordered, and in use.

use crate::planning::{Planner, planner};
use scenecast_protocol::directive::PlannerKind;

#[derive(Debug)]
pub(super) struct PlannerChoice {
    configured: PlannerKind,
    chosen: Option<PlannerKind>,
    planner: Box<dyn Planner>,
    running: PlannerKind,
}

impl PlannerChoice {
    pub(super) fn new(configured: PlannerKind) -> Self {
        let running = PlannerKind::Lawnmower;
        Self { configured, chosen: None, planner: planner(running), running }
    }

    pub(super) fn choose(&mut self, chosen: Option<PlannerKind>) {
        self.chosen = chosen;
    }

    /// Selects the lawnmower until there is a utility, then the ordered or the configured planner. Returns
    /// whether the planner has changed.
    pub(super) fn follow(&mut self, has_utility: bool) -> bool {
        let wanted = if has_utility { self.chosen.unwrap_or(self.configured) } else { PlannerKind::Lawnmower };
        let changes = wanted != self.running;
        if changes {
            (self.planner, self.running) = (planner(wanted), wanted);
        }
        changes
    }

    /// Whether the plan depends on the map.
    pub(super) fn adapts(&self) -> bool {
        self.running != PlannerKind::Lawnmower
    }

    pub(super) fn planner(&self) -> &dyn Planner {
        &*self.planner
    }

    pub(super) fn planner_mut(&mut self) -> &mut dyn Planner {
        &mut *self.planner
    }
}

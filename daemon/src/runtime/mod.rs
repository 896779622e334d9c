//! The tokio shells around the roles.
use crate::{config::Config, problem::Problem, rehearsal::Mission};
/// Todo
pub fn run_vehicle(_c: Config) -> Result<(), Problem> {
    Err(Problem::Failed("x".into()))
}
/// Todo
pub fn run_surface(_c: Config) -> Result<(), Problem> {
    Err(Problem::Failed("x".into()))
}
/// Todo
pub fn run_demo(_m: Mission, _s: f64, _p: Option<u16>) -> Result<(), Problem> {
    Err(Problem::Failed("x".into()))
}

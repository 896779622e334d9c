//! Outlines and places in metres east and north of the mission's origin, as people and files give them. Every error is one line that
//! names the allowed values; `what` names the part in it.

use crate::MAX_DISTANCE_M;
use scenecast_protocol::coordinates::{DecimetrePoint, WorldPoint};
use scenecast_protocol::directive::{Fence, Polygon};

/// The fence with these parts.
pub fn fence_of(
    fence: Option<&[[f64; 2]]>,
    keep_outs: &[Vec<[f64; 2]>],
    return_point: Option<[f64; 2]>,
) -> Result<Fence, String> {
    let fence = Fence {
        fence: fence.map(|corners| outline_of("fence", corners)).transpose()?,
        keep_outs: keep_outs.iter().map(|corners| outline_of("keep_outs", corners)).collect::<Result<_, _>>()?,
        return_point: return_point.map(|at| place_of("return_point", at)).transpose()?,
    };
    fence.check().map_err(|fault| fault.to_string())?;
    Ok(fence)
}

/// The outline with these corners, which is not checked yet.
pub fn outline_of(what: &str, corners: &[[f64; 2]]) -> Result<Polygon, String> {
    corners.iter().map(|&corner| place_of(what, corner)).collect::<Result<_, _>>().map(Polygon)
}

/// The place, if it is near the origin.
pub fn place_of(what: &str, [x, y]: [f64; 2]) -> Result<DecimetrePoint, String> {
    let far = || format!("{what}: [{x}, {y}] is no place within 100 km of the mission's origin");
    let near = Some(WorldPoint::new(x, y)).filter(|_| x.hypot(y) <= MAX_DISTANCE_M);
    near.and_then(DecimetrePoint::nearest).ok_or_else(far)
}

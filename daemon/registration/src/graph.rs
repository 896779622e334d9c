//! All frames of a mission placed together, once the mission has ended, by least squares over many unknowns.

use crate::evidence::{Evidence, Step};
use crate::pair::{Link, Match};
use crate::registrar::{CHAIN_ALIKE, LOOPS_ALIKE, Placed};
use crate::similarity::FramePose;
use nalgebra::{Matrix2, Rotation2, Vector2};
use scenecast_core::wrap_rad;
use scenecast_protocol::coordinates::MapPoint;

/// Standard deviations of a frame's heading by the compass, radians, of its log scale by the altitude, and of its place as
/// it was when it was placed, metres. They hold the map as a whole, and frames without a match.
const COMPASS_SIGMA: f64 = 0.03;
const ALTITUDE_SIGMA: f64 = 0.02;
const PLACED_SIGMA_M: f64 = 3.0;
/// Standard deviations of a turn and of a change of scale that no image shows.
const UNSEEN_TURN: f64 = 0.05;
const UNSEEN_SCALE: f64 = 0.03;
/// Least standard deviations of turn and log scale by a match, and of its shift in metres.
const MATCH_SPREAD: f64 = 3e-4;
const MATCH_SIGMA_M: f64 = 0.003;
/// Times that the equations are solved, each with the weights by the errors of the solution before.
const ROUNDS: usize = 6;
/// A measurement that is off by so many standard deviations has half of its weight.
const DOUBTED: f64 = 2.0;

/// The frames of a mission, and all that was measured between them.
///
/// [`Registrar`](crate::Registrar) places each frame once, by what is known by then. For the record, the graph places them
/// all by what is known in the end: headings and scales first, and then places, each as linear least squares with robust
/// weights.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameGraph {
    frames: Vec<Frame>,
}

#[derive(Debug, Clone, PartialEq)]
struct Frame {
    placed: FramePose,
    evidence: Evidence,
}

/// The difference of two frames by a match: `newer` less `older`.
struct Difference {
    newer: usize,
    older: usize,
    value: f64,
    sigma: f64,
}

impl FrameGraph {
    /// Adds the next frame. All frames of the registration have to be added, from its first one on.
    pub fn add(&mut self, placed: &Placed) {
        self.frames.push(Frame { placed: placed.pose, evidence: placed.evidence.clone() });
    }

    /// The pairs of frames that closed a loop: the indices of the newer and of the older one.
    pub fn loops(&self) -> impl Iterator<Item = (usize, usize)> {
        self.matches().filter(|(.., is_chain)| !is_chain).map(|(newer, older, ..)| (newer, older))
    }

    /// The same graph, in which the last loop is off by `metres`.
    #[cfg(test)]
    pub(crate) fn with_wrong_loop(&self, metres: f64) -> Self {
        let mut wrong = self.clone();
        let last = wrong.frames.iter_mut().rev().find_map(|frame| frame.evidence.loops.last_mut()).unwrap();
        let by = crate::similarity::Similarity::new(0.0, 1.0, Vector2::new(metres, metres));
        last.found.similarity = by.after(&last.found.similarity);
        wrong
    }

    /// The poses of all frames.
    pub fn solve(&self) -> Vec<FramePose> {
        let headings = self.headings();
        let log_scales = self.log_scales();
        let places = self.places(&headings, &log_scales);
        let pose = |((at, heading), log_scale): ((Vector2<f64>, f64), f64)| {
            FramePose::new(MapPoint::new(at.x, at.y), wrap_rad(heading), log_scale)
        };
        places.into_iter().zip(headings).zip(log_scales).map(pose).collect()
    }

    /// The matches of all frames: the indices of the newer and of the older frame, and whether they are neighbours.
    fn matches(&self) -> impl Iterator<Item = (usize, usize, &Match, bool)> {
        self.frames.iter().enumerate().flat_map(|(i, frame)| {
            let chain = frame.evidence.chain.iter().filter(move |_| i > 0).map(move |found| (i, i - 1, found, true));
            let loops = frame.evidence.loops.iter().filter_map(move |found| {
                let older = (found.older as usize).checked_sub(1).filter(|older| *older < i)?;
                Some((i, older, &found.found, false))
            });
            chain.chain(loops)
        })
    }

    /// Headings without jumps of a turn.
    fn headings(&self) -> Vec<f64> {
        let mut start: Vec<f64> = Vec::with_capacity(self.frames.len());
        for frame in &self.frames {
            let before = start.last().copied().unwrap_or(frame.placed.heading_rad);
            start.push(before + wrap_rad(frame.placed.heading_rad - before));
        }
        let difference = |(newer, older, found, is_chain): (usize, usize, &Match, bool)| {
            let alike = if is_chain { CHAIN_ALIKE } else { LOOPS_ALIKE };
            let now = start[newer] - start[older];
            let value = now + wrap_rad(-found.similarity.turn_rad() - now);
            Difference { newer, older, value, sigma: (alike * found.turn_sigma).hypot(MATCH_SPREAD) }
        };
        let differences = self.with_unseen(self.matches().map(difference), &start, UNSEEN_TURN);
        solve_differences(&start, &differences, &start, COMPASS_SIGMA)
    }

    fn log_scales(&self) -> Vec<f64> {
        let start: Vec<f64> = self.frames.iter().map(|frame| frame.placed.log_scale).collect();
        let difference = |(newer, older, found, _): (usize, usize, &Match, bool)| Difference {
            newer,
            older,
            value: found.similarity.scale().ln(),
            sigma: found.log_scale_sigma.hypot(MATCH_SPREAD),
        };
        let differences = self.with_unseen(self.matches().map(difference), &start, UNSEEN_SCALE);
        solve_differences(&start, &differences, &vec![0.0; start.len()], ALTITUDE_SIGMA)
    }

    /// Neighbours without a match keep the difference that they were placed with.
    fn with_unseen(&self, matched: impl Iterator<Item = Difference>, placed: &[f64], sigma: f64) -> Vec<Difference> {
        let unseen = (1..self.frames.len()).filter(|&i| self.frames[i].evidence.chain.is_none());
        let kept = unseen.map(|i| Difference { newer: i, older: i - 1, value: placed[i] - placed[i - 1], sigma });
        matched.chain(kept).collect()
    }

    /// The places of frames with these headings and scales.
    fn places(&self, headings: &[f64], log_scales: &[f64]) -> Vec<Vector2<f64>> {
        let turned: Vec<FramePose> = (headings.iter().zip(log_scales))
            .map(|(heading, log_scale)| FramePose::new(MapPoint::new(0.0, 0.0), *heading, *log_scale))
            .collect();
        let placed: Vec<Vector2<f64>> = self.frames.iter().map(|frame| frame.placed.place()).collect();
        let mut shifts: Vec<Shift> = Vec::new();
        for (i, frame) in self.frames.iter().enumerate() {
            shifts.extend(frame.evidence.step.iter().filter(|_| i > 0).map(|step| Shift::of_step(step, i, headings)));
        }
        let of_loop = |(newer, older, found, _): (usize, usize, &Match, bool)| {
            let link = Link { found: *found, pose: turned[older] };
            let evidence = &self.frames[newer].evidence;
            let heights_m2 = link.parallax_m2(evidence.relief) * evidence.loops.len() as f64;
            let by = link.place(headings[newer], log_scales[newer]);
            Shift { newer, older, by, covariance_m2: link.covariance_m2() + heights_m2 }
        };
        shifts.extend(self.matches().filter(|(.., is_chain)| !is_chain).map(of_loop));
        let mut now = placed.clone();
        for _ in 0..ROUNDS {
            now = solve_shifts(&placed, &shifts, &now);
        }
        now
    }
}

/// The place of a frame less that of an earlier one, metres on the map.
struct Shift {
    newer: usize,
    older: usize,
    by: Vector2<f64>,
    covariance_m2: Matrix2<f64>,
}

impl Shift {
    /// The step to frame `newer`. The track is as turned as the frame at its start.
    fn of_step(step: &Step, newer: usize, headings: &[f64]) -> Self {
        let turned = Rotation2::new(-wrap_rad(headings[newer - 1] - step.from_heading_rad));
        Self { newer, older: newer - 1, by: turned * step.by, covariance_m2: step.covariance_m2 }
    }
}

/// The weight of a measurement that is off by so many standard deviations (Cauchy).
fn trust(deviations2: f64) -> f64 {
    1.0 / (1.0 + deviations2 / (DOUBTED * DOUBTED))
}

fn solve_differences(start: &[f64], differences: &[Difference], anchors: &[f64], anchor_sigma: f64) -> Vec<f64> {
    let mut now = start.to_vec();
    for _ in 0..ROUNDS {
        let mut equations = NormalEquations::new(now.len());
        anchors.iter().enumerate().for_each(|(i, at)| equations.measure(i, *at, anchor_sigma.powi(-2)));
        for Difference { newer, older, value, sigma } in differences {
            let off = (now[*newer] - now[*older] - value) / sigma;
            equations.measure_difference(*newer, *older, *value, trust(off * off) / (sigma * sigma));
        }
        now = equations.solve(&now);
    }
    now
}

fn solve_shifts(placed: &[Vector2<f64>], shifts: &[Shift], now: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    let mut equations = NormalEquations::new(2 * placed.len());
    for (i, at) in placed.iter().enumerate() {
        equations.measure(2 * i, at.x, PLACED_SIGMA_M.powi(-2));
        equations.measure(2 * i + 1, at.y, PLACED_SIGMA_M.powi(-2));
    }
    for Shift { newer, older, by, covariance_m2 } in shifts {
        let covariance = covariance_m2 + Matrix2::identity() * MATCH_SIGMA_M.powi(2);
        let Some(inverse) = covariance.try_inverse() else { continue };
        let off = now[*newer] - now[*older] - by;
        let weight = inverse * trust(off.dot(&(inverse * off)).max(0.0));
        let (axes, right) = ([0, 1], weight * by);
        for a in axes {
            equations.measure_difference(2 * newer + a, 2 * older + a, 0.0, weight[(a, a)]);
            equations.add_right(2 * newer + a, right[a]);
            equations.add_right(2 * older + a, -right[a]);
        }
        let mixed = weight[(0, 1)];
        equations.add(2 * newer, 2 * newer + 1, mixed);
        equations.add(2 * older, 2 * older + 1, mixed);
        equations.add(2 * newer, 2 * older + 1, -mixed);
        equations.add(2 * newer + 1, 2 * older, -mixed);
    }
    let start: Vec<f64> = now.iter().flat_map(|at| [at.x, at.y]).collect();
    equations.solve(&start).chunks_exact(2).map(|at| Vector2::new(at[0], at[1])).collect()
}

/// The normal equations of a problem: a symmetric, positive definite matrix by its diagonal and its entries above it, and
/// the right side.
pub(crate) struct NormalEquations {
    diagonal: Vec<f64>,
    above: Vec<(u32, u32, f64)>,
    right: Vec<f64>,
}

impl NormalEquations {
    pub(crate) fn new(unknowns: usize) -> Self {
        Self { diagonal: vec![0.0; unknowns], above: Vec::new(), right: vec![0.0; unknowns] }
    }

    /// Adds to the entry of two unknowns, on both sides of the diagonal.
    pub(crate) fn add(&mut self, i: usize, j: usize, value: f64) {
        if i == j {
            self.diagonal[i] += value;
        } else {
            self.above.push((i as u32, j as u32, value));
        }
    }

    pub(crate) fn add_right(&mut self, i: usize, value: f64) {
        self.right[i] += value;
    }

    /// A measurement of an unknown with a weight.
    pub(crate) fn measure(&mut self, i: usize, value: f64, weight: f64) {
        self.add(i, i, weight);
        self.add_right(i, weight * value);
    }

    /// A measurement of the difference of two unknowns, `i` less `j`, with a weight.
    pub(crate) fn measure_difference(&mut self, i: usize, j: usize, value: f64, weight: f64) {
        self.measure(i, value, weight);
        self.measure(j, -value, weight);
        self.add(i, j, -weight);
    }

    fn product(&self, x: &[f64]) -> Vec<f64> {
        let mut y: Vec<f64> = self.diagonal.iter().zip(x).map(|(d, x)| d * x).collect();
        for &(i, j, value) in &self.above {
            let (i, j) = (i as usize, j as usize);
            y[i] += value * x[j];
            y[j] += value * x[i];
        }
        y
    }

    /// Solves by conjugate gradients from `start` on, preconditioned by the diagonal (Shewchuk, "An Introduction to the
    /// Conjugate Gradient Method Without the Agonizing Pain", 1994, B3).
    pub(crate) fn solve(&self, start: &[f64]) -> Vec<f64> {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let preconditioned =
            |r: &[f64]| r.iter().zip(&self.diagonal).map(|(r, d)| r / d.max(1e-300)).collect::<Vec<f64>>();
        let mut x = start.to_vec();
        let mut residual: Vec<f64> = self.right.iter().zip(self.product(&x)).map(|(b, ax)| b - ax).collect();
        let mut direction = preconditioned(&residual);
        let mut left = dot(&residual, &direction);
        let enough = 1e-18 * dot(&self.right, &preconditioned(&self.right)).max(1e-300);
        for _ in 0..MAX_STEPS.min(20 * x.len() + 20) {
            if left <= enough {
                break;
            }
            let product = self.product(&direction);
            let step = left / dot(&direction, &product).max(1e-300);
            x.iter_mut().zip(&direction).for_each(|(x, d)| *x += step * d);
            residual.iter_mut().zip(&product).for_each(|(r, p)| *r -= step * p);
            let next = preconditioned(&residual);
            let now = dot(&residual, &next);
            direction.iter_mut().zip(&next).for_each(|(d, n)| *d = n + now / left * *d);
            left = now;
        }
        x
    }
}

/// Limit of the steps of one solution.
const MAX_STEPS: usize = 20_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_with_a_loop_shares_its_error() {
        // Nine steps of 1, and a loop that says that the tenth unknown is the first one plus 8.1.
        let mut equations = NormalEquations::new(10);
        equations.measure(0, 5.0, 1.0);
        (1..10).for_each(|i| equations.measure_difference(i, i - 1, 1.0, 1.0));
        equations.measure_difference(9, 0, 8.1, 1.0);
        let x = equations.solve(&[0.0; 10]);
        assert!((x[0] - 5.0).abs() < 1e-6, "{x:?}");
        (1..10).for_each(|i| assert!((x[i] - x[i - 1] - 0.91).abs() < 1e-6, "{x:?}"));
    }
}

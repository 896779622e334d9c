//! Reads Markov fits of measured links from CSV. One step of a fitted chain is one packet.

#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used))]

use super::{GilbertElliott, ThreeState};
use crate::nodes::NodeId;
use std::time::Duration;
use thiserror::Error;

/// One directed link of a measurement campaign, with a Markov chain fitted to its losses.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FittedLink<Model> {
    /// Number of the deployment in the campaign.
    pub topology: u8,
    /// The sender of the measured packets.
    pub from: NodeId,
    /// The receiver of the measured packets.
    pub to: NodeId,
    /// The fitted chain, its dwells in seconds.
    pub model: Model,
}

/// An error in a table of fitted links; lines count from 1.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum FitError {
    /// A line does not have the columns of this layout.
    #[error("line {line}: {found} columns, expected {expected}")]
    Columns {
        /// Number of the line in the table.
        line: usize,
        /// Number of columns of the line.
        found: usize,
        /// Number of columns of the layout.
        expected: usize,
    },
    /// A node or topology is not a number 0..=255.
    #[error("line {line}: not a node number: {text}")]
    Node {
        /// Number of the line in the table.
        line: usize,
        /// Text of the wrong field.
        text: String,
    },
    /// A probability is not a number in 0..=1, or the probabilities to leave a state sum to more than 1.
    #[error("line {line}: not a probability: {text}")]
    Probability {
        /// Number of the line in the table.
        line: usize,
        /// Text of the wrong field.
        text: String,
    },
    /// The table contains no link.
    #[error("no link found")]
    Empty,
}

impl GilbertElliott {
    /// Reads lines `topology,from,to,p_succ_good,p_succ_bad,p_gb,p_bg`; a step of the chain lasts `step`.
    ///
    /// A header line is allowed.
    ///
    /// # Errors
    ///
    /// The first wrong line, or [`FitError::Empty`].
    pub fn from_csv(text: &str, step: Duration) -> Result<Vec<FittedLink<Self>>, FitError> {
        rows::<4>(text)?
            .into_iter()
            .map(|(line, ends, [good, bad, to_bad, to_good])| {
                let model = Self {
                    dwell_good: dwell(step, to_bad, line)?,
                    dwell_bad: dwell(step, to_good, line)?,
                    loss_good: 1.0 - good,
                    loss_bad: 1.0 - bad,
                };
                Ok(ends.with(model))
            })
            .collect()
    }
}

impl ThreeState {
    /// Reads lines `topology,from,to,p_succ_good,p_succ_medium,p_succ_bad,p_gb,p_gm,p_mg,p_mb,p_bg,p_bm`; a step of the
    /// chain lasts `step`.
    ///
    /// A header line is allowed.
    ///
    /// # Errors
    ///
    /// The first wrong line, or [`FitError::Empty`].
    pub fn from_csv(text: &str, step: Duration) -> Result<Vec<FittedLink<Self>>, FitError> {
        rows::<9>(text)?
            .into_iter()
            .map(|(line, ends, [good, medium, bad, gb, gm, mg, mb, bg, bm])| {
                let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
                let model = Self {
                    dwell: [dwell(step, gb + gm, line)?, dwell(step, mg + mb, line)?, dwell(step, bg + bm, line)?],
                    loss: [1.0 - good, 1.0 - medium, 1.0 - bad],
                    good_to_medium: share(gm, gb + gm),
                    medium_to_good: share(mg, mg + mb),
                    bad_to_good: share(bg, bg + bm),
                };
                Ok(ends.with(model))
            })
            .collect()
    }
}

/// Topology, sender and receiver of a row.
struct LinkEnds([u8; 3]);

impl LinkEnds {
    fn with<Model>(self, model: Model) -> FittedLink<Model> {
        let Self([topology, from, to]) = self;
        FittedLink { topology, from: NodeId(from), to: NodeId(to), model }
    }
}

/// Mean time until a step of probability `leave`; `Duration::MAX` if the probability is 0.
fn dwell(step: Duration, leave: f64, line: usize) -> Result<Duration, FitError> {
    if leave > 1.0 + 1e-9 {
        return Err(FitError::Probability { line, text: leave.to_string() });
    }
    Ok(Duration::try_from_secs_f64(step.as_secs_f64() / leave).unwrap_or(Duration::MAX))
}

/// Line number, ends and `N` probabilities of each line that is neither empty nor the header.
fn rows<const N: usize>(text: &str) -> Result<Vec<(usize, LinkEnds, [f64; N])>, FitError> {
    let lines = (1..).zip(text.lines().map(str::trim));
    let rows: Result<Vec<_>, _> = lines
        .filter(|(_, line)| !line.is_empty() && !line.starts_with("topology"))
        .map(|(n, line)| row(n, line))
        .collect();
    rows.and_then(|rows| if rows.is_empty() { Err(FitError::Empty) } else { Ok(rows) })
}

fn row<const N: usize>(line: usize, text: &str) -> Result<(usize, LinkEnds, [f64; N]), FitError> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    if fields.len() != 3 + N {
        return Err(FitError::Columns { line, found: fields.len(), expected: 3 + N });
    }
    let (ends, numbers) = fields.split_at(3);
    let mut row = (line, LinkEnds([0; 3]), [0.0; N]);
    for (slot, text) in row.1.0.iter_mut().zip(ends) {
        *slot = text.parse().map_err(|_| FitError::Node { line, text: text.to_string() })?;
    }
    for (slot, text) in row.2.iter_mut().zip(numbers) {
        let wrong = || FitError::Probability { line, text: text.to_string() };
        *slot = text.parse().ok().filter(|p| (0.0..=1.0).contains(p)).ok_or_else(wrong)?;
    }
    Ok(row)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: Duration = Duration::from_secs(4);

    #[test]
    fn two_states_scale_their_dwell_by_the_step() {
        let text =
            "topology,from,to,p_succ_good,p_succ_bad,p_gb,p_bg\n1,1,2,0.96,0.6,0.2,0.1\n\n1,2,1,0.98,0.5,0.25,0.1\n";
        let links = GilbertElliott::from_csv(text, STEP).expect("good table");
        assert_eq!(links.len(), 2);
        let link = &links[0];
        assert_eq!((link.topology, link.from, link.to), (1, NodeId(1), NodeId(2)));
        assert_eq!((link.model.dwell_good, link.model.dwell_bad), (Duration::from_secs(20), Duration::from_secs(40)));
        let discrete = (0.1 * (1.0 - 0.96) + 0.2 * (1.0 - 0.6)) / 0.3;
        assert!((link.model.loss_rate() - discrete).abs() < 1e-9);
    }

    #[test]
    fn three_states_keep_the_stationary_loss_of_the_chain() {
        let text = "1,1,2,0.97,0.8,0.5,0.1,0.1,0.2,0.2,0.15,0.05\n";
        let model = ThreeState::from_csv(text, STEP).expect("good table")[0].model;
        let step = [[0.8, 0.1, 0.1], [0.2, 0.6, 0.2], [0.15, 0.05, 0.8]];
        let mut shares = [1.0 / 3.0; 3];
        for _ in 0..1000 {
            shares = std::array::from_fn(|to| (0..3).map(|from| shares[from] * step[from][to]).sum());
        }
        let discrete: f64 = shares.iter().zip([0.03, 0.2, 0.5]).map(|(s, l)| s * l).sum();
        assert!((model.loss_rate() - discrete).abs() < 1e-9, "{} {discrete}", model.loss_rate());
    }

    #[test]
    fn a_wrong_table_names_the_line() {
        assert_eq!(GilbertElliott::from_csv("", STEP), Err(FitError::Empty));
        let short = GilbertElliott::from_csv("1,1,2,0.9", STEP);
        assert_eq!(short, Err(FitError::Columns { line: 1, found: 4, expected: 7 }));
        let large = GilbertElliott::from_csv("\n1,1,2,0.9,0.9,1.5,0.1", STEP);
        assert_eq!(large, Err(FitError::Probability { line: 2, text: "1.5".into() }));
        let node = GilbertElliott::from_csv("1,x,2,0.9,0.9,0.5,0.1", STEP);
        assert_eq!(node, Err(FitError::Node { line: 1, text: "x".into() }));
    }
}

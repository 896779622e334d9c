//! Loss as trials have measured it: delivery against range, and Markov chains fitted to links. One step of a fitted chain is one
//! packet.

#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used))]
use super::{FrameContext, FrameFate, GilbertElliott, LinkLoss, ThreeState};
use crate::nodes::NodeId;
use crate::random::RandomStream;
use std::sync::Arc;
use std::time::Duration;
use thiserror::Error;

/// Delivery ratios at measured ranges, with linear interpolation between them; the first and the last value hold outside.
///
/// ```
/// use sim_channel::loss::RangeTable;
///
/// let table = RangeTable::from_csv("# range_m delivery\n1000 0.9\n2000 0.5").unwrap();
/// assert!((table.delivery(1500.0) - 0.7).abs() < 1e-9);
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct RangeTable {
    points: Arc<[(f64, f64)]>,
}

/// An error in a table of delivery ratios.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum RangeTableError {
    /// A line is not a range in metres and a ratio 0..=1; lines count from 1.
    #[error("line {line}: expected range_m and delivery ratio 0..=1")]
    Line {
        /// Number of the line in the table.
        line: usize,
    },
    /// The table contains no point.
    #[error("no point found")]
    Empty,
}

impl RangeTable {
    /// Reads lines of range in metres and delivery ratio, separated by tab, blank, comma or semicolon.
    ///
    /// Lines that begin with `#` are skipped; the ranges may come in any order.
    ///
    /// # Errors
    ///
    /// The first wrong line, or [`RangeTableError::Empty`].
    pub fn from_csv(text: &str) -> Result<Self, RangeTableError> {
        let lines = (1..).zip(text.lines().map(str::trim));
        let points: Result<Vec<_>, _> = lines
            .filter(|(_, content)| !content.is_empty() && !content.starts_with('#'))
            .map(|(line, content)| point(content).ok_or(RangeTableError::Line { line }))
            .collect();
        let mut points = points?;
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        if points.is_empty() { Err(RangeTableError::Empty) } else { Ok(Self { points: points.into() }) }
    }

    /// Share of frames that are delivered at `range_m`, 0..=1.
    #[must_use]
    pub fn delivery(&self, range_m: f64) -> f64 {
        let after = self.points.partition_point(|(range, _)| *range <= range_m);
        let below = after.checked_sub(1).and_then(|index| self.points.get(index));
        match (below, self.points.get(after)) {
            (Some((r0, d0)), Some((r1, d1))) => d0 + (d1 - d0) * (range_m - r0) / (r1 - r0),
            (Some((_, only)), None) | (None, Some((_, only))) => *only,
            (None, None) => 0.0,
        }
    }

    pub(super) fn instance(&self) -> Box<dyn LinkLoss> {
        Box::new(self.clone())
    }
}

impl LinkLoss for RangeTable {
    fn draw_fate(&mut self, frame: &FrameContext, rng: &mut RandomStream) -> FrameFate {
        FrameFate::lost_if(rng.bernoulli(1.0 - self.delivery(frame.range_m)))
    }
}

fn point(line: &str) -> Option<(f64, f64)> {
    let mut fields = line.split(['\t', ' ', ',', ';']).filter(|field| !field.is_empty());
    let range: f64 = fields.next()?.parse().ok()?;
    let delivery: f64 = fields.next()?.parse().ok()?;
    (range.is_finite() && range >= 0.0 && (0.0..=1.0).contains(&delivery)).then_some((range, delivery))
}

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
    use crate::loss::tests::{losses, share};
    use std::time::Duration;

    const TABLE: &str = "# range_m delivery\n500\t0.9\n1500,0.5\n2000 0\n";

    #[test]
    fn delivery_lies_on_straight_lines() {
        let table = RangeTable::from_csv(TABLE).expect("table");
        for (range_m, delivery) in
            [(0.0, 0.9), (500.0, 0.9), (1000.0, 0.7), (1500.0, 0.5), (1750.0, 0.25), (9000.0, 0.0)]
        {
            assert!((table.delivery(range_m) - delivery).abs() < 1e-12);
        }
    }

    #[test]
    fn loss_at_a_kilometre_matches_the_table() {
        let model = RangeTable::from_csv(TABLE).expect("table").into();
        assert!((share(&losses(&model, Duration::from_secs(1), 50_000)) - 0.3).abs() < 0.01);
    }

    #[test]
    fn a_wrong_line_is_named() {
        assert_eq!(RangeTable::from_csv("1 0.5\n2 1.5"), Err(RangeTableError::Line { line: 2 }));
        assert_eq!(RangeTable::from_csv("x"), Err(RangeTableError::Line { line: 1 }));
        assert_eq!(RangeTable::from_csv("\n"), Err(RangeTableError::Empty));
    }

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

//! Steering: a label is weighed, and the camera's time over its kind of floor is compared with the run without the order.

mod command;
mod favourite;
mod flight;
mod reference;
mod turn;

pub(crate) use command::SteeringBench;

use favourite::Favourite;
use flight::{Flight, Watched};
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_protocol::wire::Intent;
use scenecast_worlds::scoring::median;
use serde::Serialize;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, mpsc};

/// Mission time of the order, seconds.
const ORDER_S: u32 = 120;
/// Mission time of each run, seconds: ten minutes after the order.
const END_S: u32 = 720;
/// The weight of the label, and that of exploration.
const WEIGHT: f64 = 0.8;
const EXPLORATION: f64 = 0.1;
/// The least median of the gains.
pub const GAIN_LIMIT: f64 = 2.0;

/// Both runs of one seed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SteeringPair {
    pub seed: u64,
    /// The weighed label, and its share of the vehicle's map when the order was given.
    pub label: u8,
    pub share: f64,
    /// The true area of the label inside and outside of the cells that were seen by then, square metres: where the
    /// vehicle's model finds the label once it has been shown the whole sea floor.
    pub seen_m2: f64,
    pub unseen_m2: f64,
    /// Time that the camera spent over that area in the ten minutes after the order, with and without it, seconds.
    pub with_s: f64,
    pub without_s: f64,
    /// `with_s` divided by `without_s`, which counts as at least a second.
    pub gain: f64,
    /// The true class of most of that area, and the same gain over the floor of this class.
    pub class: String,
    pub class_gain: f64,
    /// Seconds from the vehicle's receipt of the order until it headed for its nearest cell of the label that it had not
    /// looked at since; `None` if it took more than 20 s.
    pub turned_s: Option<u32>,
    /// The purpose of the vehicle's plan at the end of that time.
    pub purpose: String,
    /// The longest time that the vehicle stayed within 2 m without a report that it holds, in both runs, seconds.
    pub longest_stay_s: u32,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SteeringFigures {
    pub pairs: Vec<SteeringPair>,
    pub median_gain: f64,
    pub median_class_gain: f64,
    pub longest_stay_s: u32,
}

impl SteeringFigures {
    fn new(mut pairs: Vec<SteeringPair>) -> Self {
        pairs.sort_by_key(|pair| pair.seed);
        let median_of = |gain: fn(&SteeringPair) -> f64| median(&pairs.iter().map(gain).collect::<Vec<f64>>());
        let (median_gain, median_class_gain) = (median_of(|pair| pair.gain), median_of(|pair| pair.class_gain));
        let longest_stay_s = pairs.iter().map(|pair| pair.longest_stay_s).max().unwrap_or_default();
        Self { pairs, median_gain, median_class_gain, longest_stay_s }
    }

    /// Pairs whose vehicle headed for the label in time.
    pub fn turned(&self) -> usize {
        self.pairs.iter().filter(|pair| pair.turned_s.is_some()).count()
    }

    /// The limits that were not kept, a line each.
    pub fn missed(&self) -> Vec<String> {
        let mut missed = Vec::new();
        if self.median_gain < GAIN_LIMIT {
            missed.push(format!("the median gain is {:.2}, below {GAIN_LIMIT}", self.median_gain));
        }
        if self.longest_stay_s >= flight::STAY_LIMIT_S {
            missed.push(format!("the vehicle stayed within 2 m for {} s without holding", self.longest_stay_s));
        }
        missed
    }
}

/// Runs the pairs of `seeds` seeds from `seed` on, in as many threads as there are processors. `each` is called after each
/// pair.
///
/// # Errors
///
/// A configuration that is not valid, or a world whose first two minutes show no label with more of its kind elsewhere.
pub fn measure_steering(
    config: &Config,
    (seed, seeds): (u64, u64),
    each: &mut dyn FnMut(&SteeringPair),
) -> Result<SteeringFigures, UserError> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicU64::new(0);
    let (sender, done) = mpsc::channel();
    let mut pairs = Vec::new();
    std::thread::scope(|scope| {
        for _ in 0..threads {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                loop {
                    let nth = next.fetch_add(1, Ordering::Relaxed);
                    if nth >= seeds || sender.send(pair(config, seed.wrapping_add(nth))).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        for pair in done {
            let pair = pair?;
            each(&pair);
            pairs.push(pair);
        }
        Ok(())
    })?;
    Ok(SteeringFigures::new(pairs))
}

fn pair(config: &Config, seed: u64) -> Result<SteeringPair, UserError> {
    let mut with = Flight::new(config, seed)?;
    with.fly_until(ORDER_S)?;
    let truth = Arc::new(reference::labels_of(&with.mission, &with.mission.pictured_area())?);
    let Some(favourite) = Favourite::choose(&with, &truth) else {
        return Err(UserError::Failed(format!("seed {seed}: no label has more of its area outside of the seen cells")));
    };
    let Favourite { label, class, .. } = favourite;
    let watched = || Watched { labels: truth.clone(), label, class };
    with.watch(watched());
    with.weigh(label, WEIGHT, EXPLORATION)?;
    with.fly_until(END_S)?;
    let mut without = Flight::new(config, seed)?;
    without.fly_until(ORDER_S)?;
    without.watch(watched());
    without.fly_until(END_S)?;
    let ([with_s, class_s], [without_s, other_class_s]) = (with.watched_s(), without.watched_s());
    let (turned_s, purpose) = with.turned();
    let round = |value: f64| (value * 10.0).round() / 10.0;
    Ok(SteeringPair {
        seed,
        label,
        share: favourite.share,
        seen_m2: round(favourite.seen_m2),
        unseen_m2: round(favourite.unseen_m2),
        with_s: round(with_s),
        without_s: round(without_s),
        gain: with_s / without_s.max(1.0),
        class: with.class_name(class),
        class_gain: class_s / other_class_s.max(1.0),
        turned_s,
        purpose: purpose.map_or("none", purpose_name).to_owned(),
        longest_stay_s: with.longest_stay_s().max(without.longest_stay_s()),
    })
}

fn purpose_name(purpose: Intent) -> &'static str {
    match purpose {
        Intent::Unseen => "unseen",
        Intent::Curiosity => "curiosity",
        Intent::Label(_) => "label",
        Intent::LabelAgain(_) => "label again",
        Intent::Destination => "destination",
        Intent::Area(_) => "area",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair_of(seed: u64, gain: f64, longest_stay_s: u32) -> SteeringPair {
        SteeringPair {
            seed,
            label: 1,
            share: 0.1,
            class: "sand".to_owned(),
            class_gain: 1.0,
            seen_m2: 1.0,
            unseen_m2: 2.0,
            with_s: gain,
            without_s: 1.0,
            gain,
            turned_s: None,
            purpose: "label".to_owned(),
            longest_stay_s,
        }
    }

    #[test]
    fn limits_that_were_not_kept_are_named() {
        let good = SteeringFigures::new(vec![pair_of(2, 3.0, 59), pair_of(1, 1.0, 3), pair_of(3, 2.5, 0)]);
        assert_eq!((good.median_gain, good.longest_stay_s, good.pairs[0].seed), (2.5, 59, 1));
        assert_eq!(good.missed(), Vec::<String>::new());
        let poor = SteeringFigures::new(vec![pair_of(1, 1.0, 60), pair_of(2, 2.0, 0)]);
        assert_eq!(poor.median_gain, 1.5);
        assert_eq!(poor.missed().len(), 2, "{:?}", poor.missed());
    }
}

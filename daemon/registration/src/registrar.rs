//! Places each frame once, by its overlap with earlier frames.

use crate::altitude::ScaleFilter;
use crate::camera_image::{CameraImage, FlatField, Thumbnail};
use crate::compass::HeadingFilter;
use crate::consensus::ExpectedRelief;
use crate::evidence::{Evidence, Loop, Step, Tally};
use crate::kept_frames::{KeptFrame, KeptFrames};
use crate::odometry::{OdometryFilter, Seen};
use crate::pair::{Attempts, Expected, Gates, Link, PLACED_SPREAD};
use crate::similarity::FramePose;
use nalgebra::{Matrix2, Rotation2, Vector2};
use scenecast_core::wrap_rad;
use scenecast_protocol::coordinates::MapPoint;
use serde::{Deserialize, Serialize};

/// Candidates for loops that are tried for each frame, unless set otherwise.
const MAX_LOOPS: u8 = 3;
/// Expected standard deviation of turn and log scale against the frame before, and against earlier frames.
const CHAIN_SPREAD: f64 = 0.025;
const LOOP_SPREAD: f64 = 0.012;
/// Standard deviation of the map itself from place to place, in pixels of a thumbnail.
const MAP_SIGMA_PX: f64 = 0.3;
/// Turns of successive frames have errors that are alike, as are those of several loops, so that their sum is this much
/// less certain than the sum of independent ones.
pub(crate) const CHAIN_ALIKE: f64 = 3.0;
pub(crate) const LOOPS_ALIKE: f64 = 2.0;
/// Variance of the heights before any was seen, in squares of the altitude, and the links that it is averaged over.
const FIRST_RELIEF: f64 = 4e-4;
const RELIEF_LINKS: f64 = 12.0;
/// The same for the first match. Were it taken for flat, a rough floor's slopes would turn the frame.
const UNSEEN_RELIEF: f64 = 0.02;
/// The relief is never taken for larger: heights with a standard deviation of a third of the altitude.
const MAX_RELIEF: f64 = 0.1;
/// A loop that is further from the pose than so many standard deviations contradicts it.
const GATE: f64 = 5.0;

/// A new frame, and where the vehicle's other sensors believe it was taken.
#[derive(Debug, Clone, Copy)]
pub struct FrameInput<'a> {
    pub image: CameraImage<'a>,
    /// Edge of a pixel on the sea floor by the altitude, metres.
    pub metres_per_pixel: f64,
    /// The place below the camera by dead reckoning. Only its change from frame to frame counts.
    pub dead_reckoned: MapPoint,
    /// Direction of the frame's top by the compass, clockwise from north, radians.
    pub compass_rad: f64,
}

/// The pose of a frame, and the evidence for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed {
    pub pose: FramePose,
    /// Whether the frame was matched with the one before.
    pub is_chained: bool,
    /// Number of earlier frames that it was matched with.
    pub loops: u8,
    /// Standard deviation of the place against earlier parts of the map, metres.
    pub sigma_m: f64,
    pub evidence: Evidence,
}

/// Places frames on the map. A frame is never moved once it is placed.
///
/// Where images say nothing, frames follow dead reckoning and compass. Fixes are no part of it: they place the map as a
/// whole. The same frames give the same poses, also across [`Registrar::save`] and [`Registrar::restore`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Registrar {
    pub(crate) flat: FlatField,
    pub(crate) odometry: OdometryFilter,
    pub(crate) last: Option<Last>,
    pub(crate) kept: KeptFrames,
    /// Variance of the heights of the floor, in squares of the altitude.
    pub(crate) relief: f64,
    /// Links that the variance is a mean of, up to a bound.
    relief_links: f64,
    /// Earlier frames that each frame is compared with.
    loops: u8,
    pub(crate) tally: Tally,
}

/// The state after the last frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Last {
    pub(crate) pose: FramePose,
    dead_reckoned: [f64; 2],
    /// Whether dead reckoning continues at another place.
    is_displaced: bool,
    compass_rad: f64,
    pub(crate) heading: HeadingFilter,
    pub(crate) scale: ScaleFilter,
    /// Covariance of the place against earlier parts of the map, square metres.
    pub(crate) covariance_m2: Matrix2<f64>,
    /// Loops that showed the same floor as this frame: errors by its mean height are the same in all of them.
    pub(crate) shared: f64,
    /// `None` for a frame without texture.
    pub(crate) thumbnail: Option<Thumbnail>,
}

impl Registrar {
    /// An empty map. `drift` is the expected error of dead reckoning in metres for each metre of path.
    pub fn new(drift: f64) -> Self {
        Self {
            flat: FlatField::default(),
            odometry: OdometryFilter::new(drift),
            last: None,
            kept: KeptFrames::default(),
            relief: FIRST_RELIEF,
            relief_links: 0.0,
            loops: MAX_LOOPS,
            tally: Tally::default(),
        }
    }

    /// Sets the number of earlier frames, besides the one before, that each frame is compared with.
    #[must_use]
    pub fn with_loops(mut self, loops: u8) -> Self {
        self.loops = loops;
        self
    }

    /// The vehicle may have moved unmeasured: dead reckoning continues somewhere else. The next frame is where dead
    /// reckoning says, with an error of `sigma_m` metres, until it is found to overlap with an earlier one.
    pub fn handle_gap(&mut self, sigma_m: f64) {
        if let Some(last) = &mut self.last {
            last.thumbnail = None;
            last.is_displaced = true;
            last.covariance_m2 = Matrix2::identity() * sigma_m * sigma_m;
        }
    }

    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// Whether the numbers can be those of a registration.
    pub(crate) fn is_sound(&self) -> bool {
        self.flat.is_sound()
            && self.odometry.is_sound()
            && self.kept.is_sound()
            && (0.0..=MAX_RELIEF).contains(&self.relief)
            && (0.0..=RELIEF_LINKS).contains(&self.relief_links)
            && self.last.as_ref().is_none_or(Last::is_sound)
    }

    /// Places a frame. The first one is placed by its input.
    pub fn handle_frame(&mut self, input: &FrameInput) -> Placed {
        let thumbnail = Thumbnail::new(&input.image, input.metres_per_pixel, &mut self.flat);
        self.place(input, thumbnail)
    }

    /// Places a frame by odometry and compass alone, whatever its image shows.
    pub fn handle_unmatched_frame(&mut self, input: &FrameInput) -> Placed {
        self.place(input, None)
    }

    fn place(&mut self, input: &FrameInput, thumbnail: Option<Thumbnail>) -> Placed {
        self.tally.frames += 1;
        let placed = match self.last.take() {
            None => self.begin(input, thumbnail),
            Some(last) => self.advance(last, input, thumbnail),
        };
        self.tally.chained += u32::from(placed.is_chained);
        self.tally.loops += u32::from(placed.loops);
        self.tally.looped += u32::from(placed.loops > 0);
        self.tally.unseen += u32::from(!placed.is_chained && placed.loops == 0);
        placed
    }

    fn begin(&mut self, input: &FrameInput, thumbnail: Option<Thumbnail>) -> Placed {
        let pose = FramePose::new(input.dead_reckoned, input.compass_rad, 0.0);
        let (heading, scale) = (HeadingFilter::new(input.compass_rad), ScaleFilter::new());
        self.keep(input, pose, heading, scale, (Matrix2::zeros(), 0.0), thumbnail);
        Placed { pose, is_chained: false, loops: 0, sigma_m: 0.0, evidence: Evidence::default() }
    }

    fn advance(&mut self, mut last: Last, input: &FrameInput, thumbnail: Option<Thumbnail>) -> Placed {
        let is_displaced = last.is_displaced;
        if is_displaced {
            last.pose = FramePose::new(input.dead_reckoned, last.pose.heading_rad, last.pose.log_scale);
            last.dead_reckoned = [input.dead_reckoned.x_m, input.dead_reckoned.y_m];
        }
        let moved = last.moved(input);
        let (by, sigma_m) = self.odometry.corrected(moved);
        let scales = thumbnail.as_ref().and_then(Thumbnail::unpacked);
        let pixel_m = input.metres_per_pixel * input.image.reduction();
        let reach_m = thumbnail.as_ref().map_or(1.0, |new| new.extent_m().iter().sum::<f64>() / 2.0);
        let window_m = 16.0 * pixel_m + 4.0 * (sigma(&last.covariance_m2) + sigma_m);
        let mut attempts = scales.as_ref().map(|scales| Attempts::new(scales, window_m, Gates::default()));
        let guess_heading = last.heading.corrected(input.compass_rad).0 + last.heading_offset();
        let guess = FramePose::new(point(last.pose.place() + by), wrap_rad(guess_heading), 0.0);
        let window_m = 16.0 * pixel_m + 5.0 * sigma_m;
        let chain =
            attempts.as_mut().and_then(|attempts| last.chain(attempts, &guess, window_m, self.expected_relief()));
        last.take_chain(input, chain.as_ref());
        chain.iter().for_each(|link| self.learn_relief(link));
        let step = match &chain {
            Some(link) => self.fused_step(&mut last, link, moved, reach_m),
            None => last.unseen_step(by, sigma_m),
        };
        let place = last.pose.place() + step.by;
        let now = FramePose::new(point(place), last.heading.heading_rad(), last.scale.log_scale());
        let window_m = 16.0 * pixel_m + 4.0 * sigma(&last.covariance_m2);
        let (numbers, links): (Vec<u32>, Vec<Link>) = match (&mut attempts, &thumbnail) {
            (Some(attempts), Some(thumbnail)) => self.loops(attempts, thumbnail, &now, window_m).into_iter().unzip(),
            _ => Default::default(),
        };
        let (pose, agrees) = self.close(&mut last, &now, &links, pixel_m);
        links.iter().for_each(|link| self.learn_relief(link));
        let agreeing = numbers.iter().zip(&links).zip(agrees).filter(|(_, agrees)| *agrees);
        let loops: Vec<Loop> = agreeing.map(|((&older, link), _)| Loop { older, found: link.found }).collect();
        let (closed, sigma_m) = (loops.len() as u8, sigma(&last.covariance_m2));
        let evidence = Evidence {
            step: (!is_displaced).then_some(step),
            chain: chain.map(|link| link.found),
            loops,
            relief: self.relief,
        };
        self.keep(input, pose, last.heading, last.scale, (last.covariance_m2, last.shared), thumbnail);
        Placed { pose, is_chained: evidence.chain.is_some(), loops: closed, sigma_m, evidence }
    }

    /// What is known of the heights before a match. The first match has to find them by itself.
    fn expected_relief(&self) -> ExpectedRelief {
        match self.relief_links > 0.0 {
            true => ExpectedRelief::known(self.relief),
            false => ExpectedRelief::guessed(UNSEEN_RELIEF),
        }
    }

    fn learn_relief(&mut self, link: &Link) {
        self.relief_links = (self.relief_links + 1.0).min(RELIEF_LINKS);
        self.relief += (link.found.relief.clamp(0.0, MAX_RELIEF) - self.relief) / self.relief_links;
    }

    /// The displacement by odometry and images. Its covariance is added to that of the place.
    fn fused_step(&mut self, last: &mut Last, link: &Link, moved: Vector2<f64>, reach_m: f64) -> Step {
        let seen = Seen {
            by: link.place(last.heading.heading_rad(), last.scale.log_scale()) - last.pose.place(),
            covariance_m2: link.covariance_m2(),
            relief: self.relief,
            alike: link.alike().min(1.0),
            reach_m: reach_m / 2.0,
        };
        let (by, covariance_m2) = self.odometry.fuse(moved, &seen);
        last.covariance_m2 += covariance_m2;
        last.shared *= (-by.norm() / reach_m).exp();
        Step { by, from_heading_rad: last.pose.heading_rad, covariance_m2 }
    }

    /// Matches with earlier frames, each with the number of that frame.
    fn loops(&mut self, attempts: &mut Attempts, new: &Thumbnail, now: &FramePose, window_m: f64) -> Vec<(u32, Link)> {
        let chosen = self.kept.candidates(self.tally.frames, now, new.extent_m(), self.loops.into());
        self.tally.attempts += chosen.len() as u32;
        let frames = chosen.into_iter().filter_map(|i| self.kept.get(i));
        let links = frames.filter_map(|frame| {
            let similarity = frame.pose.to_map().inverse().after(&now.to_map());
            let found = attempts.attempt(
                &frame.thumbnail.unpacked()?,
                &Expected { similarity, window_m, spread: LOOP_SPREAD, relief: self.expected_relief() },
            )?;
            Some((frame.number, Link { found, pose: frame.pose }))
        });
        links.collect()
    }

    /// Corrects the pose by the loops that agree with it, and returns which do.
    fn close(&mut self, last: &mut Last, now: &FramePose, links: &[Link], pixel_m: f64) -> (FramePose, Vec<bool>) {
        let (shared, relief) = (last.shared + links.len() as f64, self.relief);
        let covariance = |link: &Link| {
            let map2 = Matrix2::identity() * (MAP_SIGMA_PX * pixel_m).powi(2);
            link.covariance_m2() + map2 + link.parallax_m2(relief)
        };
        let place = |link: &Link| link.place(now.heading_rad, now.log_scale);
        let distance = |off: Vector2<f64>, covariance: Matrix2<f64>| {
            let wider = covariance + Matrix2::identity() * (0.5 * pixel_m).powi(2);
            wider.try_inverse().map_or(f64::INFINITY, |inverse| off.dot(&(inverse * off)).max(0.0).sqrt())
        };
        let agrees = |link: &Link| {
            let drifted = self.odometry.systematic_m2(now.place() - link.pose.place());
            let is_near = distance(place(link) - now.place(), last.covariance_m2 + drifted + covariance(link)) < GATE;
            // Two loops that agree with each other are trusted.
            let is_confirmed = links.iter().any(|other| {
                let both = covariance(link) + covariance(other);
                let is_sharp = sigma(&both) < 8.0 * pixel_m;
                !std::ptr::eq(link, other) && is_sharp && distance(place(link) - place(other), both) < GATE / 2.0
            });
            is_near || is_confirmed
        };
        let agrees: Vec<bool> = links.iter().map(agrees).collect();
        let agreeing: Vec<&Link> =
            links.iter().zip(&agrees).filter(|(_, agrees)| **agrees).map(|(link, _)| link).collect();
        self.tally.contradicted += (links.len() - agreeing.len()) as u32;
        for link in &agreeing {
            last.heading.measure(link.heading_rad(), (LOOPS_ALIKE * link.found.turn_sigma).hypot(PLACED_SPREAD));
            last.scale.measure(link.log_scale(), link.found.log_scale_sigma.hypot(PLACED_SPREAD));
        }
        let (heading, log_scale) = (last.heading.heading_rad(), last.scale.log_scale());
        let drifted = agreeing.iter().map(|link| self.odometry.systematic_m2(now.place() - link.pose.place()));
        let drifted = drifted.max_by(|a, b| a.trace().total_cmp(&b.trace())).unwrap_or_default();
        // The drift is corrected by the first link as the place is; a later one finds what is left of both.
        let (mut at, mut whole) = (now.place(), last.covariance_m2 + drifted);
        for link in &agreeing {
            let measured = covariance(link) + link.parallax_m2(relief) * (shared - 1.0).max(0.0);
            let gain = gain(&whole, &measured);
            at += gain * (link.place(heading, log_scale) - at);
            whole = reduced(&whole, &measured);
            last.covariance_m2 = reduced(&last.covariance_m2, &measured);
        }
        last.shared += agreeing.len() as f64;
        (FramePose::new(point(at), heading, log_scale), agrees)
    }

    fn keep(
        &mut self,
        input: &FrameInput,
        pose: FramePose,
        heading: HeadingFilter,
        scale: ScaleFilter,
        (covariance_m2, shared): (Matrix2<f64>, f64),
        thumbnail: Option<Thumbnail>,
    ) {
        if let Some(thumbnail) = &thumbnail {
            self.kept.offer(&KeptFrame { number: self.tally.frames, pose, thumbnail: thumbnail.clone() });
        }
        let MapPoint { x_m, y_m } = input.dead_reckoned;
        let (dead_reckoned, compass_rad) = ([x_m, y_m], input.compass_rad);
        self.last = Some(Last {
            pose,
            dead_reckoned,
            is_displaced: false,
            compass_rad,
            heading,
            scale,
            covariance_m2,
            shared,
            thumbnail,
        });
    }
}

impl Last {
    fn is_sound(&self) -> bool {
        let others = [self.dead_reckoned[0], self.dead_reckoned[1], self.compass_rad];
        let mut numbers = self.covariance_m2.iter().copied().chain(others);
        let variances = self.covariance_m2.diagonal();
        self.pose.is_sound()
            && numbers.all(f64::is_finite)
            && variances.min() >= 0.0
            && self.covariance_m2.determinant() >= -1e-9 * variances.max().powi(2)
            && (0.0..=1e9).contains(&self.shared)
            && self.heading.is_sound()
            && self.scale.is_sound()
            && self.thumbnail.as_ref().is_none_or(Thumbnail::is_sound)
    }

    /// A displacement that no image shows. Such errors add up, as they are alike.
    fn unseen_step(&mut self, by: Vector2<f64>, sigma_m: f64) -> Step {
        let before = sigma(&self.covariance_m2);
        self.covariance_m2 += Matrix2::identity() * (sigma_m * sigma_m + 2.0 * sigma_m * before);
        self.shared = 0.0;
        Step { by, from_heading_rad: self.pose.heading_rad, covariance_m2: Matrix2::identity() * sigma_m * sigma_m }
    }

    /// The turn of the map against the corrected compass at the last frame.
    fn heading_offset(&self) -> f64 {
        wrap_rad(self.pose.heading_rad - self.heading.corrected(self.compass_rad).0)
    }

    /// The displacement by odometry since this frame, in the axes of the map.
    fn moved(&self, input: &FrameInput) -> Vector2<f64> {
        let [x, y] = self.dead_reckoned;
        let by = Vector2::new(input.dead_reckoned.x_m - x, input.dead_reckoned.y_m - y);
        // Odometry has the axes of the compass.
        Rotation2::new(wrap_rad(self.compass_rad - self.pose.heading_rad)) * by
    }

    /// The match of a frame at `guess` with this one.
    fn chain(&self, attempts: &mut Attempts, guess: &FramePose, window_m: f64, relief: ExpectedRelief) -> Option<Link> {
        let old = self.thumbnail.as_ref()?.unpacked()?;
        let similarity = self.pose.to_map().inverse().after(&guess.to_map());
        let found = attempts.attempt(&old, &Expected { similarity, window_m, spread: CHAIN_SPREAD, relief })?;
        Some(Link { found, pose: self.pose })
    }

    /// Heading and scale of a new frame, by its match with this one, compass and altitude.
    fn take_chain(&mut self, input: &FrameInput, chain: Option<&Link>) {
        let turned = chain.map(|link| (-link.found.similarity.turn_rad(), CHAIN_ALIKE * link.found.turn_sigma));
        let scaled = chain.map(|link| (link.found.similarity.scale().ln(), link.found.log_scale_sigma));
        self.heading.advance(input.compass_rad, turned);
        self.heading.measure_compass();
        self.scale.advance(scaled);
        self.scale.measure_altitude();
    }
}

/// The share of a measurement in an estimate, by the covariances of both.
fn gain(estimate: &Matrix2<f64>, measurement: &Matrix2<f64>) -> Matrix2<f64> {
    (estimate + measurement).try_inverse().map_or(Matrix2::zeros(), |inverse| estimate * inverse)
}

/// The covariance of an estimate after a measurement.
fn reduced(estimate: &Matrix2<f64>, measurement: &Matrix2<f64>) -> Matrix2<f64> {
    let left = (Matrix2::identity() - gain(estimate, measurement)) * estimate;
    (left + left.transpose()) / 2.0
}

/// The root of the mean variance of both directions.
fn sigma(covariance: &Matrix2<f64>) -> f64 {
    (covariance.trace() / 2.0).max(0.0).sqrt()
}

fn point(at: Vector2<f64>) -> MapPoint {
    MapPoint::new(at.x, at.y)
}

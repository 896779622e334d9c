//! How a vehicle builds its map, how finely it tells it, and how it chooses its way.

use super::{Figure, PlannerKind};
use crate::bytes::{Reader, Truncated};
use crate::map::PlaneKind;
use std::ops::RangeInclusive;

/// What an order says of one setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Change<T> {
    /// Nothing: it stays as it is.
    #[default]
    Keep,
    /// It is as the vehicle is configured.
    Configured,
    /// It is this.
    To(T),
}

impl<T: Copy> Change<T> {
    /// What was ordered last, of this and an order after it.
    pub fn then(self, later: Self) -> Self {
        if matches!(later, Self::Keep) { self } else { later }
    }

    /// What is in force, if it is not what the vehicle is configured with.
    pub fn value(self) -> Option<T> {
        match self {
            Self::To(value) => Some(value),
            Self::Keep | Self::Configured => None,
        }
    }

    fn code(self, index: impl FnOnce(T) -> u8) -> u8 {
        match self {
            Self::Keep => 0,
            Self::Configured => 1,
            Self::To(value) => index(value) + 2,
        }
    }

    fn from_code(code: u8, value: impl FnOnce(u8) -> Option<T>) -> Result<Self, Truncated> {
        match code {
            0 => Ok(Self::Keep),
            1 => Ok(Self::Configured),
            _ => value(code - 2).map(Self::To).ok_or(Truncated),
        }
    }
}

/// Which cells of the map a vehicle tells: a band of sizes, the finest and the coarsest. The model's own cells stay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellBand {
    /// Every cell.
    Fine,
    /// Every fourth cell in both directions first where there is too much to say, then every cell.
    CoarseToFine,
    /// Every fourth cell in both directions. Cells that the surface knows already stay up to date.
    Coarse,
}

impl CellBand {
    /// Every band, in wire order.
    pub const ALL: [Self; 3] = [Self::Fine, Self::CoarseToFine, Self::Coarse];

    /// Name in files and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fine => "fine",
            Self::CoarseToFine => "coarse-to-fine",
            Self::Coarse => "coarse",
        }
    }

    /// The band of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|band| band.name() == name)
    }
}

/// Planes that are told beside the labels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PlaneSet {
    /// How sure the model is of a label.
    pub confidence: bool,
    /// Depth of the sea floor.
    pub depth: bool,
    /// How badly the model explains what it sees.
    pub curiosity: bool,
}

impl PlaneSet {
    /// The planes for which it holds.
    pub fn of(has: impl Fn(PlaneKind) -> bool) -> Self {
        Self {
            confidence: has(PlaneKind::Confidence),
            depth: has(PlaneKind::Depth),
            curiosity: has(PlaneKind::Curiosity),
        }
    }

    /// The planes among them, in wire order.
    pub fn kinds(self) -> impl Iterator<Item = PlaneKind> {
        PlaneKind::ALL.into_iter().filter(move |&kind| self.has(kind))
    }

    /// Whether a plane is among them.
    pub fn has(self, kind: PlaneKind) -> bool {
        match kind {
            PlaneKind::Confidence => self.confidence,
            PlaneKind::Depth => self.depth,
            PlaneKind::Curiosity => self.curiosity,
        }
    }
}

/// A setting that no vehicle could obey.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{name} {value}: it takes {} to {}", range.start(), range.end())]
pub struct SettingsFault {
    /// Name of the setting.
    pub name: &'static str,
    /// What it was set to.
    pub value: f64,
    /// What it may be.
    pub range: RangeInclusive<f64>,
}

/// How the vehicle builds its map, how finely it tells it and how it chooses its way; what is not named stays as it is.
///
/// ```text
///         7   6   5   4   3   2   1   0
///       +-----------+-----------+-------+
/// byte 0| planner   | cells     | planes|
///       +---+---+---+---+---+---+---+---+
/// byte 1| C | D | Q | a | b | g | r | f |
///       +---+---+---+---+---+---+---+---+
/// then 2 bytes, a figure, for each of a, b, g, r, f that is 1
/// ```
/// * planner: 0 stays, 1 as configured, 2 lawnmower, 3 greedy, 4 horizon.
/// * cells: 0 stays, 1 as configured, 2 fine, 3 coarse to fine, 4 coarse.
/// * planes: 0 stay, 1 as configured, 2 those of C (confidence), D (depth) and Q (curiosity).
/// * a, b, g: alpha, beta, gamma of the scene model; r: words resampled a second of mission time; f: camera frames a
///   second that the scene model sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Settings {
    /// How the vehicle chooses its way.
    pub planner: Change<PlannerKind>,
    /// Which cells it tells.
    pub cells: Change<CellBand>,
    /// Which planes it tells.
    pub planes: Change<PlaneSet>,
    /// Preference for labels that are used elsewhere.
    pub alpha: Change<Figure>,
    /// Prior weight of each word in a label.
    pub beta: Change<Figure>,
    /// Weight of a new label.
    pub gamma: Change<Figure>,
    /// Words resampled a second of mission time.
    pub refine_words_per_s: Change<Figure>,
    /// Camera frames a second that the scene model sees at most.
    pub frames_per_s: Change<Figure>,
}

impl Settings {
    /// What alpha and beta may be.
    pub const PRIOR: RangeInclusive<f64> = 1e-9..=1e3;
    /// What gamma may be.
    pub const GAMMA: RangeInclusive<f64> = 1e-12..=1e3;
    /// Words a second that may be resampled.
    pub const WORDS_PER_S: RangeInclusive<f64> = 1.0..=1e8;
    /// Frames a second that the scene model may see.
    pub const FRAMES_PER_S: RangeInclusive<f64> = 0.01..=30.0;
    /// Most bytes of the payload.
    pub const MAX_BYTES: usize = 12;

    /// What both together say, this one first.
    #[must_use]
    pub fn then(&self, later: &Self) -> Self {
        Self {
            planner: self.planner.then(later.planner),
            cells: self.cells.then(later.cells),
            planes: self.planes.then(later.planes),
            alpha: self.alpha.then(later.alpha),
            beta: self.beta.then(later.beta),
            gamma: self.gamma.then(later.gamma),
            refine_words_per_s: self.refine_words_per_s.then(later.refine_words_per_s),
            frames_per_s: self.frames_per_s.then(later.frames_per_s),
        }
    }

    /// Each number with its name and range.
    pub fn figures(&self) -> [(&'static str, Change<Figure>, RangeInclusive<f64>); 5] {
        [
            ("alpha", self.alpha, Self::PRIOR),
            ("beta", self.beta, Self::PRIOR),
            ("gamma", self.gamma, Self::GAMMA),
            ("refine_words_per_s", self.refine_words_per_s, Self::WORDS_PER_S),
            ("frames_per_s", self.frames_per_s, Self::FRAMES_PER_S),
        ]
    }

    /// Says which number no vehicle could obey, if any.
    pub fn check(&self) -> Result<(), SettingsFault> {
        for (name, change, range) in self.figures() {
            let value = change.value().map(Figure::value);
            if let Some(value) = value.filter(|value| !range.contains(value)) {
                return Err(SettingsFault { name, value, range });
            }
        }
        Ok(())
    }

    /// The payload, which is also how it is kept.
    pub fn to_bytes(&self) -> Vec<u8> {
        let planner = self.planner.code(|p| p as u8);
        let cells = self.cells.code(|c| c as u8);
        let planes = self.planes.code(|_| 0);
        let set = self.planes.value().unwrap_or_default();
        let mut given = u8::from(set.confidence) << 7 | u8::from(set.depth) << 6 | u8::from(set.curiosity) << 5;
        let mut numbers = Vec::new();
        for (index, (_, change, _)) in self.figures().into_iter().enumerate() {
            if !matches!(change, Change::Keep) {
                given |= 0x10 >> index;
            }
            Figure::encode(change, &mut numbers);
        }
        let mut out = vec![planner << 5 | cells << 2 | planes, given];
        out.append(&mut numbers);
        out
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        let (choices, given) = (r.u8()?, r.u8()?);
        let set = PlaneSet { confidence: given & 0x80 != 0, depth: given & 0x40 != 0, curiosity: given & 0x20 != 0 };
        let planes = Change::from_code(choices & 3, |code| (code == 0).then_some(set))?;
        if planes.value().is_none() && set != PlaneSet::default() {
            return Err(Truncated);
        }
        let mut figure = |bit: u8| if given & bit != 0 { Figure::decode(r) } else { Ok(Change::Keep) };
        Ok(Self {
            alpha: figure(0x10)?,
            beta: figure(0x08)?,
            gamma: figure(0x04)?,
            refine_words_per_s: figure(0x02)?,
            frames_per_s: figure(0x01)?,
            planner: Change::from_code(choices >> 5, |code| PlannerKind::ALL.get(usize::from(code)).copied())?,
            cells: Change::from_code(choices >> 2 & 7, |code| CellBand::ALL.get(usize::from(code)).copied())?,
            planes,
        })
    }

    /// Reads [`Self::to_bytes`]; none if they make no sense.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut r = Reader::new(bytes);
        Self::decode(&mut r).ok().filter(|_| r.rest().is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::fmt;

    fn to(value: f64) -> Change<Figure> {
        Change::To(Figure::new(value).unwrap())
    }

    fn change<T: Copy + fmt::Debug + 'static>(value: impl Strategy<Value = T>) -> impl Strategy<Value = Change<T>> {
        prop_oneof![Just(Change::Keep), Just(Change::Configured), value.prop_map(Change::To)]
    }

    fn figure() -> impl Strategy<Value = Figure> {
        (100u16..=999, -14i32..=17).prop_map(|(digits, e)| Figure::new(f64::from(digits) * 10f64.powi(e)).unwrap())
    }

    fn settings() -> impl Strategy<Value = Settings> {
        let choices = (
            change(proptest::sample::select(PlannerKind::ALL.to_vec())),
            change(proptest::sample::select(CellBand::ALL.to_vec())),
            change(any::<[bool; 3]>().prop_map(|[confidence, depth, curiosity]| PlaneSet {
                confidence,
                depth,
                curiosity,
            })),
        );
        let figures = (change(figure()), change(figure()), change(figure()), change(figure()), change(figure()));
        (choices, figures).prop_map(|((planner, cells, planes), (alpha, beta, gamma, refine, frames))| Settings {
            planner,
            cells,
            planes,
            alpha,
            beta,
            gamma,
            refine_words_per_s: refine,
            frames_per_s: frames,
        })
    }

    #[test]
    fn golden_bytes_of_settings() {
        let settings = Settings {
            planner: Change::To(PlannerKind::Horizon),
            cells: Change::To(CellBand::Coarse),
            planes: Change::To(PlaneSet { depth: true, ..PlaneSet::default() }),
            alpha: to(0.01),
            gamma: Change::Configured,
            frames_per_s: to(0.25),
            ..Settings::default()
        };
        let bytes = [0x92, 0x55, 0x28, 0x64, 0, 0, 0x2C, 0xFA];
        assert_eq!(settings.to_bytes(), bytes);
        assert_eq!(Settings::from_bytes(&bytes), Some(settings));
        assert_eq!(Settings::default().to_bytes(), [0, 0]);
        let curious = PlaneSet::of(|kind| kind == PlaneKind::Curiosity);
        assert_eq!(Settings { planes: Change::To(curious), ..Settings::default() }.to_bytes(), [2, 0x20]);
    }

    #[test]
    fn an_order_adds_to_those_before_it_and_can_take_them_back() {
        let first = Settings { alpha: to(0.5), gamma: to(1e-5), ..Settings::default() };
        let second = Settings { alpha: Change::Configured, beta: to(0.2), ..Settings::default() };
        let both = first.then(&second);
        assert_eq!((both.alpha, both.beta, both.gamma), (Change::Configured, to(0.2), to(1e-5)));
        assert_eq!((both.alpha.value(), both.then(&first).alpha), (None, to(0.5)));
    }

    #[test]
    fn a_number_out_of_its_range_is_named() {
        let said = |settings: Settings| settings.check().unwrap_err().to_string();
        assert_eq!(
            said(Settings { alpha: to(5000.0), ..Settings::default() }),
            "alpha 5000: it takes 0.000000001 to 1000"
        );
        let fast = Settings { frames_per_s: to(31.0), ..Settings::default() };
        assert_eq!(said(fast), "frames_per_s 31: it takes 0.01 to 30");
        assert_eq!(Settings { gamma: to(1e-12), beta: to(1e3), ..Settings::default() }.check(), Ok(()));
    }

    #[test]
    fn reserved_bits_and_codes_are_refused() {
        for bytes in
            [&[0xA0, 0][..], &[0x14, 0], &[3, 0], &[0, 0x20], &[0, 0x80], &[0, 0x10, 0, 99], &[0, 0x10, 0x80, 100]]
        {
            assert_eq!(Settings::from_bytes(bytes), None, "{bytes:02X?}");
        }
        assert_eq!(Settings::from_bytes(&[0, 0, 0]), None);
    }

    proptest! {
        #[test]
        fn settings_round_trip(settings in settings()) {
            let bytes = settings.to_bytes();
            prop_assert!(bytes.len() <= Settings::MAX_BYTES);
            prop_assert_eq!(Settings::from_bytes(&bytes), Some(settings));
        }

        #[test]
        fn any_bytes_are_settings_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..14)) {
            if let Some(settings) = Settings::from_bytes(&bytes) {
                prop_assert_eq!(settings.to_bytes(), bytes);
            }
        }
    }
}

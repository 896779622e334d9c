//! Settings of the vehicle: how it places its frames and builds its map, which cells and layers it sends, and how it plans
//! its path.

use super::{AtEnd, CellBand, Change, PlannerKind, Registration, ShortDecimal};
use crate::bytes::{Reader, Truncated};
use crate::map::LayerMask;
use std::ops::RangeInclusive;

/// A setting that no vehicle could obey.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{name} {value}: it takes {} to {}", range.start(), range.end())]
pub struct SettingsFault {
    /// Name of the setting, as in files and in the API.
    pub name: &'static str,
    /// The value that was ordered, in the unit of the setting.
    pub value: f64,
    /// The values that a vehicle accepts, in the same unit.
    pub range: RangeInclusive<f64>,
}

/// Orders about the scene model, the cells and layers to send, and the planner. A setting that is not named stays as it is.
///
/// ```text
///         7   6   5   4   3   2   1   0
///       +-----------+-----------+-------+
/// byte 0| planner   | cells     | layers|
///       +-----------+---+---+---+---+---+
/// byte 1| end       | a | b | g | r | f |
///       +-----------+---+---+---+---+---+
/// then 2 bytes, a mask of layers, if layers is 2
/// then 2 bytes, a [`ShortDecimal`], for each of a, b, g, r, f that is 1
/// then 1 byte, unless all of it is 0:
///       +-------+-----------------------+
///       | reg.  | labels                |
///       +-------+-----------------------+
/// ```
/// * planner: 0 stays, 1 as configured, 2 lawnmower, 3 greedy, 4 horizon.
/// * cells: 0 stays, 1 as configured, 2 fine, 3 coarse to fine, 4 coarse.
/// * layers: 0 stay, 1 as configured, 2 those of the mask, whose bit 0 is layer 0.
/// * a, b, g: alpha, beta, gamma of the scene model; r: words resampled a second of mission time; f: camera frames a
///   second that the scene model sees.
/// * end of the survey: 0 stays, 1 as configured, 2 repeat, 3 explore, 4 hold ([`AtEnd`]).
/// * registration: 0 stays, 1 as configured, 2 off, 3 on ([`Registration`]).
/// * labels: 0 stay, 1 as configured, 2 to 32.
///
/// ```
/// use scenecast_protocol::directive::{Change, PlannerKind, Settings, ShortDecimal};
///
/// let first = Settings { alpha: Change::To(ShortDecimal::new(0.1).unwrap()), ..Settings::default() };
/// let second = Settings { planner: Change::To(PlannerKind::Horizon), ..Settings::default() };
/// let both = first.then(&second);
/// assert_eq!((both.alpha, both.planner), (first.alpha, second.planner));
/// assert_eq!(Settings::from_bytes(&both.to_bytes()), Some(both));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Settings {
    /// The planner that chooses the next waypoints.
    pub planner: Change<PlannerKind>,
    /// What an adaptive survey does once no look pays any more.
    pub at_end: Change<AtEnd>,
    /// Whether images place the frames of the camera.
    pub registration: Change<Registration>,
    /// The cells of the map that it sends.
    pub cells: Change<CellBand>,
    /// The layers that it sends beside the labels.
    pub layers: Change<LayerMask>,
    /// Alpha of the scene model, within [`Self::PRIOR`]: the weight of labels that are common elsewhere.
    pub alpha: Change<ShortDecimal>,
    /// Beta of the scene model, within [`Self::PRIOR`]: the prior count of each word in a label.
    pub beta: Change<ShortDecimal>,
    /// Gamma of the scene model, within [`Self::GAMMA`]: the weight of a new label.
    pub gamma: Change<ShortDecimal>,
    /// Words resampled a second of mission time.
    pub refine_words_per_s: Change<ShortDecimal>,
    /// Camera frames a second that the scene model sees at most.
    pub frames_per_s: Change<ShortDecimal>,
    /// Most labels that the map tells apart at one time, within [`Self::LABELS`]; where labels are habitats.
    pub labels: Change<u8>,
}

impl Settings {
    /// The range of alpha and beta, dimensionless.
    pub const PRIOR: RangeInclusive<f64> = 1e-9..=1e3;
    /// The range of gamma, dimensionless.
    pub const GAMMA: RangeInclusive<f64> = 1e-12..=1e3;
    /// Words a second that may be resampled.
    pub const WORDS_PER_S: RangeInclusive<f64> = 1.0..=1e8;
    /// Frames a second that the scene model may see.
    pub const FRAMES_PER_S: RangeInclusive<f64> = 0.01..=30.0;
    /// Labels that a map may tell apart at most.
    pub const LABELS: RangeInclusive<u8> = 2..=32;
    /// Most bytes of the payload.
    pub const MAX_BYTES: usize = 15;
    /// The bits of the number of labels.
    const LABEL_BITS: u8 = 0x3F;

    /// The combination of these settings with later ones; where both name a setting, the later one counts.
    #[must_use]
    pub fn then(&self, later: &Self) -> Self {
        Self {
            planner: self.planner.then(later.planner),
            at_end: self.at_end.then(later.at_end),
            registration: self.registration.then(later.registration),
            cells: self.cells.then(later.cells),
            layers: self.layers.then(later.layers),
            alpha: self.alpha.then(later.alpha),
            beta: self.beta.then(later.beta),
            gamma: self.gamma.then(later.gamma),
            refine_words_per_s: self.refine_words_per_s.then(later.refine_words_per_s),
            frames_per_s: self.frames_per_s.then(later.frames_per_s),
            labels: self.labels.then(later.labels),
        }
    }

    /// Each numeric setting with its name and range.
    pub fn numbers(&self) -> [(&'static str, Change<ShortDecimal>, RangeInclusive<f64>); 5] {
        [
            ("alpha", self.alpha, Self::PRIOR),
            ("beta", self.beta, Self::PRIOR),
            ("gamma", self.gamma, Self::GAMMA),
            ("refine_words_per_s", self.refine_words_per_s, Self::WORDS_PER_S),
            ("frames_per_s", self.frames_per_s, Self::FRAMES_PER_S),
        ]
    }

    /// Checks that every number lies within its range; the error names the first one that does not.
    pub fn check(&self) -> Result<(), SettingsFault> {
        for (name, change, range) in self.numbers() {
            let value = change.value().map(ShortDecimal::value);
            if let Some(value) = value.filter(|value| !range.contains(value)) {
                return Err(SettingsFault { name, value, range });
            }
        }
        if let Some(labels) = self.labels.value().filter(|labels| !Self::LABELS.contains(labels)) {
            let range = f64::from(*Self::LABELS.start())..=f64::from(*Self::LABELS.end());
            return Err(SettingsFault { name: "labels", value: labels.into(), range });
        }
        Ok(())
    }

    /// Encodes the payload, which is also the form in the journal.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut given = self.at_end.code(|choice| choice as u8) << 5;
        let mut numbers = Vec::new();
        for (index, (_, change, _)) in self.numbers().into_iter().enumerate() {
            if !matches!(change, Change::Keep) {
                given |= 0x10 >> index;
            }
            ShortDecimal::encode(change, &mut numbers);
        }
        let choices = self.planner.code(|p| p as u8) << 5 | self.cells.code(|c| c as u8) << 2 | self.layers.code(|_| 0);
        let mut out = vec![choices, given];
        out.extend(self.layers.value().into_iter().flat_map(|mask| mask.0.to_be_bytes()));
        out.append(&mut numbers);
        // More than the bits hold is out of range, and must stay so.
        let labels = self.labels.code(|labels| labels.clamp(2, Self::LABEL_BITS) - 2);
        let more = self.registration.code(|choice| choice as u8) << 6 | labels;
        out.extend((more != 0).then_some(more));
        out
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        let (choices, given) = (r.u8()?, r.u8()?);
        let layers = match choices & 3 {
            2 => Change::To(LayerMask(r.u16()?)),
            code => Change::from_code(code, |_| None)?,
        };
        let mut figure = |bit: u8| if given & bit != 0 { ShortDecimal::decode(r) } else { Ok(Change::Keep) };
        let (alpha, beta, gamma) = (figure(0x10)?, figure(0x08)?, figure(0x04)?);
        let (refine_words_per_s, frames_per_s) = (figure(0x02)?, figure(0x01)?);
        // A byte of zeros is left out.
        let more = match r.rest() {
            [] => 0,
            [0, ..] => return Err(Truncated),
            _ => r.u8()?,
        };
        Ok(Self {
            alpha,
            beta,
            gamma,
            refine_words_per_s,
            frames_per_s,
            labels: Change::from_code(more & Self::LABEL_BITS, |code| Some(code + 2))?,
            at_end: Change::from_code(given >> 5, |code| AtEnd::ALL.get(usize::from(code)).copied())?,
            registration: Change::from_code(more >> 6, |code| Registration::ALL.get(usize::from(code)).copied())?,
            planner: Change::from_code(choices >> 5, |code| PlannerKind::ALL.get(usize::from(code)).copied())?,
            cells: Change::from_code(choices >> 2 & 7, |code| CellBand::ALL.get(usize::from(code)).copied())?,
            layers,
        })
    }

    /// Decodes the bytes of [`Self::to_bytes`]; `None` if a code, a bit or the length is not allowed.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut r = Reader::new(bytes);
        Self::decode(&mut r).ok().filter(|_| r.rest().is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::LayerId;
    use proptest::prelude::*;
    use std::fmt;

    fn to(value: f64) -> Change<ShortDecimal> {
        Change::To(ShortDecimal::new(value).unwrap())
    }

    fn change<T: Copy + fmt::Debug + 'static>(value: impl Strategy<Value = T>) -> impl Strategy<Value = Change<T>> {
        prop_oneof![Just(Change::Keep), Just(Change::Configured), value.prop_map(Change::To)]
    }

    fn figure() -> impl Strategy<Value = ShortDecimal> {
        (100u16..=999, -14i32..=17)
            .prop_map(|(digits, e)| ShortDecimal::new(f64::from(digits) * 10f64.powi(e)).unwrap())
    }

    fn settings() -> impl Strategy<Value = Settings> {
        let choices = (
            change(proptest::sample::select(PlannerKind::ALL.to_vec())),
            change(proptest::sample::select(AtEnd::ALL.to_vec())),
            change(proptest::sample::select(Registration::ALL.to_vec())),
            change(proptest::sample::select(CellBand::ALL.to_vec())),
            change(prop_oneof![0u16..8, any::<u16>()].prop_map(LayerMask)),
            change(2u8..=63),
        );
        let figures = (change(figure()), change(figure()), change(figure()), change(figure()), change(figure()));
        (choices, figures).prop_map(
            |((planner, at_end, registration, cells, layers, labels), (alpha, beta, gamma, refine, frames))| Settings {
                planner,
                at_end,
                registration,
                cells,
                layers,
                alpha,
                beta,
                gamma,
                refine_words_per_s: refine,
                frames_per_s: frames,
                labels,
            },
        )
    }

    #[test]
    fn golden_bytes_of_settings() {
        let settings = Settings {
            planner: Change::To(PlannerKind::Horizon),
            cells: Change::To(CellBand::Coarse),
            layers: Change::To(LayerMask::from_iter([LayerId::DEPTH])),
            alpha: to(0.01),
            gamma: Change::Configured,
            frames_per_s: to(0.25),
            ..Settings::default()
        };
        let bytes = [0x92, 0x15, 0, 1, 0x28, 0x64, 0, 0, 0x2C, 0xFA];
        assert_eq!(settings.to_bytes(), bytes);
        assert_eq!(Settings::from_bytes(&bytes), Some(settings));
        assert_eq!(Settings::default().to_bytes(), [0, 0]);
        let of_end = |at_end| Settings { at_end, ..Settings::default() }.to_bytes();
        assert_eq!((of_end(Change::Configured), of_end(Change::To(AtEnd::Hold))), (vec![0, 0x20], vec![0, 0x80]));
        let of_registration = |registration| Settings { registration, ..Settings::default() }.to_bytes();
        assert_eq!(of_registration(Change::Configured), [0, 0, 0x40]);
        assert_eq!(of_registration(Change::To(Registration::Off)), [0, 0, 0x80]);
        let of_labels = |labels| Settings { labels, ..Settings::default() }.to_bytes();
        assert_eq!(
            [Change::Configured, Change::To(2), Change::To(32)].map(of_labels),
            [vec![0, 0, 1], vec![0, 0, 2], vec![0, 0, 32]]
        );
        assert_eq!(of_labels(Change::To(66)), [0, 0, 63], "it stays out of range");
        let of_layers = |mask| Settings { layers: Change::To(LayerMask(mask)), ..Settings::default() }.to_bytes();
        assert_eq!((of_layers(0), of_layers(0x8004)), (vec![2, 0, 0, 0], vec![2, 0, 0x80, 4]));
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
        let message = |settings: Settings| settings.check().unwrap_err().to_string();
        assert_eq!(
            message(Settings { alpha: to(5000.0), ..Settings::default() }),
            "alpha 5000: it takes 0.000000001 to 1000"
        );
        let fast = Settings { frames_per_s: to(31.0), ..Settings::default() };
        assert_eq!(message(fast), "frames_per_s 31: it takes 0.01 to 30");
        assert_eq!(message(Settings { labels: Change::To(1), ..Settings::default() }), "labels 1: it takes 2 to 32");
        assert_eq!(Settings { gamma: to(1e-12), beta: to(1e3), ..Settings::default() }.check(), Ok(()));
    }

    #[test]
    fn reserved_bits_and_codes_are_refused() {
        for bytes in [
            &[0xA0, 0][..],
            &[0x14, 0],
            &[3, 0],
            &[2, 0, 0],
            &[0, 0xA0],
            &[0, 0x10, 0, 99],
            &[0, 0x10, 0x80, 100],
            &[0, 0, 0],
            &[0, 0, 2, 2],
        ] {
            assert_eq!(Settings::from_bytes(bytes), None, "{bytes:02X?}");
        }
    }

    proptest! {
        #[test]
        fn settings_round_trip(settings in settings()) {
            let bytes = settings.to_bytes();
            prop_assert!(bytes.len() <= Settings::MAX_BYTES);
            prop_assert_eq!(Settings::from_bytes(&bytes), Some(settings));
        }

        #[test]
        fn any_bytes_are_settings_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..16)) {
            if let Some(settings) = Settings::from_bytes(&bytes) {
                prop_assert_eq!(settings.to_bytes(), bytes);
            }
        }
    }
}

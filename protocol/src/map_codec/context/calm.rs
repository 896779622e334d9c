//! The decision whether a cell far from any border or change keeps its label.

use super::recent::Recent;
use super::stage::{Contexts, StageLayout};
use super::view::View;

pub(super) const LAYOUT: StageLayout = StageLayout {
    name: "calm",
    direct: &[6 * Recent::RATES, 5 * Recent::GAPS, 500],
    keyed: &[10],
    sets: [6, Recent::RATES, 10],
    apms: 1,
};

pub(super) fn contexts(view: &View, noise: usize, calm: &Recent, border: &Recent) -> Contexts {
    let rate = calm.rate();
    let one_in = calm.one_in() - 2;
    let mut contexts = Contexts::default();
    contexts.direct[..3].copy_from_slice(&[
        rate * 6 + noise,
        calm.gap() * 5 + one_in / 2,
        (one_in * 10 + border.one_in() - 2) * 5 + rate / 10,
    ]);
    contexts.keyed[0] = (u32::from(view.held), one_in);
    contexts.sets = [noise, rate, border.one_in() - 2];
    contexts
}

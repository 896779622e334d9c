//! The legs of a survey, part by part of the area: in each part a line is one stretch, so that no leg goes around an area to stay
//! out of.

use super::lattice::{Lattice, Node};

/// The joined places of a line that are to be seen, from the west or the south.
type Stretch = Vec<Node>;
/// Stretches of neighbouring legs, of which each has one neighbour on either side.
type Part = Vec<Stretch>;

/// Parts up to this number are put in the order with the shortest ways between them; of more, the nearest one is always the next.
const MAX_ORDERED: usize = 8;

/// The ends of the legs over all `wanted` places that can be reached from a place, in the order in which a vehicle goes there.
///
/// The parts are those of the boustrophedon decomposition (Choset, 2000), on the lines of the lattice.
pub fn legs(lattice: &Lattice, from: Node, wanted: impl Fn(Node) -> bool) -> Vec<Node> {
    let reached = lattice.paths(from);
    let parts = parts(lattice, |node| wanted(node) && reached.metres[node].is_finite());
    let ways: Vec<[Vec<Node>; CORNERS]> =
        parts.iter().map(|part| std::array::from_fn(|corner| ends(part, corner))).collect();
    order(lattice, from, &ways).into_iter().flat_map(|(part, corner)| ways[part][corner].clone()).collect()
}

/// The length of the path along legs, metres.
pub fn length_m(lattice: &Lattice, legs: &[Node]) -> f64 {
    let metres = |(from, to): (&Node, &Node)| match lattice.straight(*from, *to) {
        Some(_) => super::distance(lattice.place(*from), lattice.place(*to)),
        None => lattice.paths_up_to(*from, Some(*to)).metres[*to],
    };
    legs.iter().zip(legs.iter().skip(1)).map(metres).sum()
}

fn parts(lattice: &Lattice, wanted: impl Fn(Node) -> bool) -> Vec<Part> {
    let mut parts: Vec<Part> = Vec::new();
    // The parts that the stretches of the last line belong to.
    let mut last: Vec<usize> = Vec::new();
    for line in lattice.lines().into_iter().step_by(2) {
        let stretches = stretches(lattice, line, &wanted);
        let meets =
            |part: usize, stretch: &Stretch| parts[part].last().is_some_and(|end| overlap(lattice, end, stretch));
        let mut now = Vec::new();
        let mut continued: Vec<Option<usize>> = Vec::new();
        for stretch in &stretches {
            let before: Vec<usize> = last.iter().copied().filter(|part| meets(*part, stretch)).collect();
            let is_alone = |part: usize| stretches.iter().filter(|other| meets(part, other)).count() == 1;
            continued.push(match before.as_slice() {
                [part] if is_alone(*part) => Some(*part),
                _ => None,
            });
        }
        for (stretch, part) in stretches.into_iter().zip(continued) {
            let part = part.unwrap_or_else(|| {
                parts.push(Vec::new());
                parts.len() - 1
            });
            parts[part].push(stretch);
            now.push(part);
        }
        last = now;
    }
    parts
}

/// The stretches of a line that are joined.
fn stretches(lattice: &Lattice, line: Vec<Node>, wanted: impl Fn(Node) -> bool) -> Vec<Stretch> {
    let mut stretches: Vec<Stretch> = Vec::new();
    for node in line.into_iter().filter(|&node| lattice.is_open(node) && wanted(node)) {
        let end = stretches.last_mut();
        match end.filter(|end| end.last().is_some_and(|&last| lattice.around(last).any(|(to, _)| to == node))) {
            Some(end) => end.push(node),
            None => stretches.push(vec![node]),
        }
    }
    stretches
}

/// Whether some place of one stretch lies beside one of another.
fn overlap(lattice: &Lattice, a: &Stretch, b: &Stretch) -> bool {
    let span = |stretch: &Stretch| {
        let along = |node: Option<&Node>| node.map_or(f64::NAN, |&node| lattice.along_legs(lattice.place(node)));
        (along(stretch.first()), along(stretch.last()))
    };
    let (a, b) = (span(a), span(b));
    a.0 <= b.1 + 1e-6 && b.0 <= a.1 + 1e-6
}

/// The places at which a part can be begun: at its first or its last leg, and at either end of that.
const CORNERS: usize = 4;

/// The ends of the legs of a part that is begun at a corner, in alternating direction.
fn ends(part: &Part, corner: usize) -> Vec<Node> {
    let (is_backward, begins_far) = (corner & 1 == 1, corner & 2 == 2);
    let mut legs: Vec<&Stretch> = part.iter().collect();
    if is_backward {
        legs.reverse();
    }
    let mut ends = Vec::new();
    for (leg, stretch) in legs.into_iter().enumerate() {
        let (Some(&near), Some(&far)) = (stretch.first(), stretch.last()) else { continue };
        let (begin, end) = if begins_far ^ (leg % 2 == 1) { (far, near) } else { (near, far) };
        ends.push(begin);
        if end != begin {
            ends.push(end);
        }
    }
    ends
}

/// The order of the parts, each with the corner at which it is begun.
fn order(lattice: &Lattice, from: Node, ways: &[[Vec<Node>; CORNERS]]) -> Vec<(usize, usize)> {
    let corners = || (0..ways.len()).flat_map(|part| (0..CORNERS).map(move |corner| (part, corner)));
    // Metres from an end of a part, or from the vehicle, to each corner of all parts.
    let from_node = |node: Node| -> Vec<f64> {
        let paths = lattice.paths(node);
        corners().map(|(part, corner)| ways[part][corner].first().map_or(f64::INFINITY, |&n| paths.metres[n])).collect()
    };
    let start = from_node(from);
    if ways.len() == 1 {
        let nearest = (0..CORNERS).min_by(|&a, &b| start[a].total_cmp(&start[b]));
        return nearest.map(|corner| (0, corner)).into_iter().collect();
    }
    let after: Vec<Vec<f64>> =
        corners().map(|(part, corner)| ways[part][corner].last().map_or_else(Vec::new, |&n| from_node(n))).collect();
    let order = if ways.len() <= MAX_ORDERED { shortest(&start, &after) } else { nearest_first(&start, &after) };
    order.into_iter().map(|at| (at / CORNERS, at % CORNERS)).collect()
}

/// The order of the corners with the shortest ways in all (Held and Karp, 1962).
fn shortest(start: &[f64], after: &[Vec<f64>]) -> Vec<usize> {
    let corners = start.len();
    let parts = corners / CORNERS;
    // By the set of parts that are done and the last corner: metres so far, and the corner before.
    let mut best = vec![vec![(f64::INFINITY, usize::MAX); corners]; 1 << parts];
    for (at, metres) in start.iter().enumerate() {
        best[1 << (at / CORNERS)][at] = (*metres, usize::MAX);
    }
    for done in 1..1usize << parts {
        for at in (0..corners).filter(|at| done & 1 << (at / CORNERS) != 0) {
            let so_far = best[done][at].0;
            for to in (0..corners).filter(|to| done & 1 << (to / CORNERS) == 0) {
                let next = &mut best[done | 1 << (to / CORNERS)][to];
                if so_far + after[at][to] + 1e-6 < next.0 {
                    *next = (so_far + after[at][to], at);
                }
            }
        }
    }
    let mut done = (1 << parts) - 1;
    let mut at = (0..corners).min_by(|&a, &b| best[done][a].0.total_cmp(&best[done][b].0)).unwrap_or(0);
    let mut order = vec![at; parts];
    for place in order.iter_mut().rev() {
        *place = at;
        let before = best[done][at].1;
        done &= !(1 << (at / CORNERS));
        at = if before == usize::MAX { 0 } else { before };
    }
    order
}

/// Always the nearest corner of a part that is not done.
fn nearest_first(start: &[f64], after: &[Vec<f64>]) -> Vec<usize> {
    let mut order: Vec<usize> = Vec::new();
    for _ in 0..start.len() / CORNERS {
        let metres = order.last().map_or(start, |&at| after[at].as_slice());
        let is_left = |at: &usize| order.iter().all(|done| done / CORNERS != at / CORNERS);
        order.extend((0..start.len()).filter(is_left).min_by(|&a, &b| metres[a].total_cmp(&metres[b])));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::super::{Bounds, distance};
    use super::*;
    use scenecast_core::Area;
    use scenecast_protocol::coordinates::DecimetrePoint;
    use scenecast_protocol::directive::{Fence, Polygon};

    const AREA: Area = Area { west: 0.0, south: 0.0, east: 60.0, north: 40.0 };
    const STEP_M: f64 = 1.0;

    fn outline(corners: &[(i32, i32)]) -> Polygon {
        Polygon(corners.iter().map(|&(x, y)| DecimetrePoint::new(10 * x, 10 * y)).collect())
    }

    /// The legs over what a fence and areas to stay out of leave of an area, and what is seen and flown along them.
    struct Pass {
        metres: f64,
        /// The metres of the legs alone.
        of_legs_m: f64,
        /// Open places of the legs that no path comes by.
        missed: usize,
    }

    fn pass(fence: Option<&[(i32, i32)]>, keep_outs: &[&[(i32, i32)]], start: (f64, f64)) -> Pass {
        let keep_outs = keep_outs.iter().map(|corners| outline(corners)).collect();
        let bounds = Bounds::new(&Fence { fence: fence.map(outline), keep_outs, return_point: None }, 0.5);
        let lattice = Lattice::with_legs(false, AREA, &[], STEP_M, &bounds);
        let from = lattice.entry(start, &bounds).unwrap();
        let legs = legs(&lattice, from, |_| true);
        let mut places = vec![legs[0]];
        for to in &legs[1..] {
            places.extend(lattice.paths(places[places.len() - 1]).to(*to));
        }
        let lines: Vec<Node> =
            lattice.lines().into_iter().step_by(2).flatten().filter(|&n| lattice.is_open(n)).collect();
        let of_legs_m = parts(&lattice, |_| true)
            .into_iter()
            .flatten()
            .map(|stretch| distance(lattice.place(stretch[0]), lattice.place(stretch[stretch.len() - 1])));
        Pass {
            metres: length_m(&lattice, &legs),
            of_legs_m: of_legs_m.sum(),
            missed: lines.iter().filter(|node| !places.contains(node)).count(),
        }
    }

    #[test]
    fn a_whole_area_is_one_part_from_its_nearest_corner() {
        for start in [(0.0, 0.0), (60.0, 0.0), (0.0, 40.0), (60.0, 40.0)] {
            let pass = pass(None, &[], start);
            assert_eq!(pass.missed, 0);
            assert!((pass.metres - (21.0 * 60.0 + 40.0)).abs() < 1e-6, "{}", pass.metres);
        }
    }

    #[test]
    fn no_leg_goes_around_a_bay_or_an_area_to_stay_out_of() {
        let u: &[(i32, i32)] = &[(0, 0), (60, 0), (60, 40), (40, 40), (40, 10), (20, 10), (20, 40), (0, 40)];
        let l: &[(i32, i32)] = &[(0, 0), (60, 0), (60, 15), (25, 15), (25, 40), (0, 40)];
        let rock: &[(i32, i32)] = &[(25, 12), (38, 14), (36, 30), (24, 28)];
        let reef: &[(i32, i32)] = &[(8, 5), (16, 5), (12, 20)];
        for (fence, keep_outs) in
            [(Some(u), vec![]), (Some(l), vec![]), (None, vec![rock]), (None, vec![rock, reef]), (Some(u), vec![reef])]
        {
            for start in [(2.0, 2.0), (55.0, 5.0), (10.0, 35.0)] {
                let pass = pass(fence, &keep_outs, start);
                assert_eq!(pass.missed, 0, "{fence:?} {keep_outs:?}");
                // From one leg to the next it is two steps; between two parts it may be the length or the width of the area.
                let ways_m = pass.metres - pass.of_legs_m;
                assert!(ways_m < 200.0, "{ways_m} m beside legs of {} m: {fence:?} {keep_outs:?}", pass.of_legs_m);
            }
        }
    }

    #[test]
    fn many_parts_are_visited_too() {
        let rocks: Vec<Vec<(i32, i32)>> = (0..12)
            .map(|i| (4 + 14 * (i % 4), 4 + 12 * (i / 4)))
            .map(|(x, y)| vec![(x, y), (x + 5, y), (x + 5, y + 5), (x, y + 5)])
            .collect();
        let rocks: Vec<&[(i32, i32)]> = rocks.iter().map(Vec::as_slice).collect();
        let pass = pass(None, &rocks, (0.0, 0.0));
        assert_eq!(pass.missed, 0);
        assert!(pass.metres < 1.3 * pass.of_legs_m, "{} of {}", pass.metres, pass.of_legs_m);
    }
}

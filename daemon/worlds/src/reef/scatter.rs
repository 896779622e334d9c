//! Where things are: jittered lattices of several spacings, thinned by habitat.

use super::fields::{Colour, blend, place_number, scale};
use super::ground::Ground;
use super::layout::{Habitat, Layout, Region};
use super::things::{Form, Thing};
use scene_model::random::{CounterRng, derive, mix};

/// The things of one lattice: its spacing, and their median and largest radius, metres.
struct Sizes {
    spacing_m: f32,
    median_m: f32,
    largest_m: f32,
    stream: u64,
}

const HEADS: [Sizes; 4] = [
    Sizes { spacing_m: 2.3, median_m: 0.52, largest_m: 1.15, stream: 10 },
    Sizes { spacing_m: 0.85, median_m: 0.24, largest_m: 0.50, stream: 11 },
    Sizes { spacing_m: 0.36, median_m: 0.085, largest_m: 0.20, stream: 12 },
    Sizes { spacing_m: 0.15, median_m: 0.036, largest_m: 0.08, stream: 13 },
];
const DEBRIS: Sizes = Sizes { spacing_m: 0.062, median_m: 0.011, largest_m: 0.024, stream: 20 };
const SIGNS: Sizes = Sizes { spacing_m: 1.7, median_m: 0.24, largest_m: 0.5, stream: 21 };

/// Edge of the squares within which the places of a dense lattice share their habitat.
const SHARED_M: f32 = 0.3;

/// Living corals are brown, tan, olive or grey, and nearly as one.
const LIVE_TONES: [Colour; 10] = [
    [0.205, 0.175, 0.105],
    [0.175, 0.155, 0.095],
    [0.265, 0.235, 0.155],
    [0.160, 0.155, 0.095],
    [0.225, 0.210, 0.170],
    [0.170, 0.135, 0.095],
    [0.285, 0.260, 0.170],
    [0.310, 0.290, 0.240],
    [0.185, 0.178, 0.176],
    [0.140, 0.110, 0.075],
];

/// Chooses the thing of a lattice's place, given the habitat, the clustering and the index of the lattice.
type Chooser = fn(&Habitat, f32, &mut CounterRng, usize) -> Option<Choice>;

/// Calls `found` for each head or boulder that may cover a part of the region.
pub(super) fn large_things(key: u64, layout: &Layout, ground: &Ground, region: &Region, found: &mut dyn FnMut(&Thing)) {
    for (size, sizes) in HEADS.iter().enumerate() {
        scatter(sizes, [key, size as u64], (layout, ground), region, (head, 1.6), found);
    }
}

/// Calls `found` for each stick, shell or pit that may cover a part of the region.
pub(super) fn small_things(key: u64, layout: &Layout, ground: &Ground, region: &Region, found: &mut dyn FnMut(&Thing)) {
    // Sticks are up to six times as long as wide.
    scatter(&DEBRIS, [key, 0], (layout, ground), region, (debris, 6.0), found);
    scatter(&SIGNS, [key, 0], (layout, ground), region, (sign, 1.6), found);
}

/// Visits the places of a lattice. `chooser` comes with the largest aspect of its things.
fn scatter(
    sizes: &Sizes,
    [key, size]: [u64; 2],
    (layout, ground): (&Layout, &Ground),
    region: &Region,
    (chooser, aspect): (Chooser, f32),
    found: &mut dyn FnMut(&Thing),
) {
    let spacing_m = sizes.spacing_m;
    // Neighbouring places of a dense lattice share their habitat.
    let block = ((SHARED_M / spacing_m) as i32).max(1);
    let lattice = JitteredLattice { spacing_m, block, stream: derive(key, sizes.stream) };
    let reach_m = aspect * 1.3 * sizes.largest_m;
    lattice.visit(
        layout,
        (region, reach_m),
        |_| true,
        |mut place| {
            let (x, y) = (place.x, place.y);
            let cluster = ground.noise.value(x / (3.1 * spacing_m) + 7.0, y / (3.1 * spacing_m));
            if let Some(choice) = chooser(&place.habitat, cluster, &mut place.rng, size as usize) {
                let mut thing = grown(&choice, sizes, &mut place);
                if !thing.follows_floor() {
                    let floor = ground.spot(x, y, &place.habitat, &ground.slow(x, y));
                    thing.base_m = floor.height_m - 0.05 * thing.radius_m;
                }
                found(&thing);
            }
        },
    );
}

struct Choice {
    form: Form,
    tone: Colour,
    aspect: f32,
}

/// The thing of a choice, with a size from a log-normal distribution.
fn grown(choice: &Choice, sizes: &Sizes, place: &mut Place) -> Thing {
    let Place { x, y, habitat, rng } = place;
    // The sum of three uniform values is nearly normal; its standard deviation is a half.
    let spread = (rng.unit() + rng.unit() + rng.unit() - 1.5) as f32;
    let grow = 1.0 + spread * (0.9 + spread * (0.45 + 0.15 * spread));
    let radius_m = (sizes.median_m * grow.max(0.35)).min(sizes.largest_m);
    let angle = std::f64::consts::TAU * rng.unit();
    let (sin, cos) = angle.sin_cos();
    let key = rng.next_u64();
    let tint = (0.74 + 0.58 * rng.unit()) as f32;
    // Silt, turf and the algae inside corals give nearly the same hue to all of them.
    let grey = (choice.tone[0] + choice.tone[1] + choice.tone[2]) / 3.0;
    let tone = blend(choice.tone, scale([1.22, 1.03, 0.68], grey), 0.35 + 0.50 * rng.unit() as f32);
    Thing {
        x: *x,
        y: *y,
        radius_m,
        base_m: habitat.lump_m - 0.02,
        form: choice.form,
        tone: scale(tone, tint),
        turn: [cos as f32, sin as f32],
        aspect: choice.aspect,
        key,
    }
}

/// A coral head or a boulder.
fn head(habitat: &Habitat, cluster: f32, rng: &mut CounterRng, size: usize) -> Option<Choice> {
    let chance = rng.unit() as f32;
    let garden = (habitat.reef - habitat.thicket - habitat.rock).max(0.0);
    let dense = [0.95, 1.2, 0.8, 0.4][size] * (0.25 + 1.5 * cluster);
    let stony = [0.75, 0.7, 0.4, 0.2][size];
    let thick = [1.0, 1.0, 0.5, 0.2][size];
    let stray = [0.012, 0.02, 0.012, 0.01][size] * (1.0 - habitat.grass) * (1.0 - habitat.channel);
    let tone = LIVE_TONES[rng.below(LIVE_TONES.len())];
    let kind = rng.unit();
    let plain = |form| Some(Choice { form, tone, aspect: 1.0 + 0.5 * kind as f32 });
    if chance < habitat.thicket * thick {
        let pale = [[0.27, 0.225, 0.13], [0.235, 0.20, 0.14], [0.22, 0.205, 0.11]][(key_of(kind) % 3) as usize];
        return Some(Choice {
            form: if size < 2 { Form::Staghorn } else { Form::Branching },
            tone: pale,
            aspect: 1.25,
        });
    }
    if chance < habitat.rock * stony {
        if kind < 0.82 {
            return Some(Choice { form: Form::Boulder, tone: [0.165, 0.145, 0.100], aspect: 1.3 });
        }
        return plain(if kind < 0.92 { Form::Soft } else { Form::Crust });
    }
    if chance < garden * dense {
        return plain(garden_form(size, kind));
    }
    let near = 0.10 * habitat.rubble * (1.0 - size as f32 * 0.1) * cluster;
    if chance > 1.0 - stray - near {
        return plain(if kind < 0.4 {
            Form::Massive
        } else if kind < 0.7 {
            Form::Brain
        } else {
            Form::Branching
        });
    }
    None
}

fn key_of(kind: f64) -> u64 {
    (kind * 997.0) as u64
}

fn garden_form(size: usize, kind: f64) -> Form {
    let bounds: [(f64, Form); 6] = match size {
        0 => [
            (0.26, Form::Massive),
            (0.40, Form::Brain),
            (0.52, Form::Plate),
            (0.85, Form::Branching),
            (0.89, Form::Soft),
            (1.1, Form::Crust),
        ],
        1 => [
            (0.18, Form::Massive),
            (0.30, Form::Brain),
            (0.38, Form::Plate),
            (0.74, Form::Branching),
            (0.78, Form::Soft),
            (1.1, Form::Crust),
        ],
        2 => [
            (0.14, Form::Massive),
            (0.20, Form::Brain),
            (0.24, Form::Plate),
            (0.66, Form::Branching),
            (0.72, Form::Soft),
            (1.1, Form::Crust),
        ],
        _ => [
            (0.25, Form::Massive),
            (0.25, Form::Brain),
            (0.25, Form::Plate),
            (0.60, Form::Branching),
            (0.93, Form::Crust),
            (1.1, Form::Urchin),
        ],
    };
    bounds.iter().find(|bound| kind < bound.0).map_or(Form::Massive, |bound| bound.1)
}

/// Sticks of dead coral, and shells.
fn debris(habitat: &Habitat, cluster: f32, rng: &mut CounterRng, _: usize) -> Option<Choice> {
    let chance = rng.unit() as f32;
    let kind = rng.unit();
    let sticks = habitat.rubble * (0.35 + 0.9 * cluster) + 0.10 * habitat.reef * cluster + 0.003;
    if chance < sticks {
        let tone = match kind {
            k if k < 0.5 => [0.29, 0.265, 0.21],
            k if k < 0.75 => [0.20, 0.18, 0.13],
            k if k < 0.9 => [0.26, 0.195, 0.19],
            _ => [0.42, 0.40, 0.34],
        };
        return Some(Choice { form: Form::Stick, tone, aspect: (1.2 + 4.5 * rng.unit()) as f32 });
    }
    let shells = 0.010 * (1.0 - habitat.reef) * (1.0 - habitat.grass);
    (chance > 1.0 - shells).then_some(Choice { form: Form::Shell, tone: [0.50, 0.47, 0.41], aspect: 1.4 })
}

/// Signs of animals on sand.
fn sign(habitat: &Habitat, cluster: f32, rng: &mut CounterRng, _: usize) -> Option<Choice> {
    let bare = (1.0 - habitat.reef - habitat.rubble - habitat.grass).max(0.0);
    let chance = rng.unit() as f32;
    (chance < 0.10 * bare * cluster).then_some(Choice { form: Form::Pit, tone: [0.36, 0.33, 0.26], aspect: 1.25 })
}

/// A lattice with one place at random in each of its squares.
pub(super) struct JitteredLattice {
    /// Edge of a square, metres.
    pub spacing_m: f32,
    /// Squares along the edge of a block; the places of a block share their habitat.
    pub block: i32,
    /// The key of the places' random numbers.
    pub stream: u64,
}

/// A place of a lattice.
pub(super) struct Place {
    /// Metres east, and `y` metres north.
    pub x: f32,
    pub y: f32,
    pub habitat: Habitat,
    pub rng: CounterRng,
}

impl JitteredLattice {
    /// Visits the places of the habitats that `wanted` accepts, up to `reach_m` outside of the region.
    pub(super) fn visit(
        &self,
        layout: &Layout,
        (region, reach_m): (&Region, f32),
        wanted: impl Fn(&Habitat) -> bool,
        mut found: impl FnMut(Place),
    ) {
        let first = |low: f32| ((low - reach_m) / self.spacing_m).floor() as i32;
        let last = |high: f32| ((high + reach_m) / self.spacing_m).ceil() as i32;
        let middle = |block: i32| (block as f32 + 0.5) * self.block as f32 * self.spacing_m;
        for row in first(region.south)..last(region.north) {
            let mut shared = None;
            for column in first(region.west)..last(region.east) {
                let block = column.div_euclid(self.block);
                let habitat = match shared {
                    Some((at, habitat)) if at == block => habitat,
                    _ => layout.at(middle(block), middle(row.div_euclid(self.block))),
                };
                shared = Some((block, habitat));
                if wanted(&habitat) {
                    let mut rng = CounterRng::new(self.stream ^ mix(place_number(column, row)));
                    let x = (column as f32 + rng.unit() as f32) * self.spacing_m;
                    let y = (row as f32 + rng.unit() as f32) * self.spacing_m;
                    found(Place { x, y, habitat, rng });
                }
            }
        }
    }
}

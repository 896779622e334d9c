//! The description of every key: type, default, bounds, unit, readers and meaning.
//!
//! The structs, `scenecast config`, the files in `config/`, the reference in `docs/` and the JSON Schema are made from
//! these tables.

pub(crate) mod key;
mod map;
mod modem;
mod node;
mod survey;

pub use map::{Bands, Camera, Labels, Map, Scene};
pub use modem::{Channel, Link, Modem};
pub use node::{Console, Mission, Operator, Record, Ros2, Runtime, SurfaceSection, VehicleSection, WorldSection};
pub use survey::{Autopilot, Navigation, Position, Registration, Survey};

use key::Section;

/// The settings of a process, by section; the default is that of the files in `config/`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Config {
    pub mission: Mission,
    pub vehicle: VehicleSection,
    pub surface: SurfaceSection,
    pub link: Link,
    pub modem: Modem,
    pub channel: Channel,
    pub map: Map,
    pub camera: Camera,
    pub scene: Scene,
    pub labels: Labels,
    pub bands: Bands,
    pub survey: Survey,
    pub navigation: Navigation,
    pub registration: Registration,
    pub autopilot: Autopilot,
    pub position: Position,
    pub world: WorldSection,
    pub operator: Operator,
    pub console: Console,
    pub ros2: Ros2,
    pub record: Record,
    pub runtime: Runtime,
}

impl Section {
    /// Every section, in the order of the files.
    pub const ALL: &'static [Self] = &[
        Mission::SECTION,
        VehicleSection::SECTION,
        SurfaceSection::SECTION,
        Link::SECTION,
        Modem::SECTION,
        Channel::SECTION,
        Map::SECTION,
        Camera::SECTION,
        Scene::SECTION,
        Labels::SECTION,
        Bands::SECTION,
        Survey::SECTION,
        Navigation::SECTION,
        Registration::SECTION,
        Autopilot::SECTION,
        Position::SECTION,
        WorldSection::SECTION,
        Operator::SECTION,
        Console::SECTION,
        Ros2::SECTION,
        Record::SECTION,
        Runtime::SECTION,
    ];
}

//! The commands of offline work.

mod map;
mod scene;
mod tune;
mod vocabulary;
mod wire;

pub use map::Map;
pub use scene::Scene;
pub use tune::Tune;
pub use vocabulary::Vocabulary;
pub use wire::Wire;

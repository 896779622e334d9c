//! Quality of service of the topics.

/// The quality of service of a topic, by its use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Qos {
    /// Sensors: best effort, with this depth. It matches every publisher.
    Sensor(usize),
    /// States and orders: reliable, not kept for later subscribers, with this depth.
    Reliable(usize),
    /// Latched: reliable, and the last ones are kept for later subscribers, with this depth.
    Latched(usize),
}

//! The faults of a vehicle's equipment.

/// The equipment of the vehicle that fails at the time of the pose of the same frame.
///
/// ```text
/// bit  field               1 means
///  0   camera silent       no image comes in: the camera is lost or stalled
///  1   images dropped      an image that could not be used was dropped within the last 10 s
///  2   poses missing       no pose comes in from the navigation source, so the vehicle holds its position
///  3   poses faulty        within the last 10 s, the navigation source gave a pose that could not be used
///  4   autopilot refuses   it answers and does not follow: it is disarmed, in a mode of the pilot's, or has another target
///  5   labels refused      within the last 10 s, an input of labels or bands was refused; or the folder of a source is
///                          missing, or its topic cannot be opened
///  6   images unusable     images come in, and for 10 s or more none of them could be mapped
///  7   depth missing       within the last 10 s, an image had no distances that could be used, where they are configured
/// ```
///
/// Source: vehicle, among the [`super::PoseDetails`], while there is a fault. The first bit is the highest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EquipmentFaults {
    /// No image comes in: the camera is lost or stalled.
    pub camera_silent: bool,
    /// An image that could not be used was dropped within the last 10 s.
    pub images_dropped: bool,
    /// No pose comes in from the navigation source.
    pub poses_missing: bool,
    /// Within the last 10 s, the navigation source gave a pose that could not be used.
    pub poses_faulty: bool,
    /// The autopilot answers and does not follow the vehicle's waypoints.
    pub autopilot_refuses: bool,
    /// Within the last 10 s, an input of labels or bands was refused; or the folder of a source is missing, or its topic
    /// cannot be opened.
    pub labels_refused: bool,
    /// Images come in, and for 10 s or more none of them could be mapped.
    pub images_unusable: bool,
    /// Within the last 10 s, an image had no distances that could be used, where they are configured.
    pub depth_missing: bool,
}

impl EquipmentFaults {
    /// Bytes on the wire: one bit for each fault.
    pub const BYTES: usize = 1;

    /// Whether there is a fault.
    pub fn is_any(self) -> bool {
        self != Self::default()
    }

    /// The faults for people, the gravest first, and whether the survey does not proceed with it as planned.
    pub fn iter(self) -> impl Iterator<Item = (&'static str, bool)> {
        [
            (self.autopilot_refuses, "the autopilot does not follow", true),
            (self.poses_missing, "no pose comes in", true),
            (self.camera_silent, "no image comes in", true),
            (self.images_unusable, "no image can be used", true),
            (self.poses_faulty, "poses cannot be used", false),
            (self.images_dropped, "images are dropped", false),
            (self.depth_missing, "distances are missing or cannot be used", false),
            (self.labels_refused, "labels or bands of other programs are refused or missing", false),
        ]
        .into_iter()
        .filter_map(|(is_set, text, is_grave)| is_set.then_some((text, is_grave)))
    }

    /// Only the faults with which the survey does not proceed as planned.
    #[must_use]
    pub fn grave(self) -> Self {
        Self { images_dropped: false, poses_faulty: false, labels_refused: false, depth_missing: false, ..self }
    }

    /// The byte on the wire.
    pub fn encode(self) -> [u8; Self::BYTES] {
        let bits = [
            self.camera_silent,
            self.images_dropped,
            self.poses_missing,
            self.poses_faulty,
            self.autopilot_refuses,
            self.labels_refused,
            self.images_unusable,
            self.depth_missing,
        ];
        [bits.iter().fold(0, |byte, bit| byte << 1 | u8::from(*bit))]
    }

    /// Reads the byte of the wire.
    pub fn decode(byte: u8) -> Self {
        let bit = |index: u8| byte & 0x80 >> index != 0;
        Self {
            camera_silent: bit(0),
            images_dropped: bit(1),
            poses_missing: bit(2),
            poses_faulty: bit(3),
            autopilot_refuses: bit(4),
            labels_refused: bit(5),
            images_unusable: bit(6),
            depth_missing: bit(7),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes_of_faults() {
        let faults = EquipmentFaults { camera_silent: true, autopilot_refuses: true, ..EquipmentFaults::default() };
        assert_eq!(faults.encode(), [0b1000_1000]);
        assert_eq!(EquipmentFaults::decode(0b1000_1000), faults);
        let minor = EquipmentFaults {
            images_dropped: true,
            poses_faulty: true,
            labels_refused: true,
            depth_missing: true,
            ..faults
        };
        assert_eq!(minor.grave(), faults);
        assert!(
            faults.iter().all(|(_, is_grave)| is_grave) && minor.iter().filter(|(_, is_grave)| !is_grave).count() == 4
        );
        assert!(faults.is_any() && !EquipmentFaults::default().is_any());
    }

    #[test]
    fn each_byte_is_read_back() {
        for byte in 0..=255_u8 {
            let faults = EquipmentFaults::decode(byte);
            assert_eq!((faults.encode(), faults.iter().count() as u32), ([byte], byte.count_ones()));
        }
    }
}

//! Counters of a live camera: what was mapped, and why the rest was not.

use std::collections::BTreeMap;
use std::fmt;

/// Why an image was not mapped, or an irregularity of a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CameraFault {
    /// The image has no time stamp, and its source should give one.
    NoStamp,
    /// The image is not later than the one before.
    NotLater,
    /// No pose is known at the time of the image.
    NoPose,
    /// The camera was tilted too much.
    Tilted,
    /// The vehicle came up, and the camera lost sight of the sea floor.
    ComingUp,
    /// A newer image came before the scene model was ready for this one.
    Overtaken,
    /// The bytes are not an image that can be read.
    Unreadable,
    /// The file or the stream ended within the image.
    CutOff,
    /// The pixels have an encoding that is not supported.
    Encoding,
    /// There is no calibration, where one is needed.
    Calibration,
    /// A message with a calibration cannot be used.
    BadCalibration,
    /// No distances were measured at the time of the image, which is mapped on a flat floor.
    NoDepth,
    /// A measurement of distances cannot be used.
    UnusableDepth,
    /// The source of the distances was lost, and was opened again.
    DepthLost,
    /// No distances came in for longer than allowed.
    DepthStalled,
    /// The clock of the camera's stamps went back.
    CameraClockJump,
    /// The clock of the poses went back.
    PoseClockJump,
    /// Two poses are too far apart in time for an image between them.
    PoseGap,
    /// The source ended or was lost, and was opened again.
    SourceLost,
    /// The source sent no image for longer than allowed.
    Stalled,
    /// A pose cannot be used.
    UnusablePose,
    /// The source of the poses was lost, and was opened again.
    PosesLost,
    /// No pose came in for longer than allowed.
    PosesStalled,
    /// A message of the source of the poses could not be read.
    PosesUnreadable,
    /// The source of the poses says that its pose is not valid.
    PoseRefused,
    /// The velocity log does not see the sea floor, so that its dead reckoning drifts.
    NoBottomLock,
    /// The dead reckoning of the source began anew, and its track continues at the last pose.
    DeadReckoningReset,
    /// A place, a heading, a depth or a height above the sea floor of the source was one that no vehicle can reach so fast.
    PoseJump,
}

impl CameraFault {
    /// Name for people and in metrics.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoStamp => "without a time stamp",
            Self::NotLater => "not later than the one before",
            Self::NoPose => "no pose at its time",
            Self::Tilted => "tilted too much",
            Self::ComingUp => "taken while the vehicle came up",
            Self::Overtaken => "overtaken by a newer one",
            Self::Unreadable => "unreadable",
            Self::CutOff => "cut off",
            Self::Encoding => "unknown encoding",
            Self::Calibration => "without a calibration",
            Self::BadCalibration => "unusable calibration",
            Self::NoDepth => "no depth at its time",
            Self::UnusableDepth => "unusable depth",
            Self::DepthLost => "depth lost",
            Self::DepthStalled => "depth stalled",
            Self::CameraClockJump => "camera clock went back",
            Self::PoseClockJump => "pose clock went back",
            Self::PoseGap => "gap between poses",
            Self::SourceLost => "source lost",
            Self::Stalled => "camera stalled",
            Self::UnusablePose => "unusable pose",
            Self::PosesLost => "poses lost",
            Self::PosesStalled => "poses stalled",
            Self::PosesUnreadable => "unreadable message about the pose",
            Self::PoseRefused => "pose not valid",
            Self::NoBottomLock => "no bottom lock",
            Self::DeadReckoningReset => "dead reckoning began anew",
            Self::PoseJump => "pose that jumps",
        }
    }

    /// Whether it is the source of the poses that has failed, and not the camera.
    pub fn is_of_navigation(self) -> bool {
        matches!(
            self,
            Self::PoseClockJump
                | Self::UnusablePose
                | Self::PosesLost
                | Self::PosesStalled
                | Self::PosesUnreadable
                | Self::PoseRefused
                | Self::NoBottomLock
                | Self::DeadReckoningReset
                | Self::PoseJump
        )
    }

    /// Whether each count is an image that was not mapped.
    pub fn is_dropped_image(self) -> bool {
        matches!(
            self,
            Self::NoStamp
                | Self::NotLater
                | Self::NoPose
                | Self::Tilted
                | Self::ComingUp
                | Self::Overtaken
                | Self::Unreadable
                | Self::CutOff
                | Self::Encoding
                | Self::Calibration
        )
    }
}

/// The number of images that were mapped, and of each fault.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CameraTally {
    /// Images that were given to the scene model.
    pub matched: u64,
    faults: BTreeMap<CameraFault, u64>,
}

impl CameraTally {
    pub fn count(&mut self, fault: CameraFault) {
        *self.faults.entry(fault).or_default() += 1;
    }

    pub fn of(&self, fault: CameraFault) -> u64 {
        self.faults.get(&fault).copied().unwrap_or(0)
    }

    /// Images that were not mapped.
    pub fn dropped(&self) -> u64 {
        self.faults.iter().filter(|(fault, _)| fault.is_dropped_image()).map(|(_, n)| n).sum()
    }

    pub fn iter(&self) -> impl Iterator<Item = (CameraFault, u64)> + '_ {
        self.faults.iter().map(|(&fault, &n)| (fault, n))
    }
}

impl fmt::Display for CameraTally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = |is_image: bool| {
            let of_kind = self.iter().filter(|(fault, _)| fault.is_dropped_image() == is_image);
            of_kind.map(|(fault, n)| format!("{} {n}", fault.name())).collect::<Vec<_>>().join(", ")
        };
        let (dropped, others) = (counts(true), counts(false));
        write!(f, "{} images mapped, {} dropped", self.matched, self.dropped())?;
        if !dropped.is_empty() {
            write!(f, " ({dropped})")?;
        }
        if !others.is_empty() {
            write!(f, "; beside these: {others}")?;
        }
        Ok(())
    }
}

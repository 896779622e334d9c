//! The labels of a map and their exemplars.

use crate::record::StoredLabel;
use scenecast_protocol::map::LabelTree;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A label on the map.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct MapLabel {
    /// The number of the label.
    #[schemars(range(min = 1, max = 254))]
    pub id: u8,
    /// The number of its cells.
    pub cells: u32,
    /// The area of its cells, square metres.
    pub area_m2: f64,
    /// The area that it has gained in the last five minutes, or since the surface began to count, square metres. What other
    /// labels took from it is negative.
    #[serde(default)]
    pub gained_m2: f64,
    /// The last weight sent, -1 to 1.
    pub weight: f64,
    /// The exemplars of the label, and the request for another.
    pub exemplar: ExemplarProgress,
    /// What the operator says of it.
    #[serde(flatten)]
    pub book: StoredLabel,
}

/// Which labels become one at coarser cuts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MapLabelTree {
    /// Merges, the closest first: the second label of each pair joins the first, which stands for both from then on. The first
    /// `merges - k + 1` of them make the cut at k labels.
    pub merges: Vec<(u8, u8)>,
    /// The number of labels at the cut at which they differ most clearly; null if that is the finest one.
    pub clearest: Option<u8>,
}

impl MapLabelTree {
    /// The tree of a vehicle, as the API has it.
    pub fn of(tree: &LabelTree) -> Self {
        Self { merges: tree.merges().to_vec(), clearest: tree.clearest() }
    }

    /// The same tree; `None` if it is none.
    pub fn tree(&self) -> Option<LabelTree> {
        LabelTree::new(self.merges.clone(), self.clearest)
    }
}

/// The exemplars of a label, and the request for another one.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ExemplarProgress {
    /// The stage of the request; without a request, whether there is an image.
    pub state: ExemplarStage,
    /// The received part of the requested image, 0 to 1.
    pub progress: f64,
    /// Bytes of the image that is being received, or else of the latest one.
    pub bytes: Option<usize>,
    /// The address of the latest image.
    pub url: Option<String>,
    /// Mission time of the last change of `state`, seconds.
    pub at_s: Option<f64>,
    /// The received images, the latest one last; at most 8.
    pub images: Vec<ExemplarImage>,
}

/// A received image of a label.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ExemplarImage {
    /// The number of the image among those of the label.
    #[schemars(range(min = 1, max = 63))]
    pub number: u8,
    /// Width and height of the image, pixels.
    pub edge_px: u32,
    /// Whether a larger version can be requested.
    pub can_enlarge: bool,
    /// Bytes sent over the link.
    pub bytes: usize,
    /// Path of the image on this server.
    pub url: String,
    /// Mission time of its arrival, seconds.
    pub at_s: f64,
    /// Mission time at which it was taken, seconds; null where it is not known.
    #[serde(default)]
    pub taken_s: Option<f64>,
    /// How wide it is on the sea floor, metres; null where it is not known.
    #[serde(default)]
    pub width_m: Option<f64>,
    /// Its middle in the world frame, metres east of the origin; null where it is not known.
    #[serde(default)]
    pub x_m: Option<f64>,
    /// Its middle in the world frame, metres north of the origin; null where it is not known.
    #[serde(default)]
    pub y_m: Option<f64>,
    /// Whether it was requested; otherwise the vehicle sent it with spare capacity.
    pub requested: bool,
}

/// The stage of a request for an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExemplarStage {
    /// There is no request and no image.
    #[default]
    None,
    /// The request waits for its turn.
    Queued,
    /// The request was sent and is not yet acknowledged.
    OnAir,
    /// The vehicle has no such image yet and sends it once it has one.
    NotAvailable,
    /// A part of the image has been received.
    Receiving,
    /// The image has been received.
    Received,
    /// The vehicle refused the request.
    Refused,
}

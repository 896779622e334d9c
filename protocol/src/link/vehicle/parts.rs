//! The parts of the vehicle's content: a layer on its way, and what a frame has carried.

use super::in_force::SentPart;
use crate::map::{LayerCarried, LayerId, LayerSource};
use crate::object::{ObjectId, SymbolRun};
use crate::schedule::Class;
use std::ops::Range;

/// A chunk of a frame, with the data that the sender needs once its fate is known.
#[derive(Debug)]
pub(super) enum Part<C> {
    Map(C),
    /// A label and bytes of its name and colour.
    LabelClass((u8, usize)),
    /// A version of the tree of labels and bytes of it.
    LabelTree((u32, usize)),
    Layer(LayerId, LayerCarried),
    LayerDigest(LayerId),
    Object(ObjectId, SymbolRun),
    Pose,
    /// A report that tells of these slots.
    Report(Range<usize>),
    InForce(SentPart),
    Caller,
}

impl<C> Part<C> {
    pub(super) fn class(&self) -> Class {
        match self {
            Self::Map(_) | Self::LabelClass(_) | Self::LabelTree(_) => Class::Map,
            Self::Layer(id, _) | Self::LayerDigest(id) => Class::Layer(*id),
            Self::Object(..) => Class::Exemplar,
            Self::Pose | Self::Report(_) | Self::InForce(_) | Self::Caller => Class::Status,
        }
    }
}

/// The chunks of a frame, each with the bytes of its payload.
pub(super) type Carried<C> = Vec<(Part<C>, usize)>;

/// A layer that the link replicates.
#[derive(Debug)]
pub(super) struct LayerOut {
    pub(super) source: LayerSource,
    /// Whether its digest is due.
    pub(super) owes_digest: bool,
    /// Whether it is sent at all; another one rests with the levels that the surface has of it.
    pub(super) is_selected: bool,
}

impl LayerOut {
    /// A layer without a share is sent with spare capacity only.
    pub(super) fn has_share(&self) -> bool {
        self.source.descriptor().share > 0
    }

    pub(super) fn is_shared(&self) -> bool {
        self.is_selected && self.has_share()
    }
}

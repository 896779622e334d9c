//! Planes of the map: what of them goes into a frame, and when they are worth a turn.

use super::content::{Carried, Part, VehicleContent};
use crate::map::{Cell, PlaneKind, PlaneSource, StateSource};
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::{ChunkKind, FrameBuilder, room_for_payload};

/// A plane that the link replicates.
#[derive(Debug)]
pub(super) struct PlaneOut {
    pub(super) source: PlaneSource,
    /// Whether it has a share; one without takes what nobody else needs.
    pub(super) has_share: bool,
    /// Whether its digest is to be told.
    pub(super) owes_digest: bool,
    /// Whether it is told at all; one that is not rests with what the surface has of it.
    pub(super) is_told: bool,
}

impl PlaneOut {
    pub(super) fn class(&self) -> Class {
        self.source.scale().kind().into()
    }
}

impl<S: StateSource> VehicleContent<S> {
    /// Replicates these planes beside the state, each with its part of the map's share in percent.
    pub(super) fn set_planes(&mut self, planes: impl IntoIterator<Item = (PlaneSource, u8)>) {
        let mut shares = [0; Class::PLANES.len()];
        self.planes.clear();
        for (source, share) in planes {
            let plane = PlaneOut { source, has_share: share > 0, owes_digest: false, is_told: true };
            Class::PLANES.iter().zip(&mut shares).filter(|(c, _)| **c == plane.class()).for_each(|(_, s)| *s = share);
            self.planes.push(plane);
        }
        self.shares.set_planes(shares);
    }

    /// The planes that are told: those that have a share or a place in the spending of left-over bits.
    pub(super) fn planes(&self) -> impl Iterator<Item = &PlaneSource> {
        let has_bits = |p: &&PlaneOut| p.has_share || self.spend.iter().any(|extra| extra.class() == p.class());
        self.planes.iter().filter(|p| p.is_told).filter(has_bits).map(|p| &p.source)
    }

    /// Which of the planes are told from now on; the others rest, and go on from there when they are told again.
    pub(super) fn set_told_planes(&mut self, is_told: impl Fn(PlaneKind) -> bool) {
        self.planes.iter_mut().for_each(|p| p.is_told = is_told(p.source.scale().kind()));
    }

    /// As [`PlaneSource::set_coarse_limit`], for each plane.
    pub(super) fn set_coarse_planes(&mut self, after_bytes: Option<usize>) {
        self.planes.iter_mut().for_each(|p| p.source.set_coarse_limit(after_bytes));
    }

    /// Sets quantities of cells of a plane, if it is replicated; returns whether the plane has changed.
    pub(super) fn set_plane(
        &mut self,
        kind: PlaneKind,
        cells: impl IntoIterator<Item = (Cell, f64)>,
        now: Instant,
    ) -> bool {
        self.plane_mut(kind).is_some_and(|plane| plane.source.set(cells, now) > 0)
    }

    pub(super) fn plane_mut(&mut self, kind: PlaneKind) -> Option<&mut PlaneOut> {
        self.planes.iter_mut().find(|p| p.source.scale().kind() == kind)
    }

    /// Classes of the planes that have something to send and a share.
    pub(super) fn waiting_planes(&self) -> impl Iterator<Item = Class> {
        self.planes.iter().filter(|p| p.is_told && p.has_share && p.source.backlog_bytes() > 0).map(PlaneOut::class)
    }

    /// About how many bytes of planes with a share wait.
    pub(super) fn shared_plane_backlog(&self) -> usize {
        self.planes.iter().filter(|p| p.is_told && p.has_share).map(|p| p.source.backlog_bytes()).sum()
    }

    pub(super) fn fill_plane(
        &mut self,
        class: Class,
        builder: &mut FrameBuilder,
        carried: &mut Carried<S::Carried>,
        now: Instant,
    ) {
        let room = room_for_payload(builder.room());
        let plane = self.planes.iter_mut().find(|p| p.class() == class);
        let Some(source) = plane.map(|p| &mut p.source) else { return };
        let Some((bytes, content)) = source.next_chunk(room, now) else { return };
        let fits = builder.push(ChunkKind::Plane, &bytes);
        assert!(fits, "a chunk of {} bytes was made for {room}", bytes.len());
        carried.push((Part::Plane(source.scale().kind(), content), bytes.len()));
    }

    /// The digests that are owed, as far as there is room for them.
    pub(super) fn fill_digests(&mut self, builder: &mut FrameBuilder, carried: &mut Carried<S::Carried>) {
        for plane in self.planes.iter_mut().filter(|p| p.is_told && p.owes_digest) {
            let bytes = plane.source.digest_chunk();
            if builder.push(ChunkKind::Plane, &bytes) {
                plane.owes_digest = false;
                carried.push((Part::PlaneDigest(plane.source.scale().kind()), bytes.len()));
            }
        }
    }
}

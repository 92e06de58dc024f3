//! How receivers weight the nodes of a tree.

use crate::block::NodeBlock;
use crate::child_cdf::ChildCdf;
use crate::importance::{
    Weighting, near_point, near_segment, segment_cdf, segment_weights, surface_cdf, surface_weights,
};
use crate::instance::LightInstance;
use crate::receiver::{RaySegment, ShadingPoint};
use lightshed_lanes::Lanes;

/// The receivers for which samplers select lights: a [`ShadingPoint`] or a [`RaySegment`].
pub trait Receiver: Sealed {}

impl Receiver for ShadingPoint {}
impl Receiver for RaySegment {}

/// The functions of a receiver that trees use. Sealed: implemented only here.
pub trait Sealed: Sync + Sized {
    /// The receiver in the space of the instance's mesh.
    fn in_mesh(&self, instance: &LightInstance) -> Self;

    /// Whether no light contributes, whatever its intensity.
    fn is_black(&self) -> bool;

    /// The distribution over those of eight siblings that are in `mask`; its sum is about one, two,
    /// or zero. A weight is zero only if the node cannot contribute.
    fn child_cdf<L: Lanes>(&self, block: &NodeBlock, weighting: Weighting, mask: L::Mask) -> ChildCdf<L>;

    /// Weights that can be compared with those of other blocks: not negative, finite, with a finite
    /// sum; zero only where the node cannot contribute.
    fn weights<L: Lanes>(&self, block: &NodeBlock) -> L;

    /// Bits of the nodes that are so near that their weights are poor estimates.
    fn near<L: Lanes>(&self, block: &NodeBlock) -> u32;
}

/// [`surface_cdf`] as a function of its own: without eight-lane registers it is too much code for
/// every caller.
#[inline(never)]
fn surface_cdf_apart<L: Lanes>(
    at: &ShadingPoint,
    block: &NodeBlock,
    weighting: Weighting,
    mask: L::Mask,
) -> ChildCdf<L> {
    surface_cdf(at, block, weighting, mask)
}

impl Sealed for ShadingPoint {
    #[inline(always)]
    fn in_mesh(&self, instance: &LightInstance) -> Self {
        Self {
            position: instance.to_mesh(self.position),
            normal: instance.direction_to_mesh(self.normal),
            ..*self
        }
    }

    #[inline(always)]
    fn is_black(&self) -> bool {
        !(self.reflectance_bound > 0.0)
    }

    #[inline(always)]
    fn child_cdf<L: Lanes>(&self, block: &NodeBlock, weighting: Weighting, mask: L::Mask) -> ChildCdf<L> {
        if L::IN_REGISTERS {
            surface_cdf(self, block, weighting, mask)
        } else {
            surface_cdf_apart(self, block, weighting, mask)
        }
    }

    #[inline(always)]
    fn weights<L: Lanes>(&self, block: &NodeBlock) -> L {
        surface_weights(self, block)
    }

    #[inline(always)]
    fn near<L: Lanes>(&self, block: &NodeBlock) -> u32 {
        near_point::<L>(self.position, block)
    }
}

impl Sealed for RaySegment {
    #[inline(always)]
    fn in_mesh(&self, instance: &LightInstance) -> Self {
        Self {
            start: instance.to_mesh(self.start),
            direction: instance.direction_to_mesh(self.direction),
            length: self.length / instance.scale,
        }
    }

    #[inline(always)]
    fn is_black(&self) -> bool {
        !(self.length > 0.0)
    }

    #[inline(always)]
    fn child_cdf<L: Lanes>(&self, block: &NodeBlock, _: Weighting, mask: L::Mask) -> ChildCdf<L> {
        segment_cdf(self, block, mask)
    }

    #[inline(always)]
    fn weights<L: Lanes>(&self, block: &NodeBlock) -> L {
        L::load(&segment_weights(self, block))
    }

    #[inline(always)]
    fn near<L: Lanes>(&self, block: &NodeBlock) -> u32 {
        near_segment(self, block)
    }
}

//! What receives light: surface points, and segments of rays in a medium.

use crate::block::NodeBlock;
use crate::importance::{
    Weighting, near_point, near_segment, segment_shares, segment_weights, surface_shares, surface_weights,
};
use crate::route::Shares;
use crate::two_level::LightInstance;
use glam::Vec3;
use lightshed_lanes::Lanes;
use std::fmt;

/// The sides from which a surface takes light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Facing {
    /// Where the normal points: the cosine there, nothing from behind.
    #[default]
    Front,
    /// Both sides alike: the cosine's magnitude.
    Both,
    /// All directions alike; the normal means nothing.
    All,
}

/// A point at which light is to be gathered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShadingPoint {
    /// Position, in the lights' space.
    pub position: Vec3,
    /// Unit (shading) normal.
    pub normal: Vec3,
    /// Where light counts.
    pub facing: Facing,
    /// No less than what the surface scatters towards the viewer per irradiance, from any direction (per steradian, as one
    /// number). Zero says that no light matters.
    pub reflectance_bound: f32,
}

impl ShadingPoint {
    /// An opaque surface, light from the side of its unit `normal`.
    pub fn new(position: Vec3, normal: Vec3, reflectance_bound: f32) -> Self {
        Self {
            position,
            normal,
            facing: Facing::Front,
            reflectance_bound,
        }
    }

    /// A point that takes light from all directions.
    pub fn without_normal(position: Vec3) -> Self {
        Self {
            position,
            normal: Vec3::Z,
            facing: Facing::All,
            reflectance_bound: 1.0,
        }
    }
}

/// A stretch of a ray in a medium, every point of which takes light from all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RaySegment {
    start: Vec3,
    direction: Vec3,
    length: f32,
}

/// Why a segment is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SegmentError {
    /// An end is not finite.
    NotFinite,
    /// The direction is not of unit length.
    Direction,
    /// The length is negative or not finite.
    Length,
}

impl fmt::Display for SegmentError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => write!(f, "a ray segment must start at a finite point"),
            Self::Direction => write!(f, "a ray segment needs a unit direction"),
            Self::Length => write!(f, "a ray segment needs a finite length that is not negative"),
        }
    }
}

impl std::error::Error for SegmentError {}

impl RaySegment {
    /// The points `start + t direction`, `0 ≤ t ≤ length`, with a unit `direction`.
    ///
    /// # Errors
    ///
    /// See [`SegmentError`].
    pub fn new(start: Vec3, direction: Vec3, length: f32) -> Result<Self, SegmentError> {
        if !start.is_finite() {
            return Err(SegmentError::NotFinite);
        }
        if !((direction.length_squared() - 1.0).abs() < 1e-3) {
            return Err(SegmentError::Direction);
        }
        if !(length >= 0.0 && length.is_finite()) {
            return Err(SegmentError::Length);
        }
        Ok(Self {
            start,
            direction,
            length,
        })
    }

    /// Where it starts.
    pub fn start(&self) -> Vec3 {
        self.start
    }

    /// Its unit direction.
    pub fn direction(&self) -> Vec3 {
        self.direction
    }

    /// Its length.
    pub fn length(&self) -> f32 {
        self.length
    }
}

/// What samplers choose lights for: a [`ShadingPoint`] or a [`RaySegment`].
pub trait Receiver: Sealed {}

impl Receiver for ShadingPoint {}
impl Receiver for RaySegment {}

/// Receivers as nodes see them.
pub trait Sealed: Sync + Sized {
    /// The receiver as a mesh at rest sees it whose instance this is.
    fn in_mesh(&self, instance: &LightInstance) -> Self;

    /// Whether nothing can be received, whatever shines.
    fn is_black(&self) -> bool;

    /// Shares of those of eight siblings that are `among` the ones to choose from, about one or two together, or nothing: zero only where a
    /// node cannot contribute.
    fn shares<L: Lanes>(&self, block: &NodeBlock, weighting: Weighting, among: L::Mask) -> Shares<L>;

    /// Weights that can be compared with those of other blocks: not negative, finite, with a finite sum; zero only where the node cannot
    /// contribute.
    fn weights<L: Lanes>(&self, block: &NodeBlock) -> L;

    /// Which of them are so near that their weights say little, a bit each.
    fn near<L: Lanes>(&self, block: &NodeBlock) -> u32;
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
    fn shares<L: Lanes>(&self, block: &NodeBlock, weighting: Weighting, among: L::Mask) -> Shares<L> {
        surface_shares(self, block, weighting, among)
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
    fn shares<L: Lanes>(&self, block: &NodeBlock, _: Weighting, among: L::Mask) -> Shares<L> {
        segment_shares(self, block, among)
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

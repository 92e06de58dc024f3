//! Receivers of light: surface points, and segments of rays in a medium.

use glam::Vec3;
use std::fmt;

/// The sides from which a surface takes light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Facing {
    /// The side of the normal: the cosine there, nothing from behind.
    #[default]
    Front,
    /// Both sides alike: the cosine's magnitude.
    Both,
    /// All directions alike; the normal means nothing.
    All,
}

/// The part of a surface's reflection that is not diffuse. Samplers may weigh lights by it; those
/// of this crate do not read it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gloss {
    /// Unit direction towards the viewer, in the lights' space, on the side of the normal.
    pub viewer: Vec3,
    /// Roughness `α` of GGX.
    pub roughness: f32,
    /// Part of the reflected light that the lobe has, 0 to 1. A surface of 0 is diffuse, or not
    /// known; the other fields then mean nothing.
    pub share: f32,
}

/// A point at which light is gathered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShadingPoint {
    /// Position, in the lights' space.
    pub position: Vec3,
    /// Unit (shading) normal.
    pub normal: Vec3,
    /// Where light counts.
    pub facing: Facing,
    /// An upper bound of what the surface scatters towards the viewer per irradiance, from any
    /// direction (per steradian, as one number). If it is zero, no light is selected; other values
    /// change no probability of this crate's samplers.
    pub reflectance_bound: f32,
    /// What is reflected besides a diffuse part.
    pub gloss: Gloss,
}

impl ShadingPoint {
    /// An opaque surface, light from the side of its unit `normal`.
    pub fn new(position: Vec3, normal: Vec3, reflectance_bound: f32) -> Self {
        Self {
            position,
            normal,
            facing: Facing::Front,
            reflectance_bound,
            gloss: Gloss::default(),
        }
    }

    /// A point that receives light from all directions.
    pub fn without_normal(position: Vec3) -> Self {
        Self {
            position,
            normal: Vec3::Z,
            facing: Facing::All,
            reflectance_bound: 1.0,
            gloss: Gloss::default(),
        }
    }
}

/// A segment of a ray in a medium, every point of which receives light from all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RaySegment {
    pub(crate) start: Vec3,
    pub(crate) direction: Vec3,
    pub(crate) length: f32,
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

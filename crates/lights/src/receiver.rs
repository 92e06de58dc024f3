//! What receives light.

use glam::Vec3;

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
#[derive(Clone, Copy, Debug, PartialEq)]
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

//! A scene as data: importers and users write it.

mod content;
mod medium;

pub use medium::{
    DensityDescription, EmissionDescription, GridDescription, GridFilter, MediumBoundary, MediumDescription,
    PhaseDescription,
};

use crate::{Image, Material, Rgb};
use glam::{Affine3A, Vec2, Vec3};
use std::sync::Arc;

/// A whole scene as data. Nothing here is validated; building a scene validates it.
#[derive(Clone, Debug, Default)]
pub struct SceneDescription {
    /// Surfaces, each with one material and possibly an emission.
    pub shapes: Vec<ShapeDescription>,
    /// Materials that shapes refer to by index.
    pub materials: Vec<Material>,
    /// Emitters that are no surface: points, spots, directional lights, the environment.
    pub emitters: Vec<EmitterDescription>,
    /// The camera.
    pub camera: CameraDescription,
    /// Image size, path length and sample count that the file requests.
    pub settings: RenderSettings,
    /// Participating media.
    pub media: Vec<MediumDescription>,
    /// Shapes that bound media; one each at most.
    pub boundaries: Vec<MediumBoundary>,
    /// The medium around the camera. `None` leaves it to the boundaries, see
    /// [`Scene::medium_around`](crate::Scene::medium_around); needed only where no boundary tells.
    pub camera_medium: Option<u32>,
}

/// A surface in world space.
#[derive(Clone, Debug)]
pub struct ShapeDescription {
    /// For messages: the id in the file, or a made-up one.
    pub name: String,
    /// The surface itself.
    pub geometry: Geometry,
    /// Index into [`SceneDescription::materials`].
    pub material: u32,
    /// Emitted radiance of an area emitter, towards the side of the geometric normal only.
    pub emission: Option<Rgb>,
}

/// Geometry in world space.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// A triangle mesh.
    Mesh(TriangleMesh),
    /// A sphere.
    Sphere(SphereGeometry),
    /// Copies of a mesh that are not made.
    Instances(MeshInstances),
}

/// A mesh in a space of its own, and the places where it is.
///
/// Rays are taken to the mesh, so that memory holds it once. Shapes that emit, bound media or let
/// all light pass are copied all the same when a scene is built, and so are all for
/// [accelerators](crate::AcceleratorKind) without instances.
#[derive(Clone, Debug, Default)]
pub struct MeshInstances {
    /// The mesh. A map that mirrors turns its winding over, as if its vertices were moved.
    pub mesh: TriangleMesh,
    /// From the mesh's space to the world, for each instance: finite and regular.
    pub to_world: Vec<Affine3A>,
}

impl MeshInstances {
    /// Corners of the mesh's box in the world, eight of each instance; none of an empty mesh.
    pub fn box_corners(&self) -> impl Iterator<Item = Vec3> + '_ {
        let boxes = self.mesh.positions.iter().map(|&position| [position; 2]);
        let bounds = boxes.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
        bounds.into_iter().flat_map(|[least, greatest]| {
            self.to_world.iter().flat_map(move |map| {
                (0..8).map(move |corner| {
                    let take = |axis: usize| {
                        let end = if corner >> axis & 1 == 1 { greatest } else { least };
                        end[axis]
                    };
                    map.transform_point3(Vec3::new(take(0), take(1), take(2)))
                })
            })
        })
    }
}

/// An indexed triangle mesh in world space. Counter-clockwise order seen from the side the
/// geometric normal points to.
#[derive(Clone, Debug, Default)]
pub struct TriangleMesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Per-vertex shading normals (unit length, world space), or empty for face normals.
    pub normals: Vec<Vec3>,
    /// Per-vertex texture coordinates, or empty. `v` as in the file: image row 0 is at `v = 1`
    /// (Mitsuba's and OBJ's convention); importers of formats with the other convention flip on
    /// reading.
    pub uvs: Vec<Vec2>,
    /// Three indices a triangle.
    pub indices: Vec<[u32; 3]>,
    /// Per-vertex colours, finite and not negative, which [`ColorTexture::Vertex`] shows; or empty
    /// for white.
    ///
    /// [`ColorTexture::Vertex`]: crate::ColorTexture::Vertex
    pub colors: Vec<Rgb>,
    /// Per triangle what its emission is multiplied by, finite and not negative; or empty for ones.
    /// The emission of a texture, in steps.
    pub glow: Vec<Rgb>,
}

#[cfg(feature = "gltf")]
impl TriangleMesh {
    /// Whether some triangle has an area. A scene refuses meshes without.
    pub(crate) fn has_area(&self) -> bool {
        let corners = |triangle: &[u32; 3]| triangle.map(|i| self.positions[i as usize].as_dvec3());
        let mut triangles = self.indices.iter().map(corners);
        triangles.any(|[a, b, c]| (b - a).cross(c - a).try_normalize().is_some())
    }
}

/// A sphere in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereGeometry {
    /// Centre.
    pub center: Vec3,
    /// Radius, positive.
    pub radius: f32,
    /// Whether the geometric normal points inwards.
    pub flip_normals: bool,
}

/// An emitter that is no surface.
#[derive(Clone, Debug)]
pub enum EmitterDescription {
    /// Isotropic point light of radiant intensity `intensity` (W/sr).
    Point {
        /// World position.
        position: Vec3,
        /// Radiant intensity.
        intensity: Rgb,
    },
    /// A spot light: intensity within `beam_width`, falling linearly in the angle to zero at
    /// `cutoff_angle` (Mitsuba's falloff).
    Spot {
        /// World position.
        position: Vec3,
        /// Unit direction of the axis.
        direction: Vec3,
        /// Radiant intensity on the axis.
        intensity: Rgb,
        /// Half-angle of the full-intensity cone, radians.
        beam_width: f32,
        /// Half-angle beyond which nothing is emitted, radians.
        cutoff_angle: f32,
    },
    /// A directional light at infinity.
    Directional {
        /// Unit direction in which light travels.
        direction: Vec3,
        /// Irradiance on a plane perpendicular to `direction`.
        irradiance: Rgb,
    },
    /// Constant radiance from everywhere.
    Constant {
        /// Radiance.
        radiance: Rgb,
    },
    /// An environment image.
    Environment(EnvironmentMap),
}

/// An equirectangular environment. For a direction `d` in the map's local frame: column coordinate
/// `u = atan2(d.x, −d.z) / 2π` (wrapped, pixel-centred), row `θ/π · (H−1)` with `θ` from
/// local +Y (node-centred), bilinear.
#[derive(Clone, Debug)]
pub struct EnvironmentMap {
    /// Radiance, row 0 at +Y.
    pub image: Arc<Image>,
    /// Multiplies the image.
    pub scale: f32,
    /// Rotation from the map's local frame to the world.
    pub to_world: Affine3A,
}

/// Camera: looks along local +Z, +Y up, +X to the left of the image (Mitsuba's convention).
#[derive(Clone, Debug)]
pub struct CameraDescription {
    /// Camera to world.
    pub to_world: Affine3A,
    /// Horizontal field of view, radians (importers convert from other axes by the image's aspect
    /// ratio).
    pub fov_x: f32,
    /// Pinhole or lens.
    pub projection: Projection,
    /// Distance along the axis before which nothing is seen.
    pub near_clip: f32,
    /// Distance along the axis beyond which nothing is seen.
    pub far_clip: f32,
}

/// Pinhole or thin lens.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Projection {
    /// A pinhole.
    #[default]
    Pinhole,
    /// A thin lens.
    ThinLens {
        /// Radius of the aperture.
        aperture_radius: f32,
        /// Distance of the plane in focus, along the axis.
        focus_distance: f32,
    },
}

/// Which extent of the image a field of view spans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FovAxis {
    /// The width.
    #[default]
    X,
    /// The height.
    Y,
    /// The diagonal.
    Diagonal,
    /// The smaller of width and height.
    Smaller,
    /// The larger of width and height.
    Larger,
}

impl FovAxis {
    /// Horizontal field of view in radians of an image of `aspect` = width / height, from the field
    /// of view `angle` in radians along this axis, in (0, π).
    pub fn to_horizontal(self, angle: f64, aspect: f64) -> f64 {
        // Half extent over distance is proportional to the extent in pixels.
        let ratio = match self {
            Self::X => 1.0,
            Self::Y => aspect,
            Self::Diagonal => aspect / aspect.hypot(1.0),
            Self::Smaller => aspect.max(1.0),
            Self::Larger => aspect.min(1.0),
        };
        2.0 * ((0.5 * angle).tan() * ratio).atan()
    }
}

impl Default for CameraDescription {
    fn default() -> Self {
        Self {
            to_world: Affine3A::IDENTITY,
            fov_x: std::f32::consts::FRAC_PI_4,
            projection: Projection::Pinhole,
            near_clip: 0.0,
            far_clip: f32::INFINITY,
        }
    }
}

/// Settings that a scene file requests; command lines override them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Samples a pixel.
    pub samples_per_pixel: u32,
    /// Longest path in edges: 1 shows emitters, 2 direct light. `None` is unbounded.
    pub max_depth: Option<u32>,
    /// Path length in edges from which Russian roulette may end a path.
    pub roulette_depth: u32,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            width: 256,
            height: 256,
            samples_per_pixel: 16,
            max_depth: None,
            roulette_depth: 5,
        }
    }
}

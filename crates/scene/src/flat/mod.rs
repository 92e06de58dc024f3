//! A scene as flat arrays, for shaders.

mod error;
mod materials;

pub use error::FlatError;
pub use materials::{FlatMaterials, FlatTexture};

use crate::emitter::Environment;
use crate::scene::TriangleRecord;
use crate::{Material, Rgb, Scene};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use lightshed_sampling::AliasEntry;

/// Everything that a path tracer asks of a scene of triangles, as arrays whose rows have the layout of the shaders' structs.
///
/// Not every scene has that form: see [`FlatError`].
#[derive(Clone, Debug)]
pub struct FlatScene {
    /// Geometry and what it is made of; 64 bytes each.
    pub triangles: Vec<FlatTriangle>,
    /// Normals at the corners of triangles that have them, as three times four numbers of which the last means nothing.
    pub normals: Vec<[[f32; 4]; 3]>,
    /// Texture coordinates at the corners of triangles that have them.
    pub uvs: Vec<[[f32; 2]; 3]>,
    /// Of each triangle, if it bounds a medium and lies on a surface which light does not pass, how far apart the two may be found; else 0. Empty
    /// where none does.
    pub touching: Vec<f32>,
    /// Materials with their textures.
    pub materials: FlatMaterials,
    /// Emitting triangles.
    pub emitters: Vec<FlatEmitter>,
    /// Points and spots, then directions; as emitters they are counted on from the triangles.
    pub deltas: Vec<FlatDelta>,
    /// How many of them are points and spots.
    pub points: u32,
    /// Choice among triangles, points and spots, by power; empty where none of them shines.
    pub emitter_table: Vec<AliasEntry>,
    /// The camera.
    pub camera: FlatCamera,
    /// Constant radiance from all around; black for none, or for an image.
    pub surroundings: Vec3,
    /// An image from all around.
    pub sky: Option<FlatSky>,
    /// Kinds of emitters to choose from: all that shine from somewhere count as one, each direction as another, and the surroundings as one
    /// more.
    pub groups: u32,
}

/// A triangle: corners, unit normal, and indices; `u32::MAX` for none.
pub type FlatTriangle = TriangleRecord;

/// An emitting triangle: a corner, the edges from there, unit normal, radiance, and `p_sel / area`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FlatEmitter {
    /// A corner.
    pub corner: Vec3,
    /// `p_sel / area`, per unit area.
    pub pdf_area: f32,
    /// From the corner to the second, …
    pub edge0: Vec3,
    /// Red radiance.
    pub radiance_r: f32,
    /// … and to the third.
    pub edge1: Vec3,
    /// Green radiance.
    pub radiance_g: f32,
    /// Unit normal, the side that emits.
    pub normal: Vec3,
    /// Blue radiance.
    pub radiance_b: f32,
}

/// A point, a spot or a direction that shines. 64 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FlatDelta {
    /// Where it is; of a direction the unit vector towards the light.
    pub place: Vec3,
    /// With which it is chosen, `p_sel`.
    pub probability: f32,
    /// Radiant intensity within the beam; of a direction the irradiance on a plane that faces it.
    pub intensity: Rgb,
    /// Cosine of the angle from the axis up to which that is so.
    pub cos_beam: f32,
    /// Unit axis of a spot.
    pub axis: Vec3,
    /// Cosine of the angle from the axis beyond which there is nothing.
    pub cos_cutoff: f32,
    /// That angle, in radians.
    pub cutoff_angle: f32,
    /// One over the width of the fall-off in radians, or 0 if it has none.
    pub inverse_transition: f32,
    /// Nothing.
    pub padding: [u32; 2],
}

/// An equirectangular image from all around, with a distribution over the cells between texel centres: `width` columns, `max(height, 2) − 1`
/// rows.
#[derive(Clone, Debug, PartialEq)]
pub struct FlatSky {
    /// Columns of the rotation from the world to the image's space, where y is up.
    pub axes: [Vec3; 3],
    /// Factor of all radiances.
    pub scale: f32,
    /// Texels along a row, and rows.
    pub size: [u32; 2],
    /// The last row of cells with a positive value.
    pub last_row: u32,
    /// First words of the rows of cells; of the columns, row by row; each row's last column of positive value, as in
    /// [`PiecewiseConstant2d`](lightshed_sampling::PiecewiseConstant2d); and the bits of the texels, three to each, row by row.
    pub words: Vec<u32>,
}

/// A camera: rays as [`Camera::ray`](crate::Camera::ray) makes them. 96 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FlatCamera {
    /// Columns of the rotation, …
    pub x_axis: Vec3,
    /// Radius of the aperture; 0 for a pinhole.
    pub aperture_radius: f32,
    /// …
    pub y_axis: Vec3,
    /// Distance of the plane in focus.
    pub focus_distance: f32,
    /// …
    pub z_axis: Vec3,
    /// Distance at which rays start, along the axis.
    pub near_clip: f32,
    /// Where it is.
    pub position: Vec3,
    /// Distance at which rays end, along the axis.
    pub far_clip: f32,
    /// Local direction of the image's top left corner, at z = 1.
    pub corner: [f32; 2],
    /// Step of the local direction for one pixel.
    pub pixel: [f32; 2],
    /// Pixels of the image.
    pub size: [u32; 2],
    /// Nothing.
    pub padding: [u32; 2],
}

const _: () = assert!(size_of::<FlatTriangle>() == 64 && size_of::<FlatEmitter>() == 64);
const _: () = assert!(size_of::<FlatDelta>() == 64);
const _: () = assert!(size_of::<FlatCamera>() == 96);

impl FlatScene {
    /// # Errors
    ///
    /// [`FlatError`], for what has no flat form.
    pub fn new(scene: &Scene) -> Result<Self, FlatError> {
        if !scene.media().is_empty() {
            return Err(FlatError::Media);
        }
        match scene.materials().iter().position(|m| matches!(m, Material::Null)) {
            Some(passed) => Err(FlatError::Material(passed)),
            None => Self::without_media(scene),
        }
    }

    /// All of a scene but its media. Materials that let light pass have no rows.
    ///
    /// # Errors
    ///
    /// [`FlatError`], for what else has no flat form.
    pub fn without_media(scene: &Scene) -> Result<Self, FlatError> {
        if scene.sphere_count() > 0 {
            return Err(FlatError::Spheres);
        }
        let mut materials = FlatMaterials::default();
        for (index, material) in scene.materials().iter().enumerate() {
            if !materials.push(material) {
                return Err(FlatError::Material(index));
            }
        }
        let emitters = scene.emitters();
        let environment = emitters.environment();
        let constant = environment.and_then(Environment::constant_radiance);
        let rows = (0..emitters.area_count() as u32)
            .map(|index| emitters.flat_triangle(index).ok_or(FlatError::Spheres))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            triangles: scene.triangle_records().to_vec(),
            normals: scene
                .corner_normals()
                .iter()
                .map(|normals| normals.map(|n| [n.x, n.y, n.z, 0.0]))
                .collect(),
            uvs: scene
                .corner_uvs()
                .iter()
                .map(|uvs| uvs.map(|uv| uv.to_array()))
                .collect(),
            touching: scene.slack_of_touching().to_vec(),
            materials,
            emitters: rows,
            deltas: emitters.flat_deltas(),
            points: emitters.point_count() as u32,
            emitter_table: emitters.finite_table().to_vec(),
            camera: scene
                .camera()
                .flat([scene.settings().width, scene.settings().height]),
            surroundings: constant.unwrap_or(Vec3::ZERO),
            sky: environment.and_then(Environment::flat),
            groups: emitters.group_count(),
        })
    }

    /// Corners of all triangles.
    pub fn corners(&self) -> impl ExactSizeIterator<Item = [Vec3; 3]> {
        self.triangles.iter().map(|triangle| triangle.corners)
    }
}

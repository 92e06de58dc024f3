//! A scene as flat arrays, for shaders.

mod error;

pub use error::FlatError;

use crate::emitter::{Environment, SkySampling};
use crate::scene::TriangleRecord;
use crate::{FlatCamera, FlatDelta, FlatEmitter, FlatMaterials, FlatSky, Material, Scene};
use glam::Vec3;
use lightshed_sampling::AliasEntry;

/// The data of a scene of triangles that a path tracer needs, as arrays whose rows have the layout
/// of the shaders' structs.
///
/// Not every scene has that form: see [`FlatError`].
#[derive(Clone, Debug)]
pub struct FlatScene {
    /// Geometry and what it is made of; 64 bytes each.
    pub triangles: Vec<FlatTriangle>,
    /// Normals at the corners of triangles that have them, as three times four numbers of which the
    /// last means nothing.
    pub normals: Vec<[[f32; 4]; 3]>,
    /// Texture coordinates at the corners of triangles that have them.
    pub uvs: Vec<[[f32; 2]; 3]>,
    /// For each triangle that bounds a medium and lies on an opaque surface, the greatest distance
    /// between the two; else 0. Empty if there is none.
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
    /// Kinds of emitters to select from: all finite ones count as one, each direction as another,
    /// and the environment as one more.
    pub groups: u32,
}

/// A triangle: corners, unit normal, and indices; `u32::MAX` for none.
pub type FlatTriangle = TriangleRecord;

const _: () = assert!(size_of::<FlatTriangle>() == 64);

impl FlatScene {
    /// The flat form of a scene, with the image of its environment sampled in this way.
    ///
    /// # Errors
    ///
    /// [`FlatError`], for what has no flat form.
    pub fn new(scene: &Scene, sky: SkySampling) -> Result<Self, FlatError> {
        if !scene.media().is_empty() {
            return Err(FlatError::Media);
        }
        match scene.materials().iter().position(|m| matches!(m, Material::Null)) {
            Some(passed) => Err(FlatError::Material(passed)),
            None => Self::without_media(scene, sky),
        }
    }

    /// All of a scene but its media. Materials that let light pass have no rows.
    ///
    /// # Errors
    ///
    /// [`FlatError`], for what else has no flat form.
    pub fn without_media(scene: &Scene, sky: SkySampling) -> Result<Self, FlatError> {
        if scene.sphere_count() > 0 {
            return Err(FlatError::Spheres);
        }
        if scene.instance_count() > 0 {
            return Err(FlatError::Instances);
        }
        let mut materials = FlatMaterials::default();
        for (index, material) in scene.materials().iter().enumerate() {
            if !materials.push(material) {
                return Err(FlatError::Material(index));
            }
        }
        let (emitters, by_power) = (scene.emitters(), scene.emitters_by_power());
        let environment = emitters.environment();
        let constant = environment.and_then(Environment::constant_radiance);
        let rows = (0..emitters.area_count() as u32)
            .map(|index| by_power.flat_triangle(index).ok_or(FlatError::Spheres))
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
            deltas: by_power.flat_deltas(),
            points: emitters.point_count() as u32,
            emitter_table: by_power.finite_table().to_vec(),
            camera: scene
                .camera()
                .flat([scene.settings().width, scene.settings().height]),
            surroundings: constant.unwrap_or(Vec3::ZERO),
            sky: environment.and_then(|environment| environment.flat(sky)),
            groups: by_power.group_count(),
        })
    }

    /// Corners of all triangles.
    pub fn corners(&self) -> impl ExactSizeIterator<Item = [Vec3; 3]> {
        self.triangles.iter().map(|triangle| triangle.corners)
    }
}

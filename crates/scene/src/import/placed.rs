//! Meshes that a file places many times: the first times copied, then instances.

use crate::{Geometry, Material, MeshInstances, SceneDescription, ShapeDescription};
use glam::{Affine3A, DAffine3};

/// The map of an instance in single precision; `None` if it is singular there, so that the mesh is
/// copied.
pub(super) fn instance_map(to_world: &DAffine3) -> Option<Affine3A> {
    let map = to_world.as_affine3a();
    (map.is_finite() && map.inverse().is_finite()).then_some(map)
}

/// Whether instances of a shape may stay what they are: it neither emits nor lets all light pass.
pub(super) fn may_stay(description: &SceneDescription, shape: &ShapeDescription) -> bool {
    let material = description.materials.get(shape.material as usize);
    shape.emission.is_none() && !matches!(material, Some(Material::Null))
}

impl SceneDescription {
    /// Places the instances of shape `shape` once more.
    pub(super) fn place_again(&mut self, shape: u32, map: Affine3A) {
        if let Some(Geometry::Instances(instances)) = self
            .shapes
            .get_mut(shape as usize)
            .map(|shape| &mut shape.geometry)
        {
            instances.to_world.push(map);
        }
    }
}

impl MeshInstances {
    /// One instance of the mesh of a shape; `None` if it is none.
    pub(super) fn once(geometry: Geometry, map: Affine3A) -> Option<Self> {
        match geometry {
            Geometry::Mesh(mesh) => Some(Self {
                mesh,
                to_world: vec![map],
            }),
            _ => None,
        }
    }
}

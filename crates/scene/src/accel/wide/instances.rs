//! Placed copies of objects: a tree for each object, below the leaves of the scene's tree.
//!
//! A ray that reaches an instance is taken to the object's space and goes through the object's own
//! tree. Its direction is not normalised there, so that ray parameters are those of the world. All
//! triangles of an instance see the same moved ray: no ray passes between two of them.

use super::WideBvh;
use crate::accel::Ray;
use glam::Affine3A;

/// An instance as rays see it.
#[derive(Clone, Debug)]
pub struct Placed {
    pub to_object: Affine3A,
    pub object: u32,
    /// Index of its first primitive.
    pub first: u32,
}

/// Objects and where they are.
#[derive(Clone, Debug, Default)]
pub struct Instances {
    pub objects: Vec<WideBvh>,
    pub placed: Vec<Placed>,
}

impl Instances {
    /// The object's tree, the ray in its space, and the index of the first primitive.
    #[inline(always)]
    pub fn enter(&self, index: usize, ray: &Ray) -> (&WideBvh, Ray, u32) {
        let Placed {
            to_object,
            object,
            first,
        } = &self.placed[index];
        let local = Ray {
            origin: to_object.transform_point3(ray.origin),
            direction: to_object.transform_vector3(ray.direction),
            t_max: ray.t_max,
        };
        (&self.objects[*object as usize], local, *first)
    }

    /// Bytes of all trees and places.
    pub fn bytes(&self) -> usize {
        self.objects.iter().map(WideBvh::bytes).sum::<usize>() + size_of_val(&self.placed[..])
    }
}

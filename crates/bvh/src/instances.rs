//! Trees over placed copies of objects: a level of instances above a level of objects.

use crate::build::Builder;
use crate::error::BuildError;
use crate::options::BuildOptions;
use crate::traverse::Ray;
use crate::tree::Bvh;
use glam::{Affine3A, Vec3};
use lightshed_sampling::parallel::for_each_chunk;
use lightshed_spatial::Bounds;

/// Number of instances for one thread to find boxes for at once.
const CHUNK: usize = 1 << 9;

/// Boxes of an object that the box of an instance is made from.
const PARTS: usize = 16;

/// A copy of an object, placed in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index of the object.
    pub object: u32,
    /// From the object's space to the world.
    pub to_world: Affine3A,
}

impl Instance {
    /// The box of the instance in the world, widened for rounding. `parts` are boxes in the
    /// object's space that together contain the object ([`Bvh::upper_boxes`]). The box is not
    /// finite if there are none.
    pub fn bounds(&self, parts: &[Bounds]) -> Bounds {
        let Affine3A { matrix3, translation } = self.to_world;
        let mut all = Bounds::EMPTY;
        for part in parts {
            let half = (part.max - part.min) * 0.5;
            let center = part.center();
            let middle = Vec3::from(matrix3 * glam::Vec3A::from(center)) + Vec3::from(translation);
            let reach = |axis: usize, of: Vec3| {
                matrix3.x_axis[axis].abs() * of.x
                    + matrix3.y_axis[axis].abs() * of.y
                    + matrix3.z_axis[axis].abs() * of.z
            };
            let extent = Vec3::new(reach(0, half), reach(1, half), reach(2, half));
            // Sums of four terms, each off by less than an ulp or two of the largest.
            let far = center.abs() + half;
            let size = Vec3::new(reach(0, far), reach(1, far), reach(2, far)) + Vec3::from(translation).abs();
            let widened = extent + size * (8.0 * f32::EPSILON);
            all = all.union(&Bounds::new(middle - widened, middle + widened));
        }
        all
    }
}

impl Bvh {
    /// Appends at most `count` boxes that together contain the whole tree: those of its largest
    /// nodes, none of them below another. A box around such parts of a turned object is smaller
    /// than one around its turned box.
    pub fn upper_boxes(&self, count: usize, boxes: &mut Vec<Bounds>) {
        let mut chosen = Vec::new();
        if !self.is_empty() {
            chosen.push(0);
        }
        while chosen.len() < count {
            let inner = chosen
                .iter()
                .enumerate()
                .filter(|&(_, &node)| !self.nodes()[node].is_leaf());
            let area = |node: usize| self.nodes()[node].bounds().half_area();
            let Some((place, &node)) = inner.max_by(|a, b| area(*a.1).total_cmp(&area(*b.1))) else {
                break;
            };
            if let Some([low, high]) = self.children(node) {
                chosen[place] = low;
                chosen.push(high);
            }
        }
        boxes.extend(chosen.iter().map(|&node| self.nodes()[node].bounds()));
    }
}

/// A tree over instances. The caller owns the objects' trees: they do not change when the instances
/// move.
#[derive(Clone, Debug, Default)]
pub struct InstanceTree {
    top: Bvh,
    builder: Builder,
    boxes: Vec<Bounds>,
    /// Transformation from the world to each instance's object.
    to_object: Vec<Affine3A>,
    objects: Vec<u32>,
    /// Upper boxes of each object, and where they begin.
    parts: Vec<Bounds>,
    first_parts: Vec<u32>,
}

impl InstanceTree {
    /// Builds the tree.
    ///
    /// # Errors
    /// See [`InstanceTree::rebuild`] and [`BuildError::Option`].
    pub fn new(
        objects: &[Bvh],
        instances: &[Instance],
        options: impl Into<BuildOptions>,
    ) -> Result<Self, BuildError> {
        let mut tree = Self {
            builder: Builder::new(options.into())?,
            ..Self::default()
        };
        tree.rebuild(objects, instances)?;
        Ok(tree)
    }

    /// Builds the tree again, in the memory that it has, for other instances or objects.
    ///
    /// # Errors
    /// [`BuildError::Object`] for an instance without object, [`BuildError::Bounds`] with the index
    /// of an instance if its placed box is not finite or its object is empty. The tree then is as
    /// before, except for its memory.
    pub fn rebuild(&mut self, objects: &[Bvh], instances: &[Instance]) -> Result<(), BuildError> {
        let missing = |instance: &Instance| instance.object as usize >= objects.len();
        if let Some(instance) = instances.iter().position(missing) {
            let object = instances[instance].object;
            return Err(BuildError::Object { instance, object });
        }
        self.parts.clear();
        self.first_parts.clear();
        for object in objects {
            self.first_parts.push(self.parts.len() as u32);
            object.upper_boxes(PARTS, &mut self.parts);
        }
        self.first_parts.push(self.parts.len() as u32);
        let mut boxes = core::mem::take(&mut self.boxes);
        boxes.resize(instances.len(), Bounds::EMPTY);
        for_each_chunk(&mut boxes, CHUNK, |start, boxes| {
            for (bounds, instance) in boxes.iter_mut().zip(&instances[start..]) {
                let object = instance.object as usize;
                let range = self.first_parts[object] as usize..self.first_parts[object + 1] as usize;
                *bounds = instance.bounds(&self.parts[range]);
            }
        });
        self.boxes = boxes;
        self.builder.rebuild(&self.boxes, &mut self.top)?;
        self.to_object.clear();
        self.to_object
            .extend(instances.iter().map(|i| i.to_world.inverse()));
        self.objects.clear();
        self.objects.extend(instances.iter().map(|i| i.object));
        Ok(())
    }

    /// The tree over the instances; its primitives are their indices.
    pub fn top(&self) -> &Bvh {
        &self.top
    }

    /// The first hit of a ray: instance, primitive of its object, and place along the ray.
    ///
    /// `objects` must be those that the tree was built for. `test(object, primitive, ray)` returns
    /// where a ray in the object's space hits a primitive before its `t_max`; directions are not
    /// normalised, so that places along the ray are the same in all spaces.
    pub fn nearest(
        &self,
        objects: &[Bvh],
        ray: &Ray,
        mut test: impl FnMut(u32, u32, &Ray) -> Option<f32>,
    ) -> Option<(u32, u32, f32)> {
        let mut primitive = 0;
        let (instance, t) = self.top.nearest(ray, |instance, t_max| {
            let to_object = &self.to_object[instance as usize];
            let object = self.objects[instance as usize];
            let local = Ray {
                origin: to_object.transform_point3(ray.origin),
                direction: to_object.transform_vector3(ray.direction),
                t_max,
            };
            let hit = objects[object as usize].nearest(&local, |primitive, t_max| {
                test(object, primitive, &Ray { t_max, ..local })
            })?;
            primitive = hit.0;
            Some(hit.1)
        })?;
        Some((instance, primitive, t))
    }
}

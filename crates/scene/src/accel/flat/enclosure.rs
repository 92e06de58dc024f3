//! Segments that stay in a box.
//!
//! Such a segment meets nothing that lies in a face of the box or beyond it. Where walls along the
//! coordinates enclose a scene, shadow rays between surfaces are not tested against the walls.

use crate::accel::{Ray, RayBatch};
use glam::Vec3;
use lightshed_lanes::{AnyLanes, Vec3Lanes};

/// A box whose faces are walls, where there are walls.
#[derive(Clone, Copy, Debug)]
pub struct Enclosure {
    least: Vec3,
    most: Vec3,
    /// A smaller box. If the rounded end of a segment lies in it, its exact end lies in the whole
    /// box.
    least_end: Vec3,
    most_end: Vec3,
}

/// A wall has at least this share of its side of the box around all triangles.
const WALL: f32 = 0.5;

impl Enclosure {
    /// The box around all triangles, in which sides are moved inwards to the largest wall in that
    /// half of the box: what lies beyond is seen by few.
    pub fn of(triangles: &[[Vec3; 3]], [least, most]: [Vec3; 2]) -> Self {
        let (mut inner_least, mut inner_most) = (least, most);
        let (size, center) = (most - least, least.midpoint(most));
        for axis in 0..3 {
            let side = size[(axis + 1) % 3] * size[(axis + 2) % 3];
            let mut largest = [WALL * side; 2];
            for [corner, ..] in triangles {
                let place = corner[axis];
                let upper = usize::from(place > center[axis]);
                let area = area_at(triangles, axis, place);
                if area >= largest[upper] {
                    largest[upper] = area;
                    [&mut inner_least, &mut inner_most][upper][axis] = place;
                }
            }
        }
        Self::new(inner_least, inner_most)
    }

    fn new(least: Vec3, most: Vec3) -> Self {
        // With both ends in the box, of largest coordinate m, the rounded end `o + t d` is off by
        // at most 3 m 2⁻²⁴.
        let slack = least.abs().max(most.abs()).max_element() * (4.0 * f32::EPSILON);
        let slack = Vec3::splat(slack.max(f32::MIN_POSITIVE));
        Self {
            least,
            most,
            least_end: least + slack,
            most_end: most - slack,
        }
    }

    /// Whether a triangle lies in a face or beyond it: segments in the box do not meet it.
    pub fn is_apart(&self, triangle: &[Vec3; 3]) -> bool {
        let [a, b, c] = triangle;
        a.max(*b).max(*c).cmple(self.least).any() || a.min(*b).min(*c).cmpge(self.most).any()
    }

    /// Whether a segment stays in the box.
    #[inline(always)]
    pub fn holds(&self, ray: &Ray) -> bool {
        let (origin, end) = (ray.origin, ray.origin + ray.direction * ray.t_max);
        self.least.cmple(origin).all()
            && origin.cmple(self.most).all()
            && self.least_end.cmple(end).all()
            && end.cmple(self.most_end).all()
    }

    /// Which of the segments from `place` on stay in the box, as many as there are lanes.
    #[inline(always)]
    pub fn holds_lanes<L: AnyLanes>(&self, rays: &RayBatch, place: usize) -> L::Mask {
        let [origin, direction] = rays.read::<L>(place);
        let end = origin + direction * rays.t_max.read::<L>(place);
        between(self.least, origin, self.most) & between(self.least_end, end, self.most_end)
    }
}

/// Area of the triangles in the plane where this coordinate is `place`.
fn area_at(triangles: &[[Vec3; 3]], axis: usize, place: f32) -> f32 {
    let lies_in = |triangle: &&[Vec3; 3]| triangle.iter().all(|corner| corner[axis] == place);
    let area = |[a, b, c]: &[Vec3; 3]| 0.5 * (b - a).cross(c - a).length();
    triangles.iter().filter(lies_in).map(area).sum()
}

#[inline(always)]
fn between<L: AnyLanes>(least: Vec3, v: Vec3Lanes<L>, most: Vec3) -> L::Mask {
    let (least, most) = (
        Vec3Lanes::<L>::splat(least.to_array()),
        Vec3Lanes::<L>::splat(most.to_array()),
    );
    least.x.less_equal(v.x)
        & v.x.less_equal(most.x)
        & least.y.less_equal(v.y)
        & v.y.less_equal(most.y)
        & least.z.less_equal(v.z)
        & v.z.less_equal(most.z)
}

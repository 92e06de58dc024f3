//! Rays through binary trees: for tests, for tools, and for renderers without a tree of their own.

use crate::tree::Bvh;
use glam::Vec3;
use lightshed_spatial::Bounds;

/// `1 + 2γ(3)`, rounded up: how far the slab test's far end may be off (Ize 2013, *Robust BVH Ray
/// Traversal*, §3).
const FAR_WIDENING: f32 = 1.0 + 4.0 * f32::EPSILON;

/// Most levels of a tree that a [`Builder`](crate::Builder) makes.
pub const MAX_DEPTH: usize = 128;

/// Points `origin + t direction` with `0 < t < t_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes: of any length, not zero.
    pub direction: Vec3,
    /// Where it ends.
    pub t_max: f32,
}

/// A ray as boxes see it.
struct Slabs {
    origin: Vec3,
    inverse: Vec3,
}

impl Slabs {
    fn new(ray: &Ray) -> Self {
        Self {
            origin: ray.origin,
            inverse: ray.direction.recip(),
        }
    }

    /// Where the ray enters the box; `None` if it does not before `t_max`.
    #[inline(always)]
    fn enter(&self, bounds: &Bounds, t_max: f32) -> Option<f32> {
        let (mut near, mut far) = (0.0f32, t_max);
        for axis in 0..3 {
            let a = (bounds.min[axis] - self.origin[axis]) * self.inverse[axis];
            let b = (bounds.max[axis] - self.origin[axis]) * self.inverse[axis];
            // A ray within the plane of a side gives `0 · ∞` and leaves the interval unchanged.
            let (low, high) = if self.inverse[axis] < 0.0 { (b, a) } else { (a, b) };
            near = if low > near { low } else { near };
            far = if high < far { high } else { far };
        }
        (near <= far * FAR_WIDENING).then_some(near)
    }
}

impl Bvh {
    /// The primitive that a ray hits first, and where.
    ///
    /// `test(primitive, t_max)` returns where the ray hits the primitive before `t_max`, if it
    /// does. Boxes are visited in about the order in which the ray enters them. Trees of up to
    /// [`MAX_DEPTH`] levels are searched without allocating.
    pub fn nearest(&self, ray: &Ray, mut test: impl FnMut(u32, f32) -> Option<f32>) -> Option<(u32, f32)> {
        let slabs = Slabs::new(ray);
        let mut found = None;
        let mut t_max = ray.t_max;
        let mut waiting = Waiting::default();
        if let Some(root) = self.nodes.first()
            && let Some(entered) = slabs.enter(&root.bounds(), t_max)
        {
            waiting.push(0, entered);
        }
        while let Some((index, entered)) = waiting.pop() {
            if entered > t_max {
                continue;
            }
            let node = &self.nodes[index as usize];
            let Some([low, high]) = self.children(index as usize) else {
                let primitive = self.order[node.first as usize];
                if let Some(t) = test(primitive, t_max)
                    && t < t_max
                {
                    (t_max, found) = (t, Some((primitive, t)));
                }
                continue;
            };
            let enter = |child: usize| slabs.enter(&self.nodes[child].bounds(), t_max);
            match (enter(low), enter(high)) {
                (Some(a), Some(b)) if a <= b => {
                    waiting.push(high as u32, b);
                    waiting.push(low as u32, a);
                }
                (Some(a), Some(b)) => {
                    waiting.push(low as u32, a);
                    waiting.push(high as u32, b);
                }
                (Some(a), None) => waiting.push(low as u32, a),
                (None, Some(b)) => waiting.push(high as u32, b),
                (None, None) => {}
            }
        }
        found
    }
}

/// Nodes still to be visited; those beyond a fixed number are in a list.
pub(crate) struct Waiting {
    nodes: [(u32, f32); MAX_DEPTH],
    count: usize,
    more: Vec<(u32, f32)>,
}

impl Default for Waiting {
    fn default() -> Self {
        Self {
            nodes: [(0, 0.0); MAX_DEPTH],
            count: 0,
            more: Vec::new(),
        }
    }
}

impl Waiting {
    #[inline(always)]
    pub fn push(&mut self, node: u32, entered: f32) {
        match self.nodes.get_mut(self.count) {
            Some(place) => {
                *place = (node, entered);
                self.count += 1;
            }
            None => self.more.push((node, entered)),
        }
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<(u32, f32)> {
        if let Some(last) = self.more.pop() {
            return Some(last);
        }
        self.count = self.count.checked_sub(1)?;
        Some(self.nodes[self.count])
    }
}

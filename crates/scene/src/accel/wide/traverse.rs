//! Rays through the eight-wide tree.
//!
//! Boxes are tested by slabs whose far ends are widened by the test's own rounding error (Ize 2013, *Robust BVH Ray
//! Traversal*), triangles by signed areas in a space sheared along the ray (Woop, Benthin and Wald 2013, *Watertight
//! Ray/Triangle Intersection*). The signed area of an edge is `a·b − c·d`, each product rounded once: rounding is
//! monotonic, so the computed sign is never opposite to that of the exact value, only zero in its place; zero counts
//! as inside. An edge seen from its two triangles has areas that differ in sign alone. So no ray passes between two
//! triangles that share an edge or a vertex bit for bit.

use super::WideBvh;
use super::node::{Child, ChildKind, Node, TriangleBlock};
use crate::accel::simd::{LaneKernel, Lanes};
use crate::accel::stack::{Entry, Stack};
use crate::accel::{Hit, Ray};

/// `1 + 2γ(3)`, rounded up: how far the slab test's far end may be off (Ize 2013 §3).
const FAR_WIDENING: f32 = 1.0 + 4.0 * f32::EPSILON;

/// What the tests need of a ray, in all lanes.
/// What the tests need of a ray, in all lanes.
///
/// No closures and no iterator adaptors from here on: they are functions of their own, which the compiler does not
/// inline into a caller with other instructions than the crate's, and a call for every operation is the end of speed.
#[derive(Clone, Copy)]
struct RayLanes<L> {
    origin: [L; 3],
    inverse_direction: [L; 3],
    /// Row of the node's bounds in which the ray enters, and in which it leaves, along each axis.
    near_row: [usize; 3],
    far_row: [usize; 3],
    /// Axes permuted so that the last is the one along which the direction is longest.
    axes: [usize; 3],
    /// Shear `d[kx] / d[kz]`, `d[ky] / d[kz]`, and `1 / d[kz]`.
    shear: [L; 3],
}

/// A triangle's corner relative to the ray, sheared so that the ray runs along the last axis.
struct Sheared<L> {
    x: L,
    y: L,
    z: L,
}

impl<L: Lanes> RayLanes<L> {
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
        let magnitude = [d[0].abs(), d[1].abs(), d[2].abs()];
        let kz = if magnitude[0] > magnitude[1] {
            if magnitude[0] > magnitude[2] { 0 } else { 2 }
        } else if magnitude[1] > magnitude[2] {
            1
        } else {
            2
        };
        const NEXT: [usize; 3] = [1, 2, 0];
        let kx = NEXT[kz];
        let ky = NEXT[kx];
        let inverse = [1.0 / d[0], 1.0 / d[1], 1.0 / d[2]];
        let inverse_z = inverse[kz];
        let backwards = [
            3 * usize::from(d[0].is_sign_negative()),
            3 * usize::from(d[1].is_sign_negative()),
            3 * usize::from(d[2].is_sign_negative()),
        ];
        Self {
            origin: [L::splat(o[0]), L::splat(o[1]), L::splat(o[2])],
            inverse_direction: [L::splat(inverse[0]), L::splat(inverse[1]), L::splat(inverse[2])],
            near_row: [backwards[0], 1 + backwards[1], 2 + backwards[2]],
            far_row: [3 - backwards[0], 4 - backwards[1], 5 - backwards[2]],
            axes: [kx, ky, kz],
            shear: [
                L::splat(d[kx] * inverse_z),
                L::splat(d[ky] * inverse_z),
                L::splat(inverse_z),
            ],
        }
    }

    /// Ray parameter at which the planes of `row` along `axis` are met.
    #[inline(always)]
    fn slab(&self, node: &Node, axis: usize, row: usize) -> L {
        L::load(&node.bounds[row])
            .sub(self.origin[axis])
            .mul(self.inverse_direction[axis])
    }

    /// Where the ray enters each child's box, and in which it does before `t_max`.
    #[inline(always)]
    fn enter(&self, node: &Node, t_max: L) -> (L, u32) {
        // The argument that may be NaN comes first, see `Lanes`.
        let near = self.slab(node, 2, self.near_row[2]).max(L::splat(0.0));
        let near = self.slab(node, 1, self.near_row[1]).max(near);
        let near = self.slab(node, 0, self.near_row[0]).max(near);
        let far = self.slab(node, 2, self.far_row[2]).min(t_max);
        let far = self.slab(node, 1, self.far_row[1]).min(far);
        let far = self.slab(node, 0, self.far_row[0]).min(far);
        (near, near.less_equal(far.mul(L::splat(FAR_WIDENING))))
    }

    #[inline(always)]
    fn corner(&self, corner: &[[f32; 8]; 3]) -> Sheared<L> {
        let [kx, ky, kz] = self.axes;
        let z = L::load(&corner[kz]).sub(self.origin[kz]);
        let x = L::load(&corner[kx])
            .sub(self.origin[kx])
            .sub(self.shear[0].mul(z));
        let y = L::load(&corner[ky])
            .sub(self.origin[ky])
            .sub(self.shear[1].mul(z));
        Sheared { x, y, z }
    }

    /// Ray parameter, weights of the first and second vertex, and the triangles hit within `(0, t_max)`.
    #[inline(always)]
    fn triangles(&self, block: &TriangleBlock, t_max: L) -> (L, L, L, u32) {
        let a = self.corner(&block.vertices[0]);
        let b = self.corner(&block.vertices[1]);
        let c = self.corner(&block.vertices[2]);
        // Products rounded on their own, never fused: the antisymmetry of the areas rests on it.
        let area_a = c.x.mul(b.y).sub(c.y.mul(b.x));
        let area_b = a.x.mul(c.y).sub(a.y.mul(c.x));
        let area_c = b.x.mul(a.y).sub(b.y.mul(a.x));
        let zero = L::splat(0.0);
        let least = area_a.min(area_b.min(area_c));
        let greatest = area_a.max(area_b.max(area_c));
        let one_sign = zero.less_equal(least) | greatest.less_equal(zero);
        if one_sign == 0 {
            return (zero, zero, zero, 0);
        }
        // A determinant of zero (a triangle seen edge-on, or without area) gives NaN or ∞ below, which no
        // comparison passes.
        let inverse_determinant = L::splat(1.0).div(area_a.add(area_b.add(area_c)));
        let z = area_a.mul(a.z).add(area_b.mul(b.z).add(area_c.mul(c.z)));
        let t = z.mul(self.shear[2]).mul(inverse_determinant);
        let hit = one_sign & zero.less(t) & t.less(t_max);
        (
            t,
            area_a.mul(inverse_determinant),
            area_b.mul(inverse_determinant),
            hit,
        )
    }
}

#[derive(Clone, Copy)]
struct Nearest<'a> {
    bvh: &'a WideBvh,
    ray: &'a Ray,
}

impl LaneKernel for Nearest<'_> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<Hit> {
        let bvh = self.bvh;
        let ray = RayLanes::<L>::new(self.ray);
        let mut best: Option<Hit> = None;
        let mut t_best = self.ray.t_max;
        let mut stack = Stack::new();
        let mut child = Child::new(ChildKind::Node, 0);
        'visit: loop {
            match child.kind() {
                ChildKind::Node => {
                    let node = &bvh.nodes[child.index()];
                    let (near, mut hit) = ray.enter(node, L::splat(t_best));
                    if hit != 0 {
                        let first = hit.trailing_zeros() as usize;
                        hit &= hit - 1;
                        if hit == 0 {
                            child = node.children[first];
                            continue 'visit;
                        }
                        let near = near.store();
                        let start = stack.len();
                        stack.push(Entry {
                            child: node.children[first].0,
                            t_near: near[first],
                        });
                        while hit != 0 {
                            let slot = hit.trailing_zeros() as usize;
                            hit &= hit - 1;
                            stack.push(Entry {
                                child: node.children[slot].0,
                                t_near: near[slot],
                            });
                        }
                        stack.sort_from(start);
                    }
                }
                ChildKind::Triangles => {
                    let block = &bvh.blocks[child.index()];
                    let (t, a, b, mut hit) = ray.triangles(block, L::splat(t_best));
                    if hit != 0 {
                        let (t, a, b) = (t.store(), a.store(), b.store());
                        while hit != 0 {
                            let lane = hit.trailing_zeros() as usize;
                            hit &= hit - 1;
                            if t[lane] < t_best {
                                t_best = t[lane];
                                best = Some(Hit {
                                    t: t_best,
                                    primitive: block.primitives[lane],
                                    barycentric: [b[lane], (1.0 - a[lane] - b[lane]).max(0.0)],
                                });
                            }
                        }
                    }
                }
                ChildKind::Sphere => {
                    let index = child.index();
                    if let Some(t) = bvh.spheres[index].intersect(self.ray.origin, self.ray.direction, t_best)
                    {
                        t_best = t;
                        let primitive = bvh.first_sphere + index as u32;
                        best = Some(Hit {
                            t,
                            primitive,
                            barycentric: [0.0; 2],
                        });
                    }
                }
            }
            loop {
                let Some(entry) = stack.pop() else { return best };
                if entry.t_near <= t_best {
                    child = Child(entry.child);
                    break;
                }
            }
        }
    }
}

#[derive(Clone, Copy)]
struct Any<'a> {
    bvh: &'a WideBvh,
    ray: &'a Ray,
}

impl LaneKernel for Any<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let bvh = self.bvh;
        let ray = RayLanes::<L>::new(self.ray);
        let t_max = L::splat(self.ray.t_max);
        let mut stack = Stack::new();
        let mut child = Child::new(ChildKind::Node, 0);
        loop {
            match child.kind() {
                ChildKind::Node => {
                    let node = &bvh.nodes[child.index()];
                    let (_, mut hit) = ray.enter(node, t_max);
                    while hit != 0 {
                        let slot = hit.trailing_zeros() as usize;
                        hit &= hit - 1;
                        stack.push(Entry {
                            child: node.children[slot].0,
                            t_near: 0.0,
                        });
                    }
                }
                ChildKind::Triangles => {
                    if ray.triangles(&bvh.blocks[child.index()], t_max).3 != 0 {
                        return true;
                    }
                }
                ChildKind::Sphere => {
                    let sphere = &bvh.spheres[child.index()];
                    if sphere
                        .intersect(self.ray.origin, self.ray.direction, self.ray.t_max)
                        .is_some()
                    {
                        return true;
                    }
                }
            }
            match stack.pop() {
                Some(entry) => child = Child(entry.child),
                None => return false,
            }
        }
    }
}

impl WideBvh {
    /// The nearest hit.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.lanes.run(Nearest { bvh: self, ray })
    }

    /// Whether there is any hit.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.lanes.run(Any { bvh: self, ray })
    }
}

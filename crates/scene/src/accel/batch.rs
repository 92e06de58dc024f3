//! Rays and hits coordinate by coordinate.

use super::{Hit, Ray};
use glam::Vec3;
use lightshed_lanes::{AnyLanes, Column, Lanes, Vec3Lanes};

/// Up to [`RayBatch::CAPACITY`] rays, one column a coordinate, for code that reads and writes eight
/// at a time. The user keeps the number of rays.
#[derive(Clone, Debug)]
pub struct RayBatch {
    /// Coordinates of [`Ray::origin`].
    pub origin: [Column; 3],
    /// Coordinates of [`Ray::direction`].
    pub direction: [Column; 3],
    /// [`Ray::t_max`].
    pub t_max: Column,
}

impl RayBatch {
    /// Number of rays that a batch can hold.
    pub const CAPACITY: usize = Column::CAPACITY;

    /// Rays of zero length: they hit nothing.
    pub const NOWHERE: Self = Self {
        origin: [const { Column::splat(0.0) }; 3],
        direction: [Column::splat(0.0), Column::splat(0.0), Column::splat(1.0)],
        t_max: Column::splat(0.0),
    };

    /// Ray number `index`, taken modulo the capacity.
    #[inline(always)]
    pub fn get(&self, index: usize) -> Ray {
        let [ox, oy, oz] = &self.origin;
        let [dx, dy, dz] = &self.direction;
        Ray {
            origin: Vec3::new(ox.get(index), oy.get(index), oz.get(index)),
            direction: Vec3::new(dx.get(index), dy.get(index), dz.get(index)),
            t_max: self.t_max.get(index),
        }
    }

    /// Sets ray number `index`, taken modulo the capacity.
    #[inline(always)]
    pub fn set(&mut self, index: usize, ray: &Ray) {
        for axis in 0..3 {
            self.origin[axis].set(index, ray.origin[axis]);
            self.direction[axis].set(index, ray.direction[axis]);
        }
        self.t_max.set(index, ray.t_max);
    }

    /// Sets the first rays; those beyond the capacity are left out.
    #[inline]
    pub fn fill(&mut self, rays: &[Ray]) {
        for (index, ray) in rays.iter().enumerate().take(Self::CAPACITY) {
            self.set(index, ray);
        }
    }

    /// Origins and directions of rays `place` to `place + 7`.
    #[inline(always)]
    pub fn load<L: Lanes>(&self, place: usize) -> [Vec3Lanes<L>; 2] {
        let [ox, oy, oz] = &self.origin;
        let [dx, dy, dz] = &self.direction;
        [
            Vec3Lanes::new(ox.load(place), oy.load(place), oz.load(place)),
            Vec3Lanes::new(dx.load(place), dy.load(place), dz.load(place)),
        ]
    }

    /// Origins and directions of the rays from `place` on, as many as there are lanes.
    #[inline(always)]
    pub fn read<L: AnyLanes>(&self, place: usize) -> [Vec3Lanes<L>; 2] {
        let [ox, oy, oz] = &self.origin;
        let [dx, dy, dz] = &self.direction;
        [
            Vec3Lanes::new(ox.read(place), oy.read(place), oz.read(place)),
            Vec3Lanes::new(dx.read(place), dy.read(place), dz.read(place)),
        ]
    }

    /// Sets rays `place` to `place + 7`.
    #[inline(always)]
    pub fn store<L: Lanes>(&mut self, place: usize, origin: Vec3Lanes<L>, direction: Vec3Lanes<L>, t_max: L) {
        let [ox, oy, oz] = &mut self.origin;
        ox.store(place, origin.x);
        oy.store(place, origin.y);
        oz.store(place, origin.z);
        let [dx, dy, dz] = &mut self.direction;
        dx.store(place, direction.x);
        dy.store(place, direction.y);
        dz.store(place, direction.z);
        self.t_max.store(place, t_max);
    }

    /// Appends the rays of the set bits of `mask` behind the first `place`.
    #[inline(always)]
    pub fn store_compressed<L: Lanes>(
        &mut self,
        place: usize,
        origin: Vec3Lanes<L>,
        direction: Vec3Lanes<L>,
        t_max: L,
        mask: u32,
    ) {
        let [ox, oy, oz] = &mut self.origin;
        ox.store_compressed(place, origin.x, mask);
        oy.store_compressed(place, origin.y, mask);
        oz.store_compressed(place, origin.z, mask);
        let [dx, dy, dz] = &mut self.direction;
        dx.store_compressed(place, direction.x, mask);
        dy.store_compressed(place, direction.y, mask);
        dz.store_compressed(place, direction.z, mask);
        self.t_max.store_compressed(place, t_max, mask);
    }
}

/// The hits of the rays of a [`RayBatch`], one column a value.
#[derive(Clone, Debug)]
pub struct HitBatch {
    /// [`Hit::t`]; unspecified for a ray that hits nothing.
    pub t: Column,
    /// [`Hit::primitive`], as words; [`HitBatch::NOTHING`] for a ray that hits nothing.
    pub primitive: Column,
    /// [`Hit::barycentric`]; unspecified for a ray that hits nothing.
    pub barycentric: [Column; 2],
}

impl HitBatch {
    /// In place of a primitive.
    pub const NOTHING: u32 = u32::MAX;

    /// No hits.
    pub const NONE: Self = Self {
        t: Column::splat(0.0),
        primitive: Column::splat(f32::from_bits(Self::NOTHING)),
        barycentric: [const { Column::splat(0.0) }; 2],
    };

    /// The hit of ray number `index`, taken modulo the capacity.
    #[inline(always)]
    pub fn get(&self, index: usize) -> Option<Hit> {
        let primitive = self.primitive.get_word(index);
        let [v, w] = &self.barycentric;
        (primitive != Self::NOTHING).then(|| Hit {
            t: self.t.get(index),
            primitive,
            barycentric: [v.get(index), w.get(index)],
        })
    }

    /// Takes hit number `from` of others for ray number `index` if it is nearer, or as near and of
    /// a lower number. Both are taken modulo the capacity; without a hit, `t` is the ray's end.
    #[inline(always)]
    pub(super) fn take_nearer(&mut self, index: usize, others: &Self, from: usize) {
        let (t, primitive) = (others.t.get(from), others.primitive.get_word(from));
        let (own_t, own) = (self.t.get(index), self.primitive.get_word(index));
        if t < own_t || t == own_t && primitive < own {
            self.t.set(index, t);
            self.primitive.set_word(index, primitive);
            for (own, other) in self.barycentric.iter_mut().zip(&others.barycentric) {
                own.set(index, other.get(from));
            }
        }
    }

    /// Sets the hit of ray number `index`, taken modulo the capacity.
    #[inline(always)]
    pub fn set(&mut self, index: usize, hit: Option<Hit>) {
        let hit = hit.unwrap_or(Hit {
            t: 0.0,
            primitive: Self::NOTHING,
            barycentric: [0.0; 2],
        });
        self.t.set(index, hit.t);
        self.primitive.set_word(index, hit.primitive);
        self.barycentric[0].set(index, hit.barycentric[0]);
        self.barycentric[1].set(index, hit.barycentric[1]);
    }
}

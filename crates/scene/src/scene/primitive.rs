//! Triangles and spheres as shading reads them: one record, one cache line.

use crate::material::Along;
use crate::{Hit, Ray, Sphere, SurfacePoint};
use glam::{Vec2, Vec3};
use lightshed_sampling::Frame;

/// In place of an index where there is nothing.
pub const NONE: u32 = u32::MAX;

/// A triangle: geometry and what it is made of, one cache line.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub struct TriangleRecord {
    /// Corners in space.
    pub corners: [Vec3; 3],
    /// Unit geometric normal.
    pub normal: Vec3,
    /// Index into the materials.
    pub material: u32,
    /// Index into the emitters, or `u32::MAX`.
    pub emitter: u32,
    /// Index into the scene's corner normals, or `u32::MAX` for a flat triangle.
    pub normals: u32,
    /// Index into the scene's texture coordinates, or `u32::MAX`.
    pub uvs: u32,
}

const _: () = assert!(size_of::<TriangleRecord>() == 64);

impl TriangleRecord {
    /// In place of a triangle.
    pub(crate) const NONE: Self = Self {
        corners: [Vec3::ZERO; 3],
        normal: Vec3::Z,
        material: 0,
        emitter: NONE,
        normals: NONE,
        uvs: NONE,
    };

    /// The record as two rows of lanes: corners and normal are the first twelve values.
    #[inline(always)]
    pub(crate) fn halves(&self) -> &[[f32; 8]; 2] {
        bytemuck::cast_ref(self)
    }

    /// Texture coordinates at the weights of the second and third vertex.
    #[inline(always)]
    pub(crate) fn uv(&self, [v, w]: [f32; 2], uvs: &[[Vec2; 3]]) -> Vec2 {
        match uvs.get(self.uvs as usize) {
            Some(uvs) => uvs[0] * (1.0 - v - w).max(0.0) + uvs[1] * v + uvs[2] * w,
            None => Vec2::new(v, w),
        }
    }

    /// Derivatives of the position by texture coordinates; `None` without, or where all lie on a
    /// line.
    pub(crate) fn along(&self, uvs: &[[Vec2; 3]]) -> Option<Along> {
        let uvs = uvs.get(self.uvs as usize)?;
        let [du, dv] = [uvs[1] - uvs[0], uvs[2] - uvs[0]];
        let [first, second] = [
            self.corners[1] - self.corners[0],
            self.corners[2] - self.corners[0],
        ];
        let inverse = 1.0 / du.perp_dot(dv);
        let along = Along {
            u: (first * dv.y - second * du.y) * inverse,
            v: (second * du.x - first * dv.x) * inverse,
        };
        (along.u.is_finite() && along.v.is_finite()).then_some(along)
    }

    /// Weights of the second and third vertex at a position on the triangle, at least 0 and at most
    /// 1 in all.
    pub(crate) fn weights(&self, position: Vec3) -> [f32; 2] {
        let [a, b, c] = self.corners;
        let (first, second, to) = (b - a, c - a, position - a);
        let (aa, ab, bb) = (first.dot(first), first.dot(second), second.dot(second));
        let (pa, pb) = (to.dot(first), to.dot(second));
        let inverse = 1.0 / (aa * bb - ab * ab);
        let v = ((bb * pa - ab * pb) * inverse).clamp(0.0, 1.0);
        let w = ((aa * pb - ab * pa) * inverse).clamp(0.0, 1.0);
        // Of a sliver too thin to be told from a line, the first vertex.
        let sum = (v + w).max(1.0);
        if sum.is_finite() {
            [v / sum, w / sum]
        } else {
            [0.0; 2]
        }
    }

    #[inline(always)]
    pub(crate) fn surface(&self, hit: &Hit, normals: &[[Vec3; 3]], uvs: &[[Vec2; 3]]) -> SurfacePoint {
        let [v, w] = hit.barycentric;
        let weights = [(1.0 - v - w).max(0.0), v, w];
        let terms = [0, 1, 2].map(|i| self.corners[i] * weights[i]);
        let magnitude = terms[0].abs() + terms[1].abs() + terms[2].abs();
        let [a, b, c] = self.corners;
        let extent = (a.max(b).max(c) - a.min(b).min(c)).max_element();
        let interpolated = normals.get(self.normals as usize).and_then(|normals| {
            (normals[0] * weights[0] + normals[1] * weights[1] + normals[2] * weights[2]).try_normalize()
        });
        SurfacePoint {
            position: terms[0] + terms[1] + terms[2],
            offset: SurfacePoint::offset_for(self.normal, magnitude, extent),
            geometric_normal: self.normal,
            shading: Frame::from_normal(interpolated.unwrap_or(self.normal)),
            uv: self.uv([v, w], uvs),
            primitive: hit.primitive,
            material: self.material,
            emitter: self.emitter,
        }
    }
}

/// Unit normal by the winding, in `f64` so that small triangles far from the origin keep theirs;
/// `None` if the triangle has no area.
pub fn unit_normal(corners: &[Vec3; 3]) -> Option<Vec3> {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let normal = (b - a).cross(c - a).try_normalize()?;
    Some(normal.as_vec3())
}

/// A sphere.
#[derive(Clone, Debug)]
pub struct SphereRecord {
    pub sphere: Sphere,
    /// −1 where the geometric normal points inwards, else 1.
    pub orientation: f32,
    pub material: u32,
    /// Index into the emitters, or [`NONE`].
    pub emitter: u32,
}

impl SphereRecord {
    /// Unit direction from the centre to where `ray` hits.
    #[inline(always)]
    pub fn outward(&self, ray: &Ray, hit: &Hit) -> Vec3 {
        let along_ray = ray.origin + ray.direction * hit.t;
        (along_ray - self.sphere.center).normalize_or(Vec3::Z)
    }

    /// Derivatives of the position in the unit direction `outward` by texture coordinates.
    pub fn along(&self, outward: Vec3) -> Along {
        let radius = self.sphere.radius;
        let rim = outward.truncate();
        let around = rim.length();
        let Vec2 { x, y } = rim / around.max(f32::MIN_POSITIVE);
        Along {
            u: Vec3::new(-rim.y, rim.x, 0.0) * (radius * std::f32::consts::TAU),
            // `v` grows towards the pole +z.
            v: Vec3::new(-outward.z * x, -outward.z * y, around) * (radius * std::f32::consts::PI),
        }
    }

    /// The surface point in the unit direction `outward` from the centre. A hit is projected onto
    /// the sphere that way, which is more precise than the point along the ray.
    #[inline]
    pub fn surface(&self, outward: Vec3, primitive: u32) -> SurfacePoint {
        let Sphere { center, radius } = self.sphere;
        let normal = outward * self.orientation;
        let theta = outward.z.clamp(-1.0, 1.0).acos();
        let phi = outward.y.atan2(outward.x);
        let phi = if phi < 0.0 {
            phi + std::f32::consts::TAU
        } else {
            phi
        };
        SurfacePoint {
            position: center + outward * radius,
            offset: SurfacePoint::offset_for(normal, center.abs() + Vec3::splat(radius), radius),
            geometric_normal: normal,
            shading: Frame::from_normal(normal),
            // Mitsuba's, of which `v` points downwards.
            uv: Vec2::new(phi / std::f32::consts::TAU, 1.0 - theta / std::f32::consts::PI),
            primitive,
            material: self.material,
            emitter: self.emitter,
        }
    }
}

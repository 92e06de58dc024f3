//! What shading knows of a surface point beside its normal: tangents, relief, colours of vertices.

use super::Scene;
use crate::{ColorTexture, FloatTexture, Material, Place, Rgb, Roughness, SurfacePoint};
use glam::Vec3;
use lightshed_sampling::Frame;

impl Material {
    /// Whether its shading frames are more than a normal: their tangents follow the texture
    /// coordinates, for roughness that differs along them, or a relief turns them.
    pub(super) fn needs_tangents(&self) -> bool {
        let rough = |roughness: &Option<Roughness>| roughness.as_ref().is_some_and(Roughness::is_anisotropic);
        match self {
            Self::Relief { .. } => true,
            Self::Conductor { roughness, .. }
            | Self::Dielectric { roughness, .. }
            | Self::Plastic { roughness, .. } => rough(roughness),
            Self::Blend { first, second, .. } => first.needs_tangents() || second.needs_tangents(),
            Self::TwoSided { front, back } => {
                front.needs_tangents() || back.as_ref().is_some_and(|back| back.needs_tangents())
            }
            _ => false,
        }
    }

    /// Whether it depends on the colours of vertices.
    pub(super) fn has_vertex_colors(&self) -> bool {
        let color = ColorTexture::has_vertices;
        let float = |texture: &FloatTexture| matches!(texture, FloatTexture::Vertex(_));
        match self {
            Self::Diffuse { reflectance } | Self::Mirror { reflectance } => color(reflectance),
            Self::Relief { base, .. } => base.has_vertex_colors(),
            Self::Blend {
                weight,
                first,
                second,
            } => float(weight) || first.has_vertex_colors() || second.has_vertex_colors(),
            Self::TwoSided { front, back } => {
                front.has_vertex_colors() || back.as_ref().is_some_and(|back| back.has_vertex_colors())
            }
            _ => false,
        }
    }
}

impl Roughness {
    fn is_anisotropic(&self) -> bool {
        use FloatTexture::{Constant, Image};
        match (&self.alpha_u, &self.alpha_v) {
            (Constant(u), Constant(v)) => u != v,
            (Image(u, _), Image(v, _)) => {
                !std::sync::Arc::ptr_eq(&u.image, &v.image) || u.scale != v.scale || u.to_uv != v.to_uv
            }
            (FloatTexture::Vertex(u), FloatTexture::Vertex(v)) => u != v,
            _ => true,
        }
    }
}

impl Scene {
    /// A surface point with the frame that its material wants.
    #[inline(always)]
    pub(super) fn turned(&self, point: SurfacePoint) -> SurfacePoint {
        if self.turned.is_empty() {
            point
        } else {
            self.turn(point)
        }
    }

    #[inline(never)]
    fn turn(&self, mut point: SurfacePoint) -> SurfacePoint {
        if !self.turned[point.material as usize] {
            return point;
        }
        let along = match self.triangle(point.primitive) {
            Some(triangle) => triangle.along(&self.uvs),
            None => match self.sphere(point.primitive) {
                Some(sphere) => Some(sphere.along(point.geometric_normal * sphere.orientation)),
                None => self.copies.in_world(point.primitive).along(&self.uvs),
            },
        };
        let Some(along) = along else { return point };
        point.shading = Frame::from_normal_and_tangent(point.shading.normal, along.u);
        if let Material::Relief { relief, .. } = &self.materials[point.material as usize] {
            let normal = relief.normal(&point.shading, along, self.place(&point));
            point.shading = Frame::from_normal_and_tangent(normal, along.u);
        }
        point
    }

    /// What textures are looked up by at a surface point.
    #[inline(never)]
    pub(super) fn place(&self, point: &SurfacePoint) -> Place {
        let own = self.triangle(point.primitive).copied();
        let triangle = own.or_else(|| match self.sphere(point.primitive) {
            Some(_) => None,
            None => Some(self.copies.in_world(point.primitive)),
        });
        let colors = triangle.and_then(|triangle| {
            let colors = self.colors.get(triangle.uvs as usize)?;
            let [v, w] = triangle.weights(point.position);
            Some(colors[0] * (1.0 - v - w) + colors[1] * v + colors[2] * w)
        });
        Place {
            uv: point.uv,
            color: colors.map_or(Rgb::ONE, |color| color.max(Vec3::ZERO)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Geometry, Ray, SceneDescription, ShapeDescription, builtin};
    use glam::Vec2;
    use lightshed_sampling::CounterRng;
    use lightshed_testkit::check_faults;

    /// A slanted quadrilateral whose colours are its texture coordinates.
    fn scene(material: Material) -> Scene {
        let mut mesh = builtin::quad([
            Vec3::new(0.0, 0.0, 0.3),
            Vec3::new(2.0, 0.0, 0.0),
            Vec3::new(2.0, 1.0, 0.0),
            Vec3::new(0.0, 1.0, 0.3),
        ]);
        mesh.colors = mesh.uvs.iter().map(|uv| Rgb::new(uv.x, uv.y, 0.5)).collect();
        let description = SceneDescription {
            shapes: vec![ShapeDescription {
                name: "slant".to_owned(),
                geometry: Geometry::Mesh(mesh),
                material: 0,
                emission: None,
            }],
            materials: vec![material],
            ..SceneDescription::default()
        };
        Scene::new(&description).unwrap()
    }

    fn points(scene: &Scene, count: u32) -> Vec<SurfacePoint> {
        let mut rng = CounterRng::new(7, 0, 0);
        let down = (0..count).map(|_| {
            let [x, y] = rng.next_2d();
            Ray::new(Vec3::new(2.0 * x, y, 1.0), Vec3::NEG_Z)
        });
        down.filter_map(|ray| scene.intersect(&ray)).collect()
    }

    /// Colours are interpolated like texture coordinates, alone and times a texture.
    #[test]
    fn colours_are_interpolated() {
        let constant = ColorTexture::Constant(Rgb::new(1.0, 0.5, 0.25));
        let scene = scene(Material::Diffuse {
            reflectance: ColorTexture::Vertex(Box::new(constant)),
        });
        let points = points(&scene, 200);
        assert!(points.len() > 190);
        check_faults(&["corners exchanged"], |fault| {
            points.iter().try_for_each(|point| {
                let uv = if fault.is_some() {
                    Vec2::new(point.uv.y, point.uv.x)
                } else {
                    point.uv
                };
                let expected = Rgb::new(uv.x, 0.5 * uv.y, 0.125) / std::f32::consts::PI;
                let found = scene.bsdf(point).evaluate(Vec3::Z, Vec3::Z).value;
                found
                    .abs_diff_eq(expected, 1e-5)
                    .then_some(())
                    .ok_or_else(|| format!("{found} for {expected}"))
            })
        })
        .unwrap();
    }

    /// Roughness that differs along the texture coordinates has a frame that follows them, and
    /// other materials keep theirs.
    #[test]
    fn frames_follow_texture_coordinates_where_they_matter() {
        let material = |alpha_v| Material::Conductor {
            ior: crate::ConductorIor {
                eta: Rgb::ONE,
                k: Rgb::ONE,
            },
            roughness: Some(Roughness {
                distribution: crate::Microfacet::Ggx,
                alpha_u: FloatTexture::Constant(0.5),
                alpha_v: FloatTexture::Constant(alpha_v),
            }),
            specular_reflectance: ColorTexture::Constant(Rgb::ONE),
        };
        let along = Vec3::new(2.0, 0.0, -0.3).normalize();
        for point in points(&scene(material(0.1)), 20) {
            assert!(point.shading.tangent.abs_diff_eq(along, 1e-5));
            assert!(point.shading.normal.abs_diff_eq(point.geometric_normal, 1e-6));
        }
        for point in points(&scene(material(0.5)), 20) {
            let expected = Frame::from_normal(point.geometric_normal);
            assert_eq!(point.shading.tangent, expected.tangent);
        }
    }

    /// Derivatives of a sphere's position by its texture coordinates are differences.
    #[test]
    fn spheres_have_tangents() {
        let mut description = builtin::furnace();
        description.shapes.truncate(1);
        let scene = Scene::new(&description).unwrap();
        let sphere = &scene.spheres[0];
        let mut rng = CounterRng::new(8, 0, 0);
        for _ in 0..50 {
            let outward = lightshed_sampling::UniformSphere::sample(rng.next_2d());
            if outward.z.abs() > 0.99 || (outward.y.abs() < 0.02 && outward.x > 0.0) {
                continue;
            }
            let along = sphere.along(outward);
            let at = |direction: Vec3| sphere.surface(direction.normalize(), 0);
            for (derivative, axis) in [(along.u, Vec2::X), (along.v, Vec2::Y)] {
                let step = 1e-3 * derivative.normalize();
                let (before, after) = (at(outward - step), at(outward + step));
                let found = (after.uv - before.uv) / (after.position - before.position).length();
                let expected = axis / derivative.length();
                assert!(
                    found.abs_diff_eq(expected, 0.01 * expected.length()),
                    "{outward}: {found} for {expected}"
                );
            }
        }
    }
}

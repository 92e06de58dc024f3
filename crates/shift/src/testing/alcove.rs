//! An analytic world with every kind of vertex and emitter: quads and spheres, rays cast by brute
//! force.

use super::shapes::Shape;
use crate::world::{
    Connection, Endpoint, LobeDirection, Place, RayKind, Scattering, WorldGeometry, WorldLighting,
    WorldScattering,
};
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{CosineHemisphere, Density, Frame, SolidAngle, UniformSphere};
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// One term of a scattering function.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Lobe {
    /// `albedo / π`.
    Diffuse(f32),
    /// `albedo (n + 1) / 2π · cosⁿ` of the angle to the mirror direction, over `cos θ_i`;
    /// directions below the surface are lost.
    Glossy { albedo: f32, exponent: f32 },
    /// Share of radiance.
    Mirror(f32),
}

impl Lobe {
    /// In units of GGX's `α`, which a Phong lobe of exponent `2/α² − 2` is like.
    fn roughness(self) -> f32 {
        match self {
            Self::Diffuse(_) => 1.0,
            Self::Glossy { exponent, .. } => (2.0 / (exponent + 2.0)).sqrt(),
            Self::Mirror(_) => 0.0,
        }
    }

    /// `f cos θ` and density in local coordinates, both directions above the surface.
    fn evaluate(self, wo: Vec3, wi: Vec3) -> [f32; 2] {
        match self {
            Self::Diffuse(albedo) => {
                let pdf = wi.z.max(0.0) * FRAC_1_PI;
                [albedo * pdf, pdf]
            }
            Self::Glossy { albedo, exponent } => {
                let cos = reflect(wo).dot(wi).max(0.0);
                let pdf = (exponent + 1.0) / TAU * cos.powf(exponent);
                [if wi.z > 0.0 { albedo * pdf } else { 0.0 }, pdf]
            }
            Self::Mirror(_) => [0.0; 2],
        }
    }

    fn sample(self, wo: Vec3, [u, v]: [f32; 2]) -> Vec3 {
        match self {
            Self::Diffuse(_) => CosineHemisphere::sample([u, v]),
            Self::Glossy { exponent, .. } => {
                let cos = u.powf(1.0 / (exponent + 1.0));
                let sin = (1.0 - cos * cos).max(0.0).sqrt();
                let local = Vec3::new(sin * (TAU * v).cos(), sin * (TAU * v).sin(), cos);
                Frame::from_normal(reflect(wo)).to_world(local)
            }
            Self::Mirror(_) => reflect(wo),
        }
    }
}

fn reflect(wo: Vec3) -> Vec3 {
    Vec3::new(-wo.x, -wo.y, wo.z)
}

/// Lobes with their probabilities, and what is emitted above.
#[derive(Clone, Debug)]
struct Surface {
    shape: Shape,
    lobes: Vec<(f32, Lobe)>,
    tint: Vec3,
    emission: Option<Vec3>,
}

/// Has a floor with a rough and a smooth half, a wall, a mirror, a ball that is half a mirror, a
/// lamp, a light bulb, a point light, and a sky of one colour.
pub(crate) struct Alcove {
    surfaces: Vec<Surface>,
    /// By surface, its number among the emitters; empty behind the last that emits.
    emitters: Vec<u32>,
    lights: Vec<Light>,
}

#[derive(Clone, Copy, Debug)]
enum Light {
    Surface(u32),
    Sky,
    Point { position: Vec3, intensity: Vec3 },
}

#[derive(Clone, Debug)]
pub(crate) struct Vertex {
    place: Place,
    pub position: Vec3,
    /// Of the surface's front.
    normal: Vec3,
}

/// `t` from `t_min` on to `t_max`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    origin: Vec3,
    direction: Vec3,
    range: [f32; 2],
}

const SKY: Vec3 = Vec3::new(0.3, 0.4, 0.6);

impl Alcove {
    pub(crate) fn new() -> Self {
        let quad = |corner: [f32; 3], a: [f32; 3], b: [f32; 3]| Shape::Quad {
            corner: corner.into(),
            a: a.into(),
            b: b.into(),
        };
        let ball = |center: [f32; 3], radius: f32| Shape::Sphere {
            center: center.into(),
            radius,
        };
        let plain = |shape, albedo: [f32; 3]| Surface {
            shape,
            lobes: vec![(1.0, Lobe::Diffuse(1.0))],
            tint: albedo.into(),
            emission: None,
        };
        let coated = |shape, exponent: f32| Surface {
            shape,
            lobes: vec![
                (0.6, Lobe::Diffuse(0.5)),
                (
                    0.4,
                    Lobe::Glossy {
                        albedo: 0.45,
                        exponent,
                    },
                ),
            ],
            tint: Vec3::ONE,
            emission: None,
        };
        let lamp = |shape, emission: [f32; 3]| Surface {
            emission: Some(emission.into()),
            ..plain(shape, [0.2; 3])
        };
        let glossy = Surface {
            lobes: vec![(
                1.0,
                Lobe::Glossy {
                    albedo: 0.8,
                    exponent: 60.0,
                },
            )],
            ..plain(quad([1.0, 0.0, -1.0], [0.0, 0.0, 2.0], [0.0, 1.5, 0.0]), [1.0; 3])
        };
        let mirror = Surface {
            lobes: vec![(1.0, Lobe::Mirror(0.9))],
            ..plain(ball([-0.5, 0.3, 0.2], 0.25), [1.0; 3])
        };
        let half_mirror = Surface {
            lobes: vec![(0.5, Lobe::Mirror(0.4)), (0.5, Lobe::Diffuse(0.5))],
            ..plain(ball([0.3, 0.35, -0.3], 0.25), [0.9, 0.7, 0.5])
        };
        let surfaces = vec![
            // Emitters come first: their table ends with the last of them.
            lamp(
                quad([-0.3, 1.49, -0.3], [0.6, 0.0, 0.0], [0.0, 0.0, 0.6]),
                [9.0, 8.0, 6.0],
            ),
            lamp(ball([0.55, 0.8, 0.4], 0.08), [8.0, 10.0, 12.0]),
            // The rough half of the floor, and the smooth one.
            coated(quad([-1.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -2.0]), 20.0),
            coated(quad([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -2.0]), 100.0),
            plain(
                quad([-1.0, 0.0, -1.0], [2.0, 0.0, 0.0], [0.0, 1.5, 0.0]),
                [0.7, 0.5, 0.4],
            ),
            plain(
                quad([-1.0, 0.0, 1.0], [0.0, 0.0, -2.0], [0.0, 1.5, 0.0]),
                [0.3, 0.6, 0.3],
            ),
            glossy,
            mirror,
            half_mirror,
        ];
        Self {
            emitters: vec![0, 1],
            lights: vec![
                Light::Surface(0),
                Light::Surface(1),
                Light::Sky,
                Light::Point {
                    position: Vec3::new(-0.4, 1.0, 0.7),
                    intensity: Vec3::new(0.4, 0.5, 0.7),
                },
            ],
            surfaces,
        }
    }

    fn surface(&self, vertex: &Vertex) -> &Surface {
        &self.surfaces[vertex.place.primitive as usize]
    }

    /// The frame on the viewer's side.
    fn frame(vertex: &Vertex, wo: Vec3) -> Frame {
        let side = if vertex.normal.dot(wo) < 0.0 { -1.0 } else { 1.0 };
        Frame::from_normal(vertex.normal * side)
    }

    fn offset(vertex: &Vertex, direction: Vec3) -> Vec3 {
        vertex.position + vertex.normal * 1e-5 * vertex.normal.dot(direction).signum()
    }

    /// Of choosing any one light.
    fn choice(&self) -> f32 {
        1.0 / self.lights.len() as f32
    }
}

impl WorldGeometry for Alcove {
    type Vertex = Vertex;
    type Ray = Ray;
    /// The centre of a pixel on the plane `z = 1.5`, seen from behind.
    type Sensor = [f32; 2];

    fn vertex(&self, place: &Place) -> Vertex {
        let (position, normal) = self.surfaces[place.primitive as usize]
            .shape
            .locate(place.coordinates);
        Vertex {
            place: *place,
            position,
            normal,
        }
    }

    fn place(&self, vertex: &Vertex) -> Place {
        vertex.place
    }

    fn position(&self, vertex: &Vertex) -> Vec3 {
        vertex.position
    }

    fn geometric_normal(&self, vertex: &Vertex) -> Vec3 {
        vertex.normal
    }

    fn ray(&self, from: &Vertex, direction: Vec3) -> Ray {
        Ray {
            origin: Self::offset(from, direction),
            direction,
            range: [0.0, f32::INFINITY],
        }
    }

    fn segment(&self, from: &Vertex, to: &Vertex) -> Ray {
        let d = to.position - from.position;
        let origin = Self::offset(from, d);
        Ray {
            origin,
            direction: Self::offset(to, -d) - origin,
            range: [0.0, 1.0],
        }
    }

    fn trace(&self, ray: &Ray, _: RayKind) -> Option<Vertex> {
        let (mut range, mut found) = (ray.range, None);
        for (primitive, surface) in (0..).zip(&self.surfaces) {
            if let Some((t, coordinates)) = surface.shape.intersect(ray.origin, ray.direction, range) {
                range[1] = t;
                found = Some(Place {
                    primitive,
                    coordinates,
                });
            }
        }
        found.map(|place| self.vertex(&place))
    }

    fn occluded(&self, ray: &Ray, kind: RayKind) -> bool {
        self.trace(ray, kind).is_some()
    }

    fn sensor_ray(&self, &[x, y]: &[f32; 2], [u, v, s, t]: [f32; 4]) -> Option<(Ray, Vec3)> {
        let film = Vec3::new(x + 0.1 * (u - 0.5), y + 0.1 * (v - 0.5), 1.5);
        let lens = Vec3::new(0.05 * (s - 0.5), 0.7 + 0.05 * (t - 0.5), 4.0);
        let direction = (film - lens).normalize();
        let ray = Ray {
            origin: lens,
            direction,
            range: [0.0, f32::INFINITY],
        };
        Some((ray, direction))
    }
}

impl WorldScattering for Alcove {
    fn sample_lobe(&self, vertex: &Vertex, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<LobeDirection> {
        let (frame, surface) = (Self::frame(vertex, wo), self.surface(vertex));
        let mut below = 0.0;
        let chosen = surface.lobes.iter().position(|&(probability, _)| {
            below += probability;
            u_lobe < below
        });
        let number = chosen.unwrap_or(surface.lobes.len() - 1);
        let (probability, lobe) = surface.lobes[number];
        let wi = frame.to_world(lobe.sample(frame.to_local(wo), u));
        let is_delta = matches!(lobe, Lobe::Mirror(_));
        let scattering = match lobe {
            Lobe::Mirror(share) => Scattering {
                value: surface.tint * share,
                pdf: Density::new(probability),
            },
            _ => self.evaluate_lobe(vertex, wo, wi, number as u8),
        };
        Some(LobeDirection {
            wi,
            lobe: number as u8,
            scattering,
            total_pdf: self.evaluate(vertex, wo, wi).pdf,
            is_delta,
        })
    }

    fn evaluate(&self, vertex: &Vertex, wo: Vec3, wi: Vec3) -> Scattering {
        (0..self.lobe_count(vertex)).fold(Scattering::ZERO, |sum, lobe| {
            let lobe = self.evaluate_lobe(vertex, wo, wi, lobe);
            Scattering {
                value: sum.value + lobe.value,
                pdf: sum.pdf + lobe.pdf,
            }
        })
    }

    fn lobe_count(&self, vertex: &Vertex) -> u8 {
        self.surface(vertex).lobes.len() as u8
    }

    fn evaluate_lobe(&self, vertex: &Vertex, wo: Vec3, wi: Vec3, lobe: u8) -> Scattering {
        let (frame, surface) = (Self::frame(vertex, wo), self.surface(vertex));
        let Some((probability, lobe)) = surface.lobes.get(usize::from(lobe)) else {
            return Scattering::ZERO;
        };
        let [value, pdf] = lobe.evaluate(frame.to_local(wo), frame.to_local(wi));
        Scattering {
            value: surface.tint * value,
            pdf: Density::new(probability * pdf),
        }
    }

    fn lobe_roughness(&self, vertex: &Vertex, lobe: u8) -> f32 {
        let lobe = self.surface(vertex).lobes.get(usize::from(lobe));
        lobe.map_or(0.0, |(_, lobe)| lobe.roughness())
    }
}

impl WorldLighting for Alcove {
    type Site = Vec3;

    fn site(&self, vertex: &Vertex) -> Vec3 {
        vertex.position
    }

    fn emitted(&self, vertex: &Vertex, direction: Vec3) -> Vec3 {
        let emission = self.surface(vertex).emission.unwrap_or(Vec3::ZERO);
        if self.faces(vertex, direction) {
            emission
        } else {
            Vec3::ZERO
        }
    }

    /// Panics for a surface that does not emit, or not towards `from`: nobody may ask.
    fn emitter_pdf(&self, from: &Vec3, emitter: &Vertex) -> Density<SolidAngle> {
        let Light::Surface(primitive) = self.lights[self.emitters[emitter.place.primitive as usize] as usize]
        else {
            unreachable!("the first lights are surfaces");
        };
        let d = emitter.position - *from;
        let cos_theta = emitter.normal.dot(d) / d.length();
        assert!(self.faces(emitter, -d), "asked for the back of an emitter");
        let area = self.surfaces[primitive as usize].shape.area();
        Density::new(self.choice() / area).to_solid_angle(d.length_squared(), cos_theta)
    }

    fn sample_emitter(&self, _: &Vertex, u_select: u64, u: [f32; 2]) -> Option<Endpoint> {
        let number = ((u128::from(u_select) * self.lights.len() as u128) >> 64) as usize;
        Some(match self.lights[number] {
            Light::Surface(primitive) => Endpoint::Surface(Place {
                primitive,
                coordinates: u,
            }),
            Light::Sky => Endpoint::Direction(UniformSphere::sample(u)),
            Light::Point { .. } => Endpoint::Delta(number as u32),
        })
    }

    fn environment(&self, _: Vec3) -> Vec3 {
        SKY
    }

    fn environment_pdf(&self, _: &Vec3, _: Vec3) -> Density<SolidAngle> {
        Density::new(self.choice() * 0.25 * FRAC_1_PI)
    }

    fn connect_delta(&self, from: &Vertex, emitter: u32) -> Option<Connection<Ray>> {
        let Light::Point { position, intensity } = *self.lights.get(emitter as usize)? else {
            return None;
        };
        let d = position - from.position;
        let origin = Self::offset(from, d);
        let ray = Ray {
            origin,
            direction: position - origin,
            range: [0.0, 1.0],
        };
        let irradiance = intensity / d.length_squared();
        Some(Connection::to_delta(
            d.normalize(),
            irradiance,
            self.choice(),
            ray,
        ))
    }
}

impl Alcove {
    /// Whether `direction` leads away from the front of a vertex, whose emitters' fronts emit.
    fn faces(&self, vertex: &Vertex, direction: Vec3) -> bool {
        vertex.normal.dot(direction) > 0.0
    }
}

#[test]
fn lobes_have_the_densities_that_they_say() {
    let lobes = [
        Lobe::Diffuse(0.5),
        Lobe::Glossy {
            albedo: 0.5,
            exponent: 20.0,
        },
    ];
    let wo = Vec3::new(0.3, 0.1, 0.9).normalize();
    for lobe in lobes {
        // Of the sphere, half of which a glossy lobe may lie below.
        let integral = lightshed_testkit::integrate_sphere(
            |w| f64::from(lobe.evaluate(wo, Vec3::from_array(w.map(|c| c as f32)))[1]),
            1e-5,
        );
        assert!(
            (integral.value - 1.0).abs() < 1e-3,
            "{lobe:?}: {}",
            integral.value
        );
        let mut rng = lightshed_sampling::CounterRng::new(1, 0, 0);
        let axis = reflect(wo);
        // Means of the cosine to the mirror direction, by samples and by the density.
        let mut mean = lightshed_testkit::MeanTest::new();
        for _ in 0..20_000 {
            mean.push(f64::from(lobe.sample(wo, rng.next_2d()).dot(axis)));
        }
        let expected = lightshed_testkit::integrate_sphere(
            |w| {
                let w = Vec3::from_array(w.map(|c| c as f32));
                f64::from(lobe.evaluate(wo, w)[1] * w.dot(axis))
            },
            1e-5,
        );
        mean.test_against(expected.value, 1e-6).unwrap();
    }
    assert!(
        (Shape::Sphere {
            center: Vec3::ZERO,
            radius: 1.0
        }
        .area()
            - 4.0 * PI)
            .abs()
            < 1e-5
    );
}

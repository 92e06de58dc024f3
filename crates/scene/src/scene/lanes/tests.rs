//! Points, emitter samples and camera rays in lanes against those alone, bit for bit.

use crate::{
    Camera, CameraDescription, Checkerboard, ColorTexture, EmitterDescription, EmitterLanes, Geometry,
    HitBatch, Material, Projection, Ray, Rgb, Scene, SceneDescription, ShapeDescription, SphereGeometry,
    SurfacePoint, builtin,
};
use glam::{Affine2, Affine3A, EulerRot, Quat, Vec2, Vec3};
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, LaneMask, LaneWords, Lanes, Vec3Lanes};
use lightshed_sampling::{CounterRng, Frame, UniformSphere};
use lightshed_testkit::check_faults;

/// Bits of numbers; a zero's sign is not held against them.
fn bits(values: impl IntoIterator<Item = f32>) -> Vec<u32> {
    values.into_iter().map(|x| (x + 0.0).to_bits()).collect()
}

/// What lanes tell about a point: position, offset, normals, reflectance, sides, a ray's origin.
const FIGURES: usize = 3 + 1 + 3 + 9 + 3 + 2 + 3;

struct Points<'a> {
    scene: &'a Scene,
    hits: &'a HitBatch,
    wanted: u32,
}

impl LaneKernel for Points<'_> {
    const HOT: bool = true;
    type Output = (Vec<[f32; LANES]>, u32, u32);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let points = self.scene.diffuse_lanes::<L>(self.hits, 0, self.wanted);
        let one = L::splat(1.0);
        let side = |cos: f32| {
            let seen = points.seen_from(L::splat(cos)).0;
            one.select(seen, L::splat(0.0)).store()
        };
        let mut rows = Vec::new();
        rows.extend(points.position.store());
        rows.push(points.offset.store());
        rows.extend(points.geometric_normal.store());
        for axis in [
            points.shading.tangent,
            points.shading.bitangent,
            points.shading.normal,
        ] {
            rows.extend(axis.store());
        }
        rows.extend(points.reflectance.store());
        rows.extend([side(0.5), side(-0.5)]);
        rows.extend(points.origin_towards(Vec3Lanes::splat([0.3, -0.2, 0.1])).store());
        (rows, points.diffuse, points.emitting)
    }
}

/// The same of one point by [`Scene::surface`] and [`Scene::bsdf`], if it is diffuse.
fn figures(scene: &Scene, point: &SurfacePoint) -> Option<[f32; FIGURES]> {
    scene.materials()[point.material as usize].as_diffuse()?;
    let bsdf = scene.bsdf(point);
    let seen = |cos: f32| f32::from(u8::from(bsdf.lobe_probability(0, Vec3::new(0.0, 0.0, cos)) > 0.0));
    let shading = &point.shading;
    let mut figures = Vec::new();
    figures.extend(point.position.to_array());
    figures.push(point.offset);
    figures.extend(point.geometric_normal.to_array());
    for axis in [shading.tangent, shading.bitangent, shading.normal] {
        figures.extend(axis.to_array());
    }
    figures.extend(bsdf.albedo_hint().to_array());
    figures.extend([seen(0.5), seen(-0.5)]);
    figures.extend(point.origin_towards(Vec3::new(0.3, -0.2, 0.1)).to_array());
    figures.try_into().ok()
}

/// The Cornell box with a checkered two-sided material, a ball with interpolated normals, emitting
/// and plain spheres, a material that is not diffuse, and emitters of every kind.
fn mixed() -> SceneDescription {
    let mut scene = builtin::cornell();
    let checkered = Material::Diffuse {
        reflectance: ColorTexture::Checkerboard(Checkerboard {
            color0: Rgb::new(0.2, 0.5, 0.7),
            color1: Rgb::new(0.9, 0.1, 0.4),
            to_uv: Affine2::from_scale(Vec2::new(5.0, 3.0)),
        }),
    };
    scene.materials[0] = Material::TwoSided {
        front: Box::new(checkered),
        back: None,
    };
    scene.materials.push(Material::Mirror {
        reflectance: Rgb::splat(0.9).into(),
    });
    let (center, radius) = (Vec3::new(-0.3, -0.4, 0.5), 0.35);
    let mut ball = builtin::icosphere(center, radius, 2);
    ball.normals = ball
        .positions
        .iter()
        .map(|p| (p - center) * (1.0 + 0.3 * p.x))
        .collect();
    let mut add = |name: &str, geometry, material, emission| {
        scene.shapes.push(ShapeDescription {
            name: name.to_owned(),
            geometry,
            material,
            emission,
        });
    };
    let sphere = |x, flip_normals| {
        Geometry::Sphere(SphereGeometry {
            center: Vec3::new(x, 0.5, 0.2),
            radius: 0.15,
            flip_normals,
        })
    };
    add("ball", Geometry::Mesh(ball), 1, None);
    add("lamp", sphere(0.5, false), 1, Some(Rgb::splat(2.0)));
    add("mirror", sphere(-0.5, false), 3, None);
    add("hollow", sphere(0.0, true), 2, Some(Rgb::X));
    scene.emitters = vec![
        EmitterDescription::Point {
            position: Vec3::new(0.2, 0.1, 0.9),
            intensity: Rgb::splat(0.5),
        },
        EmitterDescription::Directional {
            direction: Vec3::new(0.1, -0.4, -1.0),
            irradiance: Rgb::new(0.3, 0.2, 0.1),
        },
        EmitterDescription::Constant {
            radiance: Rgb::splat(0.2),
        },
    ];
    scene
}

/// Built-in scenes and one of everything.
fn scenes() -> Vec<Scene> {
    let descriptions = builtin::NAMES.iter().map(|name| builtin::by_name(name).unwrap());
    descriptions
        .chain([mixed()])
        .map(|description| Scene::new(&description).unwrap())
        .collect()
}

/// Rays from about the middle of the scenes in all directions.
fn rays(count: usize) -> Vec<Ray> {
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(21, i as u32, 0);
            let origin = UniformSphere::sample(rng.next_2d()) * 0.7;
            Ray::new(origin, UniformSphere::sample(rng.next_2d()))
        })
        .collect()
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    /// The weights of the second and the third vertex exchanged.
    SwappedWeights,
    /// The geometric normal for the shading normal.
    Flat,
    /// The lower half of the emitter's number is lost.
    LostBits,
    /// A point aimed at from elsewhere.
    MovedPoint,
    /// The lens is forgotten.
    Pinhole,
}

#[test]
fn points_in_lanes_are_those_alone() {
    let scenes = scenes();
    check_faults(&[Fault::SwappedWeights, Fault::Flat], |fault| {
        let (mut compared, mut emitting) = (0, 0);
        for scene in &scenes {
            let mut hits = HitBatch::NONE;
            for rays in rays(4096).chunks_exact(LANES) {
                let mut wanted = 0;
                for (lane, ray) in rays.iter().enumerate() {
                    let hit = scene.accelerator().intersect(ray);
                    hits.set(lane, hit);
                    wanted |= u32::from(hit.is_some()) << lane;
                }
                // Not all that could be had.
                wanted &= !1;
                for choice in LaneChoice::all() {
                    let (rows, diffuse, emits) = choice.run(Points {
                        scene,
                        hits: &hits,
                        wanted,
                    });
                    for (lane, ray) in rays.iter().enumerate() {
                        let Some(mut hit) = hits.get(lane).filter(|_| wanted >> lane & 1 == 1) else {
                            assert_eq!(diffuse >> lane & 1, 0);
                            continue;
                        };
                        if let Some(Fault::SwappedWeights) = fault {
                            hit.barycentric.swap(0, 1);
                        }
                        let mut point = scene.surface(ray, &hit);
                        if let Some(Fault::Flat) = fault {
                            point.shading = Frame::from_normal(point.geometric_normal);
                        }
                        let on_triangle = (hit.primitive as usize) < scene.triangle_count();
                        let expected = figures(scene, &point).filter(|_| on_triangle);
                        assert_eq!(diffuse >> lane & 1 == 1, expected.is_some());
                        let Some(expected) = expected else { continue };
                        if bits(rows.iter().map(|row| row[lane])) != bits(expected) {
                            return Err(format!("{hit:?} differs"));
                        }
                        let is_emitter = point.emitter != SurfacePoint::NO_EMITTER;
                        assert_eq!(emits >> lane & 1 == 1, is_emitter);
                        compared += 1;
                        emitting += i32::from(is_emitter);
                    }
                }
            }
        }
        assert!(
            compared > 10_000 && emitting > 100,
            "{compared} points, {emitting} emitting"
        );
        Ok(())
    })
    .unwrap();
}

/// Samples of emitters for the points of [`Points`].
struct Samples<'a> {
    scene: &'a Scene,
    hits: &'a HitBatch,
    wanted: u32,
    u_select: [u64; LANES],
    u: [[f32; LANES]; 2],
}

impl LaneKernel for Samples<'_> {
    const HOT: bool = true;
    type Output = (Vec<[f32; LANES]>, u32, u32);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let points = self.scene.diffuse_lanes::<L>(self.hits, 0, self.wanted);
        let samples: EmitterLanes<L> = self.scene.emitters_by_power().sample_lanes::<L>(
            points.position,
            [
                L::Words::load(&self.u_select.map(|u| u as u32)),
                L::Words::load(&self.u_select.map(|u| (u >> 32) as u32)),
            ],
            [L::load(&self.u[0]), L::load(&self.u[1])],
            points.diffuse,
        );
        let (origin, direction, t_max) = samples.shadow_rays(&points);
        let mut rows = Vec::new();
        for v in [samples.direction, samples.weight, origin, direction] {
            rows.extend(v.store());
        }
        rows.extend([t_max.store(), samples.pdf_solid_angle.store()]);
        rows.push(samples.emitter.map(|emitter| emitter as f32));
        let is_delta = (samples.is_delta & samples.found).bits();
        (rows, samples.found.bits() & points.diffuse, is_delta)
    }
}

#[test]
fn emitter_samples_in_lanes_are_those_alone() {
    let scenes = scenes();
    check_faults(&[Fault::LostBits, Fault::MovedPoint], |fault| {
        let (mut compared, mut deltas) = (0, 0);
        for scene in &scenes {
            let mut hits = HitBatch::NONE;
            for (rays, number) in rays(2048).chunks_exact(LANES).zip(0..) {
                let mut wanted = 0;
                for (lane, ray) in rays.iter().enumerate() {
                    let hit = scene.accelerator().intersect(ray);
                    hits.set(lane, hit);
                    wanted |= u32::from(hit.is_some()) << lane;
                }
                let mut rng = CounterRng::new(22, number, 0);
                let u_select: [u64; LANES] = std::array::from_fn(|_| rng.next_u64());
                let u: [[f32; LANES]; 2] = [(); 2].map(|()| std::array::from_fn(|_| rng.next_f32()));
                for choice in LaneChoice::all() {
                    let (rows, found, is_delta) = choice.run(Samples {
                        scene,
                        hits: &hits,
                        wanted,
                        u_select,
                        u,
                    });
                    for (lane, ray) in rays.iter().enumerate() {
                        let Some(hit) = hits.get(lane) else { continue };
                        let point = scene.surface(ray, &hit);
                        if (hit.primitive as usize) >= scene.triangle_count()
                            || figures(scene, &point).is_none()
                        {
                            continue;
                        }
                        let mut from = point.position;
                        let mut select = u_select[lane];
                        match fault {
                            Some(Fault::LostBits) => select &= 0xffff_ffff,
                            Some(Fault::MovedPoint) => from.x += 1e-3,
                            _ => {}
                        }
                        let sample = scene
                            .emitters_by_power()
                            .sample(from, select, [u[0][lane], u[1][lane]]);
                        if (found >> lane & 1 == 1) != sample.is_some() {
                            return Err(format!("{sample:?}"));
                        }
                        let Some(sample) = sample else { continue };
                        let shadow = sample.shadow_ray(&point);
                        let mut expected = Vec::new();
                        for v in [sample.direction, sample.weight, shadow.origin, shadow.direction] {
                            expected.extend(v.to_array());
                        }
                        expected.extend([shadow.t_max, sample.pdf.value(), sample.emitter as f32]);
                        if bits(rows.iter().map(|row| row[lane])) != bits(expected) {
                            return Err(format!("{sample:?} differs"));
                        }
                        assert_eq!(is_delta >> lane & 1 == 1, sample.is_delta);
                        compared += 1;
                        deltas += i32::from(sample.is_delta);
                    }
                }
            }
        }
        assert!(
            compared > 1_000 && deltas > 100,
            "{compared} samples, {deltas} of points or directions"
        );
        Ok(())
    })
    .unwrap();
}

struct CameraRays<'a> {
    camera: &'a Camera,
    film: [[f32; LANES]; 2],
    u_lens: [[f32; LANES]; 2],
}

impl LaneKernel for CameraRays<'_> {
    const HOT: bool = true;
    type Output = Vec<[f32; LANES]>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let film = [L::load(&self.film[0]), L::load(&self.film[1])];
        let u_lens = [L::load(&self.u_lens[0]), L::load(&self.u_lens[1])];
        let (origin, direction, t_max) = self.camera.ray_lanes(film, u_lens);
        let mut rows = Vec::new();
        rows.extend(origin.store());
        rows.extend(direction.store());
        rows.push(t_max.store());
        rows
    }
}

#[test]
fn camera_rays_in_lanes_are_those_alone() {
    let to_world = Affine3A::from_scale_rotation_translation(
        Vec3::new(-1.5, 0.8, 1.2),
        Quat::from_euler(EulerRot::XYZ, 0.3, -1.1, 2.0),
        Vec3::new(3.0, -0.2, 11.0),
    );
    let lens = Projection::ThinLens {
        aperture_radius: 0.2,
        focus_distance: 3.0,
    };
    check_faults(&[Fault::Pinhole], |fault| {
        for projection in [Projection::Pinhole, lens] {
            let description = CameraDescription {
                to_world,
                fov_x: 0.9,
                projection,
                near_clip: 0.1,
                far_clip: 100.0,
            };
            let camera = Camera::new(&description, 64, 48).unwrap();
            for number in 0..256 {
                let mut rng = CounterRng::new(23, number, 0);
                let film: [[f32; LANES]; 2] =
                    [64.0, 48.0].map(|size| std::array::from_fn(|_| size * rng.next_f32()));
                let u_lens: [[f32; LANES]; 2] = [(); 2].map(|()| std::array::from_fn(|_| rng.next_f32()));
                for choice in LaneChoice::all() {
                    let rows = choice.run(CameraRays {
                        camera: &camera,
                        film,
                        u_lens,
                    });
                    for lane in 0..LANES {
                        let mut u = [u_lens[0][lane], u_lens[1][lane]];
                        if let Some(Fault::Pinhole) = fault {
                            u = [0.5; 2];
                        }
                        let ray = camera.ray(Vec2::new(film[0][lane], film[1][lane]), u);
                        let mut expected = ray.origin.to_array().to_vec();
                        expected.extend(ray.direction.to_array());
                        expected.push(ray.t_max);
                        if bits(rows.iter().map(|row| row[lane])) != bits(expected) {
                            return Err(format!("{ray:?} differs"));
                        }
                    }
                }
            }
        }
        Ok(())
    })
    .unwrap();
}

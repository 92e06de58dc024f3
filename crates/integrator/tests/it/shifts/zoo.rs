//! Scenes, domains and paths to try shifts on.

use lightshed_integrator::SceneWorld;
use lightshed_sampling::{CounterRng, PathSeed};
use lightshed_scene::glam::{Affine3A, Vec2, Vec3};
use lightshed_scene::{
    Checkerboard, ColorTexture, ConductorIor, EmitterDescription, EnvironmentMap, FloatTexture, Geometry,
    Image, Material, Microfacet, Rgb, Roughness, Scene, SceneDescription, ShapeDescription, SphereGeometry,
    builtin,
};
use lightshed_shift::{Connectability, Finding, PathDomain, PathSample, TreeTracer};
use std::sync::Arc;

pub type Domain<'w> = PathDomain<'w, SceneWorld<'w>>;

fn roughness(alpha: f32, distribution: Microfacet) -> Option<Roughness> {
    let alpha = FloatTexture::Constant(alpha);
    Some(Roughness {
        distribution,
        alpha_u: alpha.clone(),
        alpha_v: alpha,
    })
}

/// The Cornell box, open at the front to a sky with a sun, with a checkered floor, spheres of
/// mirror, glass, rough glass, rough metal, coated plastic and a blend, a point light, and an
/// emitting sphere beside the lamp.
pub fn zoo() -> SceneDescription {
    let mut description = builtin::cornell();
    (description.settings.width, description.settings.height) = (32, 32);
    description.settings.max_depth = Some(7);
    let white = ColorTexture::Constant(Rgb::ONE);
    let silver = ConductorIor {
        eta: Rgb::new(0.16, 0.13, 0.14),
        k: Rgb::new(4.0, 3.1, 2.3),
    };
    let metal = |alpha| Material::Conductor {
        ior: silver,
        roughness: roughness(alpha, Microfacet::Ggx),
        specular_reflectance: white.clone(),
    };
    let glass = |roughness| Material::Dielectric {
        eta: 1.5,
        roughness,
        specular_reflectance: white.clone(),
        specular_transmittance: white.clone(),
    };
    let plastic = |alpha| Material::Plastic {
        eta: 1.5,
        diffuse_reflectance: ColorTexture::Constant(Rgb::new(0.2, 0.5, 0.7)),
        specular_reflectance: white.clone(),
        nonlinear: false,
        roughness: roughness(alpha, Microfacet::Beckmann),
    };
    let checkers = Material::TwoSided {
        front: Box::new(Material::Diffuse {
            reflectance: ColorTexture::Checkerboard(Checkerboard {
                color0: Rgb::splat(0.8),
                color1: Rgb::new(0.1, 0.3, 0.1),
                to_uv: lightshed_scene::glam::Affine2::from_scale(Vec2::splat(6.0)),
            }),
        }),
        back: None,
    };
    let blend = Material::Blend {
        weight: FloatTexture::Constant(0.4),
        first: Box::new(metal(0.05)),
        second: Box::new(Material::Diffuse {
            reflectance: ColorTexture::Constant(Rgb::new(0.9, 0.6, 0.2)),
        }),
    };
    let first = description.materials.len() as u32;
    description.materials.extend([
        Material::Mirror {
            reflectance: white.clone(),
        },
        glass(None),
        glass(roughness(0.3, Microfacet::Ggx)),
        metal(0.25),
        plastic(0.1),
        blend,
        checkers,
        Material::Diffuse {
            reflectance: ColorTexture::Constant(Rgb::ZERO),
        },
    ]);
    let mut sphere = |name: &str, material: u32, center: [f32; 3], radius: f32, emission: Option<Rgb>| {
        description.shapes.push(ShapeDescription {
            name: name.to_owned(),
            geometry: Geometry::Sphere(SphereGeometry {
                center: center.into(),
                radius,
                flip_normals: false,
            }),
            material: first + material,
            emission,
        });
    };
    sphere("mirror", 0, [-0.65, -0.75, 0.55], 0.25, None);
    sphere("glass", 1, [0.0, -0.78, 0.75], 0.22, None);
    sphere("rough glass", 2, [0.6, -0.75, 0.7], 0.25, None);
    sphere("metal", 3, [-0.75, 0.3, 0.2], 0.22, None);
    sphere("plastic", 4, [0.75, 0.35, 0.3], 0.22, None);
    sphere("blend", 5, [0.0, 0.1, 0.4], 0.2, None);
    sphere("bulb", 7, [0.5, 0.75, 0.5], 0.08, Some(Rgb::new(9.0, 6.0, 3.0)));
    let mut floor = builtin::quad([
        Vec3::new(-0.99, -0.99, 0.99),
        Vec3::new(0.99, -0.99, 0.99),
        Vec3::new(0.99, -0.99, -0.99),
        Vec3::new(-0.99, -0.99, -0.99),
    ]);
    floor.uvs = vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    description.shapes.push(ShapeDescription {
        name: "checkered floor".to_owned(),
        geometry: Geometry::Mesh(floor),
        material: first + 6,
        emission: None,
    });
    let mut sky = vec![[0.3, 0.4, 0.6]; 16 * 8];
    sky[3 * 16 + 4] = [30.0, 25.0, 20.0];
    sky[3 * 16 + 12] = [30.0, 25.0, 20.0];
    description.emitters.extend([
        EmitterDescription::Point {
            position: Vec3::new(0.2, 0.3, 1.5),
            intensity: Rgb::new(0.3, 0.4, 0.5),
        },
        EmitterDescription::Environment(EnvironmentMap {
            image: Arc::new(Image::from_linear(16, 8, sky).unwrap()),
            scale: 1.0,
            to_world: Affine3A::IDENTITY,
        }),
    ]);
    description
}

/// A scene by name, of 32 × 32 pixels.
pub fn scene(name: &str) -> Scene {
    let mut description = match name {
        "zoo" => zoo(),
        _ => builtin::by_name(name).unwrap(),
    };
    (description.settings.width, description.settings.height) = (32, 32);
    Scene::new(&description).unwrap()
}

/// The mappings under test.
pub fn mappings() -> [(&'static str, Connectability); 3] {
    [
        ("hybrid", Connectability::hybrid(0.2, 0.1).unwrap()),
        ("reconnection", Connectability::RECONNECTION),
        ("replay", Connectability::REPLAY),
    ]
}

/// The domain of a point of the film; `None` where the camera sees no surface.
pub fn domain<'w>(
    world: &'w SceneWorld<'w>,
    film: Vec2,
    connectability: Connectability,
) -> Option<Domain<'w>> {
    let ray = world.scene().camera().ray(film, [0.5; 2]);
    let hit = world.scene().accelerator().intersect(&ray)?;
    let first = world.arrive(&ray, &hit);
    let depth = world.scene().settings().max_depth.unwrap_or(9);
    Some(PathDomain::behind(
        world,
        first,
        -ray.direction,
        connectability,
        depth,
    ))
}

/// Calls `visit` with paths of a random pixel and the domains of that pixel and of one near by,
/// until about `count` paths have been seen.
pub fn random_paths<'w>(
    world: &'w SceneWorld<'w>,
    connectability: Connectability,
    seed: u64,
    count: usize,
    mut visit: impl FnMut(&PathSample, &Domain<'w>, &Domain<'w>),
) {
    let mut tracer = TreeTracer::new(4);
    let (mut seen, mut pixel) = (0, 0);
    while seen < count {
        let mut rng = CounterRng::new(seed, pixel, 0);
        pixel += 1;
        let film = Vec2::from(rng.next_2d()) * 32.0;
        // Mostly neighbours, some far away.
        let reach = if pixel % 8 == 0 { 32.0 } else { 3.0 };
        let other = (film + (Vec2::from(rng.next_2d()) - 0.5) * reach).clamp(Vec2::ZERO, Vec2::splat(31.99));
        let (Some(from), Some(to)) = (
            domain(world, film, connectability),
            domain(world, other, connectability),
        ) else {
            continue;
        };
        let trees: [_; 8] = std::array::from_fn(|_| (&from, PathSeed::draw(&mut rng)));
        tracer.trace(&trees, |_, finding| {
            if let Finding::Path(sample, _) = finding {
                seen += 1;
                visit(sample, &from, &to);
            }
        });
    }
}

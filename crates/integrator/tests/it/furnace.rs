//! The whole renderer where the answer is known: white furnaces, path lengths, roulette, lenses,
//! threads.
//!
//! Seeds are fixed. Statistical tests reject a right renderer with probability 1e-4 each, or what
//! they say.

use crate::rendered::Rendered;
use lightshed_film::{Budget, PixelEstimator, RenderOptions, render};
use lightshed_integrator::{DirectLight, DirectLightOptions, PathTracer};
use lightshed_scene::glam::{Affine3A, Vec3};
use lightshed_scene::{
    ColorTexture, ConductorIor, EmitterDescription, FloatTexture, Geometry, Material, Microfacet, Projection,
    Rgb, Roughness, Scene, SceneDescription, ShapeDescription, SphereGeometry, builtin,
};
use lightshed_testkit::{ImageMoments, StatisticsError, TileOptions, check_faults, compare_tiles};
use std::sync::atomic::AtomicBool;

const WHITE: ColorTexture = ColorTexture::Constant(Rgb::ONE);

/// The built-in furnace with another object in it.
fn furnace_with(geometry: Geometry, material: Material) -> SceneDescription {
    let mut scene = builtin::furnace();
    scene.materials = vec![material];
    scene.shapes = vec![ShapeDescription {
        name: "object".to_owned(),
        geometry,
        material: 0,
        emission: None,
    }];
    scene
}

fn sphere() -> Geometry {
    Geometry::Sphere(SphereGeometry {
        center: Vec3::new(0.1, -0.05, 0.2),
        radius: 1.1,
        flip_normals: false,
    })
}

/// Convex closed meshes: many small faces, and a turned box whose edges light passes within.
fn solids() -> [Geometry; 3] {
    let turned = Affine3A::from_rotation_x(0.6) * Affine3A::from_rotation_y(0.4);
    [
        sphere(),
        Geometry::Mesh(builtin::icosphere(Vec3::ZERO, 1.2, 3)),
        Geometry::Mesh(builtin::cuboid(turned * Affine3A::from_scale(Vec3::splat(0.7)))),
    ]
}

fn mirror(reflectance: f32) -> Material {
    Material::Mirror {
        reflectance: ColorTexture::Constant(Rgb::splat(reflectance)),
    }
}

fn dielectric(eta: f32, roughness: Option<Roughness>) -> Material {
    Material::Dielectric {
        eta,
        roughness,
        specular_reflectance: WHITE,
        specular_transmittance: WHITE,
    }
}

fn thin_dielectric(eta: f32, tint: f32) -> Material {
    Material::ThinDielectric {
        eta,
        specular_reflectance: WHITE,
        specular_transmittance: ColorTexture::Constant(Rgb::splat(tint)),
    }
}

fn rough(distribution: Microfacet, alpha: f32) -> Option<Roughness> {
    Some(Roughness {
        distribution,
        alpha_u: FloatTexture::Constant(alpha),
        alpha_v: FloatTexture::Constant(alpha),
    })
}

fn diffuse(albedo: f32) -> Material {
    Material::Diffuse {
        reflectance: ColorTexture::Constant(Rgb::splat(albedo)),
    }
}

const SIZE: [u32; 2] = [64, 64];

/// The largest `|value − 1|` over pixels and channels.
fn worst_deviation(image: &Rendered) -> f64 {
    image.mean.iter().map(|v| (v - 1.0).abs()).fold(0.0, f64::max)
}

/// Whether every pixel is 1, by the noise of the image itself.
fn white(image: &Rendered) -> Result<(), StatisticsError> {
    let truth = vec![1.0; image.mean.len()];
    let exact = ImageMoments {
        mean: &truth,
        variance_of_mean: &[],
        ..image.moments()
    };
    compare_tiles(&image.moments(), &exact, &TileOptions::default())?.verdict()
}

#[test]
fn a_white_diffuse_sphere_is_white_sample_by_sample() {
    // Cosine sampling has the integrand's own shape: no noise at all. Albedo 0.999 is the planted
    // fault.
    check_faults(&[0.999], |fault| {
        let scene = Scene::new(&furnace_with(sphere(), diffuse(fault.unwrap_or(1.0)))).unwrap();
        let estimator = DirectLight::new(
            &scene,
            scene.emitters_by_power(),
            DirectLightOptions::samples(0, 1),
        )
        .unwrap();
        let deviation = worst_deviation(&Rendered::new(&estimator, SIZE, 4, 1));
        if deviation < 1e-4 { Ok(()) } else { Err(deviation) }
    })
    .unwrap();
}

#[test]
fn emitter_sampling_keeps_the_furnace_white() {
    let scene = Scene::new(&builtin::furnace()).unwrap();
    let darker = Scene::new(&furnace_with(sphere(), diffuse(0.98))).unwrap();
    // The sum of both techniques would hide two errors that cancel, so emitter sampling is tested
    // by itself too. Its noise is the largest, 0.25 % of the sphere's mean: an albedo of 0.98 is 8
    // standard deviations off.
    for (emitter_samples, bsdf_samples) in [(1, 1), (1, 0), (3, 2)] {
        check_faults(&["albedo 0.98"], |fault| {
            let scene = if fault.is_some() { &darker } else { &scene };
            let estimator = DirectLight::new(
                scene,
                scene.emitters_by_power(),
                DirectLightOptions::samples(emitter_samples, bsdf_samples),
            )
            .unwrap();
            white(&Rendered::new(&estimator, SIZE, 128, 2))
        })
        .unwrap();
    }
    check_faults(&["albedo 0.98"], |fault| {
        let scene = if fault.is_some() { &darker } else { &scene };
        white(&Rendered::new(
            &PathTracer::new(scene, scene.emitters_by_power()),
            SIZE,
            128,
            3,
        ))
    })
    .unwrap();
}

#[test]
fn lossless_smooth_materials_are_white_at_every_angle() {
    let faults = [
        ("mirror of 0.99", mirror(0.99)),
        ("slab that absorbs 1 %", thin_dielectric(1.5, 0.99)),
    ];
    let lossless = [
        mirror(1.0),
        dielectric(1.5, None),
        dielectric(1.0 / 1.33, None),
        dielectric(2.4, None),
        thin_dielectric(1.5, 1.0),
        Material::Blend {
            weight: FloatTexture::Constant(0.3),
            first: Box::new(thin_dielectric(2.0, 1.0)),
            second: Box::new(thin_dielectric(1.33, 1.0)),
        },
    ];
    let deviation = |geometry: &Geometry, material: &Material| {
        let scene = Scene::new(&furnace_with(geometry.clone(), material.clone())).unwrap();
        // Each path's weight is one, so that one sample shows the whole of it. Paths that total
        // reflection holds for long end at an edge that none of them reaches in practice.
        let tracer = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(10_000), u32::MAX);
        worst_deviation(&Rendered::new(&tracer, SIZE, 4, 4))
    };
    for geometry in &solids() {
        for material in &lossless {
            let deviation = deviation(geometry, material);
            assert!(deviation < 1e-3, "{material:?}: {deviation}");
        }
        for (fault, material) in &faults {
            assert!(deviation(geometry, material) > 5e-3, "{fault} goes unnoticed");
        }
    }
}

#[test]
fn no_material_gives_more_light_than_it_gets() {
    // Masking loses light, nothing may win any: on convex solids, where light bounces off once, or
    // passes, no tile is brighter than 1 beyond its noise. False-positive rate below 1e-3: 16 tiles
    // × 3 channels × 24 images beyond 4.9 σ.
    let copper = |distribution, alpha| Material::Conductor {
        ior: ConductorIor {
            eta: Rgb::new(0.2, 0.92, 1.1),
            k: Rgb::new(3.9, 2.45, 2.1),
        },
        roughness: rough(distribution, alpha),
        specular_reflectance: WHITE,
    };
    let plastic = |nonlinear, roughness| Material::Plastic {
        eta: 1.5,
        diffuse_reflectance: WHITE,
        specular_reflectance: WHITE,
        nonlinear,
        roughness,
    };
    let materials = [
        copper(Microfacet::Ggx, 0.05),
        copper(Microfacet::Beckmann, 0.6),
        dielectric(1.5, rough(Microfacet::Ggx, 0.3)),
        dielectric(1.5, rough(Microfacet::Beckmann, 0.1)),
        plastic(false, None),
        plastic(true, rough(Microfacet::Ggx, 0.2)),
        Material::TwoSided {
            front: Box::new(Material::Blend {
                weight: FloatTexture::Constant(0.5),
                first: Box::new(diffuse(1.0)),
                second: Box::new(copper(Microfacet::Ggx, 0.2)),
            }),
            back: None,
        },
    ];
    let excess = |geometry: &Geometry, material: &Material, radiance: f32| {
        let mut description = furnace_with(geometry.clone(), material.clone());
        description.emitters = vec![EmitterDescription::Constant {
            radiance: Rgb::splat(radiance),
        }];
        let scene = Scene::new(&description).unwrap();
        let image = Rendered::new(
            &PathTracer::new(&scene, scene.emitters_by_power()).with_depths(None, 8),
            SIZE,
            32,
            5,
        );
        let truth = vec![1.0; image.mean.len()];
        let exact = ImageMoments {
            mean: &truth,
            variance_of_mean: &[],
            ..image.moments()
        };
        let report = compare_tiles(&image.moments(), &exact, &TileOptions::default()).unwrap();
        report.tiles.iter().map(|tile| tile.z).fold(0.0, f64::max)
    };
    for geometry in &solids() {
        for material in &materials {
            let z = excess(geometry, material, 1.0);
            assert!(z < 4.9, "{material:?}: a tile at {z} σ");
        }
        let z = excess(geometry, &diffuse(1.0), 1.05);
        assert!(z > 4.9, "light that is 5 % too bright goes unnoticed: {z} σ");
    }
}

/// Two images of estimators that should agree.
fn agree(a: &Rendered, b: &Rendered) -> Result<(), StatisticsError> {
    compare_tiles(&a.moments(), &b.moments(), &TileOptions::default())?.verdict()
}

#[test]
fn one_edge_shows_emitters_and_none_shows_nothing() {
    let description = builtin::cornell();
    let scene = Scene::new(&description).unwrap();
    let radiance = description.shapes.iter().find_map(|s| s.emission).unwrap();
    let none = Rendered::new(
        &PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(0), 1000),
        SIZE,
        1,
        6,
    );
    assert!(none.mean.iter().all(|&v| v == 0.0));
    let camera = Scene::new(&SceneDescription {
        settings: lightshed_scene::RenderSettings {
            width: SIZE[0],
            height: SIZE[1],
            ..description.settings
        },
        ..description
    })
    .unwrap();
    let one = Rendered::new(
        &PathTracer::new(&camera, camera.emitters_by_power()).with_depths(Some(1), 1000),
        SIZE,
        4,
        6,
    );
    let whole = one.mean.chunks(3).filter(|p| {
        p.iter()
            .zip(radiance.to_array())
            .all(|(&v, l)| (v - f64::from(l)).abs() < 1e-5 * f64::from(l))
    });
    let black = one.mean.chunks(3).filter(|p| p.iter().all(|&v| v == 0.0));
    let (whole, black) = (whole.count(), black.count());
    // The light is a thin trapezium of some 13 × 3 pixels; the rest of those it touches are in
    // between.
    assert!(whole > 10, "{whole} pixels show the light");
    assert!(
        black > 3900 && whole + black < 4096,
        "{black} black, {whole} bright"
    );
}

/// A box with glossy and diffuse lobes, for small images.
fn glossy_box() -> SceneDescription {
    let mut description = builtin::cornell_glossy();
    (description.settings.width, description.settings.height) = (SIZE[0], SIZE[1]);
    description
}

/// Adds up two estimators.
struct Sum<A, B>(A, B);

impl<A: PixelEstimator, B: PixelEstimator> PixelEstimator for Sum<A, B> {
    fn sample(&self, x: u32, y: u32, sample_index: u32, seed: u64) -> Rgb {
        self.0.sample(x, y, sample_index, seed) + self.1.sample(x, y, sample_index, seed ^ 1)
    }
}

#[test]
fn two_edges_are_direct_light() {
    let scene = Scene::new(&glossy_box()).unwrap();
    let path = |edges, seed| {
        Rendered::new(
            &PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(edges), 1000),
            SIZE,
            64,
            seed,
        )
    };
    let two = path(2, 7);
    for (emitter_samples, bsdf_samples) in [(1, 1), (4, 1), (1, 3), (0, 2), (2, 0)] {
        let direct = DirectLight::new(
            &scene,
            scene.emitters_by_power(),
            DirectLightOptions::samples(emitter_samples, bsdf_samples),
        )
        .unwrap();
        agree(&Rendered::new(&direct, SIZE, 64, 8), &two).unwrap();
    }
    // What must be told apart: a bounce more, a bounce less, and both techniques without weights.
    agree(&path(3, 9), &two).unwrap_err();
    agree(&path(1, 9), &two).unwrap_err();
    let unweighted = Sum(
        DirectLight::new(
            &scene,
            scene.emitters_by_power(),
            DirectLightOptions::samples(1, 0),
        )
        .unwrap(),
        DirectLight::new(
            &scene,
            scene.emitters_by_power(),
            DirectLightOptions::samples(0, 1),
        )
        .unwrap(),
    );
    agree(&Rendered::new(&unweighted, SIZE, 64, 9), &two).unwrap_err();
}

#[test]
fn impossible_numbers_of_samples_are_errors() {
    let scene = Scene::new(&builtin::furnace()).unwrap();
    assert!(
        DirectLight::new(
            &scene,
            scene.emitters_by_power(),
            DirectLightOptions::samples(0, 0)
        )
        .is_err()
    );
    assert!(
        DirectLight::new(
            &scene,
            scene.emitters_by_power(),
            DirectLightOptions::samples(1, u32::MAX)
        )
        .is_err()
    );
    assert!(
        DirectLight::new(
            &scene,
            scene.emitters_by_power(),
            DirectLightOptions::samples(0, 1)
        )
        .is_ok()
    );
}

#[test]
fn roulette_changes_no_mean() {
    // Glass too, whose radiance scaling roulette has to undo.
    let mut description = glossy_box();
    description.materials.push(dielectric(1.5, None));
    description.shapes[5].material = description.materials.len() as u32 - 1;
    let scene = Scene::new(&description).unwrap();
    let image = |edges, roulette, seed| {
        let tracer = PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(edges), roulette);
        Rendered::new(&tracer, SIZE, 128, seed)
    };
    let without = image(6, 1000, 10);
    for roulette in [1, 3] {
        agree(&image(6, roulette, 11), &without).unwrap();
    }
    // Paths that end without being made up for would be worse than this.
    agree(&image(4, 1000, 12), &without).unwrap_err();
}

/// Emissive squares at two distances from the camera at the origin, which looks along +Z.
fn squares(projection: Projection) -> SceneDescription {
    let mut description = SceneDescription {
        materials: vec![diffuse(0.0)],
        ..SceneDescription::default()
    };
    for (index, (x, y, z)) in [(-0.6, 0.1, 4.0), (0.3, 0.4, 4.0), (0.1, -0.5, 4.0)]
        .into_iter()
        .enumerate()
    {
        // Wound so that the normal points at the camera.
        let corners = [(-0.2, -0.2), (-0.2, 0.2), (0.2, 0.2), (0.2, -0.2)];
        description.shapes.push(ShapeDescription {
            name: format!("square {index}"),
            geometry: Geometry::Mesh(builtin::quad(
                corners.map(|(dx, dy)| Vec3::new(x + dx, y + dy, z)),
            )),
            material: 0,
            emission: Some(Rgb::new(1.0, 2.0, 0.5) * (index + 1) as f32),
        });
    }
    description.camera.projection = projection;
    (description.settings.width, description.settings.height) = (SIZE[0], SIZE[1]);
    description
}

#[test]
fn a_lens_shows_the_plane_in_focus_as_a_pinhole_does() {
    let image = |projection, seed| {
        let scene = Scene::new(&squares(projection)).unwrap();
        Rendered::new(
            &PathTracer::new(&scene, scene.emitters_by_power()).with_depths(Some(1), 1000),
            SIZE,
            256,
            seed,
        )
    };
    let lens = |focus_distance| Projection::ThinLens {
        aperture_radius: 0.3,
        focus_distance,
    };
    let pinhole = image(Projection::Pinhole, 13);
    let lit = pinhole.mean.iter().filter(|&&v| v > 0.0).count();
    assert!(lit > 300, "only {lit} values show the squares");
    // Edges blur by half a pixel where the fault is planted: small tiles see it.
    let fine = TileOptions {
        tile_size: 2,
        ..TileOptions::default()
    };
    check_faults(&["focus 10 % too far"], |fault| {
        let seen = image(lens(if fault.is_some() { 4.4 } else { 4.0 }), 14);
        compare_tiles(&seen.moments(), &pinhole.moments(), &fine)?.verdict()
    })
    .unwrap();
    // Out of focus the light is spread, not lost: what leaves a square arrives.
    let blurred = image(lens(4.5), 15);
    let sum = |image: &Rendered| image.mean.iter().sum::<f64>();
    assert!((sum(&blurred) / sum(&pinhole) - 1.0).abs() < 0.02);
}

#[test]
fn threads_do_not_change_the_image() {
    let scene = Scene::new(&glossy_box()).unwrap();
    let film = |threads, seed| {
        let mut options = RenderOptions::new(SIZE[0], SIZE[1], Budget::Samples(6));
        (options.threads, options.seed) = (threads, seed);
        render(
            &PathTracer::new(&scene, scene.emitters_by_power()),
            &options,
            &|_| (),
            &AtomicBool::new(false),
        )
        .unwrap()
        .film
    };
    let one = film(1, 16);
    for threads in [2, 5] {
        assert!(film(threads, 16) == one, "{threads} threads change the image");
    }
    assert!(film(1, 17) != one, "the seed changes nothing");
}

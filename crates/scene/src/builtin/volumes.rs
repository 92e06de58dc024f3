//! Scenes with participating media: a cloud, smoke in a room, a fire.

use super::cornell::cornell;
use super::mesh::{cuboid, quad};
use super::noise::{fractal, smoothstep};
use crate::{
    CameraDescription, ColorTexture, DensityDescription, EmissionDescription, EmitterDescription,
    EnvironmentMap, Geometry, GridDescription, GridFilter, Image, Material, MediumBoundary,
    MediumDescription, PhaseDescription, RenderSettings, Rgb, SceneDescription, ShapeDescription,
};
use glam::{Affine3A, Vec3, Vec3A};
use std::sync::Arc;

/// A cloud under a blue sky with a bright, warm sun of some degrees: a grid of 80 × 56 × 80
/// voxels, albedo 1, isotropic, with a mean free path of a twentieth of its width where it is
/// densest. Nothing else. 192 × 128 pixels, `max_depth` 8.
///
/// Values are computed in code, the same everywhere but for the last bit of a platform's functions.
pub fn cloud() -> SceneDescription {
    const SIZE: [u32; 3] = [80, 56, 80];
    let extent = Vec3::new(2.0, 1.4, 2.0);
    let grid = voxels(SIZE, extent, |p| {
        // Some balls run into one another; noise eats into them from outside.
        let balls = [
            (Vec3::new(0.0, -0.12, 0.0), 0.62),
            (Vec3::new(-0.48, -0.2, 0.15), 0.42),
            (Vec3::new(0.5, -0.18, -0.1), 0.44),
            (Vec3::new(0.12, 0.22, 0.1), 0.38),
            (Vec3::new(-0.1, -0.1, 0.5), 0.36),
        ];
        let inside = balls
            .map(|(center, radius): (Vec3, f32)| 1.0 - (p - center).length() / radius)
            .into_iter()
            .fold(-1.0f32, f32::max);
        let eroded = inside + 1.1 * (fractal(p * 4.0, 5) - 0.55);
        smoothstep(0.0, 0.35, eroded)
    });
    let mut scene = SceneDescription {
        emitters: vec![EmitterDescription::Environment(sky())],
        camera: camera(Vec3::new(0.0, -0.55, 3.6), Vec3::new(0.0, 0.0, 0.0), 40.0),
        settings: settings(192, 128, 8),
        ..SceneDescription::default()
    };
    let medium = MediumDescription {
        name: "cloud".to_owned(),
        density: DensityDescription::Grid(grid),
        extinction: Rgb::splat(20.0),
        albedo: Rgb::ONE,
        albedo_grids: Vec::new(),
        phase: PhaseDescription::Isotropic,
        emission: None,
    };
    fill(&mut scene, medium, Vec3::ZERO, extent);
    scene
}

/// The Cornell box with a plume of grey-blue smoke that rises between the boxes, around them and in
/// front of them: a grid of 48 × 64 × 48 voxels, scattering forward with an asymmetry of 0.4. 192
/// × 192 pixels, `max_depth` 8.
pub fn smoke_in_cornell() -> SceneDescription {
    const SIZE: [u32; 3] = [48, 64, 48];
    let extent = Vec3::new(1.5, 1.86, 1.5);
    let grid = voxels(SIZE, extent, |p| {
        // A plume that widens and turns as it rises.
        let height = p.y / extent.y + 0.5;
        let (sin, cos) = (3.5 * height).sin_cos();
        let axis = Vec3::new(0.22 * height * cos, p.y, 0.22 * height * sin);
        let width = 0.16 + 0.42 * height;
        let inside = 1.0 - (p - axis).length() / width;
        let wisps = fractal(Vec3::new(p.x, p.y * 0.6, p.z) * 4.0, 4);
        let fade = smoothstep(0.0, 0.08, height) * smoothstep(0.0, 0.15, 1.0 - height);
        fade * smoothstep(0.0, 0.5, inside + 1.4 * (wisps - 0.5))
    });
    let mut scene = cornell();
    scene.settings = RenderSettings {
        roulette_depth: 1_000,
        ..settings(192, 192, 8)
    };
    let medium = MediumDescription {
        name: "smoke".to_owned(),
        density: DensityDescription::Grid(grid),
        extinction: Rgb::splat(6.0),
        albedo: Rgb::new(0.82, 0.86, 0.9),
        albedo_grids: Vec::new(),
        phase: PhaseDescription::HenyeyGreenstein { g: 0.4 },
        emission: None,
    };
    fill(&mut scene, medium, Vec3::new(0.0, -0.02, 0.1), extent);
    scene
}

/// A fire over a grey floor, at night: flames that emit where they are hottest, with smoke above,
/// whose extinction is stronger in the blue. A grid of 48 × 72 × 48 voxels, emission in another
/// of that size. 160 × 192 pixels, `max_depth` 6.
pub fn fire() -> SceneDescription {
    const SIZE: [u32; 3] = [48, 72, 48];
    let extent = Vec3::new(1.2, 1.8, 1.2);
    // Inside of the flames, 1 at their axis.
    let flame = |p: Vec3| {
        let height = p.y / extent.y + 0.5;
        let sway = 0.1 * height * (fractal(Vec3::new(0.3, p.y * 2.0, 0.7), 2) - 0.5);
        let width = 0.36 * (1.0 - 0.55 * height) * smoothstep(0.0, 0.12, height) + 0.02;
        let licks = fractal(Vec3::new(p.x * 4.0, p.y * 2.0 - 1.3, p.z * 4.0), 4);
        let inside = 1.0 - Vec3::new(p.x - sway, 0.0, p.z).length() / width + 1.2 * (licks - 0.5);
        (inside, height)
    };
    let density = voxels(SIZE, extent, |p| {
        let (inside, height) = flame(p);
        let fade = smoothstep(0.0, 0.05, height) * smoothstep(0.0, 0.2, 1.0 - height);
        fade * (0.15 + 0.85 * height) * smoothstep(0.0, 0.6, inside)
    });
    let heat = voxels(SIZE, extent, |p| {
        let (inside, height) = flame(p);
        let cooling = 1.0 - smoothstep(0.35, 0.85, height);
        smoothstep(0.0, 0.9, inside).powi(2) * cooling
    });
    let corner = |x: f32, z: f32| Vec3::new(x, -0.95, z);
    let mut scene = SceneDescription {
        shapes: vec![ShapeDescription {
            name: "floor".to_owned(),
            geometry: Geometry::Mesh(quad([
                corner(-3.0, 3.0),
                corner(3.0, 3.0),
                corner(3.0, -3.0),
                corner(-3.0, -3.0),
            ])),
            material: 0,
            emission: None,
        }],
        materials: vec![Material::Diffuse {
            reflectance: ColorTexture::Constant(Rgb::splat(0.4)),
        }],
        emitters: vec![EmitterDescription::Constant {
            radiance: Rgb::new(0.01, 0.012, 0.02),
        }],
        camera: camera(Vec3::new(0.0, 0.1, 4.2), Vec3::new(0.0, -0.1, 0.0), 32.0),
        settings: settings(160, 192, 6),
        ..SceneDescription::default()
    };
    let medium = MediumDescription {
        name: "fire".to_owned(),
        density: DensityDescription::Grid(density),
        extinction: Rgb::new(4.0, 4.8, 6.0),
        albedo: Rgb::splat(0.5),
        albedo_grids: Vec::new(),
        phase: PhaseDescription::HenyeyGreenstein { g: 0.3 },
        emission: Some(EmissionDescription {
            radiance: Rgb::new(40.0, 13.0, 2.5),
            grid: Some(heat),
        }),
    };
    fill(&mut scene, medium, Vec3::ZERO, extent);
    scene
}

/// A grid over the box of that extent around the origin, of the values of a function of the voxels'
/// centres there.
fn voxels(size: [u32; 3], extent: Vec3, value: impl Fn(Vec3) -> f32) -> GridDescription {
    let mut values = Vec::with_capacity(size.map(|n| n as usize).iter().product());
    let step = extent / Vec3::from_array(size.map(|n| n as f32));
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let cell = Vec3::new(x as f32 + 0.5, y as f32 + 0.5, z as f32 + 0.5);
                values.push(value(cell * step - 0.5 * extent));
            }
        }
    }
    GridDescription {
        resolution: size,
        values: values.into(),
        filter: GridFilter::Trilinear,
        to_world: Affine3A::from_translation(-0.5 * extent) * Affine3A::from_scale(extent),
    }
}

/// Puts a medium into a box of that extent around `center`, which bounds it.
fn fill(scene: &mut SceneDescription, mut medium: MediumDescription, center: Vec3, extent: Vec3) {
    let shift = Affine3A::from_translation(center);
    if let DensityDescription::Grid(grid) = &mut medium.density {
        grid.to_world = shift * grid.to_world;
    }
    if let Some(grid) = medium
        .emission
        .as_mut()
        .and_then(|emission| emission.grid.as_mut())
    {
        grid.to_world = shift * grid.to_world;
    }
    scene.boundaries.push(MediumBoundary {
        shape: scene.shapes.len() as u32,
        interior: Some(scene.media.len() as u32),
        exterior: None,
    });
    scene.shapes.push(ShapeDescription {
        name: medium.name.clone(),
        geometry: Geometry::Mesh(cuboid(shift * Affine3A::from_scale(0.5 * extent))),
        material: scene.materials.len() as u32,
        emission: None,
    });
    scene.materials.push(Material::Null);
    scene.media.push(medium);
}

/// A sky that is bluer overhead, over dark ground, with a sun 35° above the horizon, to the right
/// and behind the camera.
fn sky() -> EnvironmentMap {
    const SIZE: [u32; 2] = [128, 64];
    let sun = Vec3::new(0.65, 0.57, 0.5).normalize();
    let mut pixels = Vec::with_capacity((SIZE[0] * SIZE[1]) as usize);
    for row in 0..SIZE[1] {
        let (sin_theta, cos_theta) = (row as f32 / (SIZE[1] - 1) as f32 * std::f32::consts::PI).sin_cos();
        for column in 0..SIZE[0] {
            let phi = (column as f32 + 0.5) / SIZE[0] as f32 * std::f32::consts::TAU;
            let direction = Vec3::new(sin_theta * phi.sin(), cos_theta, -sin_theta * phi.cos());
            let up = direction.y.max(0.0);
            let air = Rgb::new(0.62, 0.72, 0.85).lerp(Rgb::new(0.18, 0.34, 0.7), up.sqrt());
            let ground = Rgb::new(0.14, 0.13, 0.11);
            let background = ground.lerp(air, smoothstep(-0.06, 0.06, direction.y));
            let glare = smoothstep(0.995, 0.998, direction.dot(sun));
            pixels.push((background + Rgb::new(180.0, 150.0, 115.0) * glare).to_array());
        }
    }
    EnvironmentMap {
        image: Arc::new(
            Image::from_linear(SIZE[0], SIZE[1], pixels).expect("as many pixels as the size says"),
        ),
        scale: 1.0,
        to_world: Affine3A::IDENTITY,
    }
}

/// A camera at `origin` that looks at `target`.
fn camera(origin: Vec3, target: Vec3, degrees: f32) -> CameraDescription {
    let forward = (target - origin).normalize();
    let left = Vec3::Y.cross(forward).normalize();
    CameraDescription {
        to_world: Affine3A::from_cols(
            Vec3A::from(left),
            Vec3A::from(forward.cross(left)),
            Vec3A::from(forward),
            Vec3A::from(origin),
        ),
        fov_x: degrees.to_radians(),
        ..CameraDescription::default()
    }
}

fn settings(width: u32, height: u32, max_depth: u32) -> RenderSettings {
    RenderSettings {
        width,
        height,
        samples_per_pixel: 64,
        max_depth: Some(max_depth),
        roulette_depth: 1_000,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MediumDensity, Scene};

    /// Mean density and share of empty voxels, as the pictures were judged by.
    #[test]
    fn densities_are_what_they_are() {
        for (scene, mean, empty) in [
            (cloud(), 0.21, 0.7),
            (smoke_in_cornell(), 0.1, 0.75),
            (fire(), 0.05, 0.8),
        ] {
            let DensityDescription::Grid(grid) = &scene.media[0].density else {
                panic!("a grid");
            };
            let count = grid.values.len() as f32;
            let found = grid.values.iter().sum::<f32>() / count;
            let zeros = grid.values.iter().filter(|&&v| v == 0.0).count() as f32 / count;
            println!("{}: mean {found}, empty {zeros}", scene.media[0].name);
            assert!((found / mean - 1.0).abs() < 0.5, "{found}");
            assert!((zeros - empty).abs() < 0.2, "{zeros}");
            assert!(grid.values.iter().all(|v| (0.0..=1.0).contains(v)));
            let built = Scene::new(&scene).unwrap();
            assert!(matches!(built.media()[0].density(), MediumDensity::Grid(_)));
            assert_eq!(built.camera_medium(built.camera()), None);
            // The boundary is the grid's box.
            assert_eq!(
                built.medium_around(grid.to_world.transform_point3(Vec3::splat(0.5))),
                Some(0)
            );
        }
    }
}

//! Skies.

use crate::tests::parity::harness::{COUNT, Shader, Tier, compare, directions, floats, gpu, unit_numbers};
use crate::tests::support::exact_gpu;
use crate::{Buffer, Gpu};
use glam::{Affine3A, Vec3};
use lightshed_sampling::{CounterRng, PiecewiseConstant2d};
use lightshed_scene::{
    EmitterDescription, EnvironmentMap, FlatScene, FlatSky, Image, Rgb, Scene, SceneDescription, SkySampling,
    builtin, luminance,
};
use std::sync::Arc;

const HOST: &str = "
    import package::lightshed::sky::Sky;
    @group(0) @binding(2) var<storage, read> about: Sky;
    @group(0) @binding(3) var<storage, read> words: array<u32>;
    fn sky() -> Sky { return about; }
    fn load_sky_word(index: u32) -> u32 { return words[index]; }";

/// An image of noise over six decades, with black rows and cells, turned around.
fn map([width, height]: [u32; 2]) -> EnvironmentMap {
    let mut rng = CounterRng::new(81, width, height);
    let mut texel = |i: u32| {
        let dark = height > 4 && (i / width < 2 || i % 7 < 3);
        let brightness = if dark {
            0.0
        } else {
            10f32.powf(6.0 * rng.next_f32() - 3.0)
        };
        (brightness * Rgb::new(rng.next_f32(), rng.next_f32(), rng.next_f32())).to_array()
    };
    EnvironmentMap {
        image: Arc::new(
            Image::from_linear(width, height, (0..width * height).map(&mut texel).collect())
                .expect("all texels"),
        ),
        scale: 1.7,
        to_world: Affine3A::from_rotation_y(0.4) * Affine3A::from_rotation_x(-1.1),
    }
}

/// A scene with nothing but that sky.
fn scene(map: &EnvironmentMap) -> Scene {
    Scene::new(&SceneDescription {
        emitters: vec![EmitterDescription::Environment(map.clone())],
        ..builtin::cornell()
    })
    .expect("a box under a sky")
}

/// The distribution that an image gives, by the definition.
fn distribution(map: &EnvironmentMap) -> PiecewiseConstant2d {
    let (width, height) = (map.image.width(), map.image.height());
    let rows = height.max(2) - 1;
    let mut weights = Vec::new();
    for row in 0..rows {
        let sin_theta = ((f64::from(row) + 0.5) / f64::from(rows) * std::f64::consts::PI).sin();
        for column in 0..width {
            let brightness =
                |x: u32, y: u32| f64::from(luminance(map.image.texel(x % width, y.min(height - 1))));
            let sum = brightness(column, row)
                + brightness(column + 1, row)
                + brightness(column, row + 1)
                + brightness(column + 1, row + 1);
            weights.push((0.25 * sum * sin_theta) as f32);
        }
    }
    PiecewiseConstant2d::new(&weights, width as usize).expect("some light")
}

/// What the host reads.
fn buffers(gpu: &Gpu, sky: &FlatSky) -> [Buffer; 2] {
    let [x, y, z] = sky.axes;
    let about: Vec<u32> = [
        [x.x, x.y, x.z, sky.scale].map(f32::to_bits),
        [y.x.to_bits(), y.y.to_bits(), y.z.to_bits(), sky.last_row],
        [z.x.to_bits(), z.y.to_bits(), z.z.to_bits(), 0],
        [sky.size[0], sky.size[1], 0, 0],
    ]
    .concat();
    [
        gpu.buffer("about", &about).expect("it is small"),
        gpu.buffer("words", &sky.words).expect("they are few"),
    ]
}

/// Numbers that differ by more than a share of the largest of the truth's, or of 1.
fn unlike(found: &[u32], truth: &[f32], tolerance: f32) -> bool {
    let scale = truth.iter().fold(0.0f32, |scale, x| scale.max(x.abs())).max(1e-3);
    let numbers = found.iter().map(|&word| f32::from_bits(word));
    numbers
        .zip(truth)
        .any(|(found, &truth)| !((found - truth).abs() <= tolerance * scale))
}

const SIZES: [[u32; 2]; 4] = [[64, 33], [9, 5], [1, 1], [5, 1]];

/// Cells are chosen exactly; directions, densities and radiances of the choice lie within bounds.
#[test]
fn samples() {
    let Some(gpu) = exact_gpu() else { return };
    for (size, salt) in SIZES.into_iter().zip(90..) {
        let map = map(size);
        let scene = scene(&map);
        let environment = scene.emitters().environment().expect("there is one");
        let table = distribution(&map);
        let sky = FlatScene::new(&scene, SkySampling::Luminance)
            .expect("it is flat")
            .sky
            .expect("it is an image");
        let buffers = buffers(gpu, &sky);
        let shader = Shader {
            host: HOST,
            buffers: &[&buffers[0], &buffers[1]],
            ..Shader::new(
                "import package::lightshed::sky::sky_sample;",
                "let s = sky_sample(vec2f(number(0u), number(1u)));
                 put(0u, s.cell.x); put(1u, s.cell.y); put_3(2u, s.direction); put_f(5u, s.pdf); put_3(6u, s.radiance);",
            )
        };
        let inputs = unit_numbers::<2>(salt);
        let found = shader.run::<2, 9>(gpu, &inputs);
        let cells: Vec<[u32; 2]> = found.iter().map(|found| [found[0], found[1]]).collect();
        let choice = |words: &[u32; 2]| table.sample(floats(words)).cell;
        compare("choice of a cell", Tier::Words, &inputs, &cells, choice).expect("cells are the library's");
        // Another row of the table is noticed.
        if size[1] > 1 {
            let planted = |words: &[u32; 2]| choice(words).map(|x| x.max(1));
            assert!(compare("planted", Tier::Words, &inputs, &cells, planted).is_err());
        }
        let mut off = 0;
        for (input, found) in inputs.iter().zip(&found) {
            let Some((direction, radiance, pdf)) = environment.sample(floats(input)) else {
                assert!(f32::from_bits(found[5]) == 0.0, "{input:?}: {found:?}");
                continue;
            };
            assert!(
                !unlike(&found[2..5], &direction.to_array(), 2e-6),
                "{input:?}: {found:?} for {direction}"
            );
            // Near the poles a density is as good as the polar angle.
            let local = glam::Mat3::from_cols(sky.axes[0], sky.axes[1], sky.axes[2]) * direction;
            let sin_theta = local.x.hypot(local.z).max(1e-7);
            assert!(
                !unlike(&found[5..6], &[pdf.value()], 1e-6 + 3e-7 / sin_theta),
                "{input:?}: {found:?} for {pdf:?}"
            );
            // A texel apart are values as different as you like.
            off += u32::from(unlike(&found[6..9], &radiance.to_array(), 1e-3));
        }
        assert!(off * 1000 < COUNT as u32, "{size:?}: radiances of {off}");
    }
}

/// Radiances and densities of given directions, but where rounding leads into the cell beside.
#[test]
fn directions_are_looked_up() {
    let Some(gpu) = gpu() else { return };
    for (size, salt) in SIZES.into_iter().zip(95..) {
        let map = map(size);
        let scene = scene(&map);
        let environment = scene.emitters().environment().expect("there is one");
        let sky = FlatScene::new(&scene, SkySampling::Luminance)
            .expect("it is flat")
            .sky
            .expect("it is an image");
        let inputs = directions(salt);
        let worst = |sky: &FlatSky| {
            let buffers = buffers(gpu, sky);
            let shader = Shader {
                host: HOST,
                buffers: &[&buffers[0], &buffers[1]],
                ..Shader::new(
                    "import package::lightshed::sky::{sky_pdf, sky_radiance};",
                    "let d = vec3f(number(0u), number(1u), number(2u)); put_3(0u, sky_radiance(d)); put_f(3u, sky_pdf(d));",
                )
            };
            let found = shader.run::<3, 4>(gpu, &inputs);
            let mut unlike_count = [0; 2];
            for (input, found) in inputs.iter().zip(&found) {
                let direction = Vec3::from_array(floats(input));
                let radiance = environment.radiance(direction).to_array();
                unlike_count[0] += u32::from(unlike(&found[..3], &radiance, 1e-3));
                unlike_count[1] +=
                    u32::from(unlike(&found[3..], &[environment.pdf(direction).value()], 1e-4));
            }
            unlike_count
        };
        let unlike_count = worst(&sky);
        println!("{size:?}: {unlike_count:?} of {COUNT}");
        assert!(
            unlike_count.iter().all(|&count| count * 1000 < COUNT as u32),
            "{size:?}: {unlike_count:?}"
        );
        if size[1] > 1 {
            // A rotation the other way.
            let [x, y, z] = sky.axes;
            let transposed = glam::Mat3::from_cols(x, y, z).transpose();
            let planted = FlatSky {
                axes: [transposed.x_axis, transposed.y_axis, transposed.z_axis],
                ..sky
            };
            assert!(worst(&planted).iter().any(|&count| count * 1000 > COUNT as u32));
        }
    }
}

#[test]
fn angles_in_turns() {
    let Some(gpu) = gpu() else { return };
    let inputs: Vec<[u32; 2]> = directions(99).iter().map(|&[x, y, _]| [x, y]).collect();
    let shader = Shader::new(
        "import package::lightshed::turn::turn_of;",
        "put_f(0u, turn_of(number(0u), number(1u)));",
    );
    let truth = |words: &[u32; 2]| {
        let [y, x] = floats(words).map(f64::from);
        [((y.atan2(x) / std::f64::consts::TAU) as f32).to_bits()]
    };
    let found = shader.run::<2, 1>(gpu, &inputs);
    let within = |absolute| Tier::Bounded {
        absolute,
        relative: 0.0,
    };
    assert_eq!(compare("angle", within(6e-8), &inputs, &found, truth), Ok(()));
    assert!(compare("planted", within(6e-9), &inputs, &found, truth).is_err());
}

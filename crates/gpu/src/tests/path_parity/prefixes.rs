//! Prefixes on the device, the light along them and their shift are those of the library.

use super::{LENGTH, SIDE, most_differences, run, tolerance, zoo};
use crate::GpuScene;
use crate::tests::support::{gpu, planted};
use lightshed_integrator::{SceneVertex, SceneWorld};
use lightshed_resampling::{ShiftMapping, Undefined};
use lightshed_sampling::{CounterRng, PathSeed};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Rgb, Scene};
use lightshed_shift::{
    Connectability, Place, PrefixDomain, PrefixFinding, PrefixSample, PrefixShift, PrefixStart, PrefixTracer,
    WorldGeometry,
};

/// Prefixes, and the domains that they are carried to.
const PAIRS: usize = 1 << 14;

const PROGRAM: &str = "
    import package::threads::thread_number;
    import package::memory::scene::settings;
    import package::lightshed::connectability::Connectability;
    import package::lightshed::path_prefix::{NO_LIGHT, PrefixDomain, PrefixReservoir, shift_prefix, trace_prefix};
    import package::lightshed::path_shift::{DEFINED, path_jacobian};
    import package::lightshed::path_vertex::vertex_at;
    struct Start { primitive: u32, v: f32, w: f32, seed_low: u32, wo: vec3f, seed_high: u32 }
    struct Found {
        prefix: PrefixReservoir,
        light: vec3f, outcome: u32,
        throughput: vec3f, jacobian: f32,
        wo: vec3f, same: u32,
        padding: vec4u,
    }
    @group(2) @binding(1) var<storage, read_write> samples: array<vec4u>;
    @group(2) @binding(2) var<storage, read> starts: array<Start>;
    @group(2) @binding(3) var<storage, read_write> found: array<Found>;
    @group(2) @binding(4) var<storage, read> rules: Connectability;
    fn domain_of(start: Start) -> PrefixDomain {
        return PrefixDomain(vertex_at(start.primitive, vec2f(start.v, start.w)), start.wo, settings.max_depth, rules);
    }
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
        let index = thread_number(id, groups);
        if 2u * index + 1u >= arrayLength(&starts) { return; }
        let start = starts[2u * index];
        let seed = vec2u(start.seed_low, start.seed_high);
        let traced = trace_prefix(domain_of(start), seed, 0u, settings.roulette_depth);
        // Light asks for no numbers of the prefix.
        let dark = trace_prefix(domain_of(start), seed, NO_LIGHT, settings.roulette_depth);
        let same = all(dark.prefix.throughput == traced.prefix.throughput) && all(dark.light == vec3f(0.0));
        var answer = Found();
        answer.prefix = traced.prefix;
        answer.light = traced.light;
        answer.same = u32(same);
        if traced.prefix.weight > 0.0 {
            let image = shift_prefix(traced.prefix, domain_of(starts[2u * index + 1u]));
            answer.outcome = image.outcome;
            if image.outcome == DEFINED {
                answer.throughput = image.prefix.throughput;
                answer.wo = image.prefix.wo;
                answer.jacobian = path_jacobian(traced.prefix.density, image.prefix.density);
            }
        }
        found[index] = answer;
    }";

/// Words of a [`Found`](PROGRAM).
type Words = [u32; 32];

type Domain<'a> = PrefixDomain<'a, SceneWorld<'a>>;

/// What a place of the image sees, as a domain and as a shader reads it.
fn domain<'a>(
    world: &'a SceneWorld<'a>,
    place: Vec2,
    ends: Connectability,
) -> Option<(Domain<'a>, [u32; 8])> {
    let scene = world.scene();
    let ray = scene.camera().ray(place, [0.5; 2]);
    let hit = scene.accelerator().intersect(&ray)?;
    let vertex: SceneVertex = world.arrive(&ray, &hit);
    let Place {
        primitive,
        coordinates: [v, w],
    } = world.place(&vertex);
    let wo = -ray.direction;
    let [x, y, z] = wo.to_array().map(f32::to_bits);
    let words = [primitive, v.to_bits(), w.to_bits(), 0, x, y, z, 0];
    Some((PrefixDomain::behind(world, vertex, wo, ends, LENGTH), words))
}

/// The library's prefix with its weight, the light along it, and its image.
struct Truth {
    prefix: Option<(PrefixSample, f32)>,
    light: Rgb,
    image: Option<Result<(PrefixSample, f32), Undefined>>,
}

/// Whether words are numbers within a share of others.
fn close(tolerance: f32, found: &[u32], truth: &[f32]) -> bool {
    found.iter().zip(truth).all(|(&found, &truth)| {
        let found = f32::from_bits(found);
        found.to_bits() == truth.to_bits() || (found - truth).abs() <= tolerance * truth.abs()
    })
}

fn agrees(tolerance: f32, found: &Words, truth: &Truth) -> bool {
    // Sums and quotients of weights are rounded otherwise.
    let loose = tolerance.max(1e-6);
    if found[27] != 1 || !close(loose, &found[16..19], &truth.light.to_array()) {
        return false;
    }
    let Some((prefix, weight)) = truth.prefix else {
        return found[11] == 0;
    };
    let Place {
        primitive,
        coordinates,
    } = prefix.place();
    let is_own = found[2] & 0xff == prefix.length()
        && found[3] == primitive
        && close(tolerance, &found[12..14], &coordinates)
        && close(tolerance, &found[4..7], &prefix.throughput().to_array())
        && close(tolerance, &found[8..11], &prefix.wo().to_array())
        && close(loose, &found[11..12], &[weight]);
    is_own
        && match &truth.image {
            Some(Ok((image, jacobian))) => {
                found[19] == super::DEFINED
                    && close(tolerance, &found[20..23], &image.throughput().to_array())
                    && close(tolerance, &found[23..24], &[*jacobian])
                    && close(tolerance, &found[24..27], &image.wo().to_array())
            }
            Some(Err(reason)) => found[19] == *reason as u32,
            None => false,
        }
}

#[test]
fn prefixes_are_those_of_the_library() {
    let Some(gpu) = gpu() else { return };
    let scene = Scene::new(&zoo()).expect("it is sound");
    let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    let extent = scene.extent();
    let ends = [(0.15, 0.02), (0.4, 0.2)];
    let ends = ends.map(|(alpha, distance)| {
        Connectability::hybrid(alpha, distance * extent).expect("they are thresholds")
    });
    let faults = [
        // A prefix ends wherever it is rough, however it got there.
        [
            "package_lightshed_connectability_rough(ends, before.roughness) && ",
            "",
        ],
        // It ends however near the vertex before is.
        [
            " && package_lightshed_connectability_far(ends, position, position - before.position)",
            "",
        ],
        // The density is one of directions.
        [
            "let density = package_lightshed_measure__3solid_angle_to_area(scattering.pdf, squared, cos_theta);",
            "let density = scattering.pdf;",
        ],
        // Emitters are found twice.
        ["incident * omega * weight", "incident * weight"],
        // What roulette left is not made up for.
        ["weight = weight / survival", "weight = weight"],
        // An image may end before its last vertex.
        [
            "if package_lightshed__1path_prefix__1prefix_ends(to.ends, before, vertex) {",
            "if false {",
        ],
    ];
    for (number, ends) in ends.into_iter().enumerate() {
        let mut rng = CounterRng::new(0x7072_6566_6978, 0, 0);
        let mut tracer = PrefixTracer::new(3);
        let (mut starts, mut truth) = (Vec::new(), Vec::new());
        while truth.len() < PAIRS {
            let place = Vec2::from(rng.next_2d()) * SIDE as f32;
            let step = Vec2::from(rng.next_2d()) - 0.5;
            let other = place + step * if rng.next_f32() < 0.7 { 6.0 } else { SIDE as f32 };
            let (Some((from, mut start)), Some((to, end))) =
                (domain(&world, place, ends), domain(&world, other, ends))
            else {
                continue;
            };
            let seed = PathSeed::draw(&mut rng);
            [start[3], start[7]] = seed.words();
            let mut found = Truth {
                prefix: None,
                light: Vec3::ZERO,
                image: None,
            };
            tracer.trace(
                &[PrefixStart::new(&from, seed)],
                true,
                |_, finding| match finding {
                    PrefixFinding::Light(light) => found.light += light,
                    PrefixFinding::Prefix(prefix, _, weight) => {
                        found.prefix = Some((*prefix, weight.value() as f32));
                    }
                },
            );
            found.image = found.prefix.map(|(prefix, _)| {
                let image = PrefixShift.shift(&prefix, &from, &to)?;
                Ok((image.sample, image.jacobian.value() as f32))
            });
            starts.extend([start, end]);
            truth.push(found);
        }
        let differing = |fault| {
            let (_, found) = run::<Words>(
                gpu,
                &on_device,
                (PROGRAM, fault),
                &[[0; 16]],
                &starts,
                ends,
                PAIRS,
            );
            let pairs = found.iter().zip(&truth).enumerate();
            pairs
                .filter(|(_, (found, truth))| !agrees(tolerance(gpu), found, truth))
                .map(|(index, (found, _))| (index, *found))
                .collect::<Vec<_>>()
        };
        let wrong = differing(None);
        let prefixes = truth.iter().filter(|truth| truth.prefix.is_some()).count();
        let long = truth
            .iter()
            .filter(|t| t.prefix.is_some_and(|(prefix, _)| prefix.length() > 2))
            .count();
        let images = truth
            .iter()
            .filter(|truth| matches!(truth.image, Some(Ok(_))))
            .count();
        println!(
            "ends {number}: {} of {PAIRS} differ; {prefixes} prefixes, {long} of them long, {images} images",
            wrong.len()
        );
        if let Some((index, found)) = wrong.first() {
            let truth = &truth[*index];
            println!(
                "{index}: {found:x?} for {:?}, {}, {:?}",
                truth.prefix, truth.light, truth.image
            );
        }
        assert!(wrong.len() <= most_differences(gpu, PAIRS));
        assert!(prefixes > PAIRS / 8 && long > PAIRS / 16 && images > PAIRS / 8);
        if number > 0 || !gpu.is_exact() {
            continue;
        }
        for &fault in planted(gpu, &faults) {
            let wrong = differing(Some(fault)).len();
            println!("  {wrong} differ with {:?} planted", fault[1]);
            assert!(wrong > most_differences(gpu, PAIRS), "{fault:?} is not noticed");
        }
    }
}

//! Shifts and walks on the device are those of `lightshed-shift`, bit for bit where the device is
//! exact.

use crate::bindings::{Bindings, SceneBindings, Table, bindings};
use crate::buffer::{Access, Buffer};
use crate::restir_pt::Rules;
use crate::scene::Settings;
use crate::tests::linked::linker;
use crate::tests::support::{exact_gpu, gpu, planted};
use crate::{Gpu, GpuScene};
use lightshed_integrator::{SceneVertex, SceneWorld};
use lightshed_resampling::{ShiftMapping, Undefined};
use lightshed_sampling::{CounterRng, PathSeed};
use lightshed_scene::glam::Vec2;
use lightshed_scene::{
    ConductorIor, EmitterDescription, Material, Microfacet, Rgb, Roughness, Scene, SceneDescription, builtin,
};
use lightshed_shift::{
    Connectability, Finding, PathDomain, PathSample, PathShift, Place, TreeTracer, WorldGeometry,
};

mod prefixes;

const SIDE: u32 = 64;
const LENGTH: u32 = 7;
/// Base paths and the domains that they are carried to, under the hybrid's rules; under others a
/// quarter of that.
const PAIRS: usize = 1 << 16;

/// The outcome of a shift that is defined, by the shader's number; others have those of
/// `Undefined`.
const DEFINED: u32 = u32::MAX;

/// A sample as words, and the domain that it is carried to: a place, and the direction to the
/// viewer.
type Pair = ([u32; 16], [u32; 8]);

/// Contribution and density of a shifted path, the outcome by the shader's number, and the
/// Jacobian.
type Outcome = [u32; 8];

const SHIFTS: &str = "
    import package::threads::thread_number;
    import package::memory::scene::settings;
    import package::lightshed::connectability::Connectability;
    import package::lightshed::path_sample::PathSample;
    import package::lightshed::path_shift::{DEFINED, PathDomain, path_jacobian, shift_path};
    import package::lightshed::path_vertex::vertex_at;
    struct Start { primitive: u32, v: f32, w: f32, padding: u32, wo: vec3f, more: u32 }
    struct Image { contribution: vec3f, density: f32, outcome: u32, a: u32, b: u32, c: u32 }
    @group(2) @binding(1) var<storage, read_write> samples: array<PathSample>;
    @group(2) @binding(2) var<storage, read> starts: array<Start>;
    @group(2) @binding(3) var<storage, read_write> images: array<Image>;
    @group(2) @binding(4) var<storage, read> rules: Connectability;
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
        let index = thread_number(id, groups);
        if index >= arrayLength(&samples) { return; }
        let start = starts[index];
        let domain = PathDomain(vertex_at(start.primitive, vec2f(start.v, start.w)), start.wo, settings.max_depth, rules);
        let image = shift_path(samples[index], domain);
        var jacobian = 0.0;
        if image.outcome == DEFINED { jacobian = path_jacobian(samples[index].density, image.density); }
        images[index] = Image(image.contribution, image.density, image.outcome, bitcast<u32>(jacobian), 0u, 0u);
    }";

const WALKS: &str = "
    import package::threads::thread_number;
    import package::memory::scene::settings;
    import package::lightshed::connectability::Connectability;
    import package::lightshed::cwbvh::{intersect, occluded};
    import package::lightshed::path_numbers::scatter_numbers;
    import package::lightshed::path_sample::{PathSample, pack_reservoir, unpack_reservoir};
    import package::lightshed::path_vertex::vertex_at;
    import package::lightshed::path_walk::{PathCandidate, walk_arrive, walk_from, walk_onward, walk_to_emitter};
    import package::lightshed::ray::NOTHING;
    struct Start { primitive: u32, v: f32, w: f32, seed_low: u32, wo: vec3f, seed_high: u32 }
    @group(2) @binding(1) var<storage, read_write> samples: array<PathSample>;
    @group(2) @binding(2) var<storage, read> starts: array<Start>;
    @group(2) @binding(3) var<storage, read_write> counts: array<u32>;
    @group(2) @binding(4) var<storage, read> rules: Connectability;
    var<private> count: u32;
    fn keep(index: u32, found: PathCandidate) {
        // Through a reservoir: packing loses nothing.
        samples[16u * index + count] = unpack_reservoir(pack_reservoir(found.sample, 1.0, 20.0));
        count++;
    }
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
        let index = thread_number(id, groups);
        if index >= arrayLength(&starts) { return; }
        let start = starts[index];
        count = 0u;
        var vertex = vertex_at(start.primitive, vec2f(start.v, start.w));
        var walk = walk_from(vertex, start.wo, vec2u(start.seed_low, start.seed_high));
        while walk.index < settings.max_depth {
            let light = walk_to_emitter(walk, rules, vertex);
            if light.some && !occluded(light.ray) { keep(index, light); }
            let onward = walk_onward(walk, rules, vertex, scatter_numbers(walk.seed, walk.index), settings.roulette_depth);
            if !onward.some { break; }
            let hit = intersect(onward.ray);
            let lost = hit.primitive == NOTHING;
            if !lost { vertex = vertex_at(hit.primitive, hit.barycentric); }
            let arrival = walk_arrive(onward.walk, rules, lost, vertex);
            walk = arrival.walk;
            if arrival.candidate.some { keep(index, arrival.candidate); }
            if lost { break; }
        }
        counts[index] = count;
    }";

/// Diffuse, glossy and mirroring walls, a blend, lamps, and light from all around.
fn zoo() -> SceneDescription {
    let mut scene = builtin::cornell_glossy();
    (scene.settings.width, scene.settings.height) = (SIDE, SIDE);
    scene.emitters.push(EmitterDescription::Constant {
        radiance: Rgb::new(0.3, 0.4, 0.6),
    });
    let two_sided = |front: Material| Material::TwoSided {
        front: Box::new(front),
        back: None,
    };
    scene.materials.push(two_sided(Material::Mirror {
        reflectance: Rgb::splat(0.9).into(),
    }));
    scene.materials.push(two_sided(Material::Blend {
        weight: lightshed_scene::FloatTexture::Constant(0.4),
        first: Box::new(Material::Diffuse {
            reflectance: Rgb::new(0.2, 0.6, 0.4).into(),
        }),
        second: Box::new(Material::Conductor {
            ior: ConductorIor {
                eta: Rgb::new(0.2, 0.9, 1.1),
                k: Rgb::new(3.9, 2.4, 2.2),
            },
            roughness: Some(Roughness {
                distribution: Microfacet::Ggx,
                alpha_u: lightshed_scene::FloatTexture::Constant(0.1),
                alpha_v: lightshed_scene::FloatTexture::Constant(0.3),
            }),
            specular_reflectance: Rgb::ONE.into(),
        }),
    }));
    let mirror = scene.materials.len() as u32 - 2;
    scene.shapes[1].material = mirror;
    scene.shapes[2].material = mirror + 1;
    scene
}

fn rules(extent: f32) -> [(&'static str, Connectability); 4] {
    [
        ("replay", Connectability::REPLAY),
        ("reconnection", Connectability::RECONNECTION),
        (
            "distant reconnection",
            Connectability::reconnection(0.1 * extent).expect("a distance"),
        ),
        (
            "hybrid",
            Connectability::hybrid(0.15, 0.02 * extent).expect("thresholds"),
        ),
    ]
}

type Domain<'a> = PathDomain<'a, SceneWorld<'a>>;

/// What a place of the image sees, as a domain and as a shader reads it.
fn domain<'a>(
    world: &'a SceneWorld<'a>,
    place: Vec2,
    rules: Connectability,
) -> Option<(Domain<'a>, [u32; 8])> {
    let scene = world.scene();
    let ray = scene.camera().ray(place, [0.5; 2]);
    let hit = scene.accelerator().intersect(&ray)?;
    let vertex: SceneVertex = world.arrive(&ray, &hit);
    let wo = -ray.direction;
    let Place {
        primitive,
        coordinates: [v, w],
    } = world.place(&vertex);
    let [x, y, z] = wo.to_array().map(f32::to_bits);
    let words = [primitive, v.to_bits(), w.to_bits(), 0, x, y, z, 0];
    Some((PathDomain::behind(world, vertex, wo, rules, LENGTH), words))
}

bindings!(
    /// Of the programs here.
    ParityBindings, 2, 0,
    settings: Read,
    samples: Write,
    starts: Read,
    results: Write,
    rules: Read,
);

fn run<T: bytemuck::Pod>(
    gpu: &Gpu,
    on_device: &GpuScene,
    (program, fault): (&str, Option<[&str; 2]>),
    samples: &[[u32; 16]],
    starts: &[[u32; 8]],
    rules: Connectability,
    results: usize,
) -> (Vec<[u32; 16]>, Vec<T>) {
    let mut wgsl = linker()
        .module("package::main", program)
        .link("package::main")
        .expect("it links");
    if let Some([right, planted]) = fault {
        assert!(wgsl.contains(right), "{right}");
        wgsl = wgsl.replace(right, planted);
    }
    let tables = [SceneBindings::TABLE, ParityBindings::TABLE];
    let kernel = gpu
        .kernel_of_tables("parity", &wgsl, "main", &tables, &on_device.constants(&wgsl, &[]))
        .unwrap_or_else(|error| panic!("{error}"));
    let settings: Settings = on_device.kernel_settings(1, LENGTH, 3);
    let buffers = [
        gpu.buffer("samples", samples),
        gpu.buffer("starts", starts),
        gpu.zeros("results", (results * size_of::<T>()) as u64),
        gpu.buffer("rules", &[Rules::from(rules)]),
    ]
    .map(|buffer| buffer.expect("they are small"));
    let settings = gpu.buffer("settings", &[settings]).expect("it is small");
    let [
        samples_on_device,
        starts_on_device,
        results_on_device,
        rules_on_device,
    ] = &buffers;
    let method = gpu.bind(&[&ParityBindings {
        settings: &settings,
        samples: samples_on_device,
        starts: starts_on_device,
        results: results_on_device,
        rules: rules_on_device,
    }]);
    let scene = gpu.bind(&[&on_device.bindings()]);
    let mut work = gpu.work();
    work.dispatch_bound(
        &kernel,
        &[&scene, &method],
        [starts.len().div_ceil(64) as u32, 1, 1],
    );
    work.submit();
    (
        gpu.read(&buffers[0], samples.len()).expect("the device answers"),
        gpu.read(&buffers[2], results).expect("the device answers"),
    )
}

fn words(sample: &PathSample) -> [u32; 16] {
    bytemuck::cast(*sample)
}

/// The library's answer as the shader gives it.
fn outcome(shifted: Result<lightshed_resampling::Shifted<PathSample>, Undefined>) -> Outcome {
    let mut answer = [0; 8];
    match shifted {
        Ok(shifted) => {
            answer[4] = DEFINED;
            let sample = words(&shifted.sample);
            answer[..3].copy_from_slice(&sample[13..]);
            answer[3] = sample[11];
            // A quotient of two `f32`, rounded once on either side.
            answer[5] = (shifted.jacobian.value() as f32).to_bits();
        }
        Err(reason) => {
            answer[4] = reason as u32;
        }
    }
    answer
}

/// Base paths with what the library makes of them in other domains.
fn pairs(world: &SceneWorld<'_>, rules: Connectability) -> (Vec<Pair>, Vec<Outcome>) {
    let mut rng = CounterRng::new(0x7368_6966_7473, 0, 0);
    let mut tracer = TreeTracer::new(3);
    let (mut pairs, mut answers) = (Vec::new(), Vec::new());
    let count = if rules.reaches(3) { PAIRS } else { PAIRS / 4 };
    while pairs.len() < count {
        let place = Vec2::from(rng.next_2d()) * SIDE as f32;
        // Near or anywhere.
        let step = Vec2::from(rng.next_2d()) - 0.5;
        let other = place + step * if rng.next_f32() < 0.7 { 6.0 } else { SIDE as f32 };
        let Some((from, _)) = domain(world, place, rules) else {
            continue;
        };
        let Some((to, start)) = domain(world, other, rules) else {
            continue;
        };
        let seed = PathSeed::draw(&mut rng);
        tracer.trace(&[(&from, seed)], |_, finding| {
            if let Finding::Path(sample, _) = finding {
                answers.push(outcome(PathShift::default().shift(sample, &from, &to)));
                pairs.push((words(sample), start));
            }
        });
    }
    (pairs, answers)
}

/// Whether two answers agree: one outcome, and numbers that differ by a share of at most
/// `tolerance`.
fn agree(tolerance: f32, found: &Outcome, truth: &Outcome) -> bool {
    // What is undefined has no value.
    if found[4] != truth[4] {
        return false;
    }
    let close = |(&a, &b): (&u32, &u32)| {
        let (a, b) = (f32::from_bits(a), f32::from_bits(b));
        a.to_bits() == b.to_bits() || (a - b).abs() <= tolerance * b.abs()
    };
    truth[4] != DEFINED || found[..6].iter().zip(&truth[..6]).all(close)
}

/// The same bits, or what a device with other rounding can promise.
fn tolerance(gpu: &Gpu) -> f32 {
    if gpu.is_exact() { 0.0 } else { 2e-3 }
}

fn most_differences(gpu: &Gpu, of: usize) -> usize {
    if gpu.is_exact() { 0 } else { of / 20 }
}

#[test]
fn shifts_are_those_of_the_library() {
    let Some(gpu) = gpu() else { return };
    let scene = Scene::new(&zoo()).expect("it is sound");
    let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    // Faults in the shift, and the rules under which they must be noticed.
    let faults = [
        // The Jacobian is taken for its inverse.
        (
            "offset_density / base_density",
            "base_density / offset_density",
            "hybrid",
        ),
        // The density behind the reconnection is left out of the Jacobian.
        ("area * scattering.pdf", "area", "hybrid"),
        // A pair that the offset path could reconnect earlier is not looked for.
        ("return before.some && ", "return false && ", "hybrid"),
        // Technique weights of the base path are kept, as if emitter sampling knew no distance.
        (
            "let omega = package_lightshed_measure__1power_heuristic(connection.pdf, scattering.pdf);",
            "let omega = 0.5;",
            "replay",
        ),
        // Nothing is too close.
        ("squared >= least * least && ", "", "distant reconnection"),
    ];
    for (name, rules) in rules(scene.extent()) {
        let (pairs, truth) = pairs(&world, rules);
        let (samples, starts): (Vec<_>, Vec<_>) = pairs.into_iter().unzip();
        let run = |fault: Option<[&str; 2]>| {
            run::<Outcome>(
                gpu,
                &on_device,
                (SHIFTS, fault),
                &samples,
                &starts,
                rules,
                samples.len(),
            )
            .1
        };
        let differing = |found: &[Outcome]| {
            let pairs = found.iter().zip(&truth).enumerate();
            pairs
                .filter(|(_, (found, truth))| !agree(tolerance(gpu), found, truth))
                .map(|(index, _)| index)
                .collect::<Vec<_>>()
        };
        let found = run(None);
        let by_outcome = [DEFINED, 0, 1, 2, 3, 4, 5]
            .map(|outcome| truth.iter().filter(|truth| truth[4] == outcome).count());
        let wrong = differing(&found);
        println!(
            "{name}: {} of {} differ; outcomes {by_outcome:?}",
            wrong.len(),
            truth.len()
        );
        if let Some(&index) = wrong.first() {
            println!(
                "{:x?}: {:x?} for {:x?}",
                samples[index], found[index], truth[index]
            );
        }
        assert!(wrong.len() <= most_differences(gpu, truth.len()), "{name}");
        assert!(
            by_outcome[0] > truth.len() / 4,
            "{name} defines too little to be compared"
        );
        let of_rules = planted(gpu, &faults)
            .iter()
            .filter(|(_, _, rules)| *rules == name && gpu.is_exact());
        for (right, fault, _) in of_rules {
            let wrong = differing(&run(Some([right, fault]))).len();
            println!("  {wrong} differ with {fault:?} planted");
            assert!(
                wrong > most_differences(gpu, truth.len()),
                "{fault:?} is not noticed"
            );
        }
    }
}

/// Walks on the device: every candidate is, but for the order of a product, what the library makes
/// of it in its own domain, and those whose direction the reservoir did not round are the library's
/// own, bit for bit.
#[test]
fn walks_are_those_of_the_library() {
    let Some(gpu) = exact_gpu() else { return };
    let scene = Scene::new(&zoo()).expect("it is sound");
    let on_device = GpuScene::new(gpu, &scene).expect("it is flat");
    let world = SceneWorld::new(&scene, scene.emitters_by_power());
    const TREES: usize = 1 << 12;
    for (name, rules) in rules(scene.extent()) {
        let mut rng = CounterRng::new(0x7761_6c6b, 0, 0);
        let (mut domains, mut starts) = (Vec::new(), Vec::new());
        while domains.len() < TREES {
            let place = Vec2::from(rng.next_2d()) * SIDE as f32;
            let Some((domain, mut start)) = domain(&world, place, rules) else {
                continue;
            };
            let seed = PathSeed::draw(&mut rng);
            [start[3], start[7]] = seed.words();
            domains.push((domain, seed));
            starts.push(start);
        }
        let check = |fault: Option<[&str; 2]>| -> [usize; 3] {
            let empty = vec![[0; 16]; 16 * TREES];
            let (samples, counts) =
                run::<u32>(gpu, &on_device, (WALKS, fault), &empty, &starts, rules, TREES);
            let mut tracer = TreeTracer::new(3);
            let (mut found, mut wrong, mut unlike) = (0, 0, 0);
            for (tree, (domain, seed)) in domains.iter().enumerate() {
                let of_tree = &samples[16 * tree..][..counts[tree] as usize];
                let mut unrounded = Vec::new();
                for sample in of_tree {
                    found += 1;
                    let kept: PathSample = bytemuck::cast(*sample);
                    let truth = outcome(PathShift::default().shift(&kept, domain, domain));
                    let [a, b, c] = [sample[13], sample[14], sample[15]];
                    let own = [a, b, c, sample[11], DEFINED, 1.0f32.to_bits(), 0, 0];
                    let differs = domain.can_leave(&kept) && !agree(tolerance(gpu).max(1e-4), &own, &truth);
                    wrong += usize::from(differs);
                    if sample[2] >> 17 & 7 != 1 {
                        let mut sample = *sample;
                        // Means nothing of a path without such a vertex.
                        sample[6..8].fill(0);
                        unrounded.push(sample);
                    }
                }
                let mut truth = Vec::new();
                tracer.trace(&[(domain, *seed)], |_, finding| {
                    if let Finding::Path(sample, _) = finding
                        && words(sample)[2] >> 17 & 7 != 1
                    {
                        truth.push(words(sample));
                    }
                });
                unlike += usize::from(truth != unrounded);
            }
            [found, wrong, unlike]
        };
        let [found, wrong, unlike] = check(None);
        println!(
            "{name}: of {found} candidates {wrong} differ in their own domain, of {TREES} trees {unlike}"
        );
        assert!(found > TREES, "{name}");
        assert!(wrong <= most_differences(gpu, found), "{name}");
        assert!(unlike <= most_differences(gpu, TREES), "{name}");
        if name != "hybrid" {
            continue;
        }
        // What shows each: the place of its count, and of how many.
        let faults = [
            // Half a density.
            (
                [
                    "walk.pair_density_area * scattering.pdf",
                    "walk.pair_density_area",
                ],
                1,
                found,
            ),
            // A lobe cut short.
            (["& 15u, (bits >> 24u)", "& 7u, (bits >> 24u)"], 2, TREES),
        ];
        for &(fault, place, of) in planted(gpu, &faults) {
            let differing = check(Some(fault))[place];
            println!("  {differing} of {of} with {fault:?} planted");
            assert!(differing > most_differences(gpu, of), "{fault:?} is not noticed");
        }
    }
}

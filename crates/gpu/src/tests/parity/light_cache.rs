//! Light caches: choices and probabilities.

use crate::Gpu;
use crate::light_cache::LightCacheMemory;
use crate::tests::parity::harness::{COUNT, HOSTILE, Shader, Tier, compare, floats};
use crate::tests::support::{exact_gpu, planted};
use glam::Vec3;
use lightshed_integrator::guiding::{
    FlatLightCache, LightCache, LightCacheOptions, LightRecord, LightTreeCache,
};
use lightshed_lights::{
    Bounds, Facing, Light, LightBvh, LightChoice, LightSampler, OrientationCone, ShadingPoint,
};
use lightshed_sampling::{CounterRng, UniformSphere};

const SIDE: f32 = 8.0;

/// Lamps of all kinds in a square of eight by eight rooms; some are off, some have many parts.
fn lamps(count: usize) -> Vec<Light> {
    let mut rng = CounterRng::new(90, count as u32, 0);
    (0..count)
        .map(|i| {
            let group = Vec3::new((i % 8) as f32, (i / 8 % 8) as f32, 0.8);
            let within = Vec3::from_array([(); 3].map(|()| rng.next_f32()));
            let center = group + within * [0.9, 0.02][i % 2];
            let half = Vec3::from_array([(); 3].map(|()| rng.next_f32())) * [0.0, 0.01, 0.2][i % 3];
            let axis = UniformSphere::sample(rng.next_2d());
            Light {
                bounds: Bounds::new(center - half, center + half),
                intensity: if i % 17 == 4 {
                    0.0
                } else {
                    0.1 + 4.0 * rng.next_f32()
                },
                cone: match i % 4 {
                    0 => None,
                    1 => Some(OrientationCone::spot(axis, 0.4)),
                    _ => Some(OrientationCone::diffuse(Vec3::NEG_Z)),
                },
            }
        })
        .collect()
}

fn bounds() -> Bounds {
    Bounds::new(Vec3::ZERO, Vec3::new(SIDE, SIDE, 2.0))
}

/// A floor is seen by the lamps of its own room, and by those of a hall of rooms.
fn sees(at: Vec3, lamp: &Light) -> bool {
    let to = lamp.bounds.center();
    at.x.floor() == to.x.floor() && (at.y.floor() == to.y.floor() || at.x < 2.0)
}

/// A cache that has learnt the rooms.
fn trained(lights: &[Light], options: LightCacheOptions) -> LightCache {
    let mut cache = LightCache::new(bounds(), lights, options).expect("options are sound");
    for pass in 0..6u32 {
        let records: Vec<LightRecord> = (0..20_000u32)
            .filter_map(|i| {
                let mut rng = CounterRng::new(91, i, pass);
                let [x, y] = rng.next_2d();
                let at = ShadingPoint::new(Vec3::new(SIDE * x, SIDE * y, 0.0), Vec3::Z, 1.0);
                let LightChoice { light, pmf } = cache.sample(&at, rng.next_u64())?;
                let lamp = &lights[light as usize];
                let visible = sees(at.position, lamp);
                let squared = (lamp.bounds.center() - at.position).length_squared();
                Some(LightRecord {
                    at,
                    light,
                    pmf,
                    contribution: if visible { lamp.intensity / squared } else { 0.0 },
                    visible,
                })
            })
            .collect();
        cache.update(&records);
    }
    cache
}

/// Points, most on the floor, with a facing, 64 bits and a light.
fn questions(lights: usize) -> Vec<[u32; 10]> {
    let mut rng = CounterRng::new(92, lights as u32, 0);
    (0..COUNT / 4)
        .map(|i| {
            let u = Vec3::from_array([(); 3].map(|()| rng.next_f32()));
            let at = match i % 8 {
                0 => 3.0 * SIDE * u - SIDE,
                1 => (u * SIDE).round(),
                2 => u * Vec3::new(SIDE, SIDE, 1.0),
                _ => u * Vec3::new(SIDE, SIDE, 0.0),
            };
            let normal = match i % 3 {
                0 => UniformSphere::sample(rng.next_2d()),
                _ => Vec3::Z,
            };
            let mut words = [rng.next_u32(), rng.next_u32()];
            if i % 6 == 0 {
                words = [HOSTILE[i / 6 % HOSTILE.len()], words[1] >> (i / 6 % 32)];
            }
            let [x, y, z] = at.to_array().map(f32::to_bits);
            let [nx, ny, nz] = normal.to_array().map(f32::to_bits);
            let facing = [0, 0, 0, 1, 2][rng.next_u32() as usize % 5];
            let light = rng.next_u32() % (lights as u32 + 1);
            [x, y, z, nx, ny, nz, facing, words[0], words[1], light]
        })
        .collect()
}

fn answers(sampler: &impl LightSampler, words: &[u32; 10]) -> [u32; 4] {
    let [x, y, z, nx, ny, nz, ..] = floats(words);
    let at = ShadingPoint {
        facing: [Facing::Front, Facing::Both, Facing::All][words[6] as usize],
        ..ShadingPoint::new(Vec3::new(x, y, z), Vec3::new(nx, ny, nz), 1.0)
    };
    let chosen = sampler.sample(&at, u64::from(words[7]) | u64::from(words[8]) << 32);
    let (light, pmf) = chosen.map_or((0, 0.0), |choice| (choice.light, choice.pmf));
    let again = chosen.map_or(0.0, |choice| sampler.pmf(&at, choice.light));
    [
        light,
        pmf.to_bits(),
        sampler.pmf(&at, words[9]).to_bits(),
        again.to_bits(),
    ]
}

const HOST: &str = "
    import package::lightshed::importance::Eight;
    import package::lightshed::light_cache::LightCache;
    struct CacheMemory { cache: LightCache, children: u32, parents: u32, leaf_of: u32, factors: u32 }
    @group(0) @binding(2) var<storage, read> parts: CacheMemory;
    @group(0) @binding(3) var<storage, read> words: array<u32>;
    @group(0) @binding(4) var<storage, read> rows: array<vec4u>;
    @group(0) @binding(5) var<storage, read> nodes: array<u32>;
    @group(0) @binding(6) var<storage, read> tree_rows: array<vec4u>;
    fn light_cache() -> LightCache { return parts.cache; }
    fn load_cache_word(index: u32) -> u32 { return words[index]; }
    fn load_cache_row(place: u32) -> vec4u { return rows[place]; }
    fn load_octree_node(index: u32) -> u32 { return nodes[index]; }
    fn load_light_row(place: u32) -> vec4u { return tree_rows[place]; }
    fn load_light_level(level: u32) -> u32 { return 0u; }
    fn load_light_at(leaf: u32) -> u32 { return 0u; }
    fn load_leaf_of(light: u32) -> u32 { return 0u; }
    fn load_bvh_child(place: u32) -> u32 { return words[parts.children + place]; }
    fn load_bvh_parent(block: u32) -> u32 { return words[parts.parents + block]; }
    fn load_bvh_leaf(light: u32) -> u32 { return words[parts.leaf_of + light]; }
    fn load_factors(row: u32) -> Eight {
        let first = parts.factors + 4u * row;
        return Eight(bitcast<vec4f>(rows[first]), bitcast<vec4f>(rows[first + 1u]));
    }
    fn load_factor_row_below(row: u32, lane: u32) -> u32 {
        return rows[parts.factors + 4u * row + 2u + lane / 4u][lane % 4u];
    }";

/// Whether the device's choices and probabilities are those of a sampler with this memory, but for
/// this fault.
fn agrees(
    gpu: &Gpu,
    name: &str,
    flat: &FlatLightCache<'_>,
    sampler: &impl LightSampler,
    planted: Option<[&str; 2]>,
) -> Result<(), String> {
    let memory = LightCacheMemory::new(gpu, flat).expect("it is small");
    let (cache, octrees, tree) = (memory.bindings(), memory.octrees(), memory.tree());
    let inputs = questions(sampler.light_count());
    let shader = Shader {
        host: HOST,
        buffers: &[
            cache.light_cache_parts,
            cache.cache_words,
            cache.cache_rows,
            octrees.octree_nodes,
            tree.light_rows,
        ],
        planted,
        ..Shader::new(
            "import package::lightshed::importance::ShadingPoint;
             import package::lightshed::light_cache::{light_cache_pmf, light_cache_sample};",
            "let at = ShadingPoint(vec3f(number(0u), number(1u), number(2u)), 1.0,
                 vec3f(number(3u), number(4u), number(5u)), word(6u));
             let chosen = light_cache_sample(at, vec2u(word(7u), word(8u)));
             put(0u, select(0u, chosen.light, chosen.pmf > 0.0)); put_f(1u, chosen.pmf);
             put_f(2u, light_cache_pmf(at, word(9u)));
             put_f(3u, 0.0);
             if chosen.pmf > 0.0 {
                 put_f(3u, light_cache_pmf(at, chosen.light));
             }",
        )
    };
    let found = shader.run::<10, 4>(gpu, &inputs);
    let chosen = found.iter().filter(|found| found[1] != 0).count();
    assert!(
        planted.is_some() || chosen > inputs.len() / 4,
        "{name}: {chosen} choices"
    );
    let tier = match gpu.is_exact() {
        true => Tier::Words,
        false => Tier::Bounded {
            absolute: 0.0,
            relative: 1e-4,
        },
    };
    compare(name, tier, &inputs, &found, |words| answers(sampler, words))
}

fn options(bucket: u32, max_buckets: u32) -> LightCacheOptions {
    LightCacheOptions {
        bucket,
        max_buckets,
        ..LightCacheOptions::default()
    }
}

/// A learnt tree without lists, and a tree that has learnt nothing. Shares taken for their sums are
/// noticed.
#[test]
fn choices_of_learnt_light_trees() {
    let Some(gpu) = exact_gpu() else { return };
    let few = lamps(700);
    let cache = trained(&few, options(32, 32));
    let learnt: LightTreeCache = cache.into_tree().expect("a tree explores");
    let of_learnt = agrees(gpu, "learnt tree", &learnt.flat(), &learnt, None);
    let fault = ["low - vec4f(0.0, low.xyz)", "low"];
    assert!(agrees(gpu, "learnt tree", &learnt.flat(), &learnt, Some(fault)).is_err());
    let plain: LightBvh = learnt.into_plain();
    let flat = FlatLightCache::of_tree(&plain);
    assert_eq!(agrees(gpu, "plain tree", &flat, &plain, None), Ok(()));
    assert_eq!(of_learnt, Ok(()));
}

/// Caches of single lights and of groups, in one bucket and in several. Faults are
/// noticed: another light found, sums that forget the block before, another bucket, a number that
/// is not scaled, a share that both techniques have.
#[test]
fn choices_of_light_caches() {
    let Some(gpu) = exact_gpu() else { return };
    let few = lamps(700);
    let many = lamps(9000);
    for (name, lights, options) in [
        ("groups", &many, options(32, 32)),
        ("small buckets", &few, options(8, 8)),
        (
            "single lights",
            &few,
            LightCacheOptions {
                unit_size: 0.0,
                ..options(64, 64)
            },
        ),
        (
            "a share that is not learnt",
            &few,
            LightCacheOptions {
                learn_share: false,
                share: 0.4,
                ..options(32, 4)
            },
        ),
    ] {
        let cache = trained(lights, options);
        let flat = cache.flat().expect("it has aggregates and a tree");
        let at = |x, y| Vec3::new(x, y, 0.0);
        println!(
            "{name}: {} and {} buckets, {} and {} lights, {} of the samples explore",
            cache.buckets_at(at(0.5, 0.5)),
            cache.buckets_at(at(6.5, 6.5)),
            cache.lights_at(at(0.5, 0.5)).len(),
            cache.lights_at(at(6.5, 6.5)).len(),
            cache.share_at(at(6.5, 6.5))
        );
        assert_eq!(agrees(gpu, name, &flat, &cache, None), Ok(()));
        let faults: &[[&str; 2]] = match name {
            "groups" => &[["same.y), 0u, same.x)", "same.y), 1u, same.x)"]],
            "small buckets" => &[
                ["before = high.w", "before = 0.0"],
                ["<= unit", "< unit"],
                ["quotient.x |= 1u", "quotient.x &= 1u"],
            ],
            "a share that is not learnt" => &[["(1.0 - head.share)", "1.0"]],
            _ => &[],
        };
        for &fault in planted(gpu, faults) {
            assert!(
                agrees(gpu, name, &flat, &cache, Some(fault)).is_err(),
                "{fault:?}"
            );
        }
    }
}

//! What exists for eight lanes at once gives the bits of what exists for one.

use lightshed_lanes::{LANES, LaneChoice, LaneKernel, LaneWords, Lanes, Vec3Lanes};
use lightshed_sampling::glam::Vec3;
use lightshed_sampling::{
    ConcentricDisk, CosineHemisphere, CounterRng, Density, Frame, FrameLanes, Ggx, GgxLanes,
    MicrofacetDistribution, PathSeed, SolidAngle, UniformSphere, UniformTriangle, f32_from_u32,
    f32_from_u32_lanes, power_heuristic, power_heuristic_lanes, sin_cos_turns, sin_cos_turns_lanes,
};
use lightshed_testkit::{check_faults, hostile_unit_f32};

/// Arguments of everything, for eight lanes.
#[derive(Clone, Copy)]
struct Arguments {
    u: [[f32; LANES]; 2],
    normals: [Vec3; LANES],
    densities: [[f32; LANES]; 2],
    /// Roughness that microfacets keep.
    alpha: [f32; LANES],
    pixel: [u32; LANES],
    sample: [u32; LANES],
    seed: u64,
    block: u32,
}

/// Results, a row each.
type Results = Vec<[f32; LANES]>;

impl LaneKernel for Arguments {
    const HOT: bool = true;
    type Output = Results;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Results {
        let u = [L::load(&self.u[0]), L::load(&self.u[1])];
        let disk = ConcentricDisk::sample_lanes(u);
        let hemisphere = CosineHemisphere::sample_lanes(u);
        let triangle = UniformTriangle::sample_lanes(u);
        let sphere = UniformSphere::sample_lanes(u);
        let (sin, cos) = sin_cos_turns_lanes(u[1]);
        let normal = Vec3Lanes::new(
            L::load(&self.normals.map(|n| n.x)),
            L::load(&self.normals.map(|n| n.y)),
            L::load(&self.normals.map(|n| n.z)),
        );
        let frame = FrameLanes::from_normal(normal);
        let world = frame.to_world(hemisphere);
        let ggx = GgxLanes::new(L::load(&self.alpha));
        let facet = ggx.sample_visible_normal(normal, u);
        let facets = [
            ggx.normal_density(facet),
            ggx.masking(normal),
            ggx.visible_normal_density(normal, facet),
            ggx.visible_normal_density(hemisphere, normal),
        ];
        let weight = power_heuristic_lanes(L::load(&self.densities[0]), L::load(&self.densities[1]));
        let words = CounterRng::block_lanes::<L>(
            self.seed,
            L::Words::load(&self.pixel),
            L::Words::load(&self.sample),
            self.block,
        );
        let seeds = [L::Words::load(&self.pixel), L::Words::load(&self.sample)];
        let path_words = PathSeed::block_lanes::<L>(seeds, self.block);
        let mut rows = vec![disk[0].store(), disk[1].store()];
        let local = frame.to_local(hemisphere);
        let to_unit = (normal * L::load(&self.u[0])).normalize_or(hemisphere);
        for v in [
            hemisphere,
            frame.tangent,
            frame.bitangent,
            world,
            local,
            facet,
            to_unit,
            sphere,
        ] {
            rows.extend(v.store());
        }
        for value in facets {
            rows.push(value.store());
        }
        rows.extend([world.length().store(), sin.store(), cos.store()]);
        rows.extend([triangle[0].store(), triangle[1].store(), weight.store()]);
        for word in words.into_iter().chain(path_words) {
            rows.push(f32_from_u32_lanes::<L>(word).store());
            rows.push(L::from_bits(word).store());
        }
        rows
    }
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    SwappedUniforms,
    SwappedDensities,
    NextBlock,
    OtherPixel,
    FlippedNormal,
    Rougher,
}

/// The same, one lane after the other.
fn alone(arguments: &Arguments, fault: Option<Fault>) -> Results {
    let lanes: Vec<Vec<f32>> = (0..LANES)
        .map(|lane| {
            let mut u = [arguments.u[0][lane], arguments.u[1][lane]];
            let mut normal = arguments.normals[lane];
            let mut densities = [0, 1].map(|side| arguments.densities[side][lane]);
            let mut alpha = arguments.alpha[lane];
            let (mut pixel, mut block) = (arguments.pixel[lane], arguments.block);
            match fault {
                Some(Fault::SwappedUniforms) => u.swap(0, 1),
                Some(Fault::SwappedDensities) => densities.swap(0, 1),
                Some(Fault::NextBlock) => block += 1,
                Some(Fault::OtherPixel) => pixel ^= 1,
                Some(Fault::FlippedNormal) => normal.z = -normal.z,
                Some(Fault::Rougher) => alpha *= 1.001,
                None => {}
            }
            let disk = ConcentricDisk::sample(u);
            let hemisphere = CosineHemisphere::sample(u);
            let triangle = UniformTriangle::sample(u);
            let (sin, cos) = sin_cos_turns(u[1]);
            let frame = Frame::from_normal(normal);
            let world = frame.to_world(hemisphere);
            let ggx = Ggx::new(alpha, alpha);
            let facet = ggx.sample_visible_normal(normal, u);
            let facets = [
                ggx.normal_density(facet),
                ggx.masking(normal),
                ggx.visible_normal_density(normal, facet).value(),
                ggx.visible_normal_density(hemisphere, normal).value(),
            ];
            let [a, b] = densities.map(Density::<SolidAngle>::new);
            let mut results = vec![disk.x, disk.y];
            let local = frame.to_local(hemisphere);
            let to_unit = (normal * u[0]).normalize_or(hemisphere);
            for v in [
                hemisphere,
                frame.tangent,
                frame.bitangent,
                world,
                local,
                facet,
                to_unit,
                UniformSphere::sample(u),
            ] {
                results.extend(v.to_array());
            }
            results.extend(facets);
            results.extend([world.length(), sin, cos]);
            results.extend([triangle[0], triangle[1], power_heuristic(a, b)]);
            let sample = arguments.sample[lane];
            let mut stream = PathSeed::new(u64::from(sample) << 32 | u64::from(pixel)).stream();
            stream.set_dimension(4 * block);
            let words = (0..4).map(|n| CounterRng::at(arguments.seed, pixel, sample, 4 * block + n));
            for word in words.chain((0..4).map(|_| stream.next_u32())) {
                results.extend([f32_from_u32(word), f32::from_bits(word)]);
            }
            results
        })
        .collect();
    (0..lanes[0].len())
        .map(|row| core::array::from_fn(|lane| lanes[lane][row]))
        .collect()
}

fn arguments() -> Vec<Arguments> {
    let mut u: Vec<[f32; 2]> = hostile_unit_f32()
        .flat_map(|a| hostile_unit_f32().map(move |b| [a, b]))
        .collect();
    u.extend((0..4096).map(|i| CounterRng::new(3, i, 0).next_2d()));
    // Densities far apart, zero, infinite and not a number.
    let densities = [0.0, 1e-30, 0.3, 0.3, 7.5, 1e30, f32::MAX, f32::INFINITY, f32::NAN];
    u.chunks_exact(LANES)
        .zip(0u32..)
        .map(|(chunk, number)| {
            let lane_number = |lane: usize| 8 * number + lane as u32;
            let poles = [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(0.0, -1.0, -0.0)];
            Arguments {
                u: [0, 1].map(|side| core::array::from_fn(|lane| chunk[lane][side])),
                normals: core::array::from_fn(|lane| match lane_number(lane) % 16 {
                    pole @ 0..4 => poles[pole as usize],
                    _ => UniformSphere::sample(chunk[lane]),
                }),
                densities: [1, 9].map(|stride| {
                    core::array::from_fn(|lane| {
                        densities[(lane_number(lane) / stride) as usize % densities.len()]
                    })
                }),
                alpha: core::array::from_fn(|lane| {
                    [1e-4, 1e-3, 0.1, 0.5, 1.0, 1e3][lane_number(lane) as usize % 6]
                }),
                pixel: core::array::from_fn(|lane| lane_number(lane).wrapping_mul(0x9e37_79b9)),
                sample: core::array::from_fn(lane_number),
                seed: 0x0123_4567_89ab_cdef ^ u64::from(number) << 29,
                block: number * 5,
            }
        })
        .collect()
}

#[test]
fn lanes_give_the_bits_of_one() {
    let faults = [
        Fault::SwappedUniforms,
        Fault::SwappedDensities,
        Fault::NextBlock,
        Fault::OtherPixel,
        Fault::FlippedNormal,
        Fault::Rougher,
    ];
    let bits = |rows: Results| -> Vec<[u32; LANES]> {
        rows.into_iter()
            .map(|row| row.map(|x| if x.is_nan() { u32::MAX } else { x.to_bits() }))
            .collect()
    };
    check_faults(&faults, |fault| {
        for (number, arguments) in arguments().iter().enumerate() {
            let expected = bits(alone(arguments, fault));
            for choice in LaneChoice::all() {
                if bits(choice.run(*arguments)) != expected {
                    return Err(format!("{choice:?} differs at arguments {number}"));
                }
            }
        }
        Ok(())
    })
    .unwrap();
}

//! Quadtrees of a few bits, octrees, and the fields that they make.

use crate::Gpu;
use crate::guide::FieldRow;
use crate::tests::parity::harness::{
    COUNT, Shader, Tier, bits, check, compare, directions, floats, gpu, held,
};
use glam::Vec3;
use lightshed_integrator::guiding::{
    CompressedQuadtree, FieldOptions, GuidingField, GuidingSample, Interpolation, MAX_QUADTREE_DEPTH,
    QuadtreeModel, QuadtreeOptions,
};
use lightshed_sampling::{CounterRng, Density, DirectionDistribution, UniformSphere};
use lightshed_spatial::{AdaptiveOctree, Bounds, OctreeOptions};
use std::collections::{HashSet, VecDeque};

/// A tree whose divisions follow `rng`: often near the last one, so that some are deep.
fn tree(words: usize, rng: &mut CounterRng) -> Vec<u32> {
    let mut leaves: Vec<(u32, u32)> = (0..4).map(|child| (1, child)).collect();
    let mut inner = HashSet::new();
    while inner.len() < 8 * words - 1 {
        let place = match rng.next_f32() < 0.5 {
            true => leaves.len() - 1 - (rng.next_u32() as usize % leaves.len().min(4)),
            false => rng.next_u32() as usize % leaves.len(),
        };
        if leaves[place].0 < MAX_QUADTREE_DEPTH {
            let (depth, code) = leaves.swap_remove(place);
            inner.insert((depth, code));
            leaves.extend((0..4).map(|child| (depth + 1, code << 2 | child)));
        }
    }
    let mut bits = vec![0; words];
    let mut queue = VecDeque::from([(0u32, 0u32)]);
    let mut place = 0;
    while let Some((depth, code)) = queue.pop_front() {
        for child in 0..4 {
            let below = (depth + 1, code << 2 | child);
            if inner.contains(&below) {
                bits[place / 32] |= 1 << (place % 32);
                queue.push_back(below);
            }
            place += 1;
        }
    }
    assert!(CompressedQuadtree::new(&bits).is_ok());
    bits
}

/// Trees of all these numbers of words, one after the other: the words, and where each begins.
fn trees() -> (Vec<u32>, Vec<[u32; 2]>) {
    let (mut words, mut places) = (Vec::new(), Vec::new());
    for (salt, width) in (0..).zip([1, 2, 2, 2, 3, 4, 8, 16, 32, 32]) {
        for number in 0..8 {
            places.push([words.len() as u32, width as u32]);
            words.extend(tree(width, &mut CounterRng::new(20, salt, number)));
        }
    }
    (words, places)
}

fn tree_of(words: &[u32], [first, count]: [u32; 2]) -> &[u32] {
    &words[first as usize..(first + count) as usize]
}

const TREE_HOST: &str = "@group(0) @binding(2) var<storage, read> words: array<u32>;
    fn load_quadtree_word(index: u32) -> u32 { return words[index]; }";
const TREE_IMPORTS: &str =
    "import package::lightshed::quadtree::{quadtree_at, quadtree_leaf, quadtree_pdf, quadtree_rank,
    quadtree_sample, quadtree_select};";

/// Rank, select and the leaves by number, against loops over bits and the library's own leaves.
#[test]
fn bits_of_quadtrees() {
    let Some(gpu) = gpu() else { return };
    let (words, places) = trees();
    let buffer = gpu.buffer("trees", &words).expect("trees are small");
    let mut rng = CounterRng::new(21, 0, 0);
    let inputs: Vec<[u32; 4]> = (0..COUNT)
        .map(|i| {
            let [first, count] = places[i % places.len()];
            // Also the end of the bits, and leaves that do not exist.
            [
                first,
                count,
                rng.next_u32() % (32 * count + 1),
                rng.next_u32() % (25 * count + 1),
            ]
        })
        .collect();
    let shader = Shader {
        host: TREE_HOST,
        buffers: &[&buffer],
        ..Shader::new(
            TREE_IMPORTS,
            "let tree = quadtree_at(word(0u), word(1u));
             put(0u, quadtree_rank(tree, word(2u)));
             put(1u, quadtree_select(tree, word(3u), 0u));
             put(2u, quadtree_select(tree, word(3u), 0xffffffffu));
             let leaf = quadtree_leaf(tree, word(3u));
             put(3u, leaf.depth); put(4u, leaf.place.x); put(5u, leaf.place.y);",
        )
    };
    let truth = |&[first, count, place, number]: &[u32; 4]| {
        let tree = tree_of(&words, [first, count]);
        let bit = |place: u32| tree[place as usize / 32] >> (place % 32) & 1;
        let of = |kind: u32| {
            let mut places = (0..32 * count).filter(|&place| bit(place) == kind);
            places.nth(number as usize).unwrap_or(u32::MAX)
        };
        let view = CompressedQuadtree::new(tree).expect("it is a tree");
        let (depth, [x, y]) = view
            .leaf(number)
            .map_or((0, [0; 2]), |leaf| (leaf.depth, leaf.place));
        [(0..place).map(bit).sum(), of(1), of(0), depth, x, y]
    };
    let faults = [
        // A rank that counts its own bit, a select that forgets a word, children in another order.
        ["(1u << count) - 1u", "(2u << count) - 1u"],
        ["left -= ones;", "left -= min(ones, 31u);"],
        ["vec2u(place, place >> 1u)", "vec2u(place >> 1u, place)"],
    ];
    shader.check_with_faults(&faults, |shader| {
        let found = shader.run::<4, 6>(gpu, &inputs);
        compare("bits", Tier::Words, &inputs, &found, truth)
    });
}

/// Directions and densities have the bits of the library's, for every number of words.
#[test]
fn directions_of_quadtrees() {
    let Some(gpu) = gpu() else { return };
    let (words, places) = trees();
    let buffer = gpu.buffer("trees", &words).expect("trees are small");
    let mut rng = CounterRng::new(22, 0, 0);
    let ends = [0.0f32, 0.5, 0.25, 1.0 - f32::EPSILON / 2.0];
    let inputs: Vec<[u32; 7]> = (0..COUNT)
        .zip(directions(23))
        .map(|(i, [x, y, z])| {
            let [first, count] = places[i % places.len()];
            let mut u = || match rng.next_u32() % 8 {
                0 => ends[rng.next_u32() as usize % ends.len()],
                _ => rng.next_f32(),
            };
            [first, count, u().to_bits(), u().to_bits(), x, y, z]
        })
        .collect();
    let shader = Shader {
        host: TREE_HOST,
        buffers: &[&buffer],
        ..Shader::new(
            TREE_IMPORTS,
            "let tree = quadtree_at(word(0u), word(1u));
             let sample = quadtree_sample(tree, vec2f(number(2u), number(3u)));
             put_3(0u, sample.direction); put_f(3u, sample.pdf);
             put_f(4u, quadtree_pdf(tree, vec3f(number(4u), number(5u), number(6u))));",
        )
    };
    let truth = |&[first, count, u, v, x, y, z]: &[u32; 7]| {
        let tree = CompressedQuadtree::new(tree_of(&words, [first, count])).expect("it is a tree");
        let [u, v, x, y, z] = floats(&[u, v, x, y, z]);
        let (direction, pdf) = tree.sample([u, v]).expect("trees have directions");
        let of_other = tree.pdf(Vec3::new(x, y, z));
        bits([
            direction.x,
            direction.y,
            direction.z,
            pdf.value(),
            of_other.value(),
        ])
    };
    let tier = if gpu.is_exact() {
        Tier::Exact
    } else {
        Tier::Bounded {
            absolute: 1e-6,
            relative: 1e-5,
        }
    };
    let faults = [
        // A number of leaves too few, halves in the other order, the map's factor left out.
        ["end = 4u * (last + 1u)", "end = 4u * last"],
        ["scaled >= f32(low)", "scaled > f32(low)"],
        ["4.0 / (q * q * q)", "4.0"],
    ];
    shader.check_with_faults(&faults, |shader| {
        let found = shader.run::<7, 5>(gpu, &inputs);
        compare("directions", tier, &inputs, &found, truth)
    });
}

/// An octree that has followed points on a curve and in a corner.
fn octree() -> AdaptiveOctree {
    let bounds = Bounds {
        min: Vec3::new(-1.0, -2.0, 0.5),
        max: Vec3::new(3.0, 1.0, 2.0),
    };
    let mut tree = AdaptiveOctree::new(bounds).expect("the box is sound");
    let options = OctreeOptions {
        split_above: 30,
        collapse_below: 15,
        ..OctreeOptions::default()
    };
    let mut rng = CounterRng::new(24, 0, 0);
    let points: Vec<Vec3> = (0..20_000)
        .map(|i| {
            let t = rng.next_f32();
            let near = Vec3::new(-1.0, -2.0, 0.5) + Vec3::splat(1e-4) * Vec3::new(t, t * t, 0.3);
            let curve = Vec3::new(4.0 * t - 1.0, (9.0 * t).sin() - 0.5, 0.5 + 1.4 * t);
            if i % 8 == 0 { near } else { curve }
        })
        .collect();
    for _ in 0..24 {
        let mut counts = vec![0; tree.slot_count()];
        for slot in points.iter().filter_map(|&point| tree.slot(point)) {
            counts[slot as usize] += 1;
        }
        tree.adapt(&counts, &options).expect("it is small");
    }
    assert!(tree.slot_count() > 5_000);
    tree
}

/// Positions in and around a box, some on planes between cells, some no numbers.
fn positions<const N: usize>(bounds: &Bounds, salt: u32) -> Vec<[u32; N]> {
    let mut rng = CounterRng::new(25, salt, 0);
    let hostile = [f32::NAN, f32::INFINITY, -1e30, 0.0, f32::MAX, 1e-40];
    (0..COUNT)
        .map(|_| {
            let whole = rng.next_u32().is_multiple_of(16);
            let no_number = rng.next_u32().is_multiple_of(64);
            core::array::from_fn(|k| {
                let u = 1.02 * rng.next_f32() - 0.01;
                let u = if whole { (64.0 * u).round() / 64.0 } else { u };
                let (min, max) = (bounds.min[k % 3], bounds.max[k % 3]);
                if no_number && rng.next_u32().is_multiple_of(3) {
                    return hostile[rng.next_u32() as usize % hostile.len()].to_bits();
                }
                (min + u * (max - min)).to_bits()
            })
        })
        .collect()
}

fn octree_row(tree: &AdaptiveOctree) -> [u32; 8] {
    let min = tree.min().to_array().map(f32::to_bits);
    let per_length = 1_048_576.0 / tree.side();
    let [per_length, side] = [per_length, tree.side()].map(f32::to_bits);
    [min[0], min[1], min[2], per_length, side, 0, 0, 0]
}

/// Slots of one position, of two, and of one with an offset.
#[test]
fn slots_of_octrees() {
    let Some(gpu) = gpu() else { return };
    let tree = octree();
    let nodes = gpu.buffer("nodes", tree.nodes()).expect("it is small");
    let row = gpu.buffer("octree", &octree_row(&tree)).expect("it is small");
    let bounds = Bounds {
        min: tree.min(),
        max: tree.min() + tree.side(),
    };
    let mut inputs = positions::<6>(&bounds, 0);
    // Half of the second positions are near the first ones; offsets are some leaves at most.
    for (i, words) in inputs.iter_mut().enumerate() {
        let [x, y, z, a, b, c] = floats(words);
        if i % 2 == 0 && x.is_finite() {
            let near = 1e-3 * (Vec3::new(a, b, c) - Vec3::new(0.5, -0.5, 1.0));
            let [a, b, c] = (Vec3::new(x, y, z) + near).to_array().map(f32::to_bits);
            words[3..].copy_from_slice(&[a, b, c]);
        }
    }
    let shader = Shader {
        host: "import package::lightshed::octree::Octree;
            @group(0) @binding(2) var<storage, read> nodes: array<u32>;
            @group(0) @binding(3) var<storage, read> octree: Octree;
            fn load_octree_node(index: u32) -> u32 { return nodes[index]; }
            fn the_octree() -> Octree { return octree; }",
        buffers: &[&nodes, &row],
        ..Shader::new(
            "import package::host::the_octree;
             import package::lightshed::octree::{octree_slot, octree_slot_moved, octree_slots_of_pair};",
            "let tree = the_octree();
             let first = vec3f(number(0u), number(1u), number(2u));
             let second = vec3f(number(3u), number(4u), number(5u));
             put(0u, octree_slot(tree, first));
             let pair = octree_slots_of_pair(tree, first, second);
             put(1u, pair.first); put(2u, pair.second);
             let moved = octree_slot_moved(tree, first, second);
             put(3u, moved.first); put(4u, moved.second);",
        )
    };
    let truth = |words: &[u32; 6]| {
        let [x, y, z, a, b, c] = floats(words);
        let (first, second) = (Vec3::new(x, y, z), Vec3::new(a, b, c));
        let slot = |slot: Option<u32>| slot.unwrap_or(u32::MAX);
        let [now, before] = tree.slots_of_pair(first, second).map(slot);
        let moved = tree.slot_moved(first, second);
        let (own, other) = moved.map_or((u32::MAX, None), |(own, other)| (own, other));
        [slot(tree.slot(first)), now, before, own, slot(other)]
    };
    let faults = [
        // The child itself is counted, halves of other axes, a side of half the length.
        ["(1u << child) - 1u", "(2u << child) - 1u"],
        ["(bits.y << 1u)", "(bits.z << 1u)"],
        ["126u - own.depth", "125u - own.depth"],
    ];
    shader.check_with_faults(&faults, |shader| {
        let found = shader.run::<6, 5>(gpu, &inputs);
        compare("slots", Tier::Words, &inputs, &found, truth)
    });
}

/// A field that has learnt from light of a lamp above a floor, and from none elsewhere.
fn field(bits: u32, parallax: bool, interpolation: Interpolation) -> GuidingField<QuadtreeModel> {
    let bounds = Bounds {
        min: Vec3::new(-2.0, -1.0, 0.0),
        max: Vec3::new(2.0, 3.0, 1.5),
    };
    let options = QuadtreeOptions {
        bits,
        parallax,
        ..QuadtreeOptions::default()
    };
    let model = QuadtreeModel::new(options).expect("options are sound");
    let options = FieldOptions {
        interpolation,
        ..FieldOptions::default()
    };
    let mut field = GuidingField::<_>::new(bounds, model, options).expect("options are sound");
    let lamp = Vec3::new(0.5, 0.7, 1.4);
    let mut rng = CounterRng::new(26, bits, 0);
    for pass in 0..4u32 {
        for _ in 0..30_000 {
            let [x, y] = rng.next_2d();
            let z = if rng.next_f32() < 0.9 { 0.0 } else { rng.next_f32() };
            let position = Vec3::new(4.0 * x - 2.0, 4.0 * y - 1.0, z);
            let guide = field.at(position);
            let share = guide.map_or(0.0, |guide| guide.share);
            let u = rng.next_2d();
            let direction = match guide.filter(|_| rng.next_f32() < share) {
                Some(guide) => guide.sample(u).expect("trees have directions").0,
                None => UniformSphere::sample(u),
            };
            let scattering_pdf = UniformSphere::density();
            let pdf = guide.map_or(0.0, |guide| guide.pdf(direction).value());
            let pdf = Density::new((1.0 - share) * scattering_pdf.value() + share * pdf);
            let towards = lamp - position;
            let light = (towards.normalize().dot(direction) - 0.9).max(0.0) + 0.01 * direction.z.max(0.0);
            // Half of the floor sees light from everywhere, so that its guides are useless.
            let light = if position.x > 1.0 { 1.0 } else { light };
            field.record(&[GuidingSample {
                position,
                direction,
                distance: towards.length(),
                weight: light / pdf.value(),
                pdf,
                scattering_pdf,
            }]);
        }
        field.update().unwrap_or_else(|error| panic!("{pass}: {error}"));
    }
    field
}

const FIELD_HOST: &str = "import package::lightshed::guiding_field::GuidingField;
    @group(0) @binding(2) var<storage, read> field: GuidingField;
    @group(0) @binding(3) var<storage, read> nodes: array<u32>;
    @group(0) @binding(4) var<storage, read> regions: array<u32>;
    @group(0) @binding(5) var<storage, read> words: array<u32>;
    fn guiding_field() -> GuidingField { return field; }
    fn load_octree_node(index: u32) -> u32 { return nodes[index]; }
    fn load_guide_region(slot: u32) -> u32 { return regions[slot]; }
    fn load_quadtree_word(index: u32) -> u32 { return words[index]; }";

/// Whether the guidance of a field on the device has the bits of the library's: shares, directions,
/// and densities of others.
fn field_agrees(
    gpu: &Gpu,
    field: &GuidingField<QuadtreeModel>,
    planted: Option<[&str; 2]>,
) -> Result<(), String> {
    let flat = field.flat();
    let buffers = [
        gpu.buffer("field", &[FieldRow::from(&flat)]),
        gpu.buffer("nodes", flat.nodes),
        gpu.buffer("regions", &flat.regions),
        gpu.buffer("words", flat.records),
    ]
    .map(|buffer| buffer.expect("they are small"));
    let mut rng = CounterRng::new(27, 0, 0);
    let positions = positions::<3>(field.bounds(), 1);
    let inputs: Vec<[u32; 8]> = positions
        .iter()
        .zip(directions(28))
        .map(|(&[x, y, z], [a, b, c])| {
            // Most on the floor, which has learnt.
            let z = if rng.next_f32() < 0.7 { 0.0f32.to_bits() } else { z };
            [
                x,
                y,
                z,
                a,
                b,
                c,
                rng.next_f32().to_bits(),
                rng.next_f32().to_bits(),
            ]
        })
        .collect();
    let [row, nodes, regions, words] = &buffers;
    let shader = Shader {
        host: FIELD_HOST,
        buffers: &[row, nodes, regions, words],
        planted,
        ..Shader::new(
            "import package::lightshed::guiding_field::{guidance_at, guidance_pdf, guidance_sample};",
            "let guidance = guidance_at(vec3f(number(0u), number(1u), number(2u)));
             put_f(0u, guidance.share);
             for (var k = 1u; k < 6u; k++) { put(k, 0u); }
             if guidance.share > 0.0 {
                 let sample = guidance_sample(guidance, vec2f(number(6u), number(7u)));
                 put_3(1u, sample.direction); put_f(4u, sample.pdf);
                 put_f(5u, guidance_pdf(guidance, vec3f(number(3u), number(4u), number(5u))));
             }",
        )
    };
    let found = shader.run::<8, 6>(gpu, &inputs);
    let (mut known, mut unknown) = (0, 0);
    for words in &found {
        *(if words[0] == 0 { &mut unknown } else { &mut known }) += 1;
    }
    assert!(known > COUNT / 4 && unknown > COUNT / 20, "{known}, {unknown}");
    let tier = if gpu.is_exact() {
        Tier::Exact
    } else {
        Tier::Bounded {
            absolute: 1e-6,
            relative: 1e-4,
        }
    };
    compare("field", tier, &inputs, &found, |words| {
        let [x, y, z, a, b, c, u, v] = floats(words);
        let Some(guidance) = field.at(Vec3::new(x, y, z)) else {
            return [0; 6];
        };
        let (direction, pdf) = guidance.sample([u, v]).expect("trees have directions");
        let other = guidance.pdf(Vec3::new(a, b, c)).value();
        bits([
            guidance.share,
            direction.x,
            direction.y,
            direction.z,
            pdf.value(),
            other,
        ])
    })
}

#[test]
fn fields_of_quadtrees() {
    let Some(gpu) = gpu() else { return };
    for (bits, parallax, interpolation) in [
        (64, true, Interpolation::Jitter),
        (64, false, Interpolation::None),
        (32, true, Interpolation::None),
        (256, true, Interpolation::Jitter),
    ] {
        let field = field(bits, parallax, interpolation);
        println!(
            "{bits} bits, {parallax}, {interpolation:?}: {} regions",
            field.learnt_regions()
        );
        held(gpu, || field_agrees(gpu, &field, None));
    }
    if !gpu.is_exact() {
        return;
    }
    let field = field(64, true, Interpolation::Jitter);
    for fault in [
        // The density without its parallax, regions that never learnt used from outside, trees seen
        // from their pivots, an offset of fewer rounds.
        [" * at_pivot.factor", ""],
        ["pair.second) >> 31u) != 0u", "pair.second) >> 31u) == 0u"],
        ["(from_pivot - offset)", "(from_pivot)"],
        ["hash ^ (hash >> 13u)", "hash"],
    ] {
        assert!(field_agrees(gpu, &field, Some(fault)).is_err(), "{fault:?}");
    }
}

/// Seen from the pivot itself, every direction is its own and takes up its own solid angle.
#[test]
fn parallax_at_the_pivot_changes_nothing() {
    check::<3, 4>(
        "parallax of zero",
        Tier::Bounded {
            absolute: 1e-6,
            relative: 0.0,
        },
        &Shader::new(
            "import package::lightshed::parallax::{parallax_at_pivot, parallax_offset};",
            "let d = vec3f(number(0u), number(1u), number(2u));
             let seen = parallax_at_pivot(parallax_offset(d, 3.0, d), d);
             put_3(0u, seen.direction); put_f(3u, seen.factor);",
        ),
        &directions(29),
        |&[x, y, z]| [x, y, z, 1.0f32.to_bits()],
    );
}

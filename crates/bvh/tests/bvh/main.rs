//! What holds for every tree: against brute force, closed forms and enumeration.

mod hits;
mod instances;
mod near;
mod properties;
mod subsets;
mod trees;

use lightshed_bvh::glam::Vec3;
use lightshed_bvh::{Bounds, BuildOptions, Interior, Method, Preset, Reinsertion, SubsetOptions};
use lightshed_sampling::CounterRng;

/// Every way to build, by name.
pub fn builds() -> Vec<(String, BuildOptions)> {
    let subset = |interior, cluster| {
        Method::Subset(SubsetOptions {
            interior,
            cluster,
            fraction: 0.1,
            ..SubsetOptions::default()
        })
    };
    let window = |sweep| {
        Method::Subset(SubsetOptions {
            sweep,
            ..SubsetOptions::windowed()
        })
    };
    let methods = [
        Method::Curve,
        Method::Ploc { radius: 8 },
        Method::Binned,
        Method::Agglomerative,
        subset(Interior::Binned, 1),
        subset(Interior::Binned, 4),
        subset(Interior::Ploc(4), 4),
        subset(Interior::Agglomerative, 2),
        subset(Interior::Curve, 4),
        window(0),
        window(64),
        Method::Subset(SubsetOptions {
            interior: Interior::Curve,
            ..SubsetOptions::windowed()
        }),
    ];
    let mut all: Vec<(String, BuildOptions)> = methods
        .into_iter()
        .map(|method| (format!("{method:?}"), method.into()))
        .collect();
    let reinsertion = Some(Reinsertion {
        share: 0.5,
        passes: 2,
    });
    let method = Method::Curve;
    all.push((
        "Curve and re-insertion".to_owned(),
        BuildOptions {
            method,
            reinsertion,
            twins: false,
        },
    ));
    for preset in Preset::ALL {
        let options = preset.options();
        let twins = BuildOptions {
            twins: true,
            ..options
        };
        all.push((format!("{preset:?}"), options));
        all.push((format!("{preset:?}, twins"), twins));
    }
    all
}

/// Kinds of input, hostile ones among them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layout {
    /// Small boxes everywhere.
    Uniform,
    /// All equal.
    Equal,
    /// Points on a line.
    Line,
    /// Points.
    Points,
    /// Half of them within a ten-thousandth of the extent.
    TeapotInStadium,
    /// A few equal to the whole.
    Large,
    /// Long ones in all sizes among small ones, as beams and walls among things.
    Mixed,
    /// Coordinates of 1e-38.
    Tiny,
    /// Coordinates of 1e38.
    Huge,
    /// From the least to the greatest number.
    AllNumbers,
    /// Far from the origin.
    Far,
    /// Two or three after each other share most of their boxes, but for some that stand alone.
    Twins,
}

/// All kinds.
pub const LAYOUTS: [Layout; 12] = [
    Layout::Uniform,
    Layout::Equal,
    Layout::Line,
    Layout::Points,
    Layout::TeapotInStadium,
    Layout::Large,
    Layout::Mixed,
    Layout::Tiny,
    Layout::Huge,
    Layout::AllNumbers,
    Layout::Far,
    Layout::Twins,
];

/// So many boxes.
pub fn boxes(layout: Layout, count: u32, seed: u64) -> Vec<Bounds> {
    (0..count)
        .map(|index| {
            let mut rng = CounterRng::new(seed, index, layout as u32);
            let at = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0;
            let size = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            let usual = Bounds::new(at, at + size * 0.05);
            let scaled = |by: f32| Bounds::new(usual.min * by, usual.max * by);
            match layout {
                Layout::Uniform => usual,
                Layout::Equal => Bounds::new(Vec3::ONE, Vec3::splat(2.0)),
                Layout::Line => Bounds::of_point(Vec3::X * at.x),
                Layout::Points => Bounds::of_point(at),
                Layout::TeapotInStadium if index % 2 == 0 => scaled(1e-4),
                Layout::TeapotInStadium => usual,
                Layout::Large if index % 50 == 0 => Bounds::new(Vec3::splat(-1.0), Vec3::splat(1.05)),
                Layout::Large => usual,
                Layout::Mixed => {
                    let mut long = size * 0.01;
                    if index % 8 == 0 {
                        long[index as usize / 8 % 3] += rng.next_f32().powi(2);
                    }
                    Bounds::new(at, at + long)
                }
                Layout::Tiny => scaled(1e-38),
                Layout::Huge => scaled(1e38),
                Layout::AllNumbers => {
                    let number = |word: u32| f32::from_bits(word & 0xbf7f_ffff);
                    let mut corner = || Vec3::from([0; 3].map(|_| number(rng.next_u32())));
                    let (a, b) = (corner(), corner());
                    Bounds::new(a.min(b), a.max(b))
                }
                Layout::Far => Bounds::new(usual.min + 1e6, usual.max + 1e6),
                Layout::Twins => {
                    // Groups of three and of two in turn.
                    let group = index / 5 * 2 + index % 5 / 3;
                    let is_alone = index % 17 == 0;
                    let number = if is_alone { index } else { group };
                    let mut rng = CounterRng::new(seed, number, 100 + u32::from(is_alone));
                    let at = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0;
                    let size = Vec3::new(rng.next_f32(), rng.next_f32(), 0.1) * 0.02;
                    Bounds::new(at, at + size * (1.0 + 0.05 * (index % 3) as f32))
                }
            }
        })
        .collect()
}

/// Triangles in a heap.
pub fn triangles(count: u32, size: f32, seed: u64) -> Vec<[Vec3; 3]> {
    (0..count)
        .map(|index| {
            let mut rng = CounterRng::new(seed, index, 0);
            let mut vector = || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0;
            let (at, b, c) = (vector(), vector(), vector());
            [at, at + b * size, at + c * size]
        })
        .collect()
}

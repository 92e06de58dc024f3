//! Densities against quadrature and histograms, whatever is sampled.

use lightshed_guiding::glam::Vec3;
use lightshed_guiding::{
    CompressedQuadtree, DirectionalModel, GuidingSample, QuadtreeGoal, QuadtreeModel, QuadtreeOptions,
    QuadtreeProduct, TrainingSample, WeightedTreeModel, WeightedTreeOptions,
};
use lightshed_lights::{Gloss, ShadingPoint};
use lightshed_sampling::{
    CounterRng, Density, DirectionDistribution, SolidAngle, UniformSphere, VonMisesFisher,
};
use lightshed_spatial::Bounds;
use lightshed_testkit::{check_faults, chi_squared_test};
use std::f64::consts::{PI, TAU};

pub const UNIT: Bounds = Bounds {
    min: Vec3::ZERO,
    max: Vec3::ONE,
};

/// Samples whose weights are those of two narrow lobes and a little from everywhere, taken
/// uniformly.
pub fn lobes(count: u32, seed: u64) -> Vec<GuidingSample> {
    let lobes = [
        (Vec3::new(0.2, -0.3, -0.8), 120.0, 1.0),
        (Vec3::new(-0.9, 0.1, 0.3), 20.0, 2.0),
    ];
    (0..count)
        .map(|i| {
            let mut rng = CounterRng::new(seed, i, 0);
            let direction = UniformSphere::sample(rng.next_2d());
            let brightness = |(axis, kappa, power): (Vec3, f32, f32)| {
                VonMisesFisher::new(axis.normalize(), kappa)
                    .density(direction)
                    .value()
                    * power
            };
            let f = 0.02 + lobes.map(brightness).iter().sum::<f32>();
            GuidingSample {
                position: Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()),
                direction,
                distance: 1.0,
                weight: f / UniformSphere::density().value(),
                pdf: UniformSphere::density(),
                scattering_pdf: UniformSphere::density(),
            }
        })
        .collect()
}

/// A model's records after learning from some samples.
pub fn learnt<M: DirectionalModel>(model: &M, samples: &[GuidingSample]) -> Vec<M::Record> {
    let mut records = vec![M::Record::default(); model.stride()];
    model.reset(&mut records);
    let samples: Vec<TrainingSample> = samples.iter().filter_map(TrainingSample::new).collect();
    model.learn(&mut records, &samples, &UNIT);
    assert!(model.is_sound(&records));
    records
}

/// Trees that are the same from everywhere.
pub fn quadtree(bits: u32) -> QuadtreeModel {
    QuadtreeModel::new(QuadtreeOptions {
        bits,
        parallax: false,
        ..QuadtreeOptions::default()
    })
    .unwrap()
}

/// Rows and columns of cells of equal solid angle, and points of quadrature along each side of a
/// cell.
const CELLS: [usize; 2] = [16, 32];
const POINTS: usize = 40;

/// Holds a distribution to its integral, within 2·10⁻³, its histogram, at a significance of
/// 10⁻⁶, and the density of its samples.
fn check_directions(directions: &impl DirectionDistribution, seed: u64) -> Result<(), String> {
    let [rows, columns] = CELLS;
    let mut expected = vec![0.0; rows * columns];
    for (row, points) in expected.chunks_mut(columns).enumerate() {
        for (column, cell) in points.iter_mut().enumerate() {
            for i in 0..POINTS * POINTS {
                let place = |number: usize, of: usize, point: usize| {
                    (number as f64 + (point as f64 + 0.5) / POINTS as f64) / of as f64
                };
                let z = 2.0 * place(row, rows, i / POINTS) - 1.0;
                let phi = TAU * place(column, columns, i % POINTS);
                let r = (1.0 - z * z).sqrt();
                let direction = Vec3::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32);
                *cell += f64::from(directions.pdf(direction).value());
            }
            *cell *= 4.0 * PI / (rows * columns * POINTS * POINTS) as f64;
        }
    }
    let total: f64 = expected.iter().sum();
    if !((total - 1.0).abs() < 2e-3) {
        return Err(format!("the integral is {total}"));
    }
    let samples = 100_000;
    let mut observed = vec![0u64; rows * columns];
    for i in 0..samples {
        let u = CounterRng::new(seed, i, 1).next_2d();
        let (direction, density) = directions.sample(u).ok_or("no sample")?;
        if directions.pdf(direction) != density || !density.is_positive() {
            return Err(format!("{u:?} has density {density:?}"));
        }
        if (direction.length() - 1.0).abs() > 1e-5 {
            return Err(format!("{direction} is no unit vector"));
        }
        let row = (0.5 * (f64::from(direction.z) + 1.0) * rows as f64) as usize;
        let phi = f64::from(direction.y)
            .atan2(f64::from(direction.x))
            .rem_euclid(TAU);
        let column = (phi / TAU * columns as f64) as usize;
        observed[row.min(rows - 1) * columns + column.min(columns - 1)] += 1;
    }
    let expected: Vec<f64> = expected.iter().map(|p| p / total * f64::from(samples)).collect();
    chi_squared_test(&observed, &expected, 1e-6).map_err(|error| error.to_string())?;
    Ok(())
}

/// What can be wrong with a density.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// The octahedral factor is left out.
    NoFactor,
    /// The density is that of another tree.
    OtherTree,
}

struct Faulty<D>(D, D, Option<Fault>);

impl<D: DirectionDistribution> DirectionDistribution for Faulty<D> {
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let (direction, _) = self.0.sample(u)?;
        Some((direction, self.pdf(direction)))
    }

    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        match self.2 {
            None => self.0.pdf(direction),
            Some(Fault::NoFactor) => {
                let norm = direction.abs().element_sum();
                self.0.pdf(direction) * (norm * norm * norm / 5.2) * 4.0
            }
            Some(Fault::OtherTree) => self.1.pdf(direction),
        }
    }
}

#[test]
fn densities_are_those_of_the_samples() {
    for (seed, bits) in [(1, 32), (2, 64), (3, 96), (4, 1024)] {
        let model = quadtree(bits);
        let [records, others] = [5, 6].map(|seed| {
            let mut samples = lobes(3000, seed);
            samples
                .iter_mut()
                .for_each(|sample| sample.direction.x *= if seed == 6 { -1.0 } else { 1.0 });
            learnt(&model, &samples)
        });
        let faults: &[Fault] = if bits == 64 {
            &[Fault::NoFactor, Fault::OtherTree]
        } else {
            &[]
        };
        check_faults(faults, |fault| {
            let [own, other] = [&records, &others].map(|records| model.directions(records, Vec3::ZERO));
            check_directions(&Faulty(own, other, fault), seed)
        })
        .unwrap();
    }
    // Trees as they are seen from the middle of their region, from a corner and from far away.
    let model = QuadtreeModel::new(QuadtreeOptions::default()).unwrap();
    let records = learnt(&model, &lobes(3000, 5));
    for (seed, position) in [(10, Vec3::splat(0.5)), (11, Vec3::ZERO), (12, Vec3::splat(90.0))] {
        check_directions(&model.directions(&records, position), seed).unwrap();
    }
    let model = WeightedTreeModel::new(WeightedTreeOptions::default()).unwrap();
    let records = learnt(&model, &lobes(20_000, 5));
    check_directions(&model.directions(&records, Vec3::ZERO), 7).unwrap();
    // Nothing learnt: all directions alike on the square.
    check_directions(&model.directions(&[], Vec3::ZERO), 8).unwrap();
}

/// Leaves fill the square, each is where the density says it is, and the leaf that a naive search
/// finds has the density of eq. 5.1.
#[test]
fn leaves_are_where_their_bits_say() {
    for bits in (32..=1024).step_by(32) {
        let model = quadtree(bits);
        let records = learnt(&model, &lobes(1000, u64::from(bits)));
        let tree = CompressedQuadtree::new(&records).unwrap();
        let leaves: Vec<_> = (0..tree.leaf_count())
            .map(|number| tree.leaf(number).unwrap())
            .collect();
        assert_eq!(leaves.len() as u32, 3 * bits / 4 + 1);
        assert_eq!(tree.leaf(tree.leaf_count()), None);
        assert_eq!(leaves.iter().map(|leaf| f64::from(leaf.area())).sum::<f64>(), 1.0);
        for i in 0..200 {
            let direction = UniformSphere::sample(CounterRng::new(1, i, bits).next_2d());
            let square = lightshed_sampling::octahedral_encode(direction);
            let has = |depth: u32, place: [u32; 2]| {
                let scaled = square * (1u32 << depth) as f32;
                (scaled.x.floor() as u32, scaled.y.floor() as u32) == (place[0], place[1])
            };
            let mut found = leaves.iter().filter(|leaf| has(leaf.depth, leaf.place));
            let leaf = found.next().expect("leaves fill the square");
            assert!(found.next().is_none());
            let q = (direction / direction.abs().element_sum()).length();
            let expected = q * q * q / 4.0 / (leaf.area() * leaves.len() as f32);
            let density = tree.pdf(direction).value();
            assert!(
                (density / expected - 1.0).abs() < 1e-5,
                "{density} and {expected}"
            );
        }
    }
    assert!(CompressedQuadtree::new(&[0]).is_err());
    assert!(CompressedQuadtree::new(&[]).is_err());
}

/// Trees of all widths with a table of their counts have the samples and densities of those
/// without, bit for bit, also where light is near. A table of another tree is found.
#[test]
fn tables_have_the_bits_of_the_tree() {
    check_faults(&["another tree", "a word of it"], |fault| {
        for bits in (32..=1024).step_by(32) {
            let model = QuadtreeModel::new(QuadtreeOptions {
                bits,
                ..QuadtreeOptions::default()
            })
            .unwrap();
            let [records, others] =
                [0, 1].map(|seed| learnt(&model, &lobes(4000, 2 * u64::from(bits) + seed)));
            let mut table = vec![0; model.table_words()];
            model.tabulate(&records, &mut table);
            match fault {
                Some("another tree") => model.tabulate(&others, &mut table),
                Some(_) => table[0] = table[0].rotate_left(8),
                None => {}
            }
            for i in 0..300 {
                let mut rng = CounterRng::new(1, i, bits);
                let position = Vec3::new(rng.next_f32(), rng.next_f32(), 3.0 * rng.next_f32());
                let plain = model.directions(&records, position);
                let by_table = model.directions_by_table(&records, &table, position);
                let (u, direction) = (rng.next_2d(), UniformSphere::sample(rng.next_2d()));
                let bits_of = |directions: &dyn DirectionDistribution| {
                    let (sampled, density) = directions.sample(u).unwrap();
                    let densities = [density, directions.pdf(sampled), directions.pdf(direction)];
                    (
                        sampled.to_array().map(f32::to_bits),
                        densities.map(|density| density.value().to_bits()),
                    )
                };
                let [a, b] = [bits_of(&plain), bits_of(&by_table)];
                if a != b {
                    return Err(format!("{bits}: {a:?} and {b:?}"));
                }
            }
        }
        Ok(())
    })
    .unwrap();
}

/// Neighbouring numbers give neighbouring directions: a net of 64 × 64 numbers leaves no leaf of a
/// 64-bit tree empty, and none has far more than its share.
#[test]
fn the_warp_keeps_strata() {
    let model = quadtree(64);
    let records = learnt(&model, &lobes(3000, 9));
    let tree = CompressedQuadtree::new(&records).unwrap();
    let mut counts = vec![0u32; tree.leaf_count() as usize];
    let leaves: Vec<_> = (0..tree.leaf_count())
        .map(|number| tree.leaf(number).unwrap())
        .collect();
    for i in 0..4096u32 {
        let u = [(i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5].map(|u| u / 64.0);
        let square = lightshed_sampling::octahedral_encode(tree.sample(u).unwrap().0);
        let number = leaves.iter().position(|leaf| {
            let place = square * (1u32 << leaf.depth) as f32;
            [place.x as u32, place.y as u32] == leaf.place
        });
        counts[number.unwrap()] += 1;
    }
    let mean = 4096.0 / f64::from(tree.leaf_count());
    let squares: f64 = counts
        .iter()
        .map(|&count| (f64::from(count) - mean).powi(2))
        .sum();
    let variance = squares / f64::from(tree.leaf_count());
    // Independent numbers would have a variance of the mean, 83.6.
    assert!(variance < 0.6 * mean, "variance {variance} at a mean of {mean}");
}

/// The more bits, the nearer: the mean of `f²/p` over directions falls towards the squared
/// integral, in at most two updates of fresh trees.
#[test]
fn more_bits_are_nearer_to_the_target() {
    let samples = lobes(20_000, 3);
    let second_moment = |directions: &dyn Fn(Vec3) -> f32| {
        let terms = samples.iter().map(|sample| {
            let f = f64::from(sample.weight) / (4.0 * PI);
            f * f / f64::from(directions(sample.direction)) * 4.0 * PI
        });
        terms.sum::<f64>() / samples.len() as f64
    };
    let uniform = second_moment(&|_| UniformSphere::density().value());
    let of_bits = |bits| {
        let model = quadtree(bits);
        let records = learnt(&model, &samples);
        second_moment(&|direction| model.directions(&records, Vec3::ZERO).pdf(direction).value())
    };
    let found = [32, 64, 128, 512].map(of_bits);
    println!("uniform {uniform}, quadtrees {found:?}");
    assert!(found.windows(2).all(|pair| pair[1] < pair[0]), "{found:?}");
    assert!(found[1] < 0.35 * uniform, "{found:?} and {uniform}");
    let model = WeightedTreeModel::new(WeightedTreeOptions::default()).unwrap();
    let records = learnt(&model, &samples);
    let weighted = second_moment(&|direction| {
        model
            .directions(&records, Vec3::ZERO)
            .pdf(direction)
            .value()
            .max(1e-3)
    });
    println!("with weights {weighted}");
    assert!(weighted < found[0]);
}

/// A lamp of radius 0.2 at `(0.5, 0.5, 3)`, as samples that were taken uniformly at points of the
/// unit cube see it.
fn lamp(count: u32, seed: u64) -> Vec<GuidingSample> {
    let mut samples = lobes(count, seed);
    samples.retain_mut(|sample| {
        let to = Vec3::new(0.5, 0.5, 3.0) - sample.position;
        let along = to.dot(sample.direction);
        sample.distance = along;
        sample.weight = 1.0;
        along > 0.0 && to.length_squared() - along * along < 0.04
    });
    samples
}

/// A region whose parts see a lamp in directions that differ by more than its size: with parallax
/// the tree has half of the second moment or less. Without the distances of the samples there is no
/// gain.
#[test]
fn parallax_follows_a_lamp() {
    let samples = lamp(1_000_000, 3);
    let others = lamp(1_000_000, 4);
    assert!(samples.len() > 500, "{}", samples.len());
    let second_moment = |parallax, samples: &[GuidingSample]| {
        let model = QuadtreeModel::new(QuadtreeOptions {
            parallax,
            ..QuadtreeOptions::default()
        })
        .unwrap();
        let records = learnt(&model, samples);
        let terms = others.iter().map(|sample| {
            let density = model.directions(&records, sample.position).pdf(sample.direction);
            1.0 / f64::from(density.value())
        });
        terms.sum::<f64>()
    };
    let without = second_moment(false, &samples);
    check_faults(&[()], |fault| {
        let mut samples = samples.clone();
        if fault.is_some() {
            samples
                .iter_mut()
                .for_each(|sample| sample.distance = f32::INFINITY);
        }
        let with = second_moment(true, &samples);
        println!("{with} with parallax, {without} without");
        if with < 0.5 * without {
            Ok(())
        } else {
            Err(format!("{with} and {without}"))
        }
    })
    .unwrap();
}

/// Half of the light comes from where the BSDF samples anyway. A tree leaves that to it: the
/// mixture has a lower second moment than with a tree that is the best without a BSDF, and no
/// higher one than with a tree of even loads.
#[test]
fn trees_of_least_variance_count_what_the_bsdf_finds() {
    let scattering = |direction: Vec3| {
        let lobe = VonMisesFisher::new(Vec3::new(0.6, 0.0, 0.8), 100.0);
        0.02 / (4.0 * std::f32::consts::PI) + 0.98 * lobe.density(direction).value()
    };
    let samples = |seed| {
        let mut samples = lobes(40_000, seed);
        for sample in &mut samples {
            let own = scattering(sample.direction);
            sample.scattering_pdf = Density::new(own);
            sample.weight += 3.0 * own / UniformSphere::density().value();
        }
        samples
    };
    let (known, others) = (samples(5), samples(6));
    let second_moment = |goal| {
        let model = QuadtreeModel::new(QuadtreeOptions {
            goal,
            ..QuadtreeOptions::default()
        })
        .unwrap();
        let records = learnt(&model, &known);
        let directions = model.directions(&records, Vec3::splat(0.5));
        let terms = others.iter().map(|sample| {
            let guide = f64::from(directions.pdf(sample.direction).value());
            let mixture = 0.4 * f64::from(sample.scattering_pdf.value()) + 0.6 * guide;
            f64::from(sample.weight).powi(2) / mixture
        });
        terms.sum::<f64>()
    };
    let even = second_moment(QuadtreeGoal::EvenLoad);
    let least = second_moment(QuadtreeGoal::LeastVariance { share: 0.6 });
    let alone = second_moment(QuadtreeGoal::LeastVariance { share: 1.0 });
    println!("even loads {even}, least variance {least}, of the tree alone {alone}");
    assert!(least < even, "{least} and {even}");
    assert!(least < 0.7 * alone, "{least} and {alone}");
}

/// A tree that keeps what products need.
fn product_model(bits: u32) -> QuadtreeModel {
    QuadtreeModel::new(QuadtreeOptions {
        bits,
        product: true,
        ..QuadtreeOptions::default()
    })
    .unwrap()
}

/// Receivers of all kinds.
fn receiver(i: u32) -> ShadingPoint {
    let mut rng = CounterRng::new(31, i, 0);
    let normal = UniformSphere::sample(rng.next_2d());
    let viewer = UniformSphere::sample(rng.next_2d());
    let viewer = if viewer.dot(normal) < 0.0 { -viewer } else { viewer };
    ShadingPoint {
        gloss: Gloss {
            viewer,
            roughness: 0.1 + 0.5 * rng.next_f32(),
            share: [0.0, 0.6, 1.0][i as usize % 3],
        },
        ..ShadingPoint::new(
            Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()),
            normal,
            1.0,
        )
    }
}

/// Runs `check` with products of trees of this size and receivers.
fn with_products(
    bits: u32,
    count: u32,
    mut check: impl FnMut(u32, &QuadtreeProduct<'_>, &ShadingPoint) -> Result<(), String>,
) -> Result<(), String> {
    let model = product_model(bits);
    let records = learnt(&model, &lobes(20_000, 3));
    let mut table = vec![0; model.table_words()];
    model.tabulate(&records, &mut table);
    for i in 0..count {
        let at = receiver(i);
        let directions = model.directions_by_table(&records, &table, at.position);
        let product = directions.times(&at).ok_or("no product")?;
        check(i, &product, &at).map_err(|error| format!("{bits} bits, {i}: {error}"))?;
    }
    Ok(())
}

#[derive(Clone, Copy, Debug)]
enum ProductFault {
    /// The density is that of the tree.
    TreeAlone,
    /// The density is that for a diffuse receiver.
    NoLobe,
}

struct FaultyProduct<'a, 'b>(
    &'b QuadtreeProduct<'a>,
    Option<(ProductFault, QuadtreeProduct<'a>)>,
);

impl DirectionDistribution for FaultyProduct<'_, '_> {
    fn sample(&self, u: [f32; 2]) -> Option<(Vec3, Density<SolidAngle>)> {
        let (direction, _) = self.0.sample(u)?;
        Some((direction, self.pdf(direction)))
    }

    fn pdf(&self, direction: Vec3) -> Density<SolidAngle> {
        match &self.1 {
            None => self.0.pdf(direction),
            Some((ProductFault::TreeAlone, _)) => self.0.seen().pdf(direction),
            Some((ProductFault::NoLobe, other)) => other.pdf(direction),
        }
    }
}

/// Densities of products are those of their samples, at 10⁻⁶ for each of 18.
#[test]
fn products_sample_their_density() {
    check_faults(&[ProductFault::TreeAlone, ProductFault::NoLobe], |fault| {
        for bits in [32, 64, 128] {
            with_products(bits, 6, |i, product, at| {
                let diffuse = ShadingPoint {
                    gloss: Gloss::default(),
                    ..*at
                };
                let other = product.seen().times(&diffuse).ok_or("no product")?;
                check_directions(
                    &FaultyProduct(product, fault.map(|fault| (fault, other))),
                    i.into(),
                )
            })?;
        }
        Ok::<_, String>(())
    })
    .unwrap();
}

/// The ratio is that of the densities.
#[test]
fn ratios_are_those_of_densities() {
    with_products(64, 20, |_, product, _| {
        for i in 0..2000 {
            let direction = UniformSphere::sample(CounterRng::new(9, i, 0).next_2d());
            let truth = product.pdf(direction).value() / product.seen().pdf(direction).value();
            let ratio = product.ratio(direction);
            if (ratio - truth.max(1.0 / 64.0)).abs() > 1e-4 * ratio {
                return Err(format!("{ratio}, not {truth}"));
            }
        }
        Ok(())
    })
    .unwrap();
}

/// Light times the cosine: the product has at most three quarters of the tree's second moment, over
/// receivers of all orientations. That of a receiver that faces away gains nothing.
#[test]
fn products_have_a_lower_second_moment() {
    check_faults(&[()], |fault| {
        let (mut with, mut without) = (0.0, 0.0);
        let others = lobes(20_000, 4);
        with_products(64, 30, |_, product, at| {
            let turned = ShadingPoint {
                normal: if fault.is_some() { -at.normal } else { at.normal },
                gloss: Gloss::default(),
                ..*at
            };
            let product = product.seen().times(&turned).ok_or("no product")?;
            let moment = |pdf: &dyn Fn(Vec3) -> f32| -> f64 {
                let term = |sample: &GuidingSample| {
                    let f = f64::from(sample.weight * at.normal.dot(sample.direction).max(0.0));
                    let cosine = f64::from(at.normal.dot(sample.direction).max(0.0)) / PI;
                    f * f / (0.5 * cosine + 0.5 * f64::from(pdf(sample.direction))).max(1e-9)
                };
                others.iter().map(term).sum()
            };
            with += moment(&|direction| product.pdf(direction).value());
            without += moment(&|direction| product.seen().pdf(direction).value());
            Ok(())
        })?;
        println!("{with} with the product, {without} without");
        match with < 0.75 * without {
            true => Ok(()),
            false => Err(format!("{with} and {without}")),
        }
    })
    .unwrap();
}

//! Properties of every sampler, and faults that these tests must find.

use crate::block::WIDTH;
use crate::descent::{cdf_of_all, probability_of};
use crate::testing::{LAYOUTS, Layout, lights_of, points, segments};
use crate::tree::{Child, Tree};
use crate::weighing::Receiver;
use crate::{
    BvhBuild, Light, LightBvh, LightChoice, LightSampler, OpenedTree, PerfectTree, PerfectTreeOptions,
    PowerLights, ShadingPoint, Stride, UniformLights, Weighting,
};
use lightshed_lanes::{ArrayLanes, Lanes};
use lightshed_sampling::CounterRng;
use lightshed_testkit::{check_faults, chi_squared_test};

/// Probabilities of all lights and of none, by visiting all of the tree.
pub(crate) fn enumerate<T: Tree, R: Receiver>(tree: &T, at: &R) -> (Vec<f64>, f64) {
    enumerate_from(tree, at, &[(tree.root(), 1.0)])
}

/// The same from some nodes with their probabilities.
fn enumerate_from<T: Tree, R: Receiver>(
    tree: &T,
    at: &R,
    from: &[(Child<T::NodeId>, f64)],
) -> (Vec<f64>, f64) {
    fn visit<T: Tree, R: Receiver>(
        tree: &T,
        at: &R,
        child: Child<T::NodeId>,
        here: f64,
        found: &mut (Vec<f64>, f64),
    ) {
        let node = match child {
            Child::Leaf(light) => return found.0[light as usize] += here,
            Child::Inner(node) => node,
        };
        // Zero only where the node cannot contribute, as probabilities are.
        let parts = at.weights::<ArrayLanes>(&tree.siblings(node)).store();
        let cdf = cdf_of_all::<ArrayLanes, T, R>(tree, at, node);
        if cdf.total() == 0.0 {
            assert_eq!(parts, [0.0; WIDTH]);
            found.1 += here;
            return;
        }
        for (lane, part) in parts.into_iter().enumerate() {
            let probability = cdf.probability(lane);
            assert!(
                (probability > 0.0) == (part > 0.0),
                "lane {lane} has {probability}: {parts:?}"
            );
            if part > 0.0 {
                visit(tree, at, tree.child(node, lane), here * probability, found);
            }
        }
    }
    let mut found = (vec![0.0; tree.lights()], 0.0);
    for &(step, here) in from {
        visit(tree, at, step, here, &mut found);
    }
    found
}

/// Trees under test: every kind, for these lights.
macro_rules! for_every_tree {
    ($lights:expr, |$name:ident, $tree:ident| $body:block) => {
        for stride in [Stride::One, Stride::Three] {
            for weighting in [Weighting::Center, Weighting::MinMax, Weighting::Yuksel] {
                let options = PerfectTreeOptions::default()
                    .with_stride(stride)
                    .with_weighting(weighting);
                let $name = format!("perfect tree, {stride:?}, {weighting:?}");
                let $tree = PerfectTree::with_options($lights, options).unwrap();
                $body
            }
        }
        for build in [
            BvhBuild::Binned,
            BvhBuild::AlongCurve,
            BvhBuild::Stochastic,
            BvhBuild::Agglomerative,
        ] {
            let ($name, $tree) = (
                format!("light BVH, {build:?}"),
                LightBvh::with_build($lights, build).unwrap(),
            );
            $body
        }
    };
}

/// `Σ pmf + P(none) = 1`, and the pmf that is reported is that of the enumeration.
fn check_sum<T: Tree + LightSampler<R>, R: Receiver>(name: &str, tree: &T, at: &R) {
    if at.is_black() {
        assert_eq!(tree.sample(at, 1 << 60), None);
        assert_eq!(tree.pmf(at, 0), 0.0);
        return;
    }
    let (expected, none) = enumerate(tree, at);
    let mut sum = 0.0;
    for (light, &expected) in expected.iter().enumerate() {
        let pmf = LightSampler::pmf(tree, at, light as u32);
        assert!(
            (f64::from(pmf) - expected).abs() <= 1e-6 * expected + 1e-30,
            "{name}: light {light} has {pmf}, not {expected}"
        );
        sum += f64::from(pmf);
    }
    assert!((sum + none - 1.0).abs() < 1e-6, "{name}: {sum} + {none} is not 1");
    assert_eq!(tree.pmf(at, tree.lights() as u32), 0.0);
}

#[test]
fn probabilities_add_up() {
    for layout in LAYOUTS {
        for count in [1, 2, 7, 8, 9, 100, 4096] {
            let lights = lights_of(layout, count, 11);
            let at = points(&lights, if count > 1000 { 4 } else { 32 }, 3);
            let stretches = segments(4, 5);
            for_every_tree!(&lights, |name, tree| {
                let name = format!("{name}, {count} {layout:?}");
                at.iter().for_each(|at| check_sum(&name, &tree, at));
                stretches.iter().for_each(|at| check_sum(&name, &tree, at));
            });
        }
    }
}

/// The same with near nodes opened.
#[test]
fn opened_probabilities_add_up() {
    for layout in LAYOUTS {
        for count in [1, 2, 9, 100, 300, 4096] {
            let lights = lights_of(layout, count, 11);
            let name = format!("{count} {layout:?}");
            let at = points(&lights, if count > 1000 { 2 } else { 16 }, 3);
            check_opened(&name, &LightBvh::new(&lights).unwrap(), &at);
            check_opened(&name, &PerfectTree::new(&lights).unwrap(), &at);
        }
    }
}

/// The pmf of an opened tree against the enumeration from the nodes of its cut.
fn check_opened<T: Tree + Clone>(name: &str, tree: &T, at: &[ShadingPoint]) {
    let opened = OpenedTree::new(tree.clone());
    for at in at {
        let cut = opened.cut_for(at);
        let (expected, none) = enumerate_from(tree, at, &cut);
        let none = none + 1.0 - cut.iter().map(|(_, here)| here).sum::<f64>();
        let mut sum = 0.0;
        for (light, &expected) in expected.iter().enumerate() {
            let pmf = f64::from(LightSampler::pmf(&opened, at, light as u32));
            assert!(
                (pmf - expected).abs() <= 1e-6 * expected + 1e-30,
                "light {light} of {name}: {pmf} is not {expected}"
            );
            sum += pmf;
        }
        assert!((sum + none - 1.0).abs() < 1e-6, "{name}: {sum} + {none} is not 1");
    }
}

/// Samples have the pmf that is reported, bit for bit; alone and in a batch.
fn check_agreement<S: LightSampler<R>, R>(name: &str, sampler: &S, at: &R, count: u32) {
    let mut rng = CounterRng::new(17, count, 0);
    let mut u: Vec<u64> = (0..count).map(|_| rng.next_u64()).collect();
    u[0] = u64::MAX;
    u[1] = 0;
    for sorted in [false, true] {
        if sorted {
            u.sort_unstable();
        }
        let mut together = vec![None; u.len()];
        sampler.sample_many(at, &u, &mut together);
        for (&u, &together) in u.iter().zip(&together) {
            let alone = sampler.sample(at, u);
            assert_eq!(alone, together, "{name}: {u:#x} alone and in a batch");
            if let Some(LightChoice { light, pmf }) = alone {
                assert!(pmf > 0.0);
                assert_eq!(pmf.to_bits(), sampler.pmf(at, light).to_bits(), "{name}");
            }
        }
    }
}

#[test]
fn sample_and_pmf_are_the_same_number() {
    for layout in LAYOUTS {
        for count in [1, 5, 300, 4096] {
            let lights = lights_of(layout, count, 23);
            let at = points(&lights, 12, 9);
            let stretches = segments(3, 1);
            for_every_tree!(&lights, |name, tree| {
                at.iter().for_each(|at| check_agreement(&name, &tree, at, 150));
                stretches
                    .iter()
                    .for_each(|at| check_agreement(&name, &tree, at, 150));
            });
            let (uniform, power) = (
                UniformLights::new(count).unwrap(),
                PowerLights::new(&lights).unwrap(),
            );
            let opened = OpenedTree::new(LightBvh::new(&lights).unwrap());
            at.iter()
                .for_each(|at| check_agreement("opened BVH", &opened, at, 150));
            stretches
                .iter()
                .for_each(|at| check_agreement("opened BVH", &opened, at, 150));
            let opened = OpenedTree::new(PerfectTree::new(&lights).unwrap());
            at.iter()
                .for_each(|at| check_agreement("opened tree", &opened, at, 150));
            check_agreement("uniform", &uniform, &at[0], 150);
            check_agreement("power", &power, &at[0], 150);
        }
    }
}

/// Receivers that go down together choose what each chooses alone, also if they have several
/// numbers; black ones choose nothing.
/// Planted fault: numbers of different receivers that share a node's distribution.
#[test]
fn batches_change_no_choice() {
    for count in [1, 9, 4096] {
        let lights = lights_of(Layout::Clustered, count, 23);
        let mut at = points(&lights, 50, 9);
        at[7].reflectance_bound = 0.0;
        let mut rng = CounterRng::new(3, count as u32, 0);
        let u: Vec<u64> = at.iter().map(|_| rng.next_u64()).collect();
        for_every_tree!(&lights, |name, tree| {
            let mut together = vec![None; at.len()];
            tree.sample_each(&at, &u, &mut together);
            for ((at, &u), &together) in at.iter().zip(&u).zip(&together) {
                assert_eq!(tree.sample(at, u), together, "{name}, {count} lights");
            }
            // One to three numbers each; some receivers come again.
            let of: Vec<u8> = (0..at.len()).map(|i| (i / (1 + i % 3)) as u8).collect();
            tree.sample_for(&at, &of, &u, &mut together);
            for ((&of, &u), together) in of.iter().zip(&u).zip(together) {
                assert_eq!(
                    tree.sample(&at[usize::from(of)], u),
                    together,
                    "{name}, {count} lights"
                );
            }
        });
    }
}

/// Histograms of choices against pmfs, χ² at a significance of 1e-4 shared among about 50 tests;
/// with faults.
#[test]
fn samples_follow_the_pmf() {
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// The pmf of another point.
        OtherPoint,
        /// A number of few bits.
        FewBits,
        /// The pmf of the next light.
        Neighbour,
    }
    let lights = lights_of(Layout::Clustered, 200, 4);
    // Where more than one light matters.
    let many_matter = |at: &ShadingPoint| {
        let (pmf, none) = enumerate(&PerfectTree::new(&lights).unwrap(), at);
        pmf.iter().chain([&none]).all(|&p| p < 0.5)
    };
    let at: Vec<ShadingPoint> = points(&lights, 60, 6)
        .into_iter()
        .filter(many_matter)
        .take(8)
        .collect();
    assert_eq!(at.len(), 8);
    check_faults(&[Fault::OtherPoint, Fault::FewBits, Fault::Neighbour], |fault| {
        let mut result = Ok(());
        for_every_tree!(&lights, |name, tree| {
            for (i, point) in at.iter().enumerate() {
                let (mut counts, mut expected) = (vec![0u64; 201], vec![0.0; 201]);
                let mut rng = CounterRng::new(31, i as u32, 0);
                let samples = 4000;
                for _ in 0..samples {
                    let mut u = rng.next_u64();
                    if let Some(Fault::FewBits) = fault {
                        u &= 0xf << 60;
                    }
                    let light = tree.sample(point, u).map_or(200, |c| c.light);
                    counts[light as usize] += 1;
                }
                let pmf_at = match fault {
                    Some(Fault::OtherPoint) => &at[(i + 1) % at.len()],
                    _ => point,
                };
                let off = u32::from(matches!(fault, Some(Fault::Neighbour)));
                for (light, expected) in (0..200).zip(&mut expected) {
                    *expected = probability_of::<ArrayLanes, _, _>(&tree, pmf_at, (light + off) % 200);
                }
                expected[200] = (1.0 - expected[..200].iter().sum::<f64>()).max(0.0);
                if result.is_ok() {
                    let expected: Vec<f64> = expected.iter().map(|p| p * f64::from(samples)).collect();
                    let report = chi_squared_test(&counts, &expected, 2e-6);
                    result = match report {
                        Ok(_) => Ok(()),
                        Err(error) => Err(format!("{name}: {error}")),
                    };
                }
            }
        });
        result
    })
    .expect("every fault is found");
}

/// Trees built on any number of threads, and by pools of any size, choose the same lights.
#[cfg(feature = "parallel")]
#[test]
fn threads_change_nothing() {
    let lights = lights_of(Layout::Clustered, 150_000, 6);
    let at = points(&lights, 50, 4);
    let u: Vec<u64> = (0..20).map(|i| i * (u64::MAX / 20)).collect();
    let choices = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let bvh = |build| LightBvh::with_build(&lights, build).unwrap();
        let (perfect, binned, along_curve, stochastic) = pool.install(|| {
            (
                PerfectTree::new(&lights).unwrap(),
                bvh(BvhBuild::Binned),
                bvh(BvhBuild::AlongCurve),
                bvh(BvhBuild::Stochastic),
            )
        });
        let mut all = Vec::new();
        for at in &at {
            for sampler in [&perfect as &dyn LightSampler, &binned, &along_curve, &stochastic] {
                all.extend(u.iter().map(|&u| sampler.sample(at, u)));
            }
        }
        all
    };
    let one = choices(1);
    assert!(one.iter().filter(|c| c.is_some()).count() > 500);
    for threads in [2, 3, 8] {
        assert_eq!(one, choices(threads), "{threads} threads");
    }
}

/// With 2²⁰ lights there is a number for each that has a pmf, the one in the middle of its
/// share; a number of few bits does not find them all.
#[test]
fn every_light_of_a_million_is_reached() {
    let lights = lights_of(Layout::Uniform, 1 << 20, 8);
    let at = ShadingPoint::without_normal(glam::Vec3::new(0.3, 3.0, 0.2));
    check_faults(&[16, 24], |few_bits| {
        check_reached(&PerfectTree::new(&lights).unwrap(), &at, few_bits)?;
        // One fault is enough of them.
        if few_bits.is_some() {
            return Ok::<(), String>(());
        }
        for build in [BvhBuild::Binned, BvhBuild::AlongCurve, BvhBuild::Stochastic] {
            check_reached(&LightBvh::with_build(&lights, build).unwrap(), &at, few_bits)?;
        }
        Ok(())
    })
    .expect("numbers of few bits are noticed");
}

fn check_reached<T: Tree + LightSampler>(
    tree: &T,
    at: &ShadingPoint,
    few_bits: Option<u32>,
) -> Result<(), String> {
    let (mut possible, mut refreshed) = (0, 0);
    for light in (0..tree.lights() as u32).step_by(7) {
        let Some(path) = tree.path_to(light) else { continue };
        if !(tree.pmf(at, light) > 0.0) {
            continue;
        }
        possible += 1;
        // The middle of the light's share, as far as the number's first bits tell.
        let (mut low, mut width, mut i) = (0.0, 1.0, 0);
        while let Some((node, lane)) = path.step(i) {
            let cdf = cdf_of_all::<ArrayLanes, T, _>(tree, at, node);
            let before: f64 = (0..lane).map(|lane| cdf.probability(lane)).sum();
            low += width * before;
            width *= cdf.probability(lane);
            i += 1;
            // From here on other bits decide: any that lead this path will do.
            if width < 1.0 / (1u64 << 26) as f64 {
                refreshed += 1;
                break;
            }
        }
        let found = |u: u64| {
            let u = few_bits.map_or(u, |bits| u >> (64 - bits) << (64 - bits));
            tree.sample(at, u).is_some_and(|choice| choice.light == light)
        };
        let number = |place: f64| (place * 2.0_f64.powi(64)) as u64;
        let middle = number(low + 0.5 * width);
        // Where bits are made anew within the share, so many numbers of it are tried that one that
        // fails to lead there has a chance of less than 1e-9.
        let tries = if path.step(i).is_some() { 1 << 16 } else { 0 };
        let others = (0..tries).map(|k| number(low + width * ((f64::from(k) + 0.5) / f64::from(tries))));
        if !found(middle) && !others.into_iter().any(found) {
            return Err(format!(
                "light {light} of pmf {} is out of reach",
                tree.pmf(at, light)
            ));
        }
    }
    if possible < tree.lights() / 16 {
        return Err(format!(
            "{possible} lights are a weak test, {refreshed} refreshed"
        ));
    }
    Ok(())
}

/// Mean cosine-weighted irradiance can only come from lights that can be chosen: a light that has a
/// point above the receiver's horizon which sees the receiver on its emitting side has a positive
/// pmf.
#[test]
fn a_pmf_of_zero_means_no_light() {
    for layout in [Layout::Uniform, Layout::Clustered, Layout::Overlapping] {
        let lights = lights_of(layout, 60, 19);
        let at = points(&lights, 200, 2);
        let mut dark = 0;
        for_every_tree!(&lights, |name, tree| {
            for (i, point) in at.iter().enumerate() {
                let mut rng = CounterRng::new(1, i as u32, 5);
                for (index, light) in lights.iter().enumerate() {
                    let contributes = (0..8).any(|_| contributes(light, point, &mut rng));
                    let pmf = tree.pmf(point, index as u32);
                    assert!(!contributes || pmf > 0.0, "{name}: light {index} at point {i}");
                    dark += usize::from(pmf == 0.0 && light.intensity > 0.0);
                }
            }
        });
        assert!(dark > 0, "the test would pass if nothing were ever zero");
    }
}

/// Whether a random point of the light, with a random normal of its cone, sends light to the
/// receiver.
fn contributes(light: &Light, at: &ShadingPoint, rng: &mut CounterRng) -> bool {
    use crate::Facing;
    use lightshed_sampling::{Frame, UniformCone};
    if light.intensity == 0.0 {
        return false;
    }
    let u = glam::Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
    let to_receiver = at.position - (light.bounds.min + u * light.bounds.diagonal());
    let received = match at.facing {
        Facing::Front => at.normal.dot(-to_receiver) > 0.0,
        Facing::Both => at.normal.dot(to_receiver) != 0.0,
        Facing::All => true,
    };
    let emitted = light.cone.is_none_or(|cone| {
        let normals = UniformCone::from_one_minus_cos(1.0 - cone.normals_angle.cos());
        let normal = Frame::from_normal(cone.axis).to_world(normals.sample(rng.next_2d()));
        normal.dot(to_receiver) > to_receiver.length() * cone.emission_angle.cos().max(0.0)
    });
    received && emitted
}

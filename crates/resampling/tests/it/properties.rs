//! Properties over arbitrary targets: zeros, subnormals, 1e±30, the largest `f32`.

use lightshed_resampling::{
    ContributionWeight, Counting, Domain, Input, Jacobian, Mis, MixtureRis, Pairwise, PairwiseStream,
    Reservoir, Ris, Selection, ShiftMapping, Shifted, Technique, Undefined, integrate, merge,
};
use lightshed_testkit::rng;
use proptest::prelude::*;

/// Non-negative finite `f32`, with what breaks arithmetic well represented.
fn extreme() -> impl Strategy<Value = f32> {
    prop_oneof![
        2 => Just(0.0f32),
        1 => Just(f32::from_bits(1)),
        1 => Just(1e-40f32),
        1 => Just(1e-30f32),
        1 => Just(1e30f32),
        1 => Just(f32::MAX),
        4 => 1e-3f32..1e3,
        2 => (0u32..0x7F80_0000).prop_map(f32::from_bits),
    ]
}

fn positive() -> impl Strategy<Value = f32> {
    extreme().prop_map(|value| value.max(f32::from_bits(1)))
}

fn family() -> impl Strategy<Value = Mis> {
    prop_oneof![
        Just(Mis::Balance),
        Just(Mis::PAIRWISE_UNIFORM),
        Just(Mis::PAIRWISE_DEFENSIVE),
        (1e-6f64..1e6, 0.0f64..=1.0).prop_map(|(a, k)| Mis::Pairwise(Pairwise::new(a, k).unwrap())),
    ]
}

/// Techniques at one `y`: canonical ones share a positive density.
fn techniques() -> impl Strategy<Value = Vec<Technique>> {
    let neighbours = prop::collection::vec((extreme(), extreme()), 0..8);
    let canonical = prop::collection::vec(1e-3f32..1e6, 1..4);
    (positive(), canonical, neighbours).prop_map(|(p, canonical, neighbours)| {
        let technique = |density: f32, confidence: f32, canonical| Technique {
            density: f64::from(density),
            confidence: f64::from(confidence),
            canonical,
        };
        let canonical = canonical.into_iter().map(|c| technique(p, c, true));
        canonical
            .chain(neighbours.into_iter().map(|(q, c)| technique(q, c, false)))
            .collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn weights_are_a_partition_of_unity(mis in family(), techniques in techniques()) {
        let mut m = vec![f64::NAN; techniques.len()];
        mis.weights(&techniques, &mut m);
        prop_assert!(m.iter().all(|m| (0.0..=1.0 + 1e-12).contains(m)), "{m:?}");
        prop_assert!((m.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{m:?}");
        for (m, technique) in m.iter().zip(&techniques) {
            prop_assert!(technique.density > 0.0 || *m == 0.0, "weight for what cannot produce y");
        }
    }

    /// `w_i = m_i (p̂/q_i) B_i ≤ B_i c_i/C_R` (Lin 2022 eq. 6.39), for `α ≤ C_N/C_R`.
    #[test]
    fn resampling_weights_are_bounded(
        mis in prop_oneof![
            Just(Mis::Balance), Just(Mis::PAIRWISE_UNIFORM), Just(Mis::PAIRWISE_DEFENSIVE)
        ],
        techniques in techniques(),
    ) {
        let mut m = vec![0.0; techniques.len()];
        mis.weights(&techniques, &mut m);
        let p = techniques[0].density;
        let canonical: f64 = techniques.iter().filter(|t| t.canonical).map(|t| t.confidence).sum();
        for (m, t) in m.iter().zip(&techniques).filter(|(_, t)| t.density > 0.0) {
            let relative = m * p / t.density;
            let bound = t.confidence / canonical;
            prop_assert!(relative <= bound * (1.0 + 1e-9), "{relative} {bound} {t:?}");
        }
    }

    #[test]
    fn merging_extreme_numbers_stays_finite(
        mis in prop_oneof![family(), Just(Mis::ConstantBiased), Just(Mis::ConstantDebiased)],
        rows in prop::collection::vec((prop::array::uniform3(extreme()), 0usize..3, extreme(), extreme()), 1..7),
        jacobian in positive(),
        seed in any::<u64>(),
    ) {
        let domains: Vec<Wild> =
            rows.iter().map(|row| Wild { targets: row.0.map(f64::from), jacobian: f64::from(jacobian) }).collect();
        let reservoirs: Vec<Reservoir<usize, Counting>> = rows
            .iter()
            .map(|row| Reservoir::new(row.1, ContributionWeight::new(row.2).unwrap(), row.3).unwrap())
            .collect();
        let mut inputs = vec![Input::canonical(&domains[0], &reservoirs[0])];
        inputs.extend(domains.iter().zip(&reservoirs).skip(1).map(|(d, r)| Input::neighbour(d, r)));
        let outcome = merge(&domains[0], &WildShift, &inputs, mis, &mut rng(seed));
        let neighbours: f64 = rows[1..].iter().map(|row| f64::from(row.3)).sum();
        if let Ok(merged) = outcome {
            let (reservoir, report) = (merged.reservoir, merged.report);
            prop_assert!(reservoir.weight().value().is_finite() && reservoir.weight().value() >= 0.0);
            prop_assert!(reservoir.confidence().is_finite());
            prop_assert!(report.weight_sum.is_finite() && report.weight_square_sum.is_finite());
            let effective = report.effective_count();
            prop_assert!((0.0..=rows.len() as f64 + 1e-6).contains(&effective), "{effective}");
            prop_assert_eq!(report.selected.is_some(), !reservoir.is_empty());
            prop_assert!(report.selected.is_none() || report.target > 0.0);
        } else {
            prop_assert!(rows[0].3 == 0.0 && neighbours > 0.0);
        }
        let summed = integrate(&domains[0], &WildShift, &inputs, mis, |part| {
            assert!(part.weight.is_finite() && part.weight >= 0.0);
        });
        prop_assert_eq!(summed.is_ok(), rows[0].3 > 0.0 || neighbours == 0.0 || !matches!(mis, Mis::Pairwise(_)));
        if let (Mis::Pairwise(pairwise), true) = (mis, rows[0].3 > 0.0) {
            let mut rng = rng(seed);
            let mut stream =
                PairwiseStream::new(&domains[0], &domains[0], &reservoirs[0], pairwise, neighbours).unwrap();
            for (domain, reservoir) in domains.iter().zip(&reservoirs).skip(1) {
                stream.neighbour(domain, reservoir, &WildShift, &mut rng).unwrap();
            }
            let merged = stream.finish(&mut rng);
            prop_assert!(merged.reservoir.weight().value().is_finite());
            prop_assert!(merged.report.weight_sum.is_finite());
        }
    }

    #[test]
    fn ris_of_extreme_numbers_stays_finite(
        candidates in prop::collection::vec((extreme(), extreme(), 0.0f64..1.0), 0..20),
        seed in any::<u64>(),
    ) {
        let mut rng = rng(seed);
        let mut single = Ris::<usize, Counting>::new();
        let mut mixture = MixtureRis::<usize, Counting>::new();
        for (i, (target, weight, m)) in candidates.iter().enumerate() {
            let weight = ContributionWeight::<Counting>::new(*weight).unwrap();
            single.candidate(i, f64::from(*target), weight, &mut rng);
            mixture.candidate(i, f64::from(*target), *m, weight, &mut rng);
        }
        let positive = candidates.iter().any(|(t, w, _)| *t > 0.0 && *w > 0.0);
        let single: Reservoir<usize, Counting> = single.finish(1.0);
        let mixture: Reservoir<usize, Counting> = mixture.finish(1.0);
        prop_assert_eq!(!single.is_empty(), positive);
        for reservoir in [single, mixture] {
            prop_assert!(reservoir.weight().value().is_finite() && reservoir.weight().value() >= 0.0);
            if let Some(&i) = reservoir.sample() {
                prop_assert!(candidates[i].0 > 0.0 && candidates[i].1 > 0.0);
            }
        }
    }

    #[test]
    fn selections_never_take_what_has_no_weight(
        weights in prop::collection::vec(any::<f64>(), 0..20), seed in any::<u64>()
    ) {
        let mut rng = rng(seed);
        let mut selection = Selection::new();
        for (i, w) in weights.iter().enumerate() {
            selection.offer(i, *w, &mut rng);
        }
        prop_assert!(selection.weight_sum().is_finite() && selection.weight_sum() >= 0.0);
        prop_assert!(selection.item().is_none_or(|&i| weights[i] > 0.0 && weights[i].is_finite()));
        prop_assert_eq!(selection.item().is_some(), weights.iter().any(|w| *w > 0.0 && w.is_finite()));
    }
}

/// Three points with arbitrary targets. Point 2 shifts nowhere; others keep their place, with an
/// arbitrary Jacobian.
struct Wild {
    targets: [f64; 3],
    jacobian: f64,
}

impl Domain for Wild {
    type Sample = usize;
    type Space = Counting;
    fn target(&self, &x: &usize) -> f64 {
        self.targets[x]
    }
}

struct WildShift;

impl ShiftMapping<Wild> for WildShift {
    fn shift(&self, &x: &usize, from: &Wild, to: &Wild) -> Result<Shifted<usize>, Undefined> {
        if x == 2 {
            return Err(Undefined::NotConnectable);
        }
        let forward = core::ptr::from_ref(from) < core::ptr::from_ref(to);
        let jacobian = Jacobian::new(if forward {
            from.jacobian
        } else {
            1.0 / from.jacobian
        })?;
        Ok(Shifted {
            sample: x,
            jacobian,
            target: to.target(&x),
        })
    }
}

/// Planted faults for the first two properties: constant weights give a share to techniques that
/// cannot produce `y`, and let weights grow without bound where a neighbour is unlikely to.
#[test]
fn constant_weights_break_partition_and_bound() {
    let technique = |density, canonical| Technique {
        density,
        confidence: 1.0,
        canonical,
    };
    let mut m = [0.0; 2];
    Mis::ConstantBiased.weights(&[technique(1.0, true), technique(0.0, false)], &mut m);
    assert_eq!(m[1], 0.5, "a share for what cannot produce y");
    Mis::ConstantBiased.weights(&[technique(1.0, true), technique(1e-6, false)], &mut m);
    assert!(m[1] * 1.0 / 1e-6 > 1.0, "beyond the bound");
}

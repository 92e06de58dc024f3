//! RIS, its stages, several techniques, several outputs, and merged streams.

use super::finite::{ByLabel, Enumerate, Finite, HERE, Pixel, deviation};
use lightshed_resampling::{
    Counting, Input, Mis, MixtureRis, Ris, RisMany, Tractable, balance_over_techniques, merge,
};
use lightshed_testkit::{check_faults, expectation_vector};

fn weight(density: f64) -> lightshed_resampling::ContributionWeight<Counting, f64> {
    Tractable::from_density(density).unwrap().weight()
}

#[test]
fn three_candidates() {
    let result = expectation_vector(|chooser| HERE.indicators(&HERE.draw(chooser, 3, 1.0)));
    assert!(deviation(&result.values, &HERE.truth()) < 1e-12);
}

#[test]
fn a_second_stage_with_a_dearer_target() {
    // The dear target vanishes at a point where the cheap one does not.
    let dear = [0.0, 1.0, 7.0, 0.0, 0.2];
    let result = expectation_vector(|chooser| {
        let mut second = Ris::<usize, Counting>::new();
        for _ in 0..2 {
            let survivor = HERE.draw(chooser, 2, 1.0);
            second.reservoir(&survivor, |&x| dear[x], &mut Enumerate(chooser));
        }
        let reservoir: Pixel = second.finish(1.0);
        HERE.indicators(&reservoir)
    });
    let truth: Vec<f64> = HERE
        .truth()
        .iter()
        .zip(dear)
        .map(|(&t, d)| if d > 0.0 { t } else { 0.0 })
        .collect();
    assert!(deviation(&result.values, &truth) < 1e-12);
}

#[test]
fn several_outputs_share_the_pool() {
    let result = expectation_vector(|chooser| {
        let mut ris = RisMany::<usize, Counting, 2>::new();
        for _ in 0..2 {
            let x = chooser.choose(HERE.pmf);
            ris.candidate(
                &x,
                HERE.target[x],
                weight(HERE.density(x)),
                &mut Enumerate(chooser),
            );
        }
        let outputs: [Pixel; 2] = ris.finish(1.0);
        outputs
            .iter()
            .flat_map(|output| HERE.indicators(output))
            .collect::<Vec<_>>()
    });
    let truth = [HERE.truth(), HERE.truth()].concat();
    assert!(deviation(&result.values, &truth) < 1e-12);
}

#[test]
fn several_techniques() {
    // Neither technique covers the target alone; the first draws two candidates.
    let pmfs: [[f64; 5]; 2] = [[0.5, 0.0, 0.25, 0.25, 0.0], [0.0, 0.3, 0.3, 0.0, 0.4]];
    let counts = [2, 1];
    let result = expectation_vector(|chooser| {
        let mut ris = MixtureRis::<usize, Counting>::new();
        for (technique, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                let x = chooser.choose(&pmfs[technique]);
                let density = |t: usize| pmfs[t][x] / HERE.measure[x];
                let m = balance_over_techniques(&[(2, density(0)), (1, density(1))], technique);
                ris.candidate(
                    x,
                    HERE.target[x],
                    m,
                    weight(density(technique)),
                    &mut Enumerate(chooser),
                );
            }
        }
        let reservoir: Pixel = ris.finish(1.0);
        HERE.indicators(&reservoir)
    });
    assert!(deviation(&result.values, &HERE.truth()) < 1e-12);
}

#[test]
fn merged_streams_are_one_stream() {
    let outcomes = |split: bool| {
        lightshed_testkit::distribution(|chooser| {
            let mut streams = [Ris::<usize, Counting>::new(), Ris::new()];
            for i in 0..3 {
                let x = chooser.choose(HERE.pmf);
                let w = weight(HERE.density(x));
                let stream = &mut streams[usize::from(split && i > 0)];
                stream.candidate(x, HERE.target[x], w, &mut Enumerate(chooser));
            }
            let [mut first, second] = streams;
            first.merge(second, &mut Enumerate(chooser));
            let reservoir: Pixel = first.finish(1.0);
            reservoir
                .weighted_sample()
                .map(|(&x, w)| (x, (w.value() * 1e9).round() as i64))
        })
    };
    let (one, two) = (outcomes(false), outcomes(true));
    assert_eq!(one.len(), two.len());
    for ((key, p), (key_two, p_two)) in one.iter().zip(&two) {
        assert!(key == key_two && (p - p_two).abs() < 1e-14);
    }
}

/// Visibility tested once before reuse: the target of the next stage has it, and the neighbour's
/// domain does.
#[test]
fn a_visibility_test_before_reuse() {
    let visible = |x: usize| x != 1;
    const SEEN: Finite = Finite {
        target: &[0.7, 0.0, 0.1, 0.0, 3.0],
        ..HERE
    };
    let shift = ByLabel { gate: f64::INFINITY };
    // The fault: the neighbour's domain still counts what it discarded.
    check_faults(&["target without visibility"], |fault| {
        let result = expectation_vector(|chooser| {
            let neighbour = HERE.draw(chooser, 2, 3.0).within(|&x| visible(x));
            let own = HERE.draw(chooser, 1, 1.0);
            let domain = if fault.is_some() { &HERE } else { &SEEN };
            let inputs = [
                Input::canonical(&HERE, &own),
                Input::neighbour(domain, &neighbour),
            ];
            let merged = merge(&HERE, &shift, &inputs, Mis::Balance, &mut Enumerate(chooser)).unwrap();
            HERE.indicators(&merged.reservoir)
        });
        let error = deviation(&result.values, &HERE.truth());
        if error < 1e-12 { Ok(()) } else { Err(error) }
    })
    .unwrap();
}

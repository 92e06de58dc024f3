//! Merges that keep several samples: each of them is a reservoir of its own.

use super::finite::{ByLabel, ELSEWHERE, Enumerate, HERE, Pixel, THERE, deviation};
use super::merging::unbiased_families;
use lightshed_resampling::{Input, merge_several};
use lightshed_testkit::{check_faults, expectation_vector};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Different samples are taken for one.
    AllTheSame,
    /// An input that holds what another one holds is left out.
    DuplicatesLeftOut,
}

const SHIFT: ByLabel = ByLabel { gate: f64::INFINITY };

#[test]
fn each_of_several_is_unbiased() {
    for mis in unbiased_families() {
        for count in 1..=3 {
            check_faults(&[Fault::AllTheSame, Fault::DuplicatesLeftOut], |fault| {
                let result = expectation_vector(|chooser| {
                    // Two from here, so that some are the same.
                    let mut own = [HERE.draw(chooser, 1, 1.0), HERE.draw(chooser, 1, 0.5)];
                    let others = [THERE.draw(chooser, 1, 2.0), ELSEWHERE.draw(chooser, 1, 0.5)];
                    if fault == Some(Fault::DuplicatesLeftOut) && own[0].sample() == own[1].sample() {
                        own[1] = Pixel::empty(0.5);
                    }
                    let inputs = [
                        Input::canonical(&HERE, &own[0]),
                        Input::canonical(&HERE, &own[1]),
                        Input::neighbour(&THERE, &others[0]),
                        Input::neighbour(&ELSEWHERE, &others[1]),
                    ];
                    let mut output = vec![Pixel::empty(0.0); count];
                    let same = |a: &usize, b: &usize| a == b || fault == Some(Fault::AllTheSame);
                    let to = &mut Enumerate(chooser);
                    let report = merge_several(&HERE, &SHIFT, &inputs, mis, same, &mut output, to).unwrap();
                    assert!(output.iter().all(|held| held.confidence() == 4.0));
                    let held = output.iter().filter(|held| !held.is_empty()).count();
                    assert_eq!(held, if report.weight_sum > 0.0 { count } else { 0 });
                    output
                        .iter()
                        .flat_map(|held| HERE.indicators(held))
                        .collect::<Vec<_>>()
                });
                let error = deviation(&result.values, &HERE.truth().repeat(count));
                (error < 1e-12).then_some(()).ok_or(error)
            })
            .unwrap();
        }
    }
}

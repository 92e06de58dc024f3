//! Chains of frames in a still scene: what the confidence cap is for (Lin 2022 fig. 6.2, §6.5.4).

use lightshed_resampling::{
    Counting, Domain, DomainReservoir, IdentityShift, Input, Mis, Ris, Tractable, merge,
};
use lightshed_sampling::CounterRng;
use lightshed_testkit::MeanTest;

const POINTS: u32 = 8;

struct Pixel;

impl Domain for Pixel {
    type Sample = u32;
    type Space = Counting;
    fn target(&self, &x: &u32) -> f64 {
        1.0 + f64::from(x)
    }
}

/// A colour channel that the target does not follow.
fn integrand(x: u32) -> f64 {
    Pixel.target(&x) * if x.is_multiple_of(2) { 0.2 } else { 1.8 }
}

/// Over an ensemble of independent chains: the last frame's estimate, and the average over all
/// frames.
fn chains(cap: f32, frames: u32) -> (MeanTest, MeanTest) {
    let weight = Tractable::<Counting>::from_density(1.0 / POINTS as f32)
        .unwrap()
        .weight();
    let (mut last, mut average) = (MeanTest::new(), MeanTest::new());
    for chain in 0..600 {
        let mut rng = CounterRng::new(5, chain, 0);
        let mut history = DomainReservoir::<Pixel>::empty(0.0);
        let mut sum = 0.0;
        for _ in 0..frames {
            let x = rng.next_u32() % POINTS;
            let mut ris = Ris::<u32, Counting>::new();
            ris.candidate(x, Pixel.target(&x), weight, &mut rng);
            let fresh: DomainReservoir<Pixel> = ris.finish(1.0);
            let inputs = [
                Input::canonical(&Pixel, &fresh),
                Input::neighbour(&Pixel, &history),
            ];
            let merged = merge(&Pixel, &IdentityShift, &inputs, Mis::Balance, &mut rng).unwrap();
            history = merged.reservoir.with_confidence_cap(cap);
            sum += history.estimate(|&x| integrand(x));
        }
        last.push(history.estimate(|&x| integrand(x)));
        average.push(sum / f64::from(frames));
    }
    (last, average)
}

/// Every frame is unbiased with any cap (false-positive rate 1e-6 each). The variance of the
/// average over frames falls as 1/frames with a cap; without one it stays: each chain converges to
/// a wrong value of its own, which one long chain would never show.
#[test]
fn without_a_cap_the_average_does_not_converge() {
    let truth: f64 = (0..POINTS).map(integrand).sum();
    let fall = |cap: f32| {
        let (early, late) = (chains(cap, 128), chains(cap, 1024));
        for ensemble in [&early.0, &early.1, &late.0, &late.1] {
            ensemble.test_against(truth, 1e-6).unwrap();
        }
        early.1.variance() / late.1.variance()
    };
    // Expected 8; the ratio of two variances of 600 chains is within 1.5 of it at far less than
    // 1e-6.
    let capped = fall(10.0);
    assert!((5.3..12.0).contains(&capped), "{capped}");
    // The planted fault: no cap. Eight times the frames leave the error nearly as it was.
    let uncapped = fall(f32::INFINITY);
    assert!(uncapped < 1.6, "{uncapped}");
}

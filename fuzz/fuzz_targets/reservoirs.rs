//! Streams of weights, merges and records in any order: sums stay finite, nothing without weight is
//! selected, and records give back what they were made of.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lightshed_resampling::{
    ContributionWeight, Counting, JumpSelection, Reservoir, ReservoirRecord, Selection, SelectionRecord,
    WithoutReplacement,
};
use lightshed_sampling::CounterRng;

/// A step: what is done, and a number of any bits.
fn steps(bytes: &[u8]) -> impl Iterator<Item = (u8, f64)> + '_ {
    bytes.chunks_exact(9).map(|step| {
        let bits = step[1..].try_into().unwrap_or([0; 8]);
        (step[0], f64::from_bits(u64::from_le_bytes(bits)))
    })
}

fn is_weight(number: f64) -> bool {
    number > 0.0 && number.is_finite()
}

fuzz_target!(|bytes: &[u8]| {
    let mut rng = CounterRng::new(1, 2, 3);
    let (mut stream, mut jumps) = (Selection::new(), JumpSelection::new());
    let (mut kept, mut record) = (WithoutReplacement::new(3), SelectionRecord::default());
    let mut weights = Vec::new();
    for (index, (what, number)) in (0u32..).zip(steps(bytes)) {
        weights.push(number);
        match what % 5 {
            0 => {
                let mut other = Selection::new();
                other.offer(index, number, &mut rng);
                stream.merge(other, &mut rng);
            }
            1 => {
                let mut other = JumpSelection::new();
                other.offer(index, number, &mut rng);
                jumps.merge(other, &mut rng);
            }
            2 => {
                let reservoir = ContributionWeight::new(number as f32)
                    .ok()
                    .and_then(|weight| Reservoir::<u32, Counting>::new(index, weight, f32::from(what)).ok());
                if let Some(reservoir) = reservoir {
                    let again = Reservoir::<u32, Counting>::try_from(ReservoirRecord::from(&reservoir));
                    assert!(again.is_ok_and(|again| again == reservoir || reservoir.is_empty()));
                    assert!(reservoir.estimate(|_| 1.0).is_finite());
                }
                kept.offer(index, number, &mut rng);
            }
            _ => {
                stream.offer(index, number, &mut rng);
                jumps.offer(index, number, &mut rng);
                record.offer(index, number as f32, rng.next_f32());
            }
        }
        assert!(record.weight_sum.is_finite() && record.weight_sum >= 0.0);
        assert!((record.weight_sum + record.weight_sum_low).is_finite());
    }
    let selected = |item: u32| {
        weights
            .get(item as usize)
            .is_some_and(|&weight| is_weight(weight))
    };
    for (sum, item) in [
        (stream.weight_sum(), stream.item().copied()),
        (jumps.weight_sum(), jumps.item().copied()),
    ] {
        assert!(sum.is_finite() && sum >= 0.0);
        assert_eq!(sum > 0.0, item.is_some());
        assert!(item.is_none_or(selected));
    }
    for kept in kept.iter() {
        assert!(selected(*kept.item) && is_weight(kept.inclusion) && kept.inclusion <= 1.0);
    }
    let resumed = Selection::from(record);
    assert!(resumed.weight_sum().is_finite());
});

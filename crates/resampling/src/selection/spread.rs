//! A sample of fixed size in which items appear as often as their weights say.

use crate::choose::Choose;

/// Draws `count` items in proportion to `weights`, spread out: item `i` appears `⌊e_i⌋` or
/// `⌈e_i⌉` times, where `e_i = count · w_i / Σ_j w_j`, and `e_i` times in the mean. So an
/// item appears twice only if it has more than a share of `1/count`, where independent draws
/// ([`Selections`](crate::Selections)) repeat any item.
///
/// `copies` becomes how often each item appears; they sum to `count`, or to 0 if no weight is
/// positive. Weights that are zero, negative or not finite count as 0. The fractional parts meet
/// in the order of the items, each time with one decision, after which one of the two is settled
/// (the sequential pivotal method, Deville & Tillé 1998).
///
/// # Panics
/// If the slices differ in length.
pub fn spread_copies(weights: &[f64], count: u32, copies: &mut [u32], choose: &mut impl Choose) {
    assert_eq!(weights.len(), copies.len(), "one number for each weight");
    // Also false for NaN.
    let usable = |weight: f64| match weight > 0.0 && weight < f64::INFINITY {
        true => weight,
        false => 0.0,
    };
    copies.fill(0);
    // Halved, so that no sum overflows; dividing by the largest keeps subnormal weights apart.
    let largest = weights
        .iter()
        .fold(0.0f64, |largest, &weight| largest.max(usable(weight)));
    if largest == 0.0 || count == 0 {
        return;
    }
    let total: f64 = weights.iter().map(|&weight| usable(weight) / largest).sum();
    // The item whose fate is open, with its chance.
    let mut open: Option<(usize, f64)> = None;
    for (item, &weight) in weights.iter().enumerate() {
        let expected = f64::from(count) * (usable(weight) / largest / total);
        copies[item] = expected as u32;
        let chance = expected.fract();
        if chance == 0.0 {
            continue;
        }
        open = match open {
            None => Some((item, chance)),
            // One of them goes on with both chances, the other is out.
            Some((other, before)) if before + chance < 1.0 - ROUNDING => {
                let stays = choose.accept(before, before + chance);
                Some((if stays { other } else { item }, before + chance))
            }
            // One of them is selected, the other goes on with the remaining chance.
            Some((other, before)) => {
                let rest = (before + chance - 1.0).max(0.0);
                let other_is_in = choose.accept(1.0 - chance, 1.0 - rest);
                let (taken, left) = if other_is_in { (other, item) } else { (item, other) };
                copies[taken] += 1;
                (rest > ROUNDING).then_some((left, rest))
            }
        };
    }
    // Chances sum to a whole number: the remaining chance is 0 or 1 except for rounding.
    if let Some((item, chance)) = open
        && chance > 0.5
    {
        copies[item] += 1;
    }
}

/// Chances that differ by less are one.
const ROUNDING: f64 = 1e-14;

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::CounterRng;

    /// Sizes, bounds and means over many draws, with weights of any size. The mean of 4,000 draws
    /// of a chance lies within 5 deviations (5 · 0.5/√4000): at most 6e-7 of false alarms an
    /// item.
    #[test]
    fn items_appear_as_often_as_they_should() {
        let cases: [&[f64]; 5] = [
            &[1.0, 1.0, 1.0, 1.0],
            &[0.3, 5.0, f64::NAN, 0.1, 1.7, 0.0, 2.2],
            &[f64::MAX, f64::MAX, 0.5 * f64::MAX],
            &[1e-310, 3e-310, 2e-310],
            &[7.0],
        ];
        for (case, weights) in cases.into_iter().enumerate() {
            let usable = |weight: f64| if weight > 0.0 { weight } else { 0.0 };
            let largest = weights.iter().fold(0.0f64, |a, &b| a.max(usable(b)));
            let total: f64 = weights.iter().map(|&w| usable(w) / largest).sum();
            for count in [1, 2, 5] {
                let mut sums = vec![0u32; weights.len()];
                let mut copies = vec![0; weights.len()];
                for draw in 0..4000 {
                    let mut rng = CounterRng::new(case as u64, draw, count);
                    spread_copies(weights, count, &mut copies, &mut rng);
                    assert_eq!(copies.iter().sum::<u32>(), count);
                    for (item, &copies) in copies.iter().enumerate() {
                        let expected = f64::from(count) * (usable(weights[item]) / largest / total);
                        assert!((f64::from(copies) - expected).abs() < 1.0 + 1e-9);
                        sums[item] += copies;
                    }
                }
                for (item, sum) in sums.into_iter().enumerate() {
                    let expected = f64::from(count) * (usable(weights[item]) / largest / total);
                    assert!((f64::from(sum) / 4000.0 - expected).abs() < 0.04);
                }
            }
        }
        let mut copies = [9; 3];
        spread_copies(
            &[0.0, -1.0, f64::INFINITY],
            4,
            &mut copies,
            &mut CounterRng::new(1, 2, 3),
        );
        assert_eq!(copies, [0; 3]);
    }
}

//! Long streams of weights over 24 decades.

use crate::Outcome;
use lightshed::resampling::{JumpSelection, Selection};
use lightshed::sampling::{CompensatedSum, CounterRng};
use serde_json::json;

/// Streams `count` items with weights between 1e-12 and 1e12, large before small, through many
/// reservoirs at once.
///
/// What is selected is counted by place in the stream and by magnitude; the sum is held to a
/// compensated one in `f64`.
pub fn stress(count: u64) -> Outcome {
    const JUMPS: usize = 192;
    const STREAMS: usize = 8;
    const PLACES: u64 = 4;
    // Eight-fold classes of weight at the top; the lowest holds the rest.
    let class = |w: f64| usize::from(w > 2e10) + usize::from(w > 1.25e11) + usize::from(w > 5e11);
    let bin = |i: u64, w: f64| (i * PLACES / count) as usize * 4 + class(w);
    let mut weights = CounterRng::new(9, 0, 0);
    let mut rng = CounterRng::new(9, 1, 0);
    let mut sums = [CompensatedSum::<f64>::new(); 16];
    let (mut total, mut plain) = (CompensatedSum::<f64>::new(), 0.0f32);
    let mut jumps = vec![JumpSelection::<(u64, f64)>::new(); JUMPS];
    let mut streams = vec![Selection::<(u64, f64)>::new(); STREAMS];
    let mut chunk = Vec::with_capacity(4096);
    let mut first = 0;
    // exp by decades: the weights are log-uniform, in the second half of the stream below 1e11.5
    // only.
    while first < count {
        chunk.clear();
        for i in first..(first + 4096).min(count) {
            let decades = 24.0 * f64::from(weights.next_u32()) / 4_294_967_296.0 - 12.0;
            let decades = if 2 * i < count { decades } else { decades.min(11.5) };
            let w = (decades * core::f64::consts::LN_10).exp();
            sums[bin(i, w)].add(w);
            total.add(w);
            plain += w as f32;
            chunk.push((i, w));
        }
        for jump in &mut jumps {
            for &(i, w) in &chunk {
                jump.offer((i, w), w, &mut rng);
            }
        }
        for stream in &mut streams {
            for &(i, w) in &chunk {
                stream.offer((i, w), w, &mut rng);
            }
        }
        first += 4096;
    }
    let truth = total.value();
    let off = |sum: f64| (sum / truth - 1.0).abs();
    let (stream_error, jump_error) = (off(streams[0].weight_sum()), off(jumps[0].weight_sum()));
    let plain_error = off(f64::from(plain));
    let items = jumps
        .iter()
        .filter_map(JumpSelection::item)
        .chain(streams.iter().filter_map(Selection::item));
    let mut observed = [0u32; 16];
    items.for_each(|&(i, w)| observed[bin(i, w)] += 1);
    let selections = f64::from(observed.iter().sum::<u32>());
    // Bins that expect fewer than five are pooled into one.
    let (mut statistic, mut degrees, mut pooled) = (0.0, -1.0, (0.0, 0.0));
    for (sum, &seen) in sums.iter().zip(&observed) {
        let expected = selections * sum.value() / truth;
        if expected < 5.0 {
            pooled = (pooled.0 + expected, pooled.1 + f64::from(seen));
        } else {
            statistic += (f64::from(seen) - expected).powi(2) / expected;
            degrees += 1.0;
        }
    }
    if pooled.0 > 0.0 {
        statistic += (pooled.1 - pooled.0).powi(2) / pooled.0.max(1.0);
        degrees += 1.0;
    }
    // Wilson & Hilferty: the cube root of χ²/k is close to normal.
    let spread = 2.0 / (9.0 * degrees);
    let z = ((statistic / degrees).cbrt() - (1.0 - spread)) / spread.sqrt();
    Outcome {
        name: "stress",
        figure: "none; weights over 24 decades",
        values: json!({ "items": count, "selections": selections, "chi_squared": statistic,
            "degrees_of_freedom": degrees, "z": z, "relative_error_of_sum": { "streamed": stream_error,
            "jumped": jump_error, "plain_f32": plain_error } }),
        plot: None,
        claims: vec![
            (
                format!("{count} items: frequencies by χ², z = {z:.2} < 4.75 (false-positive rate 1e-6)"),
                z < 4.75,
            ),
            (
                format!(
                    "{count} items: Σw within 1e-5: {stream_error:.1e}, by jumps {jump_error:.1e}, plain f32 {plain_error:.1e}"
                ),
                stream_error < 1e-5 && jump_error < 1e-5,
            ),
        ],
    }
}

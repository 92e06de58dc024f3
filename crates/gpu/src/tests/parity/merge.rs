//! Merges of reservoirs.

use crate::tests::parity::harness::{Shader, Tier, bits, compare, floats, gpu, held, unit_numbers};
use lightshed_resampling::{
    Choose, ContributionWeight, Domain, DomainReservoir, Input, Jacobian, Mis, Reservoir, ShiftMapping,
    Shifted, Undefined, merge_and_integrate,
};
use lightshed_sampling::PrimarySample;

/// Inputs of a merge, the canonical one first.
const INPUTS: usize = 4;
/// Numbers of an input.
const EACH: usize = 8;
const CAP: f32 = 20.0;

/// The part `[offset, offset + scale)` of a line, seen from within: `x` is where on it one is. Its
/// target is a tent, cut off where it would be negative.
struct Part {
    scale: f32,
    offset: f32,
    height: f32,
    slope: f32,
}

impl Domain for Part {
    type Sample = f32;
    type Space = PrimarySample;

    fn target(&self, &x: &f32) -> f64 {
        f64::from((self.height - self.slope * (x - 0.5).abs()).max(0.0))
    }
}

/// A point of the line stays where it is.
struct Along;

impl ShiftMapping<Part> for Along {
    fn shift(&self, &x: &f32, from: &Part, to: &Part) -> Result<Shifted<f32>, Undefined> {
        let sample = (x * from.scale + from.offset - to.offset) / to.scale;
        if !(0.0..1.0).contains(&sample) {
            return Err(Undefined::OutsideDomain);
        }
        Ok(Shifted {
            sample,
            jacobian: Jacobian::new(from.scale / to.scale)?,
            target: to.target(&sample),
        })
    }
}

/// Decides by numbers at hand.
struct Decisions<'a> {
    numbers: &'a [f32],
    next: usize,
    /// Whether one was so close that rounding decides.
    close: bool,
}

impl Choose for Decisions<'_> {
    fn accept(&mut self, part: f64, total: f64) -> bool {
        let u = f64::from(self.numbers[self.next]);
        self.next += 1;
        self.close |= (u * total - part).abs() <= 1e-5 * total && part < total;
        u * total < part || part >= total
    }
}

/// Where the kept sample lies, its weight, the confidence, and the integral of the place on the
/// line; `None` where rounding decides.
fn merged(numbers: &[f32; INPUTS * EACH], count: usize, mis: Mis, canonical_last: bool) -> Option<[f32; 4]> {
    let mut inputs: Vec<(Part, DomainReservoir<Part>)> = numbers
        .chunks_exact(EACH)
        .take(count)
        .map(|n| {
            let weight = ContributionWeight::new(n[4]).expect("weights are sound");
            let reservoir = if n[4] > 0.0 {
                Reservoir::new(n[6], weight, n[5]).expect("confidences are sound")
            } else {
                Reservoir::empty(n[5])
            };
            let part = Part {
                scale: n[0],
                offset: n[1],
                height: n[2],
                slope: n[3],
            };
            (part, reservoir)
        })
        .collect();
    let us: [f32; INPUTS] = core::array::from_fn(|i| numbers[i * EACH + 7]);
    let mut choose = Decisions {
        numbers: &us,
        next: 0,
        close: false,
    };
    let canonical = if canonical_last {
        inputs.rotate_left(1);
        count - 1
    } else {
        0
    };
    let to = &inputs[canonical].0;
    let all: Vec<Input<Part>> = inputs
        .iter()
        .enumerate()
        .map(|(i, (part, reservoir))| match i == canonical {
            true => Input::canonical(part, reservoir),
            false => Input::neighbour(part, reservoir),
        })
        .collect();
    let mut sum = 0.0;
    let merged = merge_and_integrate(to, &Along, &all, mis, &mut choose, |contribution| {
        sum += f64::from(*contribution.sample) * contribution.weight;
    })
    .expect("the canonical input has confidence");
    let reservoir = merged.reservoir.with_confidence_cap(CAP);
    (!choose.close).then(|| {
        [
            reservoir.sample().copied().unwrap_or(-1.0),
            reservoir.weight().value(),
            reservoir.confidence(),
            sum as f32,
        ]
    })
}

const HOST: &str = "
    import package::lightshed::merge::{MergeImage, MergeInput};
    import package::main::number;
    var<private> carried: f32;
    var<private> kept: f32;
    var<private> sum: f32;
    var<private> drawn: u32;
    fn about(i: u32, k: u32) -> f32 { return number(8u * i + k); }
    fn tent(i: u32, x: f32) -> f32 { return max(about(i, 2u) - about(i, 3u) * abs(x - 0.5), 0.0); }
    fn merge_input(i: u32) -> MergeInput {
        return MergeInput(about(i, 5u), about(i, 4u), tent(i, about(i, 6u)));
    }
    fn merge_shift(i: u32, j: u32) -> MergeImage {
        // From the domain of X_i, or from where Y_i is.
        let start = select(0u, i, j == 0u);
        let x = select(arrived(i), about(i, 6u), j == 0u);
        let y = (x * about(start, 0u) + about(start, 1u) - about(j, 1u)) / about(j, 0u);
        if !(y >= 0.0 && y < 1.0) { return MergeImage(0.0, 0.0); }
        if j == 0u { carried = y; }
        return MergeImage(tent(j, y), about(start, 0u) / about(j, 0u));
    }
    fn merge_number(i: u32) -> f32 {
        drawn += 1u;
        return about(drawn - 1u, 7u);
    }
    fn arrived(i: u32) -> f32 { return select(carried, about(0u, 6u), i == 0u); }
    fn merge_keep(i: u32) { kept = arrived(i); }
    fn merge_visit(i: u32, weight: f32) { sum += arrived(i) * weight; }
";

/// Merges of two and of four inputs by either family of weights, samples, weights, confidences and
/// integrals: `f32` against the library's `f64`, but for decisions that rounding takes. Faults in
/// the merge are noticed.
#[test]
fn merges_are_those_of_the_library() {
    let Some(gpu) = gpu() else { return };
    let inputs: Vec<[u32; INPUTS * EACH]> = unit_numbers::<{ INPUTS * EACH }>(33)
        .iter()
        .map(|words| {
            let u = floats(words);
            let mut numbers: [f32; INPUTS * EACH] = core::array::from_fn(|k| {
                let u = u[k];
                match k % EACH {
                    0 => [0.5, 1.0, 2.0, 1.5][(u * 4.0) as usize],
                    1 => u - 0.3,
                    2 => u + 0.01,
                    3 => 4.0 * u,
                    // Some hold nothing, and some weigh much.
                    4 if u < 0.15 => 0.0,
                    4 => (u * 40.0 - 20.0).exp2(),
                    // All but the canonical one may have no confidence.
                    5 => (u * 12.0).floor().max(if k < EACH { 1.0 } else { 0.0 }),
                    _ => u,
                }
            });
            for input in numbers.chunks_exact_mut(EACH) {
                // What is held has a target.
                if !(input[2] - input[3] * (input[6] - 0.5).abs() > 0.0) {
                    input[4] = 0.0;
                }
            }
            bits(numbers)
        })
        .collect();
    let tier = Tier::Bounded {
        absolute: 0.0,
        relative: 1e-5,
    };
    let faults = [
        [
            "* image.p_hat * weight * image.jacobian",
            "* image.p_hat * weight",
        ],
        ["m * weight * image.jacobian", "m * weight"],
        ["min(confidence, cap)", "confidence"],
        ["own = input.p_hat / image.jacobian", "own = input.p_hat"],
        ["there.p_hat * there.jacobian", "there.p_hat"],
    ];
    let pairwise_faults = [
        ["input.p_hat / image.jacobian)", "input.p_hat)"],
        ["image.p_hat * image.jacobian)", "image.p_hat)"],
        ["neighbours += ", "neighbours = "],
    ];
    for (function, mis, canonical_last, count) in [
        ("merge_balance", Mis::Balance, false, 2),
        ("merge_balance", Mis::Balance, false, 4),
        ("merge_pairwise", Mis::PAIRWISE_DEFENSIVE, true, 2),
        ("merge_pairwise", Mis::PAIRWISE_DEFENSIVE, true, 4),
    ] {
        let truth = |words: &[u32; INPUTS * EACH]| merged(&floats(words), count, mis, canonical_last);
        let decided: Vec<_> = inputs
            .iter()
            .filter_map(|words| Some((*words, truth(words)?)))
            .collect();
        assert!(
            decided.len() > inputs.len() / 100 * 99,
            "rounding decides too often"
        );
        let (decided, truths): (Vec<_>, Vec<_>) = decided.into_iter().unzip();
        let body = format!(
            "let merged = {function}({count}u, {CAP:.1});
             put_f(0u, select(kept, -1.0, merged.weight == 0.0));
             put_f(1u, merged.weight); put_f(2u, merged.confidence); put_f(3u, sum);"
        );
        let imports =
            format!("import package::host::{{kept, sum}}; import package::lightshed::merge::{function};");
        let run = |planted: Option<[&str; 2]>| {
            let shader = Shader {
                host: HOST,
                planted,
                ..Shader::new(&imports, &body)
            };
            let found = shader.run::<{ INPUTS * EACH }, 4>(gpu, &decided);
            let mut truths = truths.iter();
            let next = std::cell::RefCell::new(&mut truths);
            compare(function, tier, &decided, &found, |_| {
                bits(*next.borrow_mut().next().expect("one for each"))
            })
        };
        if !held(gpu, || run(None)) {
            continue;
        }
        let of_family: &[[&str; 2]] = if canonical_last {
            &pairwise_faults
        } else {
            &faults[3..]
        };
        for fault in faults[..3].iter().chain(of_family) {
            // Four inputs show each fault that two do.
            if count == INPUTS {
                assert!(run(Some(*fault)).is_err(), "{fault:?} is not noticed");
            }
        }
    }
}

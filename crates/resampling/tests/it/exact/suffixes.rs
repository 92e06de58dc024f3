//! Suffix reuse through whole frames (Kettunen 2023 §§6–7): supporting prefixes resampled in
//! time, suffixes in time and space, a final gather over two prefixes with roulette.
//!
//! Two pixels, of which the second has no history. Every outcome of every decision is enumerated.

use super::finite::Enumerate;
use super::reuse::shared;
use lightshed_resampling::{
    Conditional, ConditionalShift, Counting, Domain, DomainReservoir, FinalGather, History, Input, Jacobian,
    MergeRule, Mis, NeighbourLists, Reservoir, Reuse, Ris, ShiftMapping, Shifted, Tractable, Undefined,
};
use lightshed_testkit::{Chooser, check_faults, expectation};

const PREFIX_PMF: [f64; 2] = [0.7, 0.3];
const PREFIX_MEASURE: [f64; 2] = [1.0, 2.0];
/// Throughput `f_p` of a prefix in either pixel.
const PREFIX_THROUGHPUT: [[f64; 2]; 2] = [[0.4, 1.0], [1.5, 0.6]];

const SUFFIX_PMF: [f64; 3] = [0.2, 0.5, 0.3];
/// Measures of suffix points behind each prefix.
const SUFFIX_MEASURE: [[f64; 3]; 2] = [[1.0, 0.5, 2.0], [0.25, 1.0, 1.5]];
/// `f_ps f_s`: one suffix is hidden from each prefix.
const CONTRIBUTION: [[f64; 3]; 2] = [[1.0, 0.0, 2.0], [0.3, 4.0, 0.0]];

/// Mistakes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// The supporting prefix is resampled by a target that has seen its suffix (against eq. 19).
    SupportSeesSuffix,
    /// Supporting prefixes without a suffix are left out of MIS weights.
    EmptySupportLeftOut,
    /// The canonical technique counts only where there is a canonical suffix.
    CanonicalForgotten,
    /// The canonical term is divided by `N` (Algorithm 1, line 12, read wrongly).
    CanonicalDivided,
    /// The integration prefix's throughput is left out.
    NoThroughput,
    /// It is there twice: as a part of the suffix's target, too.
    ThroughputTwice,
    /// `1/J` for `J`.
    InverseJacobian,
    /// Prefixes that were chosen by importance count as if all were chosen alike.
    SurvivalForgotten,
}

/// The prefixes of a pixel.
#[derive(Clone, Copy)]
struct Pixel(usize);

impl Domain for Pixel {
    type Sample = usize;
    type Space = Counting;
    fn target(&self, &z: &usize) -> f64 {
        PREFIX_THROUGHPUT[self.0][z]
    }
}

/// Prefixes have one measure in all pixels.
struct SamePrefix;

impl ShiftMapping<Pixel> for SamePrefix {
    fn shift(&self, &z: &usize, _: &Pixel, to: &Pixel) -> Result<Shifted<usize>, Undefined> {
        Ok(Shifted {
            sample: z,
            jacobian: Jacobian::IDENTITY,
            target: to.target(&z),
        })
    }
}

/// The suffixes behind a prefix.
#[derive(Clone, Copy, Debug)]
struct Behind(usize);

impl Domain for Behind {
    type Sample = usize;
    type Space = Counting;
    fn target(&self, &x: &usize) -> f64 {
        CONTRIBUTION[self.0][x]
    }
}

struct Reconnect(Option<Fault>);

impl ShiftMapping<Behind> for Reconnect {
    fn shift(&self, &x: &usize, from: &Behind, to: &Behind) -> Result<Shifted<usize>, Undefined> {
        let ratio = SUFFIX_MEASURE[to.0][x] / SUFFIX_MEASURE[from.0][x];
        let inverse = self.0 == Some(Fault::InverseJacobian);
        Ok(Shifted {
            sample: x,
            jacobian: Jacobian::new(if inverse { 1.0 / ratio } else { ratio })?,
            target: to.target(&x),
        })
    }
}

type Suffixes = Conditional<Behind, Counting>;
type Suffix = DomainReservoir<Suffixes, f64>;
type Prefix = DomainReservoir<Pixel, f64>;

fn draw_prefix(pixel: Pixel, chooser: &mut Chooser) -> Prefix {
    let z = chooser.choose(&PREFIX_PMF);
    let mut ris = Ris::<usize, Counting>::new();
    let weight = Tractable::<_, f64>::from_density(PREFIX_PMF[z] / PREFIX_MEASURE[z]).unwrap();
    ris.candidate(z, pixel.target(&z), weight.weight(), &mut Enumerate(chooser));
    ris.finish(1.0)
}

fn draw_suffix(domain: &Suffixes, chooser: &mut Chooser) -> Suffix {
    let x = chooser.choose(&SUFFIX_PMF);
    let mut ris = Ris::<usize, Counting>::new();
    let density = SUFFIX_PMF[x] / SUFFIX_MEASURE[domain.domain().0][x];
    let weight = Tractable::<_, f64>::from_density(density).unwrap().weight();
    ris.candidate(x, domain.target(&x), weight, &mut Enumerate(chooser));
    ris.finish::<f64>(1.0).given()
}

/// A frame's supporting prefixes and suffixes, by pixel.
struct Frame {
    prefixes: Vec<Prefix>,
    domains: Vec<Option<Suffixes>>,
    suffixes: Vec<Suffix>,
}

impl Frame {
    fn domains(prefixes: &[Prefix]) -> Vec<Option<Suffixes>> {
        let behind = |prefix: &Prefix| prefix.sample().map(|&z| Conditional::new(Behind(z)));
        prefixes.iter().map(behind).collect()
    }

    /// Of the first pixel alone.
    fn first(chooser: &mut Chooser) -> Self {
        let prefixes = vec![draw_prefix(Pixel(0), chooser), Reservoir::empty(0.0)];
        let domains = Self::domains(&prefixes);
        let own = draw_suffix(domains[0].as_ref().unwrap(), chooser);
        let suffixes = vec![own, Suffix::empty(0.0)];
        Self {
            prefixes,
            domains,
            suffixes,
        }
    }

    /// The frame behind `before`.
    fn next(before: &Self, mis: Mis, fault: Option<Fault>, chooser: &mut Chooser) -> Self {
        let pixels = [Pixel(0), Pixel(1)];
        let correspondence = |pixel: usize| (pixel == 0).then_some(0);
        let fresh: Vec<Prefix> = pixels.map(|pixel| draw_prefix(pixel, chooser)).into();
        let mut prefixes = fresh.clone();
        if fault == Some(Fault::SupportSeesSuffix) {
            let (z, held) = (before.prefixes[0].sample().unwrap(), &before.suffixes[0]);
            let seen = held.estimate(|&x| CONTRIBUTION[*z][x]) + 0.1;
            let mut ris = Ris::<usize, Counting>::new();
            for (reservoir, seen) in [(&fresh[0], 1.0), (&before.prefixes[0], seen)] {
                let (&z, weight) = reservoir.weighted_sample().unwrap();
                ris.candidate(z, pixels[0].target(&z) * seen, weight, &mut Enumerate(chooser));
            }
            prefixes[0] = ris.finish(2.0);
        } else {
            shared(chooser, |choose| {
                let reuse = Reuse::new(pixels, MergeRule::new(SamePrefix).with_mis(Mis::Balance));
                let history = History::new(&pixels, &before.prefixes);
                reuse
                    .temporal(&fresh, history, correspondence, &mut prefixes, |_| choose.clone())
                    .unwrap();
            });
        }
        let domains = Self::domains(&prefixes);
        let fresh: Vec<Suffix> = domains
            .iter()
            .map(|domain| draw_suffix(domain.as_ref().unwrap(), chooser))
            .collect();
        let (mut in_time, mut suffixes) = (fresh.clone(), fresh.clone());
        shared(chooser, |choose| {
            let rule = MergeRule::new(ConditionalShift(Reconnect(fault))).with_mis(mis);
            let reuse = Reuse::new(&domains, rule);
            let history = History::new(&before.domains, &before.suffixes);
            let chooser = |_| choose.clone();
            reuse
                .temporal(&fresh, history, correspondence, &mut in_time, chooser)
                .unwrap();
            let both = NeighbourLists::new([vec![1], vec![0]]).unwrap();
            reuse.spatial(both, &in_time, &mut suffixes, chooser).unwrap();
        });
        Self {
            prefixes,
            domains,
            suffixes,
        }
    }
}

/// The gather of pixel 1 over `count` prefixes, `canonical` of them with suffixes of their own,
/// from all supporting prefixes of a frame. `by_importance`, one prefix alone has a suffix, chosen
/// by its throughput.
fn gather(
    frame: &Frame,
    ([count, canonical], by_importance): ([u32; 2], bool),
    mis: Mis,
    fault: Option<Fault>,
    chooser: &mut Chooser,
) -> f64 {
    let gather = FinalGather::new(count, canonical).unwrap();
    let places: Vec<usize> = (0..count).map(|_| chooser.choose(&PREFIX_PMF)).collect();
    let sum = places.iter().map(|&z| PREFIX_THROUGHPUT[1][z]).sum();
    let survival = |&z: &usize| gather.survival(PREFIX_THROUGHPUT[1][z], sum);
    let survivals: Vec<f64> = places.iter().map(survival).collect();
    let chosen = by_importance.then(|| chooser.choose(&survivals));
    let shift = ConditionalShift(Reconnect(fault));
    let mut total = 0.0;
    for (number, &z) in places.iter().enumerate() {
        let has_own = chosen.map_or(number < canonical as usize, |chosen| number == chosen);
        let gather = match fault {
            Some(Fault::SurvivalForgotten) => gather,
            _ if by_importance => gather.surviving(survivals[number]),
            _ => gather,
        };
        let prefix = Tractable::<Counting, f64>::from_density(PREFIX_PMF[z] / PREFIX_MEASURE[z]).unwrap();
        let to = Conditional::new(Behind(z));
        let own = match fault {
            _ if has_own => draw_suffix(&to, chooser),
            Some(Fault::CanonicalForgotten) => Suffix::empty(1e-9),
            _ => Suffix::empty(1.0),
        };
        let mut inputs = vec![Input::canonical(&to, &own)];
        let supports = frame.domains.iter().zip(&frame.suffixes);
        inputs.extend(supports.filter_map(|(domain, suffix)| {
            let left_out = fault == Some(Fault::EmptySupportLeftOut) && suffix.is_empty();
            let domain = domain.as_ref().filter(|_| !left_out)?;
            Some(Input::neighbour(domain, suffix))
        }));
        let throughput = match fault {
            Some(Fault::NoThroughput) => 1.0,
            Some(Fault::ThroughputTwice) => PREFIX_THROUGHPUT[1][z].powi(2),
            _ => PREFIX_THROUGHPUT[1][z],
        };
        gather
            .integrate(prefix.into(), &to, &shift, &inputs, mis, |part| {
                let divided = part.is_canonical && fault == Some(Fault::CanonicalDivided);
                let share = if divided { 1.0 / f64::from(count) } else { 1.0 };
                total += share * throughput * CONTRIBUTION[z][*part.sample] * part.weight.value();
            })
            .unwrap();
    }
    total
}

fn truth() -> f64 {
    let behind = |z: usize| -> f64 { (0..3).map(|x| CONTRIBUTION[z][x] * SUFFIX_MEASURE[z][x]).sum() };
    (0..2)
        .map(|z| PREFIX_THROUGHPUT[1][z] * PREFIX_MEASURE[z] * behind(z))
        .sum()
}

fn run(counts: ([u32; 2], bool), mis: Mis, fault: Option<Fault>) -> Result<(), String> {
    let result = expectation(|chooser| {
        let first = Frame::first(chooser);
        let second = Frame::next(&first, mis, fault, chooser);
        gather(&second, counts, mis, fault, chooser)
    });
    assert!((result.probability - 1.0).abs() < 1e-12);
    let error = (result.value / truth() - 1.0).abs();
    if error < 1e-12 {
        Ok(())
    } else {
        Err(format!("off by {error:.2e}"))
    }
}

const FAMILIES: [Mis; 2] = [Mis::Balance, Mis::PAIRWISE_DEFENSIVE];

#[test]
fn a_gather_over_reused_suffixes_is_exact() {
    let faults = [
        Fault::SupportSeesSuffix,
        Fault::EmptySupportLeftOut,
        Fault::CanonicalForgotten,
        Fault::CanonicalDivided,
        Fault::NoThroughput,
        Fault::ThroughputTwice,
        Fault::InverseJacobian,
    ];
    for mis in FAMILIES {
        for caught in check_faults(&faults, |fault| run(([2, 1], false), mis, fault)).unwrap() {
            println!("{mis:?}, {:?}: {}", caught.fault, caught.message);
        }
    }
}

/// One prefix is no roulette, nor are two with two suffixes; three leave more to it.
#[test]
fn any_number_of_prefixes_will_do() {
    for counts in [[1, 1], [2, 2], [3, 1]] {
        for mis in FAMILIES {
            run((counts, false), mis, None).unwrap();
        }
    }
}

#[test]
fn suffixes_may_go_to_important_prefixes() {
    for mis in FAMILIES {
        check_faults(&[Fault::SurvivalForgotten, Fault::CanonicalForgotten], |fault| {
            run(([2, 1], true), mis, fault)
        })
        .unwrap();
    }
    run(([3, 1], true), Mis::Balance, None).unwrap();
    let gather = FinalGather::new(8, 2).unwrap();
    assert_eq!(gather.survival(3.0, 24.0), 0.25);
    assert_eq!(gather.survival(23.0, 24.0), 1.0);
    for (importance, sum) in [(0.0, 24.0), (0.0, 0.0), (f64::NAN, 1.0)] {
        assert_eq!(gather.survival(importance, sum), 0.0);
    }
    assert_eq!(gather.surviving(0.0).own_share(), 0.0);
    assert_eq!(gather.surviving(0.25).own_share(), gather.own_share());
}

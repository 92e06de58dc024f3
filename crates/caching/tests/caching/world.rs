//! Reservoirs in cells, on finite domains: every outcome of every decision of two frames is
//! enumerated, and planted faults are found.

use lightshed_caching::glam::Vec3;
use lightshed_caching::{WorldDomain, WorldReads, WorldReservoirOptions, WorldReservoirs};
use lightshed_resampling::{
    Choose, Counting, Domain, DomainReservoir, Domains, History, Jacobian, MergeRule, Mis, Reuse, Ris,
    ShiftMapping, Shifted, Topology, Tractable, Undefined,
};
use lightshed_sampling::CounterRng;
use lightshed_spatial::{LevelGridOptions, SurfaceSite};
use lightshed_testkit::{Chooser, check_faults, expectation_vector};
use std::sync::{Arc, Mutex};

/// A pixel at a place, whose samples are labels, each of a measure: `∫ f = Σ f(x) μ(x)`.
#[derive(Clone, Debug, PartialEq)]
struct Pixel {
    place: f32,
    labels: &'static [u32],
    measure: &'static [f64],
    target: &'static [f64],
    /// Of the labels as candidates.
    pmf: &'static [f64],
}

type Held = DomainReservoir<Pixel, f64>;

impl Pixel {
    /// Number of a label.
    fn find(&self, label: u32) -> Option<usize> {
        self.labels.iter().position(|&own| own == label)
    }
}

impl Domain for Pixel {
    type Sample = u32;
    type Space = Counting;
    fn target(&self, &label: &u32) -> f64 {
        self.find(label).map_or(0.0, |x| self.target[x])
    }
}

impl WorldDomain for Pixel {
    fn site(&self) -> Option<SurfaceSite> {
        Some(SurfaceSite::new(Vec3::new(self.place, 0.5, 0.5), Vec3::Y))
    }
    fn is_same(&self, a: &u32, b: &u32) -> bool {
        a == b
    }
}

/// To the same label, where both have it.
struct ByLabel;

impl ShiftMapping<Pixel> for ByLabel {
    fn shift(&self, &label: &u32, from: &Pixel, to: &Pixel) -> Result<Shifted<u32>, Undefined> {
        let [from, to_x] = [from, to].map(|pixel| Some((pixel, pixel.find(label)?)));
        let ((from, x), (to, y)) = from.zip(to_x).ok_or(Undefined::OutsideDomain)?;
        Ok(Shifted {
            sample: label,
            jacobian: Jacobian::new(to.measure[y] / from.measure[x])?,
            target: to.target[y],
        })
    }
}

/// Two pixels of a cell. What one sees the other sees in part.
const FIRST: [Pixel; 2] = [
    Pixel {
        place: 0.2,
        labels: &[0, 1, 2],
        measure: &[1.0, 0.5, 2.0],
        target: &[0.7, 2.0, 0.0],
        pmf: &[0.3, 0.5, 0.2],
    },
    Pixel {
        place: 0.8,
        labels: &[1, 0, 3],
        measure: &[1.0, 0.25, 1.5],
        target: &[0.4, 3.0, 0.0],
        pmf: &[0.3, 0.25, 0.45],
    },
];

/// The pixels of a second frame: three in the cell, of which one sees what none saw before, and one
/// reads only.
const SECOND: [Pixel; 4] = [
    Pixel {
        place: 0.4,
        labels: &[0, 3],
        measure: &[0.5, 1.0],
        target: &[1.0, 1.5],
        pmf: &[0.5, 0.5],
    },
    Pixel {
        place: 0.6,
        labels: &[1, 4],
        measure: &[1.0, 2.0],
        target: &[0.2, 2.5],
        pmf: &[0.35, 0.65],
    },
    Pixel {
        place: 0.9,
        labels: &[1, 0],
        measure: &[0.5, 1.0],
        target: &[0.3, 2.0],
        pmf: &[0.5, 0.5],
    },
    // In a cell of its own.
    Pixel {
        place: 1.5,
        labels: &[1, 0],
        measure: &[1.0, 1.0],
        target: &[1.0, 0.5],
        pmf: &[0.5, 0.5],
    },
];

/// The enumerator, shared by all merges of a pass.
#[derive(Clone)]
struct Shared(Arc<Mutex<Chooser>>);

impl Choose for Shared {
    fn accept(&mut self, part: f64, total: f64) -> bool {
        part == total || self.0.lock().unwrap().bernoulli(part / total)
    }
}

impl Shared {
    /// A candidate of a pixel.
    fn draw(&mut self, pixel: &Pixel) -> Held {
        let x = self.0.lock().unwrap().choose(pixel.pmf);
        let weight = Tractable::<Counting, f64>::from_density(pixel.pmf[x] / pixel.measure[x]).unwrap();
        let mut ris = Ris::<u32, Counting>::new();
        ris.candidate(pixel.labels[x], pixel.target[x], weight.weight(), self);
        ris.finish(1.0)
    }
}

/// `1{Y = y} W` of every `y`.
fn indicators(pixel: &Pixel, held: &Held) -> Vec<f64> {
    let mut values = vec![0.0; pixel.measure.len()];
    if let Some((&label, weight)) = held.weighted_sample() {
        values[pixel.find(label).expect("a label of the pixel")] = weight.value();
    }
    values
}

/// What they must be in the mean: `μ(y)` where the target is positive.
fn truth(pixel: &Pixel) -> Vec<f64> {
    let measures = pixel.target.iter().zip(pixel.measure);
    measures.map(|(&p, &mu)| if p > 0.0 { mu } else { 0.0 }).collect()
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// A reader's MIS weights ask the reader's domain what the cell could have produced.
    CellsAreTheReader,
    /// A cell is trusted by how many of its samples differ.
    ConfidenceByContent,
    /// Only reservoirs that hold something are read.
    EmptyOnesAreNotRead,
    /// Of two pixels that bring the same, one counts as if it had found nothing.
    DuplicatesLeftOut,
}

/// Cells as a reader takes them for.
struct Seen<'a> {
    world: &'a WorldReservoirs<Pixel, f64>,
    instead: Option<&'a Pixel>,
}

impl Domains for Seen<'_> {
    type Domain = Pixel;
    fn count(&self) -> usize {
        self.world.count()
    }
    fn domain(&self, index: usize) -> Option<&Pixel> {
        let site = self.world.domain(index)?;
        Some(self.instead.unwrap_or(site))
    }
}

fn options() -> WorldReservoirOptions {
    WorldReservoirOptions {
        slots: 32,
        reservoirs: 2,
        contributors: 2,
        ..WorldReservoirOptions::new(LevelGridOptions::new(1.0))
    }
}

/// A frame: the pixels' fresh reservoirs go to the cells.
fn brought(
    world: &mut WorldReservoirs<Pixel, f64>,
    pixels: &[Pixel],
    mis: Mis,
    fault: Option<Fault>,
    choose: &Shared,
) -> Vec<Held> {
    let mut fresh: Vec<Held> = pixels.iter().map(|pixel| choose.clone().draw(pixel)).collect();
    let visits = world.visit(pixels, |index| index as u32);
    if fault == Some(Fault::DuplicatesLeftOut) && fresh[0].sample() == fresh[1].sample() {
        fresh[1] = Held::empty(1.0);
    }
    let rule = MergeRule::new(ByLabel).with_mis(mis).with_confidence_cap(3.0);
    world
        .update(&visits, pixels, &fresh, &rule, |_| choose.clone())
        .unwrap();
    fresh
}

/// Expectations of what the cells and the pixels hold after two frames.
fn two_frames(mis: Mis, renewal: u32, fault: Option<Fault>) -> Result<(), String> {
    let options = WorldReservoirOptions { renewal, ..options() };
    // Sites do not depend on what is drawn.
    let sites: Mutex<Option<Vec<Pixel>>> = Mutex::default();
    let result = expectation_vector(|chooser| {
        let shared = Shared(Arc::new(Mutex::new(std::mem::take(chooser))));
        let mut world = WorldReservoirs::new(options).unwrap();
        brought(&mut world, &FIRST, mis, fault, &shared);
        let fresh = brought(&mut world, &SECOND, mis, None, &shared);
        let cells =
            (0..world.count()).filter_map(|index| Some((world.domain(index)?, &world.reservoirs()[index])));
        let mut values: Vec<f64> = cells
            .clone()
            .flat_map(|(site, held)| indicators(site, held))
            .collect();
        let first = sites
            .lock()
            .unwrap()
            .get_or_insert_with(|| cells.map(|(site, _)| site.clone()).collect())
            .clone();
        let agree = (0..world.count())
            .filter_map(|index| world.domain(index))
            .eq(first.iter());
        assert!(agree);

        let seen = Seen {
            world: &world,
            instead: (fault == Some(Fault::CellsAreTheReader)).then_some(&SECOND[0]),
        };
        let by_content = fault == Some(Fault::ConfidenceByContent);
        let held: Vec<Held> = (0..world.count())
            .map(|index| {
                let [held, other] = [index, index ^ 1].map(|index| &world.reservoirs()[index]);
                let is_less = by_content && held.sample() == other.sample();
                held.with_confidence_cap(if is_less { 0.2 } else { f32::INFINITY })
            })
            .collect();
        let reads = WorldReads::new(1).unwrap().within_cells();
        let links = world.links(&SECOND[..], reads, |index| CounterRng::new(8, index as u32, 1));
        let links =
            links.filtered(|_, other| fault != Some(Fault::EmptyOnesAreNotRead) || !held[other].is_empty());
        let reuse = Reuse::new(&SECOND[..], MergeRule::new(ByLabel).with_mis(mis));
        let mut output = fresh.clone();
        reuse
            .linked(&fresh, History::new(&seen, &held), links, &mut output, |_| {
                shared.clone()
            })
            .unwrap();
        values.extend(
            SECOND
                .iter()
                .zip(&output)
                .flat_map(|(pixel, held)| indicators(pixel, held)),
        );
        *chooser = std::mem::take(&mut shared.0.lock().unwrap());
        values
    });
    let sites = sites.into_inner().unwrap().unwrap_or_default();
    assert_eq!(sites.len(), 4, "two cells of two reservoirs");
    let truth: Vec<f64> = sites.iter().chain(&SECOND).flat_map(truth).collect();
    let off = |(value, truth): (&f64, &f64)| (value - truth).abs() / 2.0;
    let error = result.values.iter().zip(&truth).map(off).fold(0.0, f64::max);
    match error < 1e-12 && result.values.len() == truth.len() {
        true => Ok(()),
        false => Err(format!("off by {error:.3}")),
    }
}

const FAULTS: [Fault; 4] = [
    Fault::CellsAreTheReader,
    Fault::ConfidenceByContent,
    Fault::EmptyOnesAreNotRead,
    Fault::DuplicatesLeftOut,
];

#[test]
fn each_reservoir_of_a_cell_and_of_a_reader_is_unbiased() {
    for mis in [Mis::PAIRWISE_DEFENSIVE, Mis::Balance] {
        check_faults(&FAULTS, |fault| two_frames(mis, 1 << 20, fault)).unwrap();
        // Sites that move in every frame.
        two_frames(mis, 1, None).unwrap();
    }
    // The control: weights that ask nobody what it could have produced.
    assert!(two_frames(Mis::ConstantBiased, 1 << 20, None).is_err());
}

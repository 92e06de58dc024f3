//! Reservoirs in cells of space: what a frame's pixels bring and read.

use super::indirect::{IndirectPixel, Sender};
use super::primary::Primary;
use lightshed_caching::{
    CachingError, WorldDomain, WorldLinks, WorldReads, WorldReport, WorldReservoirOptions, WorldReservoirs,
    WorldVisits,
};
use lightshed_resampling::{
    DistinctSamples, DomainReservoir, Domains, History, MergeRule, Reservoir, ReuseError, ShiftMapping,
};
use lightshed_sampling::{CounterRng, FrameNumbers, PassNumbers};
use lightshed_scene::Scene;
use lightshed_scene::glam::Vec2;
use lightshed_shift::PathSample;
use lightshed_spatial::{LevelGridOptions, SurfaceSite};

/// Reuse from reservoirs in cells of space, which stay where they are when the camera moves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct WorldReuse {
    /// Side of a cell in pixels: as they see it in the middle of the image, rounded down to a power
    /// of two times the finest.
    pub cell_pixels: f32,
    /// Most cells.
    pub slots: usize,
    /// Reservoirs of a cell.
    pub reservoirs: u32,
    /// Reservoirs that a pixel reads in a frame.
    pub reads: u32,
    /// Most pixels of a frame whose fresh reservoirs a cell takes.
    pub contributors: u32,
    /// Most confidence of what a cell held before, in fresh reservoirs; positive.
    pub confidence_cap: f32,
    /// Frames after which a cell goes that nobody sees.
    pub max_age: u32,
    /// A cell that is seen moves its site once in so many frames, in the mean.
    pub renewal: u32,
}

impl Default for WorldReuse {
    /// Cells of up to 16 pixels with 8 reservoirs, of which a pixel reads 2; 16 contributors, whose
    /// reservoirs count for 20 frames.
    fn default() -> Self {
        Self {
            cell_pixels: 16.0,
            slots: 1 << 16,
            reservoirs: 8,
            reads: 2,
            contributors: 16,
            confidence_cap: 320.0,
            max_age: 128,
            renewal: 32,
        }
    }
}

impl WorldReuse {
    /// The cells of a scene, whose finest are a ten-thousandth of it.
    pub fn cells(&self, scene: &Scene) -> LevelGridOptions {
        let (camera, settings) = (scene.camera(), scene.settings());
        let middle = Vec2::new(settings.width as f32, settings.height as f32) * 0.5;
        let [a, b] = [Vec2::ZERO, Vec2::X].map(|offset| camera.ray(middle + offset, [0.5; 2]).direction);
        LevelGridOptions {
            cell: (scene.extent() * 1e-4).max(f32::MIN_POSITIVE),
            growth: self.cell_pixels * a.distance(b),
            faces: true,
            facets: false,
        }
    }

    fn options(&self, scene: &Scene) -> WorldReservoirOptions {
        let cells = self.cells(scene);
        WorldReservoirOptions {
            slots: self.slots,
            reservoirs: self.reservoirs,
            contributors: self.contributors,
            max_age: self.max_age,
            renewal: self.renewal,
            ..WorldReservoirOptions::new(cells)
        }
    }

    /// Whether reservoirs can be kept so.
    ///
    /// # Errors
    /// A number out of range.
    pub fn check(&self) -> Result<(), CachingError> {
        let fits = self.cell_pixels > 0.0 && self.cell_pixels.is_finite();
        let refused = |name, value: f32| CachingError::Option {
            name,
            value: f64::from(value),
            range: "positive",
        };
        fits.then_some(())
            .ok_or(refused("cell_pixels", self.cell_pixels))?;
        let fits = self.confidence_cap > 0.0;
        fits.then_some(())
            .ok_or(refused("confidence_cap", self.confidence_cap))?;
        WorldReads::new(self.reads)?;
        let options = WorldReservoirOptions {
            slots: self.slots.min(1),
            reservoirs: self.reservoirs,
            contributors: self.contributors,
            max_age: self.max_age,
            renewal: self.renewal,
            ..WorldReservoirOptions::new(LevelGridOptions::new(1.0))
        };
        WorldReservoirs::<Primary>::new(options).map(|_| ())
    }
}

/// Random numbers of world space, by the numbers of a third reservoir, which no pixel has.
#[derive(Clone, Copy)]
enum WorldPass {
    Rank,
    Cells,
    Links,
    Merge,
}

/// What passes in world space are.
const PASSES: u32 = WorldPass::Merge as u32 + 1;

/// The cells of a method, and how they are used.
pub(super) struct WorldCells<D: WorldDomain> {
    reservoirs: WorldReservoirs<D>,
    reads: WorldReads,
    /// Greatest confidence of a cell.
    cap: f32,
    /// Number of these among all cells of the method, which have random numbers of their own.
    number: u32,
    report: WorldReport,
}

impl<D> WorldCells<D>
where
    D: WorldDomain + Send + Sync,
    D::Sample: Send + Sync,
{
    pub fn new(scene: &Scene, reuse: &WorldReuse) -> Result<Self, CachingError> {
        reuse.check()?;
        Ok(Self {
            reservoirs: WorldReservoirs::new(reuse.options(scene))?,
            reads: WorldReads::new(reuse.reads)?,
            cap: reuse.confidence_cap,
            number: 0,
            report: WorldReport::default(),
        })
    }

    /// With random numbers of their own beside the first cells of a method.
    pub fn further(self) -> Self {
        Self {
            number: self.number + 1,
            ..self
        }
    }

    fn numbers(&self, pass: WorldPass, frame: FrameNumbers) -> PassNumbers {
        frame.pass(pass as u32 + PASSES * self.number).reservoir(2)
    }

    /// A frame begins: which of `pixels` belongs where.
    pub fn visit(
        &mut self,
        frame: FrameNumbers,
        pixels: &(impl Domains<Domain = D> + ?Sized),
    ) -> WorldVisits {
        let numbers = self.numbers(WorldPass::Rank, frame);
        self.reservoirs
            .visit(pixels, |pixel| numbers.pixel(pixel).next_u32())
    }

    /// Cells merge what pixels bring, by `rule`; they are trusted as far as the cells' own cap
    /// says.
    pub fn update<T: ShiftMapping<D> + Sync>(
        &mut self,
        frame: FrameNumbers,
        visits: &WorldVisits,
        pixels: &(impl Domains<Domain = D> + ?Sized),
        fresh: &[DomainReservoir<D>],
        rule: MergeRule<T>,
    ) -> Result<(), ReuseError> {
        let rule = &rule.with_confidence_cap(self.cap);
        let numbers = self.numbers(WorldPass::Cells, frame);
        let choose = |slot: u32| numbers.pixel(slot as usize);
        self.report = self.reservoirs.update(visits, pixels, fresh, rule, choose)?;
        Ok(())
    }

    /// What pixels read.
    pub fn links<'b, Ds: Domains<Domain = D> + ?Sized>(
        &'b self,
        frame: FrameNumbers,
        pixels: &'b Ds,
    ) -> WorldLinks<'b, D, Ds, impl Fn(usize) -> CounterRng + Sync + use<D, Ds>> {
        let numbers = self.numbers(WorldPass::Links, frame);
        self.reservoirs
            .links(pixels, self.reads, move |pixel| numbers.pixel(pixel))
    }

    /// The random numbers of pixels that merge what they read.
    pub fn choose(&self, frame: FrameNumbers) -> impl Fn(usize) -> CounterRng + Sync + use<D> {
        let numbers = self.numbers(WorldPass::Merge, frame);
        move |pixel| numbers.pixel(pixel)
    }

    pub fn history(&self) -> History<'_, WorldReservoirs<D>> {
        self.reservoirs.history()
    }

    /// What cells hold, by the numbers that links lead to.
    pub fn held(&self) -> &[DomainReservoir<D>] {
        self.reservoirs.reservoirs()
    }

    /// Figures of the last frame.
    pub fn figures(&self) -> [(&'static str, f64); 5] {
        let report = &self.report;
        let all = self
            .held()
            .iter()
            .filter(|held| !Reservoir::is_empty(held))
            .count();
        [
            ("world_cells", report.occupancy.occupied as f64),
            ("world_cells_refused", report.occupancy.refused as f64),
            ("world_cells_visited", report.visited as f64),
            ("world_reservoirs", all as f64),
            (
                "world_distinct_share",
                report.distinct as f64 / report.held.max(1) as f64,
            ),
        ]
    }
}

/// How many of the paths that are held differ: by what a tree of candidates found them.
pub(super) fn held_paths<'s>(held: impl Iterator<Item = &'s PathSample>) -> Vec<(&'static str, f64)> {
    let mut keys: Vec<_> = held
        .map(|path| {
            let anatomy = path.anatomy();
            (
                path.seed().bits(),
                anatomy.length,
                anatomy.ends_at_sampled_emitter,
            )
        })
        .collect();
    held_figures(&mut keys)
}

/// How many of the samples that pixels hold differ, by their keys.
pub(super) fn held_figures<K: Ord>(keys: &mut [K]) -> Vec<(&'static str, f64)> {
    let count = DistinctSamples::count(keys);
    vec![
        ("held_samples", count.samples as f64),
        ("distinct_samples", count.distinct as f64),
        ("effective_samples", count.effective),
    ]
}

impl WorldDomain for Primary {
    /// On the side that is seen. A surface that no endpoint can light takes no part.
    fn site(&self) -> Option<SurfaceSite> {
        let point = &self.point;
        let normal = match self.sees_outside() {
            true => point.geometric_normal,
            false => -point.geometric_normal,
        };
        let site = SurfaceSite::new(point.position, normal).with_eye_distance(self.distance);
        self.bsdf.has_non_delta().then_some(site)
    }

    fn is_same(&self, a: &Self::Sample, b: &Self::Sample) -> bool {
        a.endpoint == b.endpoint
    }
}

impl WorldDomain for IndirectPixel {
    /// On the side that is seen.
    fn site(&self) -> Option<SurfaceSite> {
        let normal = match self.outward {
            true => self.point.geometric_normal,
            false => -self.point.geometric_normal,
        };
        Some(SurfaceSite::new(self.point.position, normal).with_eye_distance(self.outlook.distance))
    }

    fn is_same(&self, a: &Sender, b: &Sender) -> bool {
        a.point.position == b.point.position && a.radiance == b.radiance
    }
}

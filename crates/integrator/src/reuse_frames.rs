//! Frames of all methods with reuse: camera rays, the data of two frames, and passes between
//! buffers.

use crate::camera_motion::pixel_seeing;
use crate::camera_ray::PixelRay;
use lightshed_film::MAX_BATCH;
use lightshed_resampling::{
    Choose, Contribution, Domain, DomainReservoir, Domains, Extent, History, Reservoir, Reuse, ReuseError,
    ShiftMapping, Storage, Sums, Topology,
};
use lightshed_sampling::{FrameNumbers, FramePasses, PassNumbers, PointSet, f32_from_u32, parallel};
use lightshed_scene::glam::{Vec2, Vec3};
use lightshed_scene::{Camera, Hit, Ray, Rgb, Scene};
use std::sync::atomic::{AtomicBool, Ordering};

/// A frame: its camera, its number and its random numbers.
#[derive(Clone, Copy)]
pub(crate) struct FrameView<'a> {
    pub camera: &'a Camera,
    pub number: u32,
    pub numbers: FrameNumbers,
}

impl<'a> FrameView<'a> {
    /// Frame number `number` of images of `seed` that are `width` pixels wide.
    pub fn new(
        camera: &'a Camera,
        passes: FramePasses,
        (number, seed): (u32, u64),
        (width, points): (u32, PointSet),
    ) -> Self {
        Self {
            camera,
            number,
            numbers: passes.frame(seed, number, width).with_points(points),
        }
    }
}

/// The size of a scene's images.
pub(crate) fn extent_of(scene: &Scene) -> Extent {
    let settings = scene.settings();
    Extent {
        width: settings.width,
        height: settings.height,
    }
}

/// The least corner of a pixel.
#[inline]
pub(crate) fn corner_of(extent: Extent, index: usize) -> Vec2 {
    let width = extent.width as usize;
    Vec2::new((index % width) as f32, (index / width) as f32)
}

/// Squares of pixels, each of which is seen by one camera ray.
#[derive(Clone, Copy)]
pub(crate) struct Cells {
    image: Extent,
    side: u32,
}

impl Cells {
    /// One for each pixel.
    pub fn pixels(image: Extent) -> Self {
        Self { image, side: 1 }
    }

    /// Of `side` pixels a side. Those at the right and at the bottom may reach out of the image.
    pub fn squares(image: Extent, side: u32) -> Self {
        let side = side.max(1);
        Self { image, side }
    }

    /// Whether they are the pixels.
    pub fn are_pixels(self) -> bool {
        self.side == 1
    }

    /// How many there are in a row and in a column.
    pub fn extent(self) -> Extent {
        Extent {
            width: self.image.width.div_ceil(self.side),
            height: self.image.height.div_ceil(self.side),
        }
    }

    /// The cell in which a point appears on the film.
    pub fn seeing(self, camera: &Camera, point: Vec3) -> Option<usize> {
        let pixel = pixel_seeing(camera, self.image, point)?;
        let [x, y] = self.image.place(pixel).map(|at| at / i64::from(self.side));
        self.extent().index(x, y)
    }

    /// The ray through a place in a cell.
    fn ray(self, camera: &Camera, index: usize, [x, y, u, v]: [f32; 4]) -> Ray {
        let side = self.side as f32;
        let corner = corner_of(self.extent(), index) * side;
        PixelRay::through(camera, corner, [x * side, y * side, u, v]).ray
    }
}

/// Does `work(first, batch)` for each of `batches`, chunks of [`MAX_BATCH`] pixels of which `first`
/// is the first, as long as nobody cancels. False if somebody did.
pub(crate) fn in_batches<B: Send>(
    batches: impl Iterator<Item = B>,
    cancel: &AtomicBool,
    work: impl Fn(usize, B) + Sync,
) -> bool {
    parallel::for_each(batches, |batch, item| {
        if !cancel.load(Ordering::Relaxed) {
            work(batch * MAX_BATCH, item);
        }
    });
    !cancel.load(Ordering::Relaxed)
}

/// Traces a camera ray through a random position of every one of `cells`, by the numbers of the
/// pass `numbers`. Passes its hit to `see`, with the cell's number, its entry in `pixels` and its
/// value in `image`. False if cancelled.
pub(crate) fn trace_camera_rays<P: Send>(
    (scene, camera, cells): (&Scene, &Camera, Cells),
    numbers: PassNumbers,
    (pixels, image): (&mut [P], &mut [Rgb]),
    cancel: &AtomicBool,
    see: impl Fn(usize, &Ray, Option<&Hit>, &mut P, &mut Rgb) + Sync,
) -> bool {
    let batches = pixels.chunks_mut(MAX_BATCH).zip(image.chunks_mut(MAX_BATCH));
    in_batches(batches, cancel, |first, (pixels, image)| {
        let count = pixels.len().min(MAX_BATCH);
        let rays: [Ray; MAX_BATCH] = std::array::from_fn(|place| {
            let index = first + place.min(count - 1);
            cells.ray(camera, index, numbers.block(index).map(f32_from_u32))
        });
        let mut hits = [None; MAX_BATCH];
        scene
            .accelerator()
            .intersect_many(&rays[..count], &mut hits[..count]);
        let found = rays.iter().zip(&hits).zip(pixels.iter_mut().zip(image));
        for (place, ((ray, hit), (pixel, value))) in found.enumerate() {
            see(first + place, ray, hit.as_ref(), pixel, value);
        }
    })
}

/// Data of a frame and of the previous one, by the order of frames: even, odd.
#[derive(Default)]
pub(crate) struct TwoFrames<P>([P; 2]);

impl<P> TwoFrames<P> {
    /// Of frame number `frame`, the last one or the one before.
    pub fn of(&self, frame: u32) -> &P {
        &self.0[frame as usize % 2]
    }

    /// Of frame number `frame`, in place of the one before the last.
    pub fn of_mut(&mut self, frame: u32) -> &mut P {
        &mut self.0[frame as usize % 2]
    }
}

/// What a pass reads and writes: this frame's reservoirs, the previous frame's, and the next ones
/// of this frame.
type Passed<'r, D, R> = (
    &'r [DomainReservoir<D, R>],
    &'r [DomainReservoir<D, R>],
    &'r mut [DomainReservoir<D, R>],
);

/// The reservoirs of the current frame, and those of the previous one.
pub(crate) struct Reservoirs<D: Domain, R: Storage = f32> {
    pub now: Vec<DomainReservoir<D, R>>,
    pub held: Vec<DomainReservoir<D, R>>,
    scratch: Vec<DomainReservoir<D, R>>,
}

// Not derived: a derive would ask for `D: Default`.
impl<D: Domain, R: Storage> Default for Reservoirs<D, R> {
    fn default() -> Self {
        Self {
            now: Vec::new(),
            held: Vec::new(),
            scratch: Vec::new(),
        }
    }
}

impl<D: Domain, R: Storage> Reservoirs<D, R>
where
    D::Sample: Send + Sync,
{
    /// Room for a frame of `count` pixels.
    pub fn begin(&mut self, count: usize) {
        for reservoirs in [&mut self.now, &mut self.scratch] {
            reservoirs.resize(count, Reservoir::empty(0.0));
        }
    }

    /// The next frame finds nothing held.
    pub fn forget(&mut self) {
        self.held.fill_with(|| Reservoir::empty(0.0));
    }

    /// Leaves the frame's reservoirs to the next one.
    pub fn keep(&mut self) {
        std::mem::swap(&mut self.now, &mut self.held);
    }

    /// Replaces the frame's reservoirs by those that `pass` writes: it gets the frame's, the
    /// previous frame's, and where to write.
    fn replace(
        &mut self,
        pass: impl FnOnce(Passed<'_, D, R>) -> Result<(), ReuseError>,
    ) -> Result<(), ReuseError> {
        pass((&self.now, &self.held, &mut self.scratch))?;
        std::mem::swap(&mut self.now, &mut self.scratch);
        Ok(())
    }

    /// Temporal reuse of the previous reservoirs, which belong to the domains `before`, at
    /// `seen_at`.
    pub fn in_time<Ds, H, T, C>(
        &mut self,
        reuse: &Reuse<'_, Ds, T>,
        before: &H,
        seen_at: impl Fn(usize, &[DomainReservoir<D, R>]) -> Option<usize> + Sync,
        choose: impl Fn(usize) -> C + Sync,
    ) -> Result<(), ReuseError>
    where
        Ds: Domains<Domain = D>,
        H: Domains<Domain = D> + ?Sized,
        T: ShiftMapping<D> + Sync,
        C: Choose,
    {
        self.replace(|(now, held, next)| {
            let history = History::new(before, held);
            reuse.temporal(now, history, |index| seen_at(index, now), next, choose)
        })
    }

    /// Rounds of spatial reuse, until cancelled.
    pub fn in_space<Ds, T, P, C>(
        &mut self,
        reuse: &Reuse<'_, Ds, T>,
        rounds: u32,
        neighbours: impl Fn(u32) -> P,
        choose: impl Fn(u32, usize) -> C + Sync,
        cancel: &AtomicBool,
    ) -> Result<(), ReuseError>
    where
        Ds: Domains<Domain = D>,
        T: ShiftMapping<D> + Sync,
        P: Topology,
        C: Choose,
    {
        let rounds = (0..rounds).take_while(|_| !cancel.load(Ordering::Relaxed));
        reuse.spatial_rounds(rounds, neighbours, &mut self.now, &mut self.scratch, choose)
    }

    /// Rounds of reuse in pairs, until cancelled.
    pub fn in_pairs<Ds, T, P, C>(
        &mut self,
        reuse: &Reuse<'_, Ds, T>,
        rounds: u32,
        pairs: impl Fn(u32) -> P,
        choose: impl Fn(u32, usize) -> C + Sync,
        cancel: &AtomicBool,
    ) -> Result<(), ReuseError>
    where
        Ds: Domains<Domain = D>,
        T: ShiftMapping<D> + Sync,
        P: Topology,
        C: Choose,
    {
        for round in (0..rounds).take_while(|_| !cancel.load(Ordering::Relaxed)) {
            let choose = |pixel| choose(round, pixel);
            self.replace(|(now, _, next)| reuse.paired(pairs(round), now, next, choose))?;
        }
        Ok(())
    }

    /// Reuse from those of another row, `others`, to which `links` lead.
    pub fn linked<Ds, H, T, C>(
        &mut self,
        reuse: &Reuse<'_, Ds, T>,
        others: History<'_, H, R>,
        links: impl Topology,
        choose: impl Fn(usize) -> C + Sync,
    ) -> Result<(), ReuseError>
    where
        Ds: Domains<Domain = D>,
        H: Domains<Domain = D> + ?Sized,
        T: ShiftMapping<D> + Sync,
        C: Choose,
    {
        self.replace(|(now, _, next)| reuse.linked(now, others, links, next, choose))
    }

    /// The same, where all that they bring shades `image`.
    pub fn linked_shaded<Ds, H, T, C>(
        &mut self,
        reuse: &Reuse<'_, Ds, T>,
        others: History<'_, H, R>,
        links: impl Topology,
        image: &mut [Rgb],
        shade: impl Fn(usize, Contribution<'_, D::Sample>, &mut Rgb) + Sync,
        choose: impl Fn(usize) -> C + Sync,
    ) -> Result<(), ReuseError>
    where
        Ds: Domains<Domain = D>,
        H: Domains<Domain = D> + ?Sized,
        T: ShiftMapping<D> + Sync,
        C: Choose,
    {
        let sums = Sums::new(image, shade);
        self.replace(|(now, _, next)| reuse.linked_integrated(now, others, links, next, sums, choose))
    }

    /// A last round, in which all inputs shade `image`.
    pub fn in_space_shaded<Ds, T, C>(
        &mut self,
        reuse: &Reuse<'_, Ds, T>,
        neighbours: impl Topology,
        image: &mut [Rgb],
        shade: impl Fn(usize, Contribution<'_, D::Sample>, &mut Rgb) + Sync,
        choose: impl Fn(usize) -> C + Sync,
    ) -> Result<(), ReuseError>
    where
        Ds: Domains<Domain = D>,
        T: ShiftMapping<D> + Sync,
        C: Choose,
    {
        let sums = Sums::new(image, shade);
        self.replace(|(now, _, next)| reuse.spatial_integrated(neighbours, now, next, sums, choose))
    }
}

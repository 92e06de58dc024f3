//! ReSTIR DI: direct light from many emitters by reuse among pixels and frames.

mod settings;

pub use settings::{RestirDiError, RestirDiSettings};

use super::candidates::{CandidateNumbers, KINDS, Survivors, resample_candidates};
use super::light::{DirectReservoir, LightSample, SeenFrom, lit_by};
use super::mutation::mutated;
use super::passes::{PASSES, Pass};
use super::primary::{Primary, trace_primaries};
use super::world::{WorldCells, WorldReuse, held_figures};
use crate::CameraMotion;
use crate::camera_motion::pixel_seeing;
use crate::emitter_sampler::EmitterSampler;
use crate::path::transport::met_emission;
use crate::ray_batch::NOWHERE;
use crate::reuse_frames::{FrameView, Reservoirs, TwoFrames, extent_of, in_batches};
use crate::visible_emission::{MOST_EDGES, VisibleFrames};
use lightshed_caching::{MAX_READS, WorldVisits};
use lightshed_film::{FrameMethod, MAX_BATCH, RayCounts};
use lightshed_film::{RayKind, RayTally};
use lightshed_resampling::{Contribution, Extent, MergeRule, Mis, Pattern, Reuse, ReuseError, Topology};
use lightshed_sampling::parallel;
use lightshed_scene::glam::Vec2;
use lightshed_scene::{Camera, EmitterEndpoint, EmittersByPower, Hit, Ray, Rgb, Scene};
use std::sync::atomic::{AtomicBool, Ordering};

/// Direct light by spatiotemporal reservoir resampling (Bitterli et al. 2020; merges by GRIS, Lin
/// 2022 ch. 6).
///
/// Each frame and pixel traces one camera ray, through a new position in the pixel. At the surface
/// it hits, candidates for the *endpoint* of light are resampled by
/// `p̂(e) = Y(f L_e |cos θ| |dω/de|)`, separately for those on surfaces, at infinity and of
/// lights that are points or directions. Shadow rays decide which survivors remain (visibility
/// *before* reuse), and one of them is selected. It is merged with the reservoir of the pixel that
/// saw the surface in the previous frame, then with neighbours of this frame, each in its own
/// domain: its own surface, view direction and, unless biased, occlusion (visibility *after* reuse,
/// evaluated in every MIS weight). The last round shades by the sum over its inputs, without colour
/// noise. Emission seen directly, and light by delta lobes, which cannot be reused, are added
/// exactly and by one sample each.
///
/// Every frame's expectation is that of [`DirectLight`](crate::DirectLight). Frames are correlated
/// with earlier ones by temporal reuse.
///
/// ```
/// use lightshed_integrator::{RestirDi, RestirDiSettings};
/// use lightshed_film::{Budget, RenderOptions, render_frames};
/// use lightshed_scene::{Scene, builtin};
/// use std::sync::atomic::AtomicBool;
///
/// let mut description = builtin::cornell();
/// (description.settings.width, description.settings.height) = (16, 16);
/// let scene = Scene::new(&description)?;
/// let options = RenderOptions::new(16, 16, Budget::Samples(4));
/// let mut method = RestirDi::new(&scene, scene.emitters_by_power(), RestirDiSettings::UNBIASED)?;
/// let outcome = render_frames(&mut method, &options, &|_| (), &AtomicBool::new(false))?;
/// assert!(outcome.film.mean_image().mean()[1] > 0.05);
/// assert_eq!(outcome.rays.map(|rays| rays.camera), Some(4 * 16 * 16));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct RestirDi<'a, S = EmittersByPower<'a>> {
    scene: &'a Scene,
    sampler: S,
    settings: RestirDiSettings,
    pattern: Pattern,
    motion: CameraMotion,
    tally: RayTally,
    /// What pixels see.
    pixels: TwoFrames<Vec<Option<Primary>>>,
    /// What they hold.
    reservoirs: Reservoirs<Primary>,
    /// What cells of space hold.
    world: Option<WorldCells<Primary>>,
    visible: VisibleFrames,
}

impl<'a, S: EmitterSampler> RestirDi<'a, S> {
    /// Candidates by `sampler`.
    ///
    /// # Errors
    /// See [`RestirDiError`].
    pub fn new(scene: &'a Scene, sampler: S, settings: RestirDiSettings) -> Result<Self, RestirDiError> {
        let pattern = settings.check()?;
        let world = settings.world.map(|world| WorldCells::new(scene, &world));
        Ok(Self {
            world: world.transpose().map_err(RestirDiError::World)?,
            scene,
            sampler,
            settings,
            pattern,
            motion: CameraMotion::STILL,
            tally: RayTally::default(),
            pixels: TwoFrames::default(),
            reservoirs: Reservoirs::default(),
            visible: VisibleFrames::default(),
        })
    }

    /// Moves the camera from frame to frame.
    #[must_use]
    pub fn with_motion(self, motion: CameraMotion) -> Self {
        Self { motion, ..self }
    }

    /// Later frames show another scene, with emitters by its sampler: of the same size, but with
    /// lights or surfaces that have changed. Everything held is forgotten, in pixels and in cells
    /// of space, since targets ask the scene as it is now.
    ///
    /// # Errors
    /// See [`RestirDiError`].
    pub fn change_scene(&mut self, scene: &'a Scene, sampler: S) -> Result<(), RestirDiError> {
        let world = self.settings.world.map(|world| WorldCells::new(scene, &world));
        self.world = world.transpose().map_err(RestirDiError::World)?;
        (self.scene, self.sampler) = (scene, sampler);
        self.reservoirs.forget();
        self.visible = VisibleFrames::default();
        Ok(())
    }

    /// What the pixels of frame `frame`, rendered last, see.
    pub(super) fn pixels(&self, frame: u32) -> &[Option<Primary>] {
        self.pixels.of(frame)
    }

    pub(super) fn world_reuse(&self) -> Option<WorldReuse> {
        self.settings.world
    }

    fn extent(&self) -> Extent {
        extent_of(self.scene)
    }

    /// Fresh reservoirs of all pixels, or of those that `wanted` names, and light by delta lobes
    /// into the image. False if cancelled.
    fn resample_fresh(
        &self,
        view: FrameView<'_>,
        wanted: Option<&[bool]>,
        reservoirs: &mut [DirectReservoir],
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> bool {
        let results = reservoirs.chunks_mut(MAX_BATCH).zip(image.chunks_mut(MAX_BATCH));
        let batches = self.pixels(view.number).chunks(MAX_BATCH).zip(results);
        in_batches(batches, cancel, |first, (pixels, (reservoirs, image))| {
            let mut by_bsdf = [None; MAX_BATCH];
            let wanted = wanted.map(|wanted| &wanted[first..first + pixels.len()]);
            self.meet_emitters(view, (first, wanted), pixels, &mut by_bsdf, image);
            self.resample_chunk(view, (first, wanted), pixels, &by_bsdf, reservoirs);
        })
    }

    /// One ray for each pixel by its BSDF: those of delta lobes are shaded, the endpoints that
    /// others meet are candidates.
    fn meet_emitters(
        &self,
        view: FrameView<'_>,
        (first, wanted): (usize, Option<&[bool]>),
        pixels: &[Option<Primary>],
        by_bsdf: &mut [Option<EmitterEndpoint>; MAX_BATCH],
        image: &mut [Rgb],
    ) {
        let (scene, emitters) = (self.scene, self.scene.emitters());
        if emitters.area_count() == 0 && emitters.environment().is_none() {
            return;
        }
        let (mut rays, mut owners, mut count) = ([NOWHERE; MAX_BATCH], [(0, None); MAX_BATCH], 0);
        for (place, primary) in surfaces(pixels) {
            // Delta lobes are shaded by this ray, whoever else wants it.
            if wanted.is_some_and(|wanted| !wanted[place]) && primary.bsdf.is_diffuse() {
                continue;
            }
            let mut rng = view.numbers.pass(Pass::Bsdf).pixel(first + place);
            let u_lobe = rng.next_f32();
            let u = Vec2::from(rng.next_2d());
            if let Some(sample) = primary.bsdf.sample(primary.wo, u_lobe, u) {
                rays[count] = primary.point.spawn(primary.point.shading.to_world(sample.wi));
                owners[count] = (place, sample.is_delta.then_some(sample.weight));
                count += 1;
            }
        }
        self.tally.add(RayKind::Path, count);
        let mut hits = [None; MAX_BATCH];
        scene.intersect_emitting_many(&rays[..count], &mut hits[..count]);
        // What a ray may hit; rays that hit nothing need no occlusion test.
        let (mut met, mut kept) = ([Met::default(); MAX_BATCH], 0);
        for index in 0..count {
            let (ray, hit) = (rays[index], hits[index]);
            let (place, delta) = owners[index];
            let point = hit.map(|hit| scene.surface(&ray, &hit));
            let radiance = met_emission(scene, &ray, point.as_ref());
            if radiance == Rgb::ZERO {
                continue;
            }
            let endpoint = match point.zip(hit) {
                Some((point, hit)) => EmitterEndpoint::Surface {
                    emitter: point.emitter,
                    coordinates: scene.coordinates(&ray, &hit),
                },
                None => EmitterEndpoint::Environment {
                    direction: ray.direction,
                },
            };
            met[kept] = Met {
                place,
                endpoint: Some(endpoint),
                shaded: delta.map(|weight| weight * radiance),
            };
            rays[kept] = Ray {
                t_max: hit.map_or(f32::INFINITY, |hit: Hit| hit.t),
                ..ray
            };
            kept += 1;
        }
        let mut occluded = [false; MAX_BATCH];
        scene
            .accelerator()
            .occluded_many(&rays[..kept], &mut occluded[..kept]);
        for (met, _) in met.iter().zip(occluded).take(kept).filter(|(_, hidden)| !hidden) {
            match met.shaded {
                Some(radiance) => image[met.place] += radiance,
                None => by_bsdf[met.place] = met.endpoint,
            }
        }
    }

    /// The numbers of a pixel's candidates.
    fn candidate_numbers(&self, view: FrameView<'_>, index: usize) -> CandidateNumbers {
        let numbers = view.numbers.pass(Pass::Candidates);
        let mut rng = numbers.pixel(index);
        if !self.settings.stratified {
            return CandidateNumbers::independent(rng);
        }
        // The words of the block are the stream's first where points are independent.
        for _ in 0..4 {
            rng.next_u32();
        }
        let [select, u, v, _] = numbers.block(index);
        CandidateNumbers::stratified([select, u, v], rng)
    }

    /// Candidates for each pixel, and the visible survivors.
    fn resample_chunk(
        &self,
        view: FrameView<'_>,
        (first, wanted): (usize, Option<&[bool]>),
        pixels: &[Option<Primary>],
        by_bsdf: &[Option<EmitterEndpoint>; MAX_BATCH],
        reservoirs: &mut [DirectReservoir],
    ) {
        // Without a surface, or with one that no endpoint can light: no part in reuse.
        reservoirs.fill(DirectReservoir::empty(0.0));
        let rng = |place, pass: Pass| view.numbers.pass(pass).pixel(first + place);
        let mut survivors = [None; MAX_BATCH];
        let lit = surfaces(pixels).filter(|(_, primary)| primary.bsdf.has_non_delta());
        for (place, primary) in lit.filter(|&(place, _)| wanted.is_none_or(|wanted| wanted[place])) {
            survivors[place] = Some(resample_candidates(
                &self.sampler,
                primary,
                self.settings.emitter_candidates,
                by_bsdf[place],
                &mut self.candidate_numbers(view, first + place),
            ));
        }
        for kind in 0..KINDS {
            let (mut rays, mut owners, mut count) = ([NOWHERE; MAX_BATCH], [0; MAX_BATCH], 0);
            for (place, primary) in surfaces(pixels) {
                let unknown = survivors[place]
                    .as_ref()
                    .and_then(|held: &Survivors| held.unknown(kind));
                if let Some(lit) = unknown.and_then(|endpoint| lit_by(self.scene, primary, endpoint)) {
                    rays[count] = lit.connection.shadow_ray(&primary.point);
                    owners[count] = place;
                    count += 1;
                }
            }
            for place in self.hidden(&rays[..count], &owners) {
                if let Some(held) = &mut survivors[place] {
                    held.remove(kind);
                }
            }
        }
        for ((place, held), reservoir) in survivors.iter().enumerate().zip(reservoirs) {
            if let Some(held) = held {
                *reservoir = held.resample(&mut rng(place, Pass::Survivors));
            }
        }
    }

    /// The owners of those shadow rays, at most [`MAX_BATCH`], that meet something.
    fn hidden(&self, rays: &[Ray], owners: &[usize; MAX_BATCH]) -> impl Iterator<Item = usize> {
        let mut occluded = [false; MAX_BATCH];
        self.tally.add(RayKind::Emitter, rays.len());
        self.scene
            .accelerator()
            .occluded_many(rays, &mut occluded[..rays.len()]);
        occluded
            .into_iter()
            .zip(*owners)
            .filter_map(|(hidden, owner)| hidden.then_some(owner))
    }

    /// All reuse of a frame. At the end `reservoirs` has the pixels' reservoirs; `image` is shaded,
    /// unless biased or without neighbours.
    fn reuse(
        &self,
        view: FrameView<'_>,
        reservoirs: &mut Reservoirs<Primary>,
        world: Option<&WorldCells<Primary>>,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Result<(), ReuseError> {
        let RestirDiSettings {
            biased,
            spatial_rounds,
            confidence_cap,
            ..
        } = self.settings;
        let (pixels, extent) = (self.pixels(view.number), self.extent());
        let shift = SeenFrom {
            scene: self.scene,
            tally: &self.tally,
            visibility: !biased,
        };
        let reuse = |mis: Mis| {
            let mis = if biased { Mis::ConstantBiased } else { mis };
            let rule = MergeRule::new(&shift).with_mis(mis);
            Reuse::new(pixels, rule.with_confidence_cap(confidence_cap))
        };
        if self.settings.temporal_reuse && view.number > 0 {
            let before = self.pixels(view.number - 1);
            let camera = self.motion.camera(self.scene, view.number - 1);
            let seen_at = |pixel: usize, _: &[DirectReservoir]| {
                let position = pixels[pixel].as_ref()?.point.position;
                let source = pixel_seeing(&camera, extent, position)?;
                alike(&pixels[pixel], &before[source]).then_some(source)
            };
            let numbers = view.numbers.pass(Pass::Temporal);
            reservoirs.in_time(&reuse(Mis::Balance), before, seen_at, |pixel| {
                numbers.pixel(pixel)
            })?;
        }
        if self.settings.mutations > 0 && !biased && view.number > 0 {
            self.mutate(view, &shift, &mut reservoirs.now);
        }
        let spatial = reuse(Mis::PAIRWISE_DEFENSIVE);
        let shade = |_, part: Contribution<'_, LightSample>, sum: &mut Rgb| {
            *sum += weighted(part.sample.value, part.weight);
        };
        if let Some(world) = world {
            let numbers = view.numbers;
            let (links, choose) = (world.links(numbers, pixels), world.choose(numbers));
            if spatial_rounds == 0 {
                return reservoirs.linked_shaded(&spatial, world.history(), links, image, shade, choose);
            }
            reservoirs.linked(&spatial, world.history(), links, choose)?;
        }
        if let Some(pairs) = self.settings.paired() {
            let numbers = view.numbers.pass(Pass::Spatial);
            let pairs = |round| {
                let pairs = pairs.over(extent, view.numbers.key(round));
                pairs.filtered(|own, other| alike(&pixels[own], &pixels[other]))
            };
            let choose = |round, pixel| numbers.round(round).pixel(pixel);
            return reservoirs.in_pairs(&spatial, spatial_rounds, pairs, choose, cancel);
        }
        let neighbours = |round| {
            let pattern = self.pattern.over(extent, view.numbers.key(round));
            pattern.filtered(|own, other| alike(&pixels[own], &pixels[other]))
        };
        let numbers = view.numbers.pass(Pass::Spatial);
        let shades = !biased && spatial_rounds > 0;
        let others = spatial_rounds - u32::from(shades);
        let choose = |round, pixel| numbers.round(round).pixel(pixel);
        reservoirs.in_space(&spatial, others, neighbours, choose, cancel)?;
        if shades {
            let choose = |pixel| choose(others, pixel);
            reservoirs.in_space_shaded(&spatial, neighbours(others), image, shade, choose)?;
        }
        Ok(())
    }

    /// A frame of the cells: they merge what pixels bring, with occlusion. Returns whether that
    /// went well.
    fn bring(
        &self,
        view: FrameView<'_>,
        (world, visits): (&mut WorldCells<Primary>, &WorldVisits),
        fresh: &[DirectReservoir],
    ) -> bool {
        let shift = SeenFrom {
            scene: self.scene,
            tally: &self.tally,
            visibility: true,
        };
        let pixels = self.pixels(view.number);
        // Fails for slices of other lengths only.
        world
            .update(view.numbers, visits, pixels, fresh, MergeRule::new(&shift))
            .is_ok()
    }

    /// Adds to each pixel the mean of `f(Y) W` over the reservoirs of cells that it reads, `f` with
    /// occlusion: **biased**, as the cells' sites need not see what the pixel sees.
    fn shade_by_cells(&self, view: FrameView<'_>, world: &WorldCells<Primary>, image: &mut [Rgb]) {
        let pixels = self.pixels(view.number);
        let links = world.links(view.numbers, pixels);
        let batches = pixels.chunks(MAX_BATCH).zip(image.chunks_mut(MAX_BATCH));
        parallel::for_each(batches, |batch, (pixels, image)| {
            let (mut reads, mut all) = ([(0, 0, 0.0); MAX_BATCH * MAX_READS as usize], 0);
            for (place, _) in surfaces(pixels) {
                let first = all;
                links.for_each(batch * MAX_BATCH + place, |held| {
                    reads[all] = (place, held, 1.0);
                    all += 1;
                });
                let share = 1.0 / (all - first).max(1) as f64;
                reads[first..all].iter_mut().for_each(|read| read.2 = share);
            }
            for reads in reads[..all].chunks(MAX_BATCH) {
                let (mut rays, mut owners, mut count) = ([NOWHERE; MAX_BATCH], [0; MAX_BATCH], 0);
                let mut light = [(0, Rgb::ZERO); MAX_BATCH];
                for &(place, held, share) in reads {
                    let Some((sample, weight)) = world.held()[held].weighted_sample() else {
                        continue;
                    };
                    let primary = pixels[place].as_ref();
                    let lit = primary.and_then(|primary| lit_by(self.scene, primary, &sample.endpoint));
                    let Some((lit, primary)) = lit.zip(primary) else {
                        continue;
                    };
                    rays[count] = lit.connection.shadow_ray(&primary.point);
                    owners[count] = count;
                    light[count] = (place, weighted(lit.value, f64::from(weight.value()) * share));
                    count += 1;
                }
                for hidden in self.hidden(&rays[..count], &owners) {
                    light[hidden].1 = Rgb::ZERO;
                }
                for (place, light) in &light[..count] {
                    image[*place] += *light;
                }
            }
        });
    }

    /// Mutates the pixels' samples by small steps.
    fn mutate(&self, view: FrameView<'_>, seen: &SeenFrom<'_>, reservoirs: &mut [DirectReservoir]) {
        let pixels = self.pixels(view.number).chunks(MAX_BATCH);
        // Numbers of a second reservoir, which no pixel has.
        let numbers = view.numbers.pass(Pass::Temporal).reservoir(1);
        parallel::for_each(
            pixels.zip(reservoirs.chunks_mut(MAX_BATCH)),
            |batch, (pixels, reservoirs)| {
                for (place, primary) in surfaces(pixels) {
                    let mut rng = numbers.pixel(batch * MAX_BATCH + place);
                    for _ in 0..self.settings.mutations {
                        reservoirs[place] = mutated(seen, primary, reservoirs[place], &mut rng);
                    }
                }
            },
        );
    }

    /// Adds `f(Y) W` to each pixel, `f` with occlusion.
    fn shade(&self, frame: u32, reservoirs: &[DirectReservoir], image: &mut [Rgb]) {
        let pixels = self.pixels(frame).chunks(MAX_BATCH);
        let results = reservoirs.chunks(MAX_BATCH).zip(image.chunks_mut(MAX_BATCH));
        parallel::for_each(pixels.zip(results), |_, (pixels, (reservoirs, image))| {
            let (mut rays, mut owners, mut count) = ([NOWHERE; MAX_BATCH], [0; MAX_BATCH], 0);
            let mut light = [Rgb::ZERO; MAX_BATCH];
            for (place, primary) in surfaces(pixels) {
                let Some((sample, weight)) = reservoirs[place].weighted_sample() else {
                    continue;
                };
                light[place] = weighted(sample.value, f64::from(weight.value()));
                // If targets ignore occlusion, it is tested now.
                let unknown = self.settings.biased.then_some(sample.endpoint);
                if let Some(lit) = unknown.and_then(|endpoint| lit_by(self.scene, primary, &endpoint)) {
                    rays[count] = lit.connection.shadow_ray(&primary.point);
                    owners[count] = place;
                    count += 1;
                }
            }
            for place in self.hidden(&rays[..count], &owners) {
                light[place] = Rgb::ZERO;
            }
            for (value, light) in image.iter_mut().zip(light) {
                *value += light;
            }
        });
    }
}

/// What a ray by the BSDF may have met.
#[derive(Clone, Copy, Default)]
struct Met {
    place: usize,
    endpoint: Option<EmitterEndpoint>,
    /// Its light, by a delta lobe.
    shaded: Option<Rgb>,
}

/// The pixels that see a surface, with their place.
fn surfaces(pixels: &[Option<Primary>]) -> impl Iterator<Item = (usize, &Primary)> {
    let numbered = pixels.iter().enumerate();
    numbered.filter_map(|(place, pixel)| pixel.as_ref().map(|primary| (place, primary)))
}

/// Whether both see surfaces between which reuse promises anything.
fn alike(own: &Option<Primary>, other: &Option<Primary>) -> bool {
    matches!((own, other), (Some(own), Some(other)) if own.resembles(other))
}

/// `f W`: the factors may be of any size.
fn weighted(value: Rgb, weight: f64) -> Rgb {
    (value.as_dvec3() * weight).as_vec3()
}

impl<S: EmitterSampler + Send> FrameMethod for RestirDi<'_, S> {
    fn size(&self) -> [u32; 2] {
        [self.extent().width, self.extent().height]
    }

    fn render_frame(
        &mut self,
        frame: u32,
        seed: u64,
        image: &mut [Rgb],
        cancel: &AtomicBool,
    ) -> Option<RayCounts> {
        let (scene, extent) = (self.scene, self.extent());
        let camera: Camera = self.motion.camera(scene, frame);
        let view = FrameView::new(
            &camera,
            PASSES,
            (frame, seed),
            (extent.width, self.settings.points),
        );
        let pixels = self.pixels.of_mut(frame);
        pixels.resize(extent.len(), None);
        let (wanted, is_still) = (self.settings.visible_emission, self.motion.is_still());
        self.visible.prepare(wanted, scene, &camera, is_still, MOST_EDGES);
        let rays = trace_primaries(scene, view, self.visible.get(), (pixels, image), cancel);
        self.tally.add(RayKind::Camera, rays.unwrap_or(0) as usize);

        let biased = self.settings.biased;
        let mut reservoirs = std::mem::take(&mut self.reservoirs);
        reservoirs.begin(extent.len());
        let mut world = self.world.take();
        let visits = world
            .as_mut()
            .filter(|_| rays.is_some())
            .map(|world| world.visit(view.numbers, self.pixels(frame)));
        // Who shades by cells alone wants candidates only for them.
        let wanted = visits.as_ref().filter(|_| biased).map(|visits| {
            let mut wanted = vec![false; extent.len()];
            visits.contributors().for_each(|pixel| wanted[pixel] = true);
            wanted
        });
        let mut done = rays.is_some()
            && self.resample_fresh(view, wanted.as_deref(), &mut reservoirs.now, image, cancel);
        if let (true, Some(world), Some(visits)) = (done, &mut world, &visits) {
            done = self.bring(view, (world, visits), &reservoirs.now);
        }
        if let (true, true, Some(world)) = (done, biased, &world) {
            self.shade_by_cells(view, world, image);
        } else if done {
            // Fails for slices of other lengths only.
            done = self
                .reuse(view, &mut reservoirs, world.as_ref(), image, cancel)
                .is_ok();
            let rounds = self.settings.spatial_rounds > 0 && self.settings.paired().is_none();
            let is_shaded = !biased && (rounds || (world.is_some() && self.settings.spatial_rounds == 0));
            if done && !is_shaded {
                self.shade(frame, &reservoirs.now, image);
            }
        }
        self.world = world;
        reservoirs.keep();
        self.reservoirs = reservoirs;
        (done && !cancel.load(Ordering::Relaxed)).then(|| self.tally.take())
    }

    fn is_still(&self) -> bool {
        self.motion.is_still()
    }

    /// How many different endpoints pixels hold after the last frame, and what cells do.
    fn figures(&self) -> Vec<(&'static str, f64)> {
        let held = self.reservoirs.held.iter().filter_map(|held| held.sample());
        let mut keys: Vec<_> = held.map(LightSample::key).collect();
        let mut figures = held_figures(&mut keys);
        figures.extend(self.world.iter().flat_map(WorldCells::figures));
        figures
    }
}

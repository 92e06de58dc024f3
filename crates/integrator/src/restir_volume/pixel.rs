//! A pixel of one frame as a domain of paths through volumes.

use super::path::{PathCoordinates, Vertex, VolumePath};
use super::through::{Volumes, optical_depth, proposal_extinction};
use lightshed_resampling::{Domain, DomainReservoir};
use lightshed_scene::glam::{DVec3, Vec3};
use lightshed_scene::volume::Interval;
use lightshed_scene::{Bsdf, Ray, SurfacePoint};

/// A stretch of the camera ray of constant coarse density, from where the one before ends.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    /// Distance at which it ends.
    end: f32,
    /// `ρ*`; may be 0.
    density: f32,
    /// `∫ ρ* dt` from the beginning of its run to its end.
    inside: f32,
}

/// Stretches in one medium.
#[derive(Clone, Copy, Debug)]
struct Run {
    medium: u32,
    /// Distance at which it begins.
    start: f32,
    /// The end of its stretches.
    stretches_end: u32,
    /// The proposals' coefficient.
    k: f64,
    /// `∫ σ*_t / ∫ ρ*` by channel, and before its beginning `∫ σ*_t`.
    coefficients: DVec3,
    depth_before: DVec3,
    /// The latter of the proposals' coefficient.
    proposal_before: f64,
}

/// The camera ray of a pixel, with what lies along it at the coarse level of proposals and reuse.
///
/// Transmittances from the camera are read off what was found once: the same ray is asked for in every target of the pixel.
pub(crate) struct VolumePixel {
    pub ray: Ray,
    /// What the camera is in.
    pub medium: Option<u32>,
    runs: Vec<Run>,
    stretches: Vec<Stretch>,
    surface: Option<PrimarySurface>,
    /// Up to the surface, or the end.
    depth: DVec3,
    proposal_depth: f64,
}

struct PrimarySurface {
    point: SurfacePoint,
    bsdf: Bsdf,
    wo: Vec3,
    medium: Option<u32>,
}

/// Where a first vertex was put.
pub(crate) enum First {
    /// In a medium, with `p(z₁)` per unit of length.
    Medium { distance: f32, pdf: f64 },
    /// On the surface, with its probability.
    Surface { pdf: f64 },
    /// Nowhere.
    Nowhere,
}

impl Default for VolumePixel {
    fn default() -> Self {
        Self {
            ray: Ray::new(Vec3::ZERO, Vec3::Z),
            medium: None,
            runs: Vec::new(),
            stretches: Vec::new(),
            surface: None,
            depth: DVec3::ZERO,
            proposal_depth: 0.0,
        }
    }
}

impl VolumePixel {
    /// Looks along a camera ray of unit direction, by densities of a level of at least 1.
    pub fn look(&mut self, volumes: &Volumes<'_>, ray: Ray, medium: Option<u32>, level: u32) {
        self.runs.clear();
        self.stretches.clear();
        (self.ray, self.medium) = (ray, medium);
        (self.depth, self.proposal_depth) = (DVec3::ZERO, 0.0);
        let (surface, medium) = volumes.parts(&ray, medium, |part| {
            if let Some(index) = part.medium {
                let (medium, coarse) = volumes.medium(index);
                let interval = Interval {
                    t0: 0.0,
                    t1: part.t_max,
                };
                let mut run = Run {
                    medium: index,
                    start: part.before as f32,
                    stretches_end: 0,
                    k: f64::from(proposal_extinction(medium)),
                    coefficients: optical_depth(medium, &part.ray, 1.0),
                    depth_before: self.depth,
                    proposal_before: self.proposal_depth,
                };
                let (mut end, mut inside) = (0.0, 0.0);
                coarse.stretches(medium, &part.ray, interval, level, |stretch| {
                    if stretch.t0 > end {
                        self.push(part.before + stretch.t0, 0.0, inside, run.stretches_end);
                        run.stretches_end = self.stretches.len() as u32;
                    }
                    end = stretch.t1;
                    inside += f64::from(stretch.density) * (stretch.t1 - stretch.t0);
                    self.push(
                        part.before + stretch.t1,
                        stretch.density,
                        inside,
                        run.stretches_end,
                    );
                    run.stretches_end = self.stretches.len() as u32;
                    true
                });
                if run.stretches_end > 0 {
                    self.depth += run.coefficients * inside;
                    self.proposal_depth += run.k * inside;
                    self.runs.push(run);
                }
            }
            true
        });
        self.surface = surface.map(|point| PrimarySurface {
            bsdf: volumes.scene.bsdf(&point),
            wo: point.shading.to_local(-ray.direction),
            point,
            medium,
        });
    }

    /// One more stretch of a run that has some if `run_end` is not 0; empty ones become one.
    fn push(&mut self, end: f64, density: f32, inside: f64, run_end: u32) {
        let stretch = Stretch {
            end: end as f32,
            density,
            inside: inside as f32,
        };
        match self.stretches.last_mut() {
            Some(last) if run_end > 0 && density == 0.0 && last.density == 0.0 => *last = stretch,
            _ => self.stretches.push(stretch),
        }
    }

    /// Whether nothing can scatter along the ray.
    pub fn is_empty(&self) -> bool {
        self.surface.is_none() && !(self.proposal_depth > 0.0)
    }

    /// The runs with their stretches.
    fn each_run(&self) -> impl Iterator<Item = (&Run, &[Stretch])> {
        let mut first = 0;
        self.runs.iter().map(move |run| {
            let end = run.stretches_end as usize;
            let stretches = &self.stretches[first..end];
            first = end;
            (run, stretches)
        })
    }

    /// The medium at a distance along the ray, and `∫ σ*_t` up to there by channel; `None` where there is no medium.
    pub fn depth_at(&self, distance: f32) -> Option<(u32, DVec3)> {
        self.each_run().find_map(|(run, stretches)| {
            if !(distance >= run.start) {
                return None;
            }
            let place = stretches.partition_point(|stretch| stretch.end < distance);
            let stretch = stretches.get(place)?;
            let (start, before) = match place.checked_sub(1) {
                Some(previous) => (stretches[previous].end, stretches[previous].inside),
                None => (run.start, 0.0),
            };
            let inside = f64::from(before) + f64::from(stretch.density) * f64::from(distance - start);
            (stretch.density > 0.0).then(|| (run.medium, run.depth_before + run.coefficients * inside))
        })
    }

    /// `∫ σ*_t` up to the surface.
    pub fn depth_of_surface(&self) -> DVec3 {
        self.depth
    }

    /// The surface that the ray ends on.
    pub fn surface_vertex<'v>(&self) -> Option<Vertex<'v>> {
        self.surface.as_ref().map(|surface| Vertex::Surface {
            point: surface.point,
            bsdf: surface.bsdf,
            wo: surface.wo,
            medium: surface.medium,
        })
    }

    /// The surface point that the ray ends on.
    pub fn surface_point(&self) -> Option<&SurfacePoint> {
        self.surface.as_ref().map(|surface| &surface.point)
    }

    /// Puts a first vertex by a free flight through the coarse density, by `u` in [0, 1).
    pub fn fly(&self, u: f64) -> First {
        let target = -(-u).ln_1p();
        if target < self.proposal_depth
            && let Some(first) = self.collide(target)
        {
            return first;
        }
        match &self.surface {
            Some(_) => First::Surface {
                pdf: (-self.proposal_depth).exp(),
            },
            None => First::Nowhere,
        }
    }

    /// As [`VolumePixel::fly`], given that there is a collision: `p(z)` made up for the chance of none (velocity resampling, Lin 2022
    /// §5.5.2). A distance only.
    pub fn forced_collision(&self, u: f64) -> Option<f32> {
        // 1 − e^{−τ} of the way to a sure collision.
        let target = -(u * (-self.proposal_depth).exp_m1()).ln_1p();
        match self.collide(target)? {
            First::Medium { distance, .. } => Some(distance),
            _ => None,
        }
    }

    /// Where the proposals' depth is `target`.
    fn collide(&self, target: f64) -> Option<First> {
        self.each_run().find_map(|(run, stretches)| {
            let wanted = (target - run.proposal_before) / run.k;
            let place = stretches.partition_point(|stretch| f64::from(stretch.inside) <= wanted);
            let stretch = stretches.get(place)?;
            let (start, before) = match place.checked_sub(1) {
                Some(previous) => (stretches[previous].end, stretches[previous].inside),
                None => (run.start, 0.0),
            };
            let density = f64::from(stretch.density);
            let distance = (f64::from(start) + (wanted - f64::from(before)) / density) as f32;
            // Rounding must not lead out of the stretch.
            let distance = distance.clamp(start, stretch.end);
            let inside = f64::from(before) + density * f64::from(distance - start);
            Some(First::Medium {
                distance,
                pdf: run.k * density * (-(run.proposal_before + run.k * inside)).exp(),
            })
        })
    }
}

impl Domain for VolumePixel {
    type Sample = VolumePath;
    type Space = PathCoordinates;

    /// Samples carry the target that they have in their pixel.
    fn target(&self, x: &VolumePath) -> f64 {
        f64::from(x.target)
    }
}

/// A pixel's path with its weight, whose size nothing bounds.
pub(crate) type VolumeReservoir = DomainReservoir<VolumePixel, f64>;

//! A pixel of one frame as a domain of paths through volumes.

use super::through::{Met, Volumes, optical_depth, proposal_extinction};
use super::vertex::Vertex;
use lightshed_resampling::{Domain, DomainReservoir};
use lightshed_scene::glam::{DVec3, Vec2, Vec3};
use lightshed_scene::volume::Interval;
use lightshed_scene::{Bsdf, EmitterEndpoint, Ray, SurfacePoint};
use lightshed_shift::{PathCoordinates, VolumePathDomain};

/// The part of the camera ray in one medium that holds some of it, in bins of equal length and
/// constant density `ρ*`.
#[derive(Clone, Copy, Debug)]
struct Run {
    medium: u32,
    /// Distance at which it begins.
    start: f32,
    /// Length of a bin.
    step: f32,
    /// The end of its bins.
    bins_end: u32,
    /// The proposals' coefficient.
    k: f64,
    /// `∫ σ*_t / ∫ ρ*` by channel, and before its beginning `∫ σ*_t`.
    coefficients: DVec3,
    depth_before: DVec3,
    /// The latter of the proposals' coefficient.
    proposal_before: f64,
}

impl Run {
    /// `∫ ρ* dt` from the beginning up to bin number `place`, and within it.
    fn bin(bins: &[f32], place: usize) -> (f64, f64) {
        let before = place.checked_sub(1).map_or(0.0, |previous| bins[previous]);
        (f64::from(before), f64::from(bins[place]) - f64::from(before))
    }
}

/// A pixel and, for its walks of one frame, a camera ray with what lies along it at the coarse
/// level of proposals.
pub(crate) struct VolumePixel {
    /// Of an odd frame.
    pub odd_frame: bool,
    /// Its least corner on the film, in pixels.
    pub corner: Vec2,
    /// Where the camera ray of its walks is in it, and on the lens.
    pub film: Vec2,
    pub lens: [f32; 2],
    pub ray: Ray,
    /// What the camera is in.
    pub medium: Option<u32>,
    runs: Vec<Run>,
    /// `∫ ρ* dt` from the beginning of the run to the end of each bin.
    bins: Vec<f32>,
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
            odd_frame: false,
            corner: Vec2::ZERO,
            film: Vec2::ZERO,
            lens: [0.5; 2],
            ray: Ray::new(Vec3::ZERO, Vec3::Z),
            medium: None,
            runs: Vec::new(),
            bins: Vec::new(),
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
        self.bins.clear();
        (self.ray, self.medium) = (ray, medium);
        (self.depth, self.proposal_depth) = (DVec3::ZERO, 0.0);
        let (surface, medium) = volumes.parts(&ray, medium, |part| {
            if let Some(index) = part.medium {
                let (medium, coarse) = volumes.medium(index);
                let interval = Interval {
                    t0: 0.0,
                    t1: part.t_max,
                };
                let first = self.bins.len();
                if let Some(range) = coarse.along(medium, &part.ray, interval, level, &mut self.bins) {
                    let inside = f64::from(self.bins.last().copied().unwrap_or(0.0));
                    let run = Run {
                        medium: index,
                        start: (part.before + f64::from(range.t0)) as f32,
                        step: (range.t1 - range.t0) / (self.bins.len() - first) as f32,
                        bins_end: self.bins.len() as u32,
                        k: f64::from(proposal_extinction(medium)),
                        coefficients: optical_depth(medium, &part.ray, 1.0),
                        depth_before: self.depth,
                        proposal_before: self.proposal_depth,
                    };
                    self.depth += optical_depth(medium, &part.ray, inside);
                    if run.k > 0.0 {
                        self.proposal_depth += run.k * inside;
                    }
                    self.runs.push(run);
                }
            }
            true
        });
        self.surface = surface.map(|Met { point, .. }| PrimarySurface {
            bsdf: volumes.scene.bsdf(&point),
            wo: point.shading.to_local(-ray.direction),
            point,
            medium,
        });
    }

    /// Whether nothing can scatter along the ray.
    pub fn is_empty(&self) -> bool {
        self.surface.is_none() && !(self.proposal_depth > 0.0)
    }

    /// The runs with their bins.
    fn each_run(&self) -> impl Iterator<Item = (&Run, &[f32])> {
        let mut first = 0;
        self.runs.iter().map(move |run| {
            let end = run.bins_end as usize;
            let bins = &self.bins[first..end];
            first = end;
            (run, bins)
        })
    }

    /// The medium at a distance along the ray, and `∫ σ*_t` up to there by channel; `None` where
    /// there is no medium.
    #[inline]
    pub fn depth_at(&self, distance: f32) -> Option<(u32, DVec3)> {
        self.each_run().find_map(|(run, bins)| {
            let along = distance - run.start;
            if !(along >= 0.0) {
                return None;
            }
            // An endless run has one bin.
            let place = if bins.len() > 1 {
                (along / run.step) as usize
            } else {
                0
            };
            let place = place.min(bins.len() - 1);
            let (before, within) = Run::bin(bins, place);
            let part = f64::from(along) / f64::from(run.step) - place as f64;
            // But for rounding where flights end.
            if !(within > 0.0 && part < 1.0 + 1e-3) {
                return None;
            }
            let inside = if within < f64::INFINITY {
                before + within * part.min(1.0)
            } else {
                f64::from(along)
            };
            let depth = if inside > 0.0 {
                run.coefficients * inside
            } else {
                DVec3::ZERO
            };
            Some((run.medium, run.depth_before + depth))
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

    /// As [`VolumePixel::fly`], given that there is a collision: `p(z)` made up for the chance of
    /// none (velocity resampling, Lin 2022 §5.5.2). A distance only.
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
        self.each_run().find_map(|(run, bins)| {
            let wanted = (target - run.proposal_before) / run.k;
            let place = bins.partition_point(|&inside| f64::from(inside) <= wanted);
            if place == bins.len() {
                return None;
            }
            let (before, within) = Run::bin(bins, place);
            let step = f64::from(run.step);
            let density = if within < f64::INFINITY {
                within / step
            } else {
                1.0
            };
            // Rounding must not lead out of the bin.
            let past = ((wanted - before) / density).clamp(0.0, step);
            let begin = if place > 0 { place as f64 * step } else { 0.0 };
            let distance = (f64::from(run.start) + begin + past) as f32;
            let inside = before + density * past;
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

impl VolumePathDomain for VolumePixel {
    type Endpoint = EmitterEndpoint;

    fn is_odd(&self) -> bool {
        self.odd_frame
    }

    fn is_same_pixel(&self, other: &Self) -> bool {
        self.corner == other.corner
    }
}

/// A path through a scene's media.
pub(crate) type VolumePath = lightshed_shift::VolumePath<EmitterEndpoint>;

/// A pixel's path with its weight, whose size nothing bounds.
pub(crate) type VolumeReservoir = DomainReservoir<VolumePixel, f64>;

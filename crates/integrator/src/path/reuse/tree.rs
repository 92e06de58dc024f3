//! What path trees of pixels have found.

use super::points::{Points, vector};
use crate::path::scattering::SurfaceVertex;
use lightshed_film::MAX_BATCH;
use lightshed_lanes::Column;
use lightshed_sampling::{Density, SolidAngle, power_heuristic};
use lightshed_scene::{HitBatch, RayBatch, Rgb, Scene, luminance};
use std::f32::consts::FRAC_1_PI;

/// The light that the path trees of up to [`MAX_BATCH`] pixels found.
pub struct Trees {
    /// What only the pixel of each tree can use.
    pub own: [Column; 3],
    /// `x₁`, by tree.
    pub first: Vertex,
    /// `x₂`, by a place of its own.
    pub second: Vertex,
    /// The place of each tree's `x₂`, if other pixels can reach it; otherwise [`Trees::NOWHERE`].
    pub second_of: [u8; MAX_BATCH],
    /// By the place of `x₂`.
    pub behind: Behind,
}

/// Vertices of trees: those that are shaded in lanes, and the others.
pub struct Vertex {
    /// The rays that met them, and where.
    pub rays: RayBatch,
    pub hits: HitBatch,
    pub points: Points,
    /// Those not shaded in lanes, as bits.
    pub alone: u64,
    /// Of these, and of all others that they meet.
    pub known: Vec<Option<SurfaceVertex>>,
}

/// Trees from `x₂` on, as sampled, without the scattering at `x₂`; sets are bits.
pub struct Behind {
    /// `x₂` that see an emitter that was sampled there.
    pub lit: u64,
    /// Towards the emitters, in the shading frames of `x₂`.
    pub light: [Column; 3],
    /// `L_e / p_e`.
    pub light_weight: [Column; 3],
    /// `p_e`, in the solid-angle measure.
    pub light_pdf: Column,
    pub light_is_delta: u64,
    /// `x₂` from which a direction was sampled that others can use, too …
    pub scattered: u64,
    /// … and these directions, in the shading frames.
    pub wi: [Column; 3],
    /// By tree: radiance emitted from there, and the density with which the emitter sample would
    /// have found it.
    pub met: [Option<(Rgb, f32)>; MAX_BATCH],
    /// By tree: radiance reflected from there.
    pub beyond: [Rgb; MAX_BATCH],
}

const ZEROS: [Column; 3] = [const { Column::splat(0.0) }; 3];

impl Vertex {
    fn new() -> Self {
        Self {
            rays: RayBatch::NOWHERE,
            hits: HitBatch::NONE,
            points: Points::NONE,
            alone: 0,
            known: Vec::new(),
        }
    }

    fn clear(&mut self) {
        self.points.clear();
        self.alone = 0;
        self.known.clear();
        self.known.resize_with(MAX_BATCH, || None);
    }

    /// Looks at a vertex that is there as other code than lanes does.
    pub fn know(&mut self, scene: &Scene, place: usize) {
        let Some(known) = self.known.get_mut(place) else {
            return;
        };
        if known.is_none()
            && let Some(hit) = self.hits.get(place)
        {
            let ray = self.rays.get(place);
            *known = Some(SurfaceVertex::new(scene, &ray, scene.surface(&ray, &hit)));
        }
    }
}

impl Trees {
    /// No place.
    pub const NOWHERE: u8 = u8::MAX;

    pub fn new() -> Self {
        Self {
            own: ZEROS,
            first: Vertex::new(),
            second: Vertex::new(),
            second_of: [Self::NOWHERE; MAX_BATCH],
            behind: Behind {
                lit: 0,
                light: ZEROS,
                light_weight: ZEROS,
                light_pdf: Column::splat(0.0),
                light_is_delta: 0,
                scattered: 0,
                wi: ZEROS,
                met: [None; MAX_BATCH],
                beyond: [Rgb::ZERO; MAX_BATCH],
            },
        }
    }

    pub fn clear(&mut self) {
        self.own = ZEROS;
        self.first.clear();
        self.second.clear();
        self.second_of = [Self::NOWHERE; MAX_BATCH];
        let behind = &mut self.behind;
        (behind.lit, behind.light_is_delta, behind.scattered) = (0, 0, 0);
        (behind.met, behind.beyond) = ([None; MAX_BATCH], [Rgb::ZERO; MAX_BATCH]);
    }

    /// What only the pixel of a tree can use.
    pub fn own(&self, tree: usize) -> Rgb {
        vector(&self.own, tree)
    }

    /// Forgets what only their pixels can use, of the trees of these bits.
    pub fn forget_own(&mut self, mut trees: u64) {
        while trees != 0 {
            for column in &mut self.own {
                column.set(trees.trailing_zeros() as usize, 0.0);
            }
            trees &= trees - 1;
        }
    }

    /// Adds light for the pixel of a tree.
    #[inline(always)]
    pub fn add_own(&mut self, tree: usize, light: Rgb) {
        for (column, light) in self.own.iter_mut().zip(light.to_array()) {
            column.set(tree, column.get(tree) + light);
        }
    }

    /// The place of a tree's `x₂`, if other pixels can reach it.
    #[inline(always)]
    pub fn second(&self, tree: usize) -> Option<usize> {
        let place = self.second_of[tree % MAX_BATCH];
        (place != Self::NOWHERE).then_some(usize::from(place))
    }

    /// [`Trees::brightness`] of the trees of a square's pixels whose `x₂` others can reach, with
    /// their batches, their numbers there, and the places of `x₂`.
    pub fn all_bright(batches: &[Self], pixels: usize) -> impl Iterator<Item = ([usize; 3], [f32; 2])> + '_ {
        batches.iter().enumerate().flat_map(move |(batch, trees)| {
            let count = MAX_BATCH.min(pixels - batch * MAX_BATCH);
            let reachable = (0..count).filter_map(|tree| Some((tree, trees.second(tree)?)));
            reachable.map(move |(tree, place)| ([batch, tree, place], trees.brightness(tree, place)))
        })
    }

    /// About the radiance that an `x₂` sends on, of what was found by the emitter sample there and
    /// along the sampled direction. It is the same for all pixels that could have made the path, so
    /// the surface counts as white and diffuse. 0 if there is nothing to share.
    fn brightness(&self, tree: usize, place: usize) -> [f32; 2] {
        let (behind, tree) = (&self.behind, tree % MAX_BATCH);
        let is_lit = behind.lit >> place & 1 == 1;
        let is_scattered = behind.scattered >> place & 1 == 1;
        let pdf = |wi: &[Column; 3]| {
            Density::<SolidAngle>::new((wi[2].get(place) * FRAC_1_PI).abs().max(f32::MIN_POSITIVE))
        };
        let found = |is_there: bool, light: Rgb| match is_there && light != Rgb::ZERO {
            // Not zero: something is there.
            true => luminance(light).max(f32::MIN_POSITIVE),
            false => 0.0,
        };
        let by_pdf = pdf(&behind.light);
        let mis = match behind.light_is_delta >> place & 1 == 1 {
            true => 1.0,
            false => power_heuristic(Density::new(behind.light_pdf.get(place)), by_pdf),
        };
        let light = vector(&behind.light_weight, place) * (by_pdf.value() * mis);
        let met = match behind.met[tree] {
            Some((met, pdf_solid_angle)) => {
                met * power_heuristic(pdf(&behind.wi), Density::new(pdf_solid_angle))
            }
            None => Rgb::ZERO,
        };
        [
            found(is_lit, light),
            found(is_scattered, met + behind.beyond[tree]),
        ]
    }
}

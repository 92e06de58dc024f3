//! Selection of lights for shadow tests, in the pass that sums their light.

use super::level::{cells_around, finer_around};
use super::query::{GridQuery, Influence};
use super::{LightId, LightingGrid};
use glam::Vec3;
use lightshed_resampling::JumpSelection;
use lightshed_sampling::luminance;
use lightshed_sampling::rand::Rng;

/// Most shadow samples at a point.
pub const MAX_SHADOW_SAMPLES: usize = 16;

/// Light at a point without occlusion, and lights with which to test occlusion.
#[derive(Clone, Debug)]
pub struct Gathered {
    /// `U = Σ_i f_i`, over all lights.
    pub unshadowed: Vec3,
    samples: [JumpSelection<LightId>; MAX_SHADOW_SAMPLES],
    count: usize,
}

impl Gathered {
    /// The selected lights, independent of each other, each with probability
    /// `Y(f_i) / Σ_j Y(f_j)`, `Y` the luminance: as many as requested, or none if no light
    /// arrives.
    ///
    /// With `V` the visibility of the lights, the mean of `V` over the samples estimates
    /// `Σ Y(f_i) V_i / Σ Y(f_i)` without bias, and `U` times it is the *ratio estimator* of the
    /// shadowed sum (Lin 2022 §3.3.3): unbiased for lights of one colour; where colours differ, it
    /// gives shadows the colour of the whole.
    pub fn samples(&self) -> impl Iterator<Item = LightId> + '_ {
        self.samples[..self.count]
            .iter()
            .filter_map(|selection| selection.item().copied())
    }
}

impl LightingGrid {
    /// Sums `f_i = response(influence_i)` over the lights that contribute to `point`, and selects
    /// `shadow_samples` (at most [`MAX_SHADOW_SAMPLES`]) among them in proportion to the luminance
    /// of `f_i`, all in one pass and constant memory.
    ///
    /// `response` returns the light that arrives, in linear RGB and not negative: for irradiance
    /// `intensity · cosθ / distance²`. Random numbers are drawn only when a selection changes,
    /// about `ln M` times a sample for `M` lights.
    #[inline]
    pub fn gather<R: Rng + ?Sized>(
        &self,
        point: Vec3,
        query: &GridQuery,
        shadow_samples: usize,
        rng: &mut R,
        mut response: impl FnMut(&Influence) -> Vec3,
    ) -> Gathered {
        let mut gathered = Gathered {
            unshadowed: Vec3::ZERO,
            samples: [const { JumpSelection::new() }; MAX_SHADOW_SAMPLES],
            count: shadow_samples.min(MAX_SHADOW_SAMPLES),
        };
        let Gathered {
            unshadowed,
            samples,
            count,
        } = &mut gathered;
        let samples = &mut samples[..*count];
        self.visit(point, query, |influence| {
            let light = response(influence);
            *unshadowed += light;
            let weight = f64::from(luminance(light));
            for selection in samples.iter_mut() {
                selection.offer(influence.id, weight, rng);
            }
        });
        *unshadowed = unshadowed.min(Vec3::splat(f32::MAX));
        gathered
    }

    /// A position within the extent of a light of the hierarchy, by three uniform numbers in [0,
    /// 1): uniform in the box around the illumination centre that has the standard deviations of
    /// the lights' positions. Rays to such positions see the light as an area (Lin 2022 §3.3.3).
    /// The box ignores surfaces: it may reach through a wall that is not parallel to an axis, which
    /// [`LightingGrid::represented_light`] does not.
    pub fn shadow_target(&self, id: LightId, u: [f32; 3]) -> Vec3 {
        let index = id.index as usize;
        match self.grid_lights(id.level).get(index) {
            Some(light) => light.position + light.spread * 3.0f32.sqrt() * (2.0 * Vec3::from(u) - 1.0),
            None => self.sorted.get(index).map_or(Vec3::ZERO, |light| light.position),
        }
    }

    /// One of the lights that a light of the hierarchy represents, as an index into
    /// [`LightingGrid::lights`].
    ///
    /// Selected from level to level down to the lights: a vertex or light in proportion to its
    /// share, its luminance, and its emission towards `point`. With trilinear shares that nest,
    /// this is about in proportion to `w_i L_i e_i`, where `w_i` is the light's share in the
    /// vertex. So a shadow ray ends on a surface that really emits towards `point`; the
    /// illumination centre of a curved or cornered surface lies in the air or inside an object.
    pub fn represented_light<R: Rng + ?Sized>(&self, id: LightId, point: Vec3, rng: &mut R) -> u32 {
        // Selects something even if nothing contributes to the point.
        const LEAST: f64 = 1e-6;
        let towards = |position: Vec3| (point - position).normalize_or_zero();
        if id.level == 0 || id.level > self.level_count {
            return self.pairs.get(id.index as usize).map_or(0, |pair| pair.index());
        }
        let mut level = id.level;
        let mut vertex = self.levels[level as usize - 1].vertex_of(id);
        while level > 1 {
            level -= 1;
            let finer = &self.levels[level as usize - 1];
            let mut chosen = JumpSelection::new();
            for (place, half_steps) in finer_around(vertex, &finer.rows) {
                let light = &finer.lights[place];
                let emission = f64::from(light.emission(towards(light.position)));
                let share = half_steps
                    .map(|step| if step == 0 { 1.0 } else { 0.5 })
                    .into_iter()
                    .product::<f64>();
                let weight = share * finer.moments[place].weight * (emission + LEAST);
                chosen.offer(half_steps, weight, rng);
            }
            let step = chosen.into_item().unwrap_or([0; 3]);
            for (vertex, step) in vertex.iter_mut().zip(step) {
                *vertex = (2 * *vertex).saturating_add_signed(step);
            }
        }
        let frame = self.frame(1);
        let mut chosen = JumpSelection::new();
        let at = glam::DVec3::from(vertex.map(f64::from));
        for cell in cells_around(vertex, &self.cells) {
            for place in self.cells.items(cell) {
                let light = &self.sorted[place];
                let share = (1.0 - (frame.in_cells(light.position) - at).abs()).max(glam::DVec3::ZERO);
                let emission = f64::from(light.emission(towards(light.position)));
                let weight = share.x * share.y * share.z * f64::from(luminance(light.intensity));
                chosen.offer(place, weight * (emission + LEAST), rng);
            }
        }
        let place = chosen.into_item().unwrap_or(0);
        self.pairs.get(place).map_or(0, |pair| pair.index())
    }
}

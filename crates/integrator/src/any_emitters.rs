//! Both ways to choose emitters in one type.

use crate::emitter_sampler::{ChosenLanes, EmitterSampler};
use crate::light_selection::LightSelection;
use lightshed_lanes::{LANES, Lanes, Vec3Lanes};
use lightshed_lights::ShadingPoint;
use lightshed_sampling::{Density, SolidAngle};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{
    EmitterConnection, EmitterEndpoint, EmitterLanes, EmitterSample, EmittersByPower, EnvironmentChoice,
    SkySampling, SurfacePoint,
};
use std::sync::Arc;

/// The emitter sampler that options ask for, known when the program runs; each function is that of
/// the sampler, bit for bit.
///
/// A method with this sampler is compiled once, whatever the options ask for.
#[derive(Clone)]
pub enum AnyEmitters<'a> {
    /// By power, whatever the point.
    Power(EmittersByPower<'a>),
    /// For the point that is lit.
    Selection(Arc<LightSelection<'a>>),
}

impl AnyEmitters<'_> {
    /// The same, with the environment sampled in this way; what has been built or learnt is shared.
    #[must_use]
    pub fn with_sky(&self, sky: SkySampling) -> Self {
        match self {
            Self::Power(emitters) => Self::Power(emitters.with_sky(sky)),
            Self::Selection(selection) => Self::Selection(Arc::new(selection.with_sky(sky))),
        }
    }
}

/// Each arm is compiled for its sampler, with its site.
macro_rules! with_emitters {
    ($emitters:expr, $site:expr, ($found:ident, $at:ident) => $do:expr) => {
        match $emitters {
            AnyEmitters::Power($found) => {
                let $at = &();
                $do
            }
            AnyEmitters::Selection(selection) => {
                let ($found, $at) = (&**selection, $site);
                $do
            }
        }
    };
}

impl EmitterSampler for AnyEmitters<'_> {
    type Site = ShadingPoint;

    #[inline]
    fn uses_site(&self) -> bool {
        match self {
            Self::Power(_) => false,
            Self::Selection(selection) => selection.uses_site(),
        }
    }

    #[inline]
    fn uses_gloss(&self) -> bool {
        match self {
            Self::Power(_) => false,
            Self::Selection(selection) => selection.uses_gloss(),
        }
    }

    #[inline]
    fn site(&self, at: impl FnOnce() -> ShadingPoint) -> ShadingPoint {
        match self {
            Self::Power(_) => ShadingPoint::default(),
            Self::Selection(selection) => selection.site(at),
        }
    }

    #[inline]
    fn sample(&self, from: Vec3, site: &ShadingPoint, u_select: u64, u: [f32; 2]) -> Option<EmitterSample> {
        with_emitters!(self, site, (emitters, at) => EmitterSampler::sample(emitters, from, at, u_select, u))
    }

    #[inline]
    fn pdf(&self, from: Vec3, site: &ShadingPoint, point: &SurfacePoint) -> Density<SolidAngle> {
        with_emitters!(self, site, (emitters, at) => EmitterSampler::pdf(emitters, from, at, point))
    }

    #[inline]
    fn pdf_environment(&self, from: Vec3, site: &ShadingPoint, direction: Vec3) -> Density<SolidAngle> {
        with_emitters!(self, site, (emitters, at) => {
            EmitterSampler::pdf_environment(emitters, from, at, direction)
        })
    }

    #[inline]
    fn environment_choice(&self) -> Option<EnvironmentChoice> {
        match self {
            Self::Power(emitters) => Some(emitters.environment_choice()),
            Self::Selection(emitters) => emitters.environment_choice(),
        }
    }

    #[inline]
    fn sample_endpoint(
        &self,
        from: Vec3,
        site: &ShadingPoint,
        u_select: u64,
        u: [f32; 2],
    ) -> Option<(EmitterEndpoint, f32)> {
        with_emitters!(self, site, (emitters, at) => {
            EmitterSampler::sample_endpoint(emitters, from, at, u_select, u)
        })
    }

    #[inline]
    fn endpoint_pdf(&self, from: Vec3, site: &ShadingPoint, point: &SurfacePoint) -> Density<SolidAngle> {
        with_emitters!(self, site, (emitters, at) => EmitterSampler::endpoint_pdf(emitters, from, at, point))
    }

    #[inline]
    fn endpoint_probability(&self, from: Vec3, site: &ShadingPoint, endpoint: &EmitterEndpoint) -> f32 {
        with_emitters!(self, site, (emitters, at) => {
            EmitterSampler::endpoint_probability(emitters, from, at, endpoint)
        })
    }

    #[inline]
    fn connect_chosen(
        &self,
        from: Vec3,
        endpoint: &EmitterEndpoint,
        probability: f32,
    ) -> Option<EmitterConnection> {
        match self {
            Self::Power(emitters) => emitters.connect_chosen(from, endpoint, probability),
            Self::Selection(emitters) => emitters.connect_chosen(from, endpoint, probability),
        }
    }

    #[inline]
    fn connect(
        &self,
        from: Vec3,
        site: &ShadingPoint,
        endpoint: &EmitterEndpoint,
    ) -> Option<EmitterConnection> {
        with_emitters!(self, site, (emitters, at) => EmitterSampler::connect(emitters, from, at, endpoint))
    }

    #[inline]
    fn sample_many(
        &self,
        from: Vec3,
        site: &ShadingPoint,
        u_select: &[u64],
        u: impl FnMut() -> [f32; 2],
        take: impl FnMut(EmitterSample),
    ) {
        with_emitters!(self, site, (emitters, at) => {
            EmitterSampler::sample_many(emitters, from, at, u_select, u, take);
        });
    }

    #[inline(always)]
    fn sample_lanes<L: Lanes>(
        &self,
        from: Vec3Lanes<L>,
        sites: &[ShadingPoint; LANES],
        u_select: [L::Words; 2],
        u: [L; 2],
        wanted: u32,
    ) -> EmitterLanes<L> {
        match self {
            Self::Power(emitters) => {
                EmitterSampler::sample_lanes(emitters, from, &[(); LANES], u_select, u, wanted)
            }
            Self::Selection(emitters) => emitters.sample_lanes(from, sites, u_select, u, wanted),
        }
    }

    #[inline(always)]
    fn choose_lanes(
        &self,
        sites: &[ShadingPoint; LANES],
        u_select: &[[[u32; LANES]; 2]],
        wanted: u32,
        chosen: &mut [ChosenLanes],
    ) -> bool {
        match self {
            Self::Power(_) => false,
            Self::Selection(emitters) => emitters.choose_lanes(sites, u_select, wanted, chosen),
        }
    }

    #[inline(always)]
    fn sample_chosen_lanes<L: Lanes>(
        &self,
        from: Vec3Lanes<L>,
        chosen: &ChosenLanes,
        u: [L; 2],
    ) -> EmitterLanes<L> {
        match self {
            Self::Power(emitters) => EmitterSampler::sample_chosen_lanes(emitters, from, chosen, u),
            Self::Selection(emitters) => emitters.sample_chosen_lanes(from, chosen, u),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LightChoosing, PathTracer};
    use lightshed_film::{PixelEstimator, SampleId};
    use lightshed_scene::{Rgb, Scene, builtin};

    /// Samples of pixels of a row, in a batch and each alone.
    fn samples<S: EmitterSampler + Send>(scene: &Scene, sampler: S) -> Vec<Rgb> {
        let tracer = PathTracer::new(scene, sampler);
        // In the lower half of the image, where the floor is.
        let settings = scene.settings();
        let ids: [SampleId; 64] = std::array::from_fn(|i| SampleId {
            x: i as u32 % settings.width,
            y: settings.height * 3 / 4,
            index: 1,
        });
        let mut values = vec![Rgb::ZERO; ids.len()];
        tracer.sample_many(&ids, 7, &mut values);
        values.extend(ids.iter().map(|id| tracer.sample(id.x, id.y, id.index, 7)));
        values
    }

    #[test]
    fn each_way_to_choose_gives_its_own_bits() {
        let scene = Scene::new(&builtin::many_lights()).unwrap();
        let power = scene.emitters_by_power();
        let tree = Arc::new(LightSelection::new(&scene, LightChoosing::Bvh).unwrap());
        let (by_power, by_tree) = (samples(&scene, power), samples(&scene, &*tree));
        assert_ne!(by_power, by_tree);
        assert_eq!(samples(&scene, AnyEmitters::Power(power)), by_power);
        assert_eq!(samples(&scene, AnyEmitters::Selection(tree)), by_tree);
    }
}

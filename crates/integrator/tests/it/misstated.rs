//! A sampler of emitters with planted faults.

use lightshed_integrator::EmitterSampler;
use lightshed_lights::ShadingPoint;
use lightshed_sampling::{Density, SolidAngle};
use lightshed_scene::glam::Vec3;
use lightshed_scene::{EmitterConnection, EmitterEndpoint, EmitterSample, SurfacePoint};

/// A sampler that states something wrong of itself.
pub struct Misstated<'a, S> {
    /// The sampler.
    pub of: &'a S,
    /// The sampler whose densities of directions towards the environment are stated.
    pub environment_of: &'a S,
    /// What stated probabilities of endpoints are multiplied by.
    pub factor: f32,
    /// The number of which numbers for the choice of an emitter are cut to multiples.
    pub step: u64,
}

impl<'a, S> Misstated<'a, S> {
    /// Without a fault.
    pub fn nothing(of: &'a S) -> Self {
        Self {
            of,
            environment_of: of,
            factor: 1.0,
            step: 1,
        }
    }
}

impl<S: EmitterSampler> EmitterSampler for Misstated<'_, S> {
    type Site = S::Site;

    fn site(&self, at: impl FnOnce() -> ShadingPoint) -> S::Site {
        self.of.site(at)
    }

    fn sample(&self, from: Vec3, site: &S::Site, u_select: u64, u: [f32; 2]) -> Option<EmitterSample> {
        self.of.sample(from, site, u_select, u)
    }

    fn pdf(&self, from: Vec3, site: &S::Site, point: &SurfacePoint) -> Density<SolidAngle> {
        self.of.pdf(from, site, point)
    }

    fn pdf_environment(&self, from: Vec3, site: &S::Site, direction: Vec3) -> Density<SolidAngle> {
        self.environment_of.pdf_environment(from, site, direction)
    }

    fn sample_endpoint(
        &self,
        from: Vec3,
        site: &S::Site,
        u_select: u64,
        u: [f32; 2],
    ) -> Option<(EmitterEndpoint, f32)> {
        self.of
            .sample_endpoint(from, site, u_select - u_select % self.step, u)
    }

    fn endpoint_pdf(&self, from: Vec3, site: &S::Site, point: &SurfacePoint) -> Density<SolidAngle> {
        self.of.endpoint_pdf(from, site, point)
    }

    fn endpoint_probability(&self, from: Vec3, site: &S::Site, endpoint: &EmitterEndpoint) -> f32 {
        self.of.endpoint_probability(from, site, endpoint)
    }

    fn connect_chosen(
        &self,
        from: Vec3,
        endpoint: &EmitterEndpoint,
        probability: f32,
    ) -> Option<EmitterConnection> {
        let connection = self.of.connect_chosen(from, endpoint, probability)?;
        Some(connection.chosen_with(self.factor))
    }
}

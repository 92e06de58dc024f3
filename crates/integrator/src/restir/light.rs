//! Direct light as a domain for each pixel: endpoints on emitters, seen from the pixel's surface.
//!
//! The sample of a pixel is an endpoint `e` ([`EmitterEndpoint`]); its domain has the target
//!
//! > `p̂(e) = Y(f(ω_o, ω) L_e(ω) |cos θ| |dω/de| V)`,
//!
//! with `ω` towards `e`, `Y` the luminance and, if visibility belongs to the target, `V` the
//! visibility. Endpoints do not depend on the pixel, so the shift between two pixels is the
//! identity with Jacobian 1; only the target differs.

use super::primary::Primary;
use lightshed_film::{RayKind, RayTally};
use lightshed_resampling::{
    Domain, DomainReservoir, Jacobian, Pulled, ShiftMapping, Shifted, Space, Undefined,
};
use lightshed_scene::{EmitterConnection, EmitterEndpoint, Rgb, Scene, luminance};

/// The measure of endpoints: area, solid angle, and counting, each on its part of the space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct EndpointSpace;
impl Space for EndpointSpace {}

/// An endpoint and its contribution in the pixel of its domain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightSample {
    pub endpoint: EmitterEndpoint,
    /// `f L_e |cos θ| |dω/de|`, times `V` where that belongs to the target.
    pub value: Rgb,
}

impl LightSample {
    pub fn target(&self) -> f64 {
        f64::from(luminance(self.value))
    }

    /// Tells endpoints apart.
    pub fn key(&self) -> [u32; 4] {
        let bits = f32::to_bits;
        match self.endpoint {
            EmitterEndpoint::Surface {
                emitter,
                coordinates: [u, v],
            } => [0, emitter, bits(u), bits(v)],
            EmitterEndpoint::Environment { direction } => {
                [1, bits(direction.x), bits(direction.y), bits(direction.z)]
            }
            EmitterEndpoint::Delta { emitter } => [2, emitter, 0, 0],
        }
    }
}

/// A pixel of one frame that sees a surface, as direct light sees it.
impl Domain for Primary {
    type Sample = LightSample;
    type Space = EndpointSpace;

    /// Samples carry the value that they have in their domain.
    fn target(&self, x: &LightSample) -> f64 {
        x.target()
    }
}

/// A pixel's endpoint with its weight.
pub(crate) type DirectReservoir = DomainReservoir<Primary>;

/// Light from an endpoint at a surface, without occlusion.
pub(crate) struct Lit {
    pub connection: EmitterConnection,
    /// `f L_e |cos θ| |dω/de|`.
    pub value: Rgb,
    /// Density with which sampling the BSDF finds the endpoint, in the measure of endpoints; zero
    /// for those it cannot hit.
    pub pdf_bsdf: f32,
}

/// Light from `endpoint` at `primary`; `None` where there is none.
#[inline]
pub(crate) fn lit_by(scene: &Scene, primary: &Primary, endpoint: &EmitterEndpoint) -> Option<Lit> {
    let connection = scene.emitters().connect(primary.point.position, endpoint)?;
    lit_over(primary, connection)
}

/// Light that a connection brings.
#[inline]
pub(crate) fn lit_over(primary: &Primary, connection: EmitterConnection) -> Option<Lit> {
    let point = &primary.point;
    let wi = point.shading.to_local(connection.direction);
    let scattered = primary.bsdf.evaluate(primary.wo, wi);
    let per_endpoint = connection.solid_angle_per_endpoint;
    let value = scattered.value * connection.radiance * per_endpoint;
    let pdf_bsdf = if connection.is_delta {
        0.0
    } else {
        scattered.pdf.value() * per_endpoint
    };
    let lit = value != Rgb::ZERO && value.is_finite() && pdf_bsdf.is_finite();
    lit.then_some(Lit {
        connection,
        value,
        pdf_bsdf,
    })
}

/// Endpoints seen from another pixel: the identity, with the target of where they arrive.
pub(crate) struct SeenFrom<'a> {
    pub scene: &'a Scene,
    pub tally: &'a RayTally,
    /// Whether occlusion belongs to the target.
    pub visibility: bool,
}

impl SeenFrom<'_> {
    /// The contribution of `endpoint` in the pixel; a shadow ray is traced only if there is light
    /// to be blocked.
    pub fn value(&self, primary: &Primary, endpoint: &EmitterEndpoint) -> Rgb {
        let Some(lit) = lit_by(self.scene, primary, endpoint) else {
            return Rgb::ZERO;
        };
        if self.visibility {
            self.tally.add(RayKind::Emitter, 1);
            if self.scene.occluded(&lit.connection.shadow_ray(&primary.point)) {
                return Rgb::ZERO;
            }
        }
        lit.value
    }
}

impl ShiftMapping<Primary> for SeenFrom<'_> {
    fn shift(
        &self,
        x: &LightSample,
        _from: &Primary,
        to: &Primary,
    ) -> Result<Shifted<LightSample>, Undefined> {
        let sample = LightSample {
            endpoint: x.endpoint,
            value: self.value(to, &x.endpoint),
        };
        Ok(Shifted {
            sample,
            jacobian: Jacobian::IDENTITY,
            target: sample.target(),
        })
    }

    fn pull(&self, y: &LightSample, _to: &Primary, from: &Primary) -> Result<Pulled, Undefined> {
        Ok(Pulled {
            jacobian: Jacobian::IDENTITY,
            proxy: f64::from(luminance(self.value(from, &y.endpoint))),
        })
    }
}

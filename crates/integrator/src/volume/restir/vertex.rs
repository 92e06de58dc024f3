//! Vertices that scatter, on surfaces and in media.

use super::through::Volumes;
use lightshed_scene::glam::{DVec3, Vec2, Vec3};
use lightshed_scene::volume::{DensityField, PhaseFunction};
use lightshed_scene::{Bsdf, EmitterConnection, Emitters, Medium, MediumDensity, Ray, SurfacePoint};

/// What a delta lobe reflects or transmits to the viewer.
pub(crate) struct Reflected {
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Factor of the radiance that arrives from this direction.
    pub share: DVec3,
    /// Probability of choosing the lobe.
    pub probability: f64,
    /// Ratio of the indices of refraction, incident side over transmitted side.
    pub eta: f64,
}

/// A vertex that scatters.
// Not boxed: each vertex would cost an allocation.
#[allow(clippy::large_enum_variant)]
pub(crate) enum Vertex<'a> {
    Medium {
        medium: &'a Medium,
        index: u32,
        position: Vec3,
        /// Direction of the ray that led here.
        incoming: Vec3,
    },
    Surface {
        point: SurfacePoint,
        bsdf: Bsdf,
        wo: Vec3,
        /// The medium on the side that the ray came from.
        medium: Option<u32>,
    },
}

impl Vertex<'_> {
    pub fn position(&self) -> Vec3 {
        match self {
            Self::Medium { position, .. } => *position,
            Self::Surface { point, .. } => point.position,
        }
    }

    /// `σ_s ρ` or `f |cos θ|`, towards a unit direction.
    pub fn scattered(&self, direction: Vec3) -> DVec3 {
        match self {
            Self::Medium { medium, position, .. } => scattering(medium, *position) * self.phase(direction),
            Self::Surface { point, bsdf, wo, .. } => bsdf
                .evaluate(*wo, point.shading.to_local(direction))
                .value
                .as_dvec3(),
        }
    }

    /// The direction from which a delta lobe sends light to the viewer, and its factor. `None` in
    /// media and for other lobes.
    pub fn reflected(&self, lobe: u8) -> Option<Reflected> {
        let Self::Surface { point, bsdf, wo, .. } = self else {
            return None;
        };
        let sample = bsdf.sample_lobe(lobe, *wo, Vec2::ZERO)?;
        sample.is_delta.then(|| Reflected {
            direction: point.shading.to_world(sample.wi),
            share: sample.value.as_dvec3(),
            probability: f64::from(sample.probability),
            eta: f64::from(sample.eta),
        })
    }

    /// The surface's own emission towards the viewer; black in media.
    pub fn emitted(&self, emitters: &Emitters) -> DVec3 {
        match self {
            Self::Medium { .. } => DVec3::ZERO,
            Self::Surface { point, wo, .. } => {
                let arriving = -point.shading.to_world(*wo);
                emitters.radiance(point, arriving).as_dvec3()
            }
        }
    }

    /// Density with respect to solid angle of sampling a direction here, without delta lobes.
    pub fn pdf_towards(&self, direction: Vec3) -> f64 {
        match self {
            Self::Medium { .. } => self.phase(direction),
            Self::Surface { point, bsdf, wo, .. } => {
                f64::from(bsdf.evaluate(*wo, point.shading.to_local(direction)).pdf.value())
            }
        }
    }

    /// In media, the factor of [`Vertex::scattered`] that depends on where light came from, `ρ`.
    pub fn phase(&self, direction: Vec3) -> f64 {
        match self {
            Self::Medium { medium, incoming, .. } => {
                f64::from(medium.phase().phase_between(*incoming, direction))
            }
            Self::Surface { .. } => 1.0,
        }
    }

    /// Whether there are no delta lobes.
    pub fn is_wide(&self) -> bool {
        match self {
            Self::Medium { .. } => true,
            Self::Surface { bsdf, .. } => {
                bsdf.is_diffuse() || !(0..bsdf.lobe_count()).any(|lobe| bsdf.is_delta(lobe))
            }
        }
    }

    /// In media, the other factor, `σ_s`.
    pub fn scattering(&self) -> DVec3 {
        match self {
            Self::Medium { medium, position, .. } => scattering(medium, *position),
            Self::Surface { .. } => DVec3::ONE,
        }
    }

    /// The ray that leaves in a unit direction, and the medium that it enters.
    pub fn leave(&self, volumes: &Volumes<'_>, direction: Vec3) -> (Ray, Option<u32>) {
        match self {
            Self::Medium { position, index, .. } => (Ray::new(*position, direction), Some(*index)),
            Self::Surface { point, .. } => (point.spawn(direction), self.medium_towards(volumes, direction)),
        }
    }

    /// The segment to an endpoint, and the medium that it starts in.
    pub fn shadow_ray(&self, volumes: &Volumes<'_>, connection: &EmitterConnection) -> (Ray, Option<u32>) {
        match self {
            Self::Medium { position, index, .. } => (connection.shadow_ray_from(*position), Some(*index)),
            Self::Surface { point, .. } => (
                connection.shadow_ray(point),
                self.medium_towards(volumes, connection.direction),
            ),
        }
    }

    fn medium_towards(&self, volumes: &Volumes<'_>, direction: Vec3) -> Option<u32> {
        match self {
            Self::Medium { index, .. } => Some(*index),
            Self::Surface { point, medium, .. } => match volumes.scene.medium_sides(point.primitive) {
                Some(sides) => sides.towards(direction.dot(point.geometric_normal)),
                None => *medium,
            },
        }
    }
}

/// `σ_t(x)` by channel.
fn extinction(medium: &Medium, position: Vec3) -> DVec3 {
    let density = match medium.density() {
        MediumDensity::Homogeneous => 1.0,
        MediumDensity::Grid(field) => {
            let (place, bounds) = (field.to_field().transform_point3(position), field.grid().bounds());
            let inside = place.cmpge(bounds.min()).all() && place.cmple(bounds.max()).all();
            if inside { field.grid().density(place) } else { 0.0 }
        }
    };
    medium.extinction().as_dvec3() * f64::from(density)
}

/// `σ_s(x)`.
fn scattering(medium: &Medium, position: Vec3) -> DVec3 {
    extinction(medium, position) * medium.albedo_at(position).as_dvec3()
}

/// `σ_a(x) L_e(x)`.
pub(crate) fn emission(medium: &Medium, position: Vec3) -> DVec3 {
    extinction(medium, position) * medium.emission_per_collision(position).as_dvec3()
}

/// The vertex where `ray`, which travelled through `medium`, met a surface.
pub(crate) fn surface_vertex<'a>(
    volumes: &Volumes<'_>,
    point: SurfacePoint,
    ray: &Ray,
    medium: Option<u32>,
) -> Vertex<'a> {
    Vertex::Surface {
        bsdf: volumes.scene.bsdf(&point),
        wo: point.shading.to_local(-ray.direction),
        point,
        medium,
    }
}

//! ReSTIR path tracing in a renderer of spheres: its world in three traits, then candidates and
//! reuse.
//!
//! `cargo run --release --manifest-path examples/users/Cargo.toml -p own_spheres`
mod scene;

use lightshed_resampling::{DomainReservoir, Extent, MergeRule, MixtureRis, Pattern, Reuse};
use lightshed_sampling::{CosineHemisphere, CounterRng, Density, Frame, PathSeed, SolidAngle, glam::Vec3};
use lightshed_shift::{Connectability, Endpoint, Finding, LobeDirection, PathDomain, PathShift, Place, RayKind};
use lightshed_shift::{Scattering, TreeTracer, WorldGeometry, WorldLighting, WorldScattering};
use scene::{Ray, Scene, Vertex};
use std::f32::consts::FRAC_1_PI;
use std::{convert::Infallible, error::Error};

impl WorldGeometry for Scene {
    type Vertex = Vertex;
    type Ray = Ray;
    type Sensor = Infallible;
    fn vertex(&self, place: &Place) -> Vertex { self.locate(place) }
    fn place(&self, vertex: &Vertex) -> Place { vertex.place }
    fn position(&self, vertex: &Vertex) -> Vec3 { vertex.position }
    fn geometric_normal(&self, vertex: &Vertex) -> Vec3 { vertex.normal }
    fn ray(&self, from: &Vertex, direction: Vec3) -> Ray { self.leave(from, direction, f32::INFINITY) }
    fn segment(&self, from: &Vertex, to: &Vertex) -> Ray { self.between(from, to) }
    fn trace(&self, ray: &Ray, _: RayKind) -> Option<Vertex> { self.hit(ray) }
    fn occluded(&self, ray: &Ray, _: RayKind) -> bool { self.hit(ray).is_some() }
}

impl WorldScattering for Scene {
    fn sample_lobe(&self, vertex: &Vertex, wo: Vec3, _: f32, u: [f32; 2]) -> Option<LobeDirection> {
        let wi = Frame::from_normal(vertex.normal).to_world(CosineHemisphere::sample(u));
        Some(LobeDirection::of_single_lobe(wi, self.evaluate(vertex, wo, wi)))
    }
    fn evaluate(&self, vertex: &Vertex, _: Vec3, wi: Vec3) -> Scattering {
        let pdf = vertex.normal.dot(wi).max(0.0) * FRAC_1_PI;
        Scattering { value: Vec3::splat(self.sphere(vertex).albedo * pdf), pdf: Density::new(pdf) }
    }
}

impl WorldLighting for Scene {
    type Site = Vec3;
    fn site(&self, vertex: &Vertex) -> Vec3 { vertex.position }
    fn emitted(&self, vertex: &Vertex, direction: Vec3) -> Vec3 { Vec3::splat(self.glow(vertex, direction)) }
    fn emitter_pdf(&self, from: &Vec3, emitter: &Vertex) -> Density<SolidAngle> {
        let d = emitter.position - *from;
        self.light_density(emitter).to_solid_angle(d.length_squared(), emitter.normal.dot(d.normalize()))
    }
    fn sample_emitter(&self, _: &Vertex, u_select: u64, u: [f32; 2]) -> Option<Endpoint> {
        Some(Endpoint::Surface(self.light_place(u_select, u)))
    }
}

/// One frame: each pixel resamples trees of paths and shares with its neighbours.
fn render(scene: &Scene, width: usize, frame: u32) -> Result<Vec<f32>, Box<dyn Error>> {
    let seen: Vec<_> = (0..width * width).map(|i| scene.seen(i, width)).collect();
    let behind = |vertex, wo| PathDomain::behind(scene, vertex, wo, Connectability::RECONNECTION, 4);
    let domains: Vec<_> = seen.iter().map(|(first, wo)| Some(behind(first.clone()?, *wo))).collect();
    let (mut tracer, rng) = (TreeTracer::new(u32::MAX), |pass| move |i: usize| CounterRng::new(pass, i as u32, frame));
    let mut fresh = Vec::new();
    for (i, domain) in domains.iter().enumerate() {
        let (mut ris, mut rng) = (MixtureRis::new(), rng(0)(i));
        if let Some(domain) = domain {
            let seed = PathSeed::draw(&mut rng);
            tracer.trace(&[(domain, seed)], |_, finding| if let Finding::Path(path, weight) = finding {
                ris.candidate(*path, path.target(), 1.0, weight, &mut rng);
            });
        }
        fresh.push(ris.finish(1.0));
    }
    let mut held: Vec<DomainReservoir<PathDomain<Scene>>> = fresh.clone();
    let extent = Extent { width: width as u32, height: width as u32 };
    let neighbours = Pattern::disk(3.0, 3)?.over(extent, frame);
    Reuse::new(&domains, MergeRule::new(PathShift::default())).spatial(neighbours, &fresh, &mut held, rng(1))?;
    let own = seen.iter().map(|(first, wo)| first.as_ref().map_or(0.0, |vertex| scene.glow(vertex, *wo)));
    Ok(own.zip(&held).map(|(own, held)| own + held.estimate(|path| f64::from(path.contribution().x)) as f32).collect())
}

fn main() -> Result<(), Box<dyn Error>> {
    for frame in 0..4 {
        let image = render(&Scene::new(), 32, frame)?;
        println!("frame {frame}: mean radiance {:.4}", image.iter().sum::<f32>() / image.len() as f32);
    }
    Ok(())
}

#[cfg(test)]
mod tests;

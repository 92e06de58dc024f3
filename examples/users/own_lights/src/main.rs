//! ReSTIR DI over a renderer's own list of lights: a light tree proposes, pixels resample and reuse
//! among frames and neighbours.
//!
//! `cargo run --release --manifest-path examples/users/Cargo.toml -p own_lights`
mod scene;

use lightshed_lights::{Bounds, Light, LightBvh, LightSampler, ShadingPoint, glam::Vec3};
use lightshed_resampling::{Counting, Domain, DomainReservoir, Extent, History, IdentityShift};
use lightshed_resampling::{MergeRule, Pattern, Reuse, Ris, Tractable};
use lightshed_sampling::CounterRng;
use scene::Scene;
use std::{error::Error, sync::Arc};

/// A pixel: a point whose light is a sum over lamps. It shares the scene, so that the renderer can
/// keep it.
struct Pixel(Arc<Scene>, Vec3);

impl Domain for Pixel {
    type Sample = u32;
    type Space = Counting;
    fn target(&self, &lamp: &u32) -> f64 {
        self.0.unshadowed(lamp, self.1)
    }
}

struct Renderer {
    tree: LightBvh,
    extent: Extent,
    reuse: Reuse<'static, Vec<Option<Pixel>>, IdentityShift>,
    held: Vec<DomainReservoir<Pixel>>,
    frame: u32,
}

impl Renderer {
    fn new(scene: &Arc<Scene>, width: usize) -> Result<Self, Box<dyn Error>> {
        let light = |lamp: &scene::Lamp| Light { bounds: Bounds::of_point(lamp.position), intensity: lamp.intensity, cone: None };
        let tree = LightBvh::new(&scene.lamps.iter().map(light).collect::<Vec<_>>())?;
        let extent = Extent { width: width as u32, height: width as u32 };
        // Pixels that show the sky are absent.
        let pixel = |i| Some(Pixel(scene.clone(), scene.floor(i, width)?));
        let reuse = Reuse::new((0..extent.len()).map(pixel).collect(), MergeRule::new(IdentityShift));
        Ok(Self { tree, extent, reuse, held: vec![DomainReservoir::<Pixel>::empty(0.0); extent.len()], frame: 0 })
    }

    /// One frame: an estimate of each pixel's light.
    fn render(&mut self) -> Result<Vec<f64>, Box<dyn Error>> {
        let rng = |pass| { let frame = self.frame; move |pixel: usize| CounterRng::new(pass, pixel as u32, frame) };
        let fresh = self.reuse.domains().iter().enumerate().map(|(i, pixel)| {
            let (mut ris, mut rng) = (Ris::new(), rng(0)(i));
            for _ in 0..if pixel.is_some() { 4 } else { 0 } {
                ris.drawn(pixel.as_ref().and_then(|pixel| {
                    // The tree may choose no light: that is a candidate too.
                    let chosen = self.tree.sample(&ShadingPoint::new(pixel.1, Vec3::Y, 1.0), rng.next_u64())?;
                    let drawn = Tractable::<Counting>::from_density(chosen.pmf).ok()?;
                    Some((chosen.light, pixel.target(&chosen.light), drawn.weight()))
                }), &mut rng);
            }
            ris.finish(1.0)
        });
        let (fresh, mut merged): (Vec<_>, _) = (fresh.collect(), self.held.clone());
        let history = History::new(self.reuse.domains(), &self.held);
        self.reuse.temporal(&fresh, history, Some, &mut merged, rng(1))?;
        let neighbours = Pattern::disk(4.0, 3)?.over(self.extent, self.frame);
        self.reuse.spatial(neighbours, &merged, &mut self.held, rng(2))?;
        self.frame += 1;
        // One shadow ray a pixel.
        Ok(self.held.iter().zip(self.reuse.domains()).map(|(held, pixel)| pixel.as_ref().map_or(0.0, |pixel| {
            held.estimate(|lamp| if pixel.0.visible(*lamp, pixel.1) { pixel.target(lamp) } else { 0.0 })
        })).collect())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut renderer = Renderer::new(&Arc::new(Scene::new()), 24)?;
    for frame in 0..4 {
        let image = renderer.render()?;
        println!("frame {frame}: mean light {:.4}", image.iter().sum::<f64>() / image.len() as f64);
    }
    Ok(())
}

#[cfg(test)]
mod tests;

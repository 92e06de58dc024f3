//! A camera pans over a floor beneath 4,096 lamps and back; cells of the floor keep lamps for
//! pixels that come into view. `cargo run --example world_reservoirs_user`
use lightshed_caching::{WorldDomain, WorldReads, WorldReservoirOptions, WorldReservoirs, glam::Vec3};
use lightshed_resampling::*;
use lightshed_sampling::CounterRng;
use lightshed_spatial::{LevelGridOptions, SurfaceSite};
/// A place on the floor, seen by a pixel. Every hundredth lamp is bright.
#[derive(Clone)]
struct Pixel(Vec3);
impl Domain for Pixel {
    type Sample = u32;
    type Space = Counting;
    fn target(&self, &lamp: &u32) -> f64 {
        let to = Vec3::new((lamp % 64) as f32, 2.0, (lamp / 64) as f32) - self.0;
        let power = if lamp % 100 == 0 { 50.0 } else { 0.1 };
        f64::from(power * to.y / to.length_squared().powf(1.5))
    }
}
impl WorldDomain for Pixel {
    fn site(&self) -> Option<SurfaceSite> {
        Some(SurfaceSite::new(self.0, Vec3::Y))
    }
    fn is_same(&self, a: &u32, b: &u32) -> bool {
        a == b
    }
}
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut world = WorldReservoirs::<Pixel>::new(WorldReservoirOptions::new(LevelGridOptions::new(2.0)))?;
    let weight = Tractable::<Counting>::from_density(1.0 / 4096.0)?.weight();
    let mut errors = [Moments::new(), Moments::new()];
    for frame in 0..60u32 {
        let left = 30.0 - (frame as f32 - 30.0).abs();
        let seen = |i| Pixel(Vec3::new(left + (i % 24) as f32, 0.0, 20.0 + (i / 24) as f32));
        let pixels: Vec<_> = (0..576).map(seen).collect();
        let rng = |pass| move |index: usize| CounterRng::new(pass, index as u32, frame);
        let mut fresh = vec![DomainReservoir::<Pixel>::empty(0.0); pixels.len()];
        for (i, (pixel, fresh)) in pixels.iter().zip(&mut fresh).enumerate() {
            let (mut ris, mut rng) = (Ris::new(), rng(0)(i));
            for lamp in (0..8).map(|_| rng.next_u32() % 4096).collect::<Vec<_>>() {
                ris.candidate(lamp, pixel.target(&lamp), weight, &mut rng);
            }
            *fresh = ris.finish(1.0);
        }
        let visits = world.visit(&pixels, |i| rng(1)(i).next_u32());
        let rule = MergeRule::new(IdentityShift).with_confidence_cap(320.0);
        world.update(&visits, &pixels, &fresh, &rule, |slot| rng(2)(slot as usize))?;
        let reuse = Reuse::new(&pixels, MergeRule::new(IdentityShift));
        let (mut merged, links) = (fresh.clone(), world.links(&pixels, WorldReads::new(2)?, rng(3)));
        reuse.linked(&fresh, world.history(), links, &mut merged, rng(4))?;
        for i in (0..576).step_by(24).filter(|_| frame > 30) {
            let truth: f64 = (0..4096).map(|lamp| pixels[i].target(&lamp)).sum();
            let error =
                |held: &DomainReservoir<Pixel>| held.estimate(|lamp| pixels[i].target(lamp)) / truth - 1.0;
            errors[0].push(error(&fresh[i]).powi(2));
            errors[1].push(error(&merged[i]).powi(2));
        }
    }
    let [alone, cells] = errors.map(|errors| errors.mean());
    println!("relative squared error: {alone:.3} alone, {cells:.3} with cells");
    Ok(())
}

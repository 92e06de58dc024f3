//! quick
use lightshed_integrator::*;
use lightshed_scene::*;
use std::sync::atomic::AtomicBool;
fn main() {
    let d = builtin::cornell();
    let scene = Scene::new(&d).unwrap();
    let tracer = PathTracer::with_depths(&scene, Some(8), 1000);
    let mut options = RenderOptions::new(256, 256, Budget::Samples(64));
    options.threads = 1;
    let out = render(&tracer, &options, &|_| {}, &AtomicBool::new(false)).unwrap();
    let n = 256.0 * 256.0 * 64.0;
    println!(
        "{:?} {:.3} M/s cpu",
        out.film.mean_image().mean(),
        n / out.cpu_seconds.unwrap() / 1e6
    );
}

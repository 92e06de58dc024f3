//! A user's example: two estimators of direct light race each other, and the page that shows it.
//!
//! `cargo run --release -p lightshed-evaluate --example evaluate_user`
use lightshed_evaluate::{ContestOptions, Contestant, Metric, Reference, ReportScene, html_report, run};
use lightshed_film::SampledFrames;
use lightshed_integrator::{DirectLight, DirectLightOptions, PathTracer};
use lightshed_scene::{Scene, builtin};
use std::error::Error;
use std::sync::atomic::AtomicBool;

fn main() -> Result<(), Box<dyn Error>> {
    let mut description = builtin::cornell();
    let size = [64, 64];
    [description.settings.width, description.settings.height] = size;
    description.settings.max_depth = Some(2);
    let scene = Scene::new(&description)?;
    let never = AtomicBool::new(false);
    let reference = Reference::rendered(
        &PathTracer::new(&scene, scene.emitters_by_power()),
        size,
        2048,
        &|_| (),
        &never,
    )?;

    // Any `Method` or `PixelEstimator`; the first is the baseline.
    let path = || {
        Ok(Box::new(SampledFrames::new(
            PathTracer::new(&scene, scene.emitters_by_power()),
            size,
            1,
        )) as Box<_>)
    };
    let direct = || {
        Ok(Box::new(SampledFrames::new(
            DirectLight::new(&scene, scene.emitters_by_power(), DirectLightOptions::default()).unwrap(),
            size,
            1,
        )) as Box<_>)
    };
    let contestants = [Contestant::new("path", path), Contestant::new("direct", direct)];
    let options = ContestOptions {
        seconds: 1.0,
        repeats: 4,
        seed: 1,
    };
    let contested = run(
        "cornell",
        &contestants,
        &reference,
        options,
        None,
        &|_| (),
        &never,
    )?;
    for standing in contested.record.standings() {
        for by_metric in &standing.by_metric {
            let (Some(error), Some(speedup)) = (by_metric.error, by_metric.speedup) else {
                continue;
            };
            println!(
                "{:<8} {:<7} {:.2e}, {:.2} times as fast ({:.2} to {:.2})",
                standing.name,
                by_metric.metric.name(),
                error.mid,
                speedup.mid,
                speedup.low,
                speedup.high
            );
        }
    }
    println!("{}", contested.record.plot(Metric::Mse).title);
    let section = ReportScene {
        title: "The Cornell box".to_owned(),
        description: "Light that was scattered once.".to_owned(),
        record: &contested.record,
        reference: &reference,
        images: &contested.images,
        checkpoints: &contested.checkpoints,
        chains: &[],
        motion: None,
        without_emitters: &[],
    };
    let page = std::env::temp_dir().join("lightshed-user.html");
    std::fs::write(
        &page,
        html_report("Direct light", "this machine", "this example", &[section])?,
    )?;
    println!("{}", page.display());
    Ok(())
}

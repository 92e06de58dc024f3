//! How a guide learns, frame by frame: the variance of a frame, what regions there are and which
//! share they give to the guide.
//!
//! ```sh
//! cargo run --release -p lightshed-integrator --example guide_training -- \
//!     [scene] [cdq|sdtree] [bits] [frames] [setting=value]…
//! ```

use lightshed_guiding::{Interpolation, QuadtreeGoal};
use lightshed_integrator::film::FrameMethod;
use lightshed_integrator::{GuideKind, GuidedPaths, GuidedPathsOptions};
use lightshed_scene::{Rgb, Scene, builtin, import};
use std::path::Path;
use std::sync::atomic::AtomicBool;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let argument =
        |place: usize, default: &str| arguments.get(place).map_or(default, String::as_str).to_owned();
    let name = argument(1, "lighthouse");
    let mut description = match builtin::by_name(&name) {
        Some(description) => description,
        None => import::load(Path::new(&name), &[])?.description,
    };
    (description.settings.width, description.settings.height) = (128, 128);
    let mut options = GuidedPathsOptions::new(argument(2, "cdq").parse::<GuideKind>()?);
    let mut seed = 1;
    options.quadtree.bits = argument(3, "64").parse()?;
    for setting in arguments.iter().skip(5) {
        let (name, value) = setting.split_once('=').ok_or("settings are name=value")?;
        match name {
            "split" => {
                options.field.split_above = value.parse()?;
                options.field.collapse_below = options.field.split_above / 2;
            }
            "share" => options.field.max_share = value.parse()?,
            "share-variance" => options.field.share_by_variance = value.parse()?,
            "depth" => description.settings.max_depth = Some(value.parse()?),
            "share-prior" => options.field.share_prior = value.parse()?,
            "prior" => options.quadtree.prior_samples = value.parse()?,
            "least" => options.quadtree.least_samples = value.parse()?,
            "eagerness" => options.quadtree.eagerness = value.parse()?,
            "goal" if value == "even" => options.quadtree.goal = QuadtreeGoal::EvenLoad,
            "goal" => {
                options.quadtree.goal = QuadtreeGoal::LeastVariance {
                    share: value.parse()?,
                }
            }
            "parallax" => options.quadtree.parallax = value.parse()?,
            "roulette" => options.roulette_depth = value.parse()?,
            "seed" => seed = value.parse()?,
            "samples" => options.samples = value.parse()?,
            "every" => options.every_frame = value.parse()?,
            "borders" => options.field.interpolation = Interpolation::None,
            "decay" => options.vmf.decay = value.parse()?,
            "count" => options.vmf.prior_count = value.parse()?,
            "blend" if value == "none" => options.field.interpolation = Interpolation::None,
            "training" => options.training = value.parse()?,
            "drop" => options.may_drop = value.parse()?,
            _ => return Err(format!("no setting {name}").into()),
        }
    }
    let scene = Scene::new(&description)?;
    let mut method = GuidedPaths::new(&scene, scene.emitters_by_power(), options)?;
    let mut image = vec![Rgb::ZERO; 128 * 128];
    // Where the noise of later frames is.
    let mut blocks = [[0.0f64; 16]; 16];
    println!("frame   variance   regions  share  seconds");
    for frame in 0..argument(4, "24").parse()? {
        let start = std::time::Instant::now();
        method.render_frame(frame, seed, &mut image, &AtomicBool::new(false));
        for (pixel, value) in image.iter().enumerate().filter(|_| frame >= 16) {
            blocks[pixel / 128 / 8][pixel % 128 / 8] += f64::from(value.length_squared());
        }
        let field = method.field();
        println!(
            "{frame:5} {:10.3e} {:9} {:6.3} {:8.3}{}",
            method.last_variance(),
            field.learnt_regions(),
            field.mean_share(),
            start.elapsed().as_secs_f64(),
            if method.is_dropped() { "  plain" } else { "" }
        );
    }
    let total: f64 = blocks.iter().flatten().sum();
    println!("share of the noise by blocks of 8 x 8 pixels, per mille:");
    for row in blocks {
        println!(
            "{}",
            row.map(|block| format!("{:4.0}", 1000.0 * block / total))
                .concat()
        );
    }
    Ok(())
}

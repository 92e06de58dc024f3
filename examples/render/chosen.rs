//! What `--method auto` has chosen, and why.

use crate::arguments::{Arguments, Device};
use crate::failure::Failure;
use crate::interruption::Interruption;
use crate::rendered::Rendered;
use lightshed::film::{Budget, RenderOptions};
use lightshed::integrator::{AutoTask, Choice, MethodRequest, Trial};
use lightshed::scene::Scene;
use serde_json::{Value, json};
use std::sync::atomic::Ordering;
use std::time::Instant;

/// A choice, seconds that its pilot took, and whether that was interrupted.
pub struct Chosen {
    pub choice: Choice,
    pub seconds: f64,
    pub interrupted: bool,
}

impl Chosen {
    /// What to render of the chosen method in place of `samples` of the plainest one, at equal
    /// cost; each part has some, if it had before.
    pub fn samples(&self, arguments: &Arguments, samples: u32) -> u32 {
        let part = arguments
            .shard
            .iter()
            .flat_map(|parts| parts.iter())
            .map(|part| part.count());
        let parts = part.chain(arguments.shards).max().unwrap_or(1);
        self.choice.frames(samples).max(parts.min(samples))
    }

    /// Adds the time to that of the rendering.
    pub fn count(&self, outcome: &mut Rendered) {
        outcome.seconds += self.seconds;
        let pilot = self.choice.pilot.map_or(0.0, |pilot| pilot.seconds);
        outcome.cpu_seconds = outcome.cpu_seconds.map(|seconds| seconds + pilot);
    }
}

/// The choice of a method, if none was given. It is the same for all shards of an image, whatever
/// their threads and seeds. Where frames move nothing is tried.
pub fn choose(
    arguments: &Arguments,
    scene: &mut Scene,
    options: &RenderOptions,
    frame: Option<u32>,
) -> Result<Option<Chosen>, Failure> {
    let MethodRequest::Auto(auto) = &arguments.request else {
        return Ok(None);
    };
    if arguments.device == Device::Gpu {
        return Ok(None);
    }
    let start = Instant::now();
    let moves = arguments.motion.is_some() || arguments.media_motion.is_some() || arguments.sequence;
    let mut interrupted = false;
    let choice = if moves || frame.is_some() || arguments.frame.is_some() {
        auto.by_features(scene)?
    } else {
        let samples = match options.budget {
            Budget::Samples(samples) => samples,
            // What the seconds are taken for.
            Budget::Seconds(_) => scene.settings().samples_per_pixel,
        };
        let task = AutoTask {
            threads: options.threads,
            by_clock: arguments.adaptive,
            // A part that follows from no other would learn for itself.
            chains: arguments.shard.is_none() && arguments.shards.is_none(),
            ..AutoTask::new([options.width, options.height], samples)
        };
        let cancel = &Interruption::catch()?.cancel;
        let choice = auto.choose(scene, &task, cancel)?;
        interrupted = cancel.load(Ordering::Relaxed);
        choice
    };
    let seconds = start.elapsed().as_secs_f64();
    Ok(Some(Chosen {
        choice,
        seconds,
        interrupted,
    }))
}

/// All there is to know of a choice.
pub fn choice_json(choice: &Choice) -> Value {
    let trial = |trial: &Trial| {
        json!({
            "method": trial.method.to_string(),
            "frames": trial.frames,
            "cost": trial.cost,
            "mse": trial.error,
            "relative_mse": trial.relative,
            "certain": trial.certain,
            "prior": trial.prior,
            "short_paths": {"cost": trial.short.cost, "error": trial.short.error},
            "is_lit": trial.is_lit,
            "merit": trial.merit(),
        })
    };
    let left_out = choice.left_out.iter();
    json!({
        "method": choice.method.to_string(),
        "cost": choice.cost,
        "why": choice.why,
        "pilot": choice.pilot.map(|pilot| json!({
            "size": pilot.size,
            "in_blocks": pilot.in_blocks,
            "seconds": pilot.seconds,
        })),
        "trials": choice.trials.iter().map(trial).collect::<Value>(),
        "left_out": left_out.map(|left| json!({"method": left.method, "why": left.why})).collect::<Value>(),
    })
}

/// The same for a reader, a line each.
pub fn choice_text(choice: &Choice) -> String {
    let features = &choice.features;
    let mut text = format!(
        "\n  chosen   {:<30} {}; a frame costs {:.2} samples of the plainest one\n  scene    {:<30} {} finite emitters, {}, {} media, {} glossy and {} smooth materials of lobes",
        choice.method.to_string(),
        choice.why,
        choice.cost,
        "",
        features.area_emitters + features.delta_emitters,
        if features.surroundings {
            "light from all around"
        } else {
            "none from all around"
        },
        features.media,
        features.glossy_materials,
        features.delta_materials,
    );
    if let Some(pilot) = &choice.pilot {
        let ([width, height], seconds) = (pilot.size, pilot.seconds);
        let of = if pilot.in_blocks { " in blocks" } else { "" };
        text += &format!(
            "\n  pilot    {:<30} {width}x{height} pixels{of}, {seconds:.2} CPU-seconds",
            ""
        );
    }
    for trial in &choice.trials {
        text += &format!(
            "\n  tried    {:<30} {} frames of cost {:.3}, squared error {:.3e}, prior {:.2}, short paths {:.2}, merit {:.3e}",
            trial.method.to_string(),
            trial.frames,
            trial.cost,
            trial.error,
            trial.prior,
            trial.short.both(),
            trial.merit()
        );
    }
    for left in &choice.left_out {
        text += &format!("\n  not tried {:<29} {}", left.method, left.why);
    }
    text
}

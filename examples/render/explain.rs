//! `--explain`: what a method does for a scene, and what it leaves out because the scene has no
//! need of it.

use crate::arguments::Arguments;
use crate::chosen::{choice_json, choice_text};
use lightshed::integrator::{Choice, PathDepth, PathMapping, guide_need};
use lightshed::scene::{Scene, SceneFeatures};
use serde_json::{Value, json};

/// A part of a method.
struct Pass {
    name: &'static str,
    /// Why it is left out, or `Ok` with what there is for it.
    runs: Result<String, &'static str>,
}

/// Runs with `what` if `has`, else is left out for `why`.
fn pass(name: &'static str, has: bool, what: impl ToString, why: &'static str) -> Pass {
    Pass {
        name,
        runs: if has { Ok(what.to_string()) } else { Err(why) },
    }
}

fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

/// All parts, in the order in which they come.
fn passes(arguments: &Arguments, guided: &Scene, max_depth: Option<u32>, roulette_depth: u32) -> Vec<Pass> {
    let scene = &SceneFeatures::of(guided);
    let (method, values) = (&arguments.method, arguments.method.values());
    let capabilities = method.capabilities();
    let bounces = capabilities.depth != PathDepth::Direct && max_depth.is_none_or(|depth| depth > 2);
    let finite = scene.area_emitters + scene.delta_emitters;
    let samples_emitters = finite > 0 || scene.surroundings;
    let shifts = method.entry().option("shift").is_some();
    let mut all = vec![
        pass(
            "places on the lens",
            scene.lens,
            "the camera has a lens",
            "the camera has a pinhole",
        ),
        pass(
            "tree traversal",
            scene.tree,
            format!(
                "{}, {}",
                count(scene.triangles, "triangle"),
                count(scene.spheres, "sphere")
            ),
            "triangles are so few that rays are tested against all of them",
        ),
        pass(
            "texture lookups",
            scene.textured_materials > 0,
            count(scene.textured_materials, "material"),
            "no material has textures",
        ),
        pass(
            "samples of emitters",
            samples_emitters,
            count(finite, "finite emitter"),
            "nothing emits",
        ),
        pass(
            "light from all around",
            scene.surroundings,
            "rays that meet nothing see it",
            "there is none: rays that meet nothing are black",
        ),
        pass(
            "light trees",
            values.light_choosing().is_some() && finite > 0,
            "--lights chooses emitters for the point",
            "emitters are chosen by power; --lights chooses them for the point",
        ),
        pass(
            "mirrors and smooth refraction",
            scene.delta_materials > 0,
            count(scene.delta_materials, "material"),
            "no material has such lobes",
        ),
        pass(
            "indirect light",
            bounces,
            "paths of more than two edges",
            "the method or --max-depth ends paths at direct light",
        ),
        pass(
            "roulette",
            bounces && max_depth.is_none_or(|depth| depth > roulette_depth),
            format!("from edge {roulette_depth} on"),
            "the longest path is not longer than what roulette spares",
        ),
    ];
    if method.entry().option("guide").is_some() {
        let (asked, need) = (values.guided_paths().is_some(), guide_need(guided));
        all.push(pass(
            "guide of directions",
            asked && need.is_ok(),
            match values.cache_rule() {
                Some(_) => "learnt from the samples of the cache's passes",
                None if method.entry().capabilities.frames => "learnt from paths beside the first frames",
                None => {
                    "learnt from the paths of the first frames, and dropped if it gains less than it costs"
                }
            },
            match need {
                Err(why) if asked => why,
                _ => "--guide is not given",
            },
        ));
    }
    if method.entry().option("cache").is_some() {
        all.push(pass(
            "cache of radiance",
            values.cache_rule().is_some(),
            "filled by passes before the first frame; paths end there, which is biased",
            "--cache is not given",
        ));
    }
    let knows = capabilities.media;
    all.push(pass(
        "media",
        knows && scene.media > 0,
        count(scene.media, "medium"),
        "the scene has none",
    ));
    all.push(pass(
        "emission of media",
        knows && scene.emitting_media > 0,
        count(scene.emitting_media, "medium"),
        "no medium emits",
    ));
    if capabilities.frames {
        all.push(pass(
            "camera motion",
            arguments.motion.is_some(),
            "pixels look for what they saw before",
            "--motion is not given",
        ));
    }
    if capabilities.media_motion {
        all.push(pass(
            "motion of media",
            arguments.media_motion.is_some(),
            "pixels look for where what they see was before",
            "--media-motion is not given",
        ));
    }
    if shifts {
        let hybrid = values.path_mapping() == PathMapping::Hybrid;
        let shares = arguments.method.entry().option("sharing").is_some()
            && values.shares_paths()
            && arguments.motion.is_none();
        let replays = if shares {
            scene.delta_materials > 0
        } else {
            !scene.is_diffuse()
        };
        all.push(pass(
            "random replay",
            hybrid && replays,
            "vertices that cannot be reconnected are replayed",
            if shares {
                "nothing is smooth: all paths are shared"
            } else if hybrid {
                "all surfaces are diffuse: every path is reconnected at once"
            } else {
                "--shift reconnection has none"
            },
        ));
        all.push(pass(
            "reuse from the frame before",
            capabilities.chain,
            "reservoirs of the frame before",
            "frames of this method are independent",
        ));
    }
    all
}

/// As text, or as JSON.
pub fn explain(
    arguments: &Arguments,
    choice: Option<&Choice>,
    scene: &Scene,
    max_depth: Option<u32>,
    roulette_depth: u32,
) -> String {
    let all = passes(arguments, scene, max_depth, roulette_depth);
    let method = arguments.method.name();
    if arguments.json {
        let passes: Vec<Value> = all
            .iter()
            .map(|pass| {
                let (runs, why) = match &pass.runs {
                    Ok(what) => (true, what.as_str()),
                    Err(why) => (false, *why),
                };
                json!({"pass": pass.name, "runs": runs, "why": why})
            })
            .collect();
        let choice = choice.map(choice_json);
        return json!({"scene": arguments.scene, "method": method, "choice": choice, "passes": passes})
            .to_string();
    }
    let mut text = format!("{} by {method}", arguments.scene);
    text += &choice.map(choice_text).unwrap_or_default();
    for pass in &all {
        text += &match &pass.runs {
            Ok(what) => format!("\n  runs     {:<30} {what}", pass.name),
            Err(why) => format!("\n  left out {:<30} {why}", pass.name),
        };
    }
    text
}

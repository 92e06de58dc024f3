//! Whether frames that follow from each other are better than the best that do not.
//!
//! What such frames have learnt makes later ones better than the first, and a pilot sees the first
//! ones alone. With `M(n) = C n E_n` for the error `E_n` of the mean of `n` frames, constant
//! where frames are independent, a method that still learns has `M(n) < M(n/2)`. Doublings that are
//! yet to come are taken to bring as much each, by the power `TRUST`.

use super::candidates::chain;
use super::choice::{Choice, Trial};
use super::cost::FrameCost;
use super::pilot::{halves, images};
use super::plan::{AutoTask, ChainPlan};
use super::race::clock;
use crate::registry::{Method, MethodError, Stage};
use std::sync::atomic::AtomicBool;

/// How much of what the last doubling brought the next ones bring.
const TRUST: f64 = 0.7;

/// What the last doubling brought, at most.
const MOST_GAIN: f64 = 2.0;

/// Most doublings that are foreseen.
const MOST_DOUBLINGS: f64 = 5.0;

/// A chain: where light goes through smooth surfaces, on paths of few edges, and the work allows
/// it.
pub(super) fn chain_to_try(
    given: &[(String, String)],
    choice: &Choice,
    task: &AutoTask,
) -> Option<(Method, ChainPlan)> {
    let features = &choice.features;
    let has_images = features.delta_materials > 0 && features.has_light() && features.media == 0;
    let few_edges = choice.max_depth.is_some_and(|depth| (3..=4).contains(&depth));
    if task.by_clock || choice.trials.is_empty() || !has_images || !few_edges {
        return None;
    }
    let method = chain(given)?;
    let plan = task.chain_plan(FrameCost::at_first_sight(&method))?;
    Some((method, plan))
}

/// The choice, or the chain if it is better in the blocks of the plan, at which the scene is.
pub(super) fn against_chain(
    choice: Choice,
    chain: &Method,
    plan: &ChainPlan,
    (stage, task): (&Stage<'_>, &AutoTask),
    cancel: &AtomicBool,
) -> Result<Choice, MethodError> {
    let start = clock();
    let Some(place) = choice
        .trials
        .iter()
        .position(|trial| trial.method == choice.method)
    else {
        return Ok(choice);
    };
    let (first, best) = (&choice.trials[0], &choice.trials[place]);
    // In other blocks than the pilot's errors differ.
    let mut scale = 1.0;
    if task.pilot_blocks() != Some(plan.blocks) {
        let frames = ((f64::from(plan.samples) * first.cost / best.cost).round() as u32).max(1);
        let Some(known) = images(stage, &best.method, frames, task.threads, cancel)? else {
            return Ok(choice);
        };
        let blocks = best.error * f64::from(best.frames) / (known.error * f64::from(known.frames));
        scale = if blocks.is_finite() { blocks } else { 1.0 };
    }
    let Some([half, whole]) = halves(stage, chain, plan.frames, task.threads, cancel)? else {
        return Ok(choice);
    };
    let [width, height] = plan.blocks.size().map(f64::from);
    let pixels = 2.0 * width * height * f64::from(plan.frames);
    let cost = FrameCost::of(chain, &choice.features);
    let cost = match &whole.rays {
        Some(rays) => cost.count(rays, pixels),
        // Of paths through media, whose rays are not counted.
        None => cost.in_paths(first.cost),
    };
    let all = f64::from(task.samples) * first.cost / cost;
    let more = all / f64::from(plan.frames);
    // Twice the frames of half the image, at twice its cost.
    let gain = (half.error / (2.0 * whole.error))
        .clamp(1.0, MOST_GAIN)
        .powf(TRUST);
    let doublings = more.log2().clamp(0.0, MOST_DOUBLINGS);
    let error = scale * whole.error;
    let trial = Trial {
        method: chain.clone(),
        frames: plan.frames,
        cost,
        error,
        relative: if best.error > 0.0 {
            error * best.relative / best.error
        } else {
            error
        },
        certain: best.certain,
        prior: gain.powf(-doublings),
        is_lit: whole.is_lit(),
    };
    let ratio = best.merit() / trial.merit();
    let mut choice = Choice {
        pilot: choice.pilot.map(|mut pilot| {
            pilot.seconds += clock() - start;
            pilot
        }),
        ..choice
    };
    if ratio > 1.0 && trial.error > 0.0 {
        choice.why = format!(
            "at equal cost {} is taken to have {ratio:.2} times its error, once it has learnt",
            choice.method
        );
        choice.cost = cost / choice.trials[0].cost;
        choice.method = chain.clone();
    }
    choice.trials.push(trial);
    Ok(choice)
}

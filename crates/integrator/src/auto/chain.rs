//! Whether frames that follow from each other are better than the best that do not: chains, and
//! paths with a guide.
//!
//! What such frames have learnt makes later ones better than the first, and a pilot sees the first
//! ones alone. With `M(n) = C n E_n` for the error `E_n` of the mean of `n` frames, constant
//! where frames are independent, a method that still learns has `M(n) < M(n/2)`. Doublings that are
//! yet to come are taken to bring as much each, by the power `TRUST`.

use super::candidates::{chain, guided};
use super::choice::{Choice, Trial};
use super::cost::FrameCost;
use super::pilot::{halves, images};
use super::plan::{AutoTask, ChainPlan, Learner};
use super::race::clock;
use crate::registry::{Method, MethodError, Stage};
use std::sync::atomic::AtomicBool;

/// How much of what the last doubling brought the next ones bring.
const TRUST: f64 = 0.7;

/// What the last doubling brought, at most.
const MOST_GAIN: f64 = 2.0;

/// What a guide gains with each doubling of the paths that teach it.
const GUIDE_GAIN: f64 = 1.27;

/// Most doublings that are foreseen.
const MOST_DOUBLINGS: f64 = 5.0;

/// How much less error at equal cost the sharing of paths among pixels must have, where a guide is
/// tried: it finds the same light, on paths of more edges than one, and costs more.
const SHARED_LIGHT: f64 = 4.0;

/// What is worth trying, and how.
pub(super) fn learners_to_try(
    given: &[(String, String)],
    choice: &Choice,
    task: &AutoTask,
    need: impl FnOnce() -> bool,
) -> Vec<(Method, ChainPlan)> {
    let chain = chain_to_try(given, choice, task);
    let guide = guide_to_try(given, choice, task).filter(|_| need());
    chain.into_iter().chain(guide).collect()
}

/// A guide: where sharing paths among pixels shows that light is found seldom and is the same for
/// neighbours, and the work allows it.
fn guide_to_try(given: &[(String, String)], choice: &Choice, task: &AutoTask) -> Option<(Method, ChainPlan)> {
    let plain = choice.trials.first()?;
    let shared = choice
        .trials
        .iter()
        .find(|trial| trial.method.name() == "path-reuse")?;
    let gain = plain.merit() / (shared.merit() / shared.prior);
    if task.by_clock || !shared.is_lit || !(gain >= SHARED_LIGHT) {
        return None;
    }
    let method = guided(given, &choice.method)?;
    let plan = task.chain_plan(Learner::Guide, FrameCost::at_first_sight(&method))?;
    Some((method, plan))
}

/// A chain: where light goes through smooth surfaces, on paths of few edges, and the work allows
/// it.
fn chain_to_try(given: &[(String, String)], choice: &Choice, task: &AutoTask) -> Option<(Method, ChainPlan)> {
    let features = &choice.features;
    let has_images = features.delta_materials > 0 && features.has_light() && features.media == 0;
    let few_edges = choice.max_depth.is_some_and(|depth| (3..=4).contains(&depth));
    if task.by_clock || choice.trials.is_empty() || !has_images || !few_edges {
        return None;
    }
    let method = chain(given)?;
    let plan = task.chain_plan(Learner::Chain, FrameCost::at_first_sight(&method))?;
    Some((method, plan))
}

/// The choice, or what learns if it is better in the blocks of the plan, at which the scene is.
pub(super) fn against_learner(
    choice: Choice,
    learner: &Method,
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
    let Some([half, whole]) = halves(stage, learner, plan.frames, task.threads, cancel)? else {
        return Ok(choice);
    };
    let [width, height] = plan.blocks.size().map(f64::from);
    let pixels = 2.0 * width * height * f64::from(plan.frames);
    let cost = FrameCost::of(learner, &choice.features);
    let cost = match &whole.rays {
        Some(rays) => cost.count(rays, pixels),
        // Of paths through media, whose rays are not counted.
        None => cost.in_paths(first.cost),
    };
    let all = f64::from(task.samples) * first.cost / cost;
    let mut more = all / f64::from(plan.frames);
    // Twice the frames of half the image, at twice its cost.
    let mut gain = (half.error / (2.0 * whole.error))
        .clamp(1.0, MOST_GAIN)
        .powf(TRUST);
    if plan.learner == Learner::Guide {
        // All pixels teach it. Its mean holds what it had not learnt yet.
        let [columns, rows] = task.size.map(f64::from);
        more *= columns * rows / (width * height);
        gain = GUIDE_GAIN;
    }
    let doublings = more.log2().clamp(0.0, MOST_DOUBLINGS);
    let error = scale * whole.error;
    let trial = Trial {
        method: learner.clone(),
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
        choice.method = learner.clone();
    }
    choice.trials.push(trial);
    Ok(choice)
}

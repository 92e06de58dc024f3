//! Whether frames that follow from each other are better than the best that do not.
//!
//! What such frames have learnt makes later ones better than the first, and a pilot sees the first
//! ones alone. With `M(n) = C n E_n` for the error `E_n` of the mean of `n` frames, constant
//! where frames are independent, a method that still learns has `M(n) < M(n/2)`. Doublings that are
//! yet to come are taken to bring as much each, by the power `TRUST`.

use super::candidates::chain;
use super::choice::{Choice, Trial};
use super::cost::FrameCost;
use super::pilot::{Images, halves, images, weights};
use super::plan::{AutoTask, ChainPlan};
use super::race::clock;
use super::short_gain::ShortGain;
use crate::registry::{Method, MethodError, Stage};
use std::sync::atomic::AtomicBool;

/// How much of what the last doubling brought the next ones bring.
const TRUST: f64 = 0.7;

/// What the last doubling brought, at most; and what it is taken to bring at the least where the
/// chain is likely to win. In `pool` its efficiency beside paths is 1.1 after 24 frames, 3.6 after
/// 100 and 7 after 200, and what few blocks show of the first doubling is chance.
const MOST_GAIN: f64 = 2.0;
const LIKELY_GAIN: f64 = 1.7;

/// Most doublings that are foreseen.
const MOST_DOUBLINGS: f64 = 5.0;

/// The part of the error that sharing takes away where it does nothing: light goes through smooth
/// surfaces on all paths that matter.
const NOTHING: f64 = 0.02;

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
    let plan = task.chain_plan(FrameCost::at_first_sight(&method), is_likely(choice))?;
    Some((method, plan))
}

/// Whether a chain, which has smooth surfaces and short paths, is likely to win by far.
fn is_likely(choice: &Choice) -> bool {
    let sharing = choice
        .trials
        .iter()
        .find(|trial| trial.method.name() == "path-reuse");
    sharing.is_some_and(|trial| trial.shared < NOTHING)
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
    let frames = ((f64::from(plan.samples) * first.cost / best.cost).round() as u32).max(1);
    let Some(known) = images(stage, &best.method, frames, task.threads, cancel)? else {
        return Ok(choice);
    };
    let Some([half, whole]) = halves(stage, chain, plan.frames, task.threads, cancel)? else {
        return Ok(choice);
    };
    let [width, height] = plan.blocks.size().map(f64::from);
    let pixels = 2.0 * width * height * f64::from(plan.frames);
    let cost = FrameCost::of(chain, &choice.features);
    let cost = match &whole.rays {
        Some(rays) => cost.count(rays, whole.alone, pixels),
        // Of paths through media, whose rays are not counted.
        None => cost.in_paths(first.cost),
    };
    // Of the many frames of the chain more is known than of the few paths, which miss light.
    let shown = [&known, &whole].map(|images| (images, f64::from(images.frames)));
    let weights = weights(shown.into_iter(), plan.blocks.size()[0] as usize);
    let relative = |images: &Images| images.weighed(&weights);
    let as_known = |best_error: f64, error: f64, known_error: f64| {
        let scale = best_error * f64::from(best.frames) / (known_error * f64::from(known.frames));
        error * if scale.is_finite() { scale } else { 1.0 }
    };
    let all = f64::from(task.samples) * first.cost / cost;
    let more = all / f64::from(plan.frames);
    // Twice the frames of half the image, at twice its cost.
    let both = |images: &Images| (images.error * relative(images)).sqrt();
    let least = if is_likely(&choice) { LIKELY_GAIN } else { 1.0 };
    let gain = (both(&half) / (2.0 * both(&whole)))
        .clamp(least, MOST_GAIN)
        .powf(TRUST);
    let doublings = more.log2().clamp(0.0, MOST_DOUBLINGS);
    let trial = Trial {
        method: chain.clone(),
        frames: plan.frames,
        cost,
        error: as_known(best.error, whole.error, known.error),
        relative: as_known(best.relative, relative(&whole), relative(&known)),
        certain: best.certain,
        prior: gain.powf(-doublings),
        shared: 0.0,
        short: ShortGain::NONE,
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

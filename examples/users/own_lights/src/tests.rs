//! The mean over frames is the sum over all lamps.

use super::*;

/// Chains of eight frames. The threshold is five standard errors of the image's mean over chains:
/// of sound programs one in a million fails.
#[test]
fn the_mean_is_the_sum_over_all_lamps() {
    let scene = Arc::new(Scene::new());
    let width = 12;
    let truth: f64 = (0..width * width).filter_map(|i| scene.floor(i, width)).map(|at| scene.light(at)).sum();
    let means: Vec<f64> = (0..24)
        .map(|chain| {
            let mut renderer = Renderer::new(&scene, width).unwrap();
            renderer.frame = 100 * chain;
            let frames = (0..8).map(|_| renderer.render().unwrap().iter().sum::<f64>());
            frames.last().unwrap() / truth
        })
        .collect();
    let count = means.len() as f64;
    let mean = means.iter().sum::<f64>() / count;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let error = (variance / count).sqrt();
    println!("{mean} ± {error} of the truth");
    assert!((mean - 1.0).abs() < 5.0 * error && error < 0.02, "{mean} ± {error}");
}

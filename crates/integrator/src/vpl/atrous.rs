//! An edge-avoiding filter for values that surfaces carry.

use lightshed_sampling::parallel;
use lightshed_scene::glam::Vec3;

/// What a pixel shows, as the filter judges it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Guide {
    pub position: Vec3,
    /// Unit normal; zero where the pixel shows no surface, which takes no part.
    pub normal: Vec3,
    /// Distance from the camera, which the size of a pixel on the surface is proportional to.
    pub distance: f32,
}

impl Default for Guide {
    fn default() -> Self {
        Self {
            position: Vec3::ZERO,
            normal: Vec3::ZERO,
            distance: 1.0,
        }
    }
}

/// Exponent of the cosine between normals.
const NORMAL_POWER: i32 = 32;
/// Distance from the tangent plane at which the weight has fallen to 1/e, relative to the distance
/// from the camera.
const PLANE_TOLERANCE: f32 = 0.01;
/// Weights of the B₃ spline: ⅜, ¼, ¹⁄₁₆.
const KERNEL: [f32; 3] = [0.375, 0.25, 0.062_5];

/// How much two pixels show the same surface, in [0, 1], symmetric.
#[inline]
pub(super) fn similarity(a: &Guide, b: &Guide) -> f32 {
    let cosine = a.normal.dot(b.normal);
    if !(cosine > 0.0) {
        return 0.0;
    }
    let between = b.position - a.position;
    let off_plane = a.normal.dot(between).abs().max(b.normal.dot(between).abs());
    let scale = PLANE_TOLERANCE * a.distance.min(b.distance);
    cosine.min(1.0).powi(NORMAL_POWER) * (-off_plane / scale.max(f32::MIN_POSITIVE)).exp()
}

/// Edge-avoiding à-trous wavelets (Dammertz et al. 2010): iteration `i` of `iterations` is a 5×5
/// B₃ spline with `2^i − 1` pixels left out between its taps,
///
/// > `v'_p = Σ_q h_{p−q} w(p, q) v_q / Σ_q h_{p−q} w(p, q)`,
///
/// with `w` from normals and tangent planes alone: nothing in it looks at the noisy values, so the
/// filter is linear and keeps their expectation wherever that is the same on a surface. `values`
/// are filtered in place, `scratch` has their length. Rows are filtered independently; the result
/// does not depend on the threads.
pub(super) fn filter(
    values: &mut [f32],
    scratch: &mut [f32],
    guides: &[Guide],
    columns: usize,
    iterations: u32,
) {
    let rows = guides.len() / columns.max(1);
    for iteration in 0..iterations {
        let step = 1isize << iteration;
        let source = &*values;
        parallel::for_each(scratch.chunks_mut(columns), |y, out| {
            for (x, out) in out.iter_mut().enumerate() {
                *out = tap(source, guides, [columns, rows], [x, y], step);
            }
        });
        values.copy_from_slice(scratch);
    }
}

#[inline]
fn tap(
    source: &[f32],
    guides: &[Guide],
    [columns, rows]: [usize; 2],
    [x, y]: [usize; 2],
    step: isize,
) -> f32 {
    let here = &guides[y * columns + x];
    let (mut sum, mut weights) = (0.0, 0.0);
    for dy in -2isize..=2 {
        let Some(y) = y.checked_add_signed(dy * step).filter(|&y| y < rows) else {
            continue;
        };
        for dx in -2isize..=2 {
            let Some(x) = x.checked_add_signed(dx * step).filter(|&x| x < columns) else {
                continue;
            };
            let place = y * columns + x;
            let kernel = KERNEL[dx.unsigned_abs()] * KERNEL[dy.unsigned_abs()];
            let weight = kernel * similarity(here, &guides[place]);
            sum += weight * source[place];
            weights += weight;
        }
    }
    if weights > 0.0 {
        sum / weights
    } else {
        source[y * columns + x]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_sampling::CounterRng;
    use lightshed_testkit::check_faults;

    const COLUMNS: usize = 64;

    /// A floor on the left, a wall on the right, and nothing in the last rows.
    fn corner() -> Vec<Guide> {
        (0..COLUMNS * 48)
            .map(|i| {
                let (x, y) = (i % COLUMNS, i / COLUMNS);
                let (u, v) = (x as f32 * 0.01, y as f32 * 0.01);
                let (position, normal) = match (x < 32, y < 40) {
                    (true, true) => (Vec3::new(u, 0.0, v), Vec3::Y),
                    (false, true) => (Vec3::new(0.32, u - 0.32, v), -Vec3::X),
                    _ => (Vec3::ZERO, Vec3::ZERO),
                };
                Guide {
                    position,
                    normal,
                    distance: 1.0,
                }
            })
            .collect()
    }

    /// Noise on each surface shrinks to its mean, the step between surfaces stays, and where there
    /// is no surface nothing changes. A filter that ignores the surfaces, or one that stops after
    /// the first iteration, is noticed.
    #[test]
    fn noise_goes_and_edges_stay() {
        check_faults(&["blind", "once"], |fault| {
            let guides = corner();
            let clean = |i: usize| if i % COLUMNS < 32 { 0.8 } else { 0.2 };
            let mut rng = CounterRng::new(51, 0, 0);
            let noisy: Vec<f32> = (0..guides.len())
                .map(|i| if rng.next_f32() < clean(i) { 1.0 } else { 0.0 })
                .collect();
            let mut values = noisy.clone();
            let mut scratch = vec![0.0; values.len()];
            let mut judged = guides.clone();
            if fault == Some("blind") {
                judged.fill(guides[0]);
            }
            let iterations = if fault == Some("once") { 1 } else { 4 };
            filter(&mut values, &mut scratch, &judged, COLUMNS, iterations);
            let inside = || 0..COLUMNS * 40;
            let worst = inside().map(|i| (values[i] - clean(i)).abs()).fold(0.0, f32::max);
            // A binomial value has a variance of 0.16 here; four iterations average some 200 of
            // them, fewer at the rims.
            if worst > 0.2 {
                return Err(format!("off by {worst}"));
            }
            let surfaceless = (COLUMNS * 40..guides.len()).all(|i| values[i] == noisy[i]);
            surfaceless
                .then_some(())
                .ok_or("a value without a surface changed".to_owned())
        })
        .unwrap();
    }

    #[test]
    fn a_constant_stays() {
        let guides = corner();
        let mut values = vec![0.37; guides.len()];
        let mut scratch = values.clone();
        filter(&mut values, &mut scratch, &guides, COLUMNS, 5);
        assert!(values.iter().all(|v| (v - 0.37).abs() < 1e-6));
    }
}

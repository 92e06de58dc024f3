//! What limits which function.

use crate::limits::Limits;

/// The limit of the benchmarks whose names begin so.
pub struct Rule {
    begins: &'static str,
    /// In words.
    pub what: &'static str,
    /// In nanoseconds, for a benchmark of that size; `None` where something was not measured.
    pub limit: fn(&Limits<'_>, f64) -> Option<f64>,
}

/// The rule that knows most of a name.
pub fn find(id: &str) -> Option<&'static Rule> {
    let known = RULES.iter().filter(|rule| id.starts_with(rule.begins));
    known.max_by_key(|rule| rule.begins.len())
}

/// Bytes of a first cache: what is near.
const NEAR: f64 = 16_384.0;
/// Bytes of a node of a light tree, eight children each.
const LIGHT_NODE: f64 = 320.0;

const fn rule(begins: &'static str, what: &'static str, limit: fn(&Limits<'_>, f64) -> Option<f64>) -> Rule {
    Rule { begins, what, limit }
}

/// Nodes on the way to one of `n` lights, each on a line that is known when the one before has been
/// read, or by `read`.
fn descent(n: f64, read: impl Fn(f64) -> f64) -> f64 {
    let levels = (n.log2() / 3.0).ceil().max(1.0) as u32;
    (1..=levels)
        .map(|level| read(LIGHT_NODE * 8f64.powi(level as i32 - 1).min(n / 8.0)))
        .sum()
}

static RULES: &[Rule] = &[
    // Random numbers.
    rule("sampling/counter_rng", "a word in order", |l, _| {
        Some(l.words(1.0))
    }),
    rule("sampling/path_seed_stream", "a word in order", |l, _| {
        Some(l.words(1.0))
    }),
    rule("sampling/rand_", "a word in order", |l, _| Some(l.words(1.0))),
    rule("sampling/sobol_sampler", "a word in order", |l, _| {
        Some(l.words(1.0))
    }),
    // Tables.
    rule("sampling/alias_sample", "a read that does not wait", |l, n| {
        Some(l.read(16.0 * n))
    }),
    rule("sampling/alias2d_sample", "a read that does not wait", |l, n| {
        Some(l.read(16.0 * n))
    }),
    rule(
        "sampling/binary_search",
        "log₂ n reads that wait, near",
        |l, n| Some(n.log2() * l.waiting_read(NEAR)),
    ),
    rule(
        "sampling/piecewise1d_sample",
        "a read that does not wait",
        |l, n| Some(l.read(4.0 * n)),
    ),
    rule(
        "sampling/piecewise2d_sample",
        "two reads, the second waits",
        |l, n| Some(l.read(4.0 * n.sqrt()) + l.waiting_read(4.0 * n)),
    ),
    rule("sampling/piecewise2d_pdf", "a read that does not wait", |l, n| {
        Some(l.read(4.0 * n))
    }),
    rule("sampling/choose", "16 reads, near", |l, _| {
        Some(16.0 * l.read(NEAR))
    }),
    rule("sampling/alias_build", "a copy of 16 bytes", |l, n| {
        Some(l.copy(16.0, 16.0 * n))
    }),
    rule("sampling/piecewise1d_build", "a copy of 4 bytes", |l, n| {
        Some(l.copy(4.0, 4.0 * n))
    }),
    rule("sampling/piecewise2d_build", "a copy of 4 bytes", |l, n| {
        Some(l.copy(4.0, 4.0 * n))
    }),
    // Geometry and sums.
    rule("sampling/octahedral_", "two words", |l, _| Some(l.words(2.0))),
    rule(
        "sampling/frame_from_normal",
        "a copy of 48 bytes, near",
        |l, _| Some(l.copy(48.0, NEAR)),
    ),
    rule("sampling/plain_sum", "a copy of 4 bytes", |l, n| {
        Some(l.copy(4.0, 4.0 * n))
    }),
    rule("sampling/pairwise_sum", "a copy of 4 bytes", |l, n| {
        Some(l.copy(4.0, 4.0 * n))
    }),
    rule("sampling/compensated_sum", "the plain sum", |l, _| {
        l.part("sampling/plain_sum/65536")
    }),
    // Warps.
    rule("sampling/warp_", "the two words it is made of", |l, _| {
        Some(l.words(2.0))
    }),
    rule("sampling/warp_free_flight", "the word it is made of", |l, _| {
        Some(l.words(1.0))
    }),
    rule("sampling/warp_sin_cos", "the word it is made of", |l, _| {
        Some(l.words(1.0))
    }),
    // Resampling.
    rule("resampling/candidate_", "the two words of a choice", |l, _| {
        Some(l.words(2.0))
    }),
    rule(
        "resampling/candidate_selection_record",
        "the word of a choice",
        |l, _| Some(l.words(1.0)),
    ),
    rule(
        "resampling/candidate_jump_selection",
        "a copy of 8 bytes",
        |l, n| Some(l.copy(8.0, 8.0 * n)),
    ),
    rule("resampling/merge_", "a candidate for each reservoir", |l, n| {
        Some(n * l.part("resampling/candidate_ris/4096")?)
    }),
    // Scenes.
    rule("scene/bsdf_resolve", "a copy of 64 bytes, near", |l, _| {
        Some(l.copy(64.0, NEAR))
    }),
    rule(
        "scene/bsdf_evaluate",
        "four reads that wait, near: operations",
        |l, _| Some(4.0 * l.waiting_read(NEAR)),
    ),
    rule("scene/bsdf_sample", "the three words it is made of", |l, _| {
        Some(l.words(3.0))
    }),
    rule(
        "scene/rays_nearest_alone",
        "four reads that wait, 8 MB",
        |l, _| Some(4.0 * l.waiting_read(8e6)),
    ),
    rule(
        "scene/rays_nearest_together",
        "four reads that do not wait, 8 MB",
        |l, _| Some(4.0 * l.read(8e6)),
    ),
    rule(
        "scene/rays_any_together",
        "four reads that do not wait, 8 MB",
        |l, _| Some(4.0 * l.read(8e6)),
    ),
    rule(
        "scene/build",
        "a copy of 36 bytes and a sort of its code",
        |l, _| Some(l.copy(36.0, 3e6) + l.part("lights/sort_codes/100000")?),
    ),
    rule("scene/few", "reads of all triangles, near", |l, n| {
        Some(n * 36.0 / 64.0 * l.read(NEAR))
    }),
    rule(
        "scene/emitter_sample",
        "four words, a read that does not wait",
        |l, n| Some(l.words(4.0) + l.read(64.0 * n)),
    ),
    rule("scene/emitter_pdf", "a read that does not wait", |l, n| {
        Some(l.read(64.0 * n))
    }),
    rule("scene/sky_sample", "two words and two reads, 512 KB", |l, _| {
        Some(l.words(2.0) + 2.0 * l.read(5e5))
    }),
    rule("scene/sky_", "two reads, 512 KB", |l, _| Some(2.0 * l.read(5e5))),
    rule("scene/texture_bilinear", "two reads that do not wait", |l, n| {
        Some(2.0 * l.read(3.0 * n))
    }),
    rule("scene/texture_nearest", "a read that does not wait", |l, n| {
        Some(l.read(3.0 * n))
    }),
    // Many lights.
    rule("lights/copy", "a copy of 48 bytes", |l, n| {
        Some(l.copy(48.0, 96.0 * n))
    }),
    rule("lights/sort_codes", "two copies of 16 bytes", |l, n| {
        Some(l.copy(32.0, 32.0 * n))
    }),
    rule(
        "lights/build_",
        "the copy of the lights and the sort of their codes",
        |l, n| Some(l.part(&format!("lights/copy/{n}"))? + l.part(&format!("lights/sort_codes/{n}"))?),
    ),
    rule(
        "lights/rebuild_",
        "the copy of the lights and the sort of their codes",
        |l, n| Some(l.part(&format!("lights/copy/{n}"))? + l.part(&format!("lights/sort_codes/{n}"))?),
    ),
    rule("lights/sample_", "a read that does not wait a level", |l, n| {
        Some(descent(n, |bytes| l.read(bytes)))
    }),
    rule("lights/sample_perfect", "a read that waits a level", |l, n| {
        Some(descent(n, |bytes| l.waiting_read(bytes)))
    }),
    rule("lights/sample_bvh", "a read that waits a level", |l, n| {
        Some(descent(n, |bytes| l.waiting_read(bytes)))
    }),
    rule("lights/sample_curve_bvh", "a read that waits a level", |l, n| {
        Some(descent(n, |bytes| l.waiting_read(bytes)))
    }),
    rule("lights/sample_uniform", "the two words it is made of", |l, _| {
        Some(l.words(2.0))
    }),
    rule(
        "lights/sample_power",
        "two words, a read that does not wait",
        |l, n| Some(l.words(2.0) + l.read(16.0 * n)),
    ),
    rule("lights/pmf_", "a read that does not wait a level", |l, n| {
        Some(descent(n, |bytes| l.read(bytes)))
    }),
    rule("lights/pmf_uniform", "a word", |l, _| Some(l.words(1.0))),
    rule("lights/pmf_power", "a read that does not wait", |l, n| {
        Some(l.read(16.0 * n))
    }),
    rule("lights/grid_gather", "a copy of 64 bytes", |l, n| {
        Some(l.copy(64.0, 64.0 * n))
    }),
    rule("lights/grid_scatter", "a copy of 64 bytes", |l, n| {
        Some(l.copy(64.0, 64.0 * n))
    }),
    rule(
        "lights/grid_move_one",
        "a copy of all lights, 64 bytes each",
        |l, n| Some(l.copy(64.0 * n, 64.0 * n)),
    ),
    rule(
        "lights/grid_move_permille",
        "a copy of a thousand lights",
        |l, n| Some(l.copy(64e3, 64.0 * n)),
    ),
    rule(
        "lights/grid_move_percent",
        "a copy of a hundred lights",
        |l, n| Some(l.copy(64e2, 64.0 * n)),
    ),
    rule("lights/grid_move_tenth", "a copy of ten lights", |l, n| {
        Some(l.copy(640.0, 64.0 * n))
    }),
    rule("lights/grid_irradiance", "a read that does not wait", |l, n| {
        Some(l.read(64.0 * n))
    }),
    rule("lights/irradiance_of_all", "a copy of 64 bytes", |l, n| {
        Some(l.copy(64.0, 64.0 * n))
    }),
    // Paths.
    rule(
        "integrator/paths_",
        "eight words at each of five vertices",
        |l, _| Some(l.words(40.0)),
    ),
    rule("film/film_add", "a copy of 48 bytes, near", |l, _| {
        Some(l.copy(48.0, NEAR))
    }),
    rule("film/render_loop", "the sum of a sample in the film", |l, _| {
        l.part("film/film_add/1024")
    }),
    rule("film/film_merge", "a copy of 48 bytes", |l, n| {
        Some(l.copy(48.0, 96.0 * n))
    }),
    rule("film/ssim", "a copy of 24 bytes", |l, n| {
        Some(l.copy(24.0, 24.0 * n))
    }),
    rule("film/comparison", "a copy of 24 bytes", |l, n| {
        Some(l.copy(24.0, 24.0 * n))
    }),
    rule("shift/trees_", "a path in a batch in `cornell`", |l, _| {
        l.part("integrator/paths_cornell/4096")
    }),
    rule("shift/shift_", "a shadow ray among 36 triangles", |l, _| {
        l.part("scene/few/any_together/flat/36")
    }),
    // Media.
    rule("volume/segments", "two reads, near", |l, _| {
        Some(2.0 * l.read(NEAR))
    }),
    rule("volume/tentative_collisions", "two words", |l, _| {
        Some(l.words(2.0))
    }),
    rule("volume/lookups_trilinear", "eight reads, near", |l, _| {
        Some(8.0 * l.read(NEAR))
    }),
    rule("volume/lookups_nearest", "a read, near", |l, _| {
        Some(l.read(NEAR))
    }),
    rule(
        "volume/ratio_trilinear",
        "two words, eight reads, near",
        |l, _| Some(l.words(2.0) + 8.0 * l.read(NEAR)),
    ),
    rule("volume/ratio_nearest", "two words, a read, near", |l, _| {
        Some(l.words(2.0) + l.read(NEAR))
    }),
    rule(
        "volume/ratio_one_majorant_trilinear",
        "two words, eight reads, near",
        |l, _| Some(l.words(2.0) + 8.0 * l.read(NEAR)),
    ),
    rule(
        "volume/ratio_one_majorant_nearest",
        "two words, a read, near",
        |l, _| Some(l.words(2.0) + l.read(NEAR)),
    ),
    rule(
        "volume/residual_ratio_trilinear",
        "two words, eight reads, near",
        |l, _| Some(l.words(2.0) + 8.0 * l.read(NEAR)),
    ),
    rule(
        "volume/residual_ratio_nearest",
        "two words, a read, near",
        |l, _| Some(l.words(2.0) + l.read(NEAR)),
    ),
    rule(
        "volume/delta_trilinear",
        "three words, eight reads, near",
        |l, _| Some(l.words(3.0) + 8.0 * l.read(NEAR)),
    ),
    rule("volume/delta_nearest", "three words, a read, near", |l, _| {
        Some(l.words(3.0) + l.read(NEAR))
    }),
    rule("volume/regular_", "a read that does not wait, 64 MB", |l, _| {
        Some(l.read(6.4e7))
    }),
];

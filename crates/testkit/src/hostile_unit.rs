//! Hostile uniforms. The tests of precision include this file, too, so it names nothing of the
//! crate.

/// Uniforms in [0, 1) at which warps break: 0, the smallest positive values, neighbours of
/// fractions at which warps branch, and the largest uniform `1 − 2⁻²⁴`.
pub fn hostile_unit_f32() -> impl Iterator<Item = f32> + Clone {
    [
        0.0,
        1e-45,
        f32::MIN_POSITIVE,
        1e-20,
        5.960_464_5e-8,
        1e-4,
        0.124_999_99,
        0.125,
        0.25,
        0.333_333_34,
        0.499_999_97,
        0.5,
        0.500_000_06,
        0.75,
        0.9,
        0.999,
        0.999_999_9,
        0.999_999_94,
    ]
    .into_iter()
}

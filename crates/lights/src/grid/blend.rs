//! The level that serves each distance.

/// The blending functions `B_ℓ(d)`. They divide every distance `d ≥ 0` between at most two
/// neighbouring levels: `Σ_ℓ B_ℓ(d) = 1` (Lin 2022 §3.2.2, fig. 3.2).
///
/// With `r_ℓ = α h_ℓ`, so `r_{ℓ+1} = 2 r_ℓ`, `B_ℓ` rises from 0 at `r_ℓ/2` to 1 at
/// `r_ℓ` and falls to 0 at `2 r_ℓ`, linearly in `d²`. (Ramps that are linear in `d` add up to
/// one as well; these have a slightly smaller error at every α and need no root.) The first level
/// does not rise but starts with 1, the last does not fall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlendingFunctions {
    /// `r_0`.
    radius_0: f32,
    first: u32,
    last: u32,
}

impl BlendingFunctions {
    /// Of levels `first..=last`, the first being at most 1, with `r_0 = α h_0` (half of `r_1`).
    pub(super) fn new(radius_0: f32, first: u32, last: u32) -> Self {
        Self {
            radius_0,
            first,
            last,
        }
    }

    /// `r_ℓ`, the distance that level ℓ serves alone.
    #[inline(always)]
    pub fn radius(&self, level: u32) -> f32 {
        self.radius_0 * (1u64 << level.min(63)) as f32
    }

    /// The first level used: 0 for the lights themselves, or 1.
    #[inline(always)]
    pub fn first_level(&self) -> u32 {
        self.first
    }

    /// The last level.
    #[inline(always)]
    pub fn last_level(&self) -> u32 {
        self.last
    }

    /// Distance from which on `B_ℓ` is zero; infinite for the last level.
    #[inline(always)]
    pub fn reach(&self, level: u32) -> f32 {
        if level >= self.last {
            f32::INFINITY
        } else {
            2.0 * self.radius(level)
        }
    }

    /// `B_ℓ(distance)`, in [0, 1]. Zero for a level out of range.
    #[inline(always)]
    pub fn weight(&self, level: u32, distance: f32) -> f32 {
        if level < self.first || level > self.last {
            return 0.0;
        }
        self.ramps(level).weight(distance * distance)
    }

    /// The two ramps of one level, with precomputed constants.
    #[inline(always)]
    pub(super) fn ramps(&self, level: u32) -> Ramps {
        Ramps {
            per_radius_squared: 1.0 / (self.radius(level) * self.radius(level)),
            rises: level > self.first,
            falls: level < self.last,
        }
    }
}

/// `B_ℓ` of one level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ramps {
    per_radius_squared: f32,
    rises: bool,
    falls: bool,
}

impl Ramps {
    #[inline(always)]
    pub fn weight(&self, distance_squared: f32) -> f32 {
        let t = distance_squared * self.per_radius_squared;
        let up = if self.rises { (4.0 * t - 1.0) / 3.0 } else { 1.0 };
        let down = if self.falls { (4.0 - t) / 3.0 } else { 1.0 };
        up.min(down).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_testkit::check_faults;

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// The rise starts at zero distance.
        RisesFromZero,
        /// A level ends where the next one is complete, minus a tenth.
        EndsEarly,
        /// The last level falls too.
        LastFalls,
    }

    /// Over 24 octaves of distance and several α: the sum is 1 to 1e-6, no more than two
    /// neighbours take part, and nothing reaches beyond `reach`. With each planted fault that
    /// fails.
    #[test]
    fn blending_functions_partition_unity() {
        check_faults(
            &[Fault::RisesFromZero, Fault::EndsEarly, Fault::LastFalls],
            |fault| {
                for (alpha, first, last) in [
                    (0.5f32, 0, 7),
                    (1.0, 1, 7),
                    (2.0, 0, 1),
                    (4.0, 1, 1),
                    (0.3, 0, 11),
                ] {
                    let blend = BlendingFunctions::new(alpha * 0.37, first, last);
                    for i in 0..6000 {
                        let distance = blend.radius(0) * (2.0f32).powf(-8.0 + 24.0 * i as f32 / 6000.0);
                        let weight = |level: u32| {
                            let t = distance / blend.radius(level);
                            let rises = level > first;
                            match fault {
                                None => blend.weight(level, distance),
                                Some(Fault::RisesFromZero) if rises && t < 1.0 => t,
                                Some(Fault::EndsEarly) if level < last && t > 1.0 => {
                                    (1.0 - (t - 1.0) / 0.9).max(0.0)
                                }
                                Some(Fault::LastFalls) if level == last && t > 1.0 => (2.0 - t).max(0.0),
                                Some(_) => blend.weight(level, distance),
                            }
                        };
                        let weights: Vec<f32> = (0..=last + 1).map(weight).collect();
                        let sum: f32 = weights.iter().sum();
                        if (sum - 1.0).abs() > 1e-6 {
                            return Err(format!("{sum} at {distance}, alpha {alpha}"));
                        }
                        let used: Vec<usize> = (0..weights.len()).filter(|&l| weights[l] > 0.0).collect();
                        assert!(
                            used.len() <= 2 && used[used.len() - 1] - used[0] <= 1,
                            "{weights:?}"
                        );
                        for &level in &used {
                            assert!(distance <= blend.reach(level as u32));
                        }
                    }
                }
                Ok(())
            },
        )
        .unwrap();
    }

    #[test]
    fn each_level_serves_its_radius_alone() {
        let blend = BlendingFunctions::new(0.5, 0, 4);
        for level in 0..=4 {
            assert_eq!(blend.weight(level, blend.radius(level)), 1.0);
        }
        assert_eq!(blend.weight(0, 0.0), 1.0);
        assert_eq!(blend.weight(4, 1e30), 1.0);
        assert_eq!(blend.weight(5, 1.0), 0.0);
    }
}

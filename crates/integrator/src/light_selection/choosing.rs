//! Selections before anything is sampled on what they select, alone and together.

use super::LightSelection;
use super::sampler::{Sampler, with_sampler};
use lightshed_lights::{LightChoice, LightSampler, ShadingPoint};

/// A selected emitter, or a group of them.
#[derive(Clone, Copy)]
pub(super) enum Chosen {
    /// The finite emitter of this index, with this probability.
    Finite { emitter: u32, probability: f32 },
    /// One of those at infinity, by this uniform number.
    Infinite { u: u64 },
}

impl LightSelection<'_> {
    /// The group of emitters that `u` selects, and the number for the selection within it; `None`
    /// if there are none.
    #[inline(always)]
    fn route(&self, u: u64) -> Option<Route> {
        // The high part of the product is the group, the low part a fresh uniform number within it.
        let routed = u128::from(u) * u128::from(self.groups);
        let (group, rest) = ((routed >> 64) as u32, routed as u64);
        if self.sampler.is_some() && group == 0 {
            return Some(Route::Finite(rest));
        }
        // Among those at infinity: the number's position within all their groups.
        let first = u32::from(self.sampler.is_some());
        let infinite = u64::from(self.groups - first);
        let share = u64::MAX.checked_div(infinite)?;
        Some(Route::Infinite(
            share * u64::from(group - first) + rest / infinite,
        ))
    }

    #[inline(always)]
    fn finite(&self, choice: LightChoice) -> Chosen {
        Chosen::Finite {
            emitter: choice.light,
            probability: choice.pmf * self.finite_probability,
        }
    }

    /// Selects by 64 uniform bits; `None` selects none.
    #[inline]
    pub(super) fn choose(&self, at: &ShadingPoint, u: u64) -> Option<Chosen> {
        match self.route(u)? {
            Route::Finite(u) => {
                let sampler = self.sampler.as_deref()?;
                let choice = with_sampler!(sampler, s => s.sample(at, u))?;
                Some(self.finite(choice))
            }
            Route::Infinite(u) => Some(Chosen::Infinite { u }),
        }
    }

    /// Many selections, up to [`TOGETHER`]: `chosen[i]` is [`choose`](Self::choose) for `u[i]`.
    /// `choices` makes those among finite emitters; it gets the sampler, the indices in `u`, the
    /// numbers and room for the choices.
    #[inline(always)]
    pub(super) fn choose_together(
        &self,
        u: &[u64],
        chosen: &mut [Option<Chosen>],
        choices: impl FnOnce(&Sampler, &[u8], &[u64], &mut [Option<LightChoice>]),
    ) {
        let (mut finite, mut places, mut count) = ([0; TOGETHER], [0u8; TOGETHER], 0);
        for (place, (&u, chosen)) in u.iter().zip(chosen.iter_mut()).enumerate() {
            *chosen = None;
            match self.route(u) {
                Some(Route::Finite(u)) => {
                    (finite[count], places[count]) = (u, place as u8);
                    count += 1;
                }
                Some(Route::Infinite(u)) => *chosen = Some(Chosen::Infinite { u }),
                None => {}
            }
        }
        let Some(sampler) = self.sampler.as_deref() else {
            return;
        };
        let mut made = [None; TOGETHER];
        choices(sampler, &places[..count], &finite[..count], &mut made[..count]);
        for (place, choice) in places[..count].iter().zip(made) {
            chosen[*place as usize] = choice.map(|choice| self.finite(choice));
        }
    }
}

/// The group of emitters that a number selects, and the number left for it.
enum Route {
    Finite(u64),
    Infinite(u64),
}

/// Choices that are made together, at most.
pub(super) const TOGETHER: usize = 16;

//! Lanes in plain arrays.

use super::Lanes;

/// The specification of [`Lanes`], for any machine.
#[derive(Clone, Copy, Debug)]
pub struct ArrayLanes([f32; 8]);

#[inline(always)]
fn lanewise(a: ArrayLanes, b: ArrayLanes, f: impl Fn(f32, f32) -> f32) -> ArrayLanes {
    ArrayLanes(core::array::from_fn(|i| f(a.0[i], b.0[i])))
}

#[inline(always)]
fn mask(a: ArrayLanes, b: ArrayLanes, f: impl Fn(f32, f32) -> bool) -> u32 {
    (0..8).fold(0, |bits, i| bits | u32::from(f(a.0[i], b.0[i])) << i)
}

impl Lanes for ArrayLanes {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; 8])
    }
    #[inline(always)]
    fn load(values: &[f32; 8]) -> Self {
        Self(*values)
    }
    #[inline(always)]
    fn store(self) -> [f32; 8] {
        self.0
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        lanewise(self, other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        lanewise(self, other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        lanewise(self, other, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        lanewise(self, other, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        lanewise(self, other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        lanewise(self, other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn compress(self, mask: u32, flip: u32) -> Self {
        Self(super::COMPRESS[mask as usize & 255].map(|bit| self.0[(bit ^ flip) as usize & 7]))
    }
    #[inline(always)]
    fn least_of(self, mask: u32) -> Self {
        let chosen = (0..8)
            .filter(|lane| mask >> lane & 1 == 1)
            .map(|lane| self.0[lane]);
        Self(
            [chosen.fold(
                f32::INFINITY,
                |least, value| if value < least { value } else { least },
            ); 8],
        )
    }
    #[inline(always)]
    fn first(self) -> f32 {
        self.0[0]
    }
    #[inline(always)]
    fn equal(self, other: Self) -> u32 {
        mask(self, other, |a, b| a == b)
    }
    #[inline(always)]
    fn less(self, other: Self) -> u32 {
        mask(self, other, |a, b| a < b)
    }
    #[inline(always)]
    fn less_equal(self, other: Self) -> u32 {
        mask(self, other, |a, b| a <= b)
    }
}

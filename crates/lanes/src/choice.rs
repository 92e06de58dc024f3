//! Which lanes a CPU has, and running code on them.

use crate::{ArrayLanes, LaneKernel};
use std::sync::OnceLock;

#[cfg(target_arch = "x86_64")]
use crate::x86::{Avx2, Avx512};

/// Which lanes to run on, found out once.
#[derive(Clone, Copy, Debug)]
pub struct LaneChoice(Choice);

#[derive(Clone, Copy, Debug)]
enum Choice {
    Array,
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// The second runs kernels that are not compiled for the first.
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512, Avx2),
}

impl LaneChoice {
    /// Plain arrays: the specification, which tests compare the others with.
    pub const ARRAY: Self = Self(Choice::Array);

    /// The fastest lanes of this CPU. If the environment variable `LIGHTSHED_LANES` is the name of
    /// lanes that it has ([`LaneChoice::name`]), those; it is read once.
    #[inline]
    pub fn best() -> Self {
        static BEST: OnceLock<LaneChoice> = OnceLock::new();
        *BEST.get_or_init(|| {
            let all = Self::all();
            let asked = std::env::var("LIGHTSHED_LANES").ok();
            let named = all.iter().find(|lanes| asked.as_deref() == Some(lanes.name()));
            *named.or(all.last()).unwrap_or(&Self::ARRAY)
        })
    }

    /// All lanes of this CPU, slower ones first.
    pub fn all() -> Vec<Self> {
        #[allow(unused_mut)]
        let mut all = vec![Self::ARRAY];
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = Avx2::detect() {
            all.push(Self(Choice::Avx2(avx2)));
            if let Some(avx512) = Avx512::detect() {
                all.push(Self(Choice::Avx512(avx512, avx2)));
            }
        }
        all
    }

    /// What they are called: `array`, `avx2` or `avx512`.
    pub fn name(self) -> &'static str {
        match self.0 {
            Choice::Array => "array",
            #[cfg(target_arch = "x86_64")]
            Choice::Avx2(_) => "avx2",
            #[cfg(target_arch = "x86_64")]
            Choice::Avx512(..) => "avx512",
        }
    }

    /// Runs `kernel` on these lanes; on AVX2 instead of AVX-512 if it is not
    /// [`HOT`](LaneKernel::HOT).
    #[inline(always)]
    pub fn run<K: LaneKernel>(self, kernel: K) -> K::Output {
        match self.0 {
            Choice::Array => run_array(kernel),
            #[cfg(target_arch = "x86_64")]
            Choice::Avx2(avx2) => avx2.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Choice::Avx512(avx512, avx2) => {
                if K::HOT {
                    avx512.run(kernel)
                } else {
                    avx2.run(kernel)
                }
            }
        }
    }
}

/// A kernel on plain arrays is much code: it is compiled once, next to the AVX2 kernel, and not
/// into every caller.
#[inline(never)]
fn run_array<K: LaneKernel>(kernel: K) -> K::Output {
    kernel.run::<ArrayLanes>()
}

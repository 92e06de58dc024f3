//! The domains of a pass, by index.

use crate::domain::Domain;
use std::sync::Arc;

/// The domains that a pass reuses among, by index: pixels of a frame, cells, prefixes with their
/// suffix spaces.
///
/// Some may be *absent*: a background pixel has nothing to integrate, an empty cell serves no
/// pixel. An absent domain is left out. Its reservoir becomes the empty one of confidence 0, and no
/// other domain reads it.
///
/// Slices, arrays and vectors of `D` or of `Option<D>` are domains, and so are references and
/// [`Arc`]s of domains. A renderer that keeps more about a pixel implements the trait for its own
/// container.
pub trait Domains: Sync {
    /// What one of them is.
    type Domain: Domain;

    /// How many indices there are, absent domains among them.
    fn count(&self) -> usize;

    /// The domain at `index`; `None` where it is absent or `index` is out of range.
    fn domain(&self, index: usize) -> Option<&Self::Domain>;
}

impl<D: Domain + Sync> Domains for [D] {
    type Domain = D;

    #[inline]
    fn count(&self) -> usize {
        self.len()
    }

    #[inline(always)]
    fn domain(&self, index: usize) -> Option<&D> {
        self.get(index)
    }
}

impl<D: Domain + Sync> Domains for [Option<D>] {
    type Domain = D;

    #[inline]
    fn count(&self) -> usize {
        self.len()
    }

    #[inline(always)]
    fn domain(&self, index: usize) -> Option<&D> {
        self.get(index)?.as_ref()
    }
}

/// What all containers do.
macro_rules! delegate {
    () => {
        #[inline]
        fn count(&self) -> usize {
            (**self).count()
        }

        #[inline(always)]
        fn domain(&self, index: usize) -> Option<&Self::Domain> {
            (**self).domain(index)
        }
    };
}

impl<S: Domains + ?Sized> Domains for &S {
    type Domain = S::Domain;
    delegate!();
}

impl<S: Domains + Send + ?Sized> Domains for Arc<S> {
    type Domain = S::Domain;
    delegate!();
}

impl<X: Sync> Domains for Vec<X>
where
    [X]: Domains,
{
    type Domain = <[X] as Domains>::Domain;
    delegate!();
}

impl<X: Sync, const N: usize> Domains for [X; N]
where
    [X]: Domains,
{
    type Domain = <[X] as Domains>::Domain;

    #[inline]
    fn count(&self) -> usize {
        N
    }

    #[inline(always)]
    fn domain(&self, index: usize) -> Option<&Self::Domain> {
        self.as_slice().domain(index)
    }
}

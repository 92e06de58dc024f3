//! The interface between trackers and a density.

use crate::{FieldBounds, FieldRay};
use glam::Vec3;
use lightshed_lanes::{LANES, LaneChoice, LaneKernel, Lanes, Vec3Lanes};

/// Bounds of a density over a region: `min ≤ ρ(x) ≤ max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DensityRange {
    /// A lower bound, not below 0.
    pub min: f32,
    /// An upper bound.
    pub max: f32,
}

impl DensityRange {
    /// The range of an unknown region: the neutral element of [`DensityRange::union`].
    pub const EMPTY: Self = Self {
        min: f32::INFINITY,
        max: 0.0,
    };

    /// The range of both regions together.
    #[inline(always)]
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }
}

/// A density `ρ(x) ≥ 0` over a box, without unit: extinction is `σ_t(x) = k ρ(x)` with a
/// user's coefficient `k` per unit of a ray's parameter ([`FieldRay`](crate::FieldRay)), one number
/// or one a channel.
///
/// Outside of its bounds there is no medium: trackers clip rays to them, and never look up outside.
pub trait DensityField {
    /// Looks up densities along one ray, and may keep data that neighbouring look-ups share.
    type Accessor<'a>: DensityAccessor
    where
        Self: 'a;

    /// The region of the medium, in the field's space.
    fn bounds(&self) -> FieldBounds;

    /// A fresh accessor for one ray; cheap.
    fn accessor(&self) -> Self::Accessor<'_>;

    /// Bounds of the density over the closed box from `low` to `high`, for points off by rounding
    /// as well. Need not be tight, but tighter bounds make faster trackers.
    fn range(&self, low: Vec3, high: Vec3) -> DensityRange;

    /// `ρ(x)`. For a point outside of the bounds it is unspecified, but finite and not negative.
    #[inline]
    fn density(&self, position: Vec3) -> f32 {
        self.accessor().density(position)
    }
}

/// Looks up the densities of a [`DensityField`].
pub trait DensityAccessor {
    /// `ρ(x)` as [`DensityField::density`], for any earlier look-ups.
    fn density(&mut self, position: Vec3) -> f32;

    /// `ρ` at the points of `ray` given by the first `count` lanes of `t`, with the bits of single
    /// look-ups; the other lanes are unspecified.
    ///
    /// Trackers call it from [lane kernels](lightshed_lanes::LaneKernel); an override must be
    /// `#[inline(always)]` and have plain loops.
    #[inline(always)]
    fn densities<L: Lanes>(&mut self, ray: &FieldRay, t: L, count: usize) -> L
    where
        Self: Sized,
    {
        let t = t.store();
        let mut values = [0.0; LANES];
        for lane in 0..count.min(LANES) {
            values[lane] = self.density(ray.at(t[lane]));
        }
        L::load(&values)
    }

    /// `ρ` at eight points, one a lane, as [`density`](Self::density) but for rounding.
    ///
    /// Called from lane kernels, as [`densities`](Self::densities).
    #[inline(always)]
    fn densities_of<L: Lanes>(&mut self, points: Vec3Lanes<L>) -> L
    where
        Self: Sized,
    {
        let ([x, y, z], mut values) = (points.store(), [0.0; LANES]);
        for lane in 0..LANES {
            values[lane] = self.density(Vec3::new(x[lane], y[lane], z[lane]));
        }
        L::load(&values)
    }
}

/// `ρ` at the points of `ray` at the first `count` of `t`: [`DensityAccessor::densities`] on the
/// machine's best lanes. The other values are unspecified.
#[inline]
pub fn densities_at<A: DensityAccessor>(
    density: &mut A,
    ray: &FieldRay,
    t: &[f32; LANES],
    count: usize,
) -> [f32; LANES] {
    LaneChoice::best().run(At {
        density,
        ray,
        t,
        count,
    })
}

struct At<'a, A> {
    density: &'a mut A,
    ray: &'a FieldRay,
    t: &'a [f32; LANES],
    count: usize,
}

impl<A: DensityAccessor> LaneKernel for At<'_, A> {
    type Output = [f32; LANES];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [f32; LANES] {
        self.density
            .densities(self.ray, L::load(self.t), self.count)
            .store()
    }
}

/// The same density everywhere in a box, or in all of space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Homogeneous {
    density: f32,
    bounds: FieldBounds,
}

impl Homogeneous {
    /// Density `ρ` within `bounds`; `None` unless it is finite and not negative.
    pub fn new(density: f32, bounds: FieldBounds) -> Option<Self> {
        (0.0..=f32::MAX)
            .contains(&density)
            .then_some(Self { density, bounds })
    }
}

impl DensityField for Homogeneous {
    type Accessor<'a> = Self;

    fn bounds(&self) -> FieldBounds {
        self.bounds
    }

    fn accessor(&self) -> Self {
        *self
    }

    fn range(&self, _: Vec3, _: Vec3) -> DensityRange {
        DensityRange {
            min: self.density,
            max: self.density,
        }
    }
}

impl DensityAccessor for Homogeneous {
    #[inline(always)]
    fn density(&mut self, _: Vec3) -> f32 {
        self.density
    }
}

/// A density by a function.
///
/// Values of the function below 0 and NaN count as 0, values above the upper bound of the range as
/// that bound. A bound that is too low changes the medium; trackers are right for the resulting
/// medium.
#[derive(Clone, Copy, Debug)]
pub struct Procedural<D, R> {
    density: D,
    range: R,
    bounds: FieldBounds,
    maximum: f32,
}

impl<D: Fn(Vec3) -> f32, R: Fn(Vec3, Vec3) -> DensityRange> Procedural<D, R> {
    /// The density `density(x)` within `bounds`. `range(low, high)` bounds it over a closed box, as
    /// [`DensityField::range`]; a function that always returns the range of the whole field is
    /// allowed. `None` unless the upper bound over all of `bounds` is finite and not negative.
    pub fn new(density: D, range: R, bounds: FieldBounds) -> Option<Self> {
        let maximum = range(bounds.min(), bounds.max()).max;
        (0.0..=f32::MAX).contains(&maximum).then_some(Self {
            density,
            range,
            bounds,
            maximum,
        })
    }
}

impl<D: Fn(Vec3) -> f32, R: Fn(Vec3, Vec3) -> DensityRange> DensityField for Procedural<D, R> {
    type Accessor<'a>
        = ProceduralAccessor<'a, D>
    where
        Self: 'a;

    fn bounds(&self) -> FieldBounds {
        self.bounds
    }

    fn accessor(&self) -> ProceduralAccessor<'_, D> {
        ProceduralAccessor {
            density: &self.density,
            maximum: self.maximum,
        }
    }

    fn range(&self, low: Vec3, high: Vec3) -> DensityRange {
        let range = (self.range)(low, high);
        // NaN becomes the bound that is always true.
        DensityRange {
            min: range.min.max(0.0).min(self.maximum),
            max: if range.max <= self.maximum {
                range.max.max(0.0)
            } else {
                self.maximum
            },
        }
    }
}

/// Looks up a [`Procedural`] density.
#[derive(Clone, Copy, Debug)]
pub struct ProceduralAccessor<'a, D> {
    density: &'a D,
    maximum: f32,
}

impl<D: Fn(Vec3) -> f32> DensityAccessor for ProceduralAccessor<'_, D> {
    #[inline(always)]
    fn density(&mut self, position: Vec3) -> f32 {
        // `max` returns the other operand where one is NaN.
        (self.density)(position).max(0.0).min(self.maximum)
    }
}

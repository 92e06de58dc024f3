//! The nearest few of many surface sites.

use crate::SurfaceSite;

/// The distance of surface sites: `d² = |x − y|² + s² |n − m|²`, with positions `x`, `y`,
/// unit normals `n`, `m` and a length `s`. Sites that face opposite directions are at least `2 s`
/// apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SiteMetric {
    normal_scale_squared: f64,
}

impl SiteMetric {
    /// Positions alone.
    pub const POSITION: Self = Self {
        normal_scale_squared: 0.0,
    };

    /// The metric with `s = normal_scale`, in units of length; `None` unless it is finite and not
    /// negative.
    pub fn new(normal_scale: f32) -> Option<Self> {
        let scale = f64::from(normal_scale);
        (scale >= 0.0 && scale.is_finite()).then_some(Self {
            normal_scale_squared: scale * scale,
        })
    }

    /// `d²`, never less than the squared distance of the positions.
    #[inline(always)]
    pub fn distance_squared(&self, a: &SurfaceSite, b: &SurfaceSite) -> f64 {
        let between = (a.position.as_dvec3() - b.position.as_dvec3()).length_squared();
        let turned = (a.normal - b.normal).length_squared();
        between + self.normal_scale_squared * f64::from(turned)
    }
}

/// A site that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Its number.
    pub index: u32,
    /// `d²` from the query site.
    pub distance_squared: f64,
}

/// The nearest few of the offered sites, ordered by distance, then by number. So the result depends
/// on the set of sites, and not on the order in which a search finds them.
#[derive(Clone, Debug)]
pub struct Nearest {
    most: usize,
    within_squared: f64,
    found: Vec<Neighbour>,
}

impl Nearest {
    /// Room for the `most` nearest of those at most `within` away. A distance that is NaN or
    /// negative finds nothing.
    pub fn new(most: usize, within: f32) -> Self {
        let within = f64::from(within);
        Self {
            most,
            within_squared: if within >= 0.0 { within * within } else { -1.0 },
            found: Vec::with_capacity(most),
        }
    }

    /// Forgets what was found.
    #[inline]
    pub fn clear(&mut self) {
        self.found.clear();
    }

    /// The sites found, the nearest first.
    #[inline]
    pub fn found(&self) -> &[Neighbour] {
        &self.found
    }

    /// Whether it is full: from now on the farthest site leaves when a nearer one is added.
    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.found.len() >= self.most
    }

    /// `d²` beyond which no site is accepted; negative if none is.
    #[inline(always)]
    pub fn reach_squared(&self) -> f64 {
        match self.found.last() {
            Some(last) if self.is_full() => last.distance_squared,
            _ if self.most == 0 => -1.0,
            _ => self.within_squared,
        }
    }

    /// Adds the site if it is among the nearest so far. A distance that is NaN is not.
    #[inline]
    pub fn offer(&mut self, index: u32, distance_squared: f64) {
        // False for NaN.
        if !(distance_squared <= self.reach_squared()) {
            return;
        }
        let before = |other: &Neighbour| (other.distance_squared, other.index) < (distance_squared, index);
        let place = self.found.partition_point(before);
        if self.is_full() {
            if place == self.found.len() {
                return;
            }
            self.found.pop();
        }
        let neighbour = Neighbour {
            index,
            distance_squared,
        };
        self.found.insert(place, neighbour);
    }
}

/// A set of sites to search. All implementations find the same as the slice of the sites itself,
/// which checks every site.
pub trait NearestSites {
    /// Writes the sites nearest to `site` into `found`, replacing its content.
    fn nearest(&self, site: &SurfaceSite, metric: SiteMetric, found: &mut Nearest);
}

impl NearestSites for [SurfaceSite] {
    fn nearest(&self, site: &SurfaceSite, metric: SiteMetric, found: &mut Nearest) {
        found.clear();
        for (index, other) in (0..).zip(self) {
            found.offer(index, metric.distance_squared(site, other));
        }
    }
}

impl<T: NearestSites + ?Sized> NearestSites for &T {
    fn nearest(&self, site: &SurfaceSite, metric: SiteMetric, found: &mut Nearest) {
        (**self).nearest(site, metric, found);
    }
}

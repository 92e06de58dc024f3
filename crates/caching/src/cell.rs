//! Moments over the vertices of a cell.

use super::moments::VertexMoments;
use glam::DVec3;
use lightshed_sampling::LUMINANCE;

/// Moments of a cell's record over many vertices `y`, each with its own samples: `E[Y]`, `E[Y²]`
/// and `E[E[Y|y]²]`, channel by channel, and from them the local variance and the squared bias of
/// the record.
///
/// - `E[V[Y|y]] = E[Y²] − E[E[Y|y]²]` (eq. 7.16),
/// - `E[(E[Y|y] − E[Y])²] = E[E[Y|y]²] − E[Y]²` (eq. 7.17).
///
/// Neither is computed as a difference of moments. With weights `w_k`, means `m_k` and sample
/// variances `s_k²` of `n_k` samples, the first is the weighted mean of `s_k²`, and the second
/// the weighted sample variance of `m_k`, minus the part of it that is noise of the means:
/// `Σ w_k (m_k − M)² / (W − Σ w_k²/W) − (1/W) Σ w_k s_k²/n_k`. Both are unbiased for
/// vertices that are independent and identically distributed, for any weights; the second may be
/// negative. The sums around the mean are updated as by West 1979 and merged as by Chan, Golub and
/// LeVeque 1983.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CellMoments {
    /// `W = Σ w_k`.
    weight: f64,
    /// `Σ w_k²`.
    weight_squared: f64,
    /// `M = Σ w_k m_k / W`.
    mean: DVec3,
    /// `Σ w_k (m_k − M)²`.
    between: DVec3,
    /// `Σ w_k s_k²`.
    within: DVec3,
    /// `Σ w_k s_k² / n_k`.
    noise: DVec3,
}

impl CellMoments {
    /// Adds a vertex, with weight 1.
    pub fn push(&mut self, vertex: &VertexMoments) {
        if vertex.count == 0 || !(vertex.mean.is_finite() && vertex.variance.is_finite()) {
            return;
        }
        self.weight += 1.0;
        self.weight_squared += 1.0;
        let from = vertex.mean - self.mean;
        self.mean += from / self.weight;
        self.between += from * (vertex.mean - self.mean);
        self.within += vertex.variance;
        self.noise += vertex.variance / f64::from(vertex.count);
    }

    /// Multiplies the weights of all vertices so far.
    pub fn fade(&mut self, keep: f64) {
        self.weight *= keep;
        self.weight_squared *= keep * keep;
        self.between *= keep;
        self.within *= keep;
        self.noise *= keep;
    }

    /// The moments of the vertices of both.
    #[must_use]
    pub fn merged(&self, other: &Self) -> Self {
        let weight = self.weight + other.weight;
        if !(weight > 0.0) {
            return Self::default();
        }
        let apart = other.mean - self.mean;
        let (share, product) = (other.weight / weight, self.weight * (other.weight / weight));
        Self {
            weight,
            weight_squared: self.weight_squared + other.weight_squared,
            mean: self.mean + apart * share,
            between: self.between + other.between + apart * apart * product,
            within: self.within + other.within,
            noise: self.noise + other.noise,
        }
    }

    /// Sum of the weights.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// Divided by `W`, or 0 if there is nothing.
    fn per_weight(&self, sum: DVec3) -> DVec3 {
        match self.weight > 0.0 {
            true => sum / self.weight,
            false => DVec3::ZERO,
        }
    }

    /// An unbiased estimate of `E[Y]`: the radiance of the cell.
    pub fn mean(&self) -> DVec3 {
        self.mean
    }

    /// An unbiased estimate of `E[Y²]`.
    pub fn second(&self) -> DVec3 {
        self.marginal_second() + self.variance()
    }

    /// An unbiased estimate of `E[E[Y|y]²]`.
    pub fn marginal_second(&self) -> DVec3 {
        self.mean * self.mean + self.per_weight(self.between) - self.per_weight(self.noise)
    }

    /// An unbiased estimate of `E[V[Y|y]]`, the local variance (eq. 7.16).
    pub fn variance(&self) -> DVec3 {
        self.per_weight(self.within)
    }

    /// An unbiased estimate of `E[(E[Y|y] − E[Y])²]`, the squared bias of the record (eq. 7.17).
    /// 0 for a single vertex, which gives no information; may be negative.
    pub fn bias_squared(&self) -> DVec3 {
        let free = self.weight - self.weight_squared / self.weight;
        if !(free > 1e-9 * self.weight) {
            return DVec3::ZERO;
        }
        self.between / free - self.per_weight(self.noise)
    }

    /// Whether the squared bias `B` is certain and at least a share of the squared mean. Of means
    /// that are normally distributed, the sample variance `B + N` with the noise `N` has the
    /// relative standard deviation `√(2 / (n − 1))` for `n` vertices; `B` is certain if it is above
    /// three times that of `B + N`. Channels count by their squared share of luminance.
    pub fn is_biased(&self, least: f64) -> bool {
        let count = self.weight * self.weight / self.weight_squared;
        if !(count >= LEAST_VERTICES) {
            return false;
        }
        let shares = (LUMINANCE * LUMINANCE).as_dvec3();
        let bias = shares.dot(self.bias_squared());
        let noise = shares.dot(self.per_weight(self.noise));
        let deviation = (2.0 / (count - 1.0)).sqrt();
        bias > 3.0 * deviation * (bias + noise) && bias > least * shares.dot(self.mean * self.mean)
    }
}

/// Fewest vertices from which a bias is taken for certain.
const LEAST_VERTICES: f64 = 12.0;

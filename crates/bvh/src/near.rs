//! What lies near a point.

use crate::traverse::Waiting;
use crate::tree::Bvh;
use glam::Vec3;

/// `1 − 2γ(3)`, rounded down: how much nearer a box may be than single precision says.
const NEARER: f32 = 1.0 - 8.0 * f32::EPSILON;

impl Bvh {
    /// Visits the primitives with boxes near `point`, in nearly all cases the nearer boxes first.
    ///
    /// `visit(primitive)` returns the squared distance within which further primitives are wanted;
    /// at first it is `within_squared`. Primitives beyond it may be visited, too. A distance that
    /// is NaN ends the search. Trees of up to [`MAX_DEPTH`](crate::MAX_DEPTH) levels are searched
    /// without allocating.
    ///
    /// ```
    /// use lightshed_bvh::glam::Vec3;
    /// use lightshed_bvh::{Bounds, Bvh, Preset};
    ///
    /// let points: Vec<Vec3> = (0..50).map(|i| Vec3::X * i as f32).collect();
    /// let boxes: Vec<Bounds> = points.iter().map(|&point| Bounds::of_point(point)).collect();
    /// let tree = Bvh::build(&boxes, Preset::Fastest.options())?;
    /// let (center, mut nearest) = (Vec3::new(31.3, 2.0, 0.0), (f64::INFINITY, 0));
    /// tree.for_each_near(center, f64::INFINITY, |index| {
    ///     let squared = f64::from(points[index as usize].distance_squared(center));
    ///     nearest = if squared < nearest.0 { (squared, index) } else { nearest };
    ///     nearest.0
    /// });
    /// assert_eq!(nearest.1, 31);
    /// # Ok::<(), lightshed_bvh::BuildError>(())
    /// ```
    pub fn for_each_near(&self, point: Vec3, within_squared: f64, mut visit: impl FnMut(u32) -> f64) {
        let mut within = within_squared;
        let mut waiting = Waiting::default();
        let away = |index: usize| self.nodes[index].bounds().distance_squared_min(point) * NEARER;
        if !self.nodes.is_empty() {
            waiting.push(0, away(0));
        }
        while let Some((index, squared)) = waiting.pop() {
            // False for NaN.
            if !(f64::from(squared) <= within) {
                continue;
            }
            let index = index as usize;
            let Some([low, high]) = self.children(index) else {
                within = visit(self.order[self.nodes[index].first as usize]);
                continue;
            };
            let (a, b) = (away(low), away(high));
            let (near, far) = if a <= b {
                ((low, a), (high, b))
            } else {
                ((high, b), (low, a))
            };
            waiting.push(far.0 as u32, far.1);
            waiting.push(near.0 as u32, near.1);
        }
    }
}

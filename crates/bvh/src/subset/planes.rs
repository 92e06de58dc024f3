//! Finds the cluster of an item by planes.
//!
//! If an axis-aligned plane separates the centres below both children of a node of the subset's
//! tree, the plane in the middle between them divides all other items too, as if the builder had
//! seen them. An item is led from the root to a cluster. Items that follow each other along the
//! curve take nearly the same way. A block of them is therefore led as far as all its centres lie
//! on one side; then its parts are led on from there.

use crate::item::BoxItem;
use crate::node::Node;
use crate::tree::children;
use glam::Vec4;

/// Items that are led together, and parts of them.
const BLOCK: usize = 64;
const PART: usize = 8;

/// Least and greatest doubled centre.
type Centers = (Vec4, Vec4);

const NO_CENTERS: Centers = (Vec4::INFINITY, Vec4::NEG_INFINITY);

#[inline(always)]
fn around(a: Centers, b: Centers) -> Centers {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Where the items below a node are divided, or a cluster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Centres before it are below the first child.
    position: f32,
    /// The axis; for a cluster [`CLUSTER`].
    axis: u32,
    /// The child before it, and that behind; of a cluster its number.
    sides: [u32; 2],
}

const CLUSTER: u32 = u32::MAX;

impl Plane {
    /// Of a cluster.
    pub fn cluster(number: u32) -> Self {
        Self {
            position: 0.0,
            axis: CLUSTER,
            sides: [number; 2],
        }
    }

    /// The same between these children.
    pub fn between(self, first: u32, second: u32) -> Self {
        Self {
            sides: self.sides.map(|side| if side == 0 { first } else { second }),
            ..self
        }
    }

    /// Where the gap between two groups of centres is largest; `None` if there is none. Its sides
    /// are 0 and 1.
    fn separating(first: &Centers, second: &Centers) -> Option<Self> {
        let mut best = None;
        let mut widest = 0.0;
        for axis in 0..3 {
            for (low, high, sides) in [(first, second, [0, 1]), (second, first, [1, 0])] {
                let (end, start) = (low.1[axis], high.0[axis]);
                let gap = start - end;
                if gap > widest {
                    widest = gap;
                    let middle = end + 0.5 * gap;
                    best = Some(Self {
                        position: if middle > end { middle } else { start },
                        axis: axis as u32,
                        sides,
                    });
                }
            }
        }
        best
    }
}

/// The plane of each node of a tree in depth-first order that has one. In `centers`, which has as
/// many places as there are nodes, the centres below each are remembered.
pub fn separating(nodes: &[Node], centers: &mut [BoxItem]) -> Vec<Option<Plane>> {
    // As rows of two corners.
    let centers: &mut [[Vec4; 2]] = bytemuck::cast_slice_mut(centers);
    let mut planes = vec![None; nodes.len()];
    for index in (0..nodes.len()).rev() {
        centers[index] = match children(nodes, index) {
            Some([first, second]) => {
                let ([a, b], [c, d]) = (centers[first], centers[second]);
                planes[index] = Plane::separating(&(a, b), &(c, d));
                around((a, b), (c, d)).into()
            }
            None => [BoxItem::new(&nodes[index].bounds(), 0).doubled_center(); 2],
        };
    }
    planes
}

/// Leads items from the root to clusters, by their doubled centres; the fourth coordinate means
/// nothing.
pub fn lead<I>(planes: &[Plane], items: &[I], center: impl Fn(&I) -> Vec4, choices: &mut [u32]) {
    for (items, choices) in items.chunks(BLOCK).zip(choices.chunks_mut(BLOCK)) {
        let mut of_parts = [NO_CENTERS; BLOCK / PART];
        let mut all = NO_CENTERS;
        for (part, items) in of_parts.iter_mut().zip(items.chunks(PART)) {
            for item in items {
                let center = center(item);
                *part = around(*part, (center, center));
            }
            all = around(all, *part);
        }
        let from = lead_all(planes, 0, &all);
        let parts = items.chunks(PART).zip(choices.chunks_mut(PART));
        for ((items, choices), part) in parts.zip(&of_parts) {
            let from = lead_all(planes, from, part);
            for (item, choice) in items.iter().zip(choices) {
                *choice = lead_one(planes, from, center(item));
            }
        }
    }
}

/// The last node from `node` on to which all of these centres lead.
fn lead_all(planes: &[Plane], mut node: u32, centers: &Centers) -> u32 {
    loop {
        let plane = &planes[node as usize];
        if plane.axis == CLUSTER {
            return node;
        }
        let axis = plane.axis as usize & 3;
        let is_behind = centers.0[axis] >= plane.position;
        if !is_behind && centers.1[axis] >= plane.position {
            return node;
        }
        node = plane.sides[usize::from(is_behind)];
    }
}

/// The cluster to which an item leads from `node` on.
#[inline(always)]
fn lead_one(planes: &[Plane], mut node: u32, center: Vec4) -> u32 {
    let center = center.to_array();
    loop {
        let plane = &planes[node as usize];
        if plane.axis == CLUSTER {
            return plane.sides[0];
        }
        let is_behind = center[plane.axis as usize & 3] >= plane.position;
        node = plane.sides[usize::from(is_behind)];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subset::SubsetOptions;
    use crate::subset::fixture::subset_of;
    use glam::Vec3;
    use lightshed_sampling::CounterRng;
    use lightshed_spatial::Bounds;
    use lightshed_testkit::check_faults;

    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// Blocks are led by the centre of their first item.
        First,
        /// Planes lie elsewhere.
        Moved,
    }

    /// Items of the subset are led to their own clusters, and the others, in blocks, to where each
    /// of them is led alone. Many centres lie on planes.
    #[test]
    fn items_are_led_to_their_clusters() {
        for (size, cluster) in [(0.2, 1), (0.01, 8), (0.0, 2), (1.0, 4)] {
            let boxes: Vec<Bounds> = (0..3000u32)
                .map(|index| {
                    let mut rng = CounterRng::new(6, index, cluster);
                    let at = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
                    let is_even = index % 3 == 0;
                    let at = if is_even { (at * 8.0).round() / 8.0 } else { at };
                    Bounds::new(at, at + if is_even { 0.0 } else { rng.next_f32() * size })
                })
                .collect();
            let options = SubsetOptions {
                cluster,
                ..SubsetOptions::default()
            };
            let (sorted, places, subset) = subset_of(&boxes, &options);
            assert!(subset.counts.len() > 3000 / 200);
            check_faults(&[Fault::First, Fault::Moved], |fault| {
                let mut planes = subset.planes.clone();
                if let Some(Fault::Moved) = fault {
                    planes.iter_mut().for_each(|plane| plane.position += 0.3);
                }
                let mut choices = vec![u32::MAX; sorted.len()];
                match fault {
                    Some(Fault::First) => {
                        for (items, choices) in sorted.chunks(BLOCK).zip(choices.chunks_mut(BLOCK)) {
                            choices.fill(lead_one(&planes, 0, items[0].doubled_center()));
                        }
                    }
                    _ => lead(&planes, &sorted, BoxItem::doubled_center, &mut choices),
                }
                for (&place, &own) in places.iter().zip(&subset.cluster_of) {
                    if choices[place as usize] != own {
                        return Err(format!("{place} of the subset"));
                    }
                }
                for (place, item) in sorted.iter().enumerate() {
                    if choices[place] != lead_one(&planes, 0, item.doubled_center()) {
                        return Err(format!("{place}"));
                    }
                }
                Ok(())
            })
            .unwrap_or_else(|e| panic!("{size} {cluster}: {e}"));
        }
    }
}

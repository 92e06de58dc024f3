//! How many lamps there are.

use super::Emitters;
use super::area::{AreaEmitter, SphereEmitter};
use glam::Vec3;

/// More emitting surfaces than these are not compared with each other.
const MOST: usize = 64;

/// The least and the greatest coordinates of a surface.
fn extent(area: &AreaEmitter) -> [Vec3; 2] {
    match area {
        AreaEmitter::Triangle(triangle) => {
            let a = triangle.corner;
            let [b, c] = triangle.edges.map(|edge| a + edge);
            [a.min(b).min(c), a.max(b).max(c)]
        }
        AreaEmitter::Sphere(SphereEmitter { sphere, .. }) => {
            [sphere.center - sphere.radius, sphere.center + sphere.radius]
        }
    }
}

fn touch([a_min, a_max]: [Vec3; 2], [b_min, b_max]: [Vec3; 2]) -> bool {
    a_min.cmple(b_max).all() && b_min.cmple(a_max).all()
}

/// How many groups of boxes there are that lie apart.
fn groups(boxes: &[[Vec3; 2]]) -> usize {
    // A box belongs to the group of the least box that it can be reached from.
    let mut group: Vec<usize> = (0..boxes.len()).collect();
    for i in 0..boxes.len() {
        for j in 0..i {
            let (old, new) = (group[i].max(group[j]), group[i].min(group[j]));
            if old != new && touch(boxes[i], boxes[j]) {
                for other in &mut group[..=i] {
                    *other = if *other == old { new } else { *other };
                }
            }
        }
    }
    let first = |(number, group): &(usize, &usize)| number == *group;
    group.iter().enumerate().filter(first).count()
}

impl Emitters {
    /// Emitting surfaces whose boxes touch are one lamp, and so is each emitter that is a point or
    /// a direction. Where there are more than 64 surfaces, each is one.
    pub(crate) fn lamps(&self) -> usize {
        let surfaces = match self.areas.len() {
            many if many > MOST => many,
            _ => groups(&self.areas.iter().map(extent).collect::<Vec<_>>()),
        };
        surfaces + self.points.len() + self.directionals.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_boxes(corners: &[[f32; 3]]) -> Vec<[Vec3; 2]> {
        let corners = corners.iter().map(|corner| Vec3::from_array(*corner));
        corners.map(|corner| [corner, corner + 1.0]).collect()
    }

    #[test]
    fn boxes_that_touch_are_one_group() {
        assert_eq!(groups(&[]), 0);
        let apart = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.5, 0.0]];
        assert_eq!(groups(&unit_boxes(&apart)), 3);
        // At a face, at a corner, and by a third that comes last.
        assert_eq!(groups(&unit_boxes(&[[0.0; 3], [1.0, 0.0, 0.0]])), 1);
        assert_eq!(groups(&unit_boxes(&[[0.0; 3], [1.0; 3]])), 1);
        let chain = [
            [4.0, 0.0, 0.0],
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [3.0, 0.0, 0.0],
        ];
        assert_eq!(groups(&unit_boxes(&chain)), 1);
        assert_eq!(groups(&unit_boxes(&chain[..4])), 2);
    }
}

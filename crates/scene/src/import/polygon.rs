//! Polygons to triangles.

/// Corners from which on a polygon is halved. Polygons of fewer corners become fans.
const HALVED: usize = 1_024;

/// Appends the triangles of a polygon. They cover it if it is convex.
///
/// A fan around the first corner has long triangles that overlap each other's boxes: a ray would be
/// tested against a quarter of them. So a polygon of many corners is cut along a chord into halves,
/// and these again, until the pieces are fans of few triangles.
pub(super) fn triangulate(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    if corners.len() < HALVED {
        if let [first, rest @ ..] = corners {
            triangles.extend(rest.array_windows().map(|&[a, b]| [*first, a, b]));
        }
        return;
    }
    // Pieces by the places of their first and last corner; all corners between belong to them.
    let mut pieces = vec![(0, corners.len() - 1)];
    while let Some((first, last)) = pieces.pop() {
        if last - first < 2 {
            continue;
        }
        let middle = first.midpoint(last);
        triangles.push([corners[first], corners[middle], corners[last]]);
        pieces.push((middle, last));
        pieces.push((first, middle));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    /// Regular polygons: the triangles' areas add up to the polygon's, none is turned over, and
    /// those of many corners overlap in few boxes.
    #[test]
    fn triangles_cover_the_polygon_once() {
        for count in [3, 4, 7, HALVED - 1, HALVED, 3 * HALVED + 1] {
            let corner = |i: usize| Vec2::from_angle(std::f32::consts::TAU * i as f32 / count as f32);
            let corners: Vec<u32> = (0..count as u32).collect();
            let mut triangles = Vec::new();
            triangulate(&corners, &mut triangles);
            assert_eq!(triangles.len(), count - 2);
            let placed: Vec<[Vec2; 3]> = triangles.iter().map(|t| t.map(|i| corner(i as usize))).collect();
            let area = |[a, b, c]: [Vec2; 3]| 0.5 * f64::from((b - a).perp_dot(c - a));
            let whole = 0.5 * count as f64 * (std::f64::consts::TAU / count as f64).sin();
            assert!(placed.iter().all(|&t| area(t) > -1e-7));
            assert!((placed.iter().map(|&t| area(t)).sum::<f64>() - whole).abs() < 1e-5);
            let place = Vec2::new(0.31, 0.17);
            let in_box = |&[a, b, c]: &[Vec2; 3]| {
                a.min(b).min(c).cmple(place).all() && a.max(b).max(c).cmpge(place).all()
            };
            let boxes = placed.iter().filter(|t| in_box(t)).count();
            assert!(count < HALVED || boxes < 40, "{boxes} boxes of {count}");
        }
    }

    #[test]
    fn few_corners_become_the_fan_of_the_first() {
        let mut triangles = Vec::new();
        triangulate(&[5, 6, 7, 8], &mut triangles);
        assert_eq!(triangles, [[5, 6, 7], [5, 7, 8]]);
        triangulate(&[], &mut triangles);
        assert_eq!(triangles.len(), 2);
    }
}

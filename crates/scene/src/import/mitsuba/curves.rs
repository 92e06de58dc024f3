//! Curves as tubes of triangles.

use super::Importer;
use super::properties::Properties;
use crate::TriangleMesh;
use crate::import::error::{ImportError, Location};
use glam::{DAffine3, DVec3, DVec4, Vec2};
use std::f64::consts::TAU;
use std::path::Path;

/// Sides of a tube.
const SIDES: u32 = 12;

/// Pieces of a segment of a spline.
const PIECES: u32 = 12;

impl Importer<'_> {
    /// The curves of a file: control points `x y z radius`, a line each, with an empty line between
    /// curves. Linear ones run from point to point, splines are uniform cubic B-splines. Tubes are
    /// open at their ends.
    pub(super) fn curves(
        &self,
        properties: &Properties,
        spline: bool,
        to_world: &DAffine3,
    ) -> Result<TriangleMesh, ImportError> {
        let node = properties.node;
        let file = properties
            .string("filename")?
            .ok_or_else(|| node.malformed("`filename` is missing"))?;
        // What silhouettes are sampled by.
        properties.ignore(&["silhouette_sampling_weight"]);
        let path = node.resolve(file, self.loading);
        let read = || -> Result<Vec<Vec<DVec4>>, ImportError> {
            let bytes = self.loading.read(&path)?;
            control_points(&bytes, &path)
        };
        let curves = read().map_err(|source| Self::referenced(node, source))?;
        let mut mesh = TriangleMesh::default();
        for curve in &curves {
            let rings = if spline {
                spline_rings(curve)
            } else {
                linear_rings(curve)
            };
            let added = rings.len() * SIDES as usize;
            self.loading.spend_mesh(added, 2 * added, || node.location())?;
            tube(&mut mesh, &rings);
        }
        if mesh.indices.is_empty() {
            return Err(node.malformed("the file has no curve"));
        }
        super::shape::place(node, &mut mesh, to_world)?;
        Ok(mesh)
    }
}

/// The control points of each curve.
fn control_points(bytes: &[u8], path: &Path) -> Result<Vec<Vec<DVec4>>, ImportError> {
    let mut curves = vec![Vec::new()];
    for (index, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        let fail = |what: &str| ImportError::malformed(Location::line(path, index as u32 + 1), what);
        let text = std::str::from_utf8(line).map_err(|_| fail("not text"))?;
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words[..] {
            [] => curves.push(Vec::new()),
            [..] if words.len() == 4 => {
                let mut point = DVec4::ZERO;
                for (axis, word) in words.iter().enumerate() {
                    let value: Option<f64> = word.parse().ok().filter(|v: &f64| v.is_finite());
                    point[axis] = value.ok_or_else(|| fail("not a finite number"))?;
                }
                if point.w <= 0.0 {
                    return Err(fail("a radius that is not positive"));
                }
                if let Some(curve) = curves.last_mut() {
                    curve.push(point);
                }
            }
            [..] => return Err(fail("expected `x y z radius`")),
        }
    }
    curves.retain(|curve| !curve.is_empty());
    Ok(curves)
}

/// A cross-section: centre, direction of the curve, radius.
struct Ring {
    center: DVec3,
    along: DVec3,
    radius: f64,
    /// Whether the tube ends before it, and a new one starts.
    is_start: bool,
}

/// Two rings for each straight segment.
fn linear_rings(points: &[DVec4]) -> Vec<Ring> {
    let segments = points.array_windows::<2>();
    let rings = segments.filter_map(|[a, b]| {
        let along = (b - a).truncate().try_normalize()?;
        Some([(a, true), (b, false)].map(|(point, is_start)| Ring {
            center: point.truncate(),
            along,
            radius: point.w,
            is_start,
        }))
    });
    rings.flatten().collect()
}

/// Rings along the cubic B-spline of the points.
fn spline_rings(points: &[DVec4]) -> Vec<Ring> {
    let mut rings = Vec::new();
    for (segment, [p0, p1, p2, p3]) in points.array_windows::<4>().enumerate() {
        let first = if segment == 0 { 0 } else { 1 };
        for piece in first..=PIECES {
            let t = f64::from(piece) / f64::from(PIECES);
            let s = 1.0 - t;
            let point = (p0 * (s * s * s)
                + p1 * (3.0 * t * t * t - 6.0 * t * t + 4.0)
                + p2 * (3.0 * s * s * s - 6.0 * s * s + 4.0)
                + p3 * (t * t * t))
                / 6.0;
            let slope = (p1 - p0) * (0.5 * s * s)
                + (p2 - p1) * (0.5 * (1.0 + 2.0 * t - 2.0 * t * t))
                + (p3 - p2) * (0.5 * t * t);
            let Some(along) = slope.truncate().try_normalize() else {
                continue;
            };
            rings.push(Ring {
                center: point.truncate(),
                along,
                radius: point.w,
                is_start: segment == 0 && piece == 0,
            });
        }
    }
    rings
}

/// Adds a tube through rings, smooth, its sides as far out as give the circle's area.
fn tube(mesh: &mut TriangleMesh, rings: &[Ring]) {
    let step = TAU / f64::from(SIDES);
    let outwards = (step / step.sin()).sqrt();
    let mut x = DVec3::ZERO;
    let mut previous: Option<u32> = None;
    for (index, ring) in rings.iter().enumerate() {
        // The frame turns as little as it can.
        x = (x - ring.along * x.dot(ring.along))
            .try_normalize()
            .unwrap_or_else(|| ring.along.any_orthonormal_vector());
        let y = ring.along.cross(x);
        let first = mesh.positions.len() as u32;
        for side in 0..=SIDES {
            let (sin, cos) = (step * f64::from(side % SIDES)).sin_cos();
            let outward = x * cos + y * sin;
            let position = ring.center + outward * (ring.radius * outwards);
            mesh.positions.push(position.as_vec3());
            mesh.normals.push(outward.as_vec3());
            let v = index as f32 / (rings.len().max(2) - 1) as f32;
            mesh.uvs.push(Vec2::new(side as f32 / SIDES as f32, 1.0 - v));
        }
        if let Some(previous) = previous.filter(|_| !ring.is_start) {
            for side in 0..SIDES {
                let [a, b, c, d] = [
                    previous + side,
                    previous + side + 1,
                    first + side,
                    first + side + 1,
                ];
                mesh.indices.extend([[a, b, d], [a, d, c]]);
            }
        }
        previous = Some(first);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(mesh: &TriangleMesh) -> f32 {
        let triangle = |t: &[u32; 3]| t.map(|i| mesh.positions[i as usize]);
        let areas = mesh.indices.iter().map(|t| {
            let [a, b, c] = triangle(t);
            0.5 * (b - a).cross(c - a).length()
        });
        areas.sum()
    }

    fn of(text: &str, spline: bool) -> TriangleMesh {
        let curves = control_points(text.as_bytes(), Path::new("c.txt")).expect("it is sound");
        let mut mesh = TriangleMesh::default();
        for curve in &curves {
            let rings = if spline {
                spline_rings(curve)
            } else {
                linear_rings(curve)
            };
            tube(&mut mesh, &rings);
        }
        mesh
    }

    /// A straight curve of either kind is a cylinder: of six control points at unit distances a
    /// spline shows the middle three units. Normals point outwards.
    #[test]
    fn straight_curves_are_cylinders() {
        let points = "0 0 0 0.1\n1 0 0 0.1\n2 0 0 0.1\n3 0 0 0.1\n4 0 0 0.1\n5 0 0 0.1\n";
        for (spline, length, tolerance) in [(false, 5.0, 0.03), (true, 3.0, 0.03)] {
            let mesh = of(points, spline);
            let expected = std::f32::consts::TAU * 0.1 * length;
            assert!(
                (area(&mesh) / expected - 1.0).abs() < tolerance,
                "{} {expected}",
                area(&mesh)
            );
            for triangle in &mesh.indices {
                let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
                let face = (b - a).cross(c - a).normalize();
                assert!(face.dot(mesh.normals[triangle[0] as usize]) > 0.9);
            }
        }
    }

    /// Curves of a file are apart; what is no curve is named with its line.
    #[test]
    fn files_have_curves_apart() {
        let line = "0 0 0 1\n0 0 1 1\n";
        let one = of(line, false).indices.len();
        assert_eq!(of(&format!("\n{line}\n\n{line}"), false).indices.len(), 2 * one);
        for (text, expected) in [
            ("0 0 0 1\n0 0 1", "c.txt:2: expected"),
            ("0 0 0 -1", "not positive"),
            ("0 0 x 1", "not a finite number"),
        ] {
            let error = control_points(text.as_bytes(), Path::new("c.txt")).expect_err(text);
            assert!(error.to_string().contains(expected), "{error}");
        }
    }
}

//! Emitters' outlines on the film.

use lightshed_scene::glam::{DVec2, DVec3};
use lightshed_scene::{EmitterOutline, FilmMap};

/// What an outline covers on the film.
#[expect(
    clippy::large_enum_variant,
    reason = "a value lives for the projection of one emitter"
)]
pub enum OnFilm {
    /// No part of the image.
    Nothing,
    /// Perhaps all of it.
    Everything,
    /// A convex polygon.
    Polygon(FilmPolygon),
}

/// A convex polygon on the film, in pixels, clipped somewhere outside the image.
pub struct FilmPolygon {
    corners: [DVec2; MOST_CORNERS],
    count: usize,
    /// By how much rays in single precision may meet the emitter beside it.
    pub pad: f64,
}

/// Corners of an outline, and one for each side of the image.
const MOST_CORNERS: usize = 12;

/// Pixels around the image up to which polygons are kept.
const MARGIN: f64 = 1.0;

/// Displacement of a hit by rounding in ray generation and intersection, as a share of the
/// coordinates of eye and emitter: 16 units in the last place.
const ROUNDING: f64 = 1.0 / (1 << 20) as f64;

/// The same of a film position, as a share of the image's side.
const FILM_ROUNDING: f64 = 1.0 / (1 << 22) as f64;

/// Corners in homogeneous film coordinates.
#[derive(Clone, Copy)]
struct Clipped {
    corners: [DVec3; MOST_CORNERS],
    count: usize,
}

impl FilmPolygon {
    pub fn corners(&self) -> &[DVec2] {
        &self.corners[..self.count]
    }
}

impl OnFilm {
    /// Of an outline as seen from the map's eye, in an image of this size.
    pub fn new(map: &FilmMap, outline: &EmitterOutline, [width, height]: [u32; 2]) -> Self {
        let (eye, size) = (map.eye.as_dvec3(), [width, height].map(f64::from));
        let sum = |v: DVec3| v.abs().element_sum();
        let farthest = outline.corners().iter().map(|&corner| sum(corner));
        let rounding = ROUNDING * (sum(eye) + farthest.fold(0.0, f64::max));
        let mut polygon = Clipped {
            corners: [DVec3::ZERO; MOST_CORNERS],
            count: outline.corners().len(),
        };
        for (to, &corner) in polygon.corners.iter_mut().zip(outline.corners()) {
            *to = map.matrix * (corner - eye);
        }
        // Rows of the matrix: gradients in space of X, Y and Z.
        let gradient = |of: DVec3| map.matrix.transpose() * of;
        // The sides of the image, moved away from it by the margin and by what rounding does.
        let sides = [
            DVec3::new(1.0, 0.0, MARGIN),
            DVec3::new(-1.0, 0.0, size[0] + MARGIN),
            DVec3::new(0.0, 1.0, MARGIN),
            DVec3::new(0.0, -1.0, size[1] + MARGIN),
        ];
        for side in sides {
            polygon = polygon.clipped(side, rounding * gradient(side).length());
        }
        if polygon.count == 0 {
            return Self::Nothing;
        }
        let clipped = &polygon.corners[..polygon.count];
        let nearest = clipped
            .iter()
            .map(|corner| corner.z)
            .fold(f64::INFINITY, f64::min);
        let off = |axis: DVec3| rounding * gradient(axis).length();
        // At the eye, the polygon is everywhere on the film. Not a number counts as such.
        if !(nearest > 2.0 * off(DVec3::Z)) {
            return Self::Everything;
        }
        let side = size[0].max(size[1]);
        let across = off(DVec3::X).max(off(DVec3::Y)) + (side + 2.0 * MARGIN) * off(DVec3::Z);
        let mut corners = [DVec2::ZERO; MOST_CORNERS];
        for (to, corner) in corners.iter_mut().zip(clipped) {
            *to = corner.truncate() / corner.z;
        }
        Self::Polygon(FilmPolygon {
            corners,
            count: polygon.count,
            pad: across / (nearest - off(DVec3::Z)) + FILM_ROUNDING * side,
        })
    }
}

impl Clipped {
    /// The part where `side · corner ≥ −slack` (Sutherland and Hodgman's step).
    fn clipped(&self, side: DVec3, slack: f64) -> Self {
        let mut kept = Self {
            corners: [DVec3::ZERO; MOST_CORNERS],
            count: 0,
        };
        let mut keep = |corner| {
            if let Some(place) = kept.corners.get_mut(kept.count) {
                *place = corner;
                kept.count += 1;
            }
        };
        let corners = &self.corners[..self.count];
        for (index, &corner) in corners.iter().enumerate() {
            let next = corners[(index + 1) % corners.len()];
            let [here, there] = [corner, next].map(|corner| side.dot(corner) + slack);
            if here >= 0.0 {
                keep(corner);
            }
            if (here >= 0.0) != (there >= 0.0) {
                keep(corner.lerp(next, here / (here - there)));
            }
        }
        kept
    }
}

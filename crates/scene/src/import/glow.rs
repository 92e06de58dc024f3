//! Textures of emission as emission that is constant over each triangle.

use crate::{ImageTexture, Rgb, TriangleMesh};
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// How often a triangle is cut into four at most.
const MOST_CUTS: u32 = 7;

/// Triangles that cutting may add to a mesh.
const MOST_ADDED: usize = 20_000;

/// Differences of emission, relative to the brightest texel, that need no cut.
const SMALL: f32 = 0.05;

/// Places on each edge of a triangle where its texture is looked at, at most.
const MOST_PLACES: u32 = 16;

/// Sets each triangle's glow to the mean of `texture` over it. Triangles over which it varies are
/// cut into four at the middles of their edges, down to two texels. Neighbours that are not cut
/// keep their edges: the cut one's lie on them up to rounding.
pub(super) fn spread(mesh: &mut TriangleMesh, texture: &ImageTexture) {
    let peak = texture.image.texels().fold(0.0_f32, |peak, texel| {
        peak.max((texel * texture.scale).max_element())
    });
    let most = mesh.indices.len() + MOST_ADDED;
    let mut waiting = std::mem::take(&mut mesh.indices);
    let (mut indices, mut glow) = (
        Vec::with_capacity(waiting.len()),
        Vec::with_capacity(waiting.len()),
    );
    let mut middles = HashMap::new();
    for cut in 0..=MOST_CUTS {
        let (mut cuts, count) = (Vec::new(), waiting.len());
        for (index, triangle) in waiting.into_iter().enumerate() {
            let seen = Seen::of(mesh, triangle, texture);
            // Those that still wait become one each at least.
            let total = indices.len() + cuts.len() + (count - index);
            if cut < MOST_CUTS && seen.texels > 2.0 && seen.range > SMALL * peak && total + 3 <= most {
                let [a, b, c] = triangle;
                let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|edge| middle(mesh, &mut middles, edge));
                cuts.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            } else {
                indices.push(triangle);
                glow.push(seen.mean);
            }
        }
        waiting = cuts;
    }
    (mesh.indices, mesh.glow) = (indices, glow);
}

/// The vertex in the middle of an edge, made once.
fn middle(mesh: &mut TriangleMesh, middles: &mut HashMap<(u32, u32), u32>, (a, b): (u32, u32)) -> u32 {
    *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
        let [a, b] = [a, b].map(|index| index as usize);
        fn push(values: &mut Vec<Vec3>, a: usize, b: usize) {
            if let (Some(&a), Some(&b)) = (values.get(a), values.get(b)) {
                values.push(0.5 * a + 0.5 * b);
            }
        }
        push(&mut mesh.positions, a, b);
        push(&mut mesh.normals, a, b);
        push(&mut mesh.colors, a, b);
        if let (Some(&a), Some(&b)) = (mesh.uvs.get(a), mesh.uvs.get(b)) {
            mesh.uvs.push(0.5 * a + 0.5 * b);
        }
        mesh.positions.len() as u32 - 1
    })
}

/// What a triangle shows of a texture.
struct Seen {
    mean: Rgb,
    /// Greatest difference of a channel.
    range: f32,
    /// Length of its longest edge in texels.
    texels: f32,
}

impl Seen {
    fn of(mesh: &TriangleMesh, triangle: [u32; 3], texture: &ImageTexture) -> Self {
        let [a, b, c] = triangle.map(|index| mesh.uvs.get(index as usize).copied().unwrap_or_default());
        let size = Vec2::new(texture.image.width() as f32, texture.image.height() as f32);
        let texels = [b - a, c - b, a - c]
            .map(|edge| (texture.to_uv.matrix2 * edge * size).length())
            .into_iter()
            .fold(0.0_f32, f32::max);
        let places = (texels.min(MOST_PLACES as f32) as u32).clamp(2, MOST_PLACES);
        let (mut sum, mut least, mut greatest) = (Vec3::ZERO, Rgb::INFINITY, Rgb::ZERO);
        let mut count = 0.0;
        // Middles of the triangles of a regular division, those that point upwards.
        for i in 0..places {
            for j in 0..places - i {
                let [v, w] = [i, j].map(|step| (step as f32 + 1.0 / 3.0) / places as f32);
                let seen = texture.at(a * (1.0 - v - w) + b * v + c * w);
                sum += seen;
                least = least.min(seen);
                greatest = greatest.max(seen);
                count += 1.0;
            }
        }
        let colors = triangle.map(|index| mesh.colors.get(index as usize).copied().unwrap_or(Rgb::ONE));
        let color = (colors[0] + colors[1] + colors[2]) / 3.0;
        Self {
            mean: sum / count * color,
            range: (greatest - least).max_element(),
            texels,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Filter, Image, Wrap, builtin};
    use glam::Affine2;
    use std::sync::Arc;

    fn texture(width: u32, height: u32, texel: impl Fn(u32, u32) -> f32) -> ImageTexture {
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let texels = texels.map(|(x, y)| [texel(x, y); 3]).collect();
        ImageTexture {
            image: Arc::new(Image::from_linear(width, height, texels).unwrap()),
            to_uv: Affine2::IDENTITY,
            filter: Filter::Bilinear,
            wrap: Wrap::Clamp,
            scale: Rgb::ONE,
        }
    }

    fn area(mesh: &TriangleMesh, triangle: usize) -> f32 {
        let [a, b, c] = mesh.indices[triangle].map(|i| mesh.positions[i as usize]);
        0.5 * (b - a).cross(c - a).length()
    }

    /// A lit corner of a screen of two triangles: area and flux stay, the lit part is where it
    /// was, and what is dark stays so.
    #[test]
    fn a_sign_glows_where_it_is_lit() {
        let mut mesh = builtin::quad([Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
        spread(
            &mut mesh,
            &texture(64, 64, |x, y| f32::from(u8::from(x < 37 && y < 27))),
        );
        assert_eq!(mesh.glow.len(), mesh.indices.len());
        assert!(mesh.indices.len() > 100 && mesh.indices.len() < 20_002);
        let areas: Vec<f32> = (0..mesh.indices.len()).map(|i| area(&mesh, i)).collect();
        let total: f32 = areas.iter().sum();
        let flux: f32 = areas
            .iter()
            .zip(&mesh.glow)
            .map(|(area, glow)| area * glow.x)
            .sum();
        assert!((total - 1.0).abs() < 1e-4, "{total}");
        // Image row 0 is at v = 1: the corner is the upper left one.
        assert!((flux - 37.0 * 27.0 / 4096.0).abs() < 0.01, "{flux}");
        for (triangle, glow) in mesh.indices.iter().zip(&mesh.glow) {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
            let place = (a + b + c) / 3.0;
            let (inside, outside) = (place.x < 0.53 && place.y > 0.63, place.x > 0.63 || place.y < 0.53);
            assert!(!inside || glow.x == 1.0, "{place} {glow}");
            assert!(!outside || glow.x == 0.0, "{place} {glow}");
        }
    }

    /// Nothing is cut where nothing varies; noise ends at the limit.
    #[test]
    fn cuts_are_where_they_help_and_end() {
        let quad = || builtin::quad([Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
        let mut mesh = quad();
        spread(&mut mesh, &texture(64, 64, |_, _| 0.5));
        assert_eq!(
            (mesh.indices.len(), &mesh.glow[..]),
            (2, &[Rgb::splat(0.5); 2][..])
        );
        let mut mesh = quad();
        spread(
            &mut mesh,
            &texture(512, 512, |x, y| (x * 7 + y * 13) as f32 % 5.0),
        );
        assert!(mesh.indices.len() <= 2 + MOST_ADDED && mesh.indices.len() > 10_000);
    }
}

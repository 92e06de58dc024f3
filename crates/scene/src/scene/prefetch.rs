//! Prefetching what shading reads at random places of memory, for all hits of a batch at once.
//!
//! Records lead to normals and texture coordinates, and those to texels. Each is asked for before
//! the first hit is shaded, so that the waits of a batch overlap.

use super::Scene;
use crate::{HitBatch, ImageTexture, Material};
use glam::Vec2;
use lightshed_lanes::prefetch;

/// Images of one material that are prefetched.
const MOST_IMAGES: usize = 3;

/// The images of each material; nothing if no material has any.
pub fn images(materials: &[Material]) -> Vec<Vec<ImageTexture>> {
    let of_each: Vec<Vec<ImageTexture>> = materials
        .iter()
        .map(|material| {
            let mut images: Vec<ImageTexture> = Vec::new();
            material.for_each_image(&mut |image| {
                if images.len() < MOST_IMAGES && !images.iter().any(|other| other.reads_as(image)) {
                    images.push(image.clone());
                }
            });
            images
        })
        .collect();
    match of_each.iter().all(Vec::is_empty) {
        true => Vec::new(),
        false => of_each,
    }
}

impl Scene {
    /// Prefetches what shading reads of the first `count` hits of a batch. It changes no result.
    #[inline]
    pub fn prefetch_hits(&self, hits: &HitBatch, count: usize) {
        for index in 0..count {
            self.prefetch_primitive(hits.primitive.get_word(index));
        }
        if self.normals.is_empty() && self.images.is_empty() {
            return;
        }
        for index in 0..count {
            let Some(record) = self.triangles.get(hits.primitive.get_word(index) as usize) else {
                continue;
            };
            if let Some([first, _, last]) = self.normals.get(record.normals as usize) {
                prefetch(first);
                prefetch(last);
            }
            if let Some([first, _, last]) = self.uvs.get(record.uvs as usize) {
                prefetch(first);
                prefetch(last);
            }
        }
        if !self.images.is_empty() {
            self.prefetch_texels(hits, count);
        }
    }

    #[inline(never)]
    fn prefetch_texels(&self, hits: &HitBatch, count: usize) {
        for index in 0..count {
            let Some(record) = self.triangles.get(hits.primitive.get_word(index) as usize) else {
                continue;
            };
            let Some(images) = self.images.get(record.material as usize) else {
                continue;
            };
            if images.is_empty() {
                continue;
            }
            let [v, w] = &hits.barycentric;
            let uv: Vec2 = record.uv([v.get(index), w.get(index)], &self.uvs);
            for image in images {
                image.prefetch(uv);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, ColorTexture, Filter, FloatTexture, Image, Microfacet, Rgb, Roughness, Wrap};
    use glam::Affine2;
    use std::sync::Arc;

    /// Every image of a nested material, each once, also where two textures share it.
    #[test]
    fn images_of_a_material_are_found_once() {
        let image = |side| Arc::new(Image::from_srgb8(side, 1, vec![[9; 3]; side as usize]).unwrap());
        let texture = |image: &Arc<Image>| ImageTexture {
            image: image.clone(),
            to_uv: Affine2::IDENTITY,
            filter: Filter::Bilinear,
            wrap: Wrap::Repeat,
            scale: Rgb::ONE,
        };
        let (color, alpha) = (image(1), image(2));
        let alpha_of = || FloatTexture::Image(texture(&alpha), Channel::Red);
        let coated = Material::Plastic {
            eta: 1.5,
            diffuse_reflectance: ColorTexture::Image(texture(&color)),
            specular_reflectance: Rgb::ONE.into(),
            nonlinear: false,
            roughness: Some(Roughness {
                distribution: Microfacet::Ggx,
                alpha_u: alpha_of(),
                alpha_v: alpha_of(),
            }),
        };
        let sided = Material::TwoSided {
            front: Box::new(coated),
            back: Some(Box::new(Material::Null)),
        };
        let plain = Material::Diffuse {
            reflectance: Rgb::ONE.into(),
        };
        let found = images(&[plain.clone(), sided]);
        let widths: Vec<Vec<u32>> = found
            .iter()
            .map(|images| images.iter().map(|texture| texture.image.width()).collect())
            .collect();
        assert_eq!(widths, [vec![], vec![1, 2]]);
        assert!(images(&[plain]).is_empty());
    }
}

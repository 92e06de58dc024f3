//! Materials and their textures as flat arrays.

use super::component_row::ComponentRow;
use crate::{ColorTexture, Filter, Image, ImageTexture, Wrap};
use bytemuck::{Pod, Zeroable};
use glam::{Affine2, Vec3};
use std::sync::Arc;

/// Materials as rows of components, with textures and tables.
#[derive(Clone, Debug, Default)]
pub struct FlatMaterials {
    /// First row and number of rows of each; one that lets light pass has none.
    pub ranges: Vec<[u32; 2]>,
    /// Components of all materials.
    pub components: Vec<ComponentRow>,
    /// Textures.
    pub textures: Vec<FlatTexture>,
    /// Texels, and what they are decoded by.
    pub texels: Vec<u32>,
    /// For each rough coat the share of light that gets through, at equal steps of the root of the
    /// cosine from 0 to 1.
    pub coats: Vec<f32>,
    /// Images that have been laid flat, with their first word and that of their table.
    images: Vec<(Arc<Image>, [u32; 2])>,
    /// First words of tables that have been.
    tables: Vec<(&'static [f32; 256], u32)>,
}

/// An image or a checkerboard over texture coordinates. 64 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FlatTexture {
    /// Columns of the map from `(u, 1 − v)` to texture space, and its translation.
    pub to_uv: [[f32; 2]; 3],
    /// Texels along a row, and rows.
    pub size: [u32; 2],
    /// Multiplies the texel.
    pub scale: Vec3,
    /// First word among the texels.
    pub first: u32,
    /// [`FlatTexture::BILINEAR`], [`FlatTexture::NEAREST`] or [`FlatTexture::CHECKERBOARD`], of
    /// which the two texels are the colours.
    pub filter: u32,
    /// What lies outside the unit square: 0 the image again, 1 its mirror image, 2 its edge.
    pub wrap: u32,
    /// First word of the 256 numbers that codes of eight bits a channel stand for, or
    /// [`FlatTexture::NO_TABLE`]: texels are three numbers each.
    pub table: u32,
    /// Nothing.
    pub padding: u32,
}

const _: () = assert!(size_of::<FlatTexture>() == 64);

impl FlatTexture {
    /// Bilinear between the four nearest texel centres.
    pub const BILINEAR: u32 = 0;
    /// The nearest texel.
    pub const NEAREST: u32 = 1;
    /// No image at all.
    pub const CHECKERBOARD: u32 = 2;

    /// In place of a table.
    pub const NO_TABLE: u32 = u32::MAX;

    fn new(to_uv: &Affine2, filter: u32) -> Self {
        Self {
            to_uv: to_uv.to_cols_array_2d(),
            size: [2, 1],
            scale: Vec3::ONE,
            first: 0,
            filter,
            wrap: 0,
            table: Self::NO_TABLE,
            padding: 0,
        }
    }
}

impl FlatMaterials {
    /// Adds a texture; its number.
    pub(crate) fn texture(&mut self, texture: &ColorTexture) -> u32 {
        let flat = match texture {
            ColorTexture::Image(texture) => self.image(texture),
            ColorTexture::Checkerboard(board) => self.two_colors(board.color0, board.color1, &board.to_uv),
            ColorTexture::Constant(color) => self.two_colors(*color, *color, &Affine2::IDENTITY),
            // Has no rows, so that nothing asks for it.
            ColorTexture::Vertex(other) => return self.texture(other),
        };
        self.textures.push(flat);
        self.textures.len() as u32 - 1
    }

    fn two_colors(&mut self, color0: Vec3, color1: Vec3, to_uv: &Affine2) -> FlatTexture {
        let first = self.texels.len() as u32;
        let colors = [color0, color1].map(|color| color.to_array());
        self.texels
            .extend(colors.as_flattened().iter().map(|v| v.to_bits()));
        FlatTexture {
            first,
            ..FlatTexture::new(to_uv, FlatTexture::CHECKERBOARD)
        }
    }

    fn image(&mut self, texture: &ImageTexture) -> FlatTexture {
        let image = &texture.image;
        let known = self.images.iter().find(|(other, _)| Arc::ptr_eq(other, image));
        let [first, table] = match known {
            Some((_, words)) => *words,
            None => {
                let (words, table) = image.words();
                let table = table.map_or(FlatTexture::NO_TABLE, |table| self.table(table));
                let words = [self.append(words), table];
                self.images.push((image.clone(), words));
                words
            }
        };
        let filter = match texture.filter {
            Filter::Bilinear => FlatTexture::BILINEAR,
            Filter::Nearest => FlatTexture::NEAREST,
        };
        FlatTexture {
            size: [image.width(), image.height()],
            scale: texture.scale,
            first,
            wrap: match texture.wrap {
                Wrap::Repeat => 0,
                Wrap::Mirror => 1,
                Wrap::Clamp | Wrap::Mixed(_) => 2,
            },
            table,
            ..FlatTexture::new(&texture.to_uv, filter)
        }
    }

    /// The first word of a table.
    fn table(&mut self, table: &'static [f32; 256]) -> u32 {
        if let Some((_, first)) = self.tables.iter().find(|(other, _)| std::ptr::eq(*other, table)) {
            return *first;
        }
        let first = self.append(table.iter().map(|v| v.to_bits()).collect());
        self.tables.push((table, first));
        first
    }

    fn append(&mut self, words: Vec<u32>) -> u32 {
        let first = self.texels.len() as u32;
        self.texels.extend(words);
        first
    }

    /// Adds the table of a rough coat; its number.
    pub(crate) fn coat(&mut self, transmittances: Vec<f32>) -> u32 {
        let number = self.coats.len() / transmittances.len().max(1);
        self.coats.extend(transmittances);
        number as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Checkerboard, FloatTexture, Material, Rgb};
    use glam::Vec2;

    fn texture(image: &Arc<Image>) -> ColorTexture {
        ColorTexture::Image(ImageTexture {
            image: image.clone(),
            to_uv: Affine2::from_scale(Vec2::new(2.0, 3.0)),
            filter: Filter::Bilinear,
            wrap: Wrap::Clamp,
            scale: Rgb::splat(0.5),
        })
    }

    /// An image that two materials share lies there once, and the table of its codes before it.
    #[test]
    fn images_lie_there_once() {
        let image = Arc::new(Image::from_srgb8(2, 1, vec![[1, 2, 3], [4, 5, 6]]).unwrap());
        let mut flat = FlatMaterials::default();
        for _ in 0..2 {
            assert!(flat.push(&Material::Diffuse {
                reflectance: texture(&image)
            }));
        }
        assert!(flat.push(&Material::Mirror {
            reflectance: ColorTexture::Checkerboard(Checkerboard {
                color0: Rgb::X,
                color1: Rgb::Y,
                to_uv: Affine2::IDENTITY,
            })
        }));
        assert_eq!(flat.ranges, [[0, 1], [1, 1], [2, 1]]);
        assert_eq!(
            flat.components.iter().map(|row| row.texture).collect::<Vec<_>>(),
            [1, 2, 3]
        );
        let [first, second, board] = flat.textures[..] else {
            panic!("{:?}", flat.textures)
        };
        assert_eq!(first, second);
        assert_eq!(
            (first.table, first.first, first.size, first.wrap),
            (0, 256, [2, 1], 2)
        );
        assert_eq!((board.filter, board.first), (FlatTexture::CHECKERBOARD, 258));
        assert_eq!(flat.texels.len(), 264);
        assert_eq!(flat.texels[256..258], [0x03_02_01, 0x06_05_04]);
        assert_eq!(f32::from_bits(flat.texels[255]), 1.0);
    }

    /// Which leaf of a blend a texture belongs to, where one of the leaves has no share; and what
    /// has no rows.
    #[test]
    fn textures_go_with_their_leaves() {
        let image = Arc::new(Image::from_srgb8(1, 1, vec![[1, 2, 3]]).unwrap());
        let textured = || {
            Box::new(Material::Diffuse {
                reflectance: texture(&image),
            })
        };
        let mirror = || {
            Box::new(Material::Mirror {
                reflectance: Rgb::ONE.into(),
            })
        };
        let blend = |weight, first, second| {
            Box::new(Material::Blend {
                weight,
                first,
                second,
            })
        };
        let half = || FloatTexture::Constant(0.5);
        let mut flat = FlatMaterials::default();
        let none = blend(FloatTexture::Constant(0.0), mirror(), textured());
        assert!(flat.push(&blend(half(), none, textured())));
        let kinds: Vec<_> = flat
            .components
            .iter()
            .map(|row| (row.kind, row.texture))
            .collect();
        assert_eq!(kinds, [(ComponentRow::MIRROR, 0), (ComponentRow::DIFFUSE, 1)]);
        let ColorTexture::Image(varying) = texture(&image) else {
            unreachable!("it is an image")
        };
        let varying = FloatTexture::Image(varying, crate::Channel::Red);
        assert!(!flat.push(&blend(varying, mirror(), textured())));
        assert!(!flat.push(&Material::Dielectric {
            eta: 1.5,
            roughness: None,
            specular_reflectance: texture(&image),
            specular_transmittance: Rgb::ONE.into(),
        }));
        assert_eq!(flat.ranges.len(), 1);
    }
}

//! What is refused, and why.

use super::super::MaterialError;
use super::*;
use crate::{Channel, ColorTexture, Filter, FloatTexture, Image, ImageTexture, Wrap};
use std::sync::Arc;

fn image(pixel: [f32; 3]) -> ImageTexture {
    ImageTexture {
        image: Arc::new(Image::from_linear(1, 1, vec![pixel]).unwrap()),
        to_uv: glam::Affine2::IDENTITY,
        filter: Filter::Nearest,
        wrap: Wrap::Repeat,
        scale: Rgb::ONE,
    }
}

#[test]
fn sound_materials_pass() {
    for (name, material) in zoo() {
        assert_eq!(material.validate(), Ok(()), "{name}");
    }
    assert_eq!(diffuse(7.0).validate(), Ok(()));
}

#[test]
fn faults_are_named() {
    let reflectance = MaterialError::Color {
        parameter: "reflectance",
    };
    assert_eq!(diffuse(-0.1).validate(), Err(reflectance));
    assert_eq!(diffuse(f32::NAN).validate(), Err(reflectance));
    let negative = Material::Diffuse {
        reflectance: ColorTexture::Image(image([0.5, -1.0, 0.5])),
    };
    assert_eq!(negative.validate(), Err(reflectance));
    let mut skewed = image([0.5; 3]);
    skewed.to_uv.translation.x = f32::INFINITY;
    let skewed = Material::Diffuse {
        reflectance: ColorTexture::Image(skewed),
    };
    let parameter = "reflectance";
    assert_eq!(skewed.validate(), Err(MaterialError::Transform { parameter }));

    let parameter = "alpha_v";
    let flat = conductor(Some(rough(GGX, 0.1, 0.0)));
    assert_eq!(flat.validate(), Err(MaterialError::Roughness { parameter }));
    let spots = Roughness {
        distribution: GGX,
        alpha_u: FloatTexture::Image(image([0.0; 3]), Channel::Green),
        alpha_v: 0.1.into(),
    };
    assert_eq!(conductor(Some(spots)).validate(), Ok(()));

    let parameter = "eta";
    for eta in [0.0, -1.5, f32::NAN, f32::INFINITY] {
        let refused = Err(MaterialError::IndexOfRefraction { parameter });
        assert_eq!(dielectric(eta, None).validate(), refused);
    }
    let parameter = "weight";
    let mixed = blend(-0.5, mirror(), mirror());
    assert_eq!(mixed.validate(), Err(MaterialError::Share { parameter }));
}

#[test]
fn nesting_is_bounded() {
    let glass = two_sided(blend(0.5, diffuse(0.5), dielectric(1.5, None)), None);
    assert_eq!(glass.validate(), Err(MaterialError::TransmissiveTwoSided));
    let mut deep = diffuse(0.5);
    for _ in 0..Material::MAX_DEPTH {
        deep = two_sided(deep, None);
    }
    assert_eq!(deep.validate(), Ok(()));
    assert_eq!(two_sided(deep, None).validate(), Err(MaterialError::TooDeep));
    let mut wide = diffuse(0.5);
    for _ in 1..Material::MAX_LEAVES {
        wide = blend(0.5, wide, diffuse(0.1));
    }
    assert_eq!(wide.validate(), Ok(()));
    assert_eq!(wide.at(Vec2::ZERO).lobe_count() as usize, Material::MAX_LEAVES);
    let wider = blend(0.5, wide, mirror());
    assert_eq!(wider.validate(), Err(MaterialError::TooManyLeaves));
    assert!(
        wider
            .at(Vec2::ZERO)
            .sample(Vec3::Z, 0.5, Vec2::splat(0.5))
            .is_some()
    );
    let message = MaterialError::TooManyLeaves.to_string();
    assert!(message.contains("too many"), "{message}");
}

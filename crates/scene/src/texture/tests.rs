use super::*;

/// A 2×2 image: red, green above blue, white.
fn quad(filter: Filter, wrap: Wrap) -> ImageTexture {
    let pixels = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]];
    ImageTexture {
        image: Arc::new(Image::from_linear(2, 2, pixels).unwrap()),
        to_uv: Affine2::IDENTITY,
        filter,
        wrap,
        scale: Rgb::ONE,
    }
}

/// Around integers, where nearest numbers change, to where there are no digits behind the point.
#[test]
fn the_floor_is_that_of_the_standard_library() {
    let mut values: Vec<f32> = lightshed_testkit::hostile_f32().collect();
    for exponent in -30..40 {
        let size = (exponent as f32).exp2();
        values.extend((0..200).map(|i| (i as f32 - 100.0) * 0.25 * size));
        for near in [size.next_up(), size.next_down(), size + 0.5, size + 0.75] {
            values.extend([near, -near]);
        }
    }
    lightshed_testkit::check_faults(&["the nearest integer", "towards zero"], |fault| {
        values.iter().try_for_each(|&x| {
            let expected = match fault {
                Some("the nearest integer") => x.round_ties_even(),
                Some(_) => x.trunc(),
                None => x.floor(),
            };
            let found = floor(x);
            (found == expected || expected.is_nan() && found.is_nan())
                .then_some(())
                .ok_or_else(|| format!("{x}: {found} for {expected}"))
        })
    })
    .unwrap();
}

#[test]
fn row_zero_is_at_v_one() {
    for filter in [Filter::Nearest, Filter::Bilinear] {
        let texture = quad(filter, Wrap::Clamp);
        assert_eq!(texture.at(Vec2::new(0.25, 0.75)), Rgb::X);
        assert_eq!(texture.at(Vec2::new(0.75, 0.75)), Rgb::Y);
        assert_eq!(texture.at(Vec2::new(0.25, 0.25)), Rgb::Z);
        assert_eq!(texture.at(Vec2::new(0.75, 0.25)), Rgb::ONE);
    }
}

#[test]
fn the_transform_acts_in_texture_space() {
    // Doubling in texture space keeps the image's upper left corner where it is, at v = 1.
    let mut texture = quad(Filter::Nearest, Wrap::Clamp);
    texture.to_uv = Affine2::from_scale(Vec2::new(2.0, 2.0));
    assert_eq!(texture.at(Vec2::new(0.1, 0.9)), Rgb::X);
    assert_eq!(texture.at(Vec2::new(0.3, 0.9)), Rgb::Y);
    assert_eq!(texture.at(Vec2::new(0.1, 0.7)), Rgb::Z);
}

#[test]
fn bilinear_mixes_and_wraps() {
    let middle = quad(Filter::Bilinear, Wrap::Repeat).at(Vec2::splat(0.5));
    assert!((middle - Rgb::new(0.5, 0.5, 0.5)).abs().max_element() < 1e-6);
    // At the left edge of the upper row: half of the right texel when repeating, none of it
    // otherwise.
    let edge = Vec2::new(0.0, 0.75);
    let repeated = quad(Filter::Bilinear, Wrap::Repeat).at(edge);
    assert!((repeated - Rgb::new(0.5, 0.5, 0.0)).abs().max_element() < 1e-6);
    for wrap in [Wrap::Mirror, Wrap::Clamp] {
        assert_eq!(quad(Filter::Bilinear, wrap).at(edge), Rgb::X);
    }
}

#[test]
fn wraps_follow_a_naive_oracle() {
    // Index by index: what a texel outside the image stands for.
    let oracle = |wrap: AxisWrap, index: i64, count: i64| match wrap {
        AxisWrap::Repeat => index.rem_euclid(count),
        AxisWrap::Mirror => {
            let folded = index.rem_euclid(2 * count);
            if folded < count {
                folded
            } else {
                2 * count - 1 - folded
            }
        }
        AxisWrap::Clamp => index.clamp(0, count - 1),
    };
    let pixels: Vec<[f32; 3]> = (0..5).map(|i| [i as f32, 0.0, 0.0]).collect();
    let mixed = [AxisWrap::Repeat, AxisWrap::Mirror, AxisWrap::Clamp]
        .map(|along| Wrap::Mixed([along, AxisWrap::Clamp]));
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].into_iter().chain(mixed) {
        let mut texture = quad(Filter::Nearest, wrap);
        texture.image = Arc::new(Image::from_linear(5, 1, pixels.clone()).unwrap());
        let texel = |index: i64| oracle(wrap.axes()[0], index, 5) as f32;
        for step in -120..120 {
            let position = step as f32 / 8.0 + 0.0625;
            let uv = Vec2::new(position / 5.0, 0.5);
            texture.filter = Filter::Nearest;
            assert_eq!(
                texture.at(uv).x,
                texel(position.floor() as i64),
                "{wrap:?} nearest at {position}"
            );
            texture.filter = Filter::Bilinear;
            let (below, share) = ((position - 0.5).floor(), (position - 0.5).rem_euclid(1.0));
            let expected = texel(below as i64) * (1.0 - share) + texel(below as i64 + 1) * share;
            assert!(
                (texture.at(uv).x - expected).abs() < 1e-4,
                "{wrap:?} bilinear at {position}"
            );
        }
    }
}

#[test]
fn extreme_coordinates_stay_finite() {
    for filter in [Filter::Nearest, Filter::Bilinear] {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let mut texture = quad(filter, wrap);
            for u in [0.0, 1.0, -1.0, 1e30, -1e30, f32::MAX, f32::MIN, 1e-40, -1e-40] {
                texture.to_uv = Affine2::from_scale(Vec2::new(3.0, -7.0));
                assert!(texture.at(Vec2::new(u, u)).is_finite());
            }
        }
    }
}

#[test]
fn checkerboard_follows_mitsuba() {
    let board = Checkerboard {
        color0: Rgb::X,
        color1: Rgb::Y,
        to_uv: Affine2::IDENTITY,
    };
    // In texture space: (0.25, 0.25) and (0.75, 0.75) are color0, the others color1.
    assert_eq!(board.at(Vec2::new(0.25, 0.75)), Rgb::X);
    assert_eq!(board.at(Vec2::new(0.75, 0.25)), Rgb::X);
    assert_eq!(board.at(Vec2::new(0.75, 0.75)), Rgb::Y);
    assert_eq!(board.at(Vec2::new(-0.25, 0.75)), Rgb::Y);
}

#[test]
fn channels_and_means() {
    let texture = quad(Filter::Bilinear, Wrap::Repeat);
    let blue = FloatTexture::Image(texture.clone(), Channel::Blue);
    assert_eq!(blue.at(Vec2::new(0.25, 0.25)), 1.0);
    assert!((blue.mean() - 0.5).abs() < 1e-6);
    assert!(
        (ColorTexture::Image(texture).mean() - Rgb::splat(0.5))
            .abs()
            .max_element()
            < 1e-6
    );
}

/// A look-up reads the first texel and its neighbours to the right and below: an image that is
/// black elsewhere gives the same.
#[test]
fn prefetched_texels_are_those_that_are_read() {
    let (width, height) = (7, 5);
    let number = |x: u32, y: u32| (1 + x + y * width) as f32;
    let at = |uv: Vec2, keep: &dyn Fn(u32, u32) -> bool| {
        let texel = |i: u32| match keep(i % width, i / width) {
            true => [number(i % width, i / width); 3],
            false => [0.0; 3],
        };
        let pixels = (0..width * height).map(texel).collect();
        let texture = ImageTexture {
            image: Arc::new(Image::from_linear(width, height, pixels).unwrap()),
            to_uv: Affine2::from_scale(Vec2::new(1.5, 0.7)),
            ..quad(Filter::Bilinear, Wrap::Mirror)
        };
        (texture.at(uv), texture.first_texel(uv))
    };
    let check = |shift: u32| {
        for step in 0..200 {
            let uv = Vec2::new(step as f32 * 0.0137, step as f32 * 0.0291);
            let (all, [x, y]) = at(uv, &|_, _| true);
            let near = |a: u32, b: u32| a == b || a == b + 1;
            let (some, _) = at(uv, &|i, j| near(i, x + shift) && near(j, y));
            if all != some {
                return Err(format!("{uv}: {some} in place of {all}"));
            }
        }
        Ok(())
    };
    lightshed_testkit::check_faults(&["a texel to the right"], |fault| {
        check(u32::from(fault.is_some()))
    })
    .unwrap();
}

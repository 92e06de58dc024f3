//! The area spread.

use lightshed_caching::AreaSpread;
use lightshed_sampling::Density;
use std::f32::consts::PI;

/// Both sides of the test are areas: they grow with the square of a scene's size, and the test
/// stays as it is.
#[test]
fn the_spread_is_an_area() {
    let spread = |scale: f32| {
        let mut spread = AreaSpread::first(2.0 * scale, 0.5);
        assert!(!spread.exceeds(0.01), "nothing has spread at the first vertex");
        // By a cosine lobe at 60 degrees, then by a mirror.
        spread.extend(0.3 * scale, Density::new(0.5 / PI), 0.8);
        spread.extend(1.0 * scale, Density::new(f32::INFINITY), 0.8);
        spread
    };
    let one = spread(1.0);
    assert!((one.area() - 0.09 * PI / 0.4).abs() < 1e-5);
    for scale in [1e-3, 1.0, 1e3] {
        let area = spread(scale).area() / (scale * scale);
        assert!((area / one.area() - 1.0).abs() < 1e-5);
        // a_0 = 4 / (2 pi).
        let limit = one.area() * PI / 2.0;
        assert!(spread(scale).exceeds(0.999 * limit) && !spread(scale).exceeds(1.001 * limit));
    }
    // Roots add up before the square.
    let mut twice = AreaSpread::first(1.0, 1.0);
    (0..2).for_each(|_| twice.extend(1.0, Density::new(1.0), 1.0));
    assert_eq!(twice.area(), 4.0);
    // What grazes spreads without end, and a density of zero is no number's fault.
    let mut grazing = AreaSpread::first(1.0, 0.0);
    grazing.extend(1.0, Density::new(1.0), 0.0);
    assert!(!grazing.exceeds(1.0) || grazing.area() == f32::INFINITY);
}

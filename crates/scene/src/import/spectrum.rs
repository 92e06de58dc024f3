//! Spectra over wavelengths to RGB.
//!
//! `X = ∫ S(λ) x̄(λ) D(λ) dλ / ∫ ȳ(λ) D(λ) dλ` and likewise for Y and Z, then linear
//! Rec. 709. `D` is the illuminant D65 for what reflects, so that `S = 1` is white, and 1 for what
//! emits.

use crate::Rgb;
use glam::{DMat3, DVec3};

/// First wavelength of the tables and their step, in nanometres.
const FIRST: f64 = 380.0;
const STEP: f64 = 10.0;

/// Colour matching functions of the standard observer of 1931 (CIE 15:2004, table T.4).
#[rustfmt::skip]
const OBSERVER: [[f64; 3]; 41] = [
    [0.0014, 0.0000, 0.0065], [0.0042, 0.0001, 0.0201], [0.0143, 0.0004, 0.0679], [0.0435, 0.0012, 0.2074],
    [0.1344, 0.0040, 0.6456], [0.2839, 0.0116, 1.3856], [0.3483, 0.0230, 1.7471], [0.3362, 0.0380, 1.7721],
    [0.2908, 0.0600, 1.6692], [0.1954, 0.0910, 1.2876], [0.0956, 0.1390, 0.8130], [0.0320, 0.2080, 0.4652],
    [0.0049, 0.3230, 0.2720], [0.0093, 0.5030, 0.1582], [0.0633, 0.7100, 0.0782], [0.1655, 0.8620, 0.0422],
    [0.2904, 0.9540, 0.0203], [0.4334, 0.9950, 0.0087], [0.5945, 0.9950, 0.0039], [0.7621, 0.9520, 0.0021],
    [0.9163, 0.8700, 0.0017], [1.0263, 0.7570, 0.0011], [1.0622, 0.6310, 0.0008], [1.0026, 0.5030, 0.0003],
    [0.8544, 0.3810, 0.0002], [0.6424, 0.2650, 0.0000], [0.4479, 0.1750, 0.0000], [0.2835, 0.1070, 0.0000],
    [0.1649, 0.0610, 0.0000], [0.0874, 0.0320, 0.0000], [0.0468, 0.0170, 0.0000], [0.0227, 0.0082, 0.0000],
    [0.0114, 0.0041, 0.0000], [0.0058, 0.0021, 0.0000], [0.0029, 0.0010, 0.0000], [0.0014, 0.0005, 0.0000],
    [0.0007, 0.0002, 0.0000], [0.0003, 0.0001, 0.0000], [0.0002, 0.0001, 0.0000], [0.0001, 0.0000, 0.0000],
    [0.0000, 0.0000, 0.0000],
];

/// The illuminant D65, relative (CIE 15:2004, table T.1).
#[rustfmt::skip]
const D65: [f64; 41] = [
    49.98, 54.65, 82.75, 91.49, 93.43, 86.68, 104.87, 117.01, 117.81, 114.86, 115.92, 108.81, 109.35, 107.80,
    104.79, 107.69, 104.41, 104.05, 100.00, 96.33, 95.79, 88.69, 90.01, 89.60, 87.70, 83.29, 83.70, 80.03, 80.21,
    82.28, 78.28, 69.72, 71.61, 74.35, 61.60, 69.89, 75.09, 63.59, 46.42, 66.81, 63.38,
];

/// From XYZ to linear Rec. 709, rows as columns of the transpose.
const TO_RGB: [[f64; 3]; 3] = [
    [3.240_479, -0.969_256, 0.055_648],
    [-1.537_150, 1.875_991, -0.204_043],
    [-0.498_535, 0.041_556, 1.057_311],
];

/// What a spectrum is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SpectrumOf {
    /// Shares of light: 1 is white.
    Reflectance,
    /// Light: the same at all wavelengths is that much luminance.
    Emission,
}

/// The colour of a spectrum that is linear between its points `(λ in nm, value)`, and zero outside
/// of them. Components below 0, which Rec. 709 cannot show, become 0.
pub(crate) fn color(points: &[(f64, f64)], of: SpectrumOf) -> Rgb {
    let value = |wavelength: f64| {
        let after = points.partition_point(|&(at, _)| at < wavelength);
        match (after.checked_sub(1).map(|i| points[i]), points.get(after)) {
            (_, Some(&(at, value))) if at == wavelength => value,
            (Some((a, from)), Some(&(b, to))) => from + (to - from) * (wavelength - a) / (b - a),
            _ => 0.0,
        }
    };
    let (mut sum, mut white) = (DVec3::ZERO, 0.0);
    // Steps of one nanometre, the tables linear between theirs.
    for step in 0..=400 {
        let wavelength = FIRST + f64::from(step);
        let place = f64::from(step) / STEP;
        let (below, share) = (
            (place as usize).min(39),
            place - f64::from((place as u32).min(39)),
        );
        let observer = DVec3::from_array(OBSERVER[below]).lerp(DVec3::from_array(OBSERVER[below + 1]), share);
        let light = match of {
            SpectrumOf::Reflectance => D65[below] + (D65[below + 1] - D65[below]) * share,
            SpectrumOf::Emission => 1.0,
        };
        sum += observer * (value(wavelength) * light);
        white += observer.y * light;
    }
    let rgb = DMat3::from_cols_array_2d(&TO_RGB) * (sum / white);
    let rgb = rgb.max(DVec3::ZERO);
    match of {
        SpectrumOf::Reflectance => rgb.min(DVec3::ONE),
        SpectrumOf::Emission => rgb,
    }
    .as_vec3()
}

/// The levels of a spectrum of numbers that are no light, such as indices of refraction: the same
/// at all wavelengths is that number.
#[cfg(feature = "pbrt")]
pub(crate) fn levels(points: &[(f64, f64)]) -> Rgb {
    let even = [(FIRST, 1.0), (FIRST + 400.0, 1.0)];
    color(points, SpectrumOf::Emission) / color(&even, SpectrumOf::Emission)
}

/// The colour of the radiance of a black body of `temperature` kelvin per nanometre (Planck's law,
/// in W/(m² sr nm)).
pub(crate) fn blackbody(temperature: f64) -> Rgb {
    const H: f64 = 6.626_070_15e-34;
    const C: f64 = 2.997_924_58e8;
    const K: f64 = 1.380_649e-23;
    let radiance = |nanometres: f64| {
        let l = nanometres * 1e-9;
        let exponent = H * C / (l * K * temperature);
        2.0 * H * C * C / l.powi(5) / exponent.exp_m1() * 1e-9
    };
    let points: Vec<(f64, f64)> = (0..=80)
        .map(|step| 380.0 + 5.0 * f64::from(step))
        .map(|wavelength| (wavelength, radiance(wavelength)))
        .collect();
    color(&points, SpectrumOf::Emission)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [(f64, f64); 2] = [(300.0, 1.0), (900.0, 1.0)];

    /// The chromaticities that define the illuminants: D65 is Rec. 709's white, and equal energy is
    /// `x = y = ⅓`.
    #[test]
    fn constant_spectra_are_their_illuminants() {
        let white = color(&ALL, SpectrumOf::Reflectance);
        assert!((white - Rgb::ONE).abs().max_element() < 0.01, "{white}");
        // (1, 1, 1) in XYZ.
        let equal = color(&ALL, SpectrumOf::Emission);
        let expected = Rgb::new(1.2048, 0.9483, 0.9089);
        assert!((equal - expected).abs().max_element() < 0.01, "{equal}");
        #[cfg(feature = "pbrt")]
        {
            let index = levels(&ALL.map(|(at, _)| (at, 2.5)));
            assert!((index - Rgb::splat(2.5)).abs().max_element() < 1e-5, "{index}");
        }
        let of_value = |value: f64| color(&ALL.map(|(at, _)| (at, value)), SpectrumOf::Reflectance);
        assert!((of_value(0.5) - 2.0 * of_value(0.25)).abs().max_element() < 1e-6);
    }

    #[test]
    fn wavelengths_have_their_hues() {
        let line = |at: f64| {
            color(
                &[(at - 10.0, 0.0), (at, 1.0), (at + 10.0, 0.0)],
                SpectrumOf::Emission,
            )
        };
        let (blue, green, red) = (line(450.0), line(540.0), line(650.0));
        assert!(blue.z > 5.0 * blue.x.max(blue.y), "{blue}");
        assert!(green.y > 5.0 * green.x.max(green.z), "{green}");
        assert!(red.x > 5.0 * red.y.max(red.z), "{red}");
    }
}

//! Indices of refraction by name.

use crate::{ConductorIor, Rgb};

/// Index of refraction of a dielectric at room conditions, by the names that Mitsuba's
/// documentation lists.
#[cfg(feature = "mitsuba")]
pub(crate) fn dielectric(name: &str) -> Option<f32> {
    Some(match name {
        "vacuum" => 1.0,
        "helium" => 1.000_036,
        "hydrogen" => 1.000_132,
        "air" => 1.000_277,
        "carbon dioxide" => 1.000_45,
        "water ice" => 1.31,
        "water" => 1.333,
        "acetone" => 1.36,
        "ethanol" => 1.361,
        "fused quartz" => 1.458,
        "carbon tetrachloride" => 1.461,
        "pyrex" => 1.47,
        "glycerol" => 1.4729,
        "acrylic glass" | "polypropylene" => 1.49,
        "benzene" => 1.501,
        "bk7" => 1.5046,
        "silicone oil" => 1.520_45,
        "sodium chloride" => 1.544,
        "amber" => 1.55,
        "pet" => 1.575,
        "bromine" => 1.661,
        "diamond" => 2.419,
        _ => return None,
    })
}

/// Complex index of refraction of a metal, measured spectra (the SOPRA collection) weighted to Rec.
/// 709 RGB, as tabulated with the scenes of Bitterli's Rendering Resources (2016). `none` reflects
/// everything at every angle.
pub(crate) fn conductor(name: &str) -> Option<ConductorIor> {
    let ior = |eta, k| ConductorIor {
        eta: Rgb::from_array(eta),
        k: Rgb::from_array(k),
    };
    Some(match name {
        "none" => ior([0.0; 3], [1.0; 3]),
        "Ag" => ior([0.155_265, 0.116_723, 0.138_342], [4.828_37, 3.122_5, 2.146_96]),
        "Al" => ior([1.657_46, 0.880_369, 0.521_229], [9.223_87, 6.269_52, 4.837]),
        "Au" => ior([0.143_119, 0.374_957, 1.442_48], [3.983_16, 2.385_72, 1.603_22]),
        "Cu" => ior([0.200_438, 0.924_033, 1.102_21], [3.912_95, 2.452_85, 2.142_19]),
        _ => return None,
    })
}

/// Reflectances at normal incidence, in linear RGB, of metals of which there are no RGB figures:
/// the index `1 + i k` with this reflectance stands for them.
pub(crate) fn roughly(name: &str) -> Option<ConductorIor> {
    let reflectance = match name.split('_').next().unwrap_or(name) {
        "Cr" => [0.549, 0.556, 0.554],
        "W" => [0.504, 0.498, 0.478],
        "Ni" => [0.660, 0.609, 0.526],
        "Fe" => [0.562, 0.565, 0.578],
        "Pt" => [0.673, 0.637, 0.585],
        "Ti" => [0.542, 0.497, 0.449],
        "Co" => [0.662, 0.655, 0.634],
        "Hg" => [0.780, 0.775, 0.775],
        "Ir" => [0.72, 0.71, 0.70],
        "Rh" => [0.76, 0.74, 0.73],
        "Mo" => [0.58, 0.57, 0.57],
        "TiN" => [0.72, 0.55, 0.30],
        "V" | "Ta" | "Nb" | "Be" => [0.53, 0.51, 0.49],
        "Te" | "VN" | "SnTe" => [0.54, 0.52, 0.50],
        "TiC" | "VC" => [0.47, 0.45, 0.44],
        "AlSb" | "HgTe" => [0.36, 0.40, 0.42],
        "AlAs" | "Se" => [0.25, 0.27, 0.30],
        "a-C" | "Cu2O" | "CuO" => [0.22, 0.22, 0.23],
        "SiC" | "TiO2" => [0.20, 0.20, 0.22],
        "d-C" => [0.17, 0.17, 0.18],
        "CsI" | "MgO" => [0.075, 0.077, 0.080],
        "ThF4" => [0.04, 0.04, 0.04],
        "K" | "Li" | "Na" => [0.92, 0.91, 0.90],
        "Ag" | "Al" | "Au" | "Cu" => return conductor(name.split('_').next()?),
        _ => return None,
    };
    let k = Rgb::from_array(reflectance).map(|r| 2.0 * (r / (1.0 - r)).sqrt());
    Some(ConductorIor { eta: Rgb::ONE, k })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metals_have_their_colours_at_normal_incidence() {
        // Reflectances in linear sRGB published for real-time shading (Akenine-Möller et al. 2018,
        // table 9.2).
        let cases = [
            ("none", [1.0, 1.0, 1.0]),
            ("Ag", [0.972, 0.960, 0.915]),
            ("Al", [0.913, 0.922, 0.924]),
            ("Au", [1.0, 0.782, 0.344]),
            ("Cu", [0.955, 0.638, 0.538]),
        ];
        for (name, expected) in cases {
            let ConductorIor { eta, k } = conductor(name).unwrap();
            let below = (eta - 1.0) * (eta - 1.0) + k * k;
            let above = (eta + 1.0) * (eta + 1.0) + k * k;
            let difference = (below / above - Rgb::from_array(expected)).abs().max_element();
            assert!(
                difference < 0.04,
                "{name}: {} against {expected:?}",
                below / above
            );
        }
        assert!(conductor("unobtainium").is_none() && roughly("unobtainium").is_none());
        let ConductorIor { eta, k } = roughly("Cr").unwrap();
        let below = (eta - 1.0) * (eta - 1.0) + k * k;
        let found = below / ((eta + 1.0) * (eta + 1.0) + k * k);
        assert!(found.abs_diff_eq(Rgb::new(0.549, 0.556, 0.554), 1e-5), "{found}");
    }
}

//! Indices of refraction by name.

use crate::{ConductorIor, Rgb};

/// Index of refraction of a dielectric at room conditions, by the names that Mitsuba's
/// documentation lists.
pub(super) fn dielectric(name: &str) -> Option<f32> {
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
pub(super) fn conductor(name: &str) -> Option<ConductorIor> {
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
        assert!(conductor("unobtainium").is_none());
    }
}

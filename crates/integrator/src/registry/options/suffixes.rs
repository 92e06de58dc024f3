//! Suffix reuse.

use super::super::option::{MethodOption, MethodValues, within};
use crate::{RestirPtOptions, RestirSuffixOptions};

/// Integration prefixes.
pub const PREFIXES: MethodOption = MethodOption::new(
    "prefixes",
    "N",
    "",
    |text| within(text, 1..=crate::MAX_PREFIXES),
    "Integration prefixes of a pixel and frame: 8, or 32 offline, if not given",
);

/// Camera rays of integration prefixes.
pub const CAMERA_RAYS: MethodOption = MethodOption::new(
    "camera-rays",
    "N",
    "",
    |text| within(text, 1..=crate::MAX_PREFIXES),
    "Camera rays of a pixel and frame that integration prefixes start from: 4, or 8 offline, if not given",
);

/// Canonical suffixes.
pub const CANONICAL: MethodOption = MethodOption::new(
    "canonical",
    "K",
    "",
    |text| within(text, 1..=crate::MAX_PREFIXES),
    "Integration prefixes that trace a suffix of their own: 4 if not given; roulette leaves the others none",
);

/// Borrowed suffixes.
pub const BORROWED: MethodOption = MethodOption::new(
    "borrowed",
    "N",
    "",
    |text| within(text, 0..=crate::MAX_BORROWED),
    "Supporting prefixes whose suffixes an integration prefix borrows: 1, or 3 offline, if not given",
);

/// Spacing of supporting prefixes.
pub const SPACING: MethodOption = MethodOption::new(
    "spacing",
    "PIXELS",
    "1",
    |text| within(text, 1..=crate::MAX_SPACING),
    "Side of the square of pixels that have one supporting prefix",
);

/// Most borrowed suffixes on the device.
const DEVICE_BORROWED: u32 = 8;

impl MethodValues {
    /// Whether each pixel has a supporting prefix, and prefixes borrow few enough suffixes for the
    /// device.
    pub(in crate::registry) fn has_supports_everywhere(&self) -> bool {
        self.get(&SPACING).is_none_or(|spacing: u32| spacing == 1)
            && self
                .get(&BORROWED)
                .is_none_or(|borrowed: u32| borrowed <= DEVICE_BORROWED)
    }

    /// Parameters of suffix reuse.
    pub fn restir_suffix_options(&self, default: RestirSuffixOptions) -> RestirSuffixOptions {
        let prefixes = self.get(&PREFIXES).unwrap_or(default.prefixes);
        RestirSuffixOptions {
            suffixes: RestirPtOptions {
                direct_samples: self.direct_samples(default.suffixes.direct_samples),
                visible_emission: self.visible_emission(),
                temporal_cap: self.temporal_cap(default.suffixes.temporal_cap),
                ..default.suffixes
            },
            prefixes,
            camera_rays: self
                .get(&CAMERA_RAYS)
                .unwrap_or(default.camera_rays.min(prefixes)),
            canonical: self.get(&CANONICAL).unwrap_or(default.canonical.min(prefixes)),
            borrowed: self.get(&BORROWED).unwrap_or(default.borrowed),
            spacing: self.get(&SPACING).unwrap_or(default.spacing),
            ..default
        }
    }
}

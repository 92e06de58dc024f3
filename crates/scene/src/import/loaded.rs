//! What an importer takes and gives.

use super::error::Location;
use crate::SceneDescription;
use std::fmt;

/// Definitions `(name, value)` that replace a Mitsuba scene's `<default>`s, like Mitsuba's
/// `-D name=value`.
pub type Defines = [(String, String)];

/// An imported scene and what was done differently from what the file asks.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub description: SceneDescription,
    /// Differences that do not make the import wrong, such as another pixel filter.
    pub warnings: Vec<Warning>,
    /// Whether the file has no camera, so that the view of the whole scene was chosen here.
    pub view_is_chosen: bool,
}

impl Loaded {
    /// Asks for an image of another size. The horizontal field of view stays; one that was chosen
    /// here grows where the new image would cut off what the old one shows.
    pub fn resize(&mut self, size: [u32; 2]) {
        let settings = &mut self.description.settings;
        let wider = |[width, height]: [u32; 2]| (f64::from(width) / f64::from(height.max(1))).max(1.0);
        let growth = wider(size) / wider([settings.width, settings.height]);
        if self.view_is_chosen && growth > 1.0 {
            let fov_x = &mut self.description.camera.fov_x;
            let half = (0.5 * f64::from(*fov_x)).tan() * growth;
            *fov_x = (2.0 * half.atan()) as f32;
        }
        [settings.width, settings.height] = size;
    }
}

/// Something in a file that is imported differently from what it says, or filled in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Where.
    pub location: Location,
    /// What.
    pub message: String,
}

#[cfg(any(feature = "gltf", feature = "mitsuba", feature = "pbrt"))]
impl Warning {
    /// Most warnings that are kept.
    const MOST: usize = 256;

    /// Adds a warning to a list that stays short, whatever the file.
    pub(crate) fn push(list: &mut Vec<Self>, location: Location, message: String) {
        if list.len() > Self::MOST {
            return;
        }
        let message = match list.len() {
            Self::MOST => "further warnings are left out".to_owned(),
            _ => message,
        };
        list.push(Self { location, message });
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.location, self.message)
    }
}

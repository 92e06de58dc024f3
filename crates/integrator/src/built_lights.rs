//! What chooses emitters, built once for several looks at a scene.

use crate::light_choosing::LightChoosing;
use crate::light_selection::{LightSelection, Sampler};
use lightshed_lights::LightError;
use lightshed_scene::{EmittersIdentity, Scene};
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

/// Trees over lights that several [`Stage`](crate::Stage)s share: those of the same scene with
/// other cameras, or at other sizes. Clones share what is in them.
///
/// A tree is found again by the emitters that it is over, so one such store may be used for any
/// number of scenes. What learns from images is not kept.
#[derive(Clone, Default)]
pub struct BuiltLights(Arc<Mutex<Vec<Built>>>);

struct Built {
    emitters: EmittersIdentity,
    choosing: LightChoosing,
    sampler: Option<Arc<Sampler>>,
}

impl BuiltLights {
    /// A selection among the scene's emitters. One that learns has learnt when this returns.
    pub(crate) fn selection<'a>(
        &self,
        scene: &'a Scene,
        choosing: LightChoosing,
    ) -> Result<LightSelection<'a>, LightError> {
        if choosing.learns() {
            return LightSelection::trained(scene, choosing);
        }
        let emitters = scene.emitters().identity();
        let known = {
            let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let mut kept = kept.iter();
            let found = kept.find(|built| built.choosing == choosing && built.emitters == emitters);
            found.map(|built| built.sampler.clone())
        };
        if let Some(sampler) = known {
            return Ok(LightSelection::of_sampler(scene, choosing, sampler));
        }
        let selection = LightSelection::new(scene, choosing)?;
        let sampler = selection.sampler();
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.push(Built {
            emitters,
            choosing,
            sampler,
        });
        Ok(selection)
    }
}

impl fmt::Debug for BuiltLights {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        f.debug_list()
            .entries(kept.iter().map(|built| built.choosing))
            .finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightshed_scene::{ImageBlocks, builtin};

    /// A tree is built once for a scene, whichever camera it has, and anew for another scene with
    /// as many lights; what learns is not kept.
    /// Planted faults: identities that are all equal; the way to choose is not asked.
    #[test]
    fn trees_are_built_once() {
        let scene = || Scene::new(&builtin::many_lights()).unwrap();
        let (mut one, other, lights) = (scene(), scene(), BuiltLights::default());
        let count = || lights.0.lock().unwrap().len();
        let of = |scene: &Scene, choosing: LightChoosing| {
            let selection = lights.selection(scene, choosing).unwrap();
            selection.sampler().map(|sampler| Arc::as_ptr(&sampler))
        };
        let first = of(&one, LightChoosing::Bvh);
        assert_eq!(of(&one, LightChoosing::Bvh), first);
        let settings = one.settings();
        let blocks = ImageBlocks::spread([settings.width, settings.height], 512.0, 16).unwrap();
        let seen = one
            .at_blocks(blocks, |scene| of(scene, LightChoosing::Bvh))
            .unwrap();
        assert_eq!((seen, count()), (first, 1));
        assert_ne!(of(&other, LightChoosing::Bvh), first);
        assert_ne!(of(&one, LightChoosing::Tree), first);
        assert_eq!(count(), 3);
        let _learnt = lights.selection(&one, LightChoosing::Vlc).unwrap();
        assert_eq!(count(), 3);
        assert_eq!(format!("{lights:?}"), "[Bvh, Bvh, Tree]");
    }
}

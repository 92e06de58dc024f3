//! Mixtures as the model of a field.

use super::fit::{VmfFit, VmfFitOptions, VmfSample};
use super::mixture::VmfMixture;
use crate::error::GuidingError;
use crate::model::DirectionalModel;
use crate::sample::TrainingSample;
use glam::Vec3;
use lightshed_spatial::Bounds;

/// A mixture of von Mises–Fisher lobes in each region ([`VmfFit`]), seen from each position by
/// the distances of the light that its lobes represent.
#[derive(Clone, Debug)]
pub struct VmfModel {
    options: VmfFitOptions,
}

impl VmfModel {
    /// Mixtures that learn in this way.
    ///
    /// # Errors
    /// [`GuidingError::Option`].
    pub fn new(options: VmfFitOptions) -> Result<Self, GuidingError> {
        VmfFit::new(options, Vec3::ZERO)?;
        Ok(Self { options })
    }
}

impl DirectionalModel for VmfModel {
    const ORDERED: bool = true;

    /// `None` has learnt nothing.
    type Record = Option<VmfFit>;
    type Distribution<'a> = VmfMixture;

    fn reset(&self, records: &mut [Option<VmfFit>]) {
        records.fill(None);
    }

    fn learn(&self, records: &mut [Option<VmfFit>], samples: &[TrainingSample], region: &Bounds) {
        let pivot = 0.5 * (region.min + region.max);
        // Options are valid; a region whose middle is not finite learns nothing.
        let (Some(record), Ok(fresh)) = (records.first_mut(), VmfFit::new(self.options, pivot)) else {
            return;
        };
        let seen = |sample: &TrainingSample| VmfSample {
            position: sample.position(),
            direction: sample.direction(),
            distance: sample.distance(),
            weight: sample.weight(),
        };
        let samples: Vec<VmfSample> = samples.iter().map(seen).collect();
        record.get_or_insert(fresh).update(&samples);
    }

    fn directions<'a>(&'a self, records: &'a [Option<VmfFit>], position: Vec3) -> VmfMixture {
        match records.first() {
            Some(Some(fit)) => fit.at(position),
            _ => VmfMixture::uniform(),
        }
    }

    fn is_sound(&self, records: &[Option<VmfFit>]) -> bool {
        records.iter().flatten().all(|fit| fit.pivot().is_finite())
    }
}

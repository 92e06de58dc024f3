//! A field as plain data, to be written to a file.

use crate::GuidingError;
use crate::field::{GuidingField, Region};
use crate::model::DirectionalModel;
use crate::options::FieldOptions;
use crate::partition::Partition;
use crate::passage::Passage;
use glam::Vec3;
use lightshed_spatial::Bounds;

/// Version of the layout of [`SavedField`].
const VERSION: u32 = 4;

/// The learnt data of a field, without its options; `R` is the model's record of a region. With the
/// feature `serde` it can be written and read in any format.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SavedField<R> {
    version: u32,
    /// Corners of the box.
    bounds: [[f32; 3]; 2],
    partition: Vec<u32>,
    records: Vec<R>,
    regions: Vec<Region>,
}

impl<M: DirectionalModel, P: Partition> GuidingField<M, P> {
    /// The learnt data of the field. Samples that wait for an update are not part of it.
    pub fn save(&self) -> SavedField<M::Record> {
        let Bounds { min, max } = *self.bounds();
        SavedField {
            version: VERSION,
            bounds: [min.to_array(), max.to_array()],
            partition: self.partition.save(),
            records: self.records.clone(),
            regions: self.regions.clone(),
        }
    }

    /// A field with the learnt data of another.
    ///
    /// # Errors
    /// [`GuidingError::Damaged`] for data that contradict themselves or the model, and the errors
    /// of [`GuidingField::new`].
    pub fn load(
        saved: &SavedField<M::Record>,
        model: M,
        options: FieldOptions,
    ) -> Result<Self, GuidingError> {
        let holds = |holds: bool, what| {
            if holds {
                Ok(())
            } else {
                Err(GuidingError::Damaged(what))
            }
        };
        holds(saved.version == VERSION, "another version")?;
        let [min, max] = saved.bounds.map(Vec3::from);
        let mut field = Self::new(Bounds { min, max }, model, options)?;
        field.partition = field.partition.load(&saved.partition)?;
        let (slots, stride) = (field.partition.slot_count(), field.model().stride());
        let fits = saved.records.len() == slots * stride && saved.regions.len() == slots;
        holds(fits, "records are missing, or too many")?;
        let mut records = saved.records.chunks(stride);
        let is_sound = records.all(|records| field.model().is_sound(records));
        holds(is_sound, "a region's records make no sense")?;
        let is_share = |region: &Region| (0.0..=1.0).contains(&region.share);
        holds(saved.regions.iter().all(is_share), "a share is not in 0..=1")?;
        let is_passage =
            |region: &Region| region.passage.is_sound() && region.arrivals.iter().all(Passage::is_sound);
        holds(saved.regions.iter().all(is_passage), "a passage makes no sense")?;
        field.records.clone_from(&saved.records);
        field.regions.clone_from(&saved.regions);
        field.tabulate();
        field.join_arrivals();
        Ok(field)
    }
}

//! From descriptions to media: everything is validated here.

use super::density::{AlbedoGrid, super_voxel};
use super::sides::{Boundaries, MediumSides};
use super::{GridField, Medium, MediumDensity, MediumEmission, MediumPhase};
use crate::{
    DensityDescription, EmissionDescription, GridDescription, GridFilter, MediumBoundary, MediumDescription,
    Rgb, SceneDescription, SceneError,
};
use glam::{Affine3A, Vec3};
use lightshed_volume::{DenseGrid, Filter, MajorantGrid};
use std::ops::Range;

/// The media of a scene. `triangles` are the ranges of the primitives that each shape became,
/// spheres after all triangles.
pub(crate) fn build_media(
    description: &SceneDescription,
    primitives: &[Range<usize>],
) -> Result<Boundaries, SceneError> {
    let SceneDescription {
        media,
        boundaries,
        camera_medium,
        shapes,
        ..
    } = description;
    let exists = |place: &dyn Fn() -> String, medium: Option<u32>| match medium {
        Some(medium) if medium as usize >= media.len() => Err(SceneError::MediumIndex {
            place: place(),
            medium,
            media: media.len(),
        }),
        _ => Ok(()),
    };
    exists(&|| "the camera".to_owned(), *camera_medium)?;
    let mut result = Boundaries {
        media: media.iter().map(medium).collect::<Result<_, _>>()?,
        camera_medium: *camera_medium,
        ..Boundaries::default()
    };
    if boundaries.is_empty() {
        return Ok(result);
    }
    let count = primitives.iter().map(|range| range.end).max().unwrap_or(0);
    result.by_primitive = vec![u32::MAX; count];
    for (index, boundary) in boundaries.iter().enumerate() {
        let MediumBoundary {
            shape,
            interior,
            exterior,
        } = *boundary;
        let Some(range) = primitives.get(shape as usize) else {
            return Err(SceneError::BoundaryShape {
                boundary: index,
                shape,
                shapes: shapes.len(),
            });
        };
        let place = || format!("shape '{}'", shapes[shape as usize].name);
        exists(&place, interior)?;
        exists(&place, exterior)?;
        for sides in &mut result.by_primitive[range.clone()] {
            if *sides != u32::MAX {
                return Err(SceneError::SecondBoundary { place: place() });
            }
            *sides = index as u32;
        }
        result.sides.push(MediumSides::new(interior, exterior));
    }
    Ok(result)
}

fn medium(description: &MediumDescription) -> Result<Medium, SceneError> {
    checked(description).map_err(|reason| SceneError::Medium {
        medium: description.name.clone(),
        reason,
    })
}

fn checked(description: &MediumDescription) -> Result<Medium, String> {
    let MediumDescription {
        name,
        density,
        extinction,
        albedo,
        albedo_grids,
        phase,
        emission,
    } = description;
    let sound = |rgb: &Rgb| rgb.is_finite() && rgb.min_element() >= 0.0;
    if !sound(extinction) {
        return Err("its extinction must be finite and not negative".to_owned());
    }
    if !(sound(albedo) && albedo.max_element() <= 1.0) {
        return Err("its albedo must be in [0, 1]".to_owned());
    }
    let albedo_grid = albedo_grid(albedo_grids)?;
    let density = match density {
        DensityDescription::Homogeneous => MediumDensity::Homogeneous,
        DensityDescription::Grid(grid) => {
            let edge = super_voxel(grid.resolution);
            let (grid, to_field) = placed(grid)?;
            let majorants = MajorantGrid::new(&grid, edge).map_err(|error| error.to_string())?;
            if !(extinction * majorants.range().max).is_finite() {
                return Err("its extinction overflows where it is densest".to_owned());
            }
            MediumDensity::Grid(Box::new(GridField {
                grid,
                majorants,
                to_field,
            }))
        }
    };
    let emission = match emission {
        Some(EmissionDescription { radiance, .. }) if !sound(radiance) => {
            return Err("its emitted radiance must be finite and not negative".to_owned());
        }
        Some(EmissionDescription { radiance, grid }) if *radiance != Rgb::ZERO => {
            let grid = grid.as_ref().map(placed).transpose()?;
            let greatest = grid.as_ref().map_or(1.0, |(grid, _)| grid.value_range().max);
            if !(radiance * greatest).is_finite() {
                return Err("its emitted radiance overflows".to_owned());
            }
            Some(MediumEmission {
                radiance: *radiance,
                grid,
            })
        }
        _ => None,
    };
    Ok(Medium {
        name: name.clone(),
        density,
        extinction: *extinction,
        albedo: *albedo,
        // Nothing emits where nothing absorbs.
        emission: emission.filter(|_| *albedo != Rgb::ONE || albedo_grid.is_some()),
        albedo_grid: albedo_grid.map(Box::new),
        phase: MediumPhase::new(phase)?,
    })
}

/// What the albedo is multiplied by, if anything.
fn albedo_grid(descriptions: &[GridDescription]) -> Result<Option<AlbedoGrid>, String> {
    let Some(first) = descriptions.first() else {
        return Ok(None);
    };
    if !matches!(descriptions.len(), 1 | 3) {
        return Err("its albedo needs one grid or three".to_owned());
    }
    if descriptions.iter().any(|grid| grid.to_world != first.to_world) {
        return Err("the grids of its albedo must lie at one place".to_owned());
    }
    if descriptions
        .iter()
        .any(|grid| grid.resolution != first.resolution)
    {
        return Err("the grids of its albedo must have one size".to_owned());
    }
    let (mut grids, mut to_field) = (Vec::new(), Affine3A::IDENTITY);
    for description in descriptions {
        let (grid, place) = placed(description)?;
        if grid.value_range().max > 1.0 {
            return Err("its albedo must be in [0, 1]".to_owned());
        }
        grids.push(grid);
        to_field = place;
    }
    Ok(Some(AlbedoGrid { grids, to_field }))
}

/// The grid, and the map from the world into its space, which counts voxels.
fn placed(description: &GridDescription) -> Result<(DenseGrid, Affine3A), String> {
    let GridDescription {
        resolution,
        values,
        filter,
        to_world,
    } = description;
    let filter = match filter {
        GridFilter::Nearest => Filter::Nearest,
        GridFilter::Trilinear => Filter::Trilinear,
    };
    let grid = DenseGrid::new(*resolution, values, filter).map_err(|error| error.to_string())?;
    let size = Vec3::from_array(resolution.map(|n| n as f32));
    let to_field = Affine3A::from_scale(size) * to_world.inverse();
    let back = to_field.inverse();
    if !(to_world.is_finite() && to_field.is_finite() && back.is_finite()) {
        return Err("the grid's transform must be finite and invertible".to_owned());
    }
    Ok((grid, to_field))
}

//! Emitters at a point.

use super::{check_rgb, luminance_f64};
use crate::{FlatDelta, Rgb};
use glam::Vec3;
use std::f64::consts::{PI, TAU};

/// An isotropic point light.
#[derive(Clone, Debug)]
pub struct Point {
    pub position: Vec3,
    pub intensity: Rgb,
}

impl Point {
    pub fn new(position: Vec3, intensity: Rgb) -> Result<Self, &'static str> {
        check_rgb(intensity)?;
        if !position.is_finite() {
            return Err("its position must be finite");
        }
        Ok(Self { position, intensity })
    }

    /// Luminous flux `4π I`.
    pub fn power(&self) -> f64 {
        2.0 * TAU * luminance_f64(self.intensity)
    }
}

/// A spot light: full intensity inside the beam, then falling linearly in the angle to nothing at
/// the cut-off.
#[derive(Clone, Debug)]
pub struct Spot {
    pub position: Vec3,
    direction: Vec3,
    intensity: Rgb,
    cos_cutoff: f32,
    cos_beam: f32,
    cutoff_angle: f32,
    /// One over the width of the fall-off, or 0 if it has none.
    inverse_transition: f32,
}

impl Spot {
    pub fn new(
        position: Vec3,
        direction: Vec3,
        intensity: Rgb,
        beam_width: f32,
        cutoff_angle: f32,
    ) -> Result<Self, &'static str> {
        check_rgb(intensity)?;
        if !position.is_finite() {
            return Err("its position must be finite");
        }
        let direction = direction
            .try_normalize()
            .ok_or("its direction must be finite and not zero")?;
        if !(beam_width >= 0.0 && beam_width <= cutoff_angle && cutoff_angle <= std::f32::consts::PI)
            || cutoff_angle <= 0.0
        {
            return Err(
                "its angles must satisfy 0 <= beam width <= cut-off <= 180 degrees, cut-off positive",
            );
        }
        let transition = cutoff_angle - beam_width;
        Ok(Self {
            position,
            direction,
            intensity,
            cos_cutoff: cutoff_angle.cos(),
            cos_beam: beam_width.cos(),
            cutoff_angle,
            inverse_transition: if transition > 0.0 { 1.0 / transition } else { 0.0 },
        })
    }

    /// Its unit axis and the angle from it beyond which there is nothing, in radians.
    pub fn cone(&self) -> (Vec3, f32) {
        (self.direction, self.cutoff_angle)
    }

    /// As a shader reads it, but for the probability of being chosen.
    pub fn flat(&self) -> FlatDelta {
        FlatDelta {
            place: self.position,
            intensity: self.intensity,
            axis: self.direction,
            cos_beam: self.cos_beam,
            cos_cutoff: self.cos_cutoff,
            cutoff_angle: self.cutoff_angle,
            inverse_transition: self.inverse_transition,
            ..FlatDelta::default()
        }
    }

    /// Radiant intensity inside the beam.
    pub fn intensity(&self) -> Rgb {
        self.intensity
    }

    /// Radiant intensity towards `point`.
    #[inline]
    pub fn intensity_towards(&self, point: Vec3) -> Rgb {
        let Some(to_point) = (point - self.position).try_normalize() else {
            return Rgb::ZERO;
        };
        let cos_theta = self.direction.dot(to_point);
        if cos_theta >= self.cos_beam {
            self.intensity
        } else if cos_theta <= self.cos_cutoff {
            Rgb::ZERO
        } else {
            self.intensity
                * ((self.cutoff_angle - cos_theta.clamp(-1.0, 1.0).acos()) * self.inverse_transition)
        }
    }

    /// Luminous flux: the beam's cone and, roughly, half of the fall-off's.
    pub fn power(&self) -> f64 {
        let mean_cos = f64::from(0.5 * (self.cos_beam + self.cos_cutoff));
        (TAU * (1.0 - mean_cos)).max(1e-6 * PI) * luminance_f64(self.intensity)
    }
}

//! Guides at eight diffuse vertices: asked one after the other, between steps that are taken in
//! lanes.

use super::guide::{DirectionGuide, GuidedVertex, usable_share};
use super::transport::Transport;
use crate::emitter_sampler::EmitterSampler;
use crate::light_selection::diffuse_shading_point;
use lightshed_lanes::{LANES, LaneKernel, Lanes};
use lightshed_sampling::DirectionDistribution;
use lightshed_scene::Rgb;
use lightshed_scene::glam::Vec3;

/// Eight vectors in memory, coordinate by coordinate.
pub(super) type VectorRows = [[f32; LANES]; 3];

/// A vector of one lane.
#[inline(always)]
pub(super) fn vector(rows: &VectorRows, lane: usize) -> Vec3 {
    Vec3::new(rows[0][lane], rows[1][lane], rows[2][lane])
}

/// Sets the vector of one lane.
#[inline(always)]
pub(super) fn set_vector(rows: &mut VectorRows, lane: usize, vector: Vec3) {
    (rows[0][lane], rows[1][lane], rows[2][lane]) = (vector.x, vector.y, vector.z);
}

/// Eight vertices with their questions to a guide; sets of lanes are bits.
pub(super) struct GuideQuestions {
    pub position: VectorRows,
    pub normal: VectorRows,
    /// Towards the previous vertices.
    pub outgoing: VectorRows,
    /// Towards the sampled emitters, in the lanes `lit` where their density is needed.
    pub light: VectorRows,
    pub lit: u32,
    /// Directions sampled by the BSDF, in the lanes `scatters`.
    pub own: VectorRows,
    pub scatters: u32,
    /// The numbers that choose between BSDF and guide, and those of a direction.
    pub u_lobe: [f32; LANES],
    pub u: [[f32; LANES]; 2],
    /// Of the paths as they come, by their edges of this number.
    pub throughput: VectorRows,
    pub depth: u32,
}

/// The answers.
pub(super) struct GuideAnswers {
    /// `α`; zero without a guide.
    pub share: [f32; LANES],
    /// `p_g` of the direction towards the emitter.
    pub light_pdf: [f32; LANES],
    /// Lanes whose direction is to be the guide's …
    pub picked: u32,
    /// … of which these got none.
    pub failed: u32,
    /// Directions of the guide, in the picked lanes.
    pub direction: VectorRows,
    /// `p_g` of the direction, the guide's or the BSDF's.
    pub pdf: [f32; LANES],
    /// Probabilities of survival that the guide asks for, in the lanes `judged`.
    pub survival: [f32; LANES],
    pub judged: u32,
}

impl GuideQuestions {
    /// Asks the guide in the lanes `wanted`. In a function of its own, with the lanes'
    /// instructions: guides count bits.
    #[inline(never)]
    pub fn ask<S: EmitterSampler, G: DirectionGuide>(
        &self,
        transport: &Transport<'_, S, G>,
        wanted: u32,
    ) -> GuideAnswers {
        transport.lanes.run(Ask {
            questions: self,
            transport,
            wanted,
        })
    }
}

struct Ask<'q, 's, S, G> {
    questions: &'q GuideQuestions,
    transport: &'q Transport<'s, S, G>,
    wanted: u32,
}

impl<S: EmitterSampler, G: DirectionGuide> LaneKernel for Ask<'_, '_, S, G> {
    type Output = GuideAnswers;

    #[inline(always)]
    fn run<L: Lanes>(self) -> GuideAnswers {
        let questions = self.questions;
        let mut answers = GuideAnswers {
            share: [0.0; LANES],
            light_pdf: [0.0; LANES],
            picked: 0,
            failed: 0,
            direction: [[0.0; LANES]; 3],
            pdf: [0.0; LANES],
            survival: [1.0; LANES],
            judged: 0,
        };
        let reflects = self.transport.guide.uses_reflection();
        let mut left = self.wanted;
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            let [position, normal, outgoing] =
                [&questions.position, &questions.normal, &questions.outgoing].map(|rows| vector(rows, lane));
            let lit = || {
                let facing = if normal.dot(outgoing) < 0.0 {
                    -normal
                } else {
                    normal
                };
                diffuse_shading_point(position, facing, Rgb::ONE)
            };
            let vertex = GuidedVertex {
                position,
                normal: Some(normal),
                outgoing,
                lit: reflects.then(lit),
            };
            let throughput: Rgb = vector(&questions.throughput, lane);
            if let Some(survival) = self.transport.survival(|| vertex, throughput, questions.depth) {
                answers.survival[lane] = survival;
                answers.judged |= 1 << lane;
            }
            // Distributions may be large: they are not moved.
            let guidance = self.transport.guide.guide(&vertex);
            let Some((directions, share)) = &guidance else {
                continue;
            };
            let Some(share) = usable_share(*share) else {
                continue;
            };
            answers.share[lane] = share;
            if questions.lit >> lane & 1 == 1 {
                answers.light_pdf[lane] = directions.pdf(vector(&questions.light, lane)).value();
            }
            if questions.u_lobe[lane] < share {
                answers.picked |= 1 << lane;
                match directions.sample([questions.u[0][lane], questions.u[1][lane]]) {
                    Some((direction, pdf)) => {
                        set_vector(&mut answers.direction, lane, direction);
                        answers.pdf[lane] = pdf.value();
                    }
                    None => answers.failed |= 1 << lane,
                }
            } else if questions.scatters >> lane & 1 == 1 {
                answers.pdf[lane] = directions.pdf(vector(&questions.own, lane)).value();
            }
        }
        answers
    }
}

//! Who answers the rays of a stream: this library and Embree, together or one by one.

use crate::embree::{EmbreeScene, Packet, Queries};
use crate::ray_streams::Batch;
use lightshed::scene::{Accelerator, HitBatch, Ray};
use std::error::Error;

/// Someone who answers rays.
pub trait Contender {
    /// Puts rays into its own structures.
    fn take(&mut self, batches: &[Batch]);
    /// Answers them.
    fn answer(&mut self);
    /// Adds for each ray how far its nearest hit is, or zero for any hit; infinitely far for none.
    fn tell(&self, distances: &mut Vec<f32>);
}

/// What is asked.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Query {
    Nearest,
    Any,
}

/// Our batches.
struct Together<'a> {
    tree: &'a Accelerator,
    query: Query,
    batches: Vec<Batch>,
    hits: Vec<HitBatch>,
    occluded: Vec<u64>,
}

impl Contender for Together<'_> {
    fn take(&mut self, batches: &[Batch]) {
        self.batches.clear();
        self.batches.extend_from_slice(batches);
        self.hits.resize(batches.len(), HitBatch::NONE);
        self.occluded.resize(batches.len(), 0);
    }

    fn answer(&mut self) {
        if self.query == Query::Any {
            for (batch, occluded) in self.batches.iter().zip(&mut self.occluded) {
                *occluded = self.tree.occluded_batch(&batch.rays, batch.count);
            }
        } else {
            for (batch, hits) in self.batches.iter().zip(&mut self.hits) {
                self.tree.intersect_batch(&batch.rays, batch.count, hits);
            }
        }
    }

    fn tell(&self, distances: &mut Vec<f32>) {
        for ((batch, hits), occluded) in self.batches.iter().zip(&self.hits).zip(&self.occluded) {
            distances.extend((0..batch.count).map(|index| match self.query {
                Query::Any => any_distance(occluded >> index & 1 == 1),
                Query::Nearest => hits.get(index).map_or(f32::INFINITY, |hit| hit.t),
            }));
        }
    }
}

fn any_distance(is_occluded: bool) -> f32 {
    if is_occluded { 0.0 } else { f32::INFINITY }
}

/// Our rays one by one.
struct Alone<'a> {
    tree: &'a Accelerator,
    query: Query,
    rays: Vec<Ray>,
    distances: Vec<f32>,
}

impl Contender for Alone<'_> {
    fn take(&mut self, batches: &[Batch]) {
        self.rays.clear();
        for batch in batches {
            self.rays
                .extend((0..batch.count).map(|index| batch.rays.get(index)));
        }
        self.distances.resize(self.rays.len(), 0.0);
    }

    fn answer(&mut self) {
        for (ray, distance) in self.rays.iter().zip(&mut self.distances) {
            *distance = match self.query {
                Query::Any => any_distance(self.tree.occluded(ray)),
                Query::Nearest => self.tree.intersect(ray).map_or(f32::INFINITY, |hit| hit.t),
            };
        }
    }

    fn tell(&self, distances: &mut Vec<f32>) {
        distances.extend_from_slice(&self.distances);
    }
}

/// Embree's packets, or rays one by one.
struct Packets<'a, const N: usize> {
    queries: Queries<'a, N>,
    query: Query,
    packets: Vec<(Packet<N>, usize)>,
}

impl<const N: usize> Contender for Packets<'_, N> {
    fn take(&mut self, batches: &[Batch]) {
        self.packets.clear();
        for batch in batches {
            for start in (0..batch.count).step_by(N) {
                let count = N.min(batch.count - start);
                let mut packet = Packet::EMPTY;
                for index in 0..count {
                    packet.set(index, &batch.rays.get(start + index));
                }
                self.packets.push((packet, count));
            }
        }
    }

    fn answer(&mut self) {
        for (packet, count) in &mut self.packets {
            self.queries.ask(packet, *count);
        }
    }

    fn tell(&self, distances: &mut Vec<f32>) {
        for (packet, count) in &self.packets {
            distances.extend((0..*count).map(|index| match self.query {
                Query::Any => any_distance(packet.is_occluded(index)),
                Query::Nearest => packet.distance(index),
            }));
        }
    }
}

/// Our batches through a tree.
pub fn together<'a>(tree: &'a Accelerator, query: Query) -> Box<dyn Contender + 'a> {
    Box::new(Together {
        tree,
        query,
        batches: Vec::new(),
        hits: Vec::new(),
        occluded: Vec::new(),
    })
}

/// Our rays through a tree, one by one.
pub fn alone<'a>(tree: &'a Accelerator, query: Query) -> Box<dyn Contender + 'a> {
    Box::new(Alone {
        tree,
        query,
        rays: Vec::new(),
        distances: Vec::new(),
    })
}

/// Embree's packets of `N` rays, which may be announced as coherent.
pub fn packets<'a, const N: usize>(
    scene: &'a EmbreeScene<'_>,
    query: Query,
    coherent: bool,
) -> Result<Box<dyn Contender + 'a>, Box<dyn Error>> {
    Ok(Box::new(Packets {
        queries: scene.queries::<N>(query == Query::Any, coherent)?,
        query,
        packets: Vec::new(),
    }))
}

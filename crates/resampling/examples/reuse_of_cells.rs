//! Rooms of a house share what they know about 64 lamps: reuse over a graph, with a room where
//! nobody is.
//!
//! `cargo run --release -p lightshed-resampling --example reuse_of_cells`
use lightshed_resampling::{
    Counting, Domain, DomainReservoir, History, IdentityShift, MergeRule, Moments, NeighbourLists, Reuse,
    Ris, Tractable,
};
use lightshed_sampling::CounterRng;

/// A room at `x`, lit by lamps all along the house; every seventh lamp is strong.
struct Room(f64);

impl Domain for Room {
    type Sample = u32;
    type Space = Counting;
    fn target(&self, &lamp: &u32) -> f64 {
        let distance = f64::from(lamp) / 8.0 - self.0;
        (if lamp % 7 == 0 { 9.0 } else { 1.0 }) / (0.1 + distance * distance)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A corridor (room 0) with six rooms on it. Nobody is in room 4.
    let room = |i| (i != 4).then_some(Room(f64::from(i) + 0.5));
    let rooms: Vec<Option<Room>> = (0..7).map(room).collect();
    let doors = NeighbourLists::new((0..7).map(|i| if i == 0 { (1..7).collect() } else { vec![0] }))?;
    let reuse = Reuse::new(&rooms, MergeRule::new(IdentityShift));
    let uniform = Tractable::<Counting>::from_density(1.0 / 64.0)?.weight();
    // Of room 3, where every third lamp is hidden.
    let light = |lamp: &u32| Room(3.5).target(lamp) * if lamp.is_multiple_of(3) { 0.0 } else { 1.0 };
    let (mut alone, mut shared) = (Moments::new(), Moments::new());
    for chain in 0..4000 {
        let mut held = vec![DomainReservoir::<Room>::empty(0.0); rooms.len()];
        let mut merged = held.clone();
        for frame in 0..8 {
            let rng = |pass| move |room: usize| CounterRng::new(pass, room as u32, chain * 8 + frame);
            let draw = |(index, room): (usize, &Option<Room>)| {
                let (mut ris, mut rng) = (Ris::new(), rng(0)(index));
                let lamp = rng.next_u32() % 64;
                let target = room.as_ref().map_or(0.0, |room| room.target(&lamp));
                ris.candidate(lamp, target, uniform, &mut rng);
                ris.finish(1.0)
            };
            let fresh: Vec<_> = rooms.iter().enumerate().map(draw).collect();
            reuse.temporal(&fresh, History::new(&rooms, &held), Some, &mut merged, rng(1))?;
            reuse.spatial(&doors, &merged, &mut held, rng(2))?;
            alone.push(fresh[3].estimate(light));
            shared.push(held[3].estimate(light));
        }
    }
    for (name, light) in [("one candidate", alone), ("with reuse", shared)] {
        let (mean, deviation) = (light.mean(), light.variance().sqrt());
        println!("{name:>13}: light of room 3 {mean:.2}, standard deviation {deviation:.1}");
    }
    Ok(())
}

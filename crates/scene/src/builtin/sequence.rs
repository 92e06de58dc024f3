//! Figures that look random.

/// The SplitMix64 sequence (Steele, Lea and Flood 2014): a scene must never change with a generator
/// meant for sampling.
pub(super) struct Sequence(pub u64);

impl Sequence {
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        let unit = (z >> 40) as f32 / (1_u32 << 24) as f32;
        low + (high - low) * unit
    }
}

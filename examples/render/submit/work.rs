//! How many shards a task renders, so that reading the scene costs little.

/// Share of a task's processor time that reading the scene should not exceed.
const MOST_READING: f64 = 0.01;

/// Tasks that a job keeps: machines to distribute them over may be many.
const LEAST_TASKS: u64 = 64;

/// Processor seconds of a frame, as far as they are known before it is rendered.
#[derive(Clone, Copy)]
pub struct Work {
    /// Reading the scene and building its structures, once in every task. Measured.
    pub reading: f64,
    /// Rendering all samples of a frame. An estimate from the number of paths.
    pub rendering: f64,
}

impl Work {
    /// Seconds of a shard out of `shards`.
    fn of_shard(self, shards: u32) -> f64 {
        self.rendering / f64::from(shards)
    }

    /// Shards of a task, of `shards` in each of `frames` frames: as many as keep reading below
    /// [`MOST_READING`], but no more than leave [`LEAST_TASKS`] tasks.
    pub fn per_task(self, shards: u32, frames: u32) -> u32 {
        let wanted = (self.reading / (MOST_READING * self.of_shard(shards))).ceil();
        let most = u64::from(shards) * u64::from(frames) / LEAST_TASKS;
        // The cast saturates.
        (wanted as u64).min(most).clamp(1, u64::from(shards)) as u32
    }

    /// Share of reading in a task of `per_task` shards, if that is too large.
    pub fn too_much_reading(self, shards: u32, per_task: u32) -> Option<f64> {
        let rendering = self.of_shard(shards) * f64::from(per_task);
        let share = self.reading / (self.reading + rendering);
        (share > 1.5 * MOST_READING).then_some(share)
    }
}

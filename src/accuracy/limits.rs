//! Limits of memory and time: a run on a finer mesh that would exceed them is not begun.
//!
//! The need of a run on N triangles follows from two runs before, on N₀ < N₁ triangles, by a straight line:
//!
//! c(N) = c₁ + (c₁ − c₀)/(N₁ − N₀) (N − N₁), with c the peak memory of the process or the seconds of the run.
//!
//! Factors grow faster. So the rounds leave half of the free memory and of the time alone.

use crate::{memory, petsc::Communicator, scene::Scene};
use std::time::Instant;

/// A smaller difference in triangles is no measure of the growth: the first run takes some memory whatever its mesh.
const MANY: f64 = 200.0;

/// The memory and the time that the rounds may take, and have taken.
pub(super) struct Limits {
    comm: Communicator,
    started: Instant,
    /// The largest memory, bytes, and the longest time of all rounds, s.
    allowed: [f64; 2],
    /// The last two runs on ever finer meshes: the triangles, the peak memory, bytes, and the seconds.
    runs: [(f64, [f64; 2]); 2],
}

impl Limits {
    /// The limits of the scene, or half of the memory that is free now, without that for swapping. Collective.
    pub(super) fn new(comm: Communicator, scene: &Scene) -> Self {
        let [peak, free] = [memory::peak(), memory::free()].map(|bytes| comm.total(bytes));
        let bytes = scene.max_memory.map_or(peak + 0.5 * free, |megabytes| 1e6 * megabytes);
        let seconds = scene.max_seconds.map_or(f64::INFINITY, |seconds| 0.5 * seconds);
        let start = (0.0, [peak, 0.0]);
        Self { comm, started: Instant::now(), allowed: [bytes, seconds], runs: [start; 2] }
    }

    /// The result of `run`, a run on `triangles` triangles, whose cost is measured. Collective.
    pub(super) fn measure<T>(&mut self, triangles: usize, run: impl FnOnce() -> T) -> T {
        let started = Instant::now();
        let result = run();
        let seconds = self.comm.max(started.elapsed().as_secs_f64());
        let cost = [self.comm.total(memory::peak()), seconds];
        if triangles as f64 > self.runs[1].0 {
            self.runs = [self.runs[1], (triangles as f64, cost)];
        }
        result
    }

    /// The reason why runs on meshes with these numbers of `triangles` must not start: together they would exceed a limit. `None`
    /// if they may start. Collective.
    pub(super) fn exceeded(&self, triangles: &[usize]) -> Option<String> {
        let [(before, first), (last, second)] = self.runs;
        let cost = |count: &usize, i: usize| {
            let slope = (second[i] - first[i]) / (last - before).max(MANY);
            (second[i] + slope * (*count as f64 - last)).max(0.0)
        };
        let [bytes, seconds] = self.allowed;
        let needed = triangles.iter().map(|count| cost(count, 0)).fold(0.0, f64::max);
        let passed = self.comm.max(self.started.elapsed().as_secs_f64());
        let longer = passed + triangles.iter().map(|count| cost(count, 1)).sum::<f64>();
        let megabytes = [needed, bytes].map(|bytes| 1e-6 * bytes);
        match () {
            () if needed > bytes => Some(format!(
                "finer meshes would take {:.0} MB of memory, and {:.0} MB are allowed (--max-memory)",
                megabytes[0], megabytes[1]
            )),
            () if longer > seconds => Some(format!(
                "finer meshes would take {longer:.1} s, and meshes may take {seconds:.1} s, half of the time allowed \
                 (--max-seconds)"
            )),
            () => None,
        }
    }
}

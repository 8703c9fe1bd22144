//! The ranks of a run and the communication between them (MPI).

use super::{raw, session::world};
use std::{
    env,
    ffi::{c_int, c_void},
    mem,
    time::{Duration, Instant},
};

/// Environment variables that the launchers known to Open MPI set in every process they start.
const LAUNCHERS: [&str; 4] = ["OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID"];

/// This rank and the number of ranks: sums and decisions over the whole body go through it.
///
/// Every reduction is collective: all ranks call it, at the same point of the run, and
/// all get the same answer to the last bit. A single rank gets its own value back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Communicator {
    rank: usize,
    size: usize,
}

impl Communicator {
    /// False if PETSc was built without MPI. Then there is one rank.
    pub const HAS_MPI: bool = cfg!(not(petsc_without_mpi));

    /// A single rank, which owns the whole body.
    pub fn serial() -> Self {
        Self { rank: 0, size: 1 }
    }

    /// The ranks of the world communicator; MPI runs.
    pub(super) fn of_world() -> Self {
        let (mut rank, mut size): (c_int, c_int) = (0, 1);
        // SAFETY: only a session calls this, and MPI runs while a session exists.
        unsafe {
            raw::MPI_Comm_rank(world(), &mut rank);
            raw::MPI_Comm_size(world(), &mut size);
        }
        Self { rank: rank as usize, size: size as usize }
    }

    /// The number of ranks that a launcher has started, including this one. It is read from the environment,
    /// before MPI runs. `None` for a process that no launcher started (a singleton).
    pub fn launched() -> Option<usize> {
        LAUNCHERS.iter().find(|name| env::var_os(name).is_some())?;
        // Open MPI, and the process managers of MPICH.
        let sizes = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"].map(|name| env::var(name).ok());
        Some(sizes.into_iter().flatten().find_map(|size| size.parse().ok()).unwrap_or(1))
    }

    /// The index of this rank, from 0.
    pub fn rank(self) -> usize {
        self.rank
    }

    /// The number of ranks.
    pub fn size(self) -> usize {
        self.size
    }

    /// Whether this is the only rank.
    pub fn is_serial(self) -> bool {
        self.size == 1
    }

    /// Whether this is rank 0, which prints and writes for all.
    pub fn is_root(self) -> bool {
        self.rank == 0
    }

    /// Replaces each value by its sum over the ranks.
    pub fn sum(self, values: &mut [f64]) {
        self.reduce(values, raw::MPI_SUM);
    }

    /// The sum of the ranks' values.
    pub fn total(self, value: f64) -> f64 {
        let mut sum = [value];
        self.sum(&mut sum);
        sum[0]
    }

    /// The sum of the ranks' counts; exact below 2⁵³, as MPI adds them as doubles.
    pub fn count(self, value: usize) -> usize {
        self.total(value as f64) as usize
    }

    /// The maximum of the ranks' values; NaN if one of them is. MPI does not define the maximum with a NaN.
    pub fn max(self, value: f64) -> f64 {
        let mut max = if value.is_nan() { [f64::INFINITY, 1.0] } else { [value, 0.0] };
        self.reduce(&mut max, raw::MPI_MAX);
        if max[1] > 0.0 { f64::NAN } else { max[0] }
    }

    /// The minimum of the ranks' values; NaN if one of them is.
    pub fn min(self, value: f64) -> f64 {
        -self.max(-value)
    }

    /// The minimum of the ranks' values and the first rank that has it (as MPI_MINLOC), or that has NaN.
    pub fn min_with_rank(self, value: f64) -> (f64, usize) {
        let minimum = self.min(value);
        let has_it = value == minimum || value.is_nan();
        let first = self.min(if has_it { self.rank as f64 } else { f64::INFINITY });
        (minimum, first as usize)
    }

    /// The value of rank `from` (as MPI_Bcast).
    pub fn broadcast(self, from: usize, value: f64) -> f64 {
        self.total(if self.rank == from { value } else { 0.0 })
    }

    /// The bytes of rank 0 (MPI_Bcast).
    pub fn broadcast_bytes(self, mut bytes: Vec<u8>) -> Vec<u8> {
        bytes.resize(self.broadcast(0, bytes.len() as f64) as usize, 0);
        // MPI's counts have 32 bits.
        for part in bytes.chunks_mut(1 << 30).filter(|_| !self.is_serial()) {
            let (data, count) = (part.as_mut_ptr().cast::<c_void>(), part.len() as c_int);
            // SAFETY: MPI runs on several ranks, and each of them has `count` bytes at `data`.
            unsafe { raw::MPI_Bcast(data, count, raw::MPI_BYTE, 0, world()) };
        }
        bytes
    }

    /// Whether the condition is true on some rank.
    pub fn any(self, condition: bool) -> bool {
        self.max(f64::from(condition)) > 0.0
    }

    /// Whether the condition is true on every rank.
    pub fn all(self, condition: bool) -> bool {
        !self.any(!condition)
    }

    /// The values of all ranks, one after the other (as MPI_Allgatherv).
    pub fn gather(self, values: &[f64]) -> Vec<f64> {
        let mut counts = vec![0.0; self.size];
        counts[self.rank] = values.len() as f64;
        self.sum(&mut counts);
        let before = counts[..self.rank].iter().sum::<f64>() as usize;
        let mut all = vec![0.0; counts.iter().sum::<f64>() as usize];
        all[before..][..values.len()].copy_from_slice(values);
        self.sum(&mut all);
        all
    }

    /// Waits until all ranks have reached this call, at most for the time `limit` (MPI_Ibarrier).
    /// False if a rank has not reached it by then: it waits in another collective call.
    pub fn barrier(self, limit: Option<Duration>) -> bool {
        if self.is_serial() {
            return true;
        }
        let started = Instant::now();
        let mut complete = 0;
        // SAFETY: MPI runs on several ranks; the request lives until it is complete or the run ends. MPI sets it and the
        // status, plain C data.
        unsafe {
            let (mut request, mut status) = (mem::zeroed(), mem::zeroed());
            raw::MPI_Ibarrier(world(), &mut request);
            loop {
                raw::MPI_Test(&mut request, &mut complete, &mut status);
                if complete != 0 || limit.is_some_and(|limit| started.elapsed() > limit) {
                    return complete != 0;
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }

    /// Ends all of several ranks at once with an exit code, wherever they are (MPI_Abort).
    pub fn abort(self, code: u8) {
        if !self.is_serial() {
            // SAFETY: MPI runs on several ranks.
            unsafe { raw::MPI_Abort(world(), i32::from(code)) };
        }
    }

    /// Replaces `values` by their reduction over the ranks (MPI_Allreduce).
    fn reduce(self, values: &mut [f64], operation: raw::MPI_Op) {
        if self.is_serial() {
            return;
        }
        let sent = values.to_vec();
        let (from, to) = (sent.as_ptr().cast::<c_void>(), values.as_mut_ptr().cast::<c_void>());
        let (count, kind) = (values.len() as c_int, raw::MPI_DOUBLE);
        // SAFETY: only `of_world` makes a communicator of several ranks, so MPI runs. It reads and writes
        // `values.len()` numbers. Its error handler ends the run.
        unsafe {
            raw::MPI_Allreduce(from, to, count, kind, operation, world());
        }
    }
}

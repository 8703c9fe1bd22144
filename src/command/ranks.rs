//! Several ranks, one program: they go on together or end together, with one message.

use super::Failure;
use signorini::petsc::Communicator;
use std::{process::ExitCode, time::Duration};

/// How long a rank that failed waits for the others to notice. Where what failed is known to all,
/// they come at once.
const PATIENCE: Duration = Duration::from_secs(10);

/// All ranks go on with their values, or none: the first rank that failed for a reason of its own
/// says why, and all end with its exit code. Collective.
///
/// # Errors
/// On several ranks [`Failure::AlreadyReported`].
pub fn together<T>(comm: Communicator, result: Result<T, Failure>) -> Result<T, Failure> {
    if comm.is_serial() {
        return result;
    }
    let failed = comm.any(result.is_err());
    let failure = match result {
        Ok(value) if !failed => return Ok(value),
        Ok(_) => Failure::OnAnotherRank,
        Err(failure) => failure,
    };
    let silent = matches!(failure, Failure::OnAnotherRank);
    let (_, speaker) = comm.min_with_rank(if silent { 1.0 } else { 0.0 });
    if comm.rank() == speaker {
        eprintln!("error: {failure}");
    }
    // Only when it is said: the first process that ends with an error ends the others.
    Err(Failure::AlreadyReported(comm.broadcast(speaker, f64::from(failure.code())) as u8))
}

/// Waits for the other ranks. Where this one has failed and they do not come, because it has
/// failed alone while they wait for it, it says so and ends them all. Collective.
pub fn rejoin<T>(comm: Communicator, result: &Result<T, Failure>) {
    let patience = result.is_err().then_some(PATIENCE);
    if !comm.barrier(patience)
        && let Err(failure) = result
    {
        eprintln!("error: rank {} of {}: {failure}", comm.rank(), comm.size());
        comm.abort(failure.code());
    }
}

/// Refuses to do something else than a run on several ranks.
pub fn refuse_ranks(command: &str) -> Result<(), ExitCode> {
    if Communicator::launched() == 1 {
        return Ok(());
    }
    // Every rank comes here; that one speaks needs no communication.
    let first = ["OMPI_COMM_WORLD_RANK", "PMI_RANK"]
        .into_iter()
        .find_map(|name| std::env::var(name).ok())
        .is_none_or(|rank| rank == "0");
    if first {
        eprintln!("error: `signorini {command}` runs in one process; start it without mpiexec");
    }
    Err(ExitCode::from(2))
}

//! Failures on several ranks: all ranks end with one message and one exit code.

use super::{Failure, tell};
use signorini::{
    evolution::RunError,
    petsc::{Communicator, Session},
};
use std::{process, time::Duration};

/// The time for which a failed rank waits for the others. If they know of the failure, they arrive at once.
const PATIENCE: Duration = Duration::from_secs(10);

/// Agreement of the ranks (as by Open MPI's MPIX_Comm_agree): all ranks go on with their values, or all fail.
/// The first rank with an error reports it, and all ranks end with its exit code. Collective.
pub fn agree<T>(comm: Communicator, result: Result<T, Failure>) -> Result<T, Failure> {
    let failed = comm.any(result.is_err());
    let failure = match result {
        Ok(value) if !failed => return Ok(value),
        Ok(_) => Failure::ON_ANOTHER_RANK,
        Err(failure) => failure,
    };
    let (_, reporter) = comm.min_with_rank(if failure.message.is_some() { 0.0 } else { 1.0 });
    if comm.rank() == reporter {
        tell("error", failure.message.as_deref().unwrap_or("another rank failed"));
    }
    // This follows the report, because mpiexec ends all ranks as soon as one ends with an error.
    let code = comm.broadcast(reporter, f64::from(failure.code)) as u8;
    Err(Failure { code, message: None })
}

/// A barrier after a run. If one rank fails alone, the others wait for it in a collective call. After
/// [`PATIENCE`] the failed rank reports its failure and aborts all ranks. Collective.
pub fn barrier_or_abort(comm: Communicator, failure: Option<&RunError>) {
    if !comm.barrier(failure.map(|_| PATIENCE))
        && let Some(error) = failure
    {
        tell("error", &format!("rank {} of {}: {error}", comm.rank(), comm.size()));
        let code = Failure::from(error).code;
        comm.abort(code);
        process::exit(code.into());
    }
}

/// Checks that `mpiexec` has not started several processes, for commands other than `signorini run`.
pub fn require_one_process() -> Result<(), Failure> {
    if Communicator::launched().is_none_or(|ranks| ranks == 1) {
        return Ok(());
    }
    let session = Session::start(&[])?;
    let problem =
        "only `signorini run` uses several processes; start other commands without mpiexec";
    let refused = agree(session.comm(), Err(Failure::input(problem)));
    session.finalize()?;
    refused
}

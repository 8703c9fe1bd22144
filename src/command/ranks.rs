//! Several ranks fail as one program: they agree that one of them has failed, and all end with one
//! message and one exit code.

use super::{Failure, tell};
use signorini::{
    evolution::RunError,
    petsc::{Communicator, Session},
};
use std::time::Duration;

/// How long a rank that has failed waits for the others. Where they know of the failure they come at
/// once.
const PATIENCE: Duration = Duration::from_secs(10);

/// Agreement on a step of the program (as by Open MPI's MPIX_Comm_agree): all ranks go on with their
/// values, or all fail. Of the ranks with an error of their own the first reports it, and all end
/// with its exit code. Collective.
pub fn agree<T>(comm: Communicator, result: Result<T, Failure>) -> Result<T, Failure> {
    if comm.is_serial() {
        return result;
    }
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
    // This comes after the report, because mpiexec ends all ranks as soon as one ends with an error.
    let code = comm.broadcast(reporter, f64::from(failure.code)) as u8;
    Err(Failure { code, message: None })
}

/// A barrier behind a run in which one rank may fail alone, while the others wait for it in some
/// collective call: after [`PATIENCE`] it then reports its failure and aborts them all. Collective.
pub fn barrier_or_abort(comm: Communicator, failure: Option<&RunError>) {
    if !comm.barrier(failure.map(|_| PATIENCE))
        && let Some(error) = failure
    {
        tell("error", &format!("rank {} of {}: {error}", comm.rank(), comm.size()));
        comm.abort(Failure::from(error).code);
    }
}

/// Refuses what is not `signorini run` where `mpiexec` has started several processes.
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

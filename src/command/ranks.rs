//! Several ranks: how a run starts itself on them, and failures, at which all ranks end with one message and one exit code.

use super::{Failure, tell, words};
use signorini::{
    evolution::RunError,
    petsc::{Communicator, Session},
};
use std::{
    convert::Infallible,
    env,
    num::NonZero,
    os::unix::process::CommandExt,
    process::{self, Command},
    str::FromStr,
    thread,
    time::Duration,
};

/// The unknowns of the displacements from which r ranks pay are this number times r²: the dense Schur complement of the interface is
/// shared. Two pay from 100,000, four from 400,000 (SPEED.md, section 2).
const UNKNOWNS: f64 = 25_000.0;

/// The error for several ranks if PETSc was built without MPI.
const WITHOUT_MPI: &str = "this program runs one process, because its PETSc was built without MPI; for several ranks, install the \
                           Debian package or build the program (INSTALL.md)";

/// The argument of `--ranks`.
#[derive(Debug, Clone, Copy)]
pub enum Ranks {
    /// As many as pay.
    Auto,
    /// This number.
    Count(NonZero<usize>),
}

impl FromStr for Ranks {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "auto" => Ok(Self::Auto),
            _ => text
                .parse()
                .map(Self::Count)
                .map_err(|_| "it is neither a number from 1 on nor auto"),
        }
    }
}

/// The number of cores that this process may use, 1 if it is not known.
pub fn cores() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get)
}

/// The number of ranks that pay for this number of unknowns of the displacements, at most one per core; one without MPI.
pub fn paying(unknowns: usize) -> usize {
    if !Communicator::HAS_MPI {
        return 1;
    }
    let ranks = (unknowns as f64 / UNKNOWNS).sqrt() as usize;
    ranks.clamp(1, cores())
}

/// Replaces this process by the same command on this number of `ranks`, without its argument `--ranks`.
pub fn start(ranks: usize) -> Result<Infallible, Failure> {
    if !Communicator::HAS_MPI {
        return Err(Failure::input(format!("--ranks: {WITHOUT_MPI}")));
    }
    let (mut passed, mut arguments) = (Vec::new(), words().into_iter().skip(1));
    while let Some(argument) = arguments.next() {
        if argument == "--" {
            passed.push(argument);
            passed.extend(arguments);
            break;
        } else if argument == "--ranks" {
            arguments.next();
        } else if !argument.as_encoded_bytes().starts_with(b"--ranks=") {
            passed.push(argument);
        }
    }
    let program =
        env::current_exe().map_err(|error| Failure::input(format!("--ranks: {error}")))?;
    let mut mpiexec = Command::new("mpiexec");
    let error = mpiexec.arg("-n").arg(ranks.to_string()).arg(program).args(passed).exec();
    Err(Failure::input(format!("--ranks: mpiexec cannot be started: {error}; install openmpi-bin")))
}

/// Checks that the ranks that a launcher started know each other.
pub fn check_launcher(comm: Communicator) -> Result<(), Failure> {
    match Communicator::launched() {
        Some(ranks) if ranks > 1 && !Communicator::HAS_MPI => {
            Err(Failure::input(format!("{ranks} processes were started: {WITHOUT_MPI}")))
        }
        Some(ranks) if ranks > 1 && comm.is_serial() => Err(Failure::input(format!(
            "{ranks} processes were started that do not know each other: this mpiexec belongs to another MPI than PETSc"
        ))),
        _ => Ok(()),
    }
}

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

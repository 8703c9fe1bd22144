//! A run that starts itself on several ranks.
//!
//! The process that was typed waits for `mpiexec` and passes signals on to it. Open MPI's answers
//! SIGINT and SIGTERM by ending its ranks within a second, but forwards SIGUSR1 and SIGUSR2 to them
//! (mpiexec(1), "Signal Propagation").

use super::Failure;
use rustix::{
    process::{Pid, Signal, kill_process},
    stdio::dup2_stderr,
};
use signal_hook::{consts::SIGINT, low_level};
use signorini::{
    interrupt::Interrupts,
    mesh::{self, MeshError, Order},
    scene::{MeshSource, Scene},
};
use std::{
    env,
    fs::{self, File},
    io::{self, IsTerminal, Read},
    num::NonZero,
    os::unix::{fs::MetadataExt, process::CommandExt},
    process::{self, Child, Command, Stdio},
    str::FromStr,
    thread,
    time::Duration,
};

/// A rank that this program has started finds here its standard error, if that is a terminal.
const TERMINAL: &str = "SIGNORINI_TERMINAL";

/// How often the launcher looks for signals and for the end.
const PAUSE: Duration = Duration::from_millis(5);

/// How many processes share a run; `None`: as many as pay.
#[derive(Debug, Clone, Copy)]
pub struct Ranks(pub Option<usize>);

/// Ranks that may share a core: none runs faster for it, and many more bring the machine down.
const CROWDED: usize = 8;

impl FromStr for Ranks {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.parse() {
            Ok(0) => Err("there is no run on 0 ranks".to_owned()),
            Ok(number) if number > CROWDED * cores() => Err(format!(
                "too many for {} cores, which share the work at best one each",
                cores()
            )),
            Ok(number) => Ok(Self(Some(number))),
            Err(_) if text == "auto" => Ok(Self(None)),
            Err(_) => Err("it is neither a number nor auto".to_owned()),
        }
    }
}

/// Numbers of ranks, and of unknowns of the displacements from which on they pay. Whole runs of the uniform
/// `square-mild` on 4 cores, seconds on 1 and 2 ranks: 33,000 unknowns and 100 steps 1.4 and 1.3; 132,000
/// and 50 steps 6.0 and 4.8; 526,000 and 10 steps 16.4 on 1 and 12.8 on 4.
const PAYING: [(usize, usize); 2] = [(2, 100_000), (4, 400_000)];

/// The cores that a run may use.
pub fn cores() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get)
}

/// The number of ranks on which a run ends first, of the cores that it may use. The mesh is made where it
/// is not there.
pub fn ranks_that_pay(scene: &Scene) -> Result<usize, MeshError> {
    // An accuracy begins with many small meshes; TAO and static scenes were not measured.
    let is_tao = scene.contact.solver.as_ref().is_some_and(|name| name.starts_with("tao"));
    if scene.accuracy.is_some() || scene.time.is_none() || is_tao {
        return Ok(1);
    }
    let MeshSource { file, parameters } = &scene.mesh;
    let triangles = mesh::announced_elements(&mesh::file(file, parameters, scene.order)?)?;
    // There are about half as many vertices as triangles, and three halves as many edges (Euler).
    let unknowns = if scene.order == Order::Quadratic { 4 * triangles } else { triangles };
    let pays = |&&(ranks, least): &&(usize, usize)| ranks <= cores() && unknowns >= least;
    Ok(PAYING.iter().filter(pays).map(|(ranks, _)| *ranks).max().unwrap_or(1))
}

/// Whether this program has started this rank.
pub fn is_launched() -> bool {
    env::var_os(TERMINAL).is_some()
}

/// Runs the program with the same arguments on so many ranks, or tells why it cannot.
pub fn on_ranks(ranks: usize) -> io::Result<Result<(), Failure>> {
    let interrupts = Interrupts::defer();
    let mut mpiexec = spawn(ranks)?;
    // It is closed when this process ends, in whatever way: then the ranks end, too.
    let _input = mpiexec.stdin.take();
    let mut signal = None;
    let status = loop {
        if let Some(status) = mpiexec.try_wait()? {
            break status;
        }
        // A second signal ends this process at once.
        if signal.is_none()
            && let Some(received) = interrupts.received()
        {
            let forwarded = if received.0 == SIGINT { Signal::USR1 } else { Signal::USR2 };
            let _ = kill_process(Pid::from_child(&mpiexec), forwarded);
            signal = Some(received);
        }
        thread::sleep(PAUSE);
    };
    Ok(match (status.code(), signal) {
        (Some(0), _) => Ok(()),
        // The ranks have told why.
        (Some(code @ (1 | 2 | 130 | 143)), _) => Err(Failure { code: code as u8, message: None }),
        (_, Some(signal)) => Err(Failure { code: signal.exit_code(), message: None }),
        (_, None) => Err(io::Error::other("a rank was killed").into()),
    })
}

fn spawn(ranks: usize) -> io::Result<Child> {
    let mut mpiexec = Command::new("mpiexec");
    mpiexec
        .args(["--quiet", "--oversubscribe", "--bind-to", "none", "-n", &ranks.to_string()])
        .arg(env::current_exe()?)
        .args(env::args_os().skip(1))
        .stdin(Stdio::piped())
        // What is typed at the terminal goes to the launcher alone.
        .process_group(0)
        .env(
            TERMINAL,
            match io::stderr().is_terminal() {
                true => format!("/proc/{}/fd/2", process::id()),
                false => String::new(),
            },
        );
    if fs::metadata("/proc/self").is_ok_and(|of_process| of_process.uid() == 0) {
        let allowed = ["OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"];
        mpiexec.envs(allowed.map(|name| (name, "1")));
    }
    // Without a PATH mpiexec itself is found (execvp(3) looks in these), but not what it starts.
    if env::var_os("PATH").is_none() {
        mpiexec.env("PATH", "/bin:/usr/bin");
    }
    mpiexec.spawn()
}

/// What the first rank does at once if this program has started it. Its standard error would be a pipe,
/// which shows no progress bar; its standard input is the launcher's pipe.
pub fn begin_first_rank() {
    let Ok(terminal) = env::var(TERMINAL) else { return };
    if let Ok(terminal) = File::options().read(true).write(true).open(terminal) {
        let _ = dup2_stderr(terminal);
    }
    thread::spawn(|| {
        let _ = io::stdin().read_to_end(&mut Vec::new());
        low_level::exit(1);
    });
}

//! PETSc's life in this process.

use super::{Communicator, PetscError, check, error, raw};
use std::{
    env,
    ffi::{CStr, CString, c_char, c_int},
    ptr,
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
};

/// PETSc is not thread-safe: whoever holds this may call it.
static TURN: Mutex<()> = Mutex::new(());
/// Vectors, matrices and solvers not yet destroyed.
static LIVE: AtomicUsize = AtomicUsize::new(0);
/// Options we set ourselves; not the user's fault if nothing reads them.
static DEFAULTS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// The right to use PETSc; every object of this module is made from it.
///
/// PETSc is started by the first session of the process. Sessions of several threads
/// (tests) take turns.
pub struct Session {
    _turn: MutexGuard<'static, ()>,
}

impl Session {
    /// Starts PETSc with `options` (as on a PETSc command line), or waits for one's turn if
    /// it runs already; then `options` are added to its options database.
    ///
    /// # Errors
    /// PETSc or MPI could not be initialised, or rejected an option.
    pub fn start(options: &[String]) -> Result<Self, PetscError> {
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        // CHOLMOD asks OpenMP for 4 threads in loops so short that a third of a factorisation's time
        // went into waking them, whatever OMP_NUM_THREADS says. A setting of each thread.
        // SAFETY: only sets a parameter.
        unsafe { raw::omp_set_max_active_levels(0) };
        let mut running = raw::PetscBool::PETSC_FALSE;
        // SAFETY: PetscInitialized may be called at any time.
        check(unsafe { raw::PetscInitialized(&mut running) })?;
        if running == raw::PetscBool::PETSC_FALSE {
            initialize(options)?;
        } else if !options.is_empty() {
            let line = c_string(&options.join(" "))?;
            // SAFETY: PETSc runs, the string lives during the call; null is the global database.
            check(unsafe { raw::PetscOptionsInsertString(ptr::null_mut(), line.as_ptr()) })?;
        }
        Ok(Self { _turn: turn })
    }

    /// The ranks of the world communicator.
    pub fn comm(&self) -> Communicator {
        Communicator::of_world()
    }

    /// Options of the database that nothing has read: most likely misspelt.
    pub fn unused_options(&self) -> Vec<String> {
        let (mut count, mut names, mut values) = (0, ptr::null_mut(), ptr::null_mut());
        let mut unused = Vec::new();
        // SAFETY: PETSc fills `count` names that stay valid until they are given back.
        unsafe {
            let database = ptr::null_mut();
            if raw::PetscOptionsLeftGet(database, &mut count, &mut names, &mut values) == 0 {
                for i in 0..count as usize {
                    let name = CStr::from_ptr(*names.add(i)).to_string_lossy();
                    unused.push(format!("-{name}"));
                }
                raw::PetscOptionsLeftRestore(database, &mut count, &mut names, &mut values);
            }
        }
        let defaults = DEFAULTS.lock().unwrap_or_else(PoisonError::into_inner);
        unused.retain(|name| name != "-no_signal_handler" && !defaults.contains(name));
        unused
    }

    /// Whether the user has given an option.
    pub(super) fn has_option(&self, name: &str) -> Result<bool, PetscError> {
        let name = c_string(name)?;
        let mut given = raw::PetscBool::PETSC_FALSE;
        // SAFETY: the string lives during the call; null is the global database.
        check(unsafe {
            raw::PetscOptionsHasName(ptr::null_mut(), ptr::null(), name.as_ptr(), &mut given)
        })?;
        Ok(given == raw::PetscBool::PETSC_TRUE)
    }

    /// Sets a default in the options database, unless the user has given that option; a default
    /// of ours from before is replaced.
    pub(super) fn default_option(&self, name: &str, value: &str) -> Result<(), PetscError> {
        let mut defaults = DEFAULTS.lock().unwrap_or_else(PoisonError::into_inner);
        let ours = defaults.iter().any(|known| known == name);
        let text = name;
        let (name, value) = (c_string(name)?, c_string(value)?);
        let mut given = raw::PetscBool::PETSC_FALSE;
        let database = ptr::null_mut();
        // SAFETY: the strings live during the calls; null is the global database.
        unsafe {
            check(raw::PetscOptionsHasName(database, ptr::null(), name.as_ptr(), &mut given))?;
            if ours || given == raw::PetscBool::PETSC_FALSE {
                check(raw::PetscOptionsSetValue(database, name.as_ptr(), value.as_ptr()))?;
                if !ours {
                    defaults.push(text.to_owned());
                }
            }
        }
        Ok(())
    }

    /// Ends PETSc and MPI. Call it last; without it MPI complains at exit.
    ///
    /// # Errors
    /// Objects made from this session still live, or PETSc fails to finalize.
    pub fn finalize(self) -> Result<(), PetscError> {
        match LIVE.load(Ordering::Relaxed) {
            // SAFETY: nothing of PETSc is alive any more.
            0 => check(unsafe { raw::PetscFinalize() }),
            n => Err(PetscError::ours(format!("{n} PETSc objects outlive their session"))),
        }
    }
}

/// Lets large blocks of memory be given back when they are freed: a library below Debian's PETSc
/// (SuperLU_DIST) switches that off when it is loaded, so that what one part of a run has freed
/// is lost in fragments for the next.
fn give_memory_back() {
    /// The number of blocks malloc allows by default.
    const BLOCKS: c_int = 65536;
    /// The largest threshold malloc knows: smaller arrays come and go with every step.
    const LARGE: c_int = 32 << 20;
    // SAFETY: mallopt only sets parameters of malloc, and before PETSc has threads.
    unsafe {
        raw::mallopt(raw::M_MMAP_THRESHOLD as c_int, LARGE);
        raw::mallopt(raw::M_TRIM_THRESHOLD as c_int, 2 * LARGE);
        raw::mallopt(raw::M_MMAP_MAX as c_int, BLOCKS);
    }
}

/// What tells a process that it is one of several ranks, by the launchers Open MPI knows.
const RANKS: [&str; 4] = ["OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID"];

/// Settings of Open MPI with which a process of its own starts no daemon, opens no network (two
/// thirds of the time it takes PETSc to start) and makes no directory of temporary files: all such
/// processes of a user would share one, and one that ends removes what another has just made.
const ALONE: [(&str, &str); 3] = [
    ("OMPI_MCA_ess_singleton_isolated", "1"),
    ("OMPI_MCA_pml", "ob1"),
    ("OMPI_MCA_orte_create_session_dirs", "0"),
];

/// PTScotch starts a thread for each core of the machine in every rank: too many by the number of
/// ranks, and slow because they wait for each other.
fn one_scotch_thread() {
    /// Read by Scotch 7 whenever it divides a graph.
    const THREADS: &str = "SCOTCH_PTHREAD_NUMBER";
    if env::var_os(THREADS).is_none() {
        // SAFETY: PETSc has no threads yet; those of tests read the environment through std.
        unsafe { env::set_var(THREADS, "1") };
    }
}

/// Starts PETSc by `start`, without what only several ranks need if this process is alone.
fn start_alone<R>(start: impl FnOnce() -> R) -> R {
    let alone = RANKS.iter().all(|name| env::var_os(name).is_none());
    let ours: Vec<_> =
        ALONE.iter().filter(|(name, _)| alone && env::var_os(name).is_none()).collect();
    // SAFETY: PETSc has no threads yet; those of tests read the environment through std.
    ours.iter().for_each(|(name, value)| unsafe { env::set_var(name, value) });
    let started = start();
    // What this process starts may be ranks.
    // SAFETY: as above.
    ours.iter().for_each(|(name, _)| unsafe { env::remove_var(name) });
    started
}

fn initialize(options: &[String]) -> Result<(), PetscError> {
    give_memory_back();
    one_scotch_thread();
    let mut arguments = vec![c_string("signorini")?, c_string("-no_signal_handler")?];
    for option in options {
        arguments.push(c_string(option)?);
    }
    let mut pointers: Vec<*mut c_char> = arguments.into_iter().map(CString::into_raw).collect();
    pointers.push(ptr::null_mut());
    let mut count = (pointers.len() - 1) as c_int;
    // PETSc keeps the argument vector for the life of the process, so it is given away.
    let mut argv = pointers.leak().as_mut_ptr();
    // SAFETY: argc and argv describe a null-terminated array of strings that is never freed.
    unsafe {
        check(start_alone(|| {
            raw::PetscInitialize(&mut count, &mut argv, ptr::null(), ptr::null())
        }))?;
        check(raw::PetscPushErrorHandler(Some(error::keep_message), ptr::null_mut()))
    }
}

/// `PETSC_COMM_WORLD`.
pub(super) fn world() -> raw::MPI_Comm {
    // SAFETY: written once by PetscInitialize, read-only afterwards.
    unsafe { raw::PETSC_COMM_WORLD }
}

/// A C string; a NUL inside is the user's typing error.
pub(super) fn c_string(text: &str) -> Result<CString, PetscError> {
    CString::new(text).map_err(|_| PetscError::ours(format!("`{text}` holds a NUL character")))
}

/// Counts an object for as long as it lives.
pub(super) struct Live;

impl Live {
    pub(super) fn new() -> Self {
        LIVE.fetch_add(1, Ordering::Relaxed);
        Self
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        LIVE.fetch_sub(1, Ordering::Relaxed);
    }
}

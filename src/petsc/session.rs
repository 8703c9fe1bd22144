//! Starting and ending PETSc (PetscInitialize, PetscFinalize).

use super::{
    Communicator, PetscError, check, error::keep_message, fork::is_fork, options,
    options::c_string, raw, shell_preconditioner,
};
use crate::memory::address_space;
use std::{
    cell::RefCell,
    env,
    ffi::{CStr, CString, OsString, c_char, c_int},
    path::Path,
    ptr,
    rc::{Rc, Weak},
    sync::{Mutex, MutexGuard, PoisonError},
};

/// PETSc is not thread-safe: only the thread that has this lock may call it.
static TURN: Mutex<()> = Mutex::new(());

thread_local! {
    /// The turn of this thread, while a session or an object of PETSc keeps it.
    static OWN_TURN: RefCell<Weak<Turn>> = RefCell::default();
}

/// The turn of a thread. Its sessions and all objects of PETSc that it owns keep it.
#[derive(Debug)]
pub(super) struct Turn(#[allow(dead_code)] MutexGuard<'static, ()>);

impl Turn {
    /// The turn that this thread has: only a session or another object leads to a new object.
    pub(super) fn of_this_thread() -> Result<Rc<Self>, PetscError> {
        let own = OWN_TURN.with_borrow(Weak::upgrade);
        own.ok_or_else(|| PetscError::ours("this thread has no session of PETSc"))
    }
}

/// The address space of OpenBLAS's buffer (BUFFER_SIZE in its common_x86_64.h) and a lower bound of MPI's, bytes.
const BUFFER: f64 = 134.3e6;
const MPI: f64 = 30e6;

/// The right to use PETSc; every object of this module is made from it.
///
/// PETSc is started by the first session of the process. Threads (tests) take turns. A turn lasts until the last session of the
/// thread and the last object made from it are dropped, so no object can be used without a turn.
pub struct Session {
    turn: Rc<Turn>,
}

impl Session {
    /// Starts PETSc with `options` (as on a PETSc command line). If PETSc runs already, waits until no other
    /// thread uses it, and adds `options` to its options database. MPI changes the environment of the process as it
    /// starts, and no other thread may read it meanwhile.
    ///
    /// # Errors
    /// PETSc or MPI could not be initialised, or rejected an option.
    pub fn start(options: &[String]) -> Result<Self, PetscError> {
        let turn = Turn::of_this_thread().unwrap_or_else(|_| {
            let turn = Turn(TURN.lock().unwrap_or_else(PoisonError::into_inner));
            Rc::new(turn)
        });
        OWN_TURN.set(Rc::downgrade(&turn));
        // CHOLMOD asks OpenMP for 4 threads in very short loops, whatever OMP_NUM_THREADS says. Waking them
        // would take a third of a factorisation's time. The setting is one of each thread.
        // Each thread would reserve 64 MB of address space for a heap of its own.
        // SuperLU_DIST, which PETSc loads, lets the heap keep all freed memory, although small blocks split it up. Blocks of at
        // least 32 MB, glibc's largest threshold, go back to the system as soon as they are freed.
        // SAFETY: only sets parameters.
        #[cfg(target_os = "linux")]
        unsafe {
            raw::omp_set_max_active_levels(0);
            raw::mallopt(raw::M_ARENA_MAX, 1);
            raw::mallopt(raw::M_MMAP_MAX, 1 << 16);
            raw::mallopt(raw::M_MMAP_THRESHOLD, 32 << 20);
        }
        let mut running = options::petsc_bool(false);
        // SAFETY: PetscInitialized may be called at any time.
        check(unsafe { raw::PetscInitialized(&mut running) })?;
        if !options::is_true(running) {
            PetscError::if_short(BUFFER + MPI - address_space(), "to start (ulimit -v)")?;
            initialize(options)?;
            PetscError::if_short(BUFFER - address_space(), "to start (ulimit -v)")?;
            let [l, n] = [c"L", c"N"].map(CStr::as_ptr);
            // OpenBLAS keeps the buffer of its first call. A call that gets no buffer would try again for ever.
            // SAFETY: the arrays have one entry.
            unsafe { raw::dtrsm_(l, l, n, n, &1, &1, &1.0, &1.0, &1, &mut 1.0, &1) };
        } else if !options.is_empty() {
            options::insert(options)?;
        }
        Ok(Self { turn })
    }

    /// The ranks of the world communicator.
    pub fn comm(&self) -> Communicator {
        Communicator::of_world()
    }

    /// Ends PETSc and MPI. Call it last; without it MPI complains at exit. In a fork they belong to the process that started
    /// them, which also has a session, and nothing is to be ended.
    ///
    /// # Errors
    /// The thread still has objects or another session, or PETSc fails to finalize.
    pub fn finalize(self) -> Result<(), PetscError> {
        match Rc::strong_count(&self.turn) - 1 - usize::from(is_fork()) {
            0 if is_fork() => Ok(()),
            0 => {
                // The caller lists the unused options; PETSc would do so again.
                options::set_default_option("-options_left", "0")?;
                // SAFETY: no object of PETSc is in use any more.
                check(unsafe { raw::PetscFinalize() })
            }
            n => Err(PetscError::ours(format!("{n} PETSc objects outlive their session"))),
        }
    }
}

/// Settings of Open MPI for a process that no launcher started (a singleton). With them it starts no
/// daemon and opens no network, which takes two thirds of PETSc's start. It makes no directory of
/// temporary files either: all singletons of a user would share it, and one that ends would remove
/// the files of another. Open MPI 5 does not start without a home and a folder of temporary
/// files, which a service may lack.
const SINGLETON: [(&str, &str); 6] = [
    ("OMPI_MCA_ess_singleton_isolated", "1"),
    ("OMPI_MCA_pml", "ob1"),
    ("OMPI_MCA_btl", "self"),
    ("HOME", "/"),
    ("TMPDIR", "/tmp"),
    ("OMPI_MCA_orte_create_session_dirs", "0"),
];

/// Sets environment variables, except those that the user has set; but a folder that does not exist is replaced. Returns
/// the old values of what it has set.
fn set_missing(variables: &[(&'static str, &str)]) -> Vec<(&'static str, Option<OsString>)> {
    let serves = |old: &OsString, value: &str| !value.starts_with('/') || Path::new(old).is_dir();
    let all = variables.iter().map(|&(name, value)| (name, value, env::var_os(name)));
    let missing = all.filter(|(_, value, old)| !old.as_ref().is_some_and(|old| serves(old, value)));
    // SAFETY: PETSc has no threads yet; those of tests read the environment through std.
    let set = missing.inspect(|(name, value, _)| unsafe { env::set_var(name, value) });
    set.map(|(name, _, old)| (name, old)).collect()
}

/// Starts PETSc; its errors keep their message for [`check`] instead of printing a trace.
fn initialize(options: &[String]) -> Result<(), PetscError> {
    // In every rank, Scotch 7 starts a thread for each core of the machine. They are too many, and slow
    // because they wait for each other. Scotch reads this variable whenever it divides a graph.
    set_missing(&[("SCOTCH_PTHREAD_NUMBER", "1")]);
    let singleton = Communicator::launched().is_none();
    let temporary = if singleton { set_missing(&SINGLETON) } else { Vec::new() };
    // A file .petscrc in the current folder could load libraries of strangers.
    let own = ["signorini", "-no_signal_handler", "-skip_petscrc"].into_iter();
    let arguments = own.chain(options.iter().map(String::as_str));
    let pointers = arguments.map(|argument| c_string(argument).map(CString::into_raw));
    let mut pointers: Vec<*mut c_char> = pointers.collect::<Result<_, _>>()?;
    pointers.push(ptr::null_mut());
    let mut count = (pointers.len() - 1) as c_int;
    // PETSc keeps the argument vector for the life of the process, so it is given away.
    let mut argv = pointers.leak().as_mut_ptr();
    // SAFETY: argc and argv describe a null-terminated array of strings that is never freed.
    let started =
        check(unsafe { raw::PetscInitialize(&mut count, &mut argv, ptr::null(), ptr::null()) });
    // This process may start others (gmsh), which must not inherit the settings.
    // SAFETY: as in `set_missing`.
    temporary.into_iter().for_each(|(name, old)| match old {
        Some(old) => unsafe { env::set_var(name, old) },
        None => unsafe { env::remove_var(name) },
    });
    started?;
    // SAFETY: PETSc runs; the handler needs no context.
    check(unsafe { raw::PetscPushErrorHandler(Some(keep_message), ptr::null_mut()) })?;
    shell_preconditioner::register()
}

/// PETSc's version, as 3.18.5.
pub fn version() -> String {
    let [mut major, mut minor, mut patch, mut release] = [0; 4];
    // SAFETY: writes four numbers; it may be called before PETSc starts.
    unsafe { raw::PetscGetVersionNumber(&mut major, &mut minor, &mut patch, &mut release) };
    format!("{major}.{minor}.{patch}")
}

/// `PETSC_COMM_WORLD`.
pub(super) fn world() -> raw::MPI_Comm {
    // SAFETY: written once by PetscInitialize, read-only afterwards.
    unsafe { raw::PETSC_COMM_WORLD }
}

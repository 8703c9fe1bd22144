//! Forks of a process in which PETSc runs: each has PETSc without starting it.

use super::{Communicator, Session, raw};
use signal_hook::low_level;
use std::{
    ffi::{c_char, c_int},
    fs::{self, File},
    io::{self, Write},
    mem,
    os::{fd::AsRawFd, unix::process::ExitStatusExt},
    panic::{AssertUnwindSafe, catch_unwind},
    process::ExitStatus,
    ptr,
    sync::atomic::{AtomicBool, Ordering},
};

/// Is this process a fork? PETSc and MPI then belong to the process that started them.
static IS_FORK: AtomicBool = AtomicBool::new(false);
/// The exit code of a program of Rust that panicked.
const PANICKED: u8 = 101;

pub(super) fn is_fork() -> bool {
    IS_FORK.load(Ordering::Relaxed)
}

impl Session {
    /// Does `work` in a fork of this process. Returns the exit code of the fork, which is the value of `work`, or 128 + n
    /// after the signal n. The fork reads nothing from standard input. Its standard output is dropped, or joins standard
    /// error if `joins_output`. `None` if a launcher has started the process, if it has several threads, or if the system makes no
    /// fork: nothing was done.
    pub fn fork(&self, joins_output: bool, work: impl FnOnce() -> u8) -> Option<i32> {
        if Communicator::launched().is_some() {
            return None;
        }
        pause_mpi();
        // A fork has only the thread that forks. Locks of other threads would stay locked.
        if fs::read_dir("/proc/self/task").ok()?.count() != 1 {
            return None;
        }
        let null = File::options().read(true).write(true).open("/dev/null").ok()?;
        let output = if joins_output { io::stderr().as_raw_fd() } else { null.as_raw_fd() };
        // SAFETY: the process has no other thread.
        match unsafe { raw::fork() } {
            0 => {
                IS_FORK.store(true, Ordering::Relaxed);
                // SAFETY: nobody owns the descriptors of standard input and output, and all are open.
                unsafe { (raw::dup2(null.as_raw_fd(), 0), raw::dup2(output, 1)) };
                let code = catch_unwind(AssertUnwindSafe(work)).unwrap_or(PANICKED);
                let _ = io::stdout().flush();
                // Without the handlers of MPI and PETSc for the end of a process.
                low_level::exit(code.into())
            }
            child => {
                let mut status = 0;
                // SAFETY: writes a number. Handlers of signals restart it.
                let waited = child > 0 && unsafe { raw::waitpid(child, &mut status, 0) } == child;
                let status = ExitStatus::from_raw(status);
                let signal = || status.signal().map(|signal| 128 + signal);
                waited.then(|| status.code().or_else(signal)).flatten()
            }
        }
    }
}

/// Ends the thread in which Open MPI 4 waits for messages of a launcher. A process that no launcher started gets none.
fn pause_mpi() {
    // SAFETY: looks for a name among those of the loaded libraries.
    let pause = unsafe { raw::dlsym(ptr::null_mut(), c"opal_progress_thread_pause".as_ptr()) };
    if !pause.is_null() {
        // SAFETY: the type of this function is that of opal/runtime/opal_progress_threads.h. A null pointer names the common
        // thread. If it has ended already, the function does nothing.
        unsafe {
            let pause: unsafe extern "C" fn(*const c_char) -> c_int = mem::transmute(pause);
            pause(ptr::null());
        }
    }
}

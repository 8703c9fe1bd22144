//! How the program ends before its time: by signals, and without memory.

use signal_hook::{
    consts::{SIGINT, SIGTERM, SIGUSR1, SIGUSR2, SIGXFSZ},
    flag, low_level,
};
use signorini::{
    interrupt::{AT_ONCE, RECEIVED, received},
    memory::REMEDY,
};
use std::{
    io::{self, Write},
    sync::Arc,
    thread::{self, sleep},
    time::Duration,
};

/// Lets SIGINT and SIGTERM end the process with the exit codes 130 and 143. While
/// [`Interrupts`](signorini::interrupt::Interrupts) defers them, only the second signal ends it. On several ranks SIGUSR1 and
/// SIGUSR2 have the same meaning, because mpiexec sends these instead. A file-size limit (SIGXFSZ) becomes an error of the
/// write that exceeds it.
///
/// # Errors
/// The system refuses handlers.
pub fn install() -> io::Result<()> {
    flag::register(SIGXFSZ, Arc::default())?;
    for (signal, meant) in
        [(SIGINT, SIGINT), (SIGTERM, SIGTERM), (SIGUSR1, SIGINT), (SIGUSR2, SIGTERM)]
    {
        // The handlers act in this order.
        flag::register_conditional_shutdown(signal, 128 + meant, AT_ONCE.clone())?;
        flag::register_usize(signal, RECEIVED.clone(), meant as usize)?;
        flag::register(signal, AT_ONCE.clone())?;
    }
    Ok(())
}

/// Starts a thread that ends the process 7 s after a signal, if it has not ended by itself: a factorisation can take minutes.
pub fn watch() {
    // Without the thread a second signal ends the process.
    drop(thread::Builder::new().stack_size(1 << 16).spawn(end_after_signal));
}

fn end_after_signal() {
    let signal = loop {
        match received() {
            Some(signal) => break signal,
            None => sleep(Duration::from_millis(200)),
        }
    };
    sleep(Duration::from_secs(7));
    let state = "within a long computation; --restart goes on from the last checkpoint, if any";
    let _ = writeln!(io::stderr(), "error: ended by {signal} {state}");
    low_level::exit(signal.exit_code().into());
}

/// Ends the process after a failed allocation. It allocates nothing.
pub fn out_of_memory() -> ! {
    let _ = writeln!(io::stderr(), "error: there is not enough memory; {REMEDY}");
    low_level::exit(1)
}

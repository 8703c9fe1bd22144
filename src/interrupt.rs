//! The handling of the signals SIGINT (Ctrl-C), SIGTERM and SIGXFSZ.

use signal_hook::{
    consts::{SIGINT, SIGTERM, SIGUSR1, SIGUSR2, SIGXFSZ},
    flag, low_level,
};
use std::{
    io::{self, Write},
    sync::{
        Arc, LazyLock, Once,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread::{self, sleep},
    time::Duration,
};

/// Whether the next signal ends the process at once.
static AT_ONCE: LazyLock<Arc<AtomicBool>> = LazyLock::new(|| Arc::new(true.into()));
/// The received signal; 0 for none.
static RECEIVED: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);
/// The start of [`watch`].
static WATCH: Once = Once::new();

/// Lets SIGINT and SIGTERM end the process with the exit codes 130 and 143. While an [`Interrupts`] defers
/// them, only the second signal ends it. On several ranks SIGUSR1 and SIGUSR2 have the same meaning, because
/// mpiexec sends these instead. A file-size limit (SIGXFSZ) becomes an error of the write that exceeds it.
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

/// Ends the process 7 s after a signal, if it has not ended by itself: a factorisation can take minutes.
fn watch() {
    while received().is_none() {
        sleep(Duration::from_millis(200));
    }
    sleep(Duration::from_secs(7));
    let signal = Signal(RECEIVED.load(Ordering::Relaxed) as i32);
    let state = "within a long computation; --restart goes on from the last checkpoint, if any";
    let _ = writeln!(io::stderr(), "error: ended by {signal} {state}");
    low_level::exit(signal.exit_code().into());
}

/// While this exists, a first signal is only recorded, so that the work can end properly. At most one exists at a time.
#[derive(Debug)]
pub struct Interrupts(());

impl Interrupts {
    /// Defers signals from now on.
    pub fn defer() -> Self {
        AT_ONCE.store(RECEIVED.load(Ordering::Relaxed) != 0, Ordering::Relaxed);
        // Without the thread a second signal ends the process.
        WATCH.call_once(|| drop(thread::Builder::new().stack_size(1 << 16).spawn(watch)));
        Self(())
    }
}

/// The received signal, if there is one.
pub fn received() -> Option<Signal> {
    match RECEIVED.load(Ordering::Relaxed) as i32 {
        0 => None,
        number => Some(Signal(number)),
    }
}

impl Drop for Interrupts {
    fn drop(&mut self) {
        AT_ONCE.store(true, Ordering::Relaxed);
    }
}

/// SIGINT or SIGTERM, by its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Signal(pub i32);

impl Signal {
    /// The exit code of a process that this signal has ended, as in shells.
    pub fn exit_code(self) -> u8 {
        (128 + self.0) as u8
    }
}

impl std::fmt::Display for Signal {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(if self.0 == SIGINT { "SIGINT" } else { "SIGTERM" })
    }
}

//! Signals that a run heeds: the flags that the handlers of a program set. The program alone installs handlers and ends itself.

use signal_hook::consts::SIGINT;
use std::sync::{
    Arc, LazyLock,
    atomic::{AtomicBool, AtomicUsize, Ordering},
};

/// Shall the next signal end the process at once? The handlers of a program read it.
pub static AT_ONCE: LazyLock<Arc<AtomicBool>> = LazyLock::new(|| Arc::new(true.into()));
/// The received signal; 0 for none. The handlers of a program set it.
pub static RECEIVED: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);

/// While this exists, a first signal is only recorded, so that the work can end properly. At most one exists at a time.
#[derive(Debug)]
pub struct Interrupts(());

impl Interrupts {
    /// Defers signals from now on.
    pub fn defer() -> Self {
        AT_ONCE.store(RECEIVED.load(Ordering::Relaxed) != 0, Ordering::Relaxed);
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

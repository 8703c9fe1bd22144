//! What made a result: the program, when, where, and what was typed.

use serde_json::{Value, json};
use std::{env, fs, thread, time::SystemTime};

/// `provenance` of `summary.json`. What the system does not tell is null.
pub fn provenance() -> Value {
    let now = humantime::format_rfc3339_seconds(SystemTime::now());
    let arguments = env::args_os().map(|word| word.to_string_lossy().into_owned());
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        // As `make build` tells of a git checkout (git describe); null where nobody told.
        "commit": option_env!("SIGNORINI_COMMIT").filter(|commit| !commit.is_empty()),
        // When the run ended, UTC.
        "date": now.to_string(),
        // The command line, word by word, and where it was typed.
        "command": arguments.collect::<Vec<_>>(),
        "directory": env::current_dir().ok(),
        "machine": {
            "host": fs::read_to_string("/proc/sys/kernel/hostname").ok().map(|n| n.trim().to_owned()),
            "processor": processor(),
            "cores": thread::available_parallelism().ok(),
        },
    })
}

/// The processor's name, where Linux tells (proc(5), cpuinfo).
fn processor() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

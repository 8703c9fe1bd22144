//! `signorini serve`: starts PETSc once, and does each command in a fork of this process.
//!
//! The start of MPI and of the libraries takes longer than a small scene. A line of standard input is a command: a JSON list of
//! its words, without the name of the program. The answer is a line with the exit code, or 128 + n after the signal n. It is
//! `null` if the command needs a process of its own.

use super::{Failure, require_one_process};
use signorini::{
    interrupt::{Interrupts, received},
    petsc::Session,
};
use std::{
    env,
    ffi::OsString,
    io::{self, Write},
    iter,
    sync::OnceLock,
};

/// In a fork: the words of its command after the name of the program.
static WORDS: OnceLock<Vec<String>> = OnceLock::new();

/// The words of the command line, the name of the program first.
pub fn words() -> Vec<OsString> {
    let mut own = env::args_os();
    match WORDS.get() {
        Some(words) => own.next().into_iter().chain(words.iter().map(OsString::from)).collect(),
        None => own.collect(),
    }
}

/// The words of a command for a fork. Several ranks are other processes, and PETSc reads some options only as it starts.
fn forkable(line: &str) -> Option<Vec<String>> {
    let words: Vec<String> = serde_json::from_str(line).ok()?;
    let is_own = |word: &String| word == "--" || word.starts_with("--ranks");
    let has_options =
        ["PETSC_OPTIONS", "PETSC_OPTIONS_YAML"].map(env::var_os).iter().any(Option::is_some);
    (!has_options && !words.iter().any(is_own)).then_some(words)
}

/// Serves commands until the end of standard input. `execute` does the command of [`words`] and returns its exit code. After a
/// signal the server ends as soon as the command has ended.
pub fn serve(joins_output: bool, execute: fn() -> u8) -> Result<(), Failure> {
    require_one_process()?;
    let session = Session::start(&[])?;
    let mut signal = None;
    // The fork does not inherit the lock of standard input.
    for line in iter::from_fn(|| io::stdin().lines().next()) {
        let words = forkable(&line?);
        // The server defers signals until the fork has ended. The fork does not.
        let interrupts = Interrupts::defer();
        let code = words.and_then(|words| {
            session.fork(joins_output, || {
                let _ = WORDS.set(words);
                drop(interrupts);
                execute()
            })
        });
        let answer = code.map_or("null".to_owned(), |code| code.to_string());
        let answered = writeln!(io::stdout(), "{answer}");
        signal = received();
        if answered.is_err() || signal.is_some() {
            break;
        }
    }
    session.finalize()?;
    signal.map_or(Ok(()), |signal| Err(Failure { code: signal.exit_code(), message: None }))
}

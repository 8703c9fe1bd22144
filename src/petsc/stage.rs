//! The stages of a run: their wall time, and PETSc's log of each (`-log_view`).

use super::{check, options::c_string, raw, session::Turn};
use std::{cell::RefCell, collections::BTreeMap, time::Instant};

thread_local! {
    /// The path of the present stage, and the seconds of each path.
    static STAGES: RefCell<(String, BTreeMap<String, f64>)> = RefCell::default();
}

/// Does `work` as a stage of PETSc's log, and adds its wall time to the stage. A stage inside another stage is a part of that one:
/// `contact/products`. PETSc's log counts the time of a stage without that of its parts (PetscLogStagePush).
pub fn stage<R>(name: &str, work: impl FnOnce() -> R) -> R {
    let outer = STAGES.with_borrow_mut(|(path, _)| {
        let outer = path.len();
        *path += if outer == 0 { "" } else { "/" };
        *path += name;
        outer
    });
    let is_logged = Turn::of_this_thread().is_ok() && push(name);
    let started = Instant::now();
    let result = work();
    let seconds = started.elapsed().as_secs_f64();
    if is_logged {
        // SAFETY: this thread has the session, and `push` has put the stage onto PETSc's stack.
        unsafe { raw::PetscLogStagePop() };
    }
    STAGES.with_borrow_mut(|(path, all)| {
        *all.entry(path.clone()).or_default() += seconds;
        path.truncate(outer);
    });
    result
}

/// The wall time of each stage of this thread, s, by its path; that of a stage contains its parts.
pub fn stage_seconds() -> BTreeMap<String, f64> {
    STAGES.with_borrow(|(_, all)| all.clone())
}

/// Puts the stage of this name onto PETSc's stack, and registers it the first time.
fn push(name: &str) -> bool {
    let Ok(name) = c_string(name) else { return false };
    let mut id = -1;
    // SAFETY: this thread has the session; the string lives during the calls, and PETSc copies it.
    unsafe {
        check(raw::PetscLogStageGetId(name.as_ptr(), &mut id)).is_ok()
            && (id >= 0 || check(raw::PetscLogStageRegister(name.as_ptr(), &mut id)).is_ok())
            && check(raw::PetscLogStagePush(id)).is_ok()
    }
}

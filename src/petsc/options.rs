//! PETSc's options database, of which a null pointer means the global one.

use super::{PetscError, check, raw};
use std::{
    ffi::{CStr, CString},
    ptr,
    sync::{Mutex, PoisonError},
};

/// Options that we have set ourselves: it is not the user's fault if nothing reads them.
static DEFAULTS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Adds options as on a command line (PetscOptionsInsertString).
pub(super) fn insert(options: &[String]) -> Result<(), PetscError> {
    let line = c_string(&options.join(" "))?;
    // SAFETY: a session exists, the string lives during the call.
    check(unsafe { raw::PetscOptionsInsertString(ptr::null_mut(), line.as_ptr()) })
}

/// Whether an option is set (PetscOptionsHasName).
pub(crate) fn has_option(name: &str) -> Result<bool, PetscError> {
    let name = c_string(name)?;
    let mut given = raw::PetscBool::PETSC_FALSE;
    // SAFETY: a session exists, the string lives during the call.
    check(unsafe {
        raw::PetscOptionsHasName(ptr::null_mut(), ptr::null(), name.as_ptr(), &mut given)
    })?;
    Ok(given == raw::PetscBool::PETSC_TRUE)
}

/// Sets an option unless the user has given it; our own earlier default is replaced
/// (PetscOptionsSetValue).
pub(crate) fn set_default_option(name: &str, value: &str) -> Result<(), PetscError> {
    let mut defaults = DEFAULTS.lock().unwrap_or_else(PoisonError::into_inner);
    let ours = defaults.iter().any(|known| known == name);
    if !ours && has_option(name)? {
        return Ok(());
    }
    let (c_name, value) = (c_string(name)?, c_string(value)?);
    // SAFETY: a session exists, the strings live during the call.
    check(unsafe { raw::PetscOptionsSetValue(ptr::null_mut(), c_name.as_ptr(), value.as_ptr()) })?;
    if !ours {
        defaults.push(name.to_owned());
    }
    Ok(())
}

/// Options that nothing has read, our own defaults left out (PetscOptionsLeftGet).
pub(super) fn unused() -> Vec<String> {
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

/// A C string; a NUL inside is the user's typing error.
pub(super) fn c_string(text: &str) -> Result<CString, PetscError> {
    CString::new(text).map_err(|_| PetscError::ours(format!("`{text}` contains a NUL character")))
}

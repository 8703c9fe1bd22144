//! PETSc's options database. A null pointer means the global one. All functions need a session.

use super::{PetscError, Session, check, raw};
use std::{
    ffi::{CStr, CString},
    ptr,
};

/// A truth value of PETSc: an enumeration in PETSc 3.22, C's `bool` in 3.25.
pub(super) fn petsc_bool<T: From<bool>>(value: bool) -> T {
    value.into()
}

/// The inverse of [`petsc_bool`].
pub(super) fn is_true<T: From<bool> + PartialEq>(value: T) -> bool {
    value == T::from(true)
}

/// Adds options as on a command line (PetscOptionsInsertString).
pub(super) fn insert(options: &[String]) -> Result<(), PetscError> {
    let line = c_string(&options.join(" "))?;
    // SAFETY: the string lives during the call.
    check(unsafe { raw::PetscOptionsInsertString(ptr::null_mut(), line.as_ptr()) })
}

/// Whether an option is set, which counts as reading it (PetscOptionsHasName).
pub(crate) fn has_option(name: &str) -> Result<bool, PetscError> {
    let (name, all) = (c_string(name)?, ptr::null_mut());
    let mut given = petsc_bool(false);
    // SAFETY: the string lives during the call.
    check(unsafe { raw::PetscOptionsHasName(all, ptr::null(), name.as_ptr(), &mut given) })?;
    Ok(is_true(given))
}

/// Sets an option unless it is set (PetscOptionsSetValue).
pub(crate) fn set_default_option(name: &str, value: &str) -> Result<(), PetscError> {
    if has_option(name)? {
        return Ok(());
    }
    let (c_name, value) = (c_string(name)?, c_string(value)?);
    // SAFETY: the strings live during the call.
    check(unsafe { raw::PetscOptionsSetValue(ptr::null_mut(), c_name.as_ptr(), value.as_ptr()) })?;
    // Now the option counts as read, so that our default never appears among the user's unused options.
    has_option(name).map(drop)
}

impl Session {
    /// Options that PETSc has not read, most likely misspelt (PetscOptionsLeftGet).
    pub fn unused_options(&self) -> Vec<String> {
        let (mut count, mut names, mut values) = (0, ptr::null_mut(), ptr::null_mut());
        let (mut unused, all) = (Vec::new(), ptr::null_mut());
        // SAFETY: PETSc fills `count` names that stay valid until they are restored.
        unsafe {
            if raw::PetscOptionsLeftGet(all, &mut count, &mut names, &mut values) == 0 {
                for i in 0..count as usize {
                    unused.push(format!("-{}", CStr::from_ptr(*names.add(i)).to_string_lossy()));
                }
                raw::PetscOptionsLeftRestore(all, &mut count, &mut names, &mut values);
            }
        }
        unused
    }
}

/// `text` as a C string; an error if it contains a NUL character.
pub(super) fn c_string(text: &str) -> Result<CString, PetscError> {
    CString::new(text).map_err(|_| PetscError::ours(format!("`{text}` contains a NUL character")))
}

//! PETSc's error codes with PETSc's messages.

use super::raw;
use crate::memory::REMEDY;
use std::{
    borrow::Cow,
    cell::RefCell,
    ffi::{CStr, c_char, c_int, c_void},
};

/// PETSC_ERR_MAT_CH_ZRPVT: a pivot of a Cholesky factorisation is not positive.
pub(super) const NOT_DEFINITE: i32 = 81;

/// A call of PETSc or CHOLMOD failed, or its arguments do not fit.
#[derive(Clone, thiserror::Error)]
#[error("{}{message}", match code { 0 => String::new(), code => format!("PETSc error {code}: ") })]
pub struct PetscError {
    /// PETSc's error code (petscerror.h); 0 if our own checks or CHOLMOD found the error.
    pub code: i32,
    /// PETSc's message at the place where the error arose.
    pub message: String,
}

debug_is_message!(PetscError);

impl PetscError {
    /// An error that our own checks or CHOLMOD found, not PETSc.
    pub(crate) fn ours(message: impl Into<String>) -> Self {
        Self { code: 0, message: message.into() }
    }

    /// An error if bytes of memory are `missing` for a purpose.
    pub(crate) fn if_short(missing: f64, purpose: &str) -> Result<(), Self> {
        let short = format!("not enough memory {purpose}: over {:.0} MB missing", 1e-6 * missing);
        if missing > 0.0 { Err(Self::ours(format!("there is {short}; {REMEDY}"))) } else { Ok(()) }
    }
}

thread_local! {
    /// The message of the last error: PETSc passes it to the error handler, and only the code to the caller.
    static MESSAGE: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Keeps the first message of an error trace instead of printing the trace (PetscPushErrorHandler).
pub(super) unsafe extern "C" fn keep_message(
    _comm: raw::MPI_Comm,
    _line: c_int,
    function: *const c_char,
    _file: *const c_char,
    code: raw::PetscErrorCode,
    kind: raw::PetscErrorType::Type,
    message: *const c_char,
    _context: *mut c_void,
) -> raw::PetscErrorCode {
    if kind == raw::PetscErrorType::PETSC_ERROR_INITIAL {
        let text = |p: *const c_char| match p.is_null() {
            true => Cow::default(),
            // SAFETY: PETSc passes NUL-terminated strings that live during this call.
            false => unsafe { CStr::from_ptr(p) }.to_string_lossy(),
        };
        MESSAGE.set(match text(function) {
            function if function.contains("Malloc") => {
                format!("there is not enough memory; {REMEDY}")
            }
            function => format!("{} (in {function})", text(message).trim_end()),
        });
    }
    code
}

/// Turns PETSc's return code into a result.
pub(super) fn check(code: raw::PetscErrorCode) -> Result<(), PetscError> {
    match code {
        0 => Ok(()),
        code => Err(PetscError { code, message: MESSAGE.take() }),
    }
}

/// The return code of a function that PETSc calls. PETSc passes the code on to the caller of the solver,
/// where [`check`] adds the message.
pub(super) fn return_code(result: Result<(), PetscError>) -> raw::PetscErrorCode {
    /// PETSC_ERR_LIB, "error in an external library".
    const LIBRARY: raw::PetscErrorCode = 76;
    let Err(error) = result else { return 0 };
    MESSAGE.set(error.message);
    if error.code == 0 { LIBRARY } else { error.code }
}

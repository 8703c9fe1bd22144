//! A factorisation that outlives the matrix values it was made from.

use super::{
    Communicator, Matrix, PetscError, Precision, Session, Vector, check,
    direct::Substructure,
    mat::entries,
    raw,
    session::{Live, c_string, world},
    vec::same_size,
};
use std::{ffi::CStr, ptr, slice};

/// A Cholesky factor: CHOLMOD's with solves of our own, by substructures where there are several
/// ranks. There MUMPS takes its place (PCCHOLESKY) where the interface is too wide, a cycle of
/// algebraic multigrid (PCGAMG) where the matrix is very large. PETSc options can ask for any PC.
///
/// Fill-reducing ordering and symbolic factorisation are done once, with the first values.
pub struct Factor {
    raw: raw::PC,
    /// In the place of `raw`, once factorised.
    parts: Option<Substructure>,
    comm: Communicator,
    precision: Precision,
    /// Whether `parts` is to be tried.
    ours: bool,
    cost: f64,
    _live: Live,
}

impl Factor {
    /// A factor of matrices with `unknowns` rows on all ranks together, whose PETSc options carry
    /// `prefix` (`-elastic_pc_type …`).
    pub fn new(
        session: &Session,
        prefix: &str,
        unknowns: usize,
        precision: Precision,
    ) -> Result<Self, PetscError> {
        let comm = session.comm();
        let mut asked = false;
        for option in ["pc_type", "pc_factor_mat_solver_type"] {
            asked |= session.has_option(&format!("-{prefix}{option}"))?;
        }
        let ours = !asked && (comm.is_serial() || unknowns < LARGE);
        let raw = ptr::null_mut();
        let mut factor =
            Self { raw, parts: None, comm, precision, ours, cost: COST, _live: Live::new() };
        cholesky_options(session, prefix)?;
        let prefix = c_string(prefix)?;
        let package = package(session);
        // SAFETY: a fresh handle, strings that live during the calls.
        unsafe {
            check(raw::PCCreate(world(), &mut factor.raw))?;
            check(raw::PCSetOptionsPrefix(factor.raw, prefix.as_ptr()))?;
            check(raw::PCSetType(factor.raw, method(session, unknowns).as_ptr()))?;
            check(raw::PCFactorSetMatSolverType(factor.raw, package.as_ptr()))?;
            check(raw::PCSetFromOptions(factor.raw))?;
        }
        Ok(factor)
    }

    /// Factorises the present values of `matrix`; false if it is not positive definite.
    pub fn factorise(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        // SAFETY: a live handle.
        unsafe { self.factorise_raw(matrix.raw, false) }
    }

    /// As `factorise`; a matrix of another `pattern` than the last needs a new ordering.
    ///
    /// # Safety
    /// `matrix` is a live handle.
    pub(super) unsafe fn factorise_raw(
        &mut self,
        matrix: raw::Mat,
        pattern: bool,
    ) -> Result<bool, PetscError> {
        if self.ours && (pattern || self.parts.is_none()) {
            // SAFETY: the caller's promise.
            self.parts = unsafe { Substructure::new(self.comm, matrix, self.precision)? };
            self.ours = self.parts.is_some();
        }
        if let Some(parts) = &mut self.parts {
            // SAFETY: the caller's promise.
            let definite = unsafe { parts.factorise(matrix)? };
            // SAFETY: the caller's promise.
            let product = 12.0 * unsafe { entries(matrix) };
            self.cost =
                self.comm.max(parts.work()) / self.comm.max(parts.traffic() + product).max(1.0);
            return Ok(definite);
        }
        // SAFETY: live handles; PETSc keeps a reference to the matrix. Without the last call it
        // would factorise again when that matrix changes.
        unsafe {
            if pattern {
                check(raw::PCReset(self.raw))?;
            }
            check(raw::PCSetReusePreconditioner(self.raw, raw::PetscBool::PETSC_FALSE))?;
            check(raw::PCSetOperators(self.raw, matrix, matrix))?;
            let definite = definite(self.raw, check(raw::PCSetUp(self.raw)))?;
            check(raw::PCSetReusePreconditioner(self.raw, raw::PetscBool::PETSC_TRUE))?;
            Ok(definite)
        }
    }

    /// Iterations of conjugate gradients that take about as long as a factorisation, by counted
    /// work; the same on all ranks.
    pub fn cost(&self) -> f64 {
        self.cost
    }

    /// Bytes that a pair of triangular solves reads on this rank; 0 where unknown.
    pub fn traffic(&self) -> f64 {
        self.parts.as_ref().map_or(0.0, Substructure::traffic)
    }

    /// `z` ← the factored matrix' inverse · `r`.
    pub fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError> {
        same_size(r.owned(), z.owned())?;
        // SAFETY: live handles of matching layout, distinct by borrowing.
        unsafe { self.apply_raw(r.raw, z.raw) }
    }

    /// # Safety
    /// Live handles of the factored matrix' layout.
    pub(super) unsafe fn apply_raw(&mut self, r: raw::Vec, z: raw::Vec) -> Result<(), PetscError> {
        if let Some(parts) = &mut self.parts {
            let (mut size, mut from, mut to) = (0, ptr::null(), ptr::null_mut());
            // SAFETY: the caller's promise; PETSc lends `size` values of each until they are given back.
            unsafe {
                check(raw::VecGetLocalSize(r, &mut size))?;
                check(raw::VecGetArrayRead(r, &mut from))?;
                check(raw::VecGetArray(z, &mut to))?;
                parts.apply(
                    slice::from_raw_parts(from, size as usize),
                    slice::from_raw_parts_mut(to, size as usize),
                );
                check(raw::VecRestoreArray(z, &mut to))?;
                return check(raw::VecRestoreArrayRead(r, &mut from));
            }
        }
        // SAFETY: the caller's promise.
        check(unsafe { raw::PCApply(self.raw, r, z) })
    }
}

/// The cost of a factor whose work is not known, in iterations. Measured on square.toml with n = 64
/// and 256, on one and two ranks: MUMPS 4 to 10, gamg 13 to 33, CHOLMOD through PETSc 10 to 19.
const COST: f64 = 10.0;

/// Left to itself CHOLMOD makes LDLᵀ of a small matrix, accepts negative pivots, and prints its
/// warnings into the results. MUMPS' guess of the memory it needs is now and then too small.
fn cholesky_options(session: &Session, prefix: &str) -> Result<(), PetscError> {
    let options = match session.comm().is_serial() {
        true => {
            &[("cholmod_final_asis", "0"), ("cholmod_final_ll", "1"), ("cholmod_print", "0")][..]
        }
        false => &[("mumps_icntl_14", "100")],
    };
    for (option, value) in options {
        session.default_option(&format!("-{prefix}mat_{option}"), value)?;
    }
    Ok(())
}

/// Rows above which several ranks use multigrid: the memory of factors grows faster than the rows.
/// With 2.1 million on two ranks a step with factors was six times as fast, their set-up four times
/// as slow, memory 10 % more; what is beyond was not measured.
const LARGE: usize = 2_500_000;

/// PETSc's type of preconditioner for so many rows on all ranks together.
fn method(session: &Session, unknowns: usize) -> &'static CStr {
    match session.comm().is_serial() || unknowns < LARGE {
        true => c"cholesky",
        false => c"gamg",
    }
}

/// The package that makes Cholesky factors.
fn package(session: &Session) -> &'static CStr {
    if session.comm().is_serial() { c"cholmod" } else { c"mumps" }
}

/// PETSC_ERR_MAT_CH_ZRPVT: a pivot of CHOLMOD's factorisation is not positive.
pub(super) const NOT_DEFINITE: i32 = 81;

/// Tells a matrix that is not positive definite from other failures of setting up `pc`.
///
/// # Safety
/// `pc` is a live handle.
unsafe fn definite(pc: raw::PC, set_up: Result<(), PetscError>) -> Result<bool, PetscError> {
    /// Where MUMPS counts negative pivots (INFOG(12)): it makes LDLᵀ and does not mind them.
    const NEGATIVE: i32 = 12;
    match set_up {
        Ok(()) => {}
        Err(error) if error.code == NOT_DEFINITE => return Ok(false),
        Err(other) => return Err(other),
    }
    let mut reason = raw::PCFailedReason::PC_NOERROR;
    let (mut factor, mut package, mut negative) = (ptr::null_mut(), ptr::null(), 0);
    // SAFETY: a live handle; the package's name is a constant of PETSc.
    unsafe {
        check(raw::PCGetFailedReason(pc, &mut reason))?;
        if reason != raw::PCFailedReason::PC_NOERROR {
            return Ok(false);
        }
        // Other preconditioners leave the name as it is.
        check(raw::PCFactorGetMatSolverType(pc, &mut package))?;
        if !package.is_null() && CStr::from_ptr(package) == c"mumps" {
            check(raw::PCFactorGetMatrix(pc, &mut factor))?;
            check(raw::MatMumpsGetInfog(factor, NEGATIVE, &mut negative))?;
        }
    }
    Ok(negative == 0)
}

impl Drop for Factor {
    fn drop(&mut self) {
        // SAFETY: the handle is ours and not used afterwards.
        unsafe { raw::PCDestroy(&mut self.raw) };
    }
}

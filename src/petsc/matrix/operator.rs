//! Matrices whose products need no entries: a MATSHELL beside the stored matrix
//! (<https://petsc.org/release/manualpages/Mat/MATSHELL/>).

use super::Matrix;
use crate::petsc::{
    PetscError, Vector, check, error::return_code, handle::Handle, options, raw, session::world,
};
use std::{cell::Cell, ffi::c_void, mem::transmute, ptr, rc::Rc};

/// A symmetric matrix A that is known by its products.
pub(crate) trait Operator {
    /// `y` ← A `x` on the owned unknowns. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    fn multiply(&self, x: &[f64], y: &mut [f64]) -> Result<(), PetscError>;

    /// The owned entries of the diagonal of A.
    fn diagonal(&self) -> Vec<f64>;

    /// Adds the stored entries of this rank to zeros, in the order of [`Matrix::read_entries`].
    fn write(&self, entries: &mut [f64]);
}

/// The operator of a matrix. Entries are written when they are first read after a change.
pub(super) struct Shell {
    handle: Handle<raw::_p_Mat>,
    /// In a box, because PETSc keeps a pointer to it.
    operator: Box<Rc<dyn Operator>>,
    /// Do the entries belong to an earlier state of the operator?
    stale: Cell<bool>,
}

/// A product as PETSc calls it: A, x, y.
type Product = unsafe extern "C" fn(raw::Mat, raw::Vec, raw::Vec) -> raw::PetscErrorCode;

impl Matrix {
    /// Takes products and the diagonal from this operator, and entries too when they are read.
    ///
    /// # Errors
    /// PETSc failed.
    pub(crate) fn set_operator(&mut self, operator: Rc<dyn Operator>) -> Result<(), PetscError> {
        let operator = Box::new(operator);
        let (rows, context) = (self.owned() as i32, ptr::from_ref(&*operator).cast_mut().cast());
        let product = raw::MatOperation::MATOP_MULT;
        // SAFETY: a fresh handle. The context lives as long as the handle, in the same owner. MatShell's
        // operations are passed as functions without arguments; PETSc calls this one as a product.
        let handle = unsafe {
            let handle = Handle::new(raw::MatDestroy, |handle| {
                raw::MatCreateShell(world(), rows, rows, -1, -1, context, handle)
            })?;
            let function = Some(transmute::<Product, unsafe extern "C" fn()>(multiply));
            check(raw::MatShellSetOperation(handle.raw(), product, function))?;
            for option in [raw::MatOption::MAT_SYMMETRIC, raw::MatOption::MAT_SYMMETRY_ETERNAL] {
                check(raw::MatSetOption(handle.raw(), option, options::petsc_bool(true)))?;
            }
            handle
        };
        self.shell = Some(Shell { handle, operator, stale: Cell::new(true) });
        Ok(())
    }

    /// The operator has changed.
    pub(crate) fn set_changed(&mut self) {
        self.shell.iter().for_each(|shell| shell.stale.set(true));
    }

    /// PETSc's handle for products: that of the operator, or that of the stored entries.
    pub(in crate::petsc) fn product(&self) -> raw::Mat {
        self.shell.as_ref().map_or(self.stored(), |shell| shell.handle.raw())
    }

    /// The stored matrix with its present entries. Collective.
    pub(in crate::petsc) fn assembled(&self) -> Result<raw::Mat, PetscError> {
        if let Some(Shell { operator, stale, .. }) = &self.shell
            && stale.replace(false)
        {
            self.write(|entries| operator.write(entries))?;
        }
        Ok(self.stored())
    }

    /// The operator, if products are taken from one.
    pub(super) fn operator(&self) -> Option<&dyn Operator> {
        self.shell.as_ref().map(|shell| &**shell.operator)
    }
}

unsafe extern "C" fn multiply(shell: raw::Mat, x: raw::Vec, y: raw::Vec) -> raw::PetscErrorCode {
    let multiply = || {
        let mut context: *mut c_void = ptr::null_mut();
        // SAFETY: PETSc passes a shell of ours, whose context lives as long, and two live vectors.
        let (operator, x, mut y) = unsafe {
            check(raw::MatShellGetContext(shell, (&raw mut context).cast()))?;
            let operator = &*context.cast::<Rc<dyn Operator>>();
            (operator, Vector::borrowed(x)?, Vector::borrowed(y)?)
        };
        x.read(|x| y.write(|y| operator.multiply(x, y)))??
    };
    return_code(multiply())
}

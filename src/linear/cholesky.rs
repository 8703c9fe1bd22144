//! Cholesky factors of matrices that one rank has.

use super::{
    LowerTriangle,
    cholmod::Cholmod,
    supernodal::{Supernodal, TriangularSolver},
};
use crate::memory;
use crate::petsc::{Communicator, PetscError};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// The factor P A Pᵀ = L Lᵀ of a sparse symmetric positive definite matrix, supernodal.
///
/// CHOLMOD orders and factorises. The triangular solves are our own. They read L faster than CHOLMOD's, and
/// half the bytes in single precision. Between the forward and the backward solve the Schur complement of an
/// interface can be solved.
pub struct Cholesky {
    factor: Cholmod,
    precision: Precision,
    /// The number of interior rows, the first in the order of L.
    interior: usize,
    solver: Box<dyn TriangularSolver>,
}

/// Digits of the entries of L.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Precision {
    /// Seven (`f32`) if this makes a good preconditioner, else sixteen.
    Preconditioner,
    /// Sixteen (`f64`).
    Full,
}

/// The cost of a factorisation in bytes that a solve reads in the same time: per floating-point operation,
/// and per entry of L (assembly, copies). They fit measured times within 10 % on one processor, for 4,000 to
/// 530,000 unknowns.
pub(super) const BYTES_PER_OPERATION: f64 = 0.8;
const BYTES_PER_ENTRY: f64 = 200.0;

impl Cholesky {
    /// Orders and analyses `a`. The last `interface` rows stay the last ones; [`Self::solve`] leaves them out.
    ///
    /// # Errors
    /// There is no memory for it.
    pub fn analyse(
        a: &mut LowerTriangle,
        interface: usize,
        precision: Precision,
    ) -> Result<Self, PetscError> {
        let interior = a.size() - interface;
        let factor = Cholmod::ordered(a, interface)?;
        let solver: Box<dyn TriangularSolver> = match precision {
            Precision::Preconditioner => Box::new(Supernodal::<f32>::new(&factor, interior)),
            Precision::Full => Box::new(Supernodal::<f64>::new(&factor, interior)),
        };
        Ok(Self { factor, precision, interior, solver })
    }

    /// Factorises `a`, which has the analysed pattern. Returns L₂₂, the block of the interface rows, with L₂₂
    /// L₂₂ᵀ = A₂₂ − A₂₁ A₁₁⁻¹ A₁₂. `None` if `a` is not positive definite.
    ///
    /// # Errors
    /// There is no memory for it.
    pub fn factorise(&mut self, a: &mut LowerTriangle) -> Result<Option<DMatrix<f64>>, PetscError> {
        self.solver.clear();
        if !self.factor.factorise(a)? {
            return Ok(None);
        }
        let block = self.interface_block();
        self.solver.take_values(&mut self.factor);
        if self.precision == Precision::Preconditioner && !self.is_accurate_enough(a) {
            self.precision = Precision::Full;
            self.solver = Box::new(Supernodal::<f64>::new(&self.factor, self.interior));
            // The rest of the values may be too short for CHOLMOD to write to.
            self.factor.free_values()?;
            self.factor.factorise(a)?;
            self.solver.take_values(&mut self.factor);
        }
        self.factor.free_values()?;
        Ok(Some(block))
    }

    /// Is the factor accurate enough for `a`? The test load is both smooth and rough: an inexact factor of an
    /// ill-conditioned matrix leaves a large residual.
    fn is_accurate_enough(&mut self, a: &LowerTriangle) -> bool {
        let load: Vec<f64> = (0..a.size()).map(|i| 1.0 + (i as f64).sin()).collect();
        let mut x = vec![0.0; load.len()];
        self.solve(&load, &mut x);
        let load = &load[..self.interior];
        let residual: f64 = a.multiply(&x).iter().zip(load).map(|(ax, b)| (b - ax).powi(2)).sum();
        residual < load.iter().map(|b| b * b).sum()
    }

    /// Checks that there is memory for L, because Linux may kill a process that takes more. malloc's pool may hold 32 MB.
    /// Collective.
    pub(super) fn check_memory(&self, comm: Communicator) -> Result<(), PetscError> {
        let [_, entries] = self.factor.operations_and_entries();
        let needed = 8.0 * comm.total(entries) / comm.size() as f64 - 33.6e6;
        PetscError::if_short(comm.max(needed - memory::available()), "for a Cholesky factor")
    }

    /// L₂₂ of a factor that has values.
    fn interface_block(&self) -> DMatrix<f64> {
        let (values, first) = (self.factor.values(), self.interior);
        let size = self.permutation().len() - first;
        let mut block = DMatrix::zeros(size, size);
        for (columns, rows, start) in self.factor.supernodes() {
            for column in columns.start.max(first)..columns.end {
                let above = column - columns.start;
                let values = &values[start + above * rows.len()..];
                for (&row, value) in rows.iter().zip(values).skip(above) {
                    block[(row as usize - first, column - first)] = *value;
                }
            }
        }
        block
    }

    /// The precision of L. After the first factorisation that needs full precision it stays full.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// P: the row of A of each row of L.
    pub fn permutation(&self) -> &[i64] {
        self.factor.permutation()
    }

    /// The forward solve with L₁₁ and L₂₁, which returns y₂:
    ///
    /// ```text
    /// L = ⎡ L₁₁     ⎤        L₁₁ y₁ = (P b)₁,        y₂ = (P b)₂ − L₂₁ y₁,
    ///     ⎣ L₂₁ L₂₂ ⎦        L₁₁ᵀ (P x)₁ = y₁ − L₂₁ᵀ (P x)₂.
    /// ```
    pub fn forward(&mut self, b: &[f64]) -> Vec<f64> {
        self.solver.forward(b)
    }

    /// The backward solve that belongs to the last [forward](Self::forward) one, for (P x)₂ = `interface`.
    pub fn backward(&mut self, interface: &[f64], x: &mut [f64]) {
        self.solver.backward(interface, x);
    }

    /// `x` ← A₁₁⁻¹ b₁, and 0 in the rows of the interface.
    pub fn solve(&mut self, b: &[f64], x: &mut [f64]) {
        let interface = vec![0.0; self.permutation().len() - self.interior];
        self.forward(b);
        self.backward(&interface, x);
    }

    /// [`Self::solve`] for two right sides of a factor without interface.
    pub fn solve_two(&mut self, b: [&[f64]; 2], x: [&mut [f64]; 2]) {
        self.solver.solve_two(b, x);
    }

    /// The time of a factorisation, as the number of bytes that solves read in this time.
    pub(super) fn work(&self) -> f64 {
        let [operations, entries] = self.factor.operations_and_entries();
        BYTES_PER_OPERATION * operations + BYTES_PER_ENTRY * entries
    }

    /// Bytes that a solve reads.
    pub fn bytes(&self) -> f64 {
        self.solver.bytes()
    }
}

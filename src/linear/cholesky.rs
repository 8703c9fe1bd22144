//! Cholesky factors of matrices that one rank has.

use super::{
    LowerTriangle,
    cholmod::Cholmod,
    supernodal::{Supernodal, TriangularSolver},
};
use crate::petsc::PetscError;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// The factor P A Pᵀ = L Lᵀ of a sparse symmetric positive definite matrix, supernodal.
///
/// CHOLMOD orders and factorises. The triangular solves are our own: they read L twice as fast, in
/// half the bytes where single precision is enough, and are two steps, between which the Schur complement
/// of an interface is solved with.
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
    /// Seven (`f32`) if that makes a good preconditioner, else sixteen.
    Preconditioner,
    /// Sixteen (`f64`).
    Full,
}

/// The largest residual ‖b − A x‖₂/‖b‖₂ of a solve in single precision for which the factor is kept
/// in that precision. With 3e-3 (the unit square, n = 256) iterations were no more than in double precision;
/// with 0.2 (the L, 259,000 unknowns) no more where contact stays and a quarter more where it moves, at half
/// the time each.
const LARGEST_RESIDUAL: f64 = 0.3;

/// Bytes that a solve reads in the time of one floating-point operation of a factorisation, and in the
/// time of its other work per entry of L (assembly, copies). Seconds of a factorisation were
/// 0.065 ns · operations + 16.5 ns · entries within 10 % (square and L, 4,000 to 530,000 unknowns, one
/// core of a Xeon with AVX-512, OpenBLAS), those of an iteration 0.06 to 0.13 ns per byte.
const BYTES_PER_OPERATION: f64 = 0.8;
const BYTES_PER_ENTRY: f64 = 200.0;

impl Cholesky {
    /// Orders and analyses `a`: in the `order` given (the row of A of each row of L), else by a choice that
    /// leaves L sparse. The last `interface` rows, also the last in the order, are not solved for.
    ///
    /// # Errors
    /// There is no memory for it.
    pub fn analyse(
        a: &mut LowerTriangle,
        order: Option<Vec<i64>>,
        interface: usize,
        precision: Precision,
    ) -> Result<Self, PetscError> {
        let interior = a.size() - interface;
        let factor = match order {
            Some(order) => Cholmod::analyse(a, order)?,
            None => Cholmod::ordered(a, interface)?,
        };
        let solver: Box<dyn TriangularSolver> = match precision {
            Precision::Preconditioner => Box::new(Supernodal::<f32>::new(&factor, interior)),
            Precision::Full => Box::new(Supernodal::<f64>::new(&factor, interior)),
        };
        Ok(Self { factor, precision, interior, solver })
    }

    /// Factorises `a`, which has the pattern that was analysed: L₂₂, the block of the interface rows,
    /// with L₂₂ L₂₂ᵀ = A₂₂ − A₂₁ A₁₁⁻¹ A₁₂. `None` if `a` is not positive definite.
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
            // What is left of the values may be too short for CHOLMOD to write to.
            self.factor.free_values()?;
            self.factor.factorise(a)?;
            self.solver.take_values(&mut self.factor);
        }
        self.factor.free_values()?;
        Ok(Some(block))
    }

    /// Whether solves come near to those with `a`: tried with a load both smooth and rough, of which an
    /// inexact factor of an ill-conditioned matrix leaves much.
    fn is_accurate_enough(&mut self, a: &LowerTriangle) -> bool {
        let load: Vec<f64> = (0..a.size()).map(|i| 1.0 + (i as f64).sin()).collect();
        let mut x = vec![0.0; load.len()];
        self.solve(&load, &mut x);
        let load = &load[..self.interior];
        let residual: f64 = a.multiply(&x).iter().zip(load).map(|(ax, b)| (b - ax).powi(2)).sum();
        residual <= LARGEST_RESIDUAL * LARGEST_RESIDUAL * load.iter().map(|b| b * b).sum::<f64>()
    }

    /// L₂₂ of a factor that has values.
    fn interface_block(&self) -> DMatrix<f64> {
        let (values, first) = (self.factor.values(), self.interior);
        let size = self.order().len() - first;
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

    /// The digits of L: full ones from the first factorisation on that needed them.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// P: the row of A of each row of L.
    pub fn order(&self) -> &[i64] {
        self.factor.order()
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
        let interface = vec![0.0; self.order().len() - self.interior];
        self.forward(b);
        self.backward(&interface, x);
    }

    /// The work of a factorisation, in bytes that a solve reads in the same time.
    pub(super) fn work(&self) -> f64 {
        let [operations, entries] = self.factor.operations_and_entries();
        BYTES_PER_OPERATION * operations + BYTES_PER_ENTRY * entries
    }

    /// Bytes that a solve reads.
    pub fn bytes(&self) -> f64 {
        self.solver.bytes()
    }
}

//! The factor that preconditions a matrix, whatever makes it.

use super::{Precision, RefactorisationPolicy, substructure::Substructure};
use crate::{
    archive::{Archive, ArchiveError},
    petsc::{
        Communicator, Matrix, PetscError, Preconditioner, Session, ShellPreconditioner, Vector,
        has_option, set_default_option,
    },
};

/// A Cholesky factor: CHOLMOD's with solves of our own, by substructuring where there are several
/// ranks. There MUMPS takes its place (PCCHOLESKY) where the interface between the ranks is too large,
/// a cycle of algebraic multigrid (PCGAMG) where the matrix is very large. PETSc options can ask for
/// any other preconditioner.
///
/// Fill-reducing ordering and symbolic factorisation are done once for each number of rows. A factor
/// may be kept as the preconditioner of later matrices until [`RefactorisationPolicy`] finds a new one
/// due.
pub struct Factor {
    comm: Communicator,
    prefix: String,
    /// Of the factors of a substructure.
    precisions: [Precision; 2],
    /// Made with the first matrix of so many rows.
    method: Option<(usize, Method)>,
    /// `None` before the first factorisation, and after one that failed.
    policy: Option<RefactorisationPolicy>,
    /// Applications in the present solve.
    applications: usize,
    /// Factorisations that did not fail.
    factorisations: usize,
    /// The values of the matrix last factorised, from which a checkpoint makes the same factor.
    values: Vec<f64>,
    /// Whether the factor was loaded and is yet to be made.
    loaded: bool,
}

enum Method {
    Substructure(Substructure),
    Petsc(Preconditioner),
}

/// The cost, in iterations, of a factorisation whose work is not known. Measured on square.toml with
/// n = 64 and 256, on one and two ranks: MUMPS 4 to 10, gamg 13 to 33, CHOLMOD through PETSc 10 to 19.
const UNKNOWN_COST: f64 = 10.0;

/// Rows above which several ranks use multigrid: the memory of factors grows faster than the rows.
/// With 2.1 million on two ranks a step with factors was six times as fast, their set-up four times
/// as slow, memory 10 % more; what is beyond was not measured.
const VERY_LARGE: usize = 2_500_000;

impl Factor {
    /// A factor whose PETSc options begin with `prefix` (`-elastic_pc_type …`).
    pub fn new(session: &Session, prefix: &str, precision: Precision) -> Self {
        Self {
            comm: session.comm(),
            prefix: prefix.to_owned(),
            precisions: [precision; 2],
            method: None,
            policy: None,
            applications: 0,
            factorisations: 0,
            values: Vec::new(),
            loaded: false,
        }
    }

    /// Saves or loads the factor as the values of the matrix that it was made of.
    ///
    /// # Errors
    /// The archive has no factor there.
    pub fn archive(&mut self, archive: &mut Archive) -> Result<(), ArchiveError> {
        archive.value(&mut self.values)?;
        archive.value(&mut self.precisions)?;
        archive.value(&mut self.policy)?;
        archive.value(&mut self.applications)?;
        archive.value(&mut self.factorisations)?;
        self.loaded |= archive.is_loading() && self.policy.is_some();
        Ok(())
    }

    /// Makes the factor that was loaded again, of a matrix with the pattern of this one. Collective.
    ///
    /// # Errors
    /// The pattern is another, or as in [`Self::factorise`].
    pub(super) fn remake(&mut self, matrix: &Matrix) -> Result<(), PetscError> {
        if !std::mem::take(&mut self.loaded) {
            return Ok(());
        }
        let mut copy = matrix.duplicate()?;
        copy.set_entries(&self.values)?;
        let (policy, factorisations) = (self.policy.take(), self.factorisations);
        if self.factorise(&copy)? {
            (self.policy, self.factorisations) = (policy, factorisations);
        }
        Ok(())
    }

    /// Whether PETSc options ask for a preconditioner.
    fn is_asked_for(&self) -> Result<bool, PetscError> {
        let prefix = &self.prefix;
        Ok(has_option(&format!("-{prefix}pc_type"))?
            || has_option(&format!("-{prefix}pc_factor_mat_solver_type"))?)
    }

    /// Refuses options that PETSc does not know before anything is factorised.
    ///
    /// # Errors
    /// They ask for what PETSc has not.
    pub fn check_options(&self) -> Result<(), PetscError> {
        if self.is_asked_for()? {
            Preconditioner::new(&self.prefix, c"cholesky", c"petsc")?;
        }
        Ok(())
    }

    /// Factorises the present values of `matrix`; false if it is not positive definite: then there is
    /// no factor. Collective.
    ///
    /// # Errors
    /// There is no memory for it, or PETSc options ask for what PETSc has not.
    pub fn factorise(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        let rows = matrix.size()?;
        let mut method = match self.method.take() {
            Some((size, method)) if size == rows => method,
            _ => self.choose(matrix, rows)?,
        };
        let (definite, cost) = match &mut method {
            Method::Petsc(preconditioner) => (preconditioner.set_up(matrix)?, UNKNOWN_COST),
            Method::Substructure(factor) => {
                let definite = factor.factorise(matrix)?;
                self.precisions = factor.precisions();
                let work = self.comm.max(factor.work());
                // An iteration reads the factor and the entries of the matrix with their columns.
                let iteration = self.comm.max(factor.bytes() + 12.0 * matrix.entries());
                (definite, work / iteration.max(1.0))
            }
        };
        self.method = Some((rows, method));
        matrix.read_entries(&mut self.values)?;
        self.policy = definite.then(|| RefactorisationPolicy::new(cost));
        self.factorisations += usize::from(definite);
        Ok(definite)
    }

    /// What factorises matrices of the pattern of this one.
    fn choose(&self, matrix: &Matrix, rows: usize) -> Result<Method, PetscError> {
        let (prefix, serial) = (&self.prefix, self.comm.is_serial());
        let asked = self.is_asked_for()?;
        let factorised = serial || rows < VERY_LARGE;
        if factorised
            && !asked
            && let Some(factor) = Substructure::new(self.comm, matrix, self.precisions)?
        {
            return Ok(Method::Substructure(factor));
        }
        // Left to itself CHOLMOD makes LDLᵀ of a small matrix, accepts negative pivots, and prints its
        // warnings into the results. MUMPS' guess of the memory it needs is now and then too small.
        let options = match serial {
            true => {
                &[("cholmod_final_asis", "0"), ("cholmod_final_ll", "1"), ("cholmod_print", "0")][..]
            }
            false => &[("mumps_icntl_14", "100")],
        };
        for (option, value) in options {
            set_default_option(&format!("-{prefix}mat_{option}"), value)?;
        }
        let kind = if factorised { c"cholesky" } else { c"gamg" };
        let package = if serial { c"cholmod" } else { c"mumps" };
        Ok(Method::Petsc(Preconditioner::new(prefix, kind, package)?))
    }

    /// Bytes that an application reads on this rank; 0 where unknown.
    pub fn bytes_per_application(&self) -> f64 {
        match &self.method {
            Some((_, Method::Substructure(factor))) => factor.bytes(),
            _ => 0.0,
        }
    }

    /// `z` ← A⁻¹ `r`, A the matrix last factorised: a pair of triangular solves.
    ///
    /// # Errors
    /// Sizes differ, or nothing was factorised.
    pub fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError> {
        self.applications += 1;
        match &mut self.method {
            Some((_, Method::Petsc(preconditioner))) => preconditioner.apply(r, z),
            Some((_, Method::Substructure(factor))) if r.owned() == z.owned() => {
                r.read(|r| z.write(|z| factor.apply(r, z)))?
            }
            _ => Err(PetscError::ours("a factor is applied that was not made for such vectors")),
        }
    }

    /// Factorisations made so far that did not fail.
    pub fn factorisations(&self) -> usize {
        self.factorisations
    }

    /// Whether the last factorisation went well.
    pub(super) fn exists(&self) -> bool {
        self.policy.is_some()
    }

    /// Iterations that a solve with the factor of an earlier matrix is worth; `None` if a new factor is
    /// due, or there is none.
    pub(super) fn iteration_limit(&self) -> Option<usize> {
        self.policy.as_ref().and_then(RefactorisationPolicy::iteration_limit)
    }

    /// Ends a solve: its applications tell how good the factor still is.
    pub(super) fn end_solve(&mut self) {
        let iterations = std::mem::take(&mut self.applications);
        if let Some(policy) = &mut self.policy {
            policy.solved(iterations);
        }
    }
}

/// Inside one of TAO's methods: every new operator begins a solve.
impl ShellPreconditioner for Factor {
    fn set_up(&mut self, matrix: &Matrix) -> Result<bool, PetscError> {
        self.remake(matrix)?;
        self.end_solve();
        let rows = matrix.size()?;
        let fits = self.method.as_ref().is_some_and(|(size, _)| *size == rows);
        if fits && self.iteration_limit().is_some() { Ok(true) } else { self.factorise(matrix) }
    }

    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError> {
        Factor::apply(self, r, z)
    }
}

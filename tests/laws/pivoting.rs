//! The active set where pivoting on all violating indices does not end, on hand-made problems.

use crate::support::{close, history, problem};
use nalgebra::{DMatrix, DVector};
use signorini::{
    contact::{
        Bound, ChosenSolver, ContactError, ContactOptions, ContactProblem, ContactReport, SOLVERS,
        Scales, find, solvers,
    },
    linear::{LinearSolver, Precision},
    mesh::Mesh,
    petsc::{Communicator, Matrix, Pattern, Session, Vector},
};

const TOLERANCE: f64 = 1e-10;

/// min ½ cᵀKc − fᵀc for c ≤ g.
struct Small {
    stiffness: DMatrix<f64>,
    load: Vec<f64>,
    gaps: Vec<f64>,
    rigid: DMatrix<f64>,
    work: DVector<f64>,
}

impl Small {
    fn solve(&self, name: &str, guess: &[f64]) -> (Vec<f64>, ContactReport) {
        self.try_solve(name, guess).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn try_solve(
        &self,
        name: &str,
        guess: &[f64],
    ) -> Result<(Vec<f64>, ContactReport), ContactError> {
        let session = Session::start(&[]).unwrap();
        let size = self.load.len();
        let entries = (0..size).flat_map(|i| (0..size as i32).map(move |j| (i, j)));
        let pattern = Pattern::new(size, entries);
        let matrix =
            Matrix::with_pattern(&session, 1, &pattern, self.stiffness.as_slice()).unwrap();
        let (mut load, mut c) =
            (Vector::zeros(&session, size).unwrap(), Vector::zeros(&session, size).unwrap());
        load.set(&self.load).unwrap();
        let bound = |(dof, gap): (usize, &f64)| Bound {
            dof,
            node: dof,
            normal: [0.0, 1.0],
            lower: f64::NEG_INFINITY,
            upper: *gap,
            tributary_length: 1.0,
        };
        let bounds: Vec<_> = self.gaps.iter().enumerate().map(bound).collect();
        let problem = ContactProblem {
            session: &session,
            stiffness: &matrix,
            stiffness_scale: self.stiffness.trace() / size as f64,
            load: &load,
            bounds: &bounds,
            rigid: &self.rigid,
            work: &self.work,
            scales: Scales {
                force: self.load.iter().map(|f| f * f).sum::<f64>().sqrt(),
                displacement: 0.0,
            },
            tolerance: TOLERANCE,
            comm: Communicator::serial(),
        };
        let options = ContactOptions::default();
        let chosen = ChosenSolver::Named(name.to_owned());
        let solver = solvers(&chosen, true, &options).unwrap().remove(0);
        let mut elastic =
            LinearSolver::new(&session, "elastic_", size, Precision::Preconditioner).unwrap();
        elastic.factor().set_condensed(&matrix, 0..size).unwrap();
        let mut warm = if name == "active-set" { guess.to_vec() } else { Vec::new() };
        let report = solver.solve(&problem, &mut elastic, &mut warm, &mut c)?;
        Ok((c.read(<[f64]>::to_vec).unwrap(), report))
    }

    /// Minimises with c = g on the active unknowns and no other bound; Kc − f there.
    fn solve_equality(&self, active: &[bool]) -> (DVector<f64>, DVector<f64>) {
        let size = self.load.len();
        let a = DMatrix::from_fn(size, size, |i, j| match active[i] {
            true => f64::from(u8::from(i == j)),
            false => self.stiffness[(i, j)],
        });
        let value = |i: usize| if active[i] { self.gaps[i] } else { self.load[i] };
        let c = a.lu().solve(&DVector::from_fn(size, |i, _| value(i))).unwrap();
        let residual = &self.stiffness * &c - DVector::from_row_slice(&self.load);
        (c, residual)
    }

    /// The set after a pivot on all violating indices.
    fn pivot_all(&self, active: [bool; 3]) -> [bool; 3] {
        let (c, residual) = self.solve_equality(&active);
        [0, 1, 2].map(|i| match active[i] {
            true => residual[i] <= 1e-12,
            false => c[i] > self.gaps[i] + 1e-12,
        })
    }

    /// Whether pivots on all violating indices from this guess never end.
    fn cycles(&self, guess: [bool; 3]) -> bool {
        // There are eight sets: who has not ended after eight pivots returns to one.
        let last = (0..8).fold(guess, |set, _| self.pivot_all(set));
        self.pivot_all(last) != last
    }

    /// The answer: the set that a pivot leaves alone.
    fn enumerate(&self) -> Vec<f64> {
        let sets = (0..8).map(|set| [0, 1, 2].map(|i| set >> i & 1 == 1));
        let right: Vec<_> = sets.filter(|set| self.pivot_all(*set) == *set).collect();
        self.solve_equality(&right[0]).0.as_slice().to_vec()
    }
}

/// Positive definite, but with positive entries off its diagonal: for some
/// guesses block pivots come back to them.
fn cycling() -> Small {
    let stiffness = [4.0, 5.0, -5.0, 5.0, 9.0, -5.0, -5.0, -5.0, 7.0];
    Small {
        stiffness: DMatrix::from_row_slice(3, 3, &stiffness),
        load: vec![-2.0, -1.0, 3.0],
        gaps: vec![0.0; 3],
        rigid: DMatrix::zeros(3, 0),
        work: DVector::zeros(0),
    }
}

#[test]
fn pivots_on_the_deepest_end_where_block_pivots_cycle() {
    let small = cycling();
    let exact = small.enumerate();
    let mut cycling = 0;
    for set in 0..8 {
        let guess = [0, 1, 2].map(|i| f64::from(set >> i & 1));
        let (c, report) = small.solve("active-set", &guess);
        c.iter().zip(&exact).for_each(|(c, e)| close(*c, *e, 1e-9));
        cycling += usize::from(small.cycles(guess.map(|on| on == 1.0)));
        // The factor is exact: all pivots but one from what already solves for the guess are condensed.
        assert!(report.iterations <= 8 && report.linear_iterations <= 2, "{report:?}");
        assert_eq!(report.factorisations, 1, "{report:?}");
    }
    assert!(cycling > 0);
}

/// A strip a hundred times as long as high whose foundations, above and below, wave like a snake, under a
/// force that wanders: long stretches of it go from one to the other in a step.
#[test]
fn a_slender_body_between_walls_takes_few_iterations_a_step() {
    let text = "material = { young = 1e8, poisson = 0.3, plane = 'strain' }
        contact.rescue = false
        contact.tolerance = 1e-8
        time = { end = 1, step = 0.05 }
        body.force = [0, '9*sin(2*pi*(x/100 - 2*t))']
        boundary = [
            { name = 'left', displacement = [0, 'free'] },
            { name = 'bottom', gap = '0.024*(0.43*(1 - t) + sin(pi*x/50 - 11.5*t))' },
            { name = 'top', gap = '0.024*(0.43*(1 - t) - sin(pi*x/50 - 11.5*t))' },
        ]";
    let problem = problem(Mesh::rectangle(100.0, 1.0, 300, 2), text).unwrap();
    let (steps, _) = history(&problem, SOLVERS[0]);
    let iterations: Vec<usize> = steps[1..].iter().map(|step| step.report.iterations).collect();
    let (mean, most) = (iterations.iter().sum::<usize>() / 20, iterations.iter().max());
    assert!(mean <= 60 && most <= Some(&100), "{iterations:?}");
}

/// A beam of three nodes that bends but is supported by nothing: (1, 1, 1) and (−1, 0, 1) are free of
/// energy. It lies on nodes 0 and 1, and the load beyond them tips it until node 2 meets its
/// obstacle: c = (−1, 0, 1).
fn beam() -> Small {
    let bending = [1.0, -2.0, 1.0, -2.0, 4.0, -2.0, 1.0, -2.0, 1.0];
    let load = vec![0.0, 0.2, 1.0];
    let rigid = DMatrix::from_row_slice(3, 2, &[1.0, -1.0, 1.0, 0.0, 1.0, 1.0]);
    Small {
        stiffness: 10.0 * DMatrix::from_row_slice(3, 3, &bending),
        work: rigid.transpose() * DVector::from_row_slice(&load),
        load,
        gaps: vec![0.0, 0.0, 1.0],
        rigid,
    }
}

#[test]
fn a_body_that_its_active_nodes_do_not_support_moves_to_the_next() {
    let beam = beam();
    for name in SOLVERS {
        // Node 0 is pulled, node 2 is not reached: without 0 the beam turns about 1.
        let (c, report) = beam.solve(name, &[1.0, 1.0, 0.0]);
        c.iter().zip([-1.0, 0.0, 1.0]).for_each(|(c, exact)| close(*c, exact, 1e-9));
        assert_eq!(report.fallbacks, 0, "{name}: {report:?}");
    }
}

#[test]
fn a_stiffness_that_no_factor_fits_is_left_to_the_rescuer() {
    // Nobody says that contact alone supports the beam: without node 0 its stiffness is singular.
    let untold = Small { rigid: DMatrix::zeros(3, 0), work: DVector::zeros(0), ..beam() };
    let failure = untold.try_solve("active-set", &[1.0, 1.0, 0.0]).unwrap_err();
    assert!(matches!(failure, ContactError::NotConverged { .. }), "{failure}");
    let (entry, _) = find("active-set").unwrap();
    let (c, _) = untold.solve(entry.rescuer.unwrap(), &[]);
    c.iter().zip([-1.0, 0.0, 1.0]).for_each(|(c, exact)| close(*c, exact, 1e-9));
}

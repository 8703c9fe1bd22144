//! What a time step costs at least: the work that no step can avoid, timed in isolation.

use crate::{
    cholesky::{Factor, Precision},
    evolution::DiscreteProblem,
    fem::{DamageSystem, Stiffness},
    petsc::{PetscError, Session, Vector},
    scene::Stepping,
};
use serde::Serialize;
use std::{hint::black_box, time::Instant};

/// The kernels of a time step at the cost they have alone.
#[derive(Debug, Serialize)]
pub struct Floor {
    /// Nodes of the mesh.
    pub nodes: usize,
    /// Median seconds of all parts once.
    pub seconds: f64,
    /// What a large copy moves per second, read and written: the speed of memory.
    pub copy_bytes_per_second: f64,
    /// The parts.
    pub parts: Vec<Part>,
}

/// One kernel.
#[derive(Debug, Serialize)]
pub struct Part {
    /// What it does.
    pub name: &'static str,
    /// Median seconds.
    pub seconds: f64,
    /// Bytes moved, every array counted once; 0 where unknown.
    pub bytes: f64,
}

/// Doubles that no cache holds.
const COPIED: usize = 1 << 24;

/// Times `rounds` of one pass over K's values, one product with K, one pair of triangular solves
/// and one damage solve, in turn, so that each finds the caches as it would in a step.
///
/// # Errors
/// PETSc failed.
pub fn floor(
    session: &Session,
    problem: &DiscreteProblem,
    rounds: usize,
) -> Result<Floor, PetscError> {
    let (body, constraints) = (&problem.body, &problem.constraints);
    let mut stiffness = Stiffness::new(session, body, &problem.elasticity, &constraints.bases)?;
    let mut held = stiffness.matrix.duplicate()?;
    let bounded: Vec<usize> = constraints.bounds.iter().map(|bound| bound.dof).collect();
    held.zero_rows_columns(&bounded, stiffness.scale)?;
    let mut factor = Factor::new(session, "elastic_", Precision::Preconditioner);
    factor.factorise(&held)?;

    let zeros = || Vector::zeros(session, stiffness.matrix.owned());
    let (mut x, mut y, mut z) = (zeros()?, zeros()?, zeros()?);
    x.write(|x| x.iter_mut().enumerate().for_each(|(i, x)| *x = (i as f64).sin()))?;
    let mut zeta = vec![0.99; body.mesh.nodes.len()];
    let (means, load) = (vec![0.99; body.triangles.len()], vec![-0.1; zeta.len()]);
    let mut damage = match (problem.damage(), problem.scene().time.map(|grid| grid.stepping)) {
        (Some(law), Some(Stepping::Uniform { steps })) => {
            let step = problem.scene().time.map_or(1.0, |grid| grid.end) / steps as f64;
            Some(DamageSystem::new(session, body, problem.mass(), law.diffusion, step)?)
        }
        _ => None,
    };

    let traffic = [
        ("stiffness refill", stiffness.refill_traffic()),
        ("product", stiffness.matrix.bytes_per_product()),
        ("triangular solves", factor.bytes_per_application()),
        ("damage solve", 0.0),
    ];
    let mut seconds = [const { Vec::new() }; 5];
    for _ in 0..rounds {
        let times = [
            timed(|| stiffness.refill(&means))?,
            timed(|| stiffness.matrix.multiply(&x, &mut y))?,
            timed(|| factor.apply(&y, &mut z))?,
            timed(|| match &mut damage {
                Some(system) => system.advance(&load, &mut zeta).map(drop),
                None => Ok(()),
            })?,
        ];
        let all = times.iter().sum();
        seconds.iter_mut().zip(times.into_iter().chain([all])).for_each(|(s, t)| s.push(t));
    }
    let [parts @ .., all] = seconds.map(median);
    let part = |((name, bytes), seconds)| Part { name, seconds, bytes };
    Ok(Floor {
        nodes: body.mesh.nodes.len(),
        seconds: all,
        copy_bytes_per_second: copy_speed(rounds),
        parts: traffic.into_iter().zip(parts).map(part).collect(),
    })
}

fn timed(work: impl FnOnce() -> Result<(), PetscError>) -> Result<f64, PetscError> {
    let started = Instant::now();
    work()?;
    Ok(started.elapsed().as_secs_f64())
}

/// Bytes read and written per second by a copy of [`COPIED`] doubles.
fn copy_speed(rounds: usize) -> f64 {
    let (from, mut to) = (vec![1.0_f64; COPIED], vec![0.0_f64; COPIED]);
    let copy = |_| {
        let started = Instant::now();
        to.copy_from_slice(black_box(&from));
        black_box(&to);
        started.elapsed().as_secs_f64()
    };
    16.0 * COPIED as f64 / median((0..rounds).map(copy).collect())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

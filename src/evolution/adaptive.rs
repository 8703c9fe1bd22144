//! Meshes for an accuracy that is asked for, instead of a size.
//!
//! From a coarse mesh, runs with few time steps tell how the error of u is spread over the triangles,
//! m_T = max_t ‖ε* − ε(u(t))‖²_T / max_t ‖u(t)‖², at the end relative to the ‖u‖² there. On a triangle
//! whose size is multiplied by r the error falls like r^p, p the order of u, and 1/r² triangles take
//! its place: the least number of triangles for a given error Σ r_T^2p m_T has r_T ~ m_T^(−1/(2p+2)).
//! The same holds for the part of the damage's error that its P1 interpolation makes; the other part
//! comes from u. Triangles are bisected down to the smaller size, round after round, until both
//! estimates are small enough.

use super::{
    DiscreteProblem, Outcome, Phases, RunError, SetupError, State, run, unresolved::unresolved,
};
use crate::{
    fem::RecoveredStrains,
    mesh::{Mesh, MeshError, Order, Refinement, sorted, twice_area},
    petsc::{PetscError, Session},
    scene::{Scene, Stepping},
};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// A mesh that was adapted to a scene.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Adapted {
    /// The mesh.
    pub mesh: Mesh,
    /// Displacement components at its nodes.
    pub unknowns: usize,
    /// Runs that were made on meshes before it.
    pub rounds: usize,
    /// The estimated relative error of u on it, in the energy norm, at the worst time.
    pub error: f64,
    /// That of the damage at the end.
    pub damage_error: Option<f64>,
    /// By how much the time at which ζ_* is reached changed from the mesh before to this one, s.
    pub stop_change: Option<f64>,
    /// Why the accuracy was not reached, if it was not.
    pub short: Option<String>,
}

/// Why no mesh was found.
#[derive(Debug, thiserror::Error)]
pub enum AdaptError {
    /// The scene does not fit a mesh.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// A triangle cannot be divided.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A run on a mesh that was tried failed.
    #[error(
        "mesh {rounds} of those tried for the accuracy, of {triangles} triangles: {source} (a run of the \
         same scene without `accuracy` keeps its results up to there)"
    )]
    Run {
        /// The number of the mesh.
        rounds: usize,
        /// Its triangles.
        triangles: usize,
        /// What failed.
        source: RunError,
    },
    /// PETSc failed.
    #[error(transparent)]
    Petsc(#[from] PetscError),
}

/// Parts of the accuracy asked for: what a mesh is made for, and what its estimate may be.
const AIM: f64 = 0.7;
const ENOUGH: f64 = 0.8;
/// The part of the damage's error that its interpolation may take.
const INTERPOLATION: f64 = 0.7;
/// The error of ζ over the damage done that the few steps of a run on a coarse mesh may make.
const PILOT_TOLERANCE: f64 = 0.05;
/// The part of the accuracy that the time steps of the last run may take.
pub const SHARE_OF_STEPS: f64 = 0.5;
/// Steps of a run on a coarse mesh; so many times, about, at which errors are estimated.
const INSTANTS: usize = 12;
/// A triangle's size is multiplied by no less than this in a round.
const LEAST_RATIO: f64 = 0.125;
/// A triangle at an edge on which a traction or a gap is not resolved becomes smaller by this.
const QUARTER: f64 = 0.25;
/// Triangles are bisected while they are larger than this part of their wanted area.
const EXCESS: f64 = 1.5;
/// At the end of a run, errors are relative to no less than this part of the largest ‖u‖².
const UNLOADED: f64 = 1e-4;
/// Rounds, and triangles of a mesh, at most.
const ROUNDS: usize = 25;
const MOST_TRIANGLES: usize = 4_000_000;

/// Refines `mesh` until the estimated relative errors of u and the damage in a run of `scene` are at most
/// `accuracy`; where the run ends at ζ_*, those of u and of that time. What the time steps add is for the
/// caller. `seen` is shown each mesh with its errors. Where a run on a refined mesh fails, the mesh before
/// it is the answer. Collective: all ranks have the same mesh.
///
/// # Errors
/// See [`AdaptError`].
pub fn adapted(
    session: &Session,
    scene: &Scene,
    mesh: Mesh,
    solver: &str,
    accuracy: f64,
    seen: &mut dyn FnMut(&Adapted),
) -> Result<Adapted, AdaptError> {
    let mut reached = None;
    let refined = refined(session, scene, mesh, solver, accuracy, &mut |mesh| {
        seen(mesh);
        reached = Some(mesh.clone());
    });
    match (refined, reached) {
        (Err(error), Some(before)) => Ok(Adapted { short: Some(error.to_string()), ..before }),
        (refined, _) => refined,
    }
}

/// The same, without an answer where a run fails.
fn refined(
    session: &Session,
    scene: &Scene,
    mesh: Mesh,
    solver: &str,
    accuracy: f64,
    seen: &mut dyn FnMut(&Adapted),
) -> Result<Adapted, AdaptError> {
    let mut scene = of_few_steps(scene);
    let order = if scene.order == Order::Quadratic { 2.0 } else { 1.0 };
    let mut refinement = Refinement::start(mesh);
    let mut stopped_before = None;
    let mut settled_rounds = 0;
    let mut rounds = 0;
    loop {
        rounds += 1;
        let problem = DiscreteProblem::new(scene.clone(), refinement.mesh.clone())?;
        let problem = problem.restrict(session)?;
        let triangles = refinement.mesh.triangles.len();
        let mut indicators = Indicators::new(&problem, triangles);
        let outcome = run(session, &problem, solver, &Phases::default(), &mut |step| {
            Ok(indicators.observe(&step.state, false)?)
        });
        let outcome = outcome.map_err(|source| AdaptError::Run { rounds, triangles, source })?;
        if let (Some(grid), Some(_)) = (&mut scene.time, outcome.stopped)
            && matches!(grid.stepping, Stepping::Uniform { .. })
        {
            // ζ_* is reached: by the body, or by too long steps.
            grid.stepping = Stepping::Auto { tolerance: PILOT_TOLERANCE.min(2.0 * accuracy) };
            continue;
        }
        indicators.observe(&outcome.last.state, true)?;
        let (error, shares) = indicators.relative();
        let damage_error = outcome.errors.damage_mesh;
        // Two meshes may agree by chance.
        let is_settled = is_settled(&outcome, stopped_before, accuracy);
        settled_rounds = if is_settled { settled_rounds + 1 } else { 0 };
        let settled = settled_rounds >= if outcome.stopped.is_some() { 2 } else { 1 };
        let exhausted = rounds >= ROUNDS || triangles > MOST_TRIANGLES;
        let times = outcome.stopped.map(|stop| stop.time).zip(stopped_before);
        let adapted = Adapted {
            mesh: refinement.mesh.clone(),
            unknowns: 2 * problem.body.nodes.partition.total(),
            rounds,
            error,
            damage_error,
            stop_change: times.map(|(now, before): (f64, f64)| (now - before).abs()),
            short: exhausted.then(|| "no larger mesh and no further one is tried".to_owned()),
        };
        seen(&adapted);
        let largest = error.max(damage_error.unwrap_or(0.0));
        let displacement = outcome.last.record.displacement_max.max(indicators.displacement);
        let coarse = unresolved(&scene, &refinement.mesh, accuracy, displacement);
        if exhausted || (largest <= ENOUGH * accuracy && settled && coarse.is_empty()) {
            return Ok(adapted);
        }
        let of_u = accuracy_of_u(accuracy, error, damage_error, settled);
        let mut ratios = size_ratios(&shares, order, AIM * of_u);
        if damage_error.is_some() {
            indicators.limit_by_damage(&outcome, accuracy, &mut ratios);
        }
        quarter(&refinement.mesh, &coarse, &mut ratios);
        stopped_before = outcome.stopped.map(|stop| stop.time);
        refinement = divided(refinement, &ratios)?;
    }
}

/// The scene of a pilot run.
fn of_few_steps(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    if let Some(grid) = &mut scene.time {
        grid.stepping = Stepping::Uniform { steps: INSTANTS };
    }
    scene
}

/// A damage, or a time, that is not exact enough asks for a u better than this one.
fn accuracy_of_u(accuracy: f64, error: f64, damage_error: Option<f64>, settled: bool) -> f64 {
    match damage_error {
        _ if !settled => accuracy.min(0.5 * error),
        Some(of_damage) if of_damage > accuracy => accuracy.min(error * accuracy / of_damage),
        _ => accuracy,
    }
}

/// Makes the triangles at some edges smaller.
fn quarter(mesh: &Mesh, edges: &HashSet<[usize; 2]>, ratios: &mut [f64]) {
    for (ratio, &[a, b, c]) in ratios.iter_mut().zip(&mesh.triangles) {
        if [[a, b], [b, c], [c, a]].iter().any(|&side| edges.contains(&sorted(side))) {
            *ratio = ratio.min(QUARTER);
        }
    }
}

/// Whether the time at which ζ_* was reached has changed by little since the mesh before.
fn is_settled(outcome: &Outcome, before: Option<f64>, accuracy: f64) -> bool {
    match (outcome.stopped, before) {
        (None, _) => true,
        (Some(_), None) => false,
        (Some(stop), Some(before)) => (stop.time - before).abs() <= ENOUGH * accuracy * stop.time,
    }
}

/// By how much to multiply the size of each triangle, with its share m_T = `shares` of the squared
/// relative error, so that this becomes `aim`².
fn size_ratios(shares: &[f64], order: f64, aim: f64) -> Vec<f64> {
    let exponent = 1.0 / (2.0 * order + 2.0);
    let ratio = |factor: f64, share: f64| match share {
        0.0 => 1.0,
        share => (factor / share.powf(exponent)).min(1.0),
    };
    let error = |factor: f64| -> f64 {
        shares.iter().map(|&share| ratio(factor, share).powf(2.0 * order) * share).sum()
    };
    let (mut low, mut high) = (0.0, shares.iter().copied().fold(0.0, f64::max).powf(exponent));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if error(middle) > aim * aim {
            high = middle;
        } else {
            low = middle;
        }
    }
    shares.iter().map(|&share| ratio(low, share).max(LEAST_RATIO)).collect()
}

/// Bisects the triangles until they are as small as `ratios` say.
fn divided(mut refinement: Refinement, ratios: &[f64]) -> Result<Refinement, MeshError> {
    let areas = areas(&refinement.mesh);
    let mut wanted: Vec<f64> = areas.iter().zip(ratios).map(|(a, r)| EXCESS * a * r * r).collect();
    loop {
        let areas = self::areas(&refinement.mesh);
        let marked: Vec<bool> = areas.iter().zip(&wanted).map(|(a, wanted)| a > wanted).collect();
        if !marked.contains(&true) {
            return Ok(refinement);
        }
        refinement = refinement.refine(&marked)?;
        wanted = refinement.parent_of_triangle.iter().map(|&parent| wanted[parent]).collect();
    }
}

/// |T| of each triangle, with straight sides, m².
fn areas(mesh: &Mesh) -> Vec<f64> {
    let corners = mesh.triangles.iter().map(|t| t.map(|node| mesh.nodes[node]));
    corners.map(|[a, b, c]| 0.5 * twice_area(a, b, c)).collect()
}

/// The errors of a run, triangle by triangle of the undivided mesh.
struct Indicators<'a> {
    problem: &'a DiscreteProblem,
    last: Option<f64>,
    /// max_t ‖ε* − ε(u)‖²_T, and the largest sum over T at any time.
    squares: Vec<f64>,
    worst: f64,
    /// max_t ‖u‖², and the largest |u| at any time, m.
    energy: f64,
    displacement: f64,
    /// ‖ε* − ε(u)‖²_T, their sum and ‖u‖² at the last time.
    end: (Vec<f64>, f64, f64),
}

impl<'a> Indicators<'a> {
    fn new(problem: &'a DiscreteProblem, triangles: usize) -> Self {
        Self {
            problem,
            last: None,
            squares: vec![0.0; triangles],
            worst: 0.0,
            energy: 0.0,
            displacement: 0.0,
            end: Default::default(),
        }
    }

    /// Sees an accepted state; `at_end` says that it is the last one. Collective.
    fn observe(&mut self, state: &State, at_end: bool) -> Result<(), PetscError> {
        let problem = self.problem;
        let end = problem.scene().time.map_or(1.0, |grid| grid.end);
        let part = |time: f64| (INSTANTS as f64 * time / end + 1e-9).floor();
        let due = match self.last {
            None => true,
            Some(before) => state.time > before && (at_end || part(state.time) > part(before)),
        };
        if !due {
            return Ok(());
        }
        self.last = Some(state.time);
        let body = &problem.body;
        let zeta = problem.zeta_at_points(&state.zeta);
        let recovered = RecoveredStrains::new(body, &state.u)?;
        let error = recovered.energy_error(&problem.elasticity, &zeta, &state.u);
        let squares = self.gathered(&error.squares);
        self.squares.iter_mut().zip(&squares).for_each(|(max, square)| *max = max.max(*square));
        self.end = (squares, error.error, error.energy);
        self.worst = self.worst.max(error.error);
        self.energy = self.energy.max(error.energy);
        self.displacement = self.displacement.max(body.nodes.partition.max_norm(&state.u));
        Ok(())
    }

    /// Makes triangles as small as the damage at the end asks for. Collective.
    fn limit_by_damage(&self, outcome: &Outcome, accuracy: f64, ratios: &mut [f64]) {
        let shares = self.gathered(&outcome.damage_indicators);
        let others = size_ratios(&shares, 2.0, INTERPOLATION * AIM * accuracy);
        ratios.iter_mut().zip(others).for_each(|(ratio, other)| *ratio = ratio.min(other));
    }

    /// Values of this rank's triangles for all triangles of the undivided mesh. Collective.
    fn gathered(&self, own: &[f64]) -> Vec<f64> {
        let body = &self.problem.body;
        let mut values = vec![0.0; self.squares.len()];
        for (&triangle, value) in body.global_triangles.iter().zip(own) {
            values[triangle] = *value;
        }
        body.nodes.partition.comm().sum(&mut values);
        values
    }

    /// The relative error at the worst time, and the shares m_T of its square.
    fn relative(&self) -> (f64, Vec<f64>) {
        if self.worst == 0.0 {
            return (0.0, vec![0.0; self.squares.len()]);
        }
        // What is left after unloading need not be exact.
        let (squares, error, energy) = &self.end;
        let energy = energy.max(UNLOADED * self.energy);
        let share = |(max, end): (&f64, &f64)| (max / self.energy).max(end / energy);
        let shares = self.squares.iter().zip(squares).map(share).collect();
        ((self.worst / self.energy).max(error / energy).sqrt(), shares)
    }
}

//! Meshes for an accuracy that is asked for, instead of a size.
//!
//! From a coarse mesh, runs with few time steps tell how the error of u is spread over the triangles,
//! m_T = max_t ‖ε* − ε(u(t))‖²_T / max_t ‖u(t)‖², at the end relative to the ‖u‖² there. On a triangle
//! whose size is multiplied by r the error falls like r^p, p the order of u, and 1/r² triangles take
//! its place: the least number of triangles for a given error Σ r_T^2p m_T has r_T ~ m_T^(−1/(2p+2)).
//! The same holds for the part of the damage's error that its P1 interpolation makes; the other part
//! comes from u. Triangles are bisected down to the smaller size, round after round, until both
//! estimates are small enough.

mod indicators;

use super::{DiscreteProblem, RunError, SetupError, unresolved::unresolved};
use crate::{
    mesh::{Mesh, MeshError, Order, Refinement, sorted, twice_area},
    petsc::{PetscError, Session},
    scene::{Scene, Stepping},
};
use indicators::{INSTANTS, Indicators};
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
/// A triangle's size is multiplied by no less than this in a round.
const LEAST_RATIO: f64 = 0.125;
/// A triangle at an edge on which a traction or a gap is not resolved becomes smaller by this.
const QUARTER: f64 = 0.25;
/// Triangles are bisected while they are larger than this many times their wanted area; see [`oversize`].
const OVERSIZE: f64 = 1.5;
/// A little less than 1: what equals the median up to rounding is bisected with it.
const TIES: f64 = 1.0 - 1e-9;
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
    let (mut scene, mut reached) = (scene.clone(), None);
    scene.time.iter_mut().for_each(|grid| grid.stepping = Stepping::Uniform { steps: INSTANTS });
    let refined = refined(session, scene, mesh, solver, accuracy, &mut |mesh| {
        seen(mesh);
        reached = Some(mesh.clone());
    });
    match (refined, reached) {
        (Err(error), Some(before)) => Ok(Adapted { short: Some(error.to_string()), ..before }),
        (refined, _) => refined,
    }
}

/// The same, of a scene with few steps, without an answer where a run fails.
fn refined(
    session: &Session,
    mut scene: Scene,
    mesh: Mesh,
    solver: &str,
    accuracy: f64,
    seen: &mut dyn FnMut(&Adapted),
) -> Result<Adapted, AdaptError> {
    let order = if scene.order == Order::Quadratic { 2.0 } else { 1.0 };
    let mut refinement = Refinement::start(mesh);
    let (mut stopped_before, mut close_before) = (None::<f64>, false);
    let mut rounds = 0;
    loop {
        rounds += 1;
        let mesh = &refinement.mesh;
        let triangles = mesh.triangles.len();
        let problem = DiscreteProblem::new(scene.clone(), mesh.clone())?.restrict(session)?;
        let (outcome, indicators) = Indicators::of_run(session, &problem, solver, triangles)
            .map_err(|source| AdaptError::Run { rounds, triangles, source })?;
        let stop = outcome.stopped.as_ref().map(|stop| stop.time);
        if stop.is_some() && choose_steps(&mut scene, accuracy) {
            continue;
        }
        let (error, shares) = indicators.relative();
        let damage_error = outcome.errors.damage_mesh;
        let stop_change = stopped_before.zip(stop).map(|(before, now)| (now - before).abs());
        let small = |(change, stop)| change <= ENOUGH * accuracy * stop;
        let close = stop_change.zip(stop).is_some_and(small);
        // Two meshes may agree by chance.
        let settled = stop.is_none() || (close && close_before);
        let exhausted = rounds >= ROUNDS || triangles > MOST_TRIANGLES;
        let adapted = Adapted {
            mesh: mesh.clone().in_morton_order(),
            unknowns: 2 * problem.body.nodes.partition.total(),
            rounds,
            error,
            damage_error,
            stop_change,
            short: exhausted.then(|| "no larger mesh and no further one is tried".to_owned()),
        };
        seen(&adapted);
        let largest = error.max(damage_error.unwrap_or(0.0));
        let displacement = outcome.last.record.displacement_max.max(indicators.displacement);
        let coarse = unresolved(&scene, mesh, accuracy, displacement);
        if exhausted || (largest <= ENOUGH * accuracy && settled && coarse.is_empty()) {
            return Ok(adapted);
        }
        let of_u = accuracy_of_u(accuracy, error, damage_error, settled);
        let mut ratios = size_ratios(&shares, order, AIM * of_u);
        if damage_error.is_some() {
            let shares = indicators.gathered(&outcome.damage_indicators);
            let others = size_ratios(&shares, 2.0, INTERPOLATION * AIM * accuracy);
            ratios.iter_mut().zip(others).for_each(|(ratio, other)| *ratio = ratio.min(other));
        }
        quarter(mesh, &coarse, &mut ratios);
        (stopped_before, close_before) = (stop, close);
        refinement = divided(refinement, &ratios)?;
    }
}

/// Where ζ_* is reached, by the body or by too long steps, the steps are chosen by their error from then on;
/// false if they are already.
fn choose_steps(scene: &mut Scene, accuracy: f64) -> bool {
    let Some(grid) = &mut scene.time else { return false };
    let uniform = matches!(grid.stepping, Stepping::Uniform { .. });
    grid.stepping = Stepping::Auto { tolerance: PILOT_TOLERANCE.min(2.0 * accuracy) };
    uniform
}

/// A damage, or a time, that is not exact enough asks for a u better than this one.
fn accuracy_of_u(accuracy: f64, error: f64, damage_error: Option<f64>, settled: bool) -> f64 {
    match damage_error {
        _ if !settled => accuracy.min(0.5 * error),
        Some(of_damage) if of_damage > ENOUGH * accuracy => {
            accuracy.min(error * accuracy / of_damage)
        }
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
    let (areas, oversize) = (areas(&refinement.mesh), oversize(ratios));
    let mut wanted: Vec<f64> =
        areas.iter().zip(ratios).map(|(a, r)| oversize * a * r * r).collect();
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

/// [`OVERSIZE`]; where that asks for no bisection, so little that of the triangles that are too large at all
/// the half with the larger errors is bisected: a mesh that is short of the accuracy must not stay.
fn oversize(ratios: &[f64]) -> f64 {
    let mut squares: Vec<f64> = ratios.iter().map(|r| r * r).filter(|&r| r < 1.0).collect();
    squares.sort_by(f64::total_cmp);
    match squares.first() {
        Some(least) if OVERSIZE * least >= 1.0 => TIES / squares[(squares.len() - 1) / 2],
        _ => OVERSIZE,
    }
}

/// |T| of each triangle, with straight sides, m².
fn areas(mesh: &Mesh) -> Vec<f64> {
    let corners = mesh.triangles.iter().map(|t| t.map(|node| mesh.nodes[node]));
    corners.map(|[a, b, c]| 0.5 * twice_area(a, b, c)).collect()
}

//! The measured errors of figures: the same few steps on the mesh bisected everywhere.
//!
//! This halves the size of all triangles, and an error of order p falls by 2^p. The figure F changes by
//! F(h/2) − F(h) = (1 − 2^−p) e(h). So its error e(h) is twice the change for p = 1, and at most 2½ times the
//! change for p ≥ 0.74. The change at one time may be zero by chance, so the bar of a figure is
//!
//! 2½ max(|ΔF(T)|, (mean over t of ΔF(t)²)^½).
//!
//! A figure that depends on u has at least the bar η²/10 of its scale, with η the relative error of u in the
//! energy norm: the relative error of the work of a constant load is η².

use super::{
    AdaptError,
    pilot::{INSTANTS, Pilot},
    sizes::areas,
};
use crate::{
    mesh::{Mesh, Order, Refinement},
    petsc::Session,
    problem::{Bar, Dimension, DiscreteProblem},
    scene::Scene,
};

/// Maximum of error over change, for figures of about first order or better.
const ERROR_OVER_CHANGE: f64 = 2.5;
/// Error over change of the damage in L². No signs cancel there, and adapted meshes reach second order.
const FIELD_ERROR_OVER_CHANGE: f64 = 4.0 / 3.0;

/// Triangles whose change is above this fraction of the largest are refined for a figure …
const GOOD_PART: f64 = 0.5;
/// … and no others, if they cause more than this fraction of the whole change.
const MOST: f64 = 0.5;

/// The fraction of the accuracy of a figure that the mesh may use; the time steps use the rest.
const SHARE: f64 = 0.97;

/// A measured error.
pub(super) struct MeasuredError {
    /// The name of the figure or norm.
    pub(super) name: String,
    pub(super) relative: f64,
    /// The fraction of the accuracy that it may use.
    share: f64,
}

impl MeasuredError {
    /// The error over the error that an accuracy allows.
    pub(super) fn excess(&self, accuracy: f64) -> f64 {
        self.relative / (self.share * accuracy)
    }
}

/// The errors of a run, from its changes when the mesh is bisected.
#[derive(Default)]
pub(super) struct Measurement {
    /// The error bars of the figures; empty if the run ends at ζ_*.
    pub(super) bars: Vec<Bar>,
    /// The error of ζ at the end over the damage, in L².
    pub(super) damage: f64,
    /// The relative error of u: the estimate on the bisected mesh at the worst time. Without damage, the error by
    /// the change of u at the end counts if it is larger.
    pub(super) displacement: f64,
    /// The error of ‖u‖² over its maximum value.
    pub(super) energy: f64,
    /// The relative error of the time of ζ_*; infinite if only one of the two runs reaches it.
    pub(super) stop: f64,
    /// Per triangle of the mesh: its share of the squared relative error of u, from the estimates on its parts, and
    /// the maximum penetration at their edges, m.
    pub(super) shares: Vec<f64>,
    pub(super) depths: Vec<f64>,
    /// Per triangle: the change of the reactions on its edges, N per metre of thickness, and max |Δζ| there.
    reactions: Vec<f64>,
    zeta: Vec<f64>,
}

impl Measurement {
    /// Compares the run `coarse` of `scene` on `mesh` with the same run on the bisected mesh. Collective.
    ///
    /// # Errors
    /// A triangle cannot be bisected, or the run on the bisected mesh fails.
    pub(super) fn new(
        session: &Session,
        scene: &Scene,
        mesh: &Mesh,
        coarse: &Pilot,
        solver: &str,
        rounds: usize,
    ) -> Result<Self, AdaptError> {
        let halved = Refinement::start(mesh.clone()).refine_everywhere()?;
        let triangles = halved.mesh.triangles.len();
        let problem =
            DiscreteProblem::new(scene.clone(), halved.mesh.clone())?.restrict(session)?;
        let fine = Pilot::run(session, &problem, solver, triangles, false);
        let fine = fine.map_err(|source| AdaptError::Run { rounds, triangles, source })?;
        let stop = match [coarse.stop(), fine.stop()] {
            [None, None] => 0.0,
            [Some(before), Some(now)] => ERROR_OVER_CHANGE * (now - before).abs() / now,
            _ => f64::INFINITY,
        };
        let (displacement, of_parts) = fine.relative();
        let displacement = displacement.max(change_of_u(coarse, &fine));
        // The squared error of order p on the whole triangle is 4^p times the sum on its parts.
        let growth = if scene.order == Order::Quadratic { 16.0 } else { 4.0 };
        let count = mesh.triangles.len();
        let (mut shares, mut depths) = (vec![0.0; count], vec![0.0_f64; count]);
        let parts = halved.parent_of_triangle.iter().zip(of_parts).zip(fine.depths());
        for ((&parent, share), depth) in parts {
            shares[parent] += growth * share;
            depths[parent] = depths[parent].max(*depth);
        }
        let [before, now] = [coarse, &fine].map(|run| run.energies());
        let energy = match now[1] {
            0.0 => 0.0,
            largest => ERROR_OVER_CHANGE * (now[0] - before[0]).abs() / largest,
        };
        let mut measured = Self { displacement, energy, stop, shares, depths, ..Self::default() };
        if coarse.stop().or(fine.stop()).is_none() {
            measured.bars = bars(coarse, &fine, coarse.relative().0.powi(2));
            (measured.damage, measured.zeta) = damage(mesh, &halved, coarse, &fine);
            measured.reactions = coarse.reactions().iter().map(|force| -force).collect();
            for (&parent, force) in halved.parent_of_triangle.iter().zip(fine.reactions()) {
                measured.reactions[parent] += force;
            }
        }
        Ok(measured)
    }

    /// The measured errors of the figures and norms in `names`, or of all: the figures, u, its energy, the damage
    /// and the time of ζ_*. The largest error over its share comes first.
    pub(super) fn errors(&self, names: &[String]) -> Vec<MeasuredError> {
        let norms = [
            ("damage", self.damage),
            ("displacement", self.displacement),
            ("energy", self.energy),
            ("stopped_at", self.stop),
        ];
        let norms = norms.map(|(name, error)| (name, error, 1.0));
        let figures = self.bars.iter().map(|bar| (bar.name.as_str(), bar.relative(), SHARE));
        let is_named = |name: &str| names.is_empty() || names.iter().any(|other| other == name);
        let errors = figures.chain(norms).filter(|(name, ..)| is_named(name));
        let mut errors: Vec<_> = errors
            .map(|(name, relative, share)| MeasuredError { name: name.to_owned(), relative, share })
            .collect();
        errors.sort_by(|a, b| (b.relative / b.share).total_cmp(&(a.relative / a.share)));
        errors
    }

    /// The maximum relative error of the figures of ζ; the time steps change these most.
    pub(super) fn of_zeta(&self) -> f64 {
        let bars = self.bars.iter().filter(|bar| bar.dimension == Dimension::Damage);
        bars.map(Bar::relative).fold(0.0, f64::max)
    }

    /// Per triangle: does it cause most of the change of the figure `name`? For min ζ and ζ at a point, ζ changes
    /// there by a large part of its maximum change. For forces and moments, the contact reactions do so, in few
    /// triangles. `None` if the whole mesh causes the change.
    pub(super) fn places(&self, name: &str) -> Option<Vec<bool>> {
        let bar = self.bars.iter().find(|bar| bar.name == name)?;
        let changes = match bar.dimension {
            Dimension::Damage if name != "zeta_mean" => &self.zeta,
            Dimension::Force | Dimension::Moment => &self.reactions,
            _ => return None,
        };
        let largest = changes.iter().fold(0.0_f64, |most, change| most.max(change.abs()));
        let here: Vec<bool> = changes.iter().map(|c| c.abs() > GOOD_PART * largest).collect();
        let marked = here.iter().filter(|&&here| here).count();
        let change: f64 = changes.iter().sum();
        let of_marked: f64 =
            changes.iter().zip(&here).filter(|(_, here)| **here).map(|(c, _)| c).sum();
        let few = marked <= here.len() / 4 && of_marked.abs() > MOST * change.abs();
        (largest > 0.0 && (bar.dimension == Dimension::Damage || few)).then_some(here)
    }
}

/// The relative error of u at the end, without damage, from the change of the potential energy J = ½‖u‖² − fᵀu.
///
/// The minima over nested spaces obey ½‖u_h − u_{h/2}‖² ≤ J(u_h) − J(u_{h/2}), with equality if no contact opens or
/// closes. For order 1, ‖u_h − u‖² is 4/3 of ‖u_h − u_{h/2}‖².
fn change_of_u(coarse: &Pilot, fine: &Pilot) -> f64 {
    if coarse.problem.damage().is_some() {
        return 0.0;
    }
    let [before, now] = [coarse, fine].map(|run| {
        let ([energy, largest], work) = (run.energies(), run.outcome.last.record.work);
        (0.5 * energy - work, largest)
    });
    let square = 2.0 * (before.0 - now.0).max(0.0) / now.1;
    if square > 0.0 { (4.0 / 3.0 * square).sqrt() } else { 0.0 }
}

/// The error bars of the figures on the mesh of `coarse`, with η² = `square`.
fn bars(coarse: &Pilot, fine: &Pilot, square: f64) -> Vec<Bar> {
    let end = coarse.outcome.last.state.time;
    let times: Vec<f64> = (0..=INSTANTS).map(|i| end * i as f64 / INSTANTS as f64).collect();
    let changes: Vec<Vec<f64>> = (times.iter())
        .map(|&time| {
            let pair = coarse.figures_at(time).into_iter().zip(fine.figures_at(time));
            pair.map(|(before, now)| now - before).collect()
        })
        .collect();
    let error = |i: usize| {
        let squares: f64 = changes.iter().map(|change| change[i] * change[i]).sum();
        let change = (squares / changes.len() as f64).sqrt().max(changes[INSTANTS][i].abs());
        ERROR_OVER_CHANGE * change
    };
    let scales = fine.scales();
    let errors: Vec<f64> = (0..scales.len()).map(error).collect();
    let mut bars = coarse.problem.bars(&errors, &scales);
    let of_u = |bar: &&mut Bar| {
        matches!(bar.dimension, Dimension::Work | Dimension::Length | Dimension::Stress)
    };
    bars.iter_mut().filter(of_u).for_each(|bar| bar.bar = bar.bar.max(0.1 * square * bar.scale));
    bars
}

/// The final error ‖ζ_h − ζ_{h/2}‖ / ‖1 − ζ_{h/2}‖, and max |ζ_h − ζ_{h/2}| per triangle. Collective.
fn damage(mesh: &Mesh, halved: &Refinement, coarse: &Pilot, fine: &Pilot) -> (f64, Vec<f64>) {
    let mut before = at_vertices(mesh, &coarse.zeta());
    let middles = halved.halved_edges.iter().map(|&[a, b]| 0.5 * (before[a] + before[b]));
    before.extend(middles.collect::<Vec<f64>>());
    let mut changes = vec![0.0_f64; mesh.triangles.len()];
    let mesh = &halved.mesh;
    let now = at_vertices(mesh, &fine.zeta());
    let mut sums = [0.0; 2];
    let parts = mesh.triangles.iter().zip(&halved.parent_of_triangle).zip(areas(mesh));
    for ((nodes, &parent), area) in parts {
        for &node in nodes {
            let change = now[node] - before[node];
            sums[0] += area * change * change;
            sums[1] += area * (1.0 - now[node]).powi(2);
            changes[parent] = changes[parent].max(change.abs());
        }
    }
    let relative = if sums[0] > 0.0 { (sums[0] / sums[1]).sqrt() } else { 0.0 };
    (FIELD_ERROR_OVER_CHANGE * relative, changes)
}

/// A field at the vertices of `mesh`, from its values on the triangles.
fn at_vertices(mesh: &Mesh, of_triangles: &[Vec<f64>; 3]) -> Vec<f64> {
    let mut values = vec![0.0; mesh.nodes.len()];
    for (t, nodes) in mesh.triangles.iter().enumerate() {
        nodes.iter().zip(of_triangles).for_each(|(&node, of)| values[node] = of[t]);
    }
    values
}

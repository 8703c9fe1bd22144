//! The measured errors of figures: the same few steps on the mesh bisected everywhere, and more often at points.
//!
//! This halves the size of all triangles, and an error of order p falls by 2^p. The figure F changes by
//! F(h/2) − F(h) = (1 − 2^−p) e(h). So its error e(h) is twice the change for p = 1, and at most c times the
//! change, with c = 2½ for p ≥ 0.74 in P2 and c = 4 for p ≥ 0.41 in P1. Both runs take
//! the same time steps, so that these cause no change. The change at one time may be zero by chance, so the bar of a figure is
//!
//! c max(|ΔF(T)|, (mean over t of ΔF(t)²)^½).
//!
//! Extremes and probes may lie at singular points, where p is small. There the triangles become h/16: for p ≥ 0.2 the
//! error is again at most 2½ times the change. The length of contact is known up to half of the edge at each end.
//!
//! A figure that depends on u has at least the bar η²/10 of its scale, with η the relative error of u in the
//! energy norm: the relative error of the work of a constant load is η².

use super::{
    AdaptError, Measured,
    changes::{bars, change_of_u, damage},
    few_step_run::{FEW, FewStepRun},
    finer::{Finer, size_at},
};
use crate::{
    evolution::AIM,
    mesh::{Mesh, Order},
    petsc::Session,
    problem::{Bar, Dimension, DiscreteProblem},
    scene::Scene,
};
use std::collections::BTreeSet;

/// Maximum of error over change, for P1 and P2. On six bodies that are not shipped, with half of it six bars fail;
/// with twice meshes have twice as many triangles.
const ERROR_OVER_CHANGE: [f64; 2] = [4.0, 2.5];
/// Triangles at points are h/2^this. With half of them some meshes have a quarter fewer
/// triangles; twice of them change few meshes.
const LEVELS: usize = 4;

/// The fraction of the accuracy of a figure that the mesh may use; the time steps use the rest. Half of it
/// makes about twice as many triangles; with twice, accuracies are missed.
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

/// The cause of an error.
pub(super) enum Cause {
    /// The triangles at the ends of contact.
    Ends,
    /// Triangles in which ζ changes: the maximum change in each triangle.
    Change(Vec<f64>),
    /// The triangles at the ends of contact and at singular points.
    Reactions,
    /// The errors of u, of which near ones count more: the figure is u at this point (0) or follows from its derivatives (1).
    Around([f64; 2], i32),
    /// The errors of u and ζ everywhere, to this power.
    Fields(f64),
}

impl Cause {
    /// The errors of figures are products of two errors of fields.
    pub(super) const FIGURE: Self = Self::Fields(0.5);
}

/// The errors of a run, from its changes when the mesh is bisected.
#[derive(Default)]
pub(super) struct Measurement {
    /// The error bars of the figures; empty if the run ends at ζ_*.
    pub(super) bars: Vec<Bar>,
    /// The extremes that grow as the mesh is refined. They have no bars.
    pub(super) grows: Vec<String>,
    /// The error of ζ at the end over the damage, in L².
    pub(super) damage: f64,
    /// The relative error of u: the estimate on the bisected mesh at the worst time. Without damage, the error by
    /// the change of u at the end counts if it is larger.
    pub(super) displacement: f64,
    /// The error of ‖u‖² over its maximum value.
    pub(super) energy: f64,
    /// The error of the time of ζ_*, s, and this time; the error is infinite if only one of the two runs reaches it.
    pub(super) stop: Option<[f64; 2]>,
    /// Per triangle of the mesh: its share of the squared relative error of u, from the estimates on its parts, and
    /// the maximum penetration at their edges, m.
    pub(super) shares: Vec<f64>,
    pub(super) depths: Vec<f64>,
    /// Per triangle: max |Δζ|; empty without damage.
    zeta: Vec<f64>,
    /// The names of the extremes.
    extremes: Vec<String>,
    /// The names of figures at points, or of probes, with these points, m.
    places: Vec<(String, [f64; 2])>,
}

impl Measurement {
    /// Compares the run `coarse` of `scene` on `mesh` with the same run on the finer mesh. Collective.
    ///
    /// # Errors
    /// A triangle cannot be bisected, or the run on the finer mesh fails.
    pub(super) fn new(
        session: &Session,
        scene: &Scene,
        mesh: &Mesh,
        coarse: &FewStepRun,
        solver: &str,
        rounds: usize,
    ) -> Result<Self, AdaptError> {
        let points = coarse.points();
        let finer = Finer::new(mesh, &points, LEVELS)?;
        let triangles = finer.mesh.triangles.len();
        let problem = DiscreteProblem::new(scene.clone(), finer.mesh.clone())?.restrict(session)?;
        let times = coarse.times();
        let fine = FewStepRun::run(session, &problem, solver, triangles, FEW, &times);
        let fine = fine.map_err(|source| AdaptError::Run { rounds, triangles, source })?;
        let order = scene.order as usize;
        let stop = match [coarse.stop(), fine.stop()] {
            [None, None] => None,
            [Some(before), Some(now)] => {
                Some([ERROR_OVER_CHANGE[order] * (now - before).abs(), now])
            }
            [time, other] => time.or(other).map(|time| [f64::INFINITY, time]),
        };
        let (displacement, of_parts) = fine.relative();
        let displacement = displacement.max(change_of_u(coarse, &fine));
        // The squared error of order p on the whole triangle is 4^p times the sum on its parts.
        let growth = if scene.order == Order::Quadratic { 16.0 } else { 4.0 };
        let count = mesh.triangles.len();
        let (mut shares, mut depths) = (vec![0.0; count], vec![0.0_f64; count]);
        let parts = finer.parents.iter().zip(of_parts).zip(fine.depths());
        for ((&parent, share), depth) in parts {
            shares[parent] += growth * share;
            depths[parent] = depths[parent].max(*depth);
        }
        let mut measured = Self { displacement, stop, shares, depths, ..Self::default() };
        if stop.is_none() {
            measured.compare(mesh, &finer, coarse, &fine);
        }
        Ok(measured)
    }

    /// Compares the figures of runs that do not reach ζ_*. Collective.
    fn compare(&mut self, mesh: &Mesh, finer: &Finer, coarse: &FewStepRun, fine: &FewStepRun) {
        let scene = coarse.problem.scene();
        let factor = ERROR_OVER_CHANGE[scene.order as usize];
        let [before, now] = [coarse, fine].map(|run| run.energies());
        self.energy = match now[1] {
            0.0 => 0.0,
            largest => factor * (now[0] - before[0]).abs() / largest,
        };
        if coarse.problem.damage().is_some() {
            (self.damage, self.zeta) = damage(mesh, finer, coarse, fine);
        }
        let extremes = fine.extremes();
        let named = extremes.named(&coarse.problem.singular_points());
        let probes = scene.probes.iter().map(|probe| (probe.name.clone(), probe.point));
        let of_extremes = named.iter().map(|extreme| (extreme.name.clone(), extreme.at));
        // A material may have the name of a probe.
        self.places = of_extremes.chain(probes).collect();
        self.extremes = coarse.problem.extremes();
        let grows = named.iter().zip(extremes.grow(|at| size_at(mesh, at)));
        let grows = grows.filter(|(extreme, grows)| *grows || extreme.singular.is_some());
        self.grows = grows.map(|(extreme, _)| extreme.name.clone()).collect();
        self.bars = bars(coarse, fine, factor, &self.grows);
    }

    /// The names of the extremes.
    pub(super) fn extremes(&self) -> &[String] {
        &self.extremes
    }

    /// Leaves out these figures, whose errors stay while the mesh becomes finer.
    pub(super) fn leave_out(&mut self, names: &BTreeSet<String>) {
        self.bars.retain(|bar| !names.contains(&bar.name));
        self.grows.extend(names.iter().cloned());
    }

    /// Why a figure in `names` has no accuracy, if one grows as the mesh is refined.
    pub(super) fn grown(&self, names: &[String]) -> Option<String> {
        let name = names.iter().find(|name| self.grows.contains(name))?;
        Some(format!("{name} is singular: it grows as the mesh is refined; ask for other figures"))
    }

    /// The errors of a run on the mesh.
    pub(super) fn result(&self) -> Measured {
        let stop = self.stop.map(|[error, _]| error).filter(|error| error.is_finite());
        let damage = (!self.zeta.is_empty()).then_some(self.damage);
        Measured { bars: self.bars.clone(), grows: self.grows.clone(), stop, damage }
    }

    /// The measured errors of the figures and norms in `names`, or of all: the figures, u, its energy, the damage
    /// and the time of ζ_*. The largest error over its share comes first.
    pub(super) fn errors(&self, names: &[String]) -> Vec<MeasuredError> {
        let norms = [
            ("damage", self.damage, 1.0),
            ("displacement", self.displacement, 1.0),
            ("energy", self.energy, 1.0),
            ("stopped_at", self.stop.map_or(0.0, |[error, time]| error / time), AIM),
        ];
        let figures = self.bars.iter().map(|bar| (bar.name.as_str(), bar.relative(), SHARE));
        let is_named = |name: &str| names.is_empty() || names.iter().any(|other| other == name);
        let errors = figures.chain(norms).filter(|(name, ..)| is_named(name));
        let mut errors: Vec<_> = errors
            .map(|(name, relative, share)| MeasuredError { name: name.to_owned(), relative, share })
            .collect();
        errors.sort_by(|a, b| (b.relative / b.share).total_cmp(&(a.relative / a.share)));
        errors
    }

    /// The part of `accuracy` that the mesh leaves to the time steps. These change the figures of ζ most.
    pub(super) fn left_to_steps(&self, accuracy: f64) -> f64 {
        let bars = self.bars.iter().filter(|bar| bar.dimension == Dimension::Damage);
        accuracy - bars.map(Bar::relative).fold(0.0, f64::max).min(SHARE * accuracy)
    }

    /// The cause of the error of the figure `name`.
    pub(super) fn cause(&self, name: &str) -> Cause {
        let Some(bar) = self.bars.iter().find(|bar| bar.name == name) else {
            return Cause::Fields(1.0);
        };
        let is_here = |(place, _): &&(String, _)| {
            name.strip_prefix(place).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        match (bar.dimension, self.places.iter().find(is_here)) {
            (Dimension::ContactLength, _) => Cause::Ends,
            (Dimension::Damage, _) if name != "zeta_mean" => Cause::Change(self.zeta.clone()),
            (Dimension::Force | Dimension::Moment, _) => Cause::Reactions,
            (Dimension::Length, Some((_, at))) => Cause::Around(*at, 0),
            (_, Some((_, at))) => Cause::Around(*at, 1),
            _ => Cause::FIGURE,
        }
    }
}

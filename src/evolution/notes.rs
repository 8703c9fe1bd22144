//! Notes for the user on the answer of a run, beyond its residuals.

use super::{Accuracy, DiscreteProblem, Outcome, percent};
use crate::{
    fem::{Body, for_elements},
    mesh::{distance, extent},
    scene::{Stepping, rounded},
};

/// Infinitesimal strain theory requires |∇u| ≪ 1. At `LARGE` the neglected term ½ ∇uᵀ∇u of the strain is up to a
/// twentieth of ∇u. A part of the body below `NOTICEABLE` may be a corner with singular strains.
const LARGE: f64 = 0.1;
const NOTICEABLE: f64 = 0.01;

/// A body that moves by less than this part of its size is noted. Loads that matter strain it by 1e-6 or more; E in Pa beside
/// lengths in mm and forces in N divides all displacements by 1e6.
const HARDLY: f64 = 1e-8;

impl Outcome {
    /// Notes for the user on the run of `problem`. Collective.
    pub fn notes(&self, problem: &DiscreteProblem) -> Vec<String> {
        let least = self.stopped.map(|stop| stop.least_admissible);
        let early = least.filter(|least| *least > problem.threshold());
        let usual =
            "a slender body, stretched triangles, nearly incompressible or almost broken material";
        let contrast = problem.contrast();
        let (worst, cause) = (self.kkt.worst(), contrast.as_deref().unwrap_or(usual));
        // With an unconstrained motion the answer is not unique, and another note says so.
        let unique = self.unconstrained.is_none();
        let displacement = if unique { self.accuracy.displacement } else { 0.0 };
        let accuracy = Accuracy { displacement, ..self.accuracy };
        let of_residuals = [
            early.map(|least| {
                format!(
                    "the run stopped too early: the damage law allows no ζ below {least:.4} up to this time; set damage.mass = \
                     \"lumped\" (explain stop)"
                )
            }),
            self.may_stop.map(|time| {
                format!(
                    "the time steps are too long to exclude that ζ reached ζ_* at t = {}, so that the errors of the figures \
                     are unknown; set a smaller time.step or time.tolerance (explain stop)",
                    rounded(time)
                )
            }),
            self.bound_violation
                .note(problem.mass(), slowest_diffusion(&problem.body, &problem.diffusions())),
            self.unconstrained.as_ref().map(|(steps, times, motion)| {
                let [first, last] = times.map(rounded);
                // Nodes that touch without force may still block the motion.
                format!(
                    "no contact force acts against {motion} in {} (t = {first} to {last}): the answer may be one of many; \
                     support this motion (explain collapse)",
                    counted(*steps)
                )
            }),
            (worst > problem.tolerance).then(|| {
                format!(
                    "the KKT residuals are up to {worst:.1e}, above contact.tolerance: rounding allows no less here \
                     ({cause}) (explain solvers)"
                )
            }),
            self.penetration.clone(),
        ];
        let [moved, most] =
            [&self.last, self.most_displaced()].map(|step| step.record.displacement_max);
        let size = extent(&problem.mesh().nodes);
        let has_gaps = problem.scene().boundaries.iter().any(|boundary| boundary.gap().is_some());
        let of_model = [
            // A stop in the first step has no state that moves.
            (most == 0.0 && has_gaps && self.stopped.is_none()).then(|| {
                "nothing moves: no load acts and no foundation presses; check their signs \
                 (explain large-rotation)"
                    .to_owned()
            }),
            (0.0 < most && most < HARDLY * size).then(|| {
                let part = most / size;
                format!(
                    "the largest displacement is only {part:.0e} of the body's size: is E in the unit of the stresses \
                     (N/mm² with mm and N)? (explain large-rotation)"
                )
            }),
            (moved > size).then(|| {
                let times = moved / size;
                format!(
                    "the largest displacement is {times:.1} times the body, NOT an answer for a real one; check units, \
                     gaps and loads (explain large-rotation)"
                )
            }),
            large_gradients(&problem.body, &self.last.state.u),
            self.rescued.as_ref().map(|(steps, solver)| {
                let steps = counted(*steps);
                format!(
                    "in {steps} the contact solver missed its tolerance, and {solver} gave the answer (explain solvers)"
                )
            }),
            self.missed_tolerance(problem),
        ];
        // Wrong units cause the other problems, too.
        let notes = of_model.into_iter().chain(of_residuals).flatten();
        notes.chain(accuracy.notes(problem.tolerance)).collect()
    }

    /// Remarks on how the run of `problem` went; none is a warning.
    pub fn remarks(&self, problem: &DiscreteProblem) -> Vec<String> {
        let (skipped, steps) = (self.skipped_damage_solves, self.last.record.step);
        let remarks = [
            (skipped > 0 && problem.damage().is_some()).then(|| {
                format!("ζ was not solved for in {skipped} of {steps} steps: it was uniform and did not change there")
            }),
            (self.rejected > 0)
                .then(|| format!("{} steps were rejected and repeated, shorter", self.rejected)),
        ];
        remarks.into_iter().flatten().collect()
    }

    /// A note on adaptive steps whose error is above the tolerance. At a stop the damage grows without bound, and the error of the
    /// time of ζ_* counts alone. If an accuracy is required, the program has set the tolerance itself.
    fn missed_tolerance(&self, problem: &DiscreteProblem) -> Option<String> {
        let scene = problem.scene();
        let Stepping::Auto { tolerance, .. } = scene.time?.stepping else { return None };
        let counts =
            problem.damage().is_some() && self.stopped.is_none() && scene.accuracy.is_none();
        let error =
            self.damage_error.filter(|error| counts && (*error > tolerance || error.is_nan()))?;
        Some(format!(
            "the time steps cause an error of the damage of about {}, above time.tolerance = {tolerance}; set a lower one \
             (explain accuracy)",
            percent(error)
        ))
    }
}

/// min κ/h² over the triangles, 1/s, with h the longest side. Collective.
fn slowest_diffusion(body: &Body, kappa: &[f64]) -> f64 {
    let rate = |(t, corners): (usize, &[usize; 3])| {
        let [a, b, c] = corners.map(|node| body.mesh.nodes[node]);
        let h = distance(a, b).max(distance(b, c)).max(distance(c, a));
        kappa.get(body.material(t)).map_or(f64::INFINITY, |kappa| kappa / (h * h))
    };
    let own = body.mesh.triangles.iter().enumerate().map(rate).fold(f64::INFINITY, f64::min);
    body.comm().min(own)
}

/// A note if u is too large for infinitesimal strains: |∇u| (Frobenius) above `LARGE` in a noticeable part of
/// the body. A translation does not count.
fn large_gradients(body: &Body, u: &[f64]) -> Option<String> {
    let gradients = for_elements!(body, cells => cells.gradients(u));
    let own = gradients.iter().zip(&body.triangles).take(body.own_triangles);
    let large = own.filter(|(gradient, _)| gradient.norm() > LARGE).map(|(_, t)| t.area()).sum();
    let part = body.comm().total(large) / body.area;
    (part > NOTICEABLE).then(|| {
        format!(
            "|∇u| exceeds {LARGE} in {:.0} % of the body: strains or rotations are too large \
             for linear elasticity; check the units of loads and moduli (explain large-rotation)",
            100.0 * part
        )
    })
}

/// "1 step" or "n steps".
fn counted(steps: usize) -> String {
    format!("{steps} step{}", if steps == 1 { "" } else { "s" })
}

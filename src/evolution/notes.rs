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
                    "ζ_* was reached too early or wrongly: the sources allow no ζ below {least:.4}"
                )
            }),
            self.may_stop.map(|time| {
                format!(
                    "the time steps are too long: within their error, ζ_* may have been reached at t = {}, and the error of \
                     the figures is unknown; set a smaller time.step or time.tolerance",
                    rounded(time)
                )
            }),
            self.bound_violation
                .note(problem.mass(), slowest_diffusion(&problem.body, &problem.diffusions())),
            self.unconstrained.as_ref().map(|(steps, times, motion)| {
                let [first, last] = times.map(rounded);
                let when = match steps {
                    1 => format!("at t = {first}"),
                    steps => format!("in {steps} steps, at t = {first} first and t = {last} last"),
                };
                // Nodes that touch without force may still block the motion.
                let problem = "no active contact node supports the body against";
                format!("{when}, {problem} {motion}: the answer may be one of many")
            }),
            (worst > problem.tolerance).then(|| {
                format!(
                    "KKT residuals up to {worst:.1e} are all that double precision allows ({cause})"
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
                "nothing moves: no load acts and no foundation presses; check their signs".to_owned()
            }),
            (0.0 < most && most < HARDLY * size).then(|| {
                let part = most / size;
                format!(
                    "the largest displacement is only {part:.0e} of the body's size: is E in the unit of the stresses \
                     (N/mm² with mm and N)?"
                )
            }),
            (moved > size).then(|| {
                let times = moved / size;
                format!("the largest displacement is {times:.1} times the body; check units, gaps and loads")
            }),
            large_gradients(&problem.body, &self.last.state.u),
            self.rescued.as_ref().map(|(steps, solver)| {
                let steps = counted(*steps);
                format!("in {steps} the solver missed the tolerance and {solver} gave the answer")
            }),
            self.adaptive_steps_note(problem, true),
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
                format!("the damage solve was skipped in {skipped} of {steps} steps: no source, uniform ζ")
            }),
            (self.rejected > 0)
                .then(|| format!("{} steps were rejected and tried again, shorter", self.rejected)),
            self.adaptive_steps_note(problem, false),
        ];
        remarks.into_iter().flatten().collect()
    }

    /// A note on the adaptive steps, if their time error `misses` the tolerance or if it does not. At a stop the damage
    /// grows without bound, and the error of the time of ζ_* counts alone.
    fn adaptive_steps_note(&self, problem: &DiscreteProblem, misses: bool) -> Option<String> {
        let error =
            self.damage_error.filter(|_| problem.damage().is_some() && self.stopped.is_none())?;
        let Stepping::Auto { tolerance, .. } = problem.scene().time?.stepping else { return None };
        // If an accuracy is required, the program has set the tolerance itself.
        let missed = (error > tolerance || error.is_nan()) && problem.scene().accuracy.is_none();
        let advice = match missed {
            true => format!(", more than time.tolerance = {tolerance}: lower it"),
            false => String::new(),
        };
        (missed == misses).then(|| {
            format!(
                "{} steps chosen: the time error of the damage is about {} of it{advice}",
                self.last.record.step,
                percent(error)
            )
        })
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
             for linear elasticity; if that is not meant, check the units of loads and moduli",
            100.0 * part
        )
    })
}

/// "1 step" or "n steps".
fn counted(steps: usize) -> String {
    format!("{steps} step{}", if steps == 1 { "" } else { "s" })
}

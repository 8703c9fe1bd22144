//! What the user should know about a problem or an answer that its residuals do not tell.

use super::{Accuracy, DiscreteProblem, Outcome, loads::LoadCurve};
use crate::{
    estimate::unresolved_notes,
    fem::for_elements,
    mesh::Order,
    model::Plane,
    scene::{Stepping, rounded},
};
use std::iter::once;

/// In plane strain with ν above this, P1 triangles lock: measured in the stability study. P2 triangles
/// converge more slowly as ν goes to ½, but do not lock (measured up to 0.4999).
const LOCKING: f64 = 0.45;
/// Materials with moduli further apart than this factor are noted: the rounding of the stiffer one is then
/// 1e-11 of the forces in the other, a tenth of the usual tolerance.
const CONTRAST: f64 = 1e5;
/// Times at which surface loads are looked at, about.
const LOOKS: usize = 8;
/// Triangles with a smaller angle are noted, degrees.
const SLIVER: f64 = 1.0;
/// Infinitesimal strain theory supposes |∇u| ≪ 1. At `LARGE` the term ½ ∇uᵀ∇u of the strain, which
/// it leaves out, is up to a twentieth of ∇u. A smaller part of the body than `NOTICEABLE` may be
/// a corner where the strain is singular, in every load.
const LARGE: f64 = 0.1;
const NOTICEABLE: f64 = 0.01;

impl Outcome {
    /// What the user should know about the run of `problem`.
    pub fn notes(&self, problem: &DiscreteProblem) -> Vec<String> {
        let mut notes = Vec::new();
        let early = |level: &f64| *level > problem.threshold();
        if let Some(least) = self.stopped.map(|stop| stop.least_admissible).filter(early) {
            notes.push(format!(
                "ζ_* was reached too early, or should not be reached at all: the sources up to \
                 there allow no ζ below {least:.4}"
            ));
        }
        let slowest = problem.slowest_diffusion();
        notes.extend(self.bound_violation.note(problem.mass(), slowest));
        if let Some((steps, times, motion)) = &self.unconstrained {
            let [first, last] = times.map(rounded);
            let when = match steps {
                1 => format!("at t = {first}"),
                steps => format!("in {steps} steps, at t = {first} first and t = {last} last"),
            };
            // Nodes that touch without force may still be in the way.
            notes.push(format!(
                "{when}, no active contact node supports the body against {motion}: the answer may \
                 be one of many"
            ));
        }
        // That an unconstrained body has no one answer is said already.
        let unique = self.unconstrained.is_none();
        let displacement = if unique { self.accuracy.displacement } else { 0.0 };
        let accuracy = Accuracy { displacement, ..self.accuracy };
        if self.kkt.worst() > problem.tolerance {
            let usual = "a body much longer than wide, stretched triangles, nearly incompressible or \
                         almost broken material";
            notes.push(format!(
                "KKT residuals up to {:.1e}, above contact.tolerance, are all that double precision allows \
                 here ({})",
                self.kkt.worst(),
                problem.contrast().as_deref().unwrap_or(usual)
            ));
        }
        notes.extend(self.penetration.clone());
        notes.extend(accuracy.notes(problem.tolerance));
        notes.extend(problem.large_gradients(&self.last.state.u));
        if let Some((steps, solver)) = &self.rescued {
            notes.push(format!(
                "in {} the contact solver stopped short of the tolerance, and {solver} gave the \
                 answer in its place",
                counted(*steps)
            ));
        }
        notes.extend(self.chosen_steps(problem, true));
        notes
    }

    /// What the run of `problem` did on its way; its answer is none the worse for it.
    pub fn remarks(&self, problem: &DiscreteProblem) -> Vec<String> {
        let mut notes = Vec::new();
        if self.skipped_damage_solves > 0 && problem.damage().is_some() {
            notes.push(format!(
                "the damage solve was skipped in {} of {} steps: no source, uniform ζ",
                self.skipped_damage_solves, self.last.record.step
            ));
        }
        if self.fallbacks > 0 {
            let steps = counted(self.fallbacks);
            notes.push(format!("in {steps} the contact solver left its fast path"));
        }
        if self.undone > 0 {
            notes.push(format!("{} steps were undone and tried again, shorter", self.undone));
        }
        notes.extend(self.chosen_steps(problem, false));
        notes
    }

    /// How many steps were chosen, and how exact the damage is for it, if that `misses` the tolerance,
    /// or if it does not.
    fn chosen_steps(&self, problem: &DiscreteProblem, misses: bool) -> Option<String> {
        let error = self.damage_error.filter(|_| problem.damage().is_some())?;
        let Stepping::Auto { tolerance, .. } = problem.scene().time?.stepping else { return None };
        // Where an accuracy is asked for, the tolerance is not the user's.
        let missed = error > tolerance && problem.scene().accuracy.is_none();
        let verdict = match missed {
            true => format!(", more than time.tolerance = {tolerance}: lower it"),
            false => String::new(),
        };
        // Two decimals, or three digits where these would say too little.
        let percent = match 100.0 * error {
            percent if percent > 0.0 && percent < 0.1 => format!("{percent:.2e} %"),
            percent => format!("{percent:.2} %"),
        };
        (missed == misses).then(|| {
            format!(
                "{} steps chosen: the damage is exact in time to about {percent} of the damage \
                 done (two or three times that where the load swings or jumps){verdict}",
                self.last.record.step
            )
        })
    }
}

impl DiscreteProblem {
    /// What the user should know before any solve: what was not taken as it is written, unconstrained
    /// rigid motions, and functions, a material or triangles that make the discretisation poor.
    pub fn notes(&self) -> Vec<String> {
        let (scene, motions) = (self.scene(), &self.motions);
        let mut notes = scene.notes.clone();
        notes.extend(motions.free.iter().map(|motion| {
            format!(
                "nothing prevents or drives {motion}: of all answers the one of least ∫|u|² is given"
            )
        }));
        let check_units = |contrast| format!("{contrast}; if that is not meant, check their units");
        notes.extend(self.contrast().map(check_units));
        notes.extend(unresolved_notes(scene, self.mesh()));
        notes.extend(self.loads.notes(&scene.sample_times(LOOKS)));
        if let Some([start, end]) = LoadCurve::unresolved_step(self) {
            notes.push(format!(
                "loads, displacements or gaps change within a time step, as between t = {start:.4e} and \
                 {end:.4e}: what happens there counts only at its ends; shorten time.step, or set it to \
                 \"auto\""
            ));
        }
        if scene.damage.is_some() && scene.time.is_none() {
            let note = "[damage] without [time]: in this static solve ζ stays damage.initial";
            notes.push(note.to_owned());
        }
        let poisson = scene.materials().map(|material| material.poisson).fold(-1.0, f64::max);
        let linear = scene.order == Order::Linear;
        if linear && scene.material.plane == Plane::Strain && poisson > LOCKING {
            notes.push(format!(
                "nearly incompressible (plane strain, ν = {poisson} > {LOCKING}): linear triangles \
                 lock, displacements may be far too small; compare with a mesh half as fine, or \
                 take discretisation.displacement = 2"
            ));
        }
        if linear && self.body.nodes.partition.comm().any(!self.body.mesh.curved.is_empty()) {
            let note = "the mesh's curved sides count as straight: discretisation.displacement = 2 would \
                        follow them";
            notes.push(note.to_owned());
        }
        notes.extend(self.sliver());
        notes
    }

    /// By what factor the moduli of the softest and of the stiffest material of the body differ, if it is
    /// large.
    pub(super) fn contrast(&self) -> Option<String> {
        let (scene, used) = (self.scene(), self.scene().materials_of(self.mesh()));
        let names = once("[material]".to_owned())
            .chain(scene.surfaces.keys().map(|name| format!("[material.{name}]")));
        let materials = scene.materials().map(|material| material.young).zip(names).zip(0..);
        let mut materials: Vec<_> =
            materials.filter(|(_, number)| used.contains(number)).map(|(of, _)| of).collect();
        materials.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let [(low, soft), .., (high, stiff)] = &materials[..] else { return None };
        let unit = &scene.units.stress;
        (high / low > CONTRAST).then(|| {
            format!(
                "E differs by a factor of {:.0e} between two materials: {high:e} {unit} in {stiff}, \
                 {low:e} {unit} in {soft}",
                high / low
            )
        })
    }

    /// The least κ/h² of the body, 1/s, with h the longest side of a triangle. Collective.
    fn slowest_diffusion(&self) -> f64 {
        let (body, kappa) = (&self.body, self.diffusions());
        let rate = |(t, corners): (usize, &[usize; 3])| {
            let [a, b, c] = corners.map(|node| body.mesh.nodes[node]);
            let side = |[x, y]: [f64; 2], [v, w]: [f64; 2]| (x - v).hypot(y - w);
            let h = side(a, b).max(side(b, c)).max(side(c, a));
            kappa.get(body.material(t)).map_or(f64::INFINITY, |kappa| kappa / (h * h))
        };
        let own = body.mesh.triangles.iter().enumerate().map(rate).fold(f64::INFINITY, f64::min);
        body.nodes.partition.comm().min(own)
    }

    /// Whether u is too large for infinitesimal strains and rotations: |∇u| (Frobenius) above
    /// `LARGE` in a noticeable part of the body. A translation, however far, is not.
    fn large_gradients(&self, u: &[f64]) -> Option<String> {
        let body = &self.body;
        let gradients = for_elements!(body, cells => cells.gradients(u));
        let own = gradients.iter().zip(&body.triangles).take(body.own_triangles);
        let large =
            own.filter(|(gradient, _)| gradient.norm() > LARGE).map(|(_, t)| t.area()).sum();
        let part = body.nodes.partition.comm().total(large) / body.area;
        (part > NOTICEABLE).then(|| {
            format!(
                "|∇u| exceeds {LARGE} in {:.0} % of the body: strains or rotations are not small, \
                 and linear elasticity, which supposes they are, is a poor model of this load",
                100.0 * part
            )
        })
    }

    /// The triangle with the smallest angle, if that is small.
    fn sliver(&self) -> Option<String> {
        let (least, at) = self.body.mesh.smallest_angle();
        let comm = self.body.nodes.partition.comm();
        let (angle, rank) = comm.min_with_rank(least);
        let [x, y] = at.map(|coordinate| comm.broadcast(rank, coordinate));
        (angle < SLIVER).then(|| {
            format!(
                "a triangle at ({x:.4}, {y:.4}) has an angle of {angle:.1e}°: round-off grows as \
                 angles shrink; mend the mesh there if that is not meant"
            )
        })
    }
}

/// So many steps, in words.
fn counted(steps: usize) -> String {
    format!("{steps} step{}", if steps == 1 { "" } else { "s" })
}

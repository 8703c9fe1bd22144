//! What the user should know about an answer that its residuals do not tell.

use super::{DiscreteProblem, Outcome};
use crate::{contact::RigidMotion, model::Plane, scene::Stepping};

/// In plane strain with ν above this, P1 triangles lock: measured in the atlas of failure.
const LOCKING: f64 = 0.45;
/// Triangles with a smaller angle are told, degrees.
const SLIVER: f64 = 1.0;
/// So many free motions are told one by one.
const TOLD: usize = 6;
/// Displacements are promised to this, relative, or to `TOLERANCES` times the KKT tolerance.
const DISPLACEMENT: f64 = 1e-6;
const TOLERANCES: f64 = 100.0;
/// A mesh is too coarse if the energy norm is estimated to be off by more than this: the
/// displacement under the load is then too small by about the square of it.
const COARSE: f64 = 0.5;
/// Infinitesimal strain theory supposes |∇u| ≪ 1. At `LARGE` the term ½ ∇uᵀ∇u of the strain, which
/// it leaves out, is up to a twentieth of ∇u. A smaller part of the body than `NOTICEABLE` may be
/// a corner where the strain is singular, in every load.
const LARGE: f64 = 0.1;
const NOTICEABLE: f64 = 0.01;

/// Estimated errors of an answer, relative.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Accuracy {
    /// Of the largest displacement, against the exact answer of the discrete problem with the
    /// same pressing nodes. The KKT residuals bound forces; where K is ill-conditioned small
    /// forces move u far. Infinite where the pressing nodes alone do not hold the body.
    ///
    /// The larger of two: of the last step, and of the step with the largest stationarity residual.
    pub displacement: f64,
    /// The time of the step of which `displacement` is, s.
    pub time: f64,
    /// Of the last step's discretisation, in the energy norm: [`crate::fem::Elasticity::energy_error`].
    pub energy: f64,
}

impl Accuracy {
    /// How exact displacements should be, relative, at a KKT tolerance.
    pub fn promised(tolerance: f64) -> f64 {
        DISPLACEMENT.max(TOLERANCES * tolerance)
    }

    /// What to tell of these errors at a KKT tolerance; nothing if they are small.
    pub fn notes(&self, tolerance: f64) -> Vec<String> {
        let mut notes = Vec::new();
        if self.displacement.is_infinite() {
            notes.push(format!(
                "at t = {:.4e}, the nodes that press do not hold the body by themselves: how exact \
                 the displacements are cannot be estimated",
                self.time
            ));
        } else if self.displacement > Self::promised(tolerance) {
            notes.push(format!(
                "the stiffness is ill-conditioned (a slender or very soft part?): the residuals \
                 are within the tolerance, but displacements are exact only to about {:.0e} of \
                 the largest at t = {:.4e}",
                self.displacement, self.time
            ));
        }
        if self.energy > COARSE {
            notes.push(format!(
                "the mesh is too coarse for this answer: strains jump from triangle to triangle \
                 by about {:.0} % (energy norm), and displacements may be far too small; use \
                 smaller or less stretched triangles, several across a part that bends",
                100.0 * self.energy
            ));
        }
        notes
    }
}

impl Outcome {
    /// What the user should know about the run of `problem`.
    pub fn notes(&self, problem: &DiscreteProblem) -> Vec<String> {
        let mut notes = Vec::new();
        if let Some(stop) = self.stopped.filter(|stop| stop.floor > problem.threshold()) {
            notes.push(format!(
                "ζ_* was reached too early, or should not be reached at all: the sources up to \
                 there allow no ζ below {:.4}",
                stop.floor
            ));
        }
        notes.extend(self.bound_violation.note(problem.mass()));
        if let Some((time, motion)) = &self.unheld {
            // Nodes that touch without force may still be in the way.
            notes.push(format!(
                "at t = {time}, no pressing node holds the body against {motion}: the answer may \
                 be one of many"
            ));
        }
        // That a body which is not held has no one answer is said already.
        let displacement = if self.unheld.is_none() { self.accuracy.displacement } else { 0.0 };
        let accuracy = Accuracy { displacement, ..self.accuracy };
        notes.extend(accuracy.notes(problem.tolerance));
        notes.extend(problem.large_gradients(&self.last.state.u));
        if self.skipped_damage_solves > 0 && problem.damage().is_some() {
            notes.push(format!(
                "the damage solve was skipped in {} of {} steps: no source, uniform ζ",
                self.skipped_damage_solves, self.last.record.step
            ));
        }
        notes.extend(self.fallbacks());
        notes.extend(self.rescues());
        if self.undone > 0 {
            notes.push(format!("{} steps were undone and tried again, shorter", self.undone));
        }
        notes.extend(self.chosen_steps(problem));
        notes
    }

    /// How many steps were chosen, and how exact the damage is for it.
    fn chosen_steps(&self, problem: &DiscreteProblem) -> Option<String> {
        let error = self.damage_error.filter(|_| problem.damage().is_some())?;
        let Stepping::Auto { tolerance } = problem.scene().time?.stepping else { return None };
        let steps = self.last.record.step;
        let verdict = match error > tolerance {
            true => format!(", more than time.tolerance = {tolerance}: lower it"),
            false => String::new(),
        };
        Some(format!(
            "{steps} steps chosen: the damage is exact in time to about {} of the damage \
             done (two or three times that where the load swings or jumps){verdict}",
            percent(error)
        ))
    }
}

impl Outcome {
    /// That answers came by single pivoting.
    fn fallbacks(&self) -> Option<String> {
        let steps = counted(self.fallbacks);
        (self.fallbacks > 0)
            .then(|| format!("in {steps} the contact solver left its fast path (single pivoting)"))
    }

    /// That answers came from another solver than the one the run is named after.
    fn rescues(&self) -> Option<String> {
        let (steps, solver) = self.rescued?;
        Some(format!(
            "in {} the contact solver stopped short of the tolerance, and {solver} gave the answer \
             in its place",
            counted(steps)
        ))
    }
}

fn counted(steps: usize) -> String {
    if steps == 1 { "1 step".to_owned() } else { format!("{steps} steps") }
}

impl DiscreteProblem {
    /// What the user should know before any solve: what was not taken as it is written, rigid
    /// motions that nothing holds, tractions, a material or triangles that make the discretisation
    /// poor.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = self.scene().notes.clone();
        notes.extend(self.pieces().into_iter().chain(self.hinge()));
        let free = &self.motions.free;
        notes.extend(free.iter().take(TOLD).map(free_motion));
        if free.len() > TOLD {
            notes.push(format!("nothing holds or drives {} more such motions", free.len() - TOLD));
        }
        notes.extend(self.unresolved.iter().cloned());
        notes.extend(self.static_damage());
        notes.extend(self.locking());
        notes.extend(self.sliver());
        notes
    }

    /// Whether u is too large for infinitesimal strains and rotations: |∇u| (Frobenius) above
    /// `LARGE` in a noticeable part of the body. A translation, however far, is not.
    fn large_gradients(&self, u: &[f64]) -> Option<String> {
        let body = &self.body;
        let gradient = |t: usize| body.triangles[t].gradient(&body.gather(t, u)).norm();
        let own = 0..body.own_triangles;
        let large = own.filter(|&t| gradient(t) > LARGE).map(|t| body.triangles[t].area).sum();
        let part = body.partition.comm().total(large) / body.area;
        (part > NOTICEABLE).then(|| {
            format!(
                "|∇u| exceeds {LARGE} in {:.0} % of the body: strains or rotations are not small, \
                 and linear elasticity, which supposes they are, is a poor model of this load",
                100.0 * part
            )
        })
    }

    fn pieces(&self) -> Option<String> {
        let pieces = self.motions.pieces;
        (pieces > 1).then(|| {
            format!("the mesh has {pieces} pieces (gmsh: Coherence joins those that touch)")
        })
    }

    fn hinge(&self) -> Option<String> {
        self.motions.hinge.map(|[x, y]| {
            format!("parts of the mesh meet in a single node, a hinge, as at ({x:.4}, {y:.4})")
        })
    }

    fn static_damage(&self) -> Option<String> {
        let scene = self.scene();
        (scene.damage.is_some() && scene.time.is_none()).then(|| {
            "[damage] without [time]: in this static solve ζ stays damage.initial".to_owned()
        })
    }

    fn locking(&self) -> Option<String> {
        let material = self.scene().material;
        let locks = material.plane == Plane::Strain && material.poisson > LOCKING;
        locks.then(|| {
            format!(
                "nearly incompressible (plane strain, ν = {} > {LOCKING}): linear triangles lock, \
                 displacements may be far too small; compare with a mesh half as fine",
                material.poisson
            )
        })
    }

    /// The triangle with the smallest angle, if that is small.
    fn sliver(&self) -> Option<String> {
        let nodes = &self.body.mesh.nodes;
        let angles =
            self.body.mesh.triangles.iter().map(|t| (smallest_angle(t.map(|i| nodes[i])), t));
        let least = angles.min_by(|(a, _), (b, _)| a.total_cmp(b));
        let comm = self.body.partition.comm();
        let (angle, rank) = comm.min_with_rank(least.map_or(f64::INFINITY, |(angle, _)| angle));
        let at = least.map_or([0.0; 2], |(_, triangle)| nodes[triangle[0]]);
        let [x, y] = at.map(|coordinate| comm.broadcast(rank, coordinate));
        (angle < SLIVER).then(|| {
            format!(
                "a triangle at ({x:.4}, {y:.4}) has an angle of {angle:.1e}°: round-off grows as \
                 angles shrink; mend the mesh there if that is not meant"
            )
        })
    }
}

/// A part of 1 in percent: with two decimals, or three figures where these would say too little.
fn percent(part: f64) -> String {
    match 100.0 * part {
        percent if percent > 0.0 && percent < 0.1 => format!("{percent:.2e} %"),
        percent => format!("{percent:.2} %"),
    }
}

fn free_motion(motion: &RigidMotion) -> String {
    format!("nothing holds or drives {motion}: of all answers the one of least ∫|u|² is given")
}

/// Degrees.
fn smallest_angle(corners: [[f64; 2]; 3]) -> f64 {
    let at = |i: usize| {
        let [a, b, c] = [0, 1, 2].map(|k| corners[(i + k) % 3]);
        let (p, q) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        // The cosine alone would lose small angles to rounding.
        (p[0] * q[1] - p[1] * q[0]).atan2(p[0] * q[0] + p[1] * q[1]).to_degrees()
    };
    at(0).min(at(1)).min(at(2))
}

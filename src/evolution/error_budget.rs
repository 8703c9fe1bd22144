//! The errors of the last state by their causes, the mesh, the time steps and the solver, and the lines that report them.

use super::Stop;
use nalgebra::DVector;
use serde::Serialize;

/// Estimated relative errors of the last accepted state: for u in the energy norm, and for the damage ζ₀ − ζ in L².
/// They are `None` without damage. The errors of the time steps are also `None` if there are too few steps, and at ζ_*.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ErrorBudget {
    /// The error of u from the mesh: the measured one or, without a measurement, the estimated one.
    pub displacement_mesh: f64,
    /// Is it measured?
    #[serde(skip)]
    pub is_measured: bool,
    /// A proved bound on this error, for the given ζ; `None` if there is none or it was not asked for.
    pub displacement_bound: Option<f64>,
    /// The data of the scene that the proof leaves out, or the reason why a proof that was asked for is not possible.
    #[serde(skip)]
    pub reservations: Vec<&'static str>,
    /// The error of the damage from the mesh; `None` if it is not measured, and if the run stopped at ζ_*, where it grows
    /// without bound.
    pub damage_mesh: Option<f64>,
    /// The error of u from the time steps.
    pub displacement_steps: Option<f64>,
    /// The error of the damage from the time steps.
    pub damage_steps: Option<f64>,
    /// The error of max |u| from the solver; infinite if the active nodes alone do not support the body.
    pub solver: f64,
    /// Can the material be damaged?
    #[serde(skip)]
    pub can_be_damaged: bool,
    /// The error bars from the time steps: of ζ at the vertices, and of u, relative, in the energy norm.
    #[serde(skip)]
    pub(crate) bars_of_steps: Option<(DVector<f64>, f64)>,
}

/// If all errors are below this, there is no advice.
const NEGLIGIBLE_ERROR: f64 = 1e-9;

impl ErrorBudget {
    /// Sets the error of u from the mesh to the `measured` one, but at least to its estimate, and at most to a proved bound.
    pub fn set_measured(&mut self, measured: f64) {
        let proved = self.displacement_bound.filter(|_| self.reservations.is_empty());
        let error = self.displacement_mesh.max(measured);
        self.displacement_mesh = proved.map_or(error, |bound| error.min(bound));
        self.is_measured = measured > 0.0;
    }

    /// The error of u from the mesh: the proved bound, beside it the measured error, or the estimate from recovered strains.
    fn of_displacements(&self) -> String {
        let (estimate, reservations) =
            (percent(self.displacement_mesh), self.reservations.join(", "));
        let proved = if self.can_be_damaged { "proved for this ζ" } else { "proved" };
        let found = if self.is_measured { "measured" } else { "estimated" };
        let error = match (self.displacement_bound, &reservations[..]) {
            (Some(bound @ 1.0..), "") => format!(
                "at most {} (energy norm, {proved}): useless, the mesh is too coarse, its triangles are too \
                 stretched, or contact is in single nodes",
                percent(bound)
            ),
            (Some(bound), "") => format!("at most {} (energy norm, {proved})", percent(bound)),
            (Some(bound), left_out) => format!(
                "about {} (energy norm, a bound without proof, as {left_out})",
                percent(bound)
            ),
            (None, "") => format!("{estimate} (energy norm, {found})"),
            (None, reason) => format!("{estimate} (energy norm, {found}: no proof, as {reason})"),
        };
        // Beside a measured error, only a useful proof says more.
        let is_proof =
            self.displacement_bound.is_some_and(|of| of < 1.0) && reservations.is_empty();
        match (self.is_measured, is_proof) {
            (true, true) => format!("from the mesh: u {estimate} (measured), {error}"),
            (true, false) => format!("from the mesh: u {estimate} (energy norm, measured)"),
            _ => format!("from the mesh: u {error}"),
        }
    }

    /// The errors by their causes, and advice on which cause to reduce. For a run that stopped at ζ_*, the error of
    /// that time replaces the error of the damage.
    pub fn lines(&self, stopped: Option<&Stop>) -> [String; 4] {
        let of_damage = |error: Option<f64>, missing: &str| match error {
            Some(error) => format!("damage {}", percent(error)),
            None => missing.to_owned(),
        };
        let missing =
            if self.can_be_damaged { "damage not measured (see --bars)" } else { "no damage" };
        let damage_mesh = of_damage(self.damage_mesh, missing);
        let of_stop = |off: Option<f64>| match off {
            Some(off) if off.is_nan() => "the time of ζ_* not estimated".to_owned(),
            Some(off) => format!("the time of ζ_* off by up to {off:.1e}"),
            None => "the time of ζ_* not measured (see --bars)".to_owned(),
        };
        let of_u = self.displacement_steps;
        let (of_mesh, of_steps, mesh, steps) = match (stopped, of_u) {
            (Some(stop), _) => {
                let [mesh, steps] = [stop.from_mesh, Some(stop.uncertainty)];
                let part = |off: Option<f64>| off.map(|off| off / stop.time);
                (of_stop(mesh), of_stop(steps), part(mesh), part(steps))
            }
            (None, Some(u)) => {
                let steps =
                    format!("u {}, {}", percent(u), of_damage(self.damage_steps, "no damage"));
                let largest = self.damage_steps.map_or(u, |damage| damage.max(u));
                (damage_mesh, steps, self.damage_mesh, Some(largest))
            }
            (None, None) => {
                let steps = if self.can_be_damaged { "not estimated" } else { "none" };
                (damage_mesh, steps.to_owned(), self.damage_mesh, None)
            }
        };
        let of_u = if stopped.is_some() { 0.0 } else { self.displacement_mesh };
        let (mesh, steps_most) = (of_u.max(mesh.unwrap_or(0.0)), steps.unwrap_or(0.0));
        let (of_solver, solver) = match self.solver.is_finite() {
            true => (format!("{:.0e}", self.solver), self.solver),
            false => ("not estimated".to_owned(), 0.0),
        };
        let advice = match mesh.max(steps_most) {
            largest if largest.max(solver) < NEGLIGIBLE_ERROR => "",
            largest if solver > largest => "; to improve: the solver's tolerance",
            _ if steps_most > mesh => "; to improve: shorter time steps",
            _ => "; to improve: the mesh",
        };
        [
            self.of_displacements(),
            format!("from the mesh: {of_mesh}"),
            format!("from the time steps: {of_steps}"),
            format!("from the solver: u {of_solver}{advice}"),
        ]
    }
}

/// An error in percent, with two digits.
pub fn percent(error: f64) -> String {
    match 100.0 * error {
        error if error == 0.0 || !error.is_finite() => format!("{error} %"),
        error if error < 0.01 => format!("{error:.0e} %"),
        error => {
            let decimals = (1.0 - error.log10().floor()).max(0.0) as usize;
            format!("{error:.decimals$} %")
        }
    }
}

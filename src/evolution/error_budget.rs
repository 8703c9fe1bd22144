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
const NEGLIGIBLE_ERROR: f64 = 1e-3;

impl ErrorBudget {
    /// Sets the error of u from the mesh to the `measured` one, but at least to its estimate, and at most to a proved bound.
    pub fn set_measured(&mut self, measured: f64) {
        let proved = self.displacement_bound.filter(|_| self.reservations.is_empty());
        let error = self.displacement_mesh.max(measured);
        self.displacement_mesh = proved.map_or(error, |bound| error.min(bound));
        self.is_measured = measured > 0.0;
    }

    /// A bound on the error of u from the mesh. Beside a measured error, only a useful proof says more.
    fn bound(&self) -> Option<String> {
        let (left_out, is_measured) = (self.reservations.join(", "), self.is_measured);
        let proved = if self.can_be_damaged { "proved for this ζ" } else { "proved" };
        let text = match (
            self.displacement_bound.map(|bound| (bound, percent(bound))),
            &left_out[..],
        ) {
            (Some((..1.0, bound)), "") => format!("at most {bound} ({proved}, energy norm)"),
            (None, "") => return None,
            _ if is_measured => return None,
            (Some((_, bound)), "") => format!(
                "no useful bound ({bound}): the mesh is too coarse, its triangles are too stretched, or contact is in single \
                 nodes"
            ),
            (Some((_, bound)), _) => format!("{bound} by a bound without proof: {left_out}"),
            (None, _) => format!("no bound: {left_out}"),
        };
        Some(format!("from the mesh: u {text}"))
    }

    /// The errors by their causes, and the next step: which cause to reduce. For a run that stopped at ζ_*, the error of
    /// that time replaces the error of the damage.
    pub fn lines(&self, stopped: Option<&Stop>) -> (Vec<String>, Option<String>) {
        const OF_MESH: &str = "from the mesh";
        const OF_STEPS: &str = "from the time steps";
        let found = if self.is_measured { "measured" } else { "estimated" };
        let error = self.displacement_mesh;
        let of_u = format!("{OF_MESH}: u {} ({found}, energy norm)", percent(error));
        let mut errors = match stopped {
            Some(stop) => [(OF_MESH, stop.from_mesh), (OF_STEPS, Some(stop.uncertainty))]
                .map(|(cause, off)| (cause, "time of ζ_*", off.map(|off| off / stop.time)))
                .to_vec(),
            None if self.can_be_damaged => vec![
                (OF_MESH, "damage", self.damage_mesh),
                (OF_STEPS, "u", self.displacement_steps),
                (OF_STEPS, "damage", self.damage_steps),
            ],
            None => Vec::new(),
        };
        let line = |(cause, of, error): &(&str, &str, Option<f64>)| match error {
            Some(error) if !error.is_nan() => format!("{cause}: {of} {}", percent(*error)),
            _ if *cause == OF_MESH => format!("{cause}: {of} not measured; --bars measures it"),
            _ => format!("{cause}: {of} not estimated"),
        };
        let lines = [of_u].into_iter().chain(self.bound()).chain(errors.iter().map(line)).collect();
        errors.push((OF_MESH, "u", Some(error).filter(|_| stopped.is_none())));
        errors.push(("from the solver", "u", Some(self.solver).filter(|error| error.is_finite())));
        let known = errors.into_iter().filter_map(|(cause, of, error)| Some((cause, of, error?)));
        let worst = known.max_by(|a, b| a.2.total_cmp(&b.2)).filter(|of| of.2 > NEGLIGIBLE_ERROR);
        let next = worst.map(|(cause, of, error)| {
            let advice = match cause {
                OF_MESH => "a finer mesh",
                OF_STEPS => "shorter time steps",
                _ => "a smaller contact.tolerance",
            };
            format!("{advice} (the largest error: {of} {})", percent(error))
        });
        (lines, next)
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

//! The conclusion at the end of a run: whether the accuracy is reached, and the errors that the error bars do not contain.

use super::{Adapted, LoopState, first_mesh::kinks};
use crate::{
    evolution::{Outcome, percent},
    mesh::Order,
    observe::ObservedProblem,
};

impl LoopState {
    /// Is the required accuracy reached? With the closing lines: the answer, the reasons why not, and the mesh. `None` without
    /// a required accuracy. A run that failed has no outcome.
    pub fn conclusion(
        &self,
        problem: &ObservedProblem,
        outcome: Option<&Outcome>,
    ) -> Option<(bool, Vec<String>)> {
        let (adapted, scene) = (self.adapted.as_ref()?, problem.scene());
        let accuracy = scene.accuracy?;
        let degree = if scene.order == Order::Quadratic { 2 } else { 1 };
        let triangles = adapted.mesh.triangles.len();
        let mesh =
            format!("the mesh is kept as mesh.msh: {triangles} triangles of degree {degree}");
        let asked = match &scene.accuracy_of[..] {
            [] => format!("accuracy {accuracy}"),
            names => format!("accuracy {accuracy} of {}", names.join(", ")),
        };
        let Some(outcome) = outcome else {
            return Some((false, vec![asked + " NOT reached", mesh]));
        };
        let reasons = self.reasons(adapted, accuracy, problem, outcome);
        let of_time = if outcome.stopped.is_some() { " in the time of ζ_*" } else { "" };
        let reached = reasons.is_empty();
        let answer = if reached { format!("reached{of_time}") } else { "NOT reached".to_owned() };
        let lines = [format!("{asked} {answer}")].into_iter().chain(reasons);
        Some((reached, lines.chain([mesh]).collect()))
    }

    /// The reasons why the accuracy is not reached; none if it is.
    fn reasons(
        &self,
        adapted: &Adapted,
        accuracy: f64,
        problem: &ObservedProblem,
        outcome: &Outcome,
    ) -> Vec<String> {
        let scene = problem.scene();
        let bars = outcome.bars.iter().filter(|bar| scene.requires_accuracy_of(&bar.name));
        let bars = bars.map(|bar| (bar.name.clone(), bar.relative()));
        let norms = scene.accuracy_of.is_empty().then_some(&adapted.worst).into_iter().flatten();
        let unknown = |error: f64| if error.is_nan() { f64::INFINITY } else { error };
        let of_stop = outcome.stopped.map(|stop| unknown(stop.bar() / stop.time));
        let of_stop = of_stop.map(|error| ("stopped_at".to_owned(), error));
        let worst = bars.chain(norms.cloned()).chain(of_stop).max_by(|a, b| a.1.total_cmp(&b.1));
        let missed = worst.filter(|(_, error)| *error > accuracy).map(|(name, error)| {
            let error = match percent(error) {
                _ if !error.is_finite() => "unknown".to_owned(),
                same if same == percent(accuracy) => format!("{:.3} %", 100.0 * error),
                percent => percent,
            };
            format!("the error of {name} is {error}")
        });
        let unconfirmed = self.is_unconfirmed_stop(outcome);
        let unconfirmed = unconfirmed
            .then_some("only this run stops at ζ_*; the runs that measure its error do not");
        // Only the limit on the time prevents a repetition.
        let is_last = self.is_last(outcome, accuracy)
            || outcome.shorter_steps(problem, &self.measured).is_none();
        let limit =
            (!is_last).then_some("shorter time steps would take longer than --max-seconds allows");
        let may_stop = outcome
            .may_stop
            .map(|_| "ζ may have reached ζ_*: the time steps are too long to exclude it");
        let of_run = [unconfirmed, may_stop, limit].into_iter().flatten().map(str::to_owned);
        let of_mesh = missed.into_iter().chain(adapted.not_reached.clone());
        of_mesh.chain(of_run).chain(self.missing_bars(outcome)).collect()
    }

    /// Notes on the accuracy and on the error bars of the run of `problem`.
    pub fn notes(&self, problem: &ObservedProblem, outcome: Option<&Outcome>) -> Vec<String> {
        let is_fixed = self.adapted.is_none();
        let notes = [
            self.kinks(problem),
            outcome.filter(|_| is_fixed).and_then(|outcome| self.missing_bars(outcome)),
        ];
        notes.into_iter().flatten().chain(self.notes.iter().cloned()).collect()
    }

    /// A note on error bars that are missing although the errors from the mesh were measured.
    fn missing_bars(&self, outcome: &Outcome) -> Option<String> {
        let is_missing = outcome.stopped.is_none() && outcome.bars.is_empty();
        (is_missing && self.measured.stop.is_some()).then(|| {
            "no error bars: a run that measures them stops at ζ_*, and this run does not; refine the mesh or shorten the \
             time steps (explain bars)"
                .to_owned()
        })
    }

    /// A note on curved edges of the adapted mesh that meet at an angle. The error bars do not contain the error of a smooth curve
    /// that they only follow roughly.
    fn kinks(&self, problem: &ObservedProblem) -> Option<String> {
        let (mesh, scene) = (&self.adapted.as_ref()?.mesh, problem.scene());
        let kinks = kinks(scene, mesh, scene.accuracy?).into_iter();
        let kinks = kinks.filter(|(allowed, kink)| !kink.is_corner && kink.angle > 2.0 * allowed);
        let (_, kink) = kinks.max_by(|(a, p), (b, q)| (p.angle / a).total_cmp(&(q.angle / b)))?;
        let at = mesh.place(mesh.nodes[kink.node]);
        Some(format!(
            "curved edges meet at {at} at an angle of {:.1e}°: if the curve is smooth there, the bars do not hold the \
             error of its shape; set smaller sizes there in the .geo (explain meshes)",
            kink.angle.to_degrees()
        ))
    }
}

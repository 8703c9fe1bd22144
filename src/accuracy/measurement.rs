//! The measured errors of figures: the same few steps on the mesh bisected everywhere, and on the meshes of the rounds before.
//!
//! The three meshes give the bars ([`Sequence`]). If no mesh before was much coarser, a mesh bisected twice is the third. All
//! runs of a measurement take the same time steps, so that these cause no change.
//!
//! If the errors are too large, the answer on the bisected mesh serves the next mesh too. Only if its errors are then still too
//! large, or if its time steps differ, this mesh is bisected itself.

use super::{
    AccuracyLoop, AdaptError, Answer, End, Extreme, FEW, FewStepRun, Measured,
    changes::{damage, displacement, overshoot},
    problem_on,
    sequence::Sequence,
};
use crate::{
    evolution::AIM,
    mesh::{Order, Refinement},
    observe::{Dimension, Figure, ObservedProblem, Of},
    scene::{Probe, is_required},
};
use std::slice::from_ref;

/// The fraction of the accuracy of a figure, or of u, that the mesh may use; the time steps use the rest.
///
/// Tuned on the 13 adapted runs. Half: a third more triangles. Twice: 29 % more steps, and three runs miss their
/// accuracy.
const SHARE: f64 = 0.97;

/// A third mesh with at most this number of triangles is used in any case. A larger one is used only if two meshes do
/// not decide, because its run may take longer than all others.
///
/// Tuned on the scenes of geo. Infinity: `lshape` at 0.03 takes 4.5 s for 0.9 s. Twice: `bridge` at 0.1 takes twice
/// the time.
const CHEAP: usize = 8_000;

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
    pub(super) fn over_accuracy(&self, accuracy: f64) -> f64 {
        self.relative / (self.share * accuracy)
    }
}

/// The cause of an error.
pub(super) enum Cause {
    /// The triangles at the ends of contact.
    Ends,
    /// The error of ζ everywhere: the shares of the triangles in its square.
    Damage(Vec<f64>),
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
    /// The errors of a run on the mesh. That of u is (‖u_h − u_{h/2}‖ / ‖u_{h/2}‖) / √(1 − r²), with r as in [`Sequence`].
    pub(super) result: Measured,
    /// The relative error of u: the one measured at the end, or the estimate at the worst time if that is larger.
    displacement: f64,
    /// The error of the time of ζ_*, s, and this time; the error is infinite if only one of the two runs reaches it.
    stop: Option<[f64; 2]>,
    /// Per triangle of the mesh: its share of the squared relative error of u, from the estimates on its parts, and
    /// the maximum penetration at their edges, m.
    pub(super) shares: Vec<f64>,
    pub(super) depths: Vec<f64>,
    /// Per triangle: its share of the squared error of ζ, and max |Δζ|; empty without damage.
    of_damage: Vec<f64>,
    zeta: Vec<f64>,
    /// The extremes of stresses and pressures on the bisected mesh, and the stresses at probes that have no value.
    of_points: Vec<Extreme>,
    at_probes: Vec<Extreme>,
    /// The mesh bisected everywhere and the answer there.
    finer: Option<(Refinement, Answer)>,
}

impl AccuracyLoop<'_> {
    /// Measures the errors of the run `coarse`, with this `answer`, by the same run on finer meshes, and by the answers on the
    /// meshes before. A mesh bisected twice is left out if it exceeds the limits, and if two meshes show already whether the
    /// `accuracy` is reached. Collective.
    ///
    /// # Errors
    /// A triangle cannot be bisected, or the run on the finer mesh fails.
    pub(super) fn measurement(
        &mut self,
        answer: &Answer,
        coarse: &FewStepRun,
        accuracy: Option<f64>,
    ) -> Result<Measurement, AdaptError> {
        let (scene, times) = (coarse.problem.scene(), &coarse.history.times);
        let finer = Refinement::start(answer.mesh.clone()).refine_everywhere()?;
        let of_fine = problem_on(self.session, scene, &finer.mesh)?;
        let fine = self.solve(&of_fine, FEW, times)?;
        let mut answers = vec![Answer::new(&fine, finer.mesh.clone())];
        let two = Sequence::new(&self.before, answer, &answers, true);
        let both = [answer, &answers[0]];
        let mut measured = Measurement::of_fields(&two, &finer, both, coarse, &fine);
        measured.set_bars(&two, coarse, &fine);
        let misses = |measured: &Measurement| {
            accuracy
                .is_some_and(|accuracy| measured.over_accuracy(accuracy, &scene.accuracy_of) > 1.0)
        };
        let is_done = two.has_coarser() || misses(&measured);
        if !is_done {
            measured.set_bars(&two.slower(), coarse, &fine);
        }
        let triangles = 4 * finer.mesh.triangles.len();
        let is_decided = accuracy.is_some() && triangles > CHEAP && !misses(&measured);
        if is_done || is_decided || self.limits.exceeded(&[triangles]).is_some() {
            measured.finer = answers.pop().map(|fine| (finer, fine));
            return Ok(measured);
        }
        let finest = Refinement::start(finer.mesh.clone()).refine_everywhere()?.mesh;
        let problem = problem_on(self.session, scene, &finest)?;
        if let Ok(run) = self.solve(&problem, FEW, times) {
            answers.push(Answer::new(&run, finest));
            let three = Sequence::new(&self.before, answer, &answers, true);
            measured.set_bars(&three, coarse, &fine);
        }
        Ok(measured)
    }
}

impl Measurement {
    /// The errors of the run `coarse` with this `answer` on a refinement of the measured mesh, the last one `before`, from the
    /// same finer mesh. `None` if the time steps differ from those `before`, or if a run stops. Collective.
    pub(super) fn on_refined(
        &self,
        before: &[Answer],
        answer: &Answer,
        coarse: &FewStepRun,
    ) -> Option<Self> {
        let (finer, fine) = self.finer.as_ref().filter(|_| self.stop.is_none())?;
        let is_like = coarse.stop().is_none() && answer.times == before.last()?.times;
        let sequence = is_like.then(|| Sequence::new(before, answer, from_ref(fine), false))?;
        // From this mesh to the one before, the error falls as its estimate does.
        let at_end = self.result.displacement * answer.error / before.last()?.error;
        let displacement = coarse.relative().0.max(at_end);
        let mut measured = Self { displacement, ..Self::default() };
        measured.result.displacement = at_end;
        if coarse.problem.damage().is_some() {
            let [shares, largest] = damage(answer, finer, fine);
            // The finer mesh has an error, too: about r times that of the mesh before.
            let before = sequence.rate() * self.result.damage.unwrap_or(0.0);
            measured.result.damage = Some(shares.iter().sum::<f64>().sqrt() + before);
            measured.zeta = largest;
        }
        measured.result.not_converged = self.result.not_converged.clone();
        measured.set_bars_of_settled(&sequence, coarse);
        Some(measured)
    }

    /// The errors of u and ζ, without bars of figures. Collective.
    fn of_fields(
        sequence: &Sequence,
        finer: &Refinement,
        [answer, finer_answer]: [&Answer; 2],
        coarse: &FewStepRun,
        fine: &FewStepRun,
    ) -> Self {
        let problem = coarse.problem;
        let mut measured = Self::default();
        (measured.displacement, _) = coarse.relative();
        let (_, of_parts) = fine.relative();
        // The squared error of order p on the whole triangle is 4^p times the sum on its parts.
        let growth = if problem.scene().order == Order::Quadratic { 16.0 } else { 4.0 };
        measured.shares = vec![0.0; answer.mesh.triangles.len()];
        measured.depths = measured.shares.clone();
        for ((&parent, share), depth) in
            finer.parent_of_triangle.iter().zip(of_parts).zip(&fine.history.depths)
        {
            measured.shares[parent] += growth * share;
            measured.depths[parent] = measured.depths[parent].max(*depth);
        }
        if coarse.stop().or(fine.stop()).is_some() {
            return measured;
        }
        let change = displacement(coarse, &answer.mesh, finer, fine);
        let at_end = change / (1.0 - sequence.rate().powi(2)).sqrt();
        measured.result.displacement = at_end;
        measured.displacement = measured.displacement.max(at_end);
        if problem.damage().is_some() {
            let [shares, largest] = damage(answer, finer, finer_answer);
            let square = (1.0 - sequence.rate()).powi(-2);
            measured.of_damage = shares.iter().map(|share| square * share).collect();
            measured.result.damage = Some(measured.of_damage.iter().sum::<f64>().sqrt());
            measured.zeta = largest;
        }
        let points = problem.singular_points();
        measured.of_points = fine.extremes.named(&points);
        measured.at_probes = fine.extremes.at_probes(&points);
        measured
    }

    /// Sets the bars of the figures, or of the time of ζ_*. Collective.
    fn set_bars(&mut self, sequence: &Sequence, coarse: &FewStepRun, fine: &FewStepRun) {
        self.stop = sequence.stop();
        if let Some([error, _]) = self.stop {
            self.result.stop = Some(error).filter(|error| error.is_finite());
            return;
        }
        let problem = fine.problem;
        // The extreme of the whole converges if that of its part does.
        let converges = |extreme: &&Extreme| {
            let part = problem.part_of(extreme.number, &fine.outcome.last.figures);
            let part = self.of_points.iter().find(|of| of.number == part).unwrap_or(extreme);
            sequence.converges(part.number, part)
        };
        let not_converged = self.of_points.iter().filter(|of| !converges(of));
        let not_converged = not_converged.chain(&self.at_probes);
        self.result.not_converged = not_converged.map(|of| of.name.clone()).collect();
        self.set_bars_of_settled(sequence, coarse);
    }

    /// Sets the bars of the figures that converge over the meshes. Collective.
    fn set_bars_of_settled(&mut self, sequence: &Sequence, coarse: &FewStepRun) {
        let problem = coarse.problem;
        let overshoots = coarse.outcome.bound_violation.first.is_some();
        let error = |(i, figure): (usize, &Figure)| match figure.dimension {
            Dimension::ContactLength => sequence.error_of_length(i),
            Dimension::Zeta if figure.of == Of::Body && overshoots => {
                sequence.error(i, figure).max(overshoot(sequence.answer()))
            }
            _ => {
                let extreme = coarse.extremes.all.iter().find(|of| of.number == i);
                sequence.error(i, figure) + extreme.map_or(0.0, |of| of.growth)
            }
        };
        let errors = Vec::from_iter(problem.figures.iter().enumerate().map(error));
        self.result.energy = coarse.history.energy;
        let Measured { bars, not_converged, .. } = &mut self.result;
        let infinite = coarse.extremes.all.iter().filter(|of| of.growth.is_infinite());
        not_converged.extend(infinite.map(|of| of.name.clone()));
        *bars = problem.bars(&errors, &coarse.scales(not_converged), not_converged);
        for figure in problem.figures.iter().filter(|of| of.dimension == Dimension::ContactLength) {
            let bar_of = |name: &str| bars.iter().position(|bar| bar.name == name);
            let pressure = bar_of(&figure.name.replace(figure.kind, "pressure_max"));
            if let (Some(length), Some(pressure)) = (bar_of(&figure.name), pressure) {
                bars[length].bar += coarse.extremes.faint_length(figure, bars[pressure].bar);
            }
        }
        problem.join_bars(bars, &coarse.outcome.last.figures);
    }

    /// Leaves out these figures of the run `coarse`, whose errors stay while the mesh becomes finer: they are no scale of others.
    pub(super) fn leave_out(&mut self, names: &[String], coarse: &FewStepRun) {
        let Measured { bars, not_converged, .. } = &mut self.result;
        bars.retain(|bar| !names.contains(&bar.name));
        not_converged.extend_from_slice(names);
        let (figures, scales) = (&coarse.problem.figures, coarse.scales(not_converged));
        for bar in bars {
            bar.scale = figures.number(&bar.name).map_or(bar.scale, |i| scales[i]);
        }
    }

    /// Why a figure in `names` has no accuracy, if one does not converge over the meshes.
    pub(super) fn without_accuracy(&self, names: &[String]) -> Option<End> {
        let name = names.iter().find(|name| self.result.not_converged.contains(name))?;
        Some(End::NotConverged(name.clone()))
    }

    /// The largest measured error in `names`, or of all, over the error that the `accuracy` allows; infinite without errors.
    pub(super) fn over_accuracy(&self, accuracy: f64, names: &[String]) -> f64 {
        self.errors(names).first().map_or(f64::INFINITY, |worst| worst.over_accuracy(accuracy))
    }

    /// The measured errors of the figures and norms in `names`, or of all: the figures, u, the damage
    /// and the time of ζ_*. The largest error over its share comes first.
    pub(super) fn errors(&self, names: &[String]) -> Vec<MeasuredError> {
        let norms = [
            ("damage", self.result.damage.unwrap_or(0.0), 1.0),
            ("displacement", self.displacement, SHARE),
            ("stopped_at", self.stop.map_or(0.0, |[error, time]| error / time), AIM),
        ];
        let figures = self.result.bars.iter().map(|bar| (bar.name.as_str(), bar.relative(), SHARE));
        let errors = figures.chain(norms).filter(|(name, ..)| is_required(names, name));
        let mut errors: Vec<_> = errors
            .map(|(name, relative, share)| {
                let relative = if relative.is_nan() { f64::INFINITY } else { relative };
                MeasuredError { name: name.to_owned(), relative, share }
            })
            .collect();
        errors.sort_by(|a, b| (b.relative / b.share).total_cmp(&(a.relative / a.share)));
        errors
    }

    /// The cause of the error of the figure or norm `name` of `problem`.
    pub(super) fn cause(&self, name: &str, problem: &ObservedProblem) -> Cause {
        let Some(bar) = self.result.bars.iter().find(|bar| bar.name == name) else {
            let of_damage = || Cause::Damage(self.of_damage.clone());
            return if name == "damage" { of_damage() } else { Cause::Fields(1.0) };
        };
        let of_extreme = self.of_points.iter().find(|of| of.name == name).map(|of| of.at);
        let figure = problem.figures.number(name).map(|number| &problem.figures[number]);
        let is_at =
            |probe: &&Probe| figure.is_some_and(|of| of.of == Of::Probe(probe.name.clone()));
        let of_probe = || problem.scene().probes.iter().find(is_at).map(|probe| probe.point);
        match (bar.dimension, of_extreme.or_else(of_probe)) {
            (Dimension::ContactLength, _) => Cause::Ends,
            (Dimension::Zeta, _) => Cause::Change(self.zeta.clone()),
            (Dimension::Force | Dimension::Moment, _) => Cause::Reactions,
            (Dimension::Length, Some(at)) => Cause::Around(at, 0),
            (Dimension::Stress, Some(at)) => Cause::Around(at, 1),
            _ => Cause::FIGURE,
        }
    }
}

//! The error bars of figures: the measured errors of the mesh, the errors of the time steps, and the scales of relative errors.

use super::Measured;
use crate::{
    advice::missed_mean,
    evolution::{AIM, Outcome},
    observe::{
        Bar, Dimension, FIRST_CONTACT, Figure, NEGLIGIBLE_DAMAGE, Observation, ObservedProblem, Of,
        Value,
    },
    petsc::PetscError,
    problem::{SAMPLE_TIMES, State},
};
use nalgebra::DVector;

/// The scale of a figure is at least this fraction of the natural scale of its dimension: of the energy ‖u‖² for a work, and of
/// Σ|f| for a force. Otherwise a force that is zero by symmetry would have no relative error.
const MIN_SCALE: f64 = 1e-3;
/// The scale of a moment is at least this fraction of the maximum force times the body's radius of gyration: a moment is
/// small about any point near the line of its force. The scale of a stress is at least this fraction of the mean stress
/// of the body, about √(E ‖u‖²/|Ω|): a stress at a free corner is zero. That of a displacement is at least this fraction of
/// max |u|: at a support it is zero.
const MIN_PART: f64 = 0.1;

impl Outcome {
    /// Sets the error bars: the `measured` errors of the mesh plus the errors of the time steps. A run that stopped at
    /// ζ_* has the bar of this time alone, because another mesh stops at another time. There are none if the run has too
    /// few steps for an estimate. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn set_bars(
        &mut self,
        problem: &ObservedProblem,
        measured: &Measured,
    ) -> Result<(), PetscError> {
        let unknown = problem.damage().is_some() && self.errors.bars_of_steps.is_none();
        if let Some(stop) = &mut self.stopped {
            stop.from_mesh = measured.stop;
            return Ok(());
        }
        self.errors.damage_mesh = measured.damage;
        self.errors.set_measured(measured.displacement);
        if unknown || measured.bars.is_empty() {
            return Ok(());
        }
        self.bars = measured.bars.clone();
        let now = self.set_scales(problem, measured);
        let none = (DVector::zeros(self.last.state.zeta.len()), 0.0);
        let of_steps = self.errors.bars_of_steps.as_ref().unwrap_or(&none);
        let last = (&self.last.state, &self.last.figures[..]);
        problem.add_step_errors(&mut self.bars, &now, last, of_steps)?;
        problem.join_bars(&mut self.bars, &self.last.figures);
        for (name, first) in problem.foundations.iter().zip(&self.last.first_contact) {
            for (kind, [_, error]) in FIRST_CONTACT.iter().zip(first.found.iter().flatten()) {
                let name = format!("{name}.{kind}");
                let bar = self.bars.iter_mut().find(|bar| bar.name == name);
                bar.into_iter().for_each(|bar| bar.bar += error);
            }
        }
        Ok(())
    }

    /// The factor for the tolerance of the time steps with which a run is within the required accuracy, if the time steps of
    /// this one take more than the part that the `measured` errors of the mesh leave. It is at least 1/64: the error of a step is of
    /// third order, so there are then about four times as many steps.
    pub fn shorter_steps(&self, problem: &ObservedProblem, measured: &Measured) -> Option<f64> {
        let accuracy = problem.scene().accuracy?;
        // Only the errors of the damage add up over the steps.
        problem.damage()?;
        let bars = measured.bars.iter().zip(&self.bars);
        let bars = bars.filter(|(bar, _)| problem.scene().requires_accuracy_of(&bar.name));
        let bars = bars.map(|(of_mesh, of_both)| [of_mesh.relative(), of_both.relative()]);
        let of_stop = self
            .stopped
            .map(|stop| [stop.from_mesh.unwrap_or(0.0), stop.bar()].map(|bar| bar / stop.time));
        let factor = bars.chain(of_stop).map(|[of_mesh, of_both]| {
            let (of_steps, left) = (of_both - of_mesh, accuracy - of_mesh);
            if of_steps > left { AIM * left / of_steps } else { 1.0 }
        });
        // The time steps alone may cause a stop that no run has measured, or prevent one.
        let unmeasured = self.stopped.is_some() && measured.stop.is_none();
        let limit = if unmeasured || self.may_stop.is_some() { 0.5 } else { 1.0 };
        let factor = factor.fold(limit, f64::min);
        (0.0 < factor && factor < 1.0).then_some(factor.max(1.0 / 64.0))
    }

    /// Takes the scales of the bars from this run. The runs that measured the errors of the mesh have few steps and may end in a
    /// less or more damaged state: their relative or absolute errors count, whichever are larger. Returns the scales of the bars
    /// in the last state. An extreme that grows is no scale.
    fn set_scales(&mut self, problem: &ObservedProblem, measured: &Measured) -> Vec<f64> {
        let scales = |sizes: &[f64], energy: f64, forces: f64| {
            let scales = problem.figure_scales(sizes, &measured.not_converged, energy, forces);
            let of = |bar: &Bar| problem.figures.number(&bar.name).map_or(0.0, |i| scales[i]);
            Vec::from_iter(self.bars.iter().map(of))
        };
        let largest = scales(&self.sizes(problem), measured.energy, self.last.forces);
        let last = self.last.figures.iter().map(|of| of.value);
        let now = scales(&problem.figures.magnitudes(last), 0.0, 0.0);
        for (bar, scale) in self.bars.iter_mut().zip(largest) {
            if scale > 0.0 && bar.scale > 0.0 {
                bar.bar *= (scale / bar.scale).max(1.0);
                bar.scale = scale;
            }
        }
        now
    }
}

impl ObservedProblem {
    /// The error bars of all figures but `left_out`, from their errors and scales. An error may be small by chance, but hardly those of
    /// all components at a probe, or of all extremes of the stress in a body: it is at least their root mean square.
    pub(crate) fn bars(&self, errors: &[f64], scales: &[f64], left_out: &[String]) -> Vec<Bar> {
        let has_components = |of: &Figure| match (&of.of, of.dimension) {
            (Of::Probe(_), Dimension::Length) => true,
            (Of::Probe(_) | Of::Body | Of::Material(_), Dimension::Stress) => !of.is_pressure(),
            _ => false,
        };
        let is_like = |a: &Figure, b: &Figure| {
            a.of == b.of && a.dimension == b.dimension && a.is_away() == b.is_away()
        };
        let figures = || {
            let figures = self.figures.iter().zip(errors.iter().zip(scales));
            figures.filter(|(of, _)| of.dimension.has_bar() && !left_out.contains(&of.name))
        };
        // The root mean square of the errors of the figures like `of`, which has components.
        let mean = |of: &Figure| {
            let like = figures().filter(|(other, _)| has_components(other) && is_like(of, other));
            let (squares, number) =
                like.fold((0.0, 0.0), |(sum, n), (_, (error, _))| (sum + error * error, n + 1.0));
            f64::sqrt(squares / number)
        };
        let missed = missed_mean(self);
        let bar = |(of, (&error, &scale)): (&Figure, (&f64, &f64))| {
            let error = if has_components(of) { error.max(mean(of)) } else { error };
            let missed = if of.dimension == Dimension::OfZeta { missed } else { 0.0 };
            Bar { name: of.name.clone(), dimension: of.dimension, bar: error + missed, scale }
        };
        figures().map(bar).collect()
    }

    /// Sets the bars of the extremes of the whole, from those of its parts:
    ///
    /// v ± max_p (v_p + b_p − v),   with v = max_p v_p.
    pub(crate) fn join_bars(&self, bars: &mut [Bar], values: &[Value]) {
        let of =
            |bars: &[Bar], k: usize| bars.iter().position(|bar| bar.name == self.figures[k].name);
        for (i, figure) in self.figures.iter().enumerate().filter(|(_, of)| of.is_extreme()) {
            let size = |k: usize| figure.size(values[k].value);
            let part = self.part_of(i, values);
            let (Some(own), Some(_)) = (of(bars, i), of(bars, part)) else { continue };
            let most = |k: usize| Some(size(k) - size(i) + bars[of(bars, k)?].bar);
            let most = self.figures.parts(i).filter_map(most).reduce(f64::max);
            bars[own].bar = most.unwrap_or(bars[own].bar);
        }
    }

    /// The scale of each figure: the maximum of its group in a run, and at least a part of its natural scale. From the
    /// `largest` [magnitudes](Figures::magnitudes), ‖u‖² (`energy`, N m per metre of thickness) and Σ|f| (`forces`, N per metre of thickness)
    /// of the run. All forces may balance, as in pure bending; their sum of moduli does not vanish.
    /// An extreme that has `not_converged` over the meshes is no scale of the others.
    pub(crate) fn figure_scales(
        &self,
        largest: &[f64],
        not_converged: &[String],
        energy: f64,
        forces: f64,
    ) -> Vec<f64> {
        let sizes = || self.figures.iter().zip(largest);
        let most = |is_like: &dyn Fn(&Figure) -> bool| {
            let like = sizes().filter(|(of, _)| is_like(of) && !not_converged.contains(&of.name));
            like.map(|(_, value)| *value).fold(0.0, f64::max)
        };
        let lever = self.body.radius_of_gyration();
        let young = self.scene().materials().map(|material| material.young);
        let mean_stress = (young.fold(f64::INFINITY, f64::min) * energy / self.body.area).sqrt();
        let scale = |figure: &Figure| {
            let own = most(&|other| other.group == figure.group);
            let least = match figure.dimension {
                Dimension::Work => MIN_SCALE * energy,
                Dimension::Length => MIN_PART * most(&|other| other.dimension == Dimension::Length),
                Dimension::Force => MIN_SCALE * forces,
                Dimension::Moment => {
                    let resultant = most(&|other| other.dimension == Dimension::Force);
                    lever * (MIN_PART * resultant).max(MIN_SCALE * forces)
                }
                Dimension::Zeta | Dimension::OfZeta => NEGLIGIBLE_DAMAGE,
                Dimension::Stress => MIN_PART * mean_stress,
                // A sum of lengths of edges has no rounding.
                Dimension::ContactLength | Dimension::Time => 0.0,
                Dimension::Place | Dimension::Given => 0.0,
            };
            own.max(least)
        };
        self.figures.iter().map(scale).collect()
    }

    /// How much each figure of `state`, with these `values`, changes when ζ changes by ±`bar` while u stays: the larger one of
    /// both changes. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    fn changes(
        &self,
        (state, values): (&State, &[Value]),
        bar: &DVector<f64>,
    ) -> Result<Vec<f64>, PetscError> {
        let (mut largest, zero) = (vec![0.0; values.len()], vec![0.0; state.u.len()]);
        for sign in [-1.0, 1.0] {
            let zeta = state.zeta.iter().zip(bar).map(|(zeta, bar)| zeta + sign * bar).collect();
            let state = State { zeta, ..state.clone() };
            let changed = self.figures.values(&Observation::new(self, &state, &zero, &zero)?);
            for ((largest, own), other) in largest.iter_mut().zip(values).zip(changed) {
                *largest = f64::max(*largest, (other.value - own.value).abs());
            }
        }
        Ok(largest)
    }

    /// Adds to the error bars the solver's tolerance and the errors of the loads' integrals, which all meshes
    /// of a measurement may have, and of the time steps: `of_steps` are the error bars of ζ at the vertices in the `last`
    /// state, and of u, relative, in the energy norm; the state comes with the values of its figures. Collective.
    ///
    /// u depends on the past, and so on the steps, only through ζ: their errors are relative to the scales `now`, in the last
    /// state.
    ///
    /// # Errors
    /// PETSc failed.
    pub(crate) fn add_step_errors(
        &self,
        bars: &mut [Bar],
        now: &[f64],
        last: (&State, &[Value]),
        of_steps: &(DVector<f64>, f64),
    ) -> Result<(), PetscError> {
        let [force, of_loads] =
            self.loads.integral_errors(&self.body, &self.scene().sample_times(SAMPLE_TIMES));
        let lever =
            self.body.radius_of_gyration() + self.body.centroid[0].hypot(self.body.centroid[1]);
        let (bar, displacement) = of_steps;
        let changes = self.changes(last, bar)?;
        let zeta = self.body.vertices.partition.min_max(bar.as_slice()).1.min(1.0);
        for (bar, now) in bars.iter_mut().zip(now) {
            let Some(number) = self.figures.number(&bar.name) else { continue };
            bar.bar += self.tolerance * bar.scale;
            // Places and given lengths have no bars.
            bar.bar += match bar.dimension {
                Dimension::Zeta | Dimension::OfZeta => 0.0,
                Dimension::Force => force.max(of_loads * bar.scale),
                Dimension::Moment => (lever * force).max(of_loads * bar.scale),
                _ => of_loads * bar.scale,
            };
            bar.bar += match bar.dimension {
                Dimension::Zeta if self.figures[number].of != Of::Body => zeta,
                Dimension::Zeta | Dimension::OfZeta => changes[number],
                // σ = ζ𝒜ε(u).
                Dimension::Stress => (displacement + zeta) * now,
                _ => displacement * now,
            };
            // 0 < ζ ≤ 1 bounds every error of ζ.
            bar.bar = bar.bar.min(if bar.dimension.is_damage() { 1.0 } else { f64::INFINITY });
        }
        Ok(())
    }
}

//! The error of ζ from the time steps: the errors of all steps, transported to the present time.
//!
//! The error e of ζ̃ obeys e′ − κΔe = φ(û, ζ + e) − φ(u, ζ) between the steps, where ζ + e is exact and û belongs to it; each step
//! adds its own error. Two fields with this equation bound e from below and above: they take the errors of the steps minus and
//! plus the doubts about them, and otherwise make the steps of ζ̃ itself:
//!
//! (M + kκL) e_n = M (e_{n−1} + β (e_{n−1} − e_{n−2} − error of the step before) + k δφ_n + error of the step),
//!
//! where δφ_n is taken at the e_n that the last two errors extrapolate: before it diffuses, the error of a step may be far too large at
//! a singular point. Euler's steps take the mean of δφ_{n−1} and δφ_n.
//!
//! The strains of û are not solved for. In a bar under one force, of parts in series, they are known: ε̂ = r ε with
//! r = ζ/(ζ + e), or if its ends are prescribed, ε̂ = r/⟨r⟩ ε with the mean ⟨r⟩ by the strain energy. In other bodies ∫ζ ε:𝒜 dε is
//! the same for small e, and the body around a weak spot keeps it from straining that much. If prescribed displacements cause the
//! share s of the strain energy, ε̂ = r ⟨r⟩^−s ε.

use super::{DamageStep, PlannedStep, RunError, SourceLoad, StepController};
use nalgebra::DVector;

impl StepController<'_> {
    /// The estimated error of ζ̃: the mean of its bounds.
    pub(super) fn error(&self) -> DVector<f64> {
        0.5 * (&self.history.errors[0] + &self.history.errors[1])
    }

    /// The estimated error of the last accepted ζ from the time steps, at the nodes.
    pub(crate) fn step_error(&self) -> DVector<f64> {
        self.error() + &self.history.last_error
    }

    /// The error bar of ζ from the time steps, at the nodes.
    pub(crate) fn step_bar(&self) -> DVector<f64> {
        let bounds = self.history.errors.each_ref();
        let [lower, upper] = bounds.map(|error| (error + &self.history.last_error).abs());
        lower.sup(&upper)
    }

    /// Twice the error of the planned Euler step, at the nodes, by the trapezoidal rule:
    ///
    /// k (φ_n − φ_{n−1}) − kκΔ(ζ_n − ζ_{n−1}),   with κΔζ_n = ζ'_n − φ_{n−1} for the `rate` ζ'_n.
    ///
    /// (28) takes the source at the beginning of a step and the diffusion at its end. The first step counts no change of the
    /// diffusion. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub(super) fn twice_euler_error(
        &self,
        planned: &PlannedStep,
        source: &SourceLoad,
        rate: &DVector<f64>,
    ) -> Result<DVector<f64>, RunError> {
        let (vertices, history) = (&self.problem.body.vertices, &self.history);
        let changes = &source.load - &history.source.load + &history.load_change;
        let weights = DVector::from_column_slice(&vertices.weights);
        let of_rate = rate - history.rate.as_ref().unwrap_or(rate);
        let mut twice = planned.k * (changes.component_div(&weights) - of_rate);
        vertices.partition.update(twice.as_mut_slice(), 1)?;
        Ok(twice)
    }

    /// Transports the bounds on the error through a step to ζ_n = `zeta`, with its `source`, and adds the lowest and the highest of the
    /// `errors` of the step. ζ̃_n is `zeta` plus the `correction`. Does a bound reach ζ_*? Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub(super) fn add_error(
        &mut self,
        planned: &PlannedStep,
        errors: [DVector<f64>; 2],
        (zeta, source, correction): (&DVector<f64>, &SourceLoad, &DVector<f64>),
        damage_step: &mut DamageStep,
    ) -> Result<bool, RunError> {
        let (threshold, mut reached) = (self.problem.threshold(), false);
        let omega = planned.length / self.history.length;
        let beta = if self.two_step { omega * omega / (1.0 + 2.0 * omega) } else { 0.0 };
        let before = |i: usize| (&self.history.errors[i], &self.history.error_changes[i]);
        let mut transported = [0, 1].map(|i| {
            let (error, change) = before(i);
            error + beta * (change - &self.history.step_errors[i])
        });
        for (i, transported) in transported.iter_mut().enumerate() {
            let (earlier, change) = before(i);
            let predicted = earlier + omega * change;
            let after = self.source_change(zeta, source, &(predicted + correction))?;
            let of_source =
                if self.two_step { after } else { 0.5 * (&self.history.error_rates[i] + after) };
            *transported += planned.k * of_source + &errors[i];
        }
        damage_step.diffuse(planned, &mut transported)?;
        self.history.step_errors = errors;
        for (i, error) in transported.into_iter().enumerate() {
            // A bound beyond ζ_* says no more.
            let most = -(zeta + correction).add_scalar(-threshold);
            let reaches = error.iter().zip(&most).any(|(error, most)| error <= most);
            reached |= self.problem.body.comm().any(reaches);
            let error = error.sup(&most);
            if !self.two_step {
                self.history.error_rates[i] =
                    self.source_change(zeta, source, &(&error + correction))?;
            }
            self.history.error_changes[i] = &error - &self.history.errors[i];
            self.history.errors[i] = error;
        }
        Ok(reached)
    }

    /// φ(û, ζ + e) − φ(u, ζ) at the nodes for e = `error`, 1/s, where `source` is that of u and ζ. Collective.
    fn source_change(
        &self,
        zeta: &DVector<f64>,
        source: &SourceLoad,
        error: &DVector<f64>,
    ) -> Result<DVector<f64>, RunError> {
        let (problem, vertices) = (self.problem, &self.problem.body.vertices);
        let mut change = DVector::zeros(zeta.len());
        let Some(laws) = problem.damage() else { return Ok(change) };
        let values = |i: usize| [zeta[i], zeta[i] + error[i]].map(|zeta| problem.truncated(zeta));
        let ratio = |[zeta, exact]: [f64; 2]| zeta / exact;
        let (share, energies) = &source.prescribed;
        let mut sums = [0.0; 2];
        for (i, energy) in energies.iter().enumerate() {
            sums[0] += energy * ratio(values(i));
            sums[1] += energy;
        }
        let comm = problem.body.comm();
        let mean = if *share > 0.0 { comm.total(sums[0]) / comm.total(sums[1]) } else { 1.0 };
        let around = mean.powf(-share);
        for i in (0..vertices.partition.owned()).filter(|&i| source.load[i] < 0.0) {
            let (phi, zeta) = (source.load[i] / vertices.weights[i], values(i));
            let stretch = (around * ratio(zeta)).powi(2);
            // A node may belong to several materials.
            let changes = laws.iter().map(|law| self.law.source_change(law, phi, zeta, stretch));
            change[i] = changes.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
        }
        vertices.partition.update(change.as_mut_slice(), 1)?;
        Ok(change)
    }

    /// At the node of minimum `zeta`: its error bar, and ζ′ in this step (`rate`) and in the one before, 1/s. Collective.
    pub(super) fn at_weakest_node(&self, zeta: &DVector<f64>, rate: &DVector<f64>) -> [f64; 3] {
        let partition = &self.problem.body.vertices.partition;
        let weakest = (0..partition.owned()).min_by(|&a, &b| zeta[a].total_cmp(&zeta[b]));
        let (_, rank) = partition.comm().min_with_rank(weakest.map_or(f64::INFINITY, |i| zeta[i]));
        let before = self.history.rate.as_ref().unwrap_or(rate);
        let bar = self.step_bar();
        let values = weakest.map_or([0.0; 3], |i| [bar[i], rate[i], before[i]]);
        values.map(|value| partition.comm().broadcast(rank, value))
    }
}

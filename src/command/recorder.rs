//! What a run shows and writes.

use super::{profile, screen::Screen};
use signorini::{
    evolution::{DiscreteProblem, Outcome, Phases, RunError, Step},
    output::{self, FieldWriter, History, Summary},
    scene::Stepping,
};
use std::{path::Path, time::Instant};

/// Shows and writes the accepted steps; of several ranks only the first shows them.
pub(super) struct Recorder<'a> {
    folder: &'a Path,
    problem: &'a DiscreteProblem,
    phases: &'a Phases,
    solver: &'a str,
    profile: bool,
    /// Triangles, and nodes with a gap condition, of the whole body.
    triangles: usize,
    contact_nodes: usize,
    /// Seconds of all accepted steps after n = 0.
    stepping: f64,
    every: Option<usize>,
    fields: FieldWriter,
    shown: Option<(History, Screen)>,
    last: Option<Step>,
}

/// Frames written, about, when the scene does not say how often.
const FRAMES: usize = 20;

impl<'a> Recorder<'a> {
    /// Of a run by the contact solver called `solver`; shows what is to be solved. Collective.
    pub(super) fn new(
        folder: &'a Path,
        problem: &'a DiscreteProblem,
        solver: &'a str,
        phases: &'a Phases,
        profile: bool,
    ) -> Result<Self, output::OutputError> {
        let (body, comm) = (&problem.body, problem.body.partition.comm());
        let bounds = &problem.constraints.bounds;
        let mut contact_nodes: Vec<usize> = bounds.iter().map(|bound| bound.node).collect();
        contact_nodes.dedup();
        let contact_nodes = comm.count(contact_nodes.len());
        let triangles = comm.count(body.own_triangles);
        let show = || -> Result<_, output::OutputError> {
            let history = History::create(folder)?;
            Ok((history, Screen::open(problem, solver, triangles, contact_nodes)))
        };
        Ok(Self {
            folder,
            problem,
            phases,
            solver,
            profile,
            triangles,
            contact_nodes,
            stepping: 0.0,
            every: problem.scene().output.every,
            fields: FieldWriter::new(folder, problem)?,
            shown: comm.is_root().then(show).transpose()?,
            last: None,
        })
    }

    /// Whether a frame is written of step `n`. Unless the scene says how often, those after 1, 2,
    /// 4, … steps are added for the runs that do not come far.
    fn is_frame(&self, n: usize) -> bool {
        match (self.every, self.problem.scene().time.map(|grid| grid.stepping)) {
            (Some(every), _) => n.is_multiple_of(every),
            (None, Some(Stepping::Uniform { steps })) => {
                let every = steps.div_ceil(FRAMES);
                n.is_multiple_of(every) || (n < every && n.is_power_of_two())
            }
            (None, _) => true,
        }
    }

    pub(super) fn accept(&mut self, step: &Step) -> Result<(), output::OutputError> {
        if step.record.step > 0 {
            self.stepping += step.record.seconds;
        }
        let written = self.phases.time("output", || {
            let shown = self.shown.as_mut().map_or(Ok(()), |(history, screen)| {
                screen.show(&step.record);
                history.add(&step.record)
            });
            // All ranks write a frame, whatever became of the row.
            match self.is_frame(step.record.step) {
                true => shown.and(self.fields.add(self.problem, &step.state)),
                false => shown,
            }
        });
        self.last = Some(step.clone());
        written
    }

    /// Writes the last accepted state, if there is one, and the summary, also of a run that failed.
    /// Collective.
    pub(super) fn finish(
        mut self,
        result: &Result<Outcome, RunError>,
        started: Instant,
    ) -> Result<(), output::OutputError> {
        let (problem, last) = (self.problem, self.last.take());
        let written = match &last {
            Some(Step { state, .. }) if self.fields.last_time() != Some(state.time) => {
                self.phases.time("output", || self.fields.add(problem, state))
            }
            _ => Ok(()),
        };
        let record = last.map(|step| step.record);
        let steps = record.map_or(0, |r| r.step);
        let (wall, scene) = (started.elapsed().as_secs_f64(), problem.scene());
        let mut notes = problem.notes();
        let outcome = result.as_ref().ok();
        notes.extend(outcome.iter().flat_map(|outcome| outcome.notes(problem)));
        let partition = &problem.body.partition;
        let summary = Summary {
            scene: scene.name.clone(),
            title: scene.title.clone(),
            solver: self.solver.to_owned(),
            ranks: partition.comm().size(),
            nodes: partition.total(),
            triangles: self.triangles,
            steps,
            end_time: record.map(|r| r.time),
            stopped_at: outcome.and_then(|o| o.stopped).map(|stop| stop.time),
            stopped_uncertainty: outcome.and_then(|o| o.stopped).map(|stop| stop.uncertainty),
            zeta_min: record.map(|r| r.zeta_min),
            zeta_mean: record.map(|r| r.zeta_mean),
            displacement_max: record.map(|r| r.displacement_max),
            work: record.map(|r| r.work),
            contact_force: record.map(|r| r.contact_force),
            active_nodes: record.map(|r| r.active_nodes),
            contact_nodes: self.contact_nodes,
            kkt: outcome.map(|o| o.kkt).or(record.map(|r| r.kkt())),
            wall_seconds: wall,
            seconds_per_step: wall / steps.max(1) as f64,
            phases: profile::whole(&self.phases.table())
                .into_iter()
                .map(|(name, phase)| (name, phase.seconds))
                .collect(),
            contact_boundary: problem.foundation.contact_boundary.clone(),
            contact_tangents: problem.foundation.tangents.clone(),
            foundation: problem.foundation.segments.clone(),
            notes,
            error: result.as_ref().err().map(ToString::to_string),
        };
        let Some((_, screen)) = &self.shown else { return written };
        summary.write(self.folder)?;
        let phases = self.phases.table();
        let table = match self.profile {
            true => profile::report(&phases, wall, steps, self.stepping),
            false => profile::short(&phases, wall),
        };
        screen.close(&summary, outcome, &table, self.folder);
        written
    }
}

//! Writes the results of a run and shows its progress.

use super::{
    checkpoint::{self, Checkpoint, Recorded},
    figures::LastFigures,
    screen,
    summary::summary,
    task::Task,
};
use serde_json::json;
use signorini::{
    accuracy::Extremes,
    evolution::{Next, Observed, Observer, Outcome, RunError, RunState, Step, StepRecord},
    interrupt::received,
    memory,
    output::{
        self, FieldWriter, OutputError, Table,
        terminal::{Progress, say},
        write_whole,
    },
    petsc::stage,
    scene::{APART, Stepping, rounded},
};
use std::{path::Path, time::Instant};

/// The approximate number of frames if the scene has no `output.every`.
const FRAMES: usize = 20;

/// Writes and shows the accepted steps. Every rank writes its piece of the fields. The first rank writes all
/// other files and shows the progress.
pub(super) struct Recorder<'a> {
    task: &'a Task<'a>,
    fields: FieldWriter,
    /// The progress bar; only the first rank has it.
    progress: Option<Progress>,
    /// `history.csv`; only the first rank writes it.
    history: Table,
    /// The numbers of the figures that a [`StepRecord`] does not have: the columns after it.
    added: Vec<usize>,
    last: Option<Step>,
    /// The iterations of the contact solver, and of the linear solvers in it.
    iterations: [usize; 2],
    /// The time of the last checkpoint.
    saved: Instant,
}

impl<'a> Recorder<'a> {
    /// A recorder for a new run. Shows a description of the task.
    pub(super) fn new(task: &'a Task) -> Result<Self, OutputError> {
        let fields = FieldWriter::new(&task.folder, &task.problem)?;
        let progress = task.problem.body.comm().is_root().then(|| screen::open(task));
        let saved = Instant::now();
        let of_record = json!(StepRecord::default());
        let figures = task.problem.figures.iter().enumerate();
        let added = figures.filter(|(_, of)| of_record.get(&of.name).is_none());
        let added = Vec::from_iter(added.map(|(number, _)| number));
        let more = added.iter().map(|&number| task.problem.figures[number].name.as_str());
        let more = Vec::from_iter(more.chain(["seconds"]));
        let history = Table::new(task.folder.join("history.csv"), &StepRecord::default(), &more)?;
        Ok(Self { task, fields, progress, history, added, last: None, iterations: [0; 2], saved })
    }

    /// Continues from a checkpoint and shows its time.
    pub(super) fn resume(
        &mut self,
        Checkpoint { recorded, run, .. }: &Checkpoint,
    ) -> Result<(), OutputError> {
        self.fields.resume(&recorded.fields)?;
        self.history.resume(recorded.history)?;
        self.last = Some(run.last().clone());
        if self.progress.is_none() {
            return Ok(());
        }
        let record = &run.last().record;
        let from = format!("from step {}, t = {}", record.step, rounded(record.time));
        if !self.task.quiet {
            say(&screen::row("restart", &from));
        }
        output::remove_outdated(&self.task.folder)
    }

    /// Removes the results of an earlier run and writes the scene of this one.
    fn start(&mut self) -> Result<(), OutputError> {
        let Task { folder, as_run, accuracy, .. } = self.task;
        let mesh = self.task.problem.scene().mesh.file.as_path();
        let copied = as_run.copies.iter().map(|(_, file)| file.as_path());
        output::prepare(folder, &Vec::from_iter(copied.chain([mesh])))?;
        write_whole(&folder.join(output::SCENE), as_run.text.as_bytes())?;
        for (name, file) in &as_run.copies {
            output::copy(file, &folder.join(name), &as_run.copies)?;
        }
        if let Some(mesh) = &accuracy.adapted {
            let text = mesh.mesh.to_msh() + output::ADAPTED;
            write_whole(&folder.join(output::MESH), text.as_bytes())?;
        }
        Ok(())
    }

    /// Whether a step gets a frame. Without `output.every` and `output.times` there are additional frames after 1, 2,
    /// 4, … steps, for runs that end early.
    fn is_frame(&self, StepRecord { step: n, time, .. }: &StepRecord) -> bool {
        let scene = self.task.problem.scene();
        let Some(grid) = scene.time else { return true };
        let (times, apart) = (&scene.output.times, APART * grid.end);
        let is_asked = times.iter().any(|asked| (asked - time).abs() <= apart);
        match (scene.output.every, grid.stepping) {
            (None, _) if !times.is_empty() => is_asked,
            (Some(every), _) => is_asked || (every > 0 && n.is_multiple_of(every)),
            (None, Stepping::Uniform { steps }) => {
                let every = steps.div_ceil(FRAMES);
                n.is_multiple_of(every) || (*n < every && n.is_power_of_two())
            }
            (None, Stepping::Auto { .. }) => {
                let part = |time: f64| (FRAMES as f64 * time / grid.end) as usize;
                let before = self.last.as_ref().map_or(0, |step| part(step.record.time));
                *n == 0 || part(*time) > before || (part(*time) == 0 && n.is_power_of_two())
            }
        }
    }

    /// Writes and shows an accepted step. Collective.
    fn write(&mut self, step: &Step) -> Result<(), OutputError> {
        let comm = self.task.problem.body.comm();
        if self.last.is_none() {
            let started = if comm.is_root() { self.start() } else { Ok(()) };
            // The other ranks write after the first one has removed the old results.
            if !comm.all(started.is_ok()) {
                return started;
            }
        }
        let written = stage("output", || {
            let end = self.task.problem.scene().time.map_or(1.0, |grid| grid.end);
            let shown = self.progress.iter_mut().filter(|_| !self.task.quiet);
            shown.for_each(|of| screen::progress(of, &step.record, end));
            let row = match comm.is_root() {
                true => {
                    let added = self.added.iter().map(|&number| step.figures[number].value);
                    let added = Vec::from_iter(added.chain([step.record.seconds]));
                    self.history.add(&[(&step.record, added)])
                }
                false => Ok(()),
            };
            // This is collective: all ranks write the frame, even if the row could not be written.
            match self.is_frame(&step.record) {
                true => row.and(self.fields.add(&self.task.problem, &step.state)),
                false => row,
            }
        });
        self.iterations[0] += step.record.iterations;
        self.iterations[1] += step.record.linear_iterations;
        self.last = Some(step.clone());
        written
    }

    /// Writes the last accepted state and the summary and shows the result, also for a failed run. If the run
    /// has no accepted state, the results of an earlier run stay. Collective.
    pub(super) fn finish(mut self, result: &Result<Outcome, RunError>) -> Result<(), OutputError> {
        let (task, last) = (self.task, self.last.take());
        let written = match &last {
            Some(Step { state, .. }) if self.fields.last_time() != Some(state.time) => {
                stage("output", || self.fields.add(&task.problem, state))
            }
            _ => Ok(()),
        };
        let written = written.and(stage("output", || self.fields.complete()));
        let problem = &task.problem;
        let extremes = last.iter().map(|step| {
            Extremes::of(problem, &step.state, &step.figures, &task.accuracy.measured)
                .map_err(|error| OutputError::new(Path::new("the extreme stresses"), error))
        });
        let (written, extremes) = match extremes.collect::<Result<Vec<_>, _>>() {
            Ok(extremes) => (written, extremes.concat()),
            Err(error) => (written.and(Err(error)), Vec::new()),
        };
        let outcome = result.as_ref().ok();
        let mut notes = task.accuracy.notes(problem, outcome);
        notes.extend(task.notes.iter().cloned().chain(problem.notes()));
        notes.extend(outcome.iter().flat_map(|outcome| outcome.notes(problem)));
        if result.is_ok() {
            checkpoint::remove(&task.folder, task.problem.body.comm().rank(), None);
        }
        let memory = task.problem.body.comm().total(1e-6 * memory::peak());
        // Only the first rank goes on from here.
        let Some(progress) = &self.progress else { return written };

        let record = last.as_ref().map(|step| step.record);
        let figures = last.as_ref().map(|step| LastFigures::new(task, step, &extremes, outcome));
        notes.extend(figures.iter().flat_map(|figures| figures.notes(problem)));
        let warnings = notes.len();
        notes.extend(outcome.iter().flat_map(|outcome| outcome.remarks(problem)));
        let (wall, result) = (task.started.elapsed().as_secs_f64(), result.as_ref());
        if let Some(figures) = &figures {
            let summary = summary(task, record, &figures.all, result, &notes, [wall, memory]);
            let path = task.folder.join("summary.json");
            write_whole(&path, format!("{summary:#}\n").as_bytes())?;
        }
        let shown = if task.verbose { &notes[..] } else { &notes[..warnings] };
        let cost = ([wall, memory], self.iterations);
        let lines = screen::conclusion(task, record, figures.as_ref(), result, shown, cost);
        progress.finish();
        say(&lines.join("\n"));
        written
    }
}

impl Observer for Recorder<'_> {
    fn accept(&mut self, step: &Step) -> Observed<Next> {
        self.write(step)?;
        let seconds = self.task.problem.scene().output.checkpoint;
        // The first rank decides by its clock.
        let due = self.progress.is_some() && self.saved.elapsed().as_secs_f64() > seconds;
        Ok(match received() {
            Some(signal) => Next::End(signal),
            None if due && seconds > 0.0 => Next::Checkpoint,
            None => Next::Step,
        })
    }

    fn keep(&mut self, state: RunState) -> Observed {
        self.fields.complete()?;
        let (fields, history) = (self.fields.written(), self.history.written());
        checkpoint::write(self.task, Recorded { fields, history }, state)?;
        self.saved = Instant::now();
        Ok(())
    }
}

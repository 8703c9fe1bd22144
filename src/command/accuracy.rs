//! Runs with a required accuracy: adapts the mesh before the run, and checks the accuracy after it.

use super::{Failure, screen, task::Task};
use signorini::{
    estimate::{self, AdaptError, Adapted, Extreme, KINKS_OF_TABLE, Measured},
    evolution::{Choices, Outcome, Step, percent},
    interrupt::Signal,
    mesh::{Mesh, Order},
    petsc::Session,
    problem::{Bar, locks},
    scene::{Scene, Stepping},
};

use std::time::Instant;

/// If the scene requires an accuracy: adapts the mesh, or takes the mesh `made` before a restart, and sets the
/// time steps of the scene. Collective.
pub(super) fn adapt(
    session: &Session,
    scene: &mut Scene,
    mesh: &Mesh,
    made: Option<Adapted>,
) -> Result<Option<Adapted>, Failure> {
    let Some(accuracy) = scene.accuracy else { return Ok(None) };
    let is_root = session.comm().is_root();
    let (started, mut is_first) = (Instant::now(), true);
    let mut show = |mesh: &Adapted| {
        if is_root {
            screen::adapting(mesh, accuracy);
            if is_first {
                screen::expected(mesh, accuracy, started.elapsed().as_secs_f64());
            }
            is_first = false;
        }
    };
    let choices = Choices::of(scene);
    let adapt = || estimate::adapted(session, scene, mesh.clone(), &choices, accuracy, &mut show);
    let adapted = made.map_or_else(adapt, Ok);
    let adapted = adapted.map_err(|error| match error {
        AdaptError::Setup(_) | AdaptError::Overturns { .. } => Failure::input(error),
        error => error.signal().map_or_else(|| (&error).into(), interrupted),
    })?;
    if let Some(grid) = &mut scene.time {
        grid.stepping = Stepping::Auto { tolerance: adapted.steps, expected: adapted.damage };
    }
    Ok(Some(adapted))
}

/// Measures the errors from the mesh, in runs with few steps or with the error `of_steps` of ζ. If such a run fails, or a finer
/// mesh would not show the error, one of the `notes` reports it. Collective.
pub(super) fn measure_errors(
    session: &Session,
    scene: &Scene,
    mesh: &Mesh,
    of_steps: Option<f64>,
    notes: &mut Vec<String>,
) -> Result<Measured, Failure> {
    // A mesh that was adapted is so fine that it does not lock.
    if of_steps.is_none() && locks(scene).is_some() {
        notes.push(
            "no error bars: a finer mesh does not show that linear triangles lock".to_owned(),
        );
        return Ok(Measured::default());
    }
    match estimate::measured_errors(session, scene, mesh, &Choices::of(scene), of_steps) {
        Ok(measured) => Ok(measured),
        // The scene fits this mesh, perhaps not the finer one.
        Err(error) => match error.signal() {
            Some(signal) => Err(interrupted(signal)),
            None => {
                notes.push(format!("the error bars could not be measured: {error}"));
                Ok(Measured::default())
            }
        },
    }
}

/// If the run stops at ζ_*, but not the runs with few steps that measured its errors: measures the time of ζ_* with steps
/// whose error is half of ζ_*. Collective.
pub(super) fn confirm_stop(
    session: &Session,
    task: &mut Task,
    outcome: &Outcome,
) -> Result<(), Failure> {
    let Some(adapted) = task.adapted.as_ref().filter(|_| is_unconfirmed_stop(task, outcome)) else {
        return Ok(());
    };
    let scene = task.problem.scene();
    let of_steps = scene.damage.as_ref().map(|damage| 0.5 * damage.law.threshold);
    let measured = measure_errors(session, scene, &adapted.mesh, of_steps, &mut task.notes)?;
    if measured.stop.is_some() {
        task.measured = measured;
    }
    Ok(())
}

/// A signal has ended a run during the adaptation of the mesh.
fn interrupted(signal: Signal) -> Failure {
    let message =
        format!("ended by {signal} while meshes were tried for the accuracy or the error bars");
    Failure { code: signal.exit_code(), message: Some(message) }
}

/// Is there time to repeat a run of some `seconds` with a tolerance of the steps that is smaller by `ratio`? Their errors are of
/// second order. Collective.
pub(super) fn has_time(task: &Task, seconds: f64, ratio: f64) -> bool {
    let passed = task.started.elapsed().as_secs_f64();
    let passed = task.problem.body.nodes.partition.comm().max(passed);
    task.problem.scene().max_seconds.is_none_or(|most| passed + seconds / ratio.sqrt() <= most)
}

/// Whether the run stops at ζ_*, but the runs that measure the errors of the mesh do not: the time steps may cause the stop.
fn is_unconfirmed_stop(task: &Task, outcome: &Outcome) -> bool {
    outcome.stopped.is_some() && task.measured.stop.is_none()
}

/// A note on error bars that are missing although the errors from the mesh were measured.
pub(super) fn missing_bars(task: &Task, outcome: &Outcome) -> Option<String> {
    let is_missing = outcome.stopped.is_none() && outcome.bars.is_empty();
    (is_missing && task.measured.stop.is_some()).then(|| {
        "no error bars: with few time steps, or on a finer mesh, the run stops at ζ_*".to_owned()
    })
}

/// A note on a sound body with a singular stress. On finer meshes this stress grows and may exceed the threshold of the damage,
/// which no error bar tells.
pub(super) fn hidden_damage(task: &Task, last: &Step, extremes: &[Extreme]) -> Option<String> {
    let is_sound = task.problem.damage().is_some() && last.record.zeta_min == 1.0;
    let point = extremes.iter().find_map(|of| of.singular.as_ref()).filter(|_| is_sound)?;
    Some(format!(
        "no damage on this mesh, but the stress is singular at {point}: on finer ones it may exceed the threshold of \
         the damage there, which the error bars do not contain"
    ))
}

/// A note on a pressure that shows the kinks of a table.
pub(super) fn kinks_of_table(extremes: &[Extreme]) -> Option<String> {
    let mut reasons = extremes.iter().filter_map(|of| of.unresolved.as_ref());
    let reason = reasons.find(|reason| reason.ends_with(KINKS_OF_TABLE))?;
    Some(format!("the contact pressure is not resolved ({reason})"))
}

/// A note on curved edges of the adapted mesh that meet at an angle. The error bars do not contain the error of a smooth curve
/// that they only follow roughly.
pub(super) fn kink_note(task: &Task) -> Option<String> {
    let (mesh, scene) = (&task.adapted.as_ref()?.mesh, task.problem.scene());
    let kinks = estimate::kinks(scene, mesh, scene.accuracy?).into_iter();
    let kinks = kinks.filter(|(allowed, kink)| !kink.is_corner && kink.angle > 2.0 * allowed);
    let (_, kink) = kinks.max_by(|(a, p), (b, q)| (p.angle / a).total_cmp(&(q.angle / b)))?;
    let at = mesh.place(mesh.nodes[kink.node]);
    Some(format!(
        "curved edges meet at {at} at an angle of {:.1e}°: if the curve is smooth there, the bars do not \
         contain the error of its shape; set smaller sizes there in the .geo",
        kink.angle.to_degrees()
    ))
}

/// Is the required accuracy reached? With the closing line: the mesh, and the errors that are too large. `None` without
/// a required accuracy.
pub(super) fn accuracy_note(task: &Task, outcome: Option<&Outcome>) -> Option<(bool, String)> {
    let (adapted, scene) = (task.adapted.as_ref()?, task.problem.scene());
    let accuracy = scene.accuracy?;
    let (triangles, rounds) = (adapted.mesh.triangles.len(), adapted.rounds);
    let degree = if scene.order == Order::Quadratic { 2 } else { 1 };
    let mesh = format!(
        "P{degree} on {triangles} triangles, mesh {rounds} of those tried (kept as mesh.msh)"
    );
    let asked = match &scene.accuracy_of[..] {
        [] => format!("accuracy {accuracy}"),
        names => format!("accuracy {accuracy} of {}", names.join(", ")),
    };
    let Some(outcome) = outcome else { return Some((false, format!("{asked}: {mesh}"))) };
    let bars = outcome.bars.iter().filter(|bar| scene.requires_accuracy_of(&bar.name));
    let bars = bars.map(|bar| (bar.name.clone(), bar.relative()));
    let norms = scene.accuracy_of.is_empty().then_some(&adapted.worst).into_iter().flatten();
    let of_stop = outcome.stopped.map(|stop| match stop.bar() / stop.time {
        unknown if unknown.is_nan() => ("stopped_at".to_owned(), f64::INFINITY),
        relative => ("stopped_at".to_owned(), relative),
    });
    let worst = bars.chain(norms.cloned()).chain(of_stop).max_by(|a, b| a.1.total_cmp(&b.1));
    let missed = worst.filter(|(_, error)| *error > accuracy).map(|(name, error)| {
        let error = match percent(error) {
            _ if !error.is_finite() => "?".to_owned(),
            same if same == percent(accuracy) => format!("{:.3} %", 100.0 * error),
            percent => percent,
        };
        format!("{name} is exact to {error} only")
    });
    let unconfirmed = "only this run stops at ζ_*, not the runs that measure its errors".to_owned();
    let unconfirmed = is_unconfirmed_stop(task, outcome).then_some(unconfirmed);
    // Only the limit on the time prevents a repetition.
    let is_last = task.repeats || outcome.shorter_steps(&task.problem, &task.measured).is_none();
    let limit = "a repetition with shorter steps would take longer than --max-seconds".to_owned();
    let limit = (!is_last).then_some(limit);
    let missing = missing_bars(task, outcome);
    let reasons = missed.into_iter().chain(adapted.not_reached.clone()).chain(unconfirmed);
    let reasons = reasons.chain(limit).chain(missing);
    let reasons: Vec<String> = reasons.collect();
    let of_time = if outcome.stopped.is_some() { " in the time of ζ_*" } else { "" };
    let probes: Vec<_> =
        scene.probes.iter().map(|probe| format!("{}.von_mises", probe.name)).collect();
    let at_probe = |bar: &&Bar| probes.contains(&bar.name);
    let stresses = outcome.bars.iter().find(at_probe).map_or_else(String::new, |bar| {
        format!(" (stresses at probes: of {:.1e} {})", bar.scale, scene.units.stress)
    });
    let note = match reasons.is_empty() {
        true => format!("{asked} reached{of_time}{stresses}: {mesh}"),
        false => format!("{asked} NOT reached ({}): {mesh}", reasons.join("; ")),
    };
    Some((reasons.is_empty(), note))
}

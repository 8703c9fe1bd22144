//! Contact solvers and damage sources of other authors: certificate, bars, accuracy and restart work as with ours.

#[path = "../../examples/own_solver.rs"]
mod own_solver;

use crate::support::*;
use own_solver::ProjectedSor;
use signorini::{
    accuracy,
    contact::{
        ChosenSolver, ContactError, ContactProblem, ContactReport, ContactSolver, SharedSolver,
        solvers,
    },
    estimate::Simulation,
    evolution::{Next, Observed, Observer, Outcome, RunOptions, RunState, Step},
    linear::LinearSolver,
    model::{DamagePoint, DamageSource},
    observe::ObservedProblem,
    petsc::{Session, Vector},
    scene::Scene,
};

use std::sync::atomic::{AtomicUsize, Ordering};

/// Calls a function as a damage source.
struct Source<F>(F);

impl<F: Fn(&DamagePoint) -> f64> DamageSource for Source<F> {
    fn source(&self, point: &DamagePoint) -> f64 {
        (self.0)(point)
    }
}

fn sor() -> Box<dyn ContactSolver> {
    Box::new(ProjectedSor { relaxation: 1.6 })
}

/// The block of the example with elements of degree `order`, and more lines of the scene.
fn block(order: usize, further: &str) -> Scene {
    scene(&format!(
        "discretisation.displacement = {order}\n{}\n{further}",
        own_solver::SCENE.replace("mesh.file = \"block.msh\"", "")
    ))
}

/// The paper's source, written once more.
fn paper(point: &DamagePoint) -> f64 {
    let ([xx, yy, twice_xy], law) = ((*point.strain).into(), point.law);
    let zeta = point.zeta.max(law.threshold).min(1.0);
    let square = (xx * xx + yy * yy + 0.5 * twice_xy * twice_xy).min(law.strain_cap);
    (law.lambda_w - law.lambda_d * (1.0 - zeta) / zeta - 0.5 * law.lambda_u * square).min(0.0)
}

#[test]
fn the_papers_source_written_by_another_author_gives_the_same_run() {
    for order in [1, 2] {
        let problem = ObservedProblem::new(block(order, ""), square(6)).unwrap();
        let session = Session::start(&[]).unwrap();
        let own = Simulation::new(&problem).law(Box::new(Source(paper))).run(&session).unwrap();
        let ours = Simulation::new(&problem).run(&session).unwrap();
        assert!(ours.last.record.zeta_min < 0.98, "the law matters");
        assert!(difference(&own.last.state.zeta, &ours.last.state.zeta) < 1e-14);
        assert!(difference(&own.last.state.u, &ours.last.state.u) < 1e-9);
        let [own, ours] = [own, ours].map(|run| run.errors.damage_steps.expect("10 steps"));
        close_relative(own, ours, 1e-6);
    }
}

/// φ = −x in steps k gives ∫(1 − ζ) = t ∫x, as diffusion neither makes nor removes damage: the source sees the place of
/// the point.
#[test]
fn a_source_knows_its_place() {
    for order in [1, 2] {
        let problem = ObservedProblem::new(block(order, ""), distorted(5)).unwrap();
        let session = Session::start(&[]).unwrap();
        let law = Box::new(Source(|point: &DamagePoint| -0.5 * point.place[0]));
        let run = Simulation::new(&problem).law(law).run(&session).unwrap();
        let (body, x) = (&problem.body, problem.body.mesh.nodes.iter().map(|node| node[0]));
        let done = 1.0 - body.mean(&run.last.state.zeta);
        close_relative(done, 0.5 * body.mean(&Vec::from_iter(x)), 1e-12);
    }
}

#[test]
fn a_source_that_heals_or_is_no_number_is_told_with_its_place() {
    let problem = ObservedProblem::new(block(1, ""), square(4)).unwrap();
    let session = Session::start(&[]).unwrap();
    for wrong in [1e-3, f64::NAN] {
        let law = Source(move |point: &DamagePoint| match point.place {
            [x, y] if x > 0.9 && y > 0.9 => wrong,
            _ => 0.0,
        });
        let run = Simulation::new(&problem).law(Box::new(law)).run(&session);
        let message = run.expect_err("the source is refused").to_string();
        let expected =
            format!("gives the source {wrong} 1/s at (1, 1), where ζ = 1; mend the law: ");
        assert!(message.starts_with("step 0 (t = 0): the damage law "), "{message}");
        assert!(message.contains(&expected), "{message}");
    }
}

/// A law that fails in the course of a run: its name is told at its first failure, without shorter steps.
struct Failing<'a>(&'a AtomicUsize);

impl DamageSource for Failing<'_> {
    fn source(&self, point: &DamagePoint) -> f64 {
        if point.zeta > 0.99 {
            return -0.1;
        }
        self.0.fetch_add(1, Ordering::Relaxed);
        f64::NAN
    }
}

#[test]
fn a_law_without_a_number_is_refused_at_once_by_its_name() {
    static FAILED: AtomicUsize = AtomicUsize::new(0);
    let adaptive = "time = { end = 1, step = 'auto' }";
    let text = own_solver::SCENE.replace("mesh.file = \"block.msh\"", "");
    let lines = text.lines().filter(|line| !line.starts_with("time"));
    let text = lines.chain([adaptive]).collect::<Vec<_>>().join("\n");
    let problem = ObservedProblem::new(scene(&text), square(4)).unwrap();
    let session = Session::start(&[]).unwrap();
    let run = Simulation::new(&problem).law(Box::new(Failing(&FAILED))).run(&session);
    let message = run.expect_err("the source is refused").to_string();
    assert!(message.contains("foreign::Failing") && message.contains("NaN"), "{message}");
    // The three points of one triangle.
    assert!(FAILED.load(Ordering::Relaxed) <= 3, "{FAILED:?} calls");
}

/// A solver of another author: it works as one of ours does, or claims to have solved and does nothing.
struct Other(Option<SharedSolver>);

impl ContactSolver for Other {
    fn name(&self) -> &'static str {
        "other"
    }

    fn solve(
        &self,
        problem: &ContactProblem,
        elastic: &mut LinearSolver,
        warm: &mut Vec<f64>,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let done = Ok(ContactReport::default());
        self.0.as_ref().map_or(done, |ours| ours.solve(problem, elastic, warm, c))
    }
}

#[test]
fn a_foreign_solver_that_claims_too_much_is_replaced_or_told() {
    let session = Session::start(&[]).unwrap();
    let run = |further| {
        let problem = ObservedProblem::new(block(1, further), square(4)).unwrap();
        let run = Simulation::new(&problem).solver(Box::new(Other(None))).run(&session);
        run.map(|outcome| (outcome.notes(&problem), outcome))
    };
    let (notes, outcome) =
        run("contact.rescue = true").expect("the default solver gives the answer");
    assert_eq!(outcome.last.report.rescued_by, Some("active-set"));
    assert!(notes.iter().any(|note| note.contains("active-set gave the answer")), "{notes:?}");
    let message = run("contact.rescue = false").expect_err("it is told").to_string();
    assert!(message.contains("other"), "{message}");
}

/// Keeps the checkpoint of step 5.
#[derive(Default)]
struct Keeper(Option<RunState>);

impl Observer for Keeper {
    fn accept(&mut self, step: &Step) -> Observed<Next> {
        Ok(if step.record.step == 5 { Next::Checkpoint } else { Next::Step })
    }

    fn keep(&mut self, state: RunState) -> Observed {
        self.0 = Some(state);
        Ok(())
    }
}

#[test]
fn a_run_with_foreign_parts_goes_on_from_a_checkpoint_bit_by_bit() {
    let problem = ObservedProblem::new(block(1, ""), square(6)).unwrap();
    let session = Session::start(&[]).unwrap();
    fn foreign(problem: &ObservedProblem) -> Simulation<'_> {
        Simulation::new(problem).solver(sor()).law(Box::new(Source(paper)))
    }
    let mut keeper = Keeper::default();
    let whole = foreign(&problem).observer(&mut keeper).run(&session).unwrap();
    let saved = keeper.0.expect("a checkpoint of step 5");
    let resumed = foreign(&problem).resume(saved).run(&session).unwrap();
    let fields = |run: &Outcome| (run.last.state.u.clone(), run.last.state.zeta.clone());
    assert_eq!(fields(&whole), fields(&resumed));
    assert_eq!(whole.last.report.rescued_by, None);
}

#[test]
fn a_mesh_for_an_accuracy_and_its_bars_are_those_of_our_parts() {
    let text = "[[probe]]\nname = 'middle'\npoint = [0.5, 0.5]";
    let (scene, session) = (block(1, text), Session::start(&[]).unwrap());
    let adapted = |run_options: &RunOptions| {
        accuracy::adapted(&session, &scene, square(4), run_options, 0.1, &mut |_| {}).unwrap()
    };
    let named = ChosenSolver::Named("penalty-duality".to_owned());
    let solver = solvers(&named, true, &scene.contact).unwrap().remove(0);
    let solver = Box::new(Other(Some(solver)));
    let own = adapted(&RunOptions::of(&scene).solver(solver).law(Box::new(Source(paper))));
    let ours = adapted(&RunOptions::of(&scene));
    assert_eq!(own.mesh.triangles, ours.mesh.triangles);
    assert!(ours.mesh.triangles.len() > 64, "the mesh was refined");
    assert!(!ours.measured.bars.is_empty());
    for (own, ours) in own.measured.bars.iter().zip(&ours.measured.bars) {
        assert_eq!(own.name, ours.name);
        close(own.bar / ours.scale, ours.bar / ours.scale, 1e-4);
    }
}

#[test]
fn a_source_without_damage_to_do_is_refused() {
    let text = own_solver::SCENE.replace("mesh.file = \"block.msh\"", "");
    let undamaged =
        Vec::from_iter(text.lines().filter(|line| !line.starts_with("damage"))).join("\n");
    let problem = ObservedProblem::new(scene(&undamaged), square(4)).unwrap();
    let session = Session::start(&[]).unwrap();
    let run = Simulation::new(&problem).law(Box::new(Source(paper))).run(&session);
    let message = run.expect_err("there is no damage").to_string();
    assert!(message.ends_with("it needs [damage] and [time]"), "{message}");
}

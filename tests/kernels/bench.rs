//! What a time step is made of, on Example I with n = 128: `cargo bench`, compared with the last
//! time it ran. `make bench` measures whole steps.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use signorini::{
    cholesky::{Factor, Precision},
    contact::SOLVERS,
    evolution::{ContactStep, DiscreteProblem},
    fem::{DamageSystem, Stiffness, source, source_load},
    petsc::{Session, Vector},
    phases::Phases,
    scene::Scene,
    study,
};
use std::{hint::black_box, path::Path, time::Duration};

const CELLS: usize = 128;

fn problem() -> DiscreteProblem {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("geo/square-mild.toml");
    let scene = Scene::read(&path, &[]).expect("a scene of this project");
    DiscreteProblem::new(scene, study::rectangle(1.0, 1.0, CELLS, CELLS)).expect("a mesh for it")
}

/// A damage field such as the scene's at the given time: worst at the corner (1, 0).
fn damaged(problem: &DiscreteProblem, time: f64) -> Vec<f64> {
    let at = |&[x, y]: &[f64; 2]| 1.0 - 0.2 * time * (-4.0 * ((1.0 - x).hypot(y))).exp();
    problem.body.mesh.nodes.iter().map(at).collect()
}

/// A displacement that strains every triangle differently.
fn displaced(problem: &DiscreteProblem) -> Vec<f64> {
    problem.body.mesh.nodes.iter().flat_map(|&[x, y]| [0.1 * x * y, -0.2 * x * x]).collect()
}

fn stiffness(c: &mut Criterion) {
    let (session, problem) = (Session::start(&[]).unwrap(), problem());
    let bases = &problem.constraints.bases;
    let mut k = Stiffness::new(&session, &problem.body, &problem.elasticity, bases).unwrap();
    let mut matrix = k.matrix.duplicate().unwrap();
    let bounded: Vec<usize> = problem.constraints.bounds.iter().map(|bound| bound.dof).collect();
    let mut factor = Factor::new(&session, "elastic_", Precision::Preconditioner);
    // The values count as new only when they are written.
    let mut renew = |k: &Stiffness, factor: &mut Factor| {
        matrix.copy(&k.matrix).unwrap();
        matrix.zero_rows_columns(&bounded, k.scale).unwrap();
        factor.factorise(&matrix).unwrap()
    };
    renew(&k, &mut factor);

    let means = problem.triangle_means(&damaged(&problem, 0.5));
    let mut x = Vector::zeros(&session, k.matrix.owned()).unwrap();
    let mut y = Vector::zeros(&session, k.matrix.owned()).unwrap();
    x.set(&displaced(&problem)).unwrap();
    c.bench_function("stiffness refill", |b| b.iter(|| k.refill(black_box(&means)).unwrap()));
    c.bench_function("product", |b| b.iter(|| k.matrix.multiply(&x, &mut y).unwrap()));
    c.bench_function("triangular solves", |b| b.iter(|| factor.apply(&x, &mut y).unwrap()));
    c.bench_function("factorisation", |b| b.iter(|| renew(&k, &mut factor)));
}

fn certificate(c: &mut Criterion) {
    let problem = problem();
    let (means, u) = (problem.triangle_means(&damaged(&problem, 0.5)), displaced(&problem));
    c.bench_function("internal force", |b| {
        b.iter(|| problem.elasticity.internal_force(&problem.body, &means, black_box(&u)));
    });
}

fn damage(c: &mut Criterion) {
    let (session, problem) = (Session::start(&[]).unwrap(), problem());
    let (body, mass, law) = (&problem.body, problem.mass(), problem.damage().unwrap());
    let (u, zeta) = (displaced(&problem), damaged(&problem, 0.5));
    let load = |u: &[f64]| {
        let strain = problem.elasticity.strain_squared(body, u);
        source_load(body, mass, &source(body, &law, &strain, &zeta))
    };
    c.bench_function("damage source", |b| b.iter(|| load(black_box(&u))));
    let mut system = DamageSystem::new(&session, body, mass, law.diffusion, 0.01).unwrap();
    let load = load(&u);
    c.bench_function("damage solve", |b| {
        b.iter(|| system.advance(&load, &mut zeta.clone()).unwrap());
    });
}

/// A step from an accepted one to damage 1 % further on or back, on the factor that is kept as
/// in a run, renewals included.
fn contact(c: &mut Criterion) {
    let (session, problem, phases) = (Session::start(&[]).unwrap(), problem(), Phases::default());
    let mut group = c.benchmark_group("contact step");
    let accepted = damaged(&problem, 0.5);
    let next = [0.45, 0.55].map(|time| damaged(&problem, time));
    for solver in SOLVERS {
        let mut contact_step = ContactStep::new(&session, &problem, solver, &phases).unwrap();
        contact_step.solve(0, 0.5, &accepted).unwrap();
        contact_step.accept(0.5).unwrap();
        let mut turn = 0;
        group.bench_function(BenchmarkId::from_parameter(solver), |b| {
            b.iter(|| {
                turn += 1;
                let step = contact_step.solve(1, 0.51, &next[turn % 2]).unwrap();
                contact_step.undo().unwrap();
                step.record.zeta_min
            });
        });
    }
    group.finish();
}

fn brief() -> Criterion {
    let criterion = Criterion::default().sample_size(10);
    criterion.warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2))
}

criterion_group! { name = kernels; config = brief(); targets = stiffness, certificate, damage, contact }
criterion_main!(kernels);

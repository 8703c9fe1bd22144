//! What a time step is made of, on Example I: `cargo bench`, compared with the last time it ran.
//! `make bench` measures whole steps.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use signorini::{
    contact::SOLVERS,
    evolution::{ContactStep, DiscreteProblem},
    fem::{DamageSystem, Stiffness, source, source_load},
    linear::{Factor, Precision},
    mesh::Mesh,
    petsc::{Matrix, Session, Vector},
    phases::Phases,
    scene::Scene,
};
use std::{hint::black_box, path::Path, time::Duration};

/// Cells a side of the square.
const CELLS: usize = 128;
/// k, s.
const STEP: f64 = 0.01;

fn problem(cells: usize) -> DiscreteProblem {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("geo/square-mild.toml");
    let scene = Scene::read(&path, &[]).expect("a scene of this project");
    DiscreteProblem::new(scene, Mesh::rectangle(1.0, 1.0, cells, cells)).expect("a mesh for it")
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

/// b(φ(ε(u), ζ)).
fn damage_load(problem: &DiscreteProblem, u: &[f64], zeta: &[f64]) -> Vec<f64> {
    let (body, law) = (&problem.body, problem.damage().unwrap());
    let strain = problem.elasticity.strain_squared(body, u);
    source_load(body, problem.mass(), &source(body, law, &strain, zeta))
}

fn damage_system(session: &Session, problem: &DiscreteProblem) -> DamageSystem {
    let diffusions = problem.diffusions();
    DamageSystem::new(session, &problem.body, problem.mass(), &diffusions, STEP).unwrap()
}

/// K, its copy with the contact unknowns prescribed, and the factor of that.
struct Elastic {
    k: Stiffness,
    prescribed: Matrix,
    bounded: Vec<usize>,
    factor: Factor,
}

impl Elastic {
    fn new(session: &Session, problem: &DiscreteProblem) -> Self {
        let constraints = &problem.constraints;
        let k = Stiffness::new(session, &problem.body, &problem.elasticity, &constraints.bases);
        let k = k.unwrap();
        let prescribed = k.matrix.duplicate().unwrap();
        let bounded = constraints.bounds.iter().map(|bound| bound.dof).collect();
        let factor = Factor::new(session, Precision::Preconditioner);
        let mut elastic = Self { k, prescribed, bounded, factor };
        elastic.factorise();
        elastic
    }

    /// The values count as new only when they are written.
    fn factorise(&mut self) {
        self.prescribed.copy(&self.k.matrix).unwrap();
        self.prescribed.zero_rows_columns(&self.bounded, self.k.scale).unwrap();
        self.factor.factorise(&self.prescribed).unwrap();
    }
}

/// What no step can do without.
fn passes(c: &mut Criterion) {
    let (session, problem) = (Session::start(&[]).unwrap(), problem(CELLS));
    let mut group = c.benchmark_group("passes");
    let Elastic { k, factor, .. } = &mut Elastic::new(&session, &problem);
    let mut damage = damage_system(&session, &problem);
    let (u, zeta) = (displaced(&problem), damaged(&problem, 0.5));
    let (means, load) = (problem.zeta_at_points(&zeta), damage_load(&problem, &u, &zeta));
    let vector = || Vector::zeros(&session, k.matrix.owned()).unwrap();
    let (mut x, mut y, mut z) = (vector(), vector(), vector());
    x.set(&u).unwrap();
    k.matrix.multiply(&x, &mut y).unwrap();

    group.bench_function("damage solve", |b| {
        b.iter(|| damage.advance(&load, &mut zeta.clone()).unwrap());
    });
    group.throughput(Throughput::Bytes(k.bytes_per_refill(&problem.body) as u64));
    group.bench_function("stiffness refill", |b| {
        let DiscreteProblem { body, elasticity, constraints, .. } = &problem;
        b.iter(|| k.refill(body, elasticity, &constraints.bases, black_box(&means)).unwrap());
    });
    group.throughput(Throughput::Bytes(k.matrix.bytes_per_product() as u64));
    group.bench_function("product", |b| {
        b.iter(|| k.matrix.multiply(&x, &mut y).unwrap());
    });
    group.throughput(Throughput::Bytes(factor.bytes_per_application() as u64));
    group.bench_function("triangular solves", |b| {
        b.iter(|| factor.apply(&y, &mut z).unwrap());
    });
    group.finish();
}

fn factorisation(c: &mut Criterion) {
    let (session, problem) = (Session::start(&[]).unwrap(), problem(CELLS));
    let mut elastic = Elastic::new(&session, &problem);
    c.bench_function("factorisation", |b| b.iter(|| elastic.factorise()));
}

fn damage_source(c: &mut Criterion) {
    let problem = problem(CELLS);
    let (u, zeta) = (displaced(&problem), damaged(&problem, 0.5));
    c.bench_function("damage source", |b| b.iter(|| damage_load(&problem, black_box(&u), &zeta)));
}

fn certificate(c: &mut Criterion) {
    let problem = problem(CELLS);
    let (means, u) = (problem.zeta_at_points(&damaged(&problem, 0.5)), displaced(&problem));
    c.bench_function("internal force", |b| {
        b.iter(|| problem.elasticity.internal_force(&problem.body, &means, black_box(&u)));
    });
}

/// A step from an accepted one to damage 1 % further on or back, on the factor that is kept as
/// in a run, renewals included.
fn contact(c: &mut Criterion) {
    let (session, problem, phases) =
        (Session::start(&[]).unwrap(), problem(CELLS), Phases::default());
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
                contact_step.solve(1, 0.51, &next[turn % 2]).unwrap().record.zeta_min
            });
        });
    }
    group.finish();
}

fn brief() -> Criterion {
    let criterion = Criterion::default().sample_size(10);
    criterion.warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2))
}

criterion_group! { name = kernels; config = brief(); targets = passes, factorisation, certificate, damage_source, contact }
criterion_main!(kernels);

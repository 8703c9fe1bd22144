//! The maximum principle of the damage step: φ ≤ 0, so max ζ never rises and min ζ falls by
//! no more than k min φ.

use crate::support::{
    DAMAGE_LAW, Random, close, distorted, largest, moved, problem, random_strains, run, square,
};
use signorini::{
    evolution::{BoundViolation, ObservedProblem, Outcome},
    fem::{Body, DamageSystem, Mass, source, source_load},
    mesh::{Mesh, Order},
    model::{DamageLaw, Fremond},
    petsc::Session,
};

const LAW: DamageLaw = DamageLaw { lambda_d: 0.1, lambda_w: 0.2, strain_cap: 10.0, ..DAMAGE_LAW };

/// The mesh size of `square(10)`, m.
const H: f64 = 0.1;

/// By how much a step with kκ = `ratio` h² leaves the bounds at most, over random ζ and
/// strains; ζ is at most 1.
fn violation(body: &Body, mass: Mass, ratio: f64) -> f64 {
    let session = Session::start(&[]).unwrap();
    let n = body.mesh.nodes.len();
    let step = ratio * H * H / LAW.diffusion;
    let mut system = DamageSystem::new(&session, body, mass, &[LAW.diffusion], step).unwrap();
    let mut random = Random::new(7);
    let mut worst = f64::NEG_INFINITY;
    for _ in 0..20 {
        let zeta: Vec<f64> = random.field(n).iter().map(|v| 0.55 + 0.45 * v.signum()).collect();
        let (strains, _) = random_strains(&mut random, body.triangles.len());
        let phi = source(body, (&Fremond, &[LAW]), &strains, &zeta).unwrap();
        let mut next = zeta.clone();
        assert!(system.advance(&source_load(body, mass, &phi), &mut next).unwrap());
        // The sharpest bounds: of ζ + kφ, triangle by triangle.
        let driven = body
            .mesh
            .triangles
            .iter()
            .zip(&phi)
            .flat_map(|(nodes, phi)| [0, 1, 2].map(|i| zeta[nodes[i]] + step * phi[i]));
        let (low, high) = driven.fold((f64::MAX, f64::MIN), |(l, h), z| (l.min(z), h.max(z)));
        for z in next {
            worst = worst.max(z - high).max(low - z);
        }
    }
    worst
}

/// kκ/h² below and above where the consistent mass begins to hold. In one dimension that is 1/6.
const BELOW: [f64; 5] = [1e-8, 1e-4, 1e-2, 0.1, 1.0 / 6.0];
const ABOVE: [f64; 3] = [0.6, 1.0, 100.0];

#[test]
fn the_lumped_mass_keeps_the_bounds_for_every_step_without_obtuse_angles() {
    let body = Body::new(square(10), Order::Linear);
    for ratio in BELOW.into_iter().chain(ABOVE) {
        let violation = violation(&body, Mass::Lumped, ratio);
        assert!(violation < 1e-12, "kκ/h² = {ratio}: {violation}");
    }
}

#[test]
fn the_consistent_mass_leaves_the_bounds_where_diffusion_is_small() {
    let body = Body::new(square(10), Order::Linear);
    for ratio in BELOW {
        // Diffusion alone leaves them by some kκ/h² where that is small.
        let violation = violation(&body, Mass::Consistent, ratio);
        assert!(violation > 0.1 * ratio, "kκ/h² = {ratio}: {violation}");
    }
    for ratio in ABOVE {
        let violation = violation(&body, Mass::Consistent, ratio);
        assert!(violation < 1e-12, "kκ/h² = {ratio}: {violation}");
    }
}

#[test]
fn obtuse_angles_break_the_lumped_mass_too() {
    let body = Body::new(moved(square(10), |[x, y]| [x + y, y]), Order::Linear);
    let violation = violation(&body, Mass::Lumped, 0.1);
    assert!(violation > 1e-3, "{violation}");
}

#[test]
fn both_masses_integrate_constants_alike() {
    let body = Body::new(distorted(6), Order::Linear);
    let mut random = Random::new(3);
    let (strains, _) = random_strains(&mut random, body.triangles.len());
    let zeta: Vec<f64> =
        random.field(body.mesh.nodes.len()).iter().map(|v| 0.6 + 0.3 * v).collect();
    let phi = source(&body, (&Fremond, &[LAW]), &strains, &zeta).unwrap();
    let [consistent, lumped] =
        [Mass::Consistent, Mass::Lumped].map(|m| source_load(&body, m, &phi));
    close(lumped.iter().sum(), consistent.iter().sum(), 1e-14);
    let apart: Vec<f64> = lumped.iter().zip(&consistent).map(|(a, b)| a - b).collect();
    assert!(largest(&apart) > 1e-4, "they are not the same");
}

/// A soft square in an unloaded body, ζ = `low` in it: kκ/h² is `ratio` for ten steps.
fn soft_square(mesh: Mesh, low: f64, ratio: f64, mass: &str) -> ObservedProblem {
    let distance = "max(abs(x - 0.5), abs(y - 0.5)) - 0.26";
    let initial = format!("{low} + {}*min(1, max(0, 1e6*({distance})))", 1.0 - low);
    let text = format!(
        "material = {{ young = 80, poisson = 0.3, plane = 'stress' }}
         damage = {{ diffusion = {:?}, lambda_d = 0, lambda_u = 1, lambda_w = 0, strain_cap = 1,
                     threshold = 0.01, initial = '{initial}' {mass} }}
         time = {{ end = 1, step = 0.1, scheme = 'euler' }}
         boundary = [{{ name = 'left', displacement = [0, 0] }}]",
        10.0 * ratio / 64.0
    );
    problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"))
}

fn outcome(low: f64, ratio: f64, mass: &str) -> (Outcome, Vec<String>) {
    let problem = soft_square(square(8), low, ratio, mass);
    let outcome = run(&problem, "active-set");
    let notes = outcome.notes(&problem);
    (outcome, notes)
}

#[test]
fn a_run_says_when_it_leaves_the_bounds_and_only_then() {
    let (outcome, notes) = outcome(0.1, 0.1, "");
    assert_eq!(outcome.bound_violation.first, Some((1, 0.1)));
    assert!(
        outcome.bound_violation.above > 1e-3 && outcome.bound_violation.below > 1e-3,
        "{:?}",
        outcome.bound_violation
    );
    let [note] = notes.as_slice() else { panic!("{notes:?}") };
    for said in ["above by ", "below by ", "step 1 ", "damage.mass = \"lumped\""] {
        assert!(note.contains(said), "{note}");
    }
    assert_eq!(self::outcome(0.1, 1.0, "").1, [""; 0], "a larger kκ cures it");
    assert_eq!(self::outcome(0.1, 0.1, ", mass = 'lumped'").1, [""; 0], "lumping cures it");
}

#[test]
fn the_mass_is_blamed_only_where_diffusion_is_small() {
    let violation =
        BoundViolation { above: 1e-3, first: Some((1, 0.1)), k: 0.1, ..BoundViolation::default() };
    // kκ/h² = 0.1 and 10.
    for (slowest, lumping_helps) in [(1.0, true), (100.0, false)] {
        let note = violation.note(Mass::Consistent, slowest).unwrap();
        assert_eq!(note.contains("set damage.mass"), lumping_helps, "{note}");
        assert_eq!(note.contains("obtuse angles, or"), !lumping_helps, "{note}");
    }
}

#[test]
fn what_many_small_steps_add_up_is_seen() {
    // The excess is that over the start, not that over the step before.
    let (outcome, _) = outcome(0.1, 1e-7, "");
    let problem = soft_square(square(8), 0.1, 1e-7, "");
    let rise = outcome.last.state.zeta.iter().copied().fold(f64::MIN, f64::max)
        - problem.initial_damage().iter().copied().fold(f64::MIN, f64::max);
    assert!(rise > 1e-7, "{rise}");
    close(outcome.bound_violation.above / rise, 1.0, 1e-12);
}

#[test]
fn a_stop_that_the_sources_do_not_allow_is_named() {
    // No source: ζ cannot fall below 0.02, and ζ_* = 0.01.
    let (consistent, notes) = outcome(0.02, 0.1, "");
    let stop = consistent.stopped.unwrap();
    close(stop.least_admissible, 0.02, 1e-14);
    assert!(notes[0].contains("too early") && notes[0].contains("0.0200"), "{notes:?}");
    let (lumped, notes) = outcome(0.02, 0.1, ", mass = 'lumped'");
    assert!(lumped.stopped.is_none() && notes.is_empty());
}

#[test]
fn a_stop_that_they_allow_is_not() {
    let text = "
        material = { young = 80, poisson = 0.3, plane = 'stress' }
        damage = { diffusion = 1, lambda_d = 0, lambda_u = 2e7, lambda_w = 0, strain_cap = 1000,
                   threshold = 0.01, initial = 1, mass = 'lumped' }
        time = { end = 1, step = 0.01 }
        boundary = [
            { name = 'left', displacement = [0, 0] },
            { name = 'right', traction = [-0.1, -0.1] },
        ]";
    let problem = problem(square(8), text).unwrap();
    let outcome = run(&problem, "active-set");
    assert!(outcome.stopped.unwrap().least_admissible <= 0.01);
    assert_eq!(outcome.notes(&problem), [""; 0]);
}

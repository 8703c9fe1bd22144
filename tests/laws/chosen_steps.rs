//! Chosen steps keep their tolerance, and no more steps are made than that takes.

use crate::support::{distorted, history, largest, moved, problem, shipped, square};
use signorini::{
    contact::SOLVERS,
    evolution::{ObservedProblem, Outcome, Step},
    scene::Stepping,
};

/// Damage done at the end, at the worst node and in the mean.
fn done(steps: &[Step]) -> [f64; 2] {
    let [first, last] = [steps.first(), steps.last()].map(|step| step.unwrap().record);
    [first.zeta_min - last.zeta_min, first.zeta_mean - last.zeta_mean]
}

/// Example II on a coarse mesh.
fn lshape(stepping: &str, load: &str) -> (Vec<Step>, Outcome) {
    let load = format!("boundary.load.traction=['0', '{load}']");
    let gap = "boundary.foundation.gap=1e-3";
    let uniform = ["discretisation.displacement=1", "mesh.parameters.grading=1", "mesh.size=1"];
    let scene = shipped("lshape", &[&uniform[..], &[stepping, &load, gap]].concat());
    history(&scene, SOLVERS[0])
}

/// The damage done by this load, from two fine uniform runs whose first-order error is extrapolated away.
fn exact(load: &str) -> [f64; 2] {
    let [coarse, fine] = ["time.step=0.002", "time.step=0.001"].map(|k| done(&lshape(k, load).0));
    [0, 1].map(|i| 2.0 * fine[i] - coarse[i])
}

/// The largest error of the damage done, relative.
fn error(steps: &[Step], exact: [f64; 2]) -> f64 {
    let found = done(steps);
    (found[0] / exact[0] - 1.0).abs().max((found[1] / exact[1] - 1.0).abs())
}

#[test]
fn the_damage_done_is_within_the_tolerance_with_fewer_steps_than_uniform_ones() {
    // A load that grows, one that swings, and one that rolls over the arm: at its end the errors of
    // uniform steps have cancelled.
    let rolling = "-160*max(0, 1 - abs(x - 8*t)/2)";
    for load in ["-80*t", "-80*sin(4*t)", rolling] {
        let (steps, outcome) = lshape("time.step=auto", load);
        let made = outcome.last.record.step + outcome.rejected;
        let exact = exact(load);
        let error = error(&steps, exact);
        println!("{load}: {made} steps, {} rejected, error {error:.2e}", outcome.rejected);
        assert!(error < 0.01, "{load}: {error}");
        let uniform = lshape(&format!("time.step={}", 1.0 / made as f64), load).0;
        let uniform = self::error(&uniform, exact);
        let better = error < uniform || load == rolling;
        assert!(better, "{load}: {error} in {made} steps, uniform {uniform}");
    }
}

#[test]
fn steps_end_at_the_times_of_output_and_are_no_more_than_these_take() {
    let run = |sets: &[&str]| {
        let plain = ["discretisation.displacement=1", "mesh.parameters.grading=1", "mesh.size=1"];
        history(&shipped("lshape", &[&plain[..], &["time.step=auto"], sets].concat()), SOLVERS[0])
    };
    let (free, _) = run(&[]);
    let (steps, outcome) = run(&["output.times=[0.9, 0.1234, 0.12341]"]);
    for time in [0.1234, 0.12341, 0.9, 1.0] {
        assert!(steps.iter().any(|step| step.state.time == time), "{time}");
    }
    let lengths = steps.windows(2).map(|pair| pair[1].state.time - pair[0].state.time);
    assert!(lengths.fold(1.0, f64::min) > 0.9e-5);
    // Two times that are near need a short step, after which the steps double: 1e-5 · 2¹² = 0.04.
    println!("{} steps, {} with times, {} rejected", free.len(), steps.len(), outcome.rejected);
    assert!(steps.len() <= free.len() + 2 * 3 + 12);
    let differ = (done(&steps)[0] / done(&free)[0] - 1.0).abs();
    assert!(differ < 0.01, "{differ}");
}

#[test]
fn lengths_are_the_longest_one_over_powers_of_the_root_of_2_so_that_a_factor_serves_many_steps() {
    for load in ["-80*t", "-80*sin(4*t)", "if(t < 0.6, -40, -80)"] {
        let (steps, outcome) = lshape("time.step=auto", load);
        let length = |pair: &[Step]| pair[1].state.time - pair[0].state.time;
        // The last two steps reach the end, and a step may end at a jump.
        let lengths: Vec<f64> = steps.windows(2).map(length).collect();
        let powers = lengths.iter().map(|length| 2.0 * (0.05 / length).log2());
        let others = powers.filter(|times| (times - times.round()).abs() > 1e-6).count();
        println!("{load}: {} steps, {others} of other lengths", outcome.last.record.step);
        assert!(lengths.len() > 12 && others <= 3, "{load}: {lengths:?}");
        // A length is kept for two steps on average.
        let kept = lengths.windows(2).filter(|pair| (pair[0] / pair[1] - 1.0).abs() < 1e-6).count();
        assert!(2 * kept >= lengths.len(), "{load}: {lengths:?}");
    }
}

#[test]
fn a_load_that_closes_the_gap_between_two_steps_is_noticed() {
    // Nothing for half of the run, then all at once: the body falls on the foundation.
    let load = "-80*min(1, max(0, 1000*(t - 0.503)))";
    let (steps, _) = lshape("time.step=auto", load);
    let [before, after] = [0, steps.len() - 1].map(|n| steps[n].record.active_nodes);
    assert!(before == 0 && after > 0, "{before} {after}");
    // Less than half of the steps before, where nothing happens.
    let early = steps.iter().filter(|step| step.state.time < 0.5).count();
    assert!(2 * early < steps.len(), "{early} of {}", steps.len());
    let error = error(&steps, exact(load));
    assert!(error < 0.01, "{error} in {} steps", steps.len());
}

/// A square that is bent down on a foundation, with this λ_U.
fn bent(lambda_u: f64, stepping: &str) -> ObservedProblem {
    let text = format!(
        "material = {{ young = 80, poisson = 0.3, plane = 'stress' }}
         damage = {{ diffusion = 0.1, lambda_d = 0.25, lambda_u = {lambda_u:e}, lambda_w = 0,
                     strain_cap = 1000, threshold = 0.01, initial = 1 }}
         time = {{ end = 1, {stepping} }}
         boundary = [
            {{ name = 'left', displacement = [0, 0] }},
            {{ name = 'bottom', gap = '0.1*x^2' }},
            {{ name = 'top', traction = [0, '-3*t'] }},
         ]"
    );
    problem(distorted(6), &text).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_sound_body_takes_few_steps() {
    let count = |lambda_u: f64, tolerance: f64| {
        let stepping = format!("step = 'auto', tolerance = {tolerance:e}");
        let (_, outcome) = history(&bent(lambda_u, &stepping), SOLVERS[0]);
        outcome.last.record.step + outcome.rejected
    };
    // No damage, negligible damage, damage.
    let [none, negligible, some] = [0.0, 1e-6, 10.0].map(|lambda_u| count(lambda_u, 1e-3));
    assert!(none == negligible && none < 40, "{none} {negligible}");
    assert!(some > 2 * none, "{some} against {none}");
}

/// A clamped square over a foundation under this traction on its top.
fn pressed(load: &str, stepping: &str) -> ObservedProblem {
    let text = format!(
        "material = {{ young = 100, poisson = 0.3, plane = 'stress' }}
         damage = {{ diffusion = 0.01, lambda_d = 0.1, lambda_u = 250, lambda_w = 0,
                     strain_cap = 1000, threshold = 0.01, initial = 1 }}
         time = {{ end = 1, {stepping} }}
         boundary = [
            {{ name = 'left', displacement = [0, 0] }},
            {{ name = 'bottom', gap = 0.01 }},
            {{ name = 'top', traction = [0, '{load}'] }},
         ]"
    );
    problem(square(6), &text).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn the_errors_of_all_steps_together_stay_within_the_tolerance() {
    // A load that fades, so that damage stops early; a short pulse; one that swings.
    let cases = [
        ("-2*exp(-5*t)", 0.01),
        ("-2*exp(-5*t)", 1e-3),
        ("-2*max(0, 1 - abs(t - 0.02)*100)", 0.01),
        ("-2*(1 - cos(12*pi*t))", 1e-3),
    ];
    for (load, tolerance) in cases {
        let fine = history(&pressed(load, "step = 2e-4, scheme = 'bdf2'"), SOLVERS[0]).1;
        let stepping = format!("step = 'auto', tolerance = {tolerance:e}");
        let scene = pressed(load, &stepping);
        let found = history(&scene, SOLVERS[0]).1;
        let [fine, zeta] = [&fine, &found].map(|outcome| &outcome.last.state.zeta);
        let error: Vec<f64> = zeta.iter().zip(fine).map(|(a, b)| (a - b).abs()).collect();
        let damage: Vec<f64> = fine.iter().map(|zeta| 1.0 - zeta).collect();
        let mean = scene.body.mean(&error) / scene.body.mean(&damage);
        let true_error = mean.max(largest(&error) / largest(&damage));
        let (steps, said) = (found.last.record.step, found.damage_error.unwrap());
        println!("{load}: {steps} steps, error {true_error:.2e}, said {said:.2e} of {tolerance:e}");
        assert!(true_error < tolerance && said < tolerance, "{load}: {true_error} {said}");
        let ratio = said / true_error;
        assert!((0.5..=2.0).contains(&ratio), "{load}: {ratio}");
    }
}

#[test]
fn errors_are_compared_with_the_damage_expected_at_the_end_where_it_is_known() {
    let run = |expected: [f64; 2]| {
        let mut scene = pressed("-2*t", "step = 'auto'").scene().clone();
        let stepping = Stepping::Auto { tolerance: 1e-3, expected };
        scene.time.iter_mut().for_each(|grid| grid.stepping = stepping);
        let problem = ObservedProblem::new(scene, square(6)).unwrap();
        let (steps, outcome) = history(&problem, SOLVERS[0]);
        (done(&steps), outcome.last.record.step, outcome.damage_error.unwrap())
    };
    let damage = run([0.0; 2]).0;
    // What is expected; a hundredth of it, which the damage soon exceeds; and ten times as much.
    let [right, low, high] = [1.0, 0.01, 10.0].map(|factor| run(damage.map(|d| factor * d)));
    println!("{right:?} {low:?} {high:?}");
    assert!(right.2 < 1e-3 && high.2 > 2.0 * right.2, "{} {}", right.2, high.2);
    assert!(high.1 < right.1 && right.1 < low.1, "{} {} {}", high.1, right.1, low.1);
}

#[test]
fn damage_that_begins_in_a_corner_does_not_stop_the_steps() {
    // Healing keeps all but a small corner sound at first: its damage of 1e-7 is no measure for errors.
    let columns = [0.0, 0.002, 0.5, 0.998, 1.0];
    let graded = moved(square(4), |place| place.map(|x| columns[(4.0 * x) as usize]));
    let text = "
        discretisation.displacement = 2
        material = { young = 100, poisson = 0.3, plane = 'stress' }
        damage = { diffusion = 0.01, lambda_d = 0.1, lambda_u = 2000, lambda_w = 0.02,
                   strain_cap = 1000, threshold = 0.01, initial = 1 }
        time = { end = 1, step = 'auto', tolerance = 0.005 }
        boundary = [
            { name = 'left', displacement = [0, 0] },
            { name = 'bottom', gap = 0 },
            { name = 'top', traction = [0, '-60*t'] },
        ]";
    let problem = problem(graded, text).unwrap_or_else(|e| panic!("{e}"));
    let (steps, outcome) = history(&problem, SOLVERS[0]);
    let made = steps.len() + outcome.rejected;
    assert!(made < 300, "{made} steps");
    assert!(outcome.stopped.is_some(), "it breaks");
}

#[test]
fn the_error_of_two_step_differences_is_estimated_within_0_8_and_1_25_of_it() {
    // At the corners of the square early errors are large, and diffusion spreads them.
    let run = |sets: &[&str]| {
        let scene = shipped("square-mild", &[&["mesh.size=0.125"], sets].concat());
        let outcome = history(&scene, SOLVERS[0]).1;
        (scene, outcome)
    };
    let fine = run(&["time.scheme=bdf2", "time.step=2e-3"]).1.last.state.zeta;
    for steps in [&["time.step=auto"][..], &["time.scheme=bdf2", "time.step=0.02"]] {
        let (scene, outcome) = run(steps);
        let norm = |of: &dyn Fn(usize) -> f64| {
            let squares: Vec<f64> = (0..fine.len()).map(|i| of(i).powi(2)).collect();
            scene.body.mean(&squares).sqrt()
        };
        let error = norm(&|i| outcome.last.state.zeta[i] - fine[i]) / norm(&|i| 1.0 - fine[i]);
        let ratio = outcome.errors.damage_steps.unwrap() / error;
        println!("{steps:?}: error {error:.2e}, estimated over true: {ratio:.2}");
        assert!((0.8..=1.25).contains(&ratio), "{steps:?}: {ratio}");
    }
}

#[test]
fn steps_that_miss_their_tolerance_are_noted() {
    let scene = bent(10.0, "step = 'auto', tolerance = 0.01");
    let mut outcome = history(&scene, SOLVERS[0]).1;
    let error = outcome.damage_error.unwrap();
    assert!(0.0 < error && error < 0.01, "{error}");
    for (error, is_noted) in [(error, false), (0.02, true)] {
        outcome.damage_error = Some(error);
        let notes = outcome.notes(&scene);
        let noted = notes.iter().any(|note| note.contains("set a lower one"));
        assert_eq!(noted, is_noted, "{notes:?}");
    }
    let uniform = history(&bent(10.0, "step = 0.1"), SOLVERS[0]).1;
    assert_eq!(uniform.damage_error, None);
}

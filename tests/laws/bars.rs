//! Error bars: a figure is off by no more than its bar, and the bar is no idle one.

use crate::support::{adapted, layered, scene, solved, square};
use signorini::{
    accuracy::{self, Adapted},
    evolution::{ObservedProblem, Outcome, RunOptions},
    mesh::Mesh,
    observe::Bar,
    petsc::Session,
    scene::Scene,
};
use std::f64::consts::FRAC_PI_2;

/// A block that is clamped on the left, pressed on top, and rests on a foundation below.
fn block(order: u8, more: &str, gap: &str, load: &str) -> Scene {
    scene(&format!(
        "{more}
         discretisation.displacement = {order}
         material = {{ young = 1000, poisson = 0.3, plane = 'stress' }}
         boundary = [
            {{ name = 'left', displacement = [0, 0] }},
            {{ name = 'bottom', gap = \"{gap}\" }},
            {{ name = 'top', traction = ['0', \"{load}\"] }},
         ]"
    ))
}

/// work, displacement_max and contact_force.
fn figures(outcome: &Outcome) -> [f64; 3] {
    let record = &outcome.last.record;
    [record.work, record.displacement_max, record.contact_force]
}

fn bar(bars: &[Bar], name: &str) -> f64 {
    bars.iter().find(|bar| bar.name == name).unwrap_or_else(|| panic!("no bar of {name}")).bar
}

/// A scene on n × n cells of the square, solved with error bars.
fn with_bars(scene: &Scene, n: usize) -> (ObservedProblem, Outcome) {
    let problem = ObservedProblem::new(scene.clone(), square(n)).unwrap();
    let mut outcome = solved(scene.clone(), square(n));
    let session = Session::start(&[]).unwrap();
    let measured =
        accuracy::measured_errors(&session, scene, [&square(n); 2], &RunOptions::of(scene), None)
            .unwrap();
    outcome.set_bars(&problem, &measured).expect("PETSc works");
    (problem, outcome)
}

#[test]
fn a_figure_on_a_given_mesh_is_off_by_no_more_than_its_bar_which_is_no_idle_one() {
    // The corner of the clamp on the foundation makes figures converge slowly, in both orders.
    let mut idle = Vec::new();
    let exact = adapted(&block(2, "", "0", "-5"), square(4), 1e-3).mesh;
    let exact = figures(&solved(block(2, "", "0", "-5"), exact));
    for order in [1, 2] {
        let scene = block(order, "", "0", "-5");
        for n in [4, 8, 16] {
            let found = figures(&solved(scene.clone(), square(n)));
            let session = Session::start(&[]).unwrap();
            let bars = accuracy::measured_errors(
                &session,
                &scene,
                [&square(n); 2],
                &RunOptions::of(&scene),
                None,
            );
            let bars = bars.unwrap_or_else(|error| panic!("{error}"));
            let names = ["work", "displacement_max", "contact_force"];
            for ((name, found), exact) in names.iter().zip(found).zip(exact) {
                let (error, bar) = ((found - exact).abs(), bar(&bars.bars, name));
                println!("order {order}, n = {n}, {name}: off by {error:.2e}, bar {bar:.2e}");
                assert!(error < 1.02 * bar, "{name}: {error:e} beyond {bar:e}");
                idle.push(bar / error);
            }
        }
    }
    // By chance an error may be much smaller than those before and after it.
    idle.sort_by(f64::total_cmp);
    assert!(idle[idle.len() / 2] < 3.0, "{idle:?}");
}

/// A ring of straight triangles on a shaft that is too large by 1e-3 (Lamé): the polygon is too short and too stiff. The mesh has no
/// geometry.
#[test]
fn bars_of_linear_elements_contain_the_error_of_the_polygon() {
    let ring = scene(
        "material = { young = 1000, poisson = 0.3, plane = 'stress' }
         boundary = [
            { name = 'bottom', symmetry = true },
            { name = 'top', symmetry = true },
            { name = 'left', gap = -0.001 },
         ]",
    );
    let pressure = 1.0 / (5.0 / 3.0 + 0.3);
    let exact = [("contact_length", FRAC_PI_2), ("contact_force", FRAC_PI_2 * pressure)];
    let mut errors = Vec::new();
    for n in [2, 4, 8] {
        let mut mesh = Mesh::rectangle(1.0, 1.0, n, 2 * n);
        for node in &mut mesh.nodes {
            let (r, (sine, cosine)) = (1.0 + node[0], (FRAC_PI_2 * node[1]).sin_cos());
            *node = [r * cosine, r * sine];
        }
        let (curved, notes) = mesh.on_smooth_curves();
        assert!(notes.len() == 1 && notes[0].contains("no geometry"), "{notes:?}");
        let problem = ObservedProblem::new(ring.clone(), mesh.clone()).unwrap();
        let outcome = solved(ring.clone(), mesh.clone());
        let session = Session::start(&[]).unwrap();
        let options = RunOptions::of(&ring);
        let meshes = [&mesh, &curved];
        let bars = accuracy::measured_errors(&session, &ring, meshes, &options, None).unwrap().bars;
        for (name, exact) in exact {
            let found = outcome.last.figures[problem.figures.number(name).unwrap()].value;
            let (error, bar) = ((found - exact).abs(), bar(&bars, name));
            println!("{n}, {name}: off by {error:.2e}, bar {bar:.2e}");
            assert!(
                error <= bar && bar < 4.0 * error,
                "{n}, {name}: off by {error:e}, bar {bar:e}"
            );
            errors.push(error);
        }
    }
    let mut orders = errors.windows(3).map(|of| (of[0] / of[2]).log2());
    assert!(orders.all(|order| (1.8..2.3).contains(&order)), "{errors:?}");
}

#[test]
fn an_accuracy_is_that_of_every_figure() {
    // A force that a clamp takes beside the foundation is far less exact than the norms of u.
    let reference = adapted(&block(2, "", "0", "-5"), square(4), 1e-3).mesh;
    let reference = figures(&solved(block(2, "", "0", "-5"), reference));
    for accuracy in [0.03, 0.01] {
        let scene = block(2, "", "0", "-5");
        let Adapted { mesh, not_reached, worst, .. } = adapted(&scene, square(2), accuracy);
        let (name, error) = worst.expect("it is measured");
        assert!(not_reached.is_none() && error <= accuracy, "{not_reached:?}, {name}: {error}");
        for (found, exact) in figures(&solved(scene, mesh)).iter().zip(reference) {
            assert!((found - exact).abs() < accuracy * exact, "{found} is not {exact}");
        }
    }
}

#[test]
fn a_figure_asked_for_alone_takes_a_smaller_mesh() {
    let all = adapted(&block(2, "", "0", "-5"), square(2), 3e-3).mesh.triangles.len();
    let alone = block(2, "accuracy = 3e-3\naccuracy_of = ['work']", "0", "-5");
    let Adapted { mesh, worst, .. } = adapted(&alone, square(2), 3e-3);
    assert!(worst.is_some_and(|(name, error)| name == "work" && error <= 3e-3));
    assert!(4 * mesh.triangles.len() < 3 * all, "{} of {all}", mesh.triangles.len());

    let session = Session::start(&[]).unwrap();
    let wrong = block(2, "accuracy = 3e-3\naccuracy_of = ['contact_forces']", "0", "-5");
    let found =
        accuracy::adapted(&session, &wrong, square(2), &RunOptions::of(&wrong), 3e-3, &mut |_| {});
    let message = found.err().map_or_else(String::new, |error| error.to_string());
    assert!(message.contains("did you mean `contact_force`"), "{message}");
}

#[test]
fn a_foundation_with_a_kink_between_the_nodes_is_found() {
    // Contact at x = 0.37, where the edge of a coarse mesh is a hundred times as long as contact is wide.
    let wedge = || block(2, "", "0.00002 + 0.05*abs(x - 0.37)", "-0.05");
    let force = |accuracy| {
        let found = solved(wedge(), adapted(&wedge(), square(4), accuracy).mesh);
        found.last.record.contact_force
    };
    let exact = force(0.01);
    assert!(exact > 1e-3, "the wedge carries {exact}");
    assert!((force(0.1) - exact).abs() < 0.1 * exact);
}

#[test]
fn contact_between_the_nodes_is_found_and_noted() {
    // A roller of radius 1 m, of which no node of a mesh of size 0.1 comes near; its contact is 8 mm wide.
    let roller = || block(2, "", "0.00001 + 0.5*(x - 0.57)^2", "-0.05");
    let given = solved(roller(), square(10));
    assert_eq!(given.last.record.active_nodes, 0);
    let problem = ObservedProblem::new(roller(), square(10)).unwrap();
    let notes = given.notes(&problem).join("\n");
    assert!(notes.contains("between its nodes, boundary \"bottom\""), "{notes}");
    let exact = figures(&solved(roller(), adapted(&roller(), square(10), 0.01).mesh));
    assert!(exact[2] > 0.25 * 0.05, "the roller carries {}", exact[2]);
    for accuracy in [0.1, 0.03] {
        let found = solved(roller(), adapted(&roller(), square(10), accuracy).mesh);
        for (found, exact) in figures(&found).iter().zip(exact) {
            assert!((found - exact).abs() < accuracy * exact, "{found} is not {exact}");
        }
    }
}

#[test]
fn a_force_that_statics_determines_is_off_by_no_more_than_its_bar_wherever_a_load_jumps() {
    // Both meshes of the measurement integrate a load over the same parts: its quadrature is not in their difference.
    let (mut errors, mut bars) = (Vec::new(), Vec::new());
    for k in 1..24 {
        let at = f64::from(k).sqrt() / 5.0;
        for (degree, load, force) in [
            (1, format!("traction = [0, '-if(x < {at}, 0, 1)']"), 1.0 - at),
            (2, format!("traction = [0, '-if(x < {at}, 1, -0.5)']"), at - 0.5 * (1.0 - at)),
            (1, format!("pressure = 'if(x > {at}, x^2, 0)'"), (1.0 - at.powi(3)) / 3.0),
            (2, format!("pressure = 'max(0, x - {at})'"), 0.5 * (1.0 - at).powi(2)),
            (1, "pressure = 'sin(3*x)'".to_owned(), (1.0 - 3.0_f64.cos()) / 3.0),
        ] {
            let scene = scene(&format!(
                "discretisation.displacement = {degree}
                 material = {{ young = 1000, poisson = 0.3, plane = 'stress' }}
                 boundary = [{{ name = 'bottom', displacement = [0, 0] }}, {{ name = 'top', {load} }}]"
            ));
            let (problem, outcome) = with_bars(&scene, 3);
            let error =
                (crate::support::figures(&problem, &outcome.last)["bottom.force_y"] - force).abs();
            let bar = bar(&outcome.bars, "bottom.force_y");
            assert!(error <= bar, "P{degree}, {load}: off by {error:.1e}, bar {bar:.1e}");
            errors.push(error);
            bars.push(bar);
        }
    }
    // Some errors are far above the solver's tolerance, and no bar is idle.
    let largest = |of: &[f64]| of.iter().copied().fold(0.0, f64::max);
    assert!(largest(&errors) > 1e-8 && largest(&bars) < 1e-5);
}

/// The travel of a foundation is given: it has no bar, and is no scale of displacements.
#[test]
fn a_foundation_that_comes_from_far_away_leaves_the_bars_as_they_are() {
    let bars = [0.0, 10.0].map(|far: f64| {
        let scene = scene(&format!(
            "material = {{ young = 1000, poisson = 0.3, plane = 'stress' }}
             time = {{ end = 1, step = 0.25 }}
             boundary = [{{ name = 'top', displacement = [0, 0] }},
                         {{ name = 'bottom', gap = '{far}*(1 - t)^4 - 0.01*t' }}]"
        ));
        let (problem, outcome) = with_bars(&scene, 4);
        let travel = crate::support::figures(&problem, &outcome.last)["bottom.travel"];
        assert!((travel - far - 0.01).abs() < 1e-12, "{travel}");
        assert!(outcome.bars.iter().all(|bar| bar.name != "bottom.travel"));
        // Only the foundation that is far away has a first contact.
        let bars = outcome.bars.iter().filter(|bar| !bar.name.ends_with("first_contact"));
        bars.map(|bar| (bar.name.clone(), bar.relative())).collect::<Vec<_>>()
    });
    for ((name, near), (_, far)) in bars[0].iter().zip(&bars[1]) {
        assert!((near - far).abs() <= 1e-6 * near.max(1e-9), "{name}: {near}, {far}");
    }
}

#[test]
fn the_error_of_u_is_measured_where_an_estimate_sees_too_little_of_it() {
    // Recovered strains of a layer of one or two triangles say 0.7 to 0.9 of the error. Without contact the answer on a finer mesh
    // has the energy of this one and that of the error: ‖u‖² − ‖u_h‖² = ‖u − u_h‖², with the work ½ ‖u‖².
    for (length, accuracy) in [(20.0, 0.05), (60.0, 0.05), (200.0, 0.02)] {
        let bar = || {
            scene(
                "accuracy = 0.1
                 discretisation.displacement = 2
                 material = { young = 1000, poisson = 0.3, plane = 'stress' }
                 boundary = [
                    { name = 'left', displacement = [0, 0] },
                    { name = 'top', traction = [0, -1e-6] },
                 ]",
            )
        };
        let mesh = || Mesh::rectangle(length, 1.0, (length / 6.0) as usize, 1);
        let work = |accuracy| {
            let found = adapted(&bar(), mesh(), accuracy);
            assert_eq!(found.not_reached, None);
            (solved(bar(), found.mesh.clone()).last.record.work, found)
        };
        let ((work, found), (exact, _)) = (work(accuracy), work(accuracy / 10.0));
        let (error, measured) = ((1.0 - work / exact).sqrt(), found.measured.displacement);
        println!(
            "length {length}: {error:.4}, measured {measured:.4}, estimated {:.4}",
            found.error
        );
        assert!(error <= accuracy, "{error} beyond {accuracy}");
        assert!((measured / error - 1.0).abs() < 0.08, "{measured} for {error}");
    }
}

/// A column, E = 100, hangs from its top. A load t² pulls it down by t²/E onto a foundation at 0.003: there at t = √0.3.
#[test]
fn a_first_contact_is_off_by_no_more_than_its_bar_which_is_within_its_step() {
    let scene_of = |gap: f64, steps: f64| {
        scene(&format!(
            "time = {{ end = 1, step = {} }}
             material = {{ young = 100, poisson = 0, plane = 'stress' }}
             boundary = [
                {{ name = 'top', displacement = ['free', 0] }},
                {{ name = 'left', symmetry = true }},
                {{ name = 'bottom', gap = {gap}, traction = [0, '-t^2'] }},
             ]",
            1.0 / steps
        ))
    };
    for steps in [4.0, 10.0, 23.0] {
        let (problem, outcome) = with_bars(&scene_of(0.003, steps), 3);
        let exact = [
            ("bottom.first_contact", 0.3_f64.sqrt()),
            ("bottom.load_x_at_first_contact", 0.0),
            ("bottom.load_y_at_first_contact", -0.3),
        ];
        for (name, exact) in exact {
            let value = outcome.last.figures[problem.figures.number(name).unwrap()].value;
            let (error, bar) = ((value - exact).abs(), bar(&outcome.bars, name));
            println!("{steps}: {name} = {value} ± {bar} for {exact}");
            // d(t²)/dt is at most 2.
            let most = if name.ends_with("bottom.first_contact") { 1.01 } else { 2.0 } / steps;
            assert!(error <= bar && bar < most, "{steps}, {name}: {value} ± {bar}");
        }
    }
    // It stays open, or touches from the start.
    let (problem, outcome) = with_bars(&scene_of(0.02, 10.0), 3);
    let number = problem.figures.number("bottom.first_contact").unwrap();
    assert!(outcome.last.figures[number].value.is_nan());
    let closed = ObservedProblem::new(scene_of(0.0, 10.0), square(3)).unwrap();
    assert_eq!(closed.figures.number("bottom.first_contact"), None);
}

/// In the upper half λ_U is five times as large, and the damage hardly spreads: ζ = 1 − c t and 1 − 5c t. The consistent mass overshoots
/// at the jump between them, on every mesh alike.
#[test]
fn the_bar_of_the_least_zeta_contains_the_overshoot_at_a_jump() {
    for order in [1, 2] {
        let scene = scene(&format!(
            "discretisation.displacement = {order}
             time = {{ end = 1, step = 0.05 }}
             material = {{ young = 1, poisson = 0, plane = 'stress' }}
             damage = {{ diffusion = 1e-9, lambda_d = 0, lambda_u = 400, upper.lambda_u = 2000 }}
             boundary = [
                {{ name = 'left', symmetry = true }},
                {{ name = 'bottom', symmetry = true }},
                {{ name = 'right', displacement = [0.01, 'free'] }},
             ]"
        ));
        let exact = 1.0 - 0.5 * 2000.0 * 0.01 * 0.01;
        for n in [4, 8, 16] {
            let mesh = layered(square(n));
            let problem = ObservedProblem::new(scene.clone(), mesh.clone()).unwrap();
            let mut outcome = solved(scene.clone(), mesh.clone());
            let session = Session::start(&[]).unwrap();
            let options = RunOptions::of(&scene);
            let measured =
                accuracy::measured_errors(&session, &scene, [&mesh; 2], &options, None).unwrap();
            outcome.set_bars(&problem, &measured).expect("PETSc works");
            let (zeta, bar) = (outcome.last.record.zeta_min, bar(&outcome.bars, "zeta_min"));
            println!("P{order}, {n}: {zeta} ± {bar} for {exact}");
            assert!((zeta - exact).abs() > 1e-3, "no overshoot");
            // The bar is that of fewer steps.
            assert!(
                (zeta - exact).abs() <= 1.02 * bar,
                "P{order}, {n}: {zeta} ± {bar} for {exact}"
            );
        }
    }
}

/// A manufactured field: p = 40 (¼ − x²) up to x = ½, beside which the gap opens like 2e-5 (x − ½)² and the side is pulled by 40 (x² − ¼).
/// On meshes of linear elements small pressures go on far into the gap.
#[test]
fn the_bar_of_a_length_of_contact_contains_faint_contact() {
    for (order, sizes) in [(1, [6, 8, 12]), (2, [4, 6, 8])] {
        let scene = scene(&format!(
            "discretisation.displacement = {order}
             material = {{ young = 2e4, poisson = 0.3, plane = 'strain' }}
             boundary = [
                {{ name = 'bottom', gap = '2e-5*max(0, x - 0.5)^2 - 3.64e-4*x^2',
                   traction = ['0', '-max(0, 40*(x^2 - 0.25))'] }},
                {{ name = 'right', traction = ['40*x^2 - 120*y^2 - 16*y - 10', '-80*x*y'] }},
                {{ name = 'top', traction = ['-80*x*y', '40*x^2 + 40*y^2 - 10'] }},
                {{ name = 'left', displacement = ['0', '1.04e-3/0.75*y^3 + 1.56e-4*y^2 - 2.6e-4*y'] }},
             ]"
        ));
        for n in sizes {
            let (problem, outcome) = with_bars(&scene, n);
            let found = outcome.last.figures[problem.figures.number("contact_length").unwrap()];
            let (error, bar) = ((found.value - 0.5).abs(), bar(&outcome.bars, "contact_length"));
            println!("order {order}, n = {n}: {} ± {bar:.3}", found.value);
            assert!(error <= bar, "order {order}, n = {n}: {} ± {bar}", found.value);
            assert!(order == 1 || bar < 0.3, "order {order}, n = {n}: ± {bar}");
        }
    }
}

//! Resultants of supports: what is zero, what the boundaries at a common node exert, and which loads balance.

use crate::{
    free_motions::disc,
    support::{
        self, ORDERS, adapted, bent, close, distorted, history, moved, order, problem, run, scene,
        square, turn, unstructured,
    },
};
use signorini::{
    contact::SOLVERS,
    evolution::{ObservedProblem, SetupError},
    mesh::{Mesh, Order},
};
use std::{collections::BTreeMap, f64::consts::PI};

/// The figures of the last state, by name.
fn figures(problem: &ObservedProblem) -> BTreeMap<String, f64> {
    support::figures(problem, &run(problem, SOLVERS[0]).last)
}

fn of_order(mesh: Mesh, order: Order, text: &str) -> Result<ObservedProblem, SetupError> {
    let material = "material = { young = 100, poisson = 0.3, plane = 'stress' }";
    let text = format!("discretisation.displacement = {}\n{material}\n{text}", 1 + order as u8);
    problem(mesh, &text)
}

#[test]
fn forces_that_balance_have_a_scale_and_need_no_finer_mesh() {
    // Exact on the first mesh: a bar in pure bending at any angle, a square pressed between axes, one that is moved without
    // strain, and one that slides on a foundation without pressing it.
    let material = "accuracy = 0.02\nmaterial = { young = 1e5, plane = 'stress', poisson";
    let bend = |angle: f64| {
        let ([c, s], across) = (turn(angle, [1.0, 0.0]), turn(-angle, [0.0, 1.0]));
        let height = format!("({} * x + {} * y - 0.5)", across[0], across[1]);
        let height = height.replace("+ -", "- ");
        format!(
            "= 0.3 }}\nboundary = [{{ name = 'left', symmetry = true }},
             {{ name = 'right', traction = ['{} * {height}', '{} * {height}'] }}]",
            100.0 * c,
            100.0 * s
        )
    };
    let moves = "= 0.3 }\nboundary = [{ name = 'left', displacement = [1, 2] },
                 { name = 'right', displacement = [1, 2] }]";
    let turns = "= 0.3 }\nprobe = [{ name = 'p', point = [0.5, 0.9] }]
                 boundary = [{ name = 'left', displacement = ['-1e-3*y', '1e-3*x'] }]";
    let slides =
        "= 0 }\nboundary = [{ name = 'left', symmetry = true }, { name = 'bottom', gap = 0 },
                  { name = 'top', symmetry = true }, { name = 'right', traction = [1, 0] }]";
    let bar = |angle: f64| moved(unstructured(0.3), move |[x, y]| turn(angle, [5.0 * x, y]));
    let bodies = [
        (bar(0.0), bend(0.0)),
        (bar(0.4), bend(0.4)),
        (bar(2.0), bend(2.0)),
        (unstructured(0.2), moves.to_owned()),
        (unstructured(0.2), turns.to_owned()),
        (unstructured(0.2), slides.to_owned()),
    ];
    for (mesh, text) in bodies {
        let (scene, triangles) = (scene(&format!("{material} {text}")), mesh.triangles.len());
        let found = adapted(&scene, mesh.clone(), 0.02);
        assert!(
            found.not_reached.is_none() && found.rounds == 1,
            "{:?}\n{text}",
            found.not_reached
        );
        assert_eq!(found.mesh.triangles.len(), triangles, "{text}");
        for bar in found.measured.bars {
            assert!(bar.bar <= 1e-6 * bar.scale, "{bar:?}\n{text}");
        }
        // The resultant of each side, and the stress at the probe, are rounding or as large as the load.
        let problem = ObservedProblem::new(scene, mesh).unwrap();
        for (name, value) in figures(&problem) {
            let is_force =
                [".force", "pressure", "stress", "mises"].iter().any(|of| name.contains(of));
            assert!(!is_force || value == 0.0 || value.abs() > 1e-3, "{name} {value:e}\n{text}");
        }
    }
}

#[test]
fn contact_without_force_has_no_figures_and_light_contact_has() {
    // A square between an axis and a wall that comes back to it at the end, exactly or up to `left`.
    for order in ORDERS {
        for wall in ["-0.01*sin(pi*t)", "-0.02*min(t, 1 - t)", "-0.01*(1 - t)*t^0.5"] {
            for left in [0.0, 1e-6, -1e-6] {
                let text = format!(
                    "time = {{ end = 1, step = 0.25 }}
                     boundary = [{{ name = 'left', symmetry = true }},
                     {{ name = 'bottom', symmetry = true }},
                     {{ name = 'right', gap = '{wall} + ({left})' }}]"
                );
                let problem = of_order(distorted(4), order, &text).unwrap();
                let last = history(&problem, SOLVERS[0]).1.last;
                let found = support::figures(&problem, &last);
                let pressed = left < 0.0;
                let name = format!("P{} {wall} {left}", 1 + order as u8);
                assert_eq!(last.record.active_nodes > 0, pressed, "{name}");
                assert_eq!(last.record.contact_force > 0.0, pressed, "{name}");
                assert_eq!(found["right.pressure_max"] > 0.0, pressed, "{name}");
                close(found["right.contact_length"], f64::from(u8::from(pressed)), 1e-12);
                assert_eq!(found["right.contact_start_x"].is_nan(), !pressed, "{name}");
                assert_eq!(found["right.peak_y"].is_nan(), !pressed, "{name}");
            }
        }
    }
}

/// Two sides with displacements and two with tractions, by the stress (σ_xx, σ_yy, σ_xy) and u as functions of x and y.
fn supported(stress: [&str; 3], left: [&str; 2], bottom: [&str; 2]) -> String {
    let [xx, yy, xy] = stress;
    format!(
        "boundary = [{{ name = 'left', displacement = {left:?} }},
         {{ name = 'bottom', displacement = {bottom:?} }},
         {{ name = 'right', traction = ['{xx}', '{xy}'] }},
         {{ name = 'top', traction = ['{xy}', '{yy}'] }}]"
    )
}

#[test]
fn supports_with_a_common_node_exert_their_tractions_exactly_in_a_patch() {
    // σ = (3, −2, 0.5) with E = 100 and ν = 0.3; without shear, one side prescribes u·ν alone.
    let u = ["0.036*x + 0.0065*y", "-0.029*y + 0.0065*x"];
    let plain = ["0.036*x", "-0.029*y"];
    let clamp = (["3", "-2", "0.5"], u, u, [-3.0, -0.5, -0.5, 2.0]);
    let axis = (["3", "-2", "0"], [plain[0], "free"], plain, [-3.0, 0.0, 0.0, 2.0]);
    for order in ORDERS {
        for mesh in [distorted(3), distorted(5), unstructured(0.3)] {
            for (stress, left, bottom, expected) in [clamp, axis] {
                let text = supported(stress, left, bottom);
                let found = figures(&of_order(mesh.clone(), order, &text).unwrap());
                let names = ["left.force_x", "left.force_y", "bottom.force_x", "bottom.force_y"];
                for (name, expected) in names.into_iter().zip(expected) {
                    close(found[name], expected, 1e-9);
                }
            }
        }
    }
}

#[test]
fn supports_with_a_common_node_converge_faster_than_the_mesh() {
    // σ = (6y, 6xy, −3x²) is in equilibrium; u by E = 100 and ν = 0.3. The force on the side `left`, −∫6y = −3, and all
    // moments converge, and both sides together balance the load exactly.
    let u = [
        "(6*x*y - 0.9*x^2*y - y^3)/100".to_owned(),
        "(-3*x^2 - 0.9*y^2 + 3*x*y^2 - 2.3*x^3)/100".to_owned(),
    ];
    let u = u.each_ref().map(String::as_str);
    for (order_of_u, least) in ORDERS.into_iter().zip([1.5, 2.5]) {
        for left in [u, [u[0], "free"]] {
            let sizes = [4, 8, 16];
            let errors = sizes.map(|n| {
                let text = supported(["6*y", "6*x*y", "-3*x^2"], left, u);
                let problem = of_order(square(n), order_of_u, &text).unwrap();
                let found = figures(&problem);
                let sum = |axis: &str| {
                    found[&format!("left.force_{axis}")] + found[&format!("bottom.force_{axis}")]
                };
                // The load is ∫(6y − 3x²) and ∫(6x − 3) over the sides.
                close(sum("x"), -2.0, 1e-9);
                close(sum("y"), 0.0, 1e-9);
                (found["left.force_x"] + 3.0).abs().max(1e-12)
            });
            let rate = order(&sizes.map(|n| 1.0 / n as f64), &errors);
            assert!(
                rate > least || errors[2] < 1e-9,
                "P{}: {rate} {errors:?}",
                1 + order_of_u as u8
            );
        }
    }
}

#[test]
fn a_load_along_a_curve_balances_within_the_error_of_its_edges() {
    // Half rings between axes, of circles and ellipses with uneven edges: f_x is odd in x and so balances, or not.
    let ring = |nx: usize, stretch: f64, order: Order| {
        let place = move |[a, r]: [f64; 2]| {
            let [x, y] =
                turn(PI - a - 0.2 * (2.0 * a).sin() - 0.1 * (1.0 - a.cos()) * a.sin(), [r, 0.0]);
            [stretch * x, y]
        };
        let flat = moved(Mesh::rectangle(PI, 1.0, nx, 3), |[x, y]| [x, 1.0 + y]);
        match order {
            Order::Linear => moved(flat, place),
            Order::Quadratic => bent(&flat, place),
        }
    };
    let cut = "{ name = 'left', symmetry = true }, { name = 'right', symmetry = true }";
    let driven = |problem| matches!(problem, Err(SetupError::Driven { .. }));
    for order in ORDERS {
        for (nx, stretch) in [(20, 1.0), (40, 1.0), (80, 1.0), (40, 1.5), (80, 1.5), (80, 0.7)] {
            for load in ["x", "x*y^2", "exp(x) - exp(-x)", "if(x > 0, 1, -1)"] {
                for side in ["top", "bottom"] {
                    let with = |more: f64| {
                        let load = format!("traction = ['{load} + ({more})', 0]");
                        let text = format!("boundary = [{cut}, {{ name = '{side}', {load} }}]");
                        of_order(ring(nx, stretch, order), order, &text)
                    };
                    let name = format!("P{} {nx} {stretch} {load} {side}", 1 + order as u8);
                    assert!(!driven(with(0.0)), "{name}");
                    assert!(driven(with(0.05)) && driven(with(-0.05)), "{name}");
                }
            }
        }
    }
    // Discs under tractions that balance by symmetry, and under 1 % of them on one side more.
    for (n, uneven) in [(24, 0.0), (24, 0.05), (48, 0.1), (96, 0.1)] {
        for [x, y] in [["x - 3", "0"], ["0", "(y - 2)^3"], ["y - 2", "x - 3"]] {
            let with = |more: &str| {
                let load = format!("traction = ['{x} + {more}', '{y}']");
                let text = format!("boundary = [{{ name = 'rim0', {load} }}]");
                of_order(disc(n, uneven, 1), Order::Linear, &text)
            };
            assert!(!driven(with("0")) && driven(with("0.02")), "{n} {uneven} {x} {y}");
        }
    }
}

/// A square, turned by an angle, with u = a + (ε + ω) x on the sides of the corner at the origin: what `left` prescribes by
/// component, the gap of `bottom` beyond u·ν with its normal, if that is fixed, and σ in the turned axes.
struct Corner {
    stress: [f64; 3],
    left: [bool; 2],
    open: f64,
    normal: Option<[f64; 2]>,
    load: f64,
}

/// Young's modulus and Poisson's ratio of these squares.
const YOUNG: f64 = 1000.0;
const POISSON: f64 = 0.3;

impl Corner {
    /// Clamped, with a closed gap.
    fn of(stress: [f64; 3]) -> Self {
        Self { stress, left: [true; 2], open: 0.0, normal: None, load: 0.0 }
    }

    /// The scene at an angle, with `more` of its tables, for lengths and forces in units that are `units` times as small.
    fn text(&self, angle: f64, zeta: f64, [length, force]: [f64; 2], more: &str) -> String {
        let [xx, yy, xy] = self.stress;
        let young = YOUNG * zeta;
        let turned = |v: [f64; 2]| turn(angle, v);
        let ([c, s], stress_unit) = (turned([1.0, 0.0]), force / length);
        // x and y in the axes of the square, m.
        let [x, y] = [format!("({c}*x + {s}*y)"), format!("({c}*y - {s}*x)")];
        let [of_x, of_y] = [
            [(xx - POISSON * yy) / young, (1.0 + POISSON) * xy / young - 2e-3],
            [(1.0 + POISSON) * xy / young + 2e-3, (yy - POISSON * xx) / young],
        ];
        // u in the turned axes, and as components.
        let along = |[a, b]: [f64; 2], shift: f64| format!("({shift} + {a}*{x} + {b}*{y})");
        let moved = [along(of_x, 0.01 * length), along(of_y, -0.02 * length)];
        let u = |k: usize| {
            let [p, q] = [turned([1.0, 0.0])[k], turned([0.0, 1.0])[k]];
            format!("{p}*{} + {q}*{}", moved[0], moved[1])
        };
        let component = |k: usize| match self.left[k] {
            true => format!("'t*({})'", u(k)),
            false => "'free'".to_owned(),
        };
        let normal = self.normal.unwrap_or([0.0, -1.0]);
        let size = normal[0].hypot(normal[1]);
        let gap = format!(
            "t*({}*{} + {}*{}) + {}",
            normal[0] / size,
            moved[0],
            normal[1] / size,
            moved[1],
            self.open * length
        );
        let fixed = turned(normal);
        let fixed = self.normal.map_or(String::new(), |_| format!(", normal = {fixed:?}"));
        let traction = |v: [f64; 2]| turned(v).map(|f| f * stress_unit);
        let load = traction([0.0, self.load]);
        format!(
            "{more}
             material = {{ young = {}, poisson = {POISSON}, plane = 'stress' }}
             boundary = [{{ name = 'left', displacement = [{}, {}] }},
                         {{ name = 'bottom', gap = '{gap}'{fixed}, traction = {load:?} }},
                         {{ name = 'right', traction = {:?} }},
                         {{ name = 'top', traction = {:?} }}]",
            YOUNG * stress_unit,
            component(0),
            component(1),
            traction([xx, xy]),
            traction([xy, yy]),
        )
        .replace("+ -", "- ")
    }
}

#[test]
fn a_clamp_and_a_foundation_with_a_common_node_exert_their_tractions_in_a_patch() {
    let corners = [
        // A pressure alone, with a tension along the foundation, with shear on an obstacle with a fixed normal, and under a load.
        Corner::of([0.0, -1.0, 0.0]),
        Corner::of([3.0, -2.0, 0.0]),
        Corner { normal: Some([0.4, -1.0]), ..Corner::of([3.0, -2.0, 0.8]) },
        Corner { load: 0.5, ..Corner::of([-1.0, -2.0, 0.0]) },
        Corner { load: -0.5, ..Corner::of([-1.0, -2.0, 0.0]) },
        // Nothing presses: the gap is open, or the foundation is free of stress.
        Corner { open: 0.01, ..Corner::of([3.0, 0.0, 0.0]) },
        Corner { open: 0.01, load: 0.7, ..Corner::of([3.0, -0.7, 0.0]) },
        Corner::of([3.0, 0.0, 0.0]),
        // One component across the foundation.
        Corner { left: [false, true], ..Corner::of([0.0, -1.0, 0.0]) },
    ];
    let free = unstructured(0.3);
    let damaged = "damage = { diffusion = 1, lambda_d = 0, lambda_u = 0, initial = 0.5 }";
    for order in ORDERS {
        for (k, corner) in corners.iter().enumerate() {
            let cases = [(0.0, 1.0, [1.0, 1.0], ""), (0.0, 0.5, [1e-3, 1e6], damaged)];
            let turned = [(0.7, 1.0, [1e3, 1e-4], ""), (2.0, 1.0, [1.0, 1.0], "")];
            // At other angles a component is no direction of the square.
            let turned = turned.into_iter().filter(|_| corner.left == [true; 2]);
            for (angle, zeta, units, more) in cases.into_iter().chain(turned) {
                for mesh in [square(2), distorted(4), free.clone()] {
                    let [length, force] = units;
                    let degree = format!("discretisation.displacement = {}", 1 + order as u8);
                    let more = format!("contact.tolerance = 1e-12\n{degree}\n{more}");
                    let text = corner.text(angle, zeta, units, &more);
                    let mesh =
                        moved(mesh, |x| turn(angle, x.map(|coordinate| length * coordinate)));
                    let problem =
                        problem(mesh, &text).unwrap_or_else(|e| panic!("{k}: {e}\n{text}"));
                    let last = run(&problem, SOLVERS[0]).last;
                    let found = support::figures(&problem, &last);
                    let resultant = |of: &str| {
                        let of =
                            ["x", "y"].map(|axis| found[&format!("{of}.force_{axis}")] / force);
                        turn(-angle, of)
                    };
                    let [xx, yy, xy] = corner.stress;
                    let expected = [("left", [-xx, -xy]), ("bottom", [-xy, -yy - corner.load])];
                    for (name, expected) in expected {
                        let found = resultant(name);
                        let error = [0, 1].map(|i| (found[i] - expected[i]).abs());
                        assert!(
                            error.iter().all(|error| *error < 2e-8),
                            "P{} corner {k} at {angle}: {name} {found:?}, not {expected:?}\n{text}",
                            1 + order as u8
                        );
                    }
                    let pressure = xy.hypot(yy + corner.load);
                    close(found["contact_force"] / force, pressure, 1e-8);
                    let pressed = f64::from(u8::from(pressure > 0.0));
                    close(found["contact_length"] / length, pressed, 1e-9);
                    // Γ_C has a row at the corner, too. The nodes of the contact problem are the others.
                    let rows = problem.supports.contact.rows(&problem.body, &last.state).0;
                    assert_eq!(rows.len(), last.state.contact.len() + 1);
                    for row in rows {
                        close(row.pressure * length / force, pressure, 1e-7);
                        assert!((row.gap / length - corner.open).abs() < 1e-9, "{row:?}");
                        assert_eq!(f64::from(row.active), pressed);
                    }
                    let active = last.state.contact.iter().filter(|point| point.active).count();
                    assert_eq!(last.record.active_nodes, active);
                }
            }
        }
    }
}

#[test]
fn a_clamp_and_a_foundation_balance_the_loads_and_no_foundation_pulls() {
    // Stress of degree 0 or singular at the corner: pressed, pulled, sheared, with a gap that is closed there alone.
    let free = unstructured(0.2);
    for order in ORDERS {
        for (gap, load) in [
            ("0", "[0.3, -1]"),
            ("0", "[0.3, 1]"),
            ("0", "[-2, 0]"),
            ("0.001*x", "[0, -1]"),
            ("0.001*(1 - x)", "[0.5, -1]"),
        ] {
            for mesh in [square(3), free.clone()] {
                let text = format!(
                    "boundary = [{{ name = 'left', displacement = [0, 0] }},
                     {{ name = 'bottom', gap = '{gap}' }}, {{ name = 'right', traction = {load} }}]"
                );
                let problem = of_order(mesh, order, &text).unwrap();
                let last = run(&problem, SOLVERS[0]).last;
                let found = support::figures(&problem, &last);
                let sum =
                    |axis: &str| found[&format!("left.{axis}")] + found[&format!("bottom.{axis}")];
                let load: Vec<f64> =
                    load[1..load.len() - 1].split(", ").map(|f| f.parse().unwrap()).collect();
                // The moment of the load at (1, ½) is F_y − F_x/2.
                close(sum("force_x"), -load[0], 1e-8);
                close(sum("force_y"), -load[1], 1e-8);
                close(sum("moment"), 0.5 * load[0] - load[1], 1e-8);
                close(found["contact_force"], found["bottom.force_y"], 1e-9);
                let rows = problem.supports.contact.rows(&problem.body, &last.state).0;
                assert!(rows.iter().all(|row| row.force >= 0.0 && row.pressure >= 0.0));
                let area: f64 = (rows.windows(2))
                    .map(|p| 0.5 * (p[0].pressure + p[1].pressure) * (p[1].x - p[0].x))
                    .sum();
                close(area, found["bottom.force_y"], 1e-9);
            }
        }
    }
}

#[test]
fn a_patch_with_a_clamp_beside_a_foundation_needs_no_finer_mesh() {
    for order in 1..=2 {
        let text = format!(
            "accuracy = 0.01\ndiscretisation.displacement = {order}
             material = {{ young = 1000, poisson = 0, plane = 'stress' }}
             boundary = [{{ name = 'left', displacement = [0, '-0.001*y'] }},
                         {{ name = 'bottom', gap = 0 }}, {{ name = 'top', traction = [0, -1] }}]"
        );
        let (scene, mesh) = (scene(&text), unstructured(0.4));
        let triangles = mesh.triangles.len();
        let found = adapted(&scene, mesh, 0.01);
        assert!(found.not_reached.is_none() && found.rounds == 1, "{:?}", found.not_reached);
        assert_eq!(found.mesh.triangles.len(), triangles);
    }
}

//! Meshes of several pieces, and parts that meet in one node: each piece stands, is supported by contact
//! or moves by itself.

use crate::support::{close, difference, distorted, moved, problem, run, square, turn};
use signorini::{
    contact::SOLVERS,
    evolution::{DiscreteProblem, SetupError},
    mesh::{Curve, Mesh},
};

const MATERIAL: &str = "material = { young = 100, poisson = 0.3, plane = 'stress' }";

/// One mesh of several; the curves of the k-th, from 1, end in k. Nodes at the same place become
/// one if `joined`.
fn together(meshes: &[Mesh], joined: bool) -> Mesh {
    let mut all = Mesh::default();
    for (k, mesh) in meshes.iter().enumerate() {
        let before = all.nodes.len();
        let mut place = |x: &[f64; 2]| {
            let near = |y: &[f64; 2]| (x[0] - y[0]).hypot(x[1] - y[1]) < 1e-9;
            let old = all.nodes[..before].iter().position(near).filter(|_| joined);
            old.unwrap_or_else(|| {
                all.nodes.push(*x);
                all.nodes.len() - 1
            })
        };
        let places: Vec<usize> = mesh.nodes.iter().map(&mut place).collect();
        all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| places[i])));
        for (name, curve) in &mesh.curves {
            let edges = curve.edges.iter().map(|e| e.map(|i| places[i])).collect();
            all.curves.insert(format!("{name}{}", k + 1), Curve { edges, interior_edges: 0 });
        }
    }
    all
}

fn at(mesh: Mesh, [x, y]: [f64; 2]) -> Mesh {
    moved(mesh, |[a, b]| [a + x, b + y])
}

fn bounded(mesh: Mesh, boundaries: &str) -> Result<DiscreteProblem, SetupError> {
    problem(mesh, &format!("{MATERIAL}\nboundary = [{boundaries}]"))
}

fn stands(mesh: Mesh, boundaries: &str) -> DiscreteProblem {
    of_order(1, mesh, boundaries)
}

/// With displacements of this order.
fn of_order(order: u8, mesh: Mesh, boundaries: &str) -> DiscreteProblem {
    let text = format!("discretisation.displacement = {order}\n{MATERIAL}");
    let problem = problem(mesh, &format!("{text}\nboundary = [{boundaries}]"));
    problem.unwrap_or_else(|e| panic!("{e}"))
}

fn refusal(mesh: Mesh, boundaries: &str) -> String {
    match bounded(mesh, boundaries) {
        Err(error @ SetupError::Driven { .. }) => error.to_string(),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("the load was accepted"),
    }
}

/// Two squares that meet in the node (1, 1).
fn hinged() -> Mesh {
    together(&[square(4), at(square(4), [1.0, 1.0])], true)
}

const CLAMPED: &str = "{ name = 'left1', displacement = [0, 0] },
    { name = 'right1', traction = [0.3, -1] }";
const PRESSED: &str = "{ name = 'bottom2', gap = '0.01*x' }, { name = 'left2', symmetry = true },
    { name = 'top2', traction = [0, '-2 - x'] }";
const PULLED: &str =
    "{ name = 'left3', traction = [-1, 0] }, { name = 'right3', traction = [1, 0] }";

#[test]
fn pieces_hang_together_in_nodes_and_parts_in_edges() {
    let components = |mesh: Mesh| {
        let c = mesh.components();
        (c.pieces.iter().map(Vec::len).collect::<Vec<_>>(), c.hinges.len())
    };
    assert_eq!(components(distorted(5)), (vec![1], 0));
    let pair = |x, joined| together(&[square(2), at(square(2), x)], joined);
    assert_eq!(components(pair([1.0, 0.0], true)), (vec![1], 0));
    assert_eq!(components(pair([1.0, 0.0], false)), (vec![1, 1], 0));
    assert_eq!(components(pair([1.0, 1.0], true)), (vec![2], 1));
    assert_eq!(components(pair([1.0, 0.5], true)), (vec![1], 0), "half a side in common");
    assert_eq!(components(pair([3.0, 0.0], true)), (vec![1, 1], 0));
    // Four around a hole, corner to corner.
    let ring = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [1.0, -1.0]].map(|x| at(square(2), x));
    assert_eq!(components(together(&ring, true)), (vec![4], 4));
    // A slit up to the middle: the node (½, 0) is there twice.
    let mut slit = square(2);
    slit.nodes.push(slit.nodes[1]);
    for t in &mut slit.triangles {
        let right = t.iter().any(|&i| slit.nodes[i][0] > 0.5);
        t.iter_mut().filter(|i| **i == 1 && right).for_each(|i| *i = 9);
    }
    assert_eq!(components(slit), (vec![1], 0));
}

#[test]
fn each_piece_moves_as_if_it_were_alone() {
    let pieces = [distorted(4), distorted(5), distorted(6)];
    let places = [[0.0, 0.0], [0.0, 3.0], [4.0, 1.0]];
    let mesh = || {
        let placed: Vec<_> = pieces.iter().zip(places).map(|(m, x)| at(m.clone(), x)).collect();
        together(&placed, false)
    };
    for order in [1, 2] {
        let whole = of_order(order, mesh(), &[CLAMPED, PRESSED, PULLED].join(","));
        let notes = whole.notes();
        assert_eq!(notes.len(), 4, "{notes:?}");
        assert!(notes[0].contains("the mesh has 3 pieces"), "{notes:?}");
        assert!(
            notes[1..].iter().all(|note| note.contains("of the piece around (4.")),
            "{notes:?}"
        );
        assert_eq!((whole.motions.free.len(), whole.motions.resisted()), (3, 1));
        for solver in SOLVERS {
            let u = run(&whole, solver).last.state.u;
            // All vertices come first, then all midpoints.
            let (mut first, mut middle) = (0, 2 * whole.body.mesh.nodes.len());
            for (k, boundaries) in [CLAMPED, PRESSED, PULLED].iter().enumerate() {
                let vertices = 2 * pieces[k].nodes.len();
                let mut mesh = at(pieces[k].clone(), places[k]);
                let named = |(name, curve)| (format!("{name}{}", k + 1), curve);
                mesh.curves = mesh.curves.into_iter().map(named).collect();
                let alone = run(&of_order(order, mesh, boundaries), solver).last.state.u;
                let (of_vertices, of_midpoints) =
                    (first + vertices, middle + alone.len() - vertices);
                let found = [&u[first..of_vertices], &u[middle..of_midpoints]].concat();
                let error = difference(&found, &alone);
                assert!(error < 1e-8, "{solver}: piece {k} is off by {error:.1e}");
                (first, middle) = (of_vertices, of_midpoints);
            }
        }
    }
}

#[test]
fn a_piece_that_the_load_drives_is_named_whatever_the_others_carry() {
    let pair = || together(&[square(3), at(square(3), [3.0, 0.0])], false);
    for load in ["1", "1e-9"] {
        let driven = format!("{{ name = 'top2', traction = [{load}, 0] }}");
        let refusal = refusal(pair(), &format!("{CLAMPED}, {driven}"));
        assert!(refusal.contains("the mesh has 2 pieces (gmsh: Coherence"), "{refusal}");
        let motion = "nothing supports the piece around (3.5000, 0.5000) against the horizontal";
        assert!(refusal.contains(motion), "{refusal}");
    }
    // Contact prevents one direction only.
    let lifted = "{ name = 'bottom2', gap = 0 }, { name = 'top2', traction = [0, 1] }";
    let refusal = refusal(pair(), &format!("{CLAMPED}, {lifted}"));
    assert!(refusal.contains("(3.5000, 0.5000) against the vertical translation"), "{refusal}");
    // Rounding of a load that is none does not drive it.
    let rounding = "{ name = 'top2', traction = ['sin(pi)', 0] }";
    assert_eq!(stands(pair(), &format!("{CLAMPED}, {rounding}")).motions.free.len(), 3);
}

#[test]
fn curves_of_one_name_on_several_pieces_hold_each() {
    let mut mesh = together(&[square(3), at(square(3), [3.0, 0.0])], false);
    for name in ["bottom", "top"] {
        let edges = [1, 2].iter().flat_map(|k| mesh.curves[&format!("{name}{k}")].edges.clone());
        let curve = Curve { edges: edges.collect(), interior_edges: 0 };
        mesh.curves.insert(name.into(), curve);
    }
    for order in [1, 2] {
        let problem = of_order(
            order,
            mesh.clone(),
            "{ name = 'bottom', gap = 0 }, { name = 'top', traction = [0, -1] }",
        );
        assert_eq!((problem.motions.free.len(), problem.motions.resisted()), (2, 4));
        for solver in SOLVERS {
            let last = run(&problem, solver).last;
            close(last.record.contact_force, 2.0, 1e-9);
            // Σ area u·m = 0 for each free motion m.
            for motion in &problem.motions.free {
                let field = problem.motions.field(motion, &problem.body);
                let dot = |i: usize| problem.body.nodes.weights[i / 2] * field[i] * last.state.u[i];
                assert!((0..field.len()).map(dot).sum::<f64>().abs() < 1e-14);
            }
        }
    }
}

#[test]
fn a_part_turns_about_the_node_it_hangs_on() {
    let driven = "{ name = 'top2', traction = [1, 0] }";
    let refused = refusal(hinged(), &format!("{CLAMPED}, {driven}"));
    assert!(refused.contains("parts of the mesh meet in single nodes"), "{refused}");
    assert!(refused.contains("against the rotation about (1.0000, 1.0000)"), "{refused}");

    // A load through the hinge: the part rests but for what is free.
    let along = "{ name = 'top2', traction = [0, 1] }, { name = 'right2', traction = [1, 0] }";
    for order in [1, 2] {
        let problem = of_order(order, hinged(), &format!("{CLAMPED}, {along}"));
        let [motion] = &problem.motions.free[..] else { panic!("one motion") };
        assert_eq!(motion.parts.len(), 2);
        assert!(
            problem.notes()[0].contains("meet in a single node, a hinge, as at (1.0000, 1.0000)")
        );
        for solver in SOLVERS {
            assert!(run(&problem, solver).kkt.within(1e-10));
        }
        // The motion has no strain: no forces.
        let field = problem.motions.field(motion, &problem.body);
        let zeta = vec![1.0; 3 * problem.body.triangles.len()];
        let force = problem.elasticity.internal_force(&problem.body, &zeta, &field);
        assert!(force.iter().all(|f| f.abs() < 1e-12), "{force:?}");
    }
}

#[test]
fn contact_holds_a_part_at_its_hinge_like_a_lever() {
    for order in [1, 2] {
        // The gap is closed at (2, 1) only; the load 1 has its resultant half way to the hinge.
        let lever = "{ name = 'bottom2', gap = '2 - x' }, { name = 'top2', traction = [0, -1] }";
        let problem = of_order(order, hinged(), &format!("{CLAMPED}, {lever}"));
        assert_eq!((problem.motions.free.len(), problem.motions.resisted()), (0, 1));
        for solver in SOLVERS {
            close(run(&problem, solver).last.record.contact_force, 0.5, 1e-9);
        }
    }
}

#[test]
fn a_triangle_between_three_parts_carries_though_no_node_is_its_own() {
    // Two squares are clamped; the triangle between them keeps a corner of the third in its place.
    let places = [[0.0, 0.0], [2.0, 0.0], [1.0, 2.0]];
    let mut mesh = together(&places.map(|x| at(square(2), x)), true);
    let corners = [[1.0, 1.0], [2.0, 1.0], [1.0, 2.0]];
    mesh.triangles.push(corners.map(|x| mesh.nodes.iter().position(|y| *y == x).unwrap()));
    let problem = stands(
        mesh,
        "{ name = 'bottom1', displacement = [0, 0] }, { name = 'bottom2', displacement = [0, 0] },
         { name = 'bottom3', gap = '2 - x' }, { name = 'top3', traction = [0, -1] }",
    );
    assert_eq!((problem.motions.free.len(), problem.motions.resisted()), (0, 1));
    for solver in SOLVERS {
        close(run(&problem, solver).last.record.contact_force, 0.5, 1e-9);
    }
}

#[test]
fn parts_hold_each_other_where_their_hinges_leave_no_motion() {
    // An arch of three: both feet clamped. A ring of four with one clamped is a linkage.
    let parts = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [1.0, -1.0]].map(|x| at(square(2), x));
    let feet = "{ name = 'bottom1', displacement = [0, 0] },
        { name = 'bottom3', displacement = [0, 0] }, { name = 'top2', traction = [1, -1] }";
    let arch = stands(together(&parts[..3], true), feet);
    assert!(arch.motions.all_prevented());
    assert!(run(&arch, SOLVERS[0]).kkt.within(1e-10));
    let ring = together(&parts, true);
    assert!(stands(ring.clone(), feet).motions.all_prevented());
    let one = "{ name = 'bottom1', displacement = [0, 0] }";
    assert_eq!(stands(ring, one).motions.free.len(), 1);
}

#[test]
fn what_is_free_does_not_depend_on_units_or_on_the_size_of_other_pieces() {
    let pieces = [1.0, 1e-3].map(|size| at(moved(square(4), |x| x.map(|v| size * v)), [3.0, size]));
    let both = [at(square(4), [0.0, 0.0]), pieces[0].clone(), pieces[1].clone()];
    for length in [1.0, 1e3, 1e-3] {
        let scaled = |mesh: Mesh| moved(mesh, |x| x.map(|v| length * v));
        let decided = |mesh: Mesh, boundaries: &str| match bounded(scaled(mesh), boundaries) {
            Ok(problem) => Ok((problem.motions.free.len(), problem.motions.resisted())),
            Err(SetupError::Driven { source, .. }) => Err(source.motion.parts.len()),
            Err(other) => panic!("{other}"),
        };
        let three = || together(&both, false);
        let standing = "{ name = 'bottom2', gap = 0 }, { name = 'bottom3', gap = 0 }";
        assert_eq!(decided(three(), &format!("{CLAMPED}, {standing}")), Ok((2, 4)));
        let pressed = format!("{CLAMPED}, {standing}, {{ name = 'top3', traction = [0, -1] }}");
        assert_eq!(decided(three(), &pressed), Ok((2, 4)));
        let driven = format!("{CLAMPED}, {standing}, {{ name = 'top3', traction = [1e-6, -1] }}");
        assert_eq!(decided(three(), &driven), Err(1));
        let hinge = format!("{CLAMPED}, {{ name = 'bottom2', gap = 0 }}");
        assert_eq!(decided(hinged(), &hinge), Ok((0, 1)));
        let turned = format!("{CLAMPED}, {{ name = 'top2', traction = [1, 0] }}");
        assert_eq!(decided(hinged(), &turned), Err(2));
    }
}

/// A disc of radius 1 around (3, 2), its rim cut into `n` edges equal up to `uneven`, in `curves`
/// curves.
fn disc(n: usize, uneven: f64, curves: usize) -> Mesh {
    let (rings, centre) = (n / 6, [3.0, 2.0]);
    let point = |ring: usize, i: usize| {
        let angle = std::f64::consts::TAU * (i as f64 + uneven * (7.0 * i as f64).sin()) / n as f64;
        let [x, y] = turn(angle, [ring as f64 / rings as f64, 0.0]);
        [centre[0] + x, centre[1] + y]
    };
    let node = |ring: usize, i: usize| 1 + (ring - 1) * n + i % n;
    let mut triangles: Vec<_> = (0..n).map(|i| [0, node(1, i), node(1, i + 1)]).collect();
    for (ring, i) in (1..rings).flat_map(|ring| (0..n).map(move |i| (ring, i))) {
        let [a, b] = [node(ring, i), node(ring, i + 1)];
        let [c, d] = [node(ring + 1, i), node(ring + 1, i + 1)];
        triangles.extend([[a, c, d], [a, d, b]]);
    }
    let arc = |k: usize| {
        let edges =
            (k * n / curves..(k + 1) * n / curves).map(|i| [node(rings, i), node(rings, i + 1)]);
        (format!("rim{k}"), Curve { edges: edges.collect(), interior_edges: 0 })
    };
    Mesh {
        nodes: std::iter::once(centre)
            .chain(
                (1..=rings)
                    .flat_map(|ring| (0..n).map(move |i| (ring, i)))
                    .map(|(r, i)| point(r, i)),
            )
            .collect(),
        triangles,
        curves: (0..curves).map(arc).collect(),
        ..Mesh::default()
    }
}

#[test]
fn a_disc_in_a_bore_turns_freely_although_its_edges_are_only_nearly_equal() {
    // gmsh cuts a circle into edges equal to 1e-8, in one curve or several.
    for (uneven, curves) in [(0.0, 1), (1e-8, 1), (1e-8, 4), (1e-6, 3)] {
        for length in [1.0, 1e3, 1e-3] {
            let rims = (0..curves).map(|k| format!("{{ name = 'rim{k}', gap = 0 }},"));
            let text = format!(
                "{MATERIAL}\nbody = {{ force = [0, -1] }}\nboundary = [{}]",
                rims.collect::<String>()
            );
            let mesh = moved(disc(24, uneven, curves), |x| x.map(|v| length * v));
            let problem = problem(mesh, &text).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!((problem.motions.free.len(), problem.motions.resisted()), (1, 2));
            assert!(problem.motions.free[0].to_string().starts_with("the rotation about"));
            // The bore leaves the motion exactly free.
            let field = problem.motions.field(&problem.motions.free[0], &problem.body);
            for bound in &problem.constraints.bounds {
                let [nx, ny] = bound.normal;
                let slope = field[2 * bound.node] * nx + field[2 * bound.node + 1] * ny;
                assert!(slope.abs() < 1e-13, "{slope}");
            }
            if length == 1.0 {
                let answers = SOLVERS.map(|solver| run(&problem, solver));
                assert!(answers.iter().all(|answer| answer.kkt.within(1e-10)));
                for other in &answers[1..] {
                    let apart = difference(&other.last.state.u, &answers[0].last.state.u);
                    assert!(apart < 1e-8, "{uneven}, {curves}: {apart}");
                }
            }
        }
    }
}

#[test]
fn a_keyway_or_a_flat_stops_the_disc() {
    // One node of the rim out of place by a hundredth.
    let mut mesh = disc(24, 0.0, 1);
    let rim = mesh.curves["rim0"].edges[5][0];
    mesh.nodes[rim][0] += 0.01;
    let problem = stands(mesh, "{ name = 'rim0', gap = 0 }");
    assert_eq!((problem.motions.free.len(), problem.motions.resisted()), (0, 3));
}

#[test]
fn without_time_only_the_time_of_the_one_solve_is_judged() {
    // At t = 0 this would lift the body, and the traction be infinite.
    let scene = |time: &str| {
        let text = format!(
            "{MATERIAL}\n{time}\nbody = {{ force = [0, '0.001*(1 - 2*t)'] }}
             boundary = [{{ name = 'bottom', gap = 0 }}, {{ name = 'top', traction = [0, '-1/t'] }}]"
        );
        problem(square(3), &text)
    };
    close(run(&scene("").unwrap(), SOLVERS[0]).last.record.contact_force, 1.001, 1e-12);
    assert!(matches!(scene("time = { end = 1, step = 0.5 }"), Err(SetupError::Scene(_))));
}

#[test]
fn a_gap_below_zero_by_rounding_is_none() {
    let gap = |gap: &str| {
        let pressed = "{ name = 'top', traction = [0, -1] }, { name = 'left', symmetry = true }";
        let clamped = "{ name = 'right', displacement = ['free', 0] }";
        bounded(square(3), &format!("{pressed}, {clamped}, {{ name = 'bottom', gap = {gap} }}"))
    };
    let (none, rounding) = (gap("0").unwrap(), gap("'0.3-0.1*3'").unwrap());
    assert!(rounding.constraints.bounds.iter().all(|bound| bound.upper == 0.0));
    for solver in SOLVERS {
        let [a, b] = [&none, &rounding].map(|problem| run(problem, solver).last.state.u);
        assert!(difference(&a, &b) < 1e-10);
    }
    // The right end of the bottom is prescribed.
    assert!(matches!(gap("-1e-9"), Err(SetupError::Constraint { .. })));
}

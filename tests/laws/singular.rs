//! Where stresses are singular: a table of corners with their exponents λ, as σ grows like r^(λ−1). The exponents are
//! roots of determinants of Williams's functions (J. Appl. Mech. 19, 1952), computed with 30 digits by a program of its own.

use crate::support::{moved, problem, square, unstructured};
use signorini::{
    advice::Singular,
    mesh::{Curve, Mesh},
};
use std::f64::consts::FRAC_PI_2;

/// Sectors around the origin: an angle in degrees and Young's modulus for each, on curves `first` and `last` or, in a full
/// circle without them, around a point inside the body.
pub fn fan(sectors: &[(f64, f64)], closed: bool) -> Mesh {
    const RINGS: usize = 3;
    let (mut mesh, mut angle, mut spokes) = (Mesh::default(), 0.0_f64, vec![(0.0, 0)]);
    for (i, (degrees, _)) in sectors.iter().enumerate() {
        let parts = (degrees / 15.0).ceil();
        (1..=parts as usize).for_each(|k| spokes.push((angle + degrees * k as f64 / parts, i)));
        angle += degrees;
    }
    let count = spokes.len() - usize::from(closed);
    let node = |spoke: usize, ring: usize| match ring {
        0 => 0,
        _ => 1 + (spoke % count) * RINGS + ring - 1,
    };
    mesh.nodes.push([0.0, 0.0]);
    for (degrees, _) in &spokes[..count] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        mesh.nodes.extend((1..=RINGS).map(|ring| [ring as f64 * cosine, ring as f64 * sine]));
    }
    for (spoke, &(_, sector)) in spokes.iter().enumerate().skip(1) {
        for ring in 1..=RINGS {
            let [a, b] = [spoke - 1, spoke].map(|spoke| node(spoke, ring));
            let [c, d] = [spoke - 1, spoke].map(|spoke| node(spoke, ring - 1));
            let triangles = if ring == 1 { vec![[a, b, 0]] } else { vec![[a, b, d], [a, d, c]] };
            for triangle in triangles {
                let of = mesh.surfaces.entry(format!("m{sector}")).or_default();
                of.push(mesh.triangles.len());
                mesh.triangles.push(triangle);
            }
        }
    }
    let mut curve = |name: &str, edges: Vec<[usize; 2]>| {
        mesh.curves.insert(name.to_owned(), Curve { edges, other_edges: 0 });
    };
    curve("rim", (1..spokes.len()).map(|k| [node(k - 1, RINGS), node(k, RINGS)]).collect());
    if !closed {
        let last = count - 1;
        curve("first", (1..=RINGS).map(|ring| [node(0, ring - 1), node(0, ring)]).collect());
        curve("last", (1..=RINGS).map(|ring| [node(last, ring), node(last, ring - 1)]).collect());
    }
    mesh
}

/// The name of the singular point at the origin, in a fan with these conditions on its sides.
fn label(sectors: &[(f64, f64)], plane: &str, poisson: f64, sides: Option<[&str; 2]>) -> String {
    let moduli: String = sectors
        .iter()
        .enumerate()
        .map(|(i, (_, young))| format!("m{i}.young = {young}, "))
        .collect();
    let conditions: Vec<_> = (sides.iter().flatten().zip(["first", "last"]))
        .filter(|(condition, _)| !condition.is_empty())
        .map(|(condition, name)| format!("{{ name = '{name}', {condition} }}"))
        .collect();
    let text = format!(
        "material = {{ young = 1, poisson = {poisson}, {moduli} plane = '{plane}' }}
         boundary = [{{ name = 'rim', pressure = 0 }}, {}]",
        conditions.join(", ")
    );
    let problem = problem(fan(sectors, sides.is_none()), &text).unwrap_or_else(|e| panic!("{e}"));
    let mut points = problem.singular_points().into_iter();
    let name = |of: Singular| if of.is_open { format!("{}, open", of.name) } else { of.name };
    points.find(|point| point.at == [0.0, 0.0]).map_or_else(String::new, name)
}

const FREE: &str = "";
const CLAMPED: &str = "displacement = [0, 0]";
const SLIDING: &str = "symmetry = true";
const CONTACT: &str = "gap = 0";
/// Slides in the direction y on a side in the direction x.
const ACROSS: &str = "displacement = [0, 'free']";

const REENTRANT: &str = "a re-entrant corner";
const FIRST: &str = "the end of `first`";
const JOINT: &str = "the end of an interface of two materials";
const FIRST_OPEN: &str = "the end of `first`, open";
const OPEN: &str = "the end of an interface of two materials, open";
const INCLUSION: &str = "a corner of an inclusion";
const REGULAR: &str = "";

/// A corner: its sectors, plane, Poisson's ratio and sides (`None` inside the body); the least Re λ (1 if none is smaller);
/// the expected name.
type Corner =
    (&'static [(f64, f64)], &'static str, f64, Option<[&'static str; 2]>, f64, &'static str);

#[rustfmt::skip]
const CORNERS: &[Corner] = &[
    // sin λω = ± λ sin ω; the last one is a crack.
    (&[(90.0, 1.0)], "stress", 0.3, Some([FREE, FREE]), 1.0, REGULAR),
    (&[(150.0, 1.0)], "stress", 0.3, Some([FREE, FREE]), 1.0, REGULAR),
    (&[(185.0, 1.0)], "stress", 0.3, Some([FREE, FREE]), 0.947372, REENTRANT),
    (&[(225.0, 1.0)], "stress", 0.3, Some([FREE, FREE]), 0.673583, REENTRANT),
    (&[(270.0, 1.0)], "stress", 0.3, Some([FREE, FREE]), 0.544484, REENTRANT),
    (&[(300.0, 1.0)], "stress", 0.3, Some([FREE, FREE]), 0.512221, REENTRANT),
    (&[(360.0, 1.0)], "stress", 0.3, Some([FREE, FREE]), 0.5, REENTRANT),
    // κ sin λω = ± λ sin ω.
    (&[(150.0, 1.0)], "stress", 0.3, Some([CLAMPED, CLAMPED]), 1.0, REGULAR),
    (&[(270.0, 1.0)], "stress", 0.3, Some([CLAMPED, CLAMPED]), 0.604044, REENTRANT),
    // 4κ sin² λω = (κ + 1)² − 4λ² sin² ω.
    (&[(45.0, 1.0)], "stress", 0.3, Some([CLAMPED, FREE]), 1.0, REGULAR),
    (&[(60.0, 1.0)], "stress", 0.3, Some([CLAMPED, FREE]), 1.0, REGULAR),
    (&[(70.0, 1.0)], "stress", 0.3, Some([CLAMPED, FREE]), 0.900758, FIRST),
    (&[(90.0, 1.0)], "stress", 0.3, Some([CLAMPED, FREE]), 0.758349, FIRST),
    (&[(90.0, 1.0)], "stress", 0.0, Some([CLAMPED, FREE]), 1.0, REGULAR),
    (&[(55.0, 1.0)], "strain", 0.3, Some([CLAMPED, FREE]), 1.0, REGULAR),
    (&[(60.0, 1.0)], "strain", 0.3, Some([CLAMPED, FREE]), 0.955422, FIRST),
    (&[(90.0, 1.0)], "strain", 0.3, Some([CLAMPED, FREE]), 0.711173, FIRST),
    (&[(90.0, 1.0)], "strain", 0.49, Some([CLAMPED, FREE]), 0.599895, FIRST),
    (&[(180.0, 1.0)], "stress", 0.3, Some([CLAMPED, FREE]), 0.5, FIRST),
    (&[(270.0, 1.0)], "stress", 0.3, Some([CLAMPED, FREE]), 0.340317, FIRST),
    // A mirror doubles the angle.
    (&[(80.0, 1.0)], "stress", 0.3, Some([SLIDING, FREE]), 1.0, REGULAR),
    (&[(90.0, 1.0)], "stress", 0.3, Some([SLIDING, FREE]), 1.0, REGULAR),
    (&[(135.0, 1.0)], "stress", 0.3, Some([SLIDING, FREE]), 0.544484, FIRST),
    (&[(180.0, 1.0)], "stress", 0.3, Some([SLIDING, FREE]), 0.5, FIRST),
    (&[(90.0, 1.0)], "stress", 0.3, Some([CLAMPED, SLIDING]), 1.0, REGULAR),
    (&[(135.0, 1.0)], "stress", 0.3, Some([CLAMPED, SLIDING]), 0.744462, FIRST),
    (&[(180.0, 1.0)], "stress", 0.3, Some([ACROSS, FREE]), 0.5, FIRST),
    // |π/ω − 1|.
    (&[(60.0, 1.0)], "stress", 0.3, Some([SLIDING, SLIDING]), 1.0, REGULAR),
    (&[(90.0, 1.0)], "stress", 0.3, Some([SLIDING, SLIDING]), 1.0, REGULAR),
    (&[(135.0, 1.0)], "stress", 0.3, Some([SLIDING, CONTACT]), 0.333333, "a corner of `first`"),
    (&[(135.0, 1.0)], "stress", 0.3, Some([CONTACT, CONTACT]), 0.333333, "a corner of `first`"),
    // The worse of an open and a closed contact.
    (&[(90.0, 1.0)], "stress", 0.3, Some([CONTACT, FREE]), 1.0, REGULAR),
    (&[(180.0, 1.0)], "stress", 0.3, Some([CONTACT, FREE]), 0.5, FIRST),
    (&[(180.0, 1.0)], "stress", 0.3, Some([CONTACT, CONTACT]), 1.0, REGULAR),
    (&[(90.0, 1.0)], "stress", 0.3, Some([CLAMPED, CONTACT]), 0.758349, FIRST_OPEN),
    // Two materials.
    (&[(90.0, 1.0), (90.0, 2.0)], "stress", 0.3, Some([FREE, FREE]), 0.973254, JOINT),
    (&[(90.0, 1.0), (90.0, 10.0)], "stress", 0.3, Some([FREE, FREE]), 0.840813, JOINT),
    (&[(90.0, 1.0), (90.0, 1000.0)], "stress", 0.3, Some([FREE, FREE]), 0.759383, JOINT),
    (&[(45.0, 10.0), (135.0, 1.0)], "stress", 0.3, Some([FREE, FREE]), 0.878035, JOINT),
    (&[(90.0, 1.0), (90.0, 10.0)], "stress", 0.3, Some([SLIDING, SLIDING]), 1.0, REGULAR),
    (&[(90.0, 1.0), (90.0, 10.0)], "stress", 0.3, Some([CLAMPED, CLAMPED]), 0.796198, JOINT),
    (&[(180.0, 1.0), (180.0, 10.0)], "stress", 0.3, Some([FREE, FREE]), 0.5, JOINT),
    (&[(90.0, 1.0), (90.0, 1.0)], "stress", 0.3, Some([FREE, FREE]), 1.0, REGULAR),
    // Contact is open or closed on both sides: without ν both are regular; with it only the closed one is.
    (&[(90.0, 1.0), (90.0, 2.0)], "stress", 0.0, Some([CONTACT, CONTACT]), 1.0, REGULAR),
    (&[(90.0, 1.0), (90.0, 1000.0)], "stress", 0.0, Some([CONTACT, CONTACT]), 1.0, REGULAR),
    (&[(90.0, 1.0), (90.0, 10.0)], "stress", 0.3, Some([CONTACT, CONTACT]), 0.840813, OPEN),
    (&[(45.0, 10.0), (135.0, 1.0)], "stress", 0.3, Some([SLIDING, SLIDING]), 0.786447, JOINT),
    (&[(45.0, 10.0), (135.0, 1.0)], "stress", 0.3, Some([CONTACT, CONTACT]), 0.786447, JOINT),
    // Inside the body.
    (&[(90.0, 1000.0), (270.0, 1.0)], "stress", 0.3, None, 0.607006, INCLUSION),
    (&[(90.0, 0.001), (270.0, 1.0)], "stress", 0.3, None, 0.545883, INCLUSION),
    (&[(90.0, 10.0), (270.0, 1.0)], "stress", 0.3, None, 0.786447, INCLUSION),
    (&[(90.0, 2.0), (270.0, 1.0)], "stress", 0.3, None, 0.906075, INCLUSION),
    (&[(180.0, 10.0), (180.0, 1.0)], "stress", 0.3, None, 1.0, REGULAR),
    (&[(120.0, 1.0), (240.0, 1.0)], "stress", 0.3, None, 1.0, REGULAR),
];

#[test]
fn a_corner_is_singular_if_its_exponent_is_below_1() {
    let mut wrong = Vec::new();
    for &(sectors, plane, poisson, sides, exponent, name) in CORNERS {
        let found = label(sectors, plane, poisson, sides);
        println!("{sectors:?} {plane} {poisson} {sides:?}: {exponent}, {found:?}");
        if found != name || found.is_empty() != (exponent == 1.0) {
            wrong.push((sectors, sides, found));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// The singular points on a mesh of a quarter of a ring with the radii 1 and 2 between its axes of symmetry.
#[test]
fn chords_of_circles_are_no_corners() {
    for size in [0.4, 0.2, 0.1, 0.05, 0.02] {
        let ring = |[x, y]: [f64; 2]| {
            let (sine, cosine) = (FRAC_PI_2 * y).sin_cos();
            [(1.0 + x) * cosine, (1.0 + x) * sine]
        };
        let text = "material = { young = 1, poisson = 0.3, plane = 'stress' }
                    boundary = [{ name = 'bottom', symmetry = true }, { name = 'top', symmetry = true }]";
        let problem =
            problem(moved(unstructured(size), ring), text).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(problem.singular_points(), [], "size {size}");
    }
}

#[test]
fn a_jump_of_the_gap_is_singular_and_a_continuous_gap_is_not() {
    for (gap, place) in [
        ("if(x < 0.5, 0, 1)", Some(0.5)),
        ("if(x < 0.5, 1, 0)", Some(0.5)),
        ("if(x < 0.23, 1e-6, 2e-6)", Some(0.2)),
        ("0.1*x", None),
        ("max(0, x - 0.5)", None),
        ("0.01*sin(40*x)", None),
    ] {
        let text = format!(
            "material = {{ young = 1, poisson = 0.3, plane = 'stress' }}
             boundary = [{{ name = 'bottom', gap = '{gap}' }}]"
        );
        let problem = problem(square(10), &text).unwrap_or_else(|e| panic!("{e}"));
        let found: Vec<_> = problem.singular_points().iter().map(|point| point.at[0]).collect();
        let names = problem.singular_points();
        assert!(names.iter().all(|point| point.name == "a jump of the gap of `bottom`"));
        assert_eq!(found.len(), usize::from(place.is_some()), "{gap}: {found:?}");
        assert!(
            found.iter().zip(place).all(|(x, place)| (x - place).abs() < 1e-12),
            "{gap}: {found:?}"
        );
    }
}

#[test]
fn a_jump_of_a_shear_load_is_singular_and_a_jump_of_a_pressure_is_not() {
    for (load, place) in [
        ("traction = ['if(x < 0.5, 1, 0)', '0']", Some(0.5)),
        ("traction = ['if(x < 0.53, 1, 2)', '-1']", Some(0.5)),
        ("traction = ['if(x < 0.57, 1, 0)', 'x']", Some(0.6)),
        ("traction = ['0', 'if(x < 0.5, 1, 0)']", None),
        ("pressure = 'if(x < 0.53, 1, 0)'", None),
        ("traction = ['x', 'sin(30*x)']", None),
        ("traction = ['max(0, x - 0.53)', '1']", None),
    ] {
        let text = format!(
            "material = {{ young = 1, poisson = 0.3, plane = 'stress' }}
             boundary = [{{ name = 'top', {load} }}, {{ name = 'bottom', symmetry = true }}, {{ name = 'left', symmetry = true }}]"
        );
        let problem = problem(square(10), &text);
        let mut points = problem.unwrap_or_else(|e| panic!("{e}")).singular_points();
        // The mirror image of a shear load at the axis of symmetry jumps as well.
        points.retain(|point| point.at[0] > 0.0);
        assert_eq!(points.len(), usize::from(place.is_some()), "{load}: {points:?}");
        let is_there =
            |x: f64| (points[0].at[0] - x).abs() < 1e-9 && points[0].name.contains("jump");
        assert!(place.is_none_or(is_there), "{load}: {points:?}");
    }
}

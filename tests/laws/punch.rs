//! A flat punch on a half-plane: the exact square-root pressure, at the rate of smooth solutions.

use crate::support::{adapted, order, run, scene, square, with_part};
use signorini::{
    contact::SOLVERS,
    evolution::ObservedProblem,
    observe::Value,
    scene::{Expression, Scene},
};
use std::f64::consts::PI;

/// Half the width of the punch, m.
const WIDTH: f64 = 0.5;
const YOUNG: f64 = 1000.0;
const POISSON: f64 = 0.3;
/// No node lies at this distance from the tip, m.
const AWAY: f64 = 0.13;

/// Stresses and displacements of the half-plane y > 0 that a frictionless punch |x| < a presses with
/// p = 1/√(1 − (x/a)²), as expressions (Westergaard; plane stress). With z = (x + iy)/a,
/// w = asin z, Z = −1/cos w and Z̄ = −w, so that Z̄′ = Z, Z′ = −z/cos³w:
///   σ_xx = Re Z − (y/a) Im Z′,  σ_yy = Re Z + (y/a) Im Z′,  σ_xy = −(y/a) Re Z′,
///   2μ u_x = a (κ − 1)/2 Re Z̄ − y Im Z,  2μ u_y = a (κ + 1)/2 Im Z̄ − y Re Z,  κ = (3 − ν)/(1 + ν).
/// With d, s half the difference and sum of |z + 1| and |z − 1|: sin Re w = d, cosh Im w = s.
struct HalfPlane {
    stress: [String; 3],
    u: [String; 2],
}

impl HalfPlane {
    fn new() -> Self {
        let (x, y) = (format!("(x/{WIDTH})"), format!("(y/{WIDTH})"));
        let far = |sign: &str| format!("sqrt(({x}{sign}1)^2+{y}^2)");
        let d = format!("(({}-{})/2)", far("+"), far("-"));
        let s = format!("(({}+{})/2)", far("+"), far("-"));
        let (cos, sinh) = (format!("sqrt(1-{d}^2)"), format!("sqrt({s}^2-1)"));
        // 1/cos w = p + iq and its cube.
        let [p, q] = [[&cos, &s], [&d, &sinh]].map(|[a, b]| format!("({a}*{b}/({s}^2-{d}^2))"));
        let cube = [format!("({p}^3-3*{p}*{q}^2)"), format!("(3*{p}^2*{q}-{q}^3)")];
        let re = format!("(-{x}*{}+{y}*{})", cube[0], cube[1]);
        let im = format!("(-{x}*{}-{y}*{})", cube[1], cube[0]);
        let kappa = (3.0 - POISSON) / (1.0 + POISSON);
        let twice_mu = YOUNG / (1.0 + POISSON);
        let scaled = |factor: f64, w: &str, part: &str| {
            format!("{WIDTH}/{twice_mu}*(-{factor}*{w}+{y}*{part})")
        };
        Self {
            stress: [format!("-{p}-{y}*{im}"), format!("-{p}+{y}*{im}"), format!("-{y}*{re}")],
            u: [
                scaled(0.5 * (kappa - 1.0), &format!("atan2({d},{cos})"), &q),
                scaled(0.5 * (kappa + 1.0), &format!("log({s}+{sinh})"), &p),
            ],
        }
    }

    /// ∫σν·u over the sides x = 1 and y = 1, by Simpson's rule.
    fn work(&self) -> f64 {
        let parse = |text: &String| Expression::parse(text).unwrap();
        let ([xx, yy, xy], [u, v]) =
            (self.stress.each_ref().map(parse), self.u.each_ref().map(parse));
        let n = 1000;
        let side = |t: [&Expression; 2], place: fn(f64) -> [f64; 2]| -> f64 {
            let at = |i: usize| {
                let [x, y] = place(i as f64 / n as f64);
                let [t0, t1, u, v] = [t[0], t[1], &u, &v].map(|e| e.eval(x, y, 0.0));
                let weight = if i == 0 || i == n { 1.0 } else { [2.0, 4.0][i % 2] };
                weight * (t0 * u + t1 * v) / (3 * n) as f64
            };
            (0..=n).map(at).sum()
        };
        side([&xx, &xy], |y| [1.0, y]) + side([&xy, &yy], |x| [x, 1.0])
    }

    /// The unit square out of it, half of whose bottom the punch presses; its other sides carry the exact
    /// tractions.
    fn scene(&self) -> Scene {
        let [xx, yy, xy] = &self.stress;
        scene(&format!(
            "discretisation.displacement = 2
             away = {AWAY}
             material = {{ young = {YOUNG}, poisson = {POISSON}, plane = 'stress' }}
             boundary = [
                {{ name = 'left', symmetry = true }},
                {{ name = 'punch', gap = 0 }},
                {{ name = 'right', traction = ['{xx}', '{xy}'] }},
                {{ name = 'top', traction = ['{xy}', '{yy}'] }},
             ]"
        ))
    }
}

#[test]
fn the_pressure_under_a_punch_comes_at_the_rate_of_smooth_solutions() {
    let exact = HalfPlane::new();
    let (mut unknowns, mut strains, mut pressures) = (Vec::new(), Vec::new(), Vec::new());
    for accuracy in [0.03, 0.01, 3e-3] {
        let first = with_part(square(8), "bottom", "punch", |[x, _]| x <= WIDTH);
        let mesh = adapted(&exact.scene(), first, accuracy).mesh;
        let problem = ObservedProblem::new(exact.scene(), mesh).unwrap();
        let last = run(&problem, SOLVERS[0]).last;
        // With a gap of zero fᵀu = ‖u‖² in the energy norm, and ‖u − u_h‖² ≤ ‖u‖² − ‖u_h‖².
        let error = (1.0 - last.record.work / exact.work()).sqrt();
        // Σ of |λ − ∫p φ| but at the tip, by Simpson's weights, over ∫p = π a/2.
        let wrong: f64 = (last.state.contact.iter())
            .map(|point| (problem.body.nodes.points[point.node][0] / WIDTH, point))
            .filter(|(x, _)| *x < 1.0)
            .map(|(x, point)| {
                point.force * (1.0 - 1.0 / (1.0 - x * x).sqrt() / point.pressure).abs()
            })
            .sum();
        let wrong = wrong / (0.5 * PI * WIDTH);
        println!("{accuracy}: {} unknowns, {error:.5}, {wrong:.5}", last.state.u.len());
        assert!(0.3 * accuracy < error && error < accuracy, "{error} for {accuracy}");
        unknowns.push(last.state.u.len() as f64);
        strains.push(error);
        pressures.push(wrong);
    }
    // On uniform meshes u ~ r^½ leaves N^−¼.
    let rates = [&strains, &pressures].map(|errors| -order(&unknowns, errors));
    assert!(rates.iter().all(|rate| (0.9..1.2).contains(rate)), "N to the minus {rates:?}");
}

/// The extremes away from the tip lie on the circle around it, between the nodes. Their error falls with the triangles, as the
/// stress on the circle is smooth.
#[test]
fn extremes_away_from_a_singular_point_converge() {
    let exact = HalfPlane::new();
    let [xx, yy, xy] = exact.stress.each_ref().map(|text| Expression::parse(text).unwrap());
    let von_mises = |[x, y]: [f64; 2]| {
        let [xx, yy, xy] = [&xx, &yy, &xy].map(|stress| stress.eval(x, y, 0.0));
        (xx * xx - xx * yy + yy * yy + 3.0 * xy * xy).sqrt()
    };
    let part = |i: usize| i as f64 / 1000.0;
    let circle = (1..1000).map(|i| {
        let (sine, cosine) = (PI * part(i)).sin_cos();
        [WIDTH + AWAY * cosine, AWAY * sine]
    });
    let bottom = (0..=1000).map(|i| [part(i), 1e-9]).filter(|[x, _]| (x - WIDTH).abs() >= AWAY);
    let largest = circle.chain(bottom).map(von_mises).fold(0.0, f64::max);
    let (sizes, mut errors) = ([8.0, 16.0, 32.0], Vec::new());
    for n in sizes {
        let mesh = with_part(square(n as usize), "bottom", "punch", |[x, _]| x <= WIDTH);
        let problem = ObservedProblem::new(exact.scene(), mesh).unwrap();
        let last = run(&problem, SOLVERS[0]).last;
        let number = problem.figures.number("von_mises_max_away").unwrap();
        let Value { value, at } = last.figures[number];
        let [x, y] = at.unwrap();
        println!("{n}: {value} for {largest} at ({x}, {y})");
        assert!((x - WIDTH).hypot(y) > 0.999 * AWAY, "({x}, {y}) is too near to the tip");
        errors.push((value / largest - 1.0).abs());
    }
    let rate = -order(&sizes, &errors);
    assert!(errors[2] < 0.01 && rate > 0.8, "{errors:?} fall like h^{rate}");
}

/// A length that leaves nothing of the body is refused.
#[test]
fn a_length_away_that_leaves_nothing_is_refused() {
    let mut scene = HalfPlane::new().scene();
    scene.away = Some(2.0);
    let mesh = with_part(square(4), "bottom", "punch", |[x, _]| x <= WIDTH);
    let refused = ObservedProblem::new(scene, mesh).unwrap_err().to_string();
    assert!(refused.contains("away leaves no node of the material"), "{refused}");
}

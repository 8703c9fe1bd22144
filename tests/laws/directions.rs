//! Stresses that depend on the direction at a corner, against closed forms: with Airy's function r² (a + bθ + c cos 2θ + d sin 2θ),
//! σ_θθ = 2(a + bθ + c cos 2θ + d sin 2θ), σ_rr = 2(a + bθ − c cos 2θ − d sin 2θ), σ_rθ = −b + 2c sin 2θ − 2d cos 2θ.

use crate::{
    singular::fan,
    support::{problem, square},
};
use nalgebra::{DMatrix, DVector, Matrix4, Vector4};
use signorini::evolution::State;

/// The factors of a, b, c and d in σ_θθ, σ_rθ and σ_rr.
fn airy(theta: f64) -> [[f64; 4]; 3] {
    let (s, c) = (2.0 * theta).sin_cos();
    [
        [2.0, 2.0 * theta, 2.0 * c, 2.0 * s],
        [0.0, -1.0, 2.0 * s, -2.0 * c],
        [2.0, 2.0 * theta, -2.0 * c, -2.0 * s],
    ]
}

/// (σ_xx, σ_yy, σ_xy) of (σ_θθ, σ_rθ, σ_rr).
fn cartesian(theta: f64, [hoop, shear, radial]: [f64; 3]) -> [f64; 3] {
    let (s, c) = theta.sin_cos();
    [
        radial * c * c + hoop * s * s - 2.0 * shear * s * c,
        radial * s * s + hoop * c * c + 2.0 * shear * s * c,
        (radial - hoop) * s * c + shear * (c * c - s * s),
    ]
}

/// The stresses by direction at the origin of a fan with these sectors and conditions on its sides; `None` if they do not depend on it
/// or are not determined.
fn rays(sectors: &[(f64, f64)], sides: [&str; 2]) -> Option<Vec<(usize, [f64; 3])>> {
    let moduli =
        sectors.iter().enumerate().map(|(i, (_, young))| format!("m{i}.young = {young}, "));
    let text = format!(
        "material = {{ young = 1, poisson = 0.3, {} plane = 'stress' }}
         boundary = [{{ name = 'rim', displacement = [0, 0] }}, {{ name = 'first', {} }}, {{ name = 'last', {} }}]",
        String::from_iter(moduli),
        sides[0],
        sides[1]
    );
    let problem = problem(fan(sectors, false), &text).unwrap_or_else(|e| panic!("{e}"));
    let found = problem.rays(&State { time: 1.0, ..State::default() });
    found.into_iter().find(|of| of.at == [0.0, 0.0]).and_then(|of| of.stresses)
}

/// The traction on a side at this angle with σ_θθ = n and σ_rθ = t, as a condition.
fn traction(angle: f64, is_last: bool, n: f64, t: f64) -> String {
    let (s, c) = angle.sin_cos();
    let sign = if is_last { 1.0 } else { -1.0 };
    format!("traction = ['{:.17e}', '{:.17e}']", sign * (t * c - n * s), sign * (t * s + n * c))
}

#[test]
fn stresses_of_one_material_are_those_of_airy() {
    for degrees in [30.0_f64, 45.0, 60.0, 90.0, 120.0, 150.0, 170.0] {
        for [p, q, r, s] in [[0.0, -5.0, 0.0, 0.0], [-4.0, 0.0, 0.0, 3.0], [1.0, 2.0, -3.0, 4.0]] {
            let angle = degrees.to_radians();
            let sides = [traction(0.0, false, p, q), traction(angle, true, r, s)];
            let found = rays(&[(degrees, 1.0)], [&sides[0], &sides[1]]).expect("a corner");
            let rows = [0.0, angle].map(airy);
            let matrix = Matrix4::from_fn(|i, k| rows[i / 2][i % 2][k]);
            let x = matrix.lu().solve(&Vector4::new(p, q, r, s)).unwrap();
            let last = (found.len() - 1) as f64;
            for (i, (_, stress)) in found.into_iter().enumerate() {
                let theta = angle * i as f64 / last;
                let own = airy(theta).map(|row| (0..4).map(|k| row[k] * x[k]).sum::<f64>());
                for (a, b) in stress.into_iter().zip(cartesian(theta, own)) {
                    assert!((a - b).abs() < 1e-9 * x.amax(), "{degrees}: {a} for {b}");
                }
            }
        }
    }
}

#[test]
fn every_sector_has_airys_stresses_and_neighbours_share_tractions_and_strains() {
    let sectors = [(40.0, 1.0), (35.0, 5.0)];
    let end = 75_f64.to_radians();
    let sides = [traction(0.0, false, -1.0, 2.0), traction(end, true, 0.5, 0.0)];
    let found = rays(&sectors, [&sides[0], &sides[1]]).expect("a corner");
    let (mut start, mut ends) = (0.0, Vec::new());
    for (number, (degrees, young)) in sectors.into_iter().enumerate() {
        let own = Vec::from_iter(found.chunk_by(|a, b| a.0 == b.0).nth(number).unwrap());
        let angle = |i: usize| start + degrees.to_radians() * i as f64 / (own.len() - 1) as f64;
        let fields = |k: usize| move |theta: f64| airy(theta).map(|row| row[k]);
        let matrix = DMatrix::from_fn(3 * own.len(), 4, |i, k| {
            cartesian(angle(i / 3), fields(k)(angle(i / 3)))[i % 3]
        });
        let values = DVector::from_fn(3 * own.len(), |i, _| own[i / 3].1[i % 3]);
        let fit = matrix.clone().svd(true, true).solve(&values, 1e-12).unwrap();
        let error = (matrix * &fit - &values).amax();
        assert!(error < 1e-9 * values.amax(), "sector {number}: {error}");
        for theta in [angle(0), angle(own.len() - 1)] {
            let [hoop, shear, radial] =
                airy(theta).map(|row| (0..4).map(|k| row[k] * fit[k]).sum::<f64>());
            ends.push([hoop, shear, (radial - 0.3 * hoop) / young]);
        }
        start += degrees.to_radians();
    }
    let is_close = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} for {b}: {ends:?}");
    (0..3).for_each(|k| is_close(ends[1][k], ends[2][k]));
    for (at, wanted) in [(0, [-1.0, 2.0]), (3, [0.5, 0.0])] {
        (0..2).for_each(|k| is_close(ends[at][k], wanted[k]));
    }
}

/// At an axis of symmetry Airy's function has a and c alone: the stress of each material is uniform, in the half as in the whole.
#[test]
fn a_symmetric_wedge_has_a_uniform_stress_in_each_material() {
    let load = |degrees: f64| traction(degrees.to_radians(), true, -1.0, 2.0);
    assert_eq!(rays(&[(40.0, 1.0)], ["symmetry = true", &load(40.0)]), None);
    assert_eq!(rays(&[(30.0, 1.0), (20.0, 4.0)], ["symmetry = true", &load(50.0)]), None);
    let sectors = [(20.0, 4.0), (30.0, 1.0), (30.0, 1.0), (20.0, 4.0)];
    assert_eq!(rays(&sectors, [&traction(0.0, false, -1.0, -2.0), &load(100.0)]), None);
}

/// On a half-plane with pressure p on one half of its boundary, σ_xx = c − p(θ − sin θ cos θ)/π and σ_yy = −p(θ + sin θ cos θ)/π:
/// other loads determine c.
#[test]
fn a_jump_of_a_pressure_on_a_smooth_side_leaves_a_tension_undetermined() {
    for (load, is_known) in
        [("pressure = 'if(x < 0.5, 1, 0)'", Some(false)), ("pressure = 1", None)]
    {
        let text = format!(
            "material = {{ young = 1, poisson = 0.3, plane = 'stress' }}
             boundary = [{{ name = 'top', {load} }}, {{ name = 'bottom', displacement = [0, 0] }}]"
        );
        let problem = problem(square(10), &text).unwrap_or_else(|e| panic!("{e}"));
        let found = problem.rays(&State { time: 1.0, ..State::default() });
        let here = found.iter().find(|of| (of.at[0] - 0.5).abs() < 1e-9);
        assert_eq!(here.map(|of| of.stresses.is_some()), is_known, "{load}");
        assert!(problem.singular_points().iter().all(|of| of.at[1] == 0.0));
    }
}

/// Shear up to an axis of symmetry at a right angle jumps at its mirror image, as on a smooth side: σ grows like ln r. At other angles the
/// sides form a corner.
#[test]
fn mirror_images_are_part_of_the_load() {
    for (angle, condition, is_singular) in [
        (90.0_f64, "symmetry = true", true),
        (90.0, "gap = 0", true),
        (90.0, "displacement = ['free', 0]", true),
        (60.0, "symmetry = true", false),
        (120.0, "symmetry = true", true),
        (90.0, "", false),
    ] {
        for (n, t, grows) in [(0.0, 1.0, true), (1.0, 0.0, false)] {
            let load = traction(angle.to_radians(), true, n, t);
            let condition = if condition.is_empty() { "pressure = 0" } else { condition };
            let text = format!(
                "material = {{ young = 1, poisson = 0.3, plane = 'stress' }}
                 boundary = [{{ name = 'rim', displacement = [0, 0] }}, {{ name = 'first', {condition} }}, {{ name = 'last', {load} }}]"
            );
            let problem = problem(fan(&[(angle, 1.0)], false), &text).unwrap();
            let found = problem.singular_points().iter().any(|of| of.at == [0.0, 0.0]);
            assert_eq!(
                found,
                is_singular && (grows || angle > 90.0),
                "{angle}, {condition}, {n}, {t}"
            );
        }
    }
}

//! Adapted meshes: the accuracy asked for is the accuracy got, with few triangles.

use crate::support::{adapted, scene, solved, square, with_part};
use signorini::{accuracy::Adapted, mesh::Mesh, scene::Scene};

/// A block under a load per area, on a foundation that ends under it: u ~ r^½ at the end, a jump of the traction besides.
fn block(accuracy: f64, load: &str) -> Scene {
    scene(&format!(
        "accuracy = {accuracy}
         material = {{ young = 1000, poisson = 0.3, plane = 'stress' }}
         boundary = [
            {{ name = 'left', symmetry = true }},
            {{ name = 'half', gap = 0 }},
            {{ name = 'top', traction = ['0', '{load}'] }},
         ]"
    ))
}

/// The unit square, of whose bottom the first half is a curve.
fn mesh() -> Mesh {
    with_part(square(2), "bottom", "half", |[x, _]| x <= 0.5)
}

/// fᵀu on a mesh: with a gap of zero fᵀu = ‖u‖², and ‖u − u_h‖² ≤ ‖u‖² − ‖u_h‖², the difference of
/// twice the energies.
fn work(mesh: Mesh) -> f64 {
    solved(block(0.1, "-1"), mesh).last.record.work
}

#[test]
fn the_error_is_at_most_the_one_asked_for_and_not_much_less() {
    let adapted = |accuracy| adapted(&block(accuracy, "-1"), mesh(), accuracy);
    let exact = work(adapted(3e-3).mesh);
    let mut triangles = Vec::new();
    for accuracy in [0.1, 0.03, 0.01] {
        let Adapted { mesh, error, not_reached, .. } = adapted(accuracy);
        triangles.push(mesh.triangles.len() as f64);
        let truth = (1.0 - work(mesh) / exact).sqrt();
        println!("{accuracy}: estimated {error:.5}, true {truth:.5}, {triangles:?}");
        assert!(not_reached.is_none() && error <= accuracy, "{not_reached:?}");
        assert!(truth < accuracy && truth > 0.3 * accuracy, "{truth} for {accuracy}");
        assert!(0.7 * truth < error && error < 1.4 * truth, "{error} for {truth}");
    }
    // P2 on adapted meshes: the error falls like 1/N, on uniform ones like N^-1/4 here.
    assert!(triangles[2] < 1.5 * 10.0 * triangles[0], "{triangles:?}");
}

#[test]
fn a_load_narrower_than_the_first_triangles_is_found() {
    // ∫ exp(−((x − c)/w)²) dx = w √π.
    let (width, accuracy) = (0.004, 0.1);
    let narrow = || block(accuracy, &format!("-exp(-((x - 0.31)/{width})^2)"));
    let mesh = adapted(&narrow(), mesh(), accuracy).mesh;
    let force = solved(narrow(), mesh).last.record.contact_force;
    let exact = width * std::f64::consts::PI.sqrt();
    assert!((force - exact).abs() < accuracy * exact, "{force} is not {exact}");
}

#[test]
fn a_slender_body_reaches_every_accuracy_in_few_rounds() {
    // Of a bent strip all triangles have much the same error: either all are too large or none is by much.
    for accuracy in [0.1, 0.07, 0.05, 0.03, 0.02, 0.01] {
        let strip = scene(&format!(
            "accuracy = {accuracy}
             material = {{ young = 2e5, poisson = 0, plane = 'stress' }}
             boundary = [
                {{ name = 'left', displacement = [0, 0] }},
                {{ name = 'right', traction = [0, -0.1] }},
             ]"
        ));
        let Adapted { mesh, rounds, error, not_reached, .. } =
            adapted(&strip, Mesh::rectangle(50.0, 1.0, 4, 1), accuracy);
        println!("{accuracy}: {error:.5}, {} triangles, mesh {rounds}", mesh.triangles.len());
        assert!(
            not_reached.is_none() && error <= accuracy && rounds <= 15,
            "{not_reached:?}, mesh {rounds}"
        );
    }
}

/// A block under a peak, a stud and a tent that are 50 times narrower than its first triangles: these do not see them. The
/// force at each accuracy is within its bar around the force at the finest.
#[test]
fn a_peak_of_the_foundation_that_the_first_triangles_miss_is_no_reason_to_give_up() {
    for gap in [
        "0.01 - 0.03*exp(-((x - 1.313)/0.01)^2)",
        "if(abs(x - 1.313) < 0.01, -0.02, 0.01)",
        "0.01 - 0.03*max(0, 1 - abs(x - 1.313)/0.01)",
    ] {
        let mut exact = None;
        for accuracy in [0.03, 0.1] {
            let scene = scene(&format!(
                "accuracy = {accuracy}
                 material = {{ young = 1e5, poisson = 0.3, plane = 'strain' }}
                 boundary = [
                    {{ name = 'left', symmetry = true }},
                    {{ name = 'bottom', displacement = ['free', 0] }},
                    {{ name = 'top', gap = '{gap}' }},
                 ]"
            ));
            let found = adapted(&scene, Mesh::rectangle(2.0, 1.0, 2, 1), accuracy);
            assert!(found.not_reached.is_none(), "{gap}, {accuracy}: {:?}", found.not_reached);
            let force = solved(scene, found.mesh).last.record.contact_force;
            let bar = found.measured.bars.iter().find(|bar| bar.name == "contact_force").unwrap();
            let exact = *exact.get_or_insert(force);
            println!("{gap}, {accuracy}: {force} ± {}", bar.bar);
            assert!((force - exact).abs() <= bar.bar, "{gap}: {force} ± {}, not {exact}", bar.bar);
        }
    }
}

/// A bar of uniform strain that is drawn and pressed a few times: its figures do not depend on the mesh, and neither do the
/// adaptive steps of the runs that measure this.
#[test]
fn adaptive_steps_are_no_error_of_the_mesh() {
    for (cycles, accuracy) in [(2, 0.05), (3, 0.05), (3, 0.01), (5, 0.02)] {
        let scene = scene(&format!(
            "accuracy = {accuracy}
             material = {{ young = 1, poisson = 0, plane = 'stress' }}
             damage = {{ diffusion = 1, lambda_d = 0, lambda_u = 4e3, lambda_w = 0.3 }}
             time = {{ end = 1, step = 'auto' }}
             boundary = [
                {{ name = 'left', symmetry = true }},
                {{ name = 'bottom', symmetry = true }},
                {{ name = 'right', displacement = ['0.015*sin({}*pi*t)', 'free'] }},
             ]",
            2 * cycles
        ));
        let Adapted { rounds, not_reached, measured, .. } = adapted(&scene, square(2), accuracy);
        let worst = measured.bars.iter().map(|bar| bar.relative()).fold(0.0, f64::max);
        println!("{cycles} cycles, {accuracy}: {rounds} rounds, {worst:.1e}");
        assert!(
            not_reached.is_none() && rounds == 1,
            "{cycles} cycles: {rounds} rounds, {not_reached:?}"
        );
        assert!(worst < 1e-6, "{cycles} cycles, {accuracy}: {worst}");
    }
}

/// A square whose damage only diffuses, with κt = 0.1.
fn diffusing(initial: &str, more: &str) -> Scene {
    scene(&format!(
        "accuracy = 0.03
         material = {{ young = 100, poisson = 0.3, plane = 'stress' }}
         damage = {{ diffusion = 0.1, lambda_d = 0, lambda_u = 0, lambda_w = 0, initial = '{initial}' }}
         time = {{ end = 1, step = 'auto' }}
         {more}
         boundary = [
            {{ name = 'left', symmetry = true }},
            {{ name = 'bottom', gap = 0 }},
            {{ name = 'top', traction = [0, -1] }},
         ]"
    ))
}

/// Damage that is uniform up to rounding needs no finer mesh, whatever its expression is.
#[test]
fn an_initial_damage_that_varies_by_rounding_is_no_reason_to_refine() {
    for initial in
        ["1 - d0*x", "1 - d0*if(x < 0.43, 1, 0)", "0.7 + d0*sin(50*x)", "0.7 + 0.1*d0*(x - x*y)"]
    {
        for d0 in ["0", "1e-15"] {
            let scene = diffusing(initial, &format!("constants = {{ d0 = {d0} }}"));
            let found = adapted(&scene, square(3), 0.03);
            assert!(found.not_reached.is_none(), "{initial}: {:?}", found.not_reached);
            assert_eq!((found.rounds, found.mesh.triangles.len()), (1, 18), "{initial}, {d0}");
        }
    }
}

/// ∫(1 − ζ) stays as it is. A mesh whose nodes miss a part of it is refined as far as this part counts at the end, after
/// its diffusion: a jump needs few meshes, and a spot that is far narrower than the first triangles is found.
#[test]
fn initial_damage_that_the_first_triangles_miss_counts_by_what_is_left_of_it() {
    const PI: f64 = std::f64::consts::PI;
    for (initial, exact, most) in [
        ("if(x < 0.43, 0.7, 1)", 0.3 * 0.43, 4),
        ("if(x + 0.3*y < 0.5, 0.5, 1)", 0.5 * (0.5 - 0.15), 4),
        ("if((x - 0.37)^2 + (y - 0.52)^2 < 0.04, 0.6, 1)", 0.4 * 0.04 * PI, 6),
        ("1 - 0.9*exp(-((x - 0.513)^2 + (y - 0.487)^2)/0.0004)", 0.9 * 0.0004 * PI, 10),
        ("if(abs(x - 0.513) < 0.004, 0.4, 1)", 0.6 * 0.008, 10),
    ] {
        let scene = diffusing(initial, "");
        let Adapted { mesh, rounds, not_reached, measured, .. } =
            adapted(&scene, crate::support::unstructured(0.2), 0.03);
        assert!(not_reached.is_none(), "{initial}: {not_reached:?}");
        assert!(rounds <= most, "{initial}: mesh {rounds}");
        let bar = measured.bars.iter().find(|bar| bar.name == "zeta_mean").unwrap().bar;
        let triangles = mesh.triangles.len();
        let found = 1.0 - solved(scene, mesh).last.record.zeta_mean;
        println!("{initial}: mesh {rounds}, {triangles} triangles, {found} ± {bar}, {exact}");
        assert!((found - exact).abs() <= bar, "{initial}: {found} ± {bar} is not {exact}");
        assert!((found - exact).abs() <= 0.03 * exact, "{initial}: {found} is not {exact}");
    }
}

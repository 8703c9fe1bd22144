//! The length of contact below a gap that grazes: the error of u closes a long part of it.

use crate::test_directory::TestDirectory;

/// A block under uniform pressure, which lies on its foundation for |x − c| < w. Beside it the same pressure bears it, and it touches a
/// foundation that recedes like a power of the distance. So the stress is uniform and u·ν = 0 on the whole side.
fn block(centre: f64, half: f64, gap: &str, plane: &str, degree: u8) -> String {
    let beside = format!("max(0, abs(x - {centre}) - {half})");
    format!(
        "mesh = {{ file = 'block.geo', size = 0.1 }}
         discretisation.displacement = {degree}
         material = {{ young = 1e5, poisson = 0.3, plane = '{plane}' }}
         boundary = [
            {{ name = 'sides', symmetry = true }}, {{ name = 'top', pressure = 500 }},
            {{ name = 'bottom', gap = '{}', pressure = 'if(abs(x - {centre}) > {half}, 500, 0)' }},
         ]",
        gap.replace("()", &format!("({beside})"))
    )
}

#[test]
fn the_bar_of_a_grazing_length_contains_the_error_of_u() {
    let directory = TestDirectory::new();
    directory.write(
        "block.geo",
        "Point(1) = {0, 0, 0}; Point(2) = {2, 0, 0}; Point(3) = {2, 1, 0}; Point(4) = {0, 1, 0};
         Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
         Curve Loop(1) = {1:4}; Plane Surface(1) = {1}; Physical Surface('body') = {1};
         Physical Curve('bottom') = {1}; Physical Curve('sides') = {2, 4}; Physical Curve('top') = {3};\n",
    );
    for (centre, half, gap, plane) in [
        (1.0, 0.5, "1e-5*()^2", "strain"),
        (0.93, 0.5, "1e-5*()^2", "strain"),
        (1.1, 0.37, "1e-4*()^3", "stress"),
        (0.87, 0.4, "1e-6*()^2", "strain"),
        (0.95, 0.61, "3e-5*()^1.5", "stress"),
        (1.03, 0.3, "1e-3*()^4", "stress"),
    ] {
        directory.write("scene.toml", &block(centre, half, gap, plane, 2));
        directory.run(&["--bars"]);
        let length = directory.summary("out/scene")["figures"]["contact_length"].clone();
        let [value, bar] = ["value", "bar"].map(|key| length[key].as_f64().unwrap());
        assert!((value - 2.0 * half).abs() <= bar, "{gap} beside {half}: {length}");
    }
}

/// A damage of 5e-14 is none: its steps are not shortened until they fail.
#[test]
fn a_damage_far_below_what_counts_takes_no_short_steps() {
    let directory = TestDirectory::new();
    directory.write("square.msh", &crate::test_directory::square(4));
    for source in [1e-8, 1e-9, 1e-10] {
        directory.write(
            "scene.toml",
            &format!(
                "mesh.file = 'square.msh'
                 material = {{ young = 80, poisson = 0.3, plane = 'strain' }}
                 time = {{ end = 1, step = 0.1 }}
                 damage = {{ diffusion = 1, lambda_d = 0, lambda_u = {source} }}
                 boundary = [{{ name = 'left', symmetry = true }}, {{ name = 'bottom', gap = 0 }},
                             {{ name = 'top', pressure = 't' }}]"
            ),
        );
        directory.run(&["--accuracy", "0.03"]);
        let damage = 1.0 - *directory.column("out/scene", "zeta_min").last().unwrap();
        assert!((0.0..1e-12).contains(&damage), "{source}: {damage}");
    }
}

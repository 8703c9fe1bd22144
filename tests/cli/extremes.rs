//! Extreme stresses and pressures: the whole agrees with its parts, and an extreme that the mesh does not determine says so.

use crate::test_directory::TestDirectory;
use serde_json::Value;

/// The reason why a pressure is infinite under a kink.
const KINK: &str = "a kink of the gap of `bottom` at ";

/// A block with a round core on two foundations.
const BLOCK: &str = "DefineConstant[ size = 0.2 ];
    Point(1) = {0, 0, 0, size}; Point(2) = {0.6, 0, 0, size}; Point(3) = {1, 0, 0, size};
    Point(4) = {1, 1, 0, size}; Point(5) = {0, 1, 0, size};
    Point(6) = {0.5, 0.5, 0, size}; Point(7) = {0.75, 0.5, 0, size}; Point(8) = {0.25, 0.5, 0, size};
    Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 1};
    Circle(6) = {7, 6, 8}; Circle(7) = {8, 6, 7};
    Curve Loop(1) = {1:5}; Curve Loop(2) = {6, 7};
    Plane Surface(1) = {1, 2}; Plane Surface(2) = {2};
    Physical Surface(\"rim\") = {1}; Physical Surface(\"core\") = {2};
    Physical Curve(\"near\") = {1}; Physical Curve(\"far\") = {2};
    Physical Curve(\"sides\") = {3, 5}; Physical Curve(\"top\") = {4};\n";

fn block(size: f64, degree: u8, young: f64, load: &str) -> String {
    format!(
        "mesh = {{ file = 'block.geo', size = {size} }}
         discretisation.displacement = {degree}
         material = {{ young = 100, poisson = 0.3, plane = 'strain', core = {{ young = {young} }} }}
         damage = {{ diffusion = 1, lambda_d = 0, lambda_u = 1000 }}
         time = {{ end = 1, step = 0.1 }}
         boundary = [
            {{ name = 'near', gap = '0.01*(x - 0.4)^2' }}, {{ name = 'far', gap = '0.01*(x - 0.4)^2' }},
            {{ name = 'sides', symmetry = true }}, {{ name = 'top', traction = [0, '{load}'] }},
         ]"
    )
}

/// The extremes by name, the opposite values of minima.
fn size(summary: &Value, name: &str) -> f64 {
    let value = summary["figures"][name]["value"].as_f64().unwrap();
    if name.ends_with("principal_min") { -value } else { value }
}

#[test]
fn the_extreme_of_the_whole_is_that_of_the_part_in_which_it_lies() {
    let directory = TestDirectory::new();
    directory.write("block.geo", BLOCK);
    for (size_of_edges, degree, young, load, options) in [
        (0.1, 1, 1000.0, "-t", &["--bars"][..]),
        (0.1, 2, 300.0, "-t*(2 - x)", &["--bars"]),
        (0.2, 2, 1000.0, "-t", &["--bars"]),
        (0.2, 2, 1000.0, "-t*(2 - x)", &["--bars"]),
        (0.1, 2, 300.0, "-t*(2 - x)", &["--accuracy", "0.1"]),
        (0.1, 1, 1000.0, "-t", &[]),
    ] {
        directory.write("scene.toml", &block(size_of_edges, degree, young, load));
        let said = directory.run(options);
        let summary = directory.summary("out/scene");
        let bar = |name: &str| summary["figures"][name]["bar"].as_f64();
        let mut barred = 0;
        for (whole, parts) in [
            ("von_mises_max", ["material", "core"]),
            ("principal_max", ["material", "core"]),
            ("principal_min", ["material", "core"]),
            ("pressure_max", ["near", "far"]),
        ] {
            let parts = parts.map(|part| format!("{part}.{whole}"));
            let [low, high] = match size(&summary, &parts[0]) < size(&summary, &parts[1]) {
                true => [&parts[0], &parts[1]],
                false => [&parts[1], &parts[0]],
            };
            let found = |name: &str, key: &str| summary["figures"][name][key].clone();
            for key in ["value", "at", "unresolved"] {
                assert_eq!(
                    found(whole, key),
                    found(high, key),
                    "P{degree}, {young}, {load}: {whole}"
                );
            }
            // On a finer mesh the extreme may lie in the other part, if that grows or is not settled.
            let open = ["singular", "unresolved"].iter().any(|key| !found(low, key).is_null());
            let leaves = open && bar(whole).is_none();
            let [of_whole, of_part] = [whole, high].map(|name| found(name, "singular"));
            assert!(of_whole == of_part || leaves, "{whole}: {of_whole}, {of_part}");
            let above = bar(low).map(|bar| size(&summary, low) + bar - size(&summary, high));
            let expected = bar(high).map(|bar| above.unwrap_or(0.0).max(bar));
            match (expected, bar(whole)) {
                (Some(a), Some(b)) => assert!((a - b).abs() < 1e-9 * a, "{whole}: {a}, {b}"),
                (a, b) => assert!(b.is_none() && (a.is_none() || leaves), "{whole}: {a:?}, {b:?}"),
            }
            barred += usize::from(bar(whole).is_some());
        }
        assert_eq!(barred > 0, !options.is_empty(), "{options:?}: {barred} bars");

        // The screen and the history show the same pressures.
        let pressures: Vec<&str> = said.out.split("largest contact pressure ").skip(1).collect();
        let line = |i: usize| pressures[i].lines().next().unwrap();
        let shown = |i: usize| line(i).trim_start_matches("of near ").trim_start_matches("of far ");
        assert!([1, 2].iter().any(|&i| shown(i) == shown(0)), "{}", said.out);
        for name in ["near.pressure_max", "far.pressure_max"] {
            let history = *directory.column("out/scene", name).last().unwrap();
            // serde_json's numbers may be off in the last digit.
            assert!((size(&summary, name) / history - 1.0).abs() < 1e-15, "{name}");
        }
    }
}

/// A square that is pressed on its foundation by the way `pressed`.
fn on(gap: &str, degree: u8, pressed: f64) -> String {
    format!(
        "mesh.file = 'square.msh'
         discretisation.displacement = {degree}
         material = {{ young = 1000, poisson = 0.3, plane = 'strain' }}
         boundary = [{{ name = 'bottom', gap = '{gap}' }}, {{ name = 'top', displacement = [0, -{pressed}] }}]"
    )
}

#[test]
fn a_pressure_on_few_nodes_or_under_a_kink_is_not_resolved_and_a_smooth_one_is() {
    const FEW: Option<&str> = Some("contact of few nodes of `bottom`");
    let directory = TestDirectory::new();
    for (gap, n, pressed, expected) in [
        // Sharp tips, at a node and beside it, and a round one that is sharp on this mesh.
        ("5*abs(x - 0.5)", 20, 0.01, FEW),
        ("1*abs(x - 0.48)", 10, 0.03, FEW),
        ("100*(x - 0.5)^2", 20, 0.01, FEW),
        // Blunt ones: the contact is wide.
        ("0.02*abs(x - 0.5)", 10, 0.02, Some(KINK)),
        ("0.02*abs(x - 0.507)", 30, 0.02, Some(KINK)),
        ("0.02*max(x - 0.5, 0)", 20, 0.02, Some(KINK)),
        ("0.02*abs(x - 0.5) + 0.02*(x - 0.5)^2", 20, 0.02, Some(KINK)),
        // Smooth gaps, and a kink that no pressure feels.
        ("0.05*(x - 0.5)^2", 10, 0.02, None),
        ("0.5*(x - 0.5)^2", 30, 0.02, None),
        ("0.02*(1 - cos(6*(x - 0.5)))", 20, 0.02, None),
        ("0.00001*abs(x - 0.5)", 20, 0.02, None),
        ("0", 10, 0.02, None),
    ] {
        directory.write("square.msh", &crate::test_directory::square(n));
        for degree in [1, 2] {
            directory.write("scene.toml", &on(gap, degree, pressed));
            let said = directory.run(&[]);
            let found = directory.summary("out/scene")["figures"]["pressure_max"].clone();
            let context = format!("{gap}, n = {n}, P{degree}: {found}\n{}", said.out);
            let kink = found["singular"].as_str().filter(|reason| reason.starts_with(KINK));
            let reason = found["unresolved"].as_str().or(kink.map(|_| KINK));
            assert_eq!(reason, expected, "{context}");
            let line =
                said.out.lines().find(|line| line.contains("largest contact pressure")).unwrap();
            let shown = line.split("largest contact pressure ").nth(1).unwrap();
            let number = shown.split([' ', 'e']).next().unwrap().trim_start_matches(['0', '.']);
            let digits = number.trim_end_matches('0').replace('.', "").len();
            let ending = [": not resolved", ": singular"][usize::from(kink.is_some())];
            assert_eq!(shown.ends_with(ending), expected.is_some(), "{context}");
            assert!(digits <= if expected.is_some() { 2 } else { 5 }, "{context}");
        }
    }
}

/// A profile given by points: a table of them presses with its kinks, and a spline does not.
#[test]
fn kinks_of_a_table_are_named_where_contact_is_closed() {
    let directory = TestDirectory::new();
    let rows = (0..=10).map(|i| f64::from(i) / 10.0);
    let rows: String = rows.map(|x| format!("{x},{}\n", 0.1 * (x - 0.5).powi(2))).collect();
    directory.write("profile.csv", &rows);
    directory.write("square.msh", &crate::test_directory::square(40));
    for (gap, degree, expected) in [
        ("table(\"profile.csv\", x)", 1, true),
        ("table(\"profile.csv\", x)", 2, true),
        ("spline(\"profile.csv\", x)", 2, false),
        ("pchip(\"profile.csv\", x)", 1, false),
    ] {
        directory.write("scene.toml", &on(gap, degree, 0.03));
        for words in [&[][..], &["--bars"]] {
            let said = directory.run(words).out;
            let found = &directory.summary("out/scene")["figures"]["pressure_max"];
            let reason = found["singular"].as_str().unwrap_or_default();
            assert_eq!(reason.starts_with(KINK), expected, "{gap}: {reason}\n{said}");
            assert!(found["bar"].is_null() || !expected, "{gap}: {found}");
        }
    }
}

/// The law of a kink: each bisection adds (E* Δ/2π) ln 2 to the largest pressure (Johnson, Contact Mechanics, 5.2), with
/// E* = E/(1 − ν²) in plane strain. Half of the model has the same kink at the axis.
#[test]
fn the_pressure_at_a_kink_grows_by_the_logarithm_of_the_edges() {
    let directory = TestDirectory::new();
    let slope = 0.02;
    let expected = 1000.0 / 0.91 * 2.0 * slope / std::f64::consts::TAU * std::f64::consts::LN_2;
    let pressure = |text: &str, n: usize| {
        directory.write("square.msh", &crate::test_directory::square(n));
        directory.write("scene.toml", text);
        directory.run(&[]);
        let found = directory.summary("out/scene")["figures"]["pressure_max"].clone();
        let reason = found["singular"].as_str().unwrap_or_default().to_owned();
        assert!(reason.starts_with(KINK), "{text}: {found}");
        (found["value"].as_f64().unwrap(), reason)
    };
    for degree in [1, 2] {
        let whole = on(&format!("{slope}*abs(x - 0.5)"), degree, 0.03);
        let [coarse, fine] = [20, 40].map(|n| pressure(&whole, n));
        let growth = fine.0 - coarse.0;
        assert!((growth / expected - 1.0).abs() < 0.1, "P{degree}: {growth}, {expected}");
        assert!(fine.1.ends_with("at (0.5000, 0.0000)"), "{}", fine.1);
        let axis = "{ name = 'left', symmetry = true }, { name = 'bottom'";
        let half = on(&format!("{slope}*x"), degree, 0.03).replace("{ name = 'bottom'", axis);
        let [coarse, fine] = [20, 40].map(|n| pressure(&half, n));
        let growth = fine.0 - coarse.0;
        assert!((growth / expected - 1.0).abs() < 0.1, "P{degree}, half: {growth}, {expected}");
        assert!(fine.1.ends_with("at (0.0000, 0.0000)"), "{}", fine.1);
    }
}

/// Smooth gaps have no kink, however curved they are; their pressures have bars. A weak kink has none at any accuracy and in any units.
#[test]
fn only_gaps_with_a_kink_are_called_kinked() {
    let directory = TestDirectory::new();
    directory.write("square.msh", &crate::test_directory::square(10));
    for (gap, is_kinked) in [
        ("0.4*(x - 0.47)^2", false),
        ("0.01*(1 - cos(11*(x - 0.4)))", false),
        ("0.02*sqrt((x - 0.5)^2 + 0.01)", false),
        ("0.1*(x - 0.53)^4 + 0.05*exp(x) - 0.05*x", false),
        ("0.02*if(x < 0.5, (x - 0.5)^2, (x - 0.5)^3)", false),
        ("0.1*max(0, x - 0.45)^2", false),
        ("0.1*(x - 0.5)^2 + 0.001*abs(x - 0.52)", true),
        ("0.1*(x - 0.5)^2 + 0.001*sqrt((x - 0.5)^2)", true),
        ("0.1*(x - 0.5)^2 - 0.001*min(x, 0.46)", true),
        // Where the slope falls, the pressure has no peak.
        ("0.1*(x - 0.5)^2 - 0.0001*abs(x - 0.52)", false),
        // The kink is open.
        ("0.4*(x - 0.2)^2 + 0.01*abs(x - 0.9)", false),
    ] {
        for degree in [1, 2] {
            directory.write("scene.toml", &on(gap, degree, 0.01));
            directory.run(&[]);
            let found = directory.summary("out/scene")["figures"]["pressure_max"].clone();
            let reason = found["singular"].as_str().unwrap_or_default();
            assert_eq!(reason.starts_with(KINK), is_kinked, "{gap}, P{degree}: {found}");
        }
    }
    // In m and Pa, and in mm and MPa.
    for (l, e) in [(1.0, 1.0), (1000.0, 1e-6)] {
        directory.write(
            "box.geo",
            &format!(
                "Point(1) = {{-{l}, 0, 0}}; Point(2) = {{{l}, 0, 0}}; Point(3) = {{{l}, {}, 0}};
                 Point(4) = {{-{l}, {}, 0}}; Line(1) = {{1, 2}}; Line(2) = {{2, 3}}; Line(3) = {{3, 4}};
                 Line(4) = {{4, 1}}; Curve Loop(1) = {{1:4}}; Plane Surface(1) = {{1}};
                 Physical Curve(\"bottom\") = {{1}}; Physical Curve(\"top\") = {{3}};
                 Physical Surface(\"body\") = {{1}};\n",
                2.0 * l,
                2.0 * l
            ),
        );
        directory.write(
            "scene.toml",
            &format!(
                "mesh = {{ file = 'box.geo', size = {} }}
                 material = {{ young = {}, poisson = 0.3, plane = 'strain' }}
                 boundary = [{{ name = 'bottom', gap = '0.01*x^2/{l} + 0.0001*abs(x)' }},
                             {{ name = 'top', pressure = {} }}]",
                0.2 * l,
                1e5 * e,
                100.0 * e
            ),
        );
        for accuracy in ["0.1", "0.02"] {
            directory.run(&["--accuracy", accuracy]);
            let found = directory.summary("out/scene")["figures"]["pressure_max"].clone();
            let reason = found["singular"].as_str().unwrap_or_default();
            assert!(reason.starts_with(KINK), "{l}, {accuracy}: {found}");
            assert!(found["bar"].is_null(), "{l}, {accuracy}: {found}");
        }
    }
}

#[test]
fn a_pressure_that_is_not_resolved_has_no_bar() {
    let directory = TestDirectory::new();
    directory.write("square.msh", &crate::test_directory::square(10));
    for gap in ["5*abs(x - 0.5)", "0.02*abs(x - 0.5)"] {
        for degree in [1, 2] {
            directory.write("scene.toml", &on(gap, degree, 0.01));
            directory.run(&["--bars"]);
            let figures = &directory.summary("out/scene")["figures"];
            assert!(figures["pressure_max"]["bar"].is_null(), "{gap}, P{degree}: {figures}");
            assert!(
                figures["contact_force"]["bar"].as_f64() > Some(0.0),
                "{gap}, P{degree}: {figures}"
            );
        }
    }
}

#[test]
fn linear_triangles_that_lock_have_no_bars_and_say_so() {
    let directory = TestDirectory::new();
    directory.write("block.geo", BLOCK);
    for (degree, plane, poisson, locks) in [
        (1, "strain", 0.4999, true),
        (1, "strain", 0.4, false),
        (1, "stress", 0.4999, false),
        (2, "strain", 0.4999, false),
    ] {
        let text = format!(
            "mesh = {{ file = 'block.geo', size = 0.3 }}
             discretisation.displacement = {degree}
             material = {{ young = 100, poisson = {poisson}, plane = '{plane}' }}
             boundary = [{{ name = 'near', displacement = [0, 0] }}, {{ name = 'far', gap = 0 }},
                         {{ name = 'top', pressure = 1 }}]"
        );
        directory.write("scene.toml", &text);
        let said = directory.run(&["--bars"]);
        let figures = directory.summary("out/scene")["figures"].clone();
        let has_none = figures.as_object().unwrap().values().all(|of| of["bar"].is_null());
        assert_eq!(has_none, locks, "P{degree}, {plane}, {poisson}");
        assert_eq!(
            said.out.contains("no error bars: a finer mesh does not show"),
            locks,
            "{said:?}"
        );
    }
}

/// Where a foundation ends under a body, stresses and pressures grow like r^−½ with every finer mesh; the length of contact
/// does not.
#[test]
fn extremes_at_the_end_of_a_foundation_have_no_bars_and_its_length_has_one() {
    let directory = TestDirectory::new();
    directory.write(
        "ledge.geo",
        "Point(1) = {0, 0, 0, 0.2}; Point(2) = {0.5, 0, 0, 0.2}; Point(3) = {1, 0, 0, 0.2};
         Point(4) = {1, 1, 0, 0.2}; Point(5) = {0, 1, 0, 0.2};
         Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 1};
         Curve Loop(1) = {1, 2, 3, 4, 5}; Plane Surface(1) = {1};
         Physical Curve('ledge') = {1}; Physical Curve('top') = {4}; Physical Curve('left') = {5};
         Physical Surface('material') = {1};\n",
    );
    directory.write(
        "scene.toml",
        "mesh.file = 'ledge.geo'
         discretisation.displacement = 2
         material = { young = 1000, poisson = 0.3, plane = 'strain' }
         boundary = [{ name = 'ledge', gap = '0' }, { name = 'left', symmetry = true },
                     { name = 'top', displacement = [0, -0.01] }]",
    );
    for options in [&["--bars"][..], &["--accuracy", "0.05"]] {
        directory.run(options);
        let summary = directory.summary("out/scene");
        let bar = |name: &str| summary["figures"][name]["bar"].as_f64();
        for name in ["pressure_max", "von_mises_max", "principal_min"] {
            assert_eq!(summary["figures"][name]["singular"], "the end of `ledge`", "{options:?}");
            assert_eq!(bar(name), None, "{options:?}: {name}");
        }
        assert!(bar("contact_length").is_some() && bar("work").is_some(), "{options:?}");
    }
}

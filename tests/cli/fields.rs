//! `fields.pvd` and its frames, read back.

#[path = "../common/vtu.rs"]
mod vtu;

use crate::test_directory::TestDirectory;
use vtu::frame;

fn field<'a>(data: &'a [(String, Vec<f64>)], name: &str) -> &'a [f64] {
    &data.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no {name}")).1
}

fn close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-9 * (1.0 + b.abs()), "{a} is not {b}");
}

#[test]
fn the_last_frame_is_the_state_of_the_summary() {
    let test_directory = TestDirectory::new();
    test_directory.run(&[]);
    let (time, file) = test_directory.frames("out/scene").pop().expect("frames");
    assert_eq!(time, 1.0);
    let frame = frame(&test_directory.path(&format!("out/scene/{file}")));
    assert_eq!((frame.points.len(), frame.nodes.len()), (3 * 25, 32));
    assert!(frame.types.iter().all(|kind| *kind == vtu::TRIANGLE));
    let sizes = |data: &[(String, Vec<f64>)], count: usize| -> Vec<(String, usize)> {
        data.iter().map(|(name, values)| (name.clone(), values.len() / count)).collect()
    };
    let named = |pairs: &[(&str, usize)]| -> Vec<(String, usize)> {
        pairs.iter().map(|(name, n)| ((*name).to_owned(), *n)).collect()
    };
    let contact = [("displacement", 3), ("zeta", 1), ("normal_pressure", 1), ("gap", 1)];
    let stress =
        [("stress", 4), ("principal_stress", 2), ("principal_direction", 3), ("von_mises", 1)];
    assert_eq!(sizes(&frame.point_data, 25), named(&[contact, stress].concat()));
    assert_eq!(sizes(&frame.cell_data, 32), named(&[("stress_raw", 3)]));

    let summary = test_directory.summary("out/scene");
    let zeta = field(&frame.point_data, "zeta");
    let least = zeta.iter().copied().fold(f64::INFINITY, f64::min);
    close(least, summary["figures"]["zeta_min"]["value"].as_f64().expect("a number"));
    let u = field(&frame.point_data, "displacement");
    let largest = u.chunks(3).map(|u| u[0].hypot(u[1])).fold(0.0, f64::max);
    close(largest, summary["figures"]["displacement_max"]["value"].as_f64().expect("a number"));
    assert!(u.chunks(3).all(|u| u[2] == 0.0));

    // Uniform pressure 3: σ_yy = −3 everywhere, the reaction at the bottom and nowhere else.
    for stress in field(&frame.cell_data, "stress_raw").chunks(3) {
        stress.iter().zip([0.0, -3.0, 0.0]).for_each(|(a, b)| close(*a, b));
    }
    // Single precision.
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-5, "{a} is not {b}");
    for stress in field(&frame.point_data, "stress").chunks(4) {
        stress.iter().zip([0.0, -3.0, 0.0, 0.0]).for_each(|(a, b)| near(*a, b));
    }
    for principal in field(&frame.point_data, "principal_stress").chunks(2) {
        principal.iter().zip([0.0, -3.0]).for_each(|(a, b)| near(*a, b));
    }
    field(&frame.point_data, "von_mises").iter().for_each(|s| near(*s, 3.0));
    let (pressure, gap) =
        (field(&frame.point_data, "normal_pressure"), field(&frame.point_data, "gap"));
    for (i, x) in frame.points.chunks(3).enumerate() {
        match x[1] == 0.0 {
            true => {
                close(pressure[i], 3.0);
                close(gap[i], 0.0);
            }
            false => assert!(pressure[i] == 0.0 && gap[i].is_nan()),
        }
    }
}

#[test]
fn frames_of_quadratic_displacements_have_quadratic_triangles() {
    let test_directory = TestDirectory::new();
    test_directory.run(&["--set", "discretisation.displacement=2"]);
    let (_, file) = test_directory.frames("out/scene").pop().expect("frames");
    let frame = frame(&test_directory.path(&format!("out/scene/{file}")));
    // 25 vertices and 56 edges.
    assert_eq!((frame.points.len(), frame.nodes.len()), (3 * 81, 32));
    assert!(frame.types.iter().all(|kind| *kind == vtu::QUADRATIC_TRIANGLE));
    let summary = test_directory.summary("out/scene");
    assert_eq!((&summary["nodes"], &summary["triangles"]), (&81.into(), &32.into()));
    assert_eq!((&summary["contact_nodes"], &summary["active_nodes"]), (&9.into(), &9.into()));

    // The midpoints of the sides 01, 12, 20 follow the vertices.
    let (zeta, u) = (field(&frame.point_data, "zeta"), field(&frame.point_data, "displacement"));
    for nodes in &frame.nodes {
        assert_eq!(nodes.len(), 6);
        for side in 0..3 {
            let ends = [nodes[side], nodes[(side + 1) % 3]];
            let mean = |of: &dyn Fn(usize) -> f64| 0.5 * (of(ends[0]) + of(ends[1]));
            (0..3).for_each(|k| {
                let x = |node: usize| frame.points[3 * node + k];
                close(x(nodes[3 + side]), mean(&x));
                // Uniform stress: u is affine.
                let u = |node: usize| u[3 * node + k];
                close(u(nodes[3 + side]), mean(&u));
            });
            close(zeta[nodes[3 + side]], mean(&|node| zeta[node]));
        }
    }
    for stress in field(&frame.cell_data, "stress_raw").chunks(3) {
        stress.iter().zip([0.0, -3.0, 0.0]).for_each(|(a, b)| close(*a, b));
    }
    let pressure = field(&frame.point_data, "normal_pressure");
    for (x, pressure) in frame.points.chunks(3).zip(pressure) {
        close(*pressure, if x[1] == 0.0 { 3.0 } else { 0.0 });
    }
}

#[test]
fn the_contact_boundary_has_frames_of_its_own() {
    // Uniform pressure 3 on the bottom, whose normal points down.
    let test_directory = TestDirectory::new();
    test_directory.run(&[]);
    let (_, file) = test_directory.frames("out/scene").pop().expect("frames");
    let file = file.replace("fields_", "contact_");
    assert!(test_directory.read("out/scene/contact.pvd").contains(&file));
    let frame = frame(&test_directory.path(&format!("out/scene/{file}")));
    assert_eq!(frame.nodes, (0..4).map(|i| vec![i, i + 1]).collect::<Vec<_>>());
    assert!(frame.types.iter().all(|kind| *kind == vtu::LINE));
    let rows = test_directory.read("out/scene/contact.csv");
    assert_eq!(rows.lines().count(), 1 + 11 * 5);
    assert!(
        rows.starts_with("time,boundary,part,arc_length,x,y,normal_x,normal_y,gap,pressure,active")
    );
    for pressure in field(&frame.point_data, "pressure_on_body").chunks(3) {
        pressure.iter().zip([0.0, 3.0, 0.0]).for_each(|(a, b)| close(*a, b));
    }
    assert_eq!(field(&frame.point_data, "arc_length"), [0.0, 0.25, 0.5, 0.75, 1.0]);
}

#[test]
fn frames_are_as_many_as_asked_for() {
    let test_directory = TestDirectory::new();
    // Steps 0 … 10: all of them, every third and the last, the ends.
    for (every, times) in [
        (None, (0..=10).collect::<Vec<_>>()),
        (Some(3), vec![0, 3, 6, 9, 10]),
        (Some(50), vec![0, 10]),
    ] {
        let set = every.map(|n| format!("output.every={n}"));
        let arguments: Vec<&str> = set.iter().flat_map(|s| ["--set", s]).collect();
        test_directory.run(&arguments);
        let frames = test_directory.frames("out/scene");
        let tenths: Vec<i32> = frames.iter().map(|(t, _)| (10.0 * t).round() as i32).collect();
        assert_eq!(tenths, times);
        // An earlier run's frames are gone, and there is nothing else.
        let mut files: Vec<String> = frames.into_iter().map(|(_, file)| file).collect();
        let contact: Vec<_> = files.iter().map(|f| f.replace("fields_", "contact_")).collect();
        let others = ["contact.csv", "contact.pvd", "fields.pvd", "history.csv", "scene.toml"];
        files.extend(contact.into_iter().chain(others.map(str::to_owned)));
        files.extend(["scene.msh", "summary.json"].map(str::to_owned));
        files.sort();
        assert_eq!(test_directory.names("out/scene"), files);
    }
}

#[test]
fn a_run_that_does_not_come_far_has_frames_of_its_beginning() {
    let test_directory = TestDirectory::new();
    // 200 steps: every tenth, and before the first of these the steps 1, 2, 4 and 8.
    let stopping = ["--set", "time.step=0.005", "--set", "damage.lambda_u=1e5"];
    test_directory.run(&stopping);
    let frames = test_directory.frames("out/scene");
    let steps: Vec<i32> = frames.iter().map(|(t, _)| (200.0 * t).round() as i32).collect();
    let last = test_directory.summary("out/scene")["steps"].as_i64().expect("a number") as i32;
    assert!(last < 100, "it stopped at ζ_*: {last}");
    let expected = [0, 1, 2, 4, 8].into_iter().chain((1..20).map(|n| 10 * n));
    let expected: Vec<i32> = expected.filter(|n| *n < last).chain([last]).collect();
    assert_eq!(steps, expected);
}

#[test]
fn chosen_steps_have_about_twenty_frames() {
    let test_directory = TestDirectory::new();
    test_directory.run(&["--set", "time.step=auto", "--set", "time.tolerance=1e-4"]);
    let frames = test_directory.frames("out/scene").len() as i64;
    let steps = test_directory.summary("out/scene")["steps"].as_i64().expect("a number");
    assert!(steps > 40 && (20..=30).contains(&frames), "{frames} frames of {steps} steps");
}

#[test]
fn frames_are_at_the_times_asked_for() {
    let test_directory = TestDirectory::new();
    let times = [0.123, 0.5, 0.777];
    let set = ["--set", "output.times=[0.777, 0.123, 0.5]", "--set"];
    for step in ["time.step=auto", "accuracy=0.05", "time.step=0.001"] {
        test_directory.run(&[&set[..], &[step]].concat());
        let frames = test_directory.frames("out/scene");
        let found: Vec<f64> = frames.iter().map(|(time, _)| *time).collect();
        assert_eq!(found.len(), 4, "{found:?}");
        for (found, time) in found.iter().zip(times.into_iter().chain([1.0])) {
            // The n-th of equal steps has the rounding of n/1000.
            let is_there =
                if step.ends_with("1") { (found - time).abs() < 1e-12 } else { *found == time };
            assert!(is_there, "{step}: {found} for {time}");
        }
        let (columns, rows) = test_directory.history("out/scene");
        let column = columns.iter().position(|name| name == "time").expect("times");
        assert!(found.iter().all(|time| rows.iter().any(|row| row[column] == *time)));
    }
}

#[test]
fn what_others_put_into_the_folder_stays_but_figures_of_an_earlier_run() {
    let test_directory = TestDirectory::new();
    let others =
        ["notes.txt", "damage_mine.png", "fields_mine.vtu", "fields_0001_old.vtu", "mesh.msh"];
    test_directory.run(&["--set", "time.end=0.1"]);
    let ours =
        ["deformed.png", "pressure_t0.5.svg", "damage.gif", "report.html", "fields_0099_1.vtu"];
    for name in others.into_iter().chain(ours) {
        test_directory.write(&format!("out/scene/{name}"), "mine");
    }
    test_directory.run(&["--set", "time.end=0.1"]);
    for name in others {
        assert_eq!(test_directory.read(&format!("out/scene/{name}")), "mine");
    }
    for name in ours {
        assert!(!test_directory.path(&format!("out/scene/{name}")).exists(), "{name}");
    }
}

//! `check` and `info`: what there is to solve, and what was solved.

use crate::test_directory::TestDirectory;

#[test]
fn a_scene_is_described_and_nothing_is_written() {
    let test_directory = TestDirectory::new();
    let before = test_directory.everything();
    let said = test_directory.say(&["check", "scene.toml"]);
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
    for fragment in [
        "25 vertices, 32 triangles, up to 1 m wide, angles from 45°",
        "50 of u, 25 of ζ; 5 nodes with a gap",
        "gap from 0 to 0 m",
        // -3 t on the unit top.
        "t = 0: (0, 0) N/m, moment about (0, 0) 0 N",
        "t = 1: (0, -3) N/m, moment about (0, 0) -1.5 N",
        "contact alone stops the vertical translation",
        "about 0.1 s in 10 steps, or 0.1 s",
    ] {
        assert!(said.out.contains(fragment), "no `{fragment}` in: {}", said.out);
    }
    // The right side, which the scene does not list.
    let free = said.out.lines().find(|line| line.contains("(all other)")).expect("a row");
    let words: Vec<_> = free.split_whitespace().skip(2).collect();
    assert_eq!(words, ["free", "4", "1", "(1.000,", "0.000)"]);
    assert_eq!(test_directory.everything(), before);
}

#[test]
fn a_scene_that_cannot_be_solved_is_refused_after_its_mesh_is_described() {
    let test_directory = TestDirectory::new();
    let said =
        test_directory.say(&["check", "scene.toml", "--set", "boundary.top.traction=[0, 1]"]);
    said.fails(2, &["the vertical translation", "the load drives it"]);
    assert!(said.out.contains("32 triangles"), "{said:?}");
    let said = test_directory.say(&["check", "scene.toml", "--set", "boundary.top.name=lid"]);
    said.fails(2, &["boundary \"lid\" is no physical curve"]);
    assert_eq!(said.out, "");
}

/// A load beyond a tenth of E is noted before any solve, by `check` and by `run`; one below is not. Pressures and tractions
/// count, at any time.
#[test]
fn loads_that_are_large_beside_the_modulus() {
    let directory = TestDirectory::new();
    let large = "boundary.top.traction=['-7*t', '-7*t']";
    for (set, is_noted) in [
        ("boundary.top.traction=[0, '-7.9*t']", false),
        (large, true),
        ("boundary.top.traction=[0, '-8.1*(1-abs(2*t-1))']", true),
        ("material.young=29", true),
    ] {
        let said = directory.say(&["check", "scene.toml", "--set", set]);
        assert_eq!(said.out.contains("is more than a tenth of E = "), is_noted, "{set}: {said:?}");
    }
    let said = directory.run(&["--set", large]).out;
    let note = "the load 9.9e0 Pa on `top` is more than a tenth of E = 8e1 Pa: are the units";
    assert!(said.find(note) < said.find("  end  ") && said.matches(note).count() == 1, "{said}");
}

/// A probe shows the stresses of a uniform state, σ_yy = −3; the damage of a run of one step has a reason.
#[test]
fn the_closing_lines_show_stresses_at_probes_and_why_there_is_no_damage() {
    let directory = TestDirectory::new();
    let probe = "probe=[{name='A', point=[0.5, 0.5]}]";
    let said = directory.run(&["--set", probe, "--set", "time.step=1"]).out;
    for text in [
        "displacement at A (",
        "stress at A, xx ",
        "stress at A, yy -3 Pa",
        "von Mises stress at A 3 Pa",
        "ζ at A 1",
    ] {
        assert!(said.contains(text), "no `{text}` in {said}");
    }
    assert!(said.contains("none yet: it begins in the second step"), "{said}");
}

#[test]
fn results_are_described() {
    let test_directory = TestDirectory::new();
    test_directory.run(&[]);
    let Some(said) = test_directory.say_python(&["info", "out/scene"]) else { return };
    assert_eq!(said.code, Some(0), "{said:?}");
    let lines: Vec<String> = (said.out.lines())
        .map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "))
        .collect();
    for line in ["title Pressed square", "steps 10", "frames 11, from t = 0 to 1"] {
        assert!(lines.iter().any(|other| other == line), "no `{line}` in: {}", said.out);
    }
    assert!(said.out.contains("run scene.toml") && !said.out.contains("foundation"));
    std::fs::remove_file(test_directory.path("out/scene/fields_0000.vtu")).unwrap();
    let said = test_directory.say(&["info", "out/scene"]);
    assert!(said.out.contains("10, from t = 0.1 to 1 (1 more are gone)"), "{}", said.out);
    test_directory
        .say(&["info", "out"])
        .fails(2, &["out/summary.json", "name a folder of results"]);
}

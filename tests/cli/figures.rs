//! Figures and reports, where there is a Python that draws them.

use crate::test_directory::TestDirectory;

#[test]
fn figures_and_a_report_are_drawn_far_from_the_scripts() {
    let test_directory = TestDirectory::new();
    test_directory.run(&["--set", "output.every=5"]);
    let drawn = test_directory.say(&["figures", "out/scene", "--time", "0.45", "--format", "svg"]);
    if drawn.err.contains("apt install python3-matplotlib") {
        return;
    }
    assert_eq!(drawn.code, Some(0), "{drawn:?}");
    for picture in ["setting_t0.5.svg", "deformed_t0.5.svg", "pressure_t0.5.svg"] {
        assert!(test_directory.read(&format!("out/scene/{picture}")).contains("<svg"), "{picture}");
    }
    assert_eq!(test_directory.say(&["figures", "nothing"]).code, Some(2));

    assert_eq!(test_directory.say(&["report", "out/scene"]).code, Some(0));
    let page = test_directory.read("out/scene/report.html");
    assert!(page.contains("data:image/png;base64,") && page.contains("[[boundary]]"));
    let outside = ["src=\"http", "href=", "<link", "@import", "$title"];
    assert!(outside.iter().all(|word| !page.contains(word)), "the page is not whole");

    let last = test_directory.frames("out/scene").pop().expect("a frame").1;
    let frame = format!("out/scene/{last}");
    test_directory.write(&frame, &test_directory.read(&frame)[..999]);
    let cut = format!("{frame}: it is damaged or cut off");
    test_directory.say(&["figures", "out/scene"]).fails(2, &[&cut]);
}

#[test]
fn the_foundation_is_drawn_where_it_is_at_the_time_of_the_picture() {
    // A plate below that comes up by 0.01 in the run, and one at the right, which leaves the corner
    // (1, 0) opposite (1.2, −gap).
    let directory = TestDirectory::new();
    let plates = "boundary.bottom.gap='0.02 - 0.01*t'";
    let scene =
        format!("{}\n[[boundary]]\nname = \"right\"\ngap = 0.2\n", directory.read("scene.toml"));
    directory.write("plates.toml", &scene);
    directory.say(&["run", "plates.toml", "--set", plates, "--set", "output.every=5"]);
    let scripts = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts");
    let draws = format!(
        "import sys; sys.path.insert(0, '{scripts}')\n\
         from pathlib import Path\n\
         from reading import read_results\n\
         for time in (0.0, 0.5, 1.0):\n\
         \x20   results = read_results(Path('out/plates'), time)\n\
         \x20   points = sorted(p for line in results.foundation() for p in map(tuple, line.tolist()))\n\
         \x20   print(len(points), points[0], points[-1], points[4])"
    );
    let python = std::env::var("PYTHON").unwrap_or("/usr/bin/python3".to_owned());
    let said = std::process::Command::new(python)
        .args(["-c", &draws])
        .current_dir(directory.path("."))
        .output()
        .expect("Python");
    let error = String::from_utf8_lossy(&said.stderr);
    if error.contains("No module named") {
        return;
    }
    let expected = "9 (0.0, -0.02) (1.2, 1.0) (1.2, -0.02)\n\
                    9 (0.0, -0.015) (1.2, 1.0) (1.2, -0.015)\n\
                    9 (0.0, -0.01) (1.2, 1.0) (1.2, -0.01)\n";
    assert_eq!(String::from_utf8_lossy(&said.stdout), expected, "{error}");
}

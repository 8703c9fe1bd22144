//! The viewer of report.html in a browser, where Chromium and Selenium are.

use crate::test_directory::{SCENE, TestDirectory, square};
use std::process::Command;

/// What viewer.py finds wrong with the page of a run, then the number of compared values; `None` without a browser.
fn looked_at(directory: &TestDirectory, folder: &str) -> Option<String> {
    let python = std::env::var("PYTHON").unwrap_or("/usr/bin/python3".to_owned());
    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cli/viewer.py");
    let ran =
        Command::new(python).args([program, folder]).current_dir(directory.path(".")).output();
    let ran = ran.expect("Python");
    let [out, err] = [ran.stdout, ran.stderr].map(|text| String::from_utf8(text).expect("UTF-8"));
    if err.contains("No module named")
        || err.contains("NoSuchDriverException")
        || err.contains("/usr/bin/chrom")
    {
        eprintln!("skipped: {err}");
        return None;
    }
    assert!(ran.status.success(), "{out}{err}");
    Some(out)
}

/// Values under the pointer are those of the VTU, at ten places per field and frame; slider, field and range do what they
/// say; the page fetches nothing and fits into narrow windows.
#[test]
fn the_viewer_shows_the_values_of_the_frames() {
    let directory = TestDirectory::new();
    for (degree, compared) in [("1", "333"), ("2", "333")] {
        let degree = format!("discretisation.displacement={degree}");
        directory.run(&["--set", "output.every=5", "--set", &degree]);
        if directory.say_python(&["report", "out/scene"]).is_none() {
            return;
        }
        let Some(found) = looked_at(&directory, "out/scene") else { return };
        assert_eq!(found.trim(), compared, "{degree}");
    }
}

/// Names that are scripts are text to the viewer. It would report an alert as an unexpected one.
#[test]
fn names_that_are_scripts_run_none() {
    let name = "</script><script>alert(1)</script><img src=x onerror=alert(2)>";
    let directory = TestDirectory::new();
    let quoted = toml::Value::from(name).to_string();
    directory.write("square.msh", &square(4).replace("\"top\"", &format!("\"{name}\"")));
    let scene = SCENE.replace("\"top\"", &quoted).replace("\"Pressed square\"", &quoted);
    directory.write("scene.toml", &format!("{scene}\n[units]\nlength = {quoted}\n"));
    directory.run(&["--set", "output.every=5"]);
    if directory.say_python(&["report", "out/scene"]).is_none() {
        return;
    }
    let Some(found) = looked_at(&directory, "out/scene") else { return };
    assert!(found.trim().parse::<usize>().is_ok_and(|count| count > 100), "{found}");
}

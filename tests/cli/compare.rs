//! `signorini compare`.

use crate::test_directory::TestDirectory;
use signorini::contact::SOLVERS;

#[test]
fn solvers_are_compared_at_order_2_and_on_the_mesh_of_an_accuracy() {
    compared("discretisation.displacement=2");
    compared("accuracy=0.05");
}

#[test]
fn a_solver_that_fails_is_compared_by_why_it_does() {
    let directory = TestDirectory::new();
    let load = "boundary.top.traction=[0, -3]";
    let none = "contact.penalty_duality.iterations=0";
    let solvers = ["--solvers", "active-set,penalty-duality", "--set", load, "--set", none];
    let said = directory.say(&[&["compare", "scene.toml"], &solvers[..]].concat());
    if said.err.contains("apt install python3-matplotlib") {
        return;
    }
    said.fails(
        1,
        &["error: scene, penalty-duality: step 0 (t = 0): penalty-duality stopped after"],
    );
    let row = said.out.lines().find(|line| line.contains("| penalty-duality")).expect("a row");
    let cells: Vec<_> = row.split('|').map(str::trim).collect();
    assert_eq!(cells[3..12], ["0", "-", "-", "-", "-", "-", "-", "-", "FAILED"], "{row}");
    assert!(row.contains("step 0 (t = 0): penalty-duality stopped after 0 iterations"), "{row}");
    let table = directory.read("out/compare/comparison.csv");
    assert!(table.contains("scene,penalty-duality,0,,,,,,,,,,"), "{table}");
}

/// All solvers agree on the scene with a key overridden.
fn compared(key: &str) {
    let test_directory = TestDirectory::new();
    let said = test_directory.say(&["compare", "scene.toml", "--set", key]);
    if said.err.contains("apt install python3-matplotlib") {
        return;
    }
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
    let table = test_directory.read("out/compare/comparison.csv");
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    let names = reader.headers().expect("a header").clone();
    let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.expect("a row")).collect();
    assert_eq!(rows.len(), SOLVERS.len());
    for row in &rows {
        let value = |name: &str| &row[names.iter().position(|n| n == name).expect(name)];
        for difference in ["difference_u", "difference_zeta", "difference_pressure"] {
            let value: f64 = value(difference).parse().expect("a number");
            assert!(value < 1e-8, "{difference}: {value}");
        }
        assert_eq!(value("error"), "");
        // The scene has 10 steps; an accuracy chooses others.
        assert_eq!(value("steps") == "10", key != "accuracy=0.05", "{key}: {row:?}");
    }
}

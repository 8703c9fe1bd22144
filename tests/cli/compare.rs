//! `signorini compare`.

use crate::test_directory::{TestDirectory, sets};
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
    let Some(said) = directory.say_python(&[&["compare", "scene.toml"], &solvers[..]].concat())
    else {
        return;
    };
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
    let Some(said) = test_directory.say_python(&["compare", "scene.toml", "--set", key]) else {
        return;
    };
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

/// The iterates of penalty-duality are those of the method, whether the free unknowns are eliminated or
/// every step 1 solves for all of them: cut off after some iterations, both miss the contact law alike.
#[test]
fn penalty_duality_has_the_same_iterates_condensed_and_with_all_unknowns() {
    let directory = TestDirectory::new();
    let run = |gap: &str, accelerate: bool, iterations: usize, options: &[&str]| {
        let boundary = format!(
            "boundary=[{{ name = \"left\", displacement = [0, 0] }}, \
            {{ name = \"bottom\", gap = \"{gap}\" }}, {{ name = \"top\", traction = [0, \"-3*t\"] }}]"
        );
        let method = format!(
            "contact.penalty_duality={{ accelerate = {accelerate}, iterations = {iterations} }}"
        );
        let keys = sets(&["time.step=1", "contact.rescue=false", &boundary, &method]);
        let command = ["run", "scene.toml", "--solver", "penalty-duality", "--out", "out"];
        directory.say(&[&command[..], &keys, options].concat())
    };
    let whole = &["--", "-elastic_pc_type", "cholesky"][..];
    for gap in ["0.03*(x - 0.6)^2", "-0.01*x"] {
        for (accelerate, iterations) in [(true, 3), (true, 5), (false, 3), (false, 40)] {
            let [condensed, whole] =
                [&[], whole].map(|options| run(gap, accelerate, iterations, options));
            condensed.fails(1, &["the tolerance 1.0e-10 is missed by contact pressures"]);
            assert_eq!(condensed.err, whole.err, "gap {gap}, {iterations} iterations");
        }
        for accelerate in [true, false] {
            let answer = |options: &[&str]| {
                assert_eq!(run(gap, accelerate, 1000, options).code, Some(0));
                let (_, rows) = directory.history("out");
                rows.last().expect("rows")[4..7].to_vec()
            };
            for (a, b) in answer(&[]).iter().zip(answer(whole)) {
                assert!((a - b).abs() < 1e-9 * b.abs(), "gap {gap}: {a} and {b}");
            }
        }
    }
}

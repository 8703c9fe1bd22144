//! Equal runs give equal files to the last bit, alone and on several ranks.

use super::{
    example, on_ranks,
    test_directory::{ProgramOutput, TestDirectory},
};
use std::collections::BTreeMap;

/// Entries of `summary.json` that tell how long a run took.
const TIMES: [&str; 5] =
    ["provenance", "wall_seconds", "peak_megabytes", "seconds_per_step", "phases"];

/// The files of a run's folder by name, without what tells seconds.
pub fn results(test_directory: &TestDirectory, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let content = |name: String| {
        let path = format!("{folder}/{name}");
        let bytes = match &name[..] {
            "summary.json" => {
                let mut summary = test_directory.summary(folder);
                let entries = summary.as_object_mut().expect("an object");
                TIMES.iter().for_each(|key| assert!(entries.remove(*key).is_some(), "{key}"));
                summary.to_string().into_bytes()
            }
            "history.csv" => {
                let text = test_directory.read(&path);
                assert!(text.lines().next().is_some_and(|header| header.ends_with(",seconds")));
                let rows = text.lines().map(|row| row.rsplit_once(',').expect("columns").0);
                rows.collect::<Vec<_>>().join("\n").into_bytes()
            }
            _ => std::fs::read(test_directory.path(&path)).expect("readable"),
        };
        (name, bytes)
    };
    test_directory.names(folder).into_iter().map(content).collect()
}

#[test]
fn a_run_repeats_itself_to_the_last_bit() {
    // The load and with it the contact travel: factors age, and are replaced many times.
    let travelling = r#"boundary.load.traction=["0","-160*max(0,1-abs(x-8*t)/2)"]"#;
    let test_directory = example("lshape");
    for solver in ["active-set", "penalty-duality", "tao"] {
        for ranks in [1, 2] {
            let run = |out: &str| {
                let set = ["--set", travelling, "--set", "time.step=0.1"];
                let arguments = ["run", "scene.toml", "--solver", solver, "--out", out];
                let arguments = [&arguments[..], &set].concat();
                let said = match ranks {
                    1 => test_directory.say(&arguments),
                    _ => ProgramOutput::of(&mut on_ranks(&test_directory, ranks, &arguments)),
                };
                assert_eq!(said.code, Some(0), "{said:?}");
                results(&test_directory, out)
            };
            // Names of other lengths move what is allocated behind them.
            let first = run(&format!("{solver}-{ranks}"));
            let second = run(&format!("{solver}-{ranks}-once-more"));
            assert!(first.len() > 10 && first.keys().eq(second.keys()));
            for (name, bytes) in &first {
                assert!(*bytes == second[name], "{solver} on {ranks} ranks: {name} differs");
            }
        }
    }
}

//! Equal runs give equal files to the last bit, alone and on several ranks.

use super::{example, on_ranks, test_directory::ProgramOutput};
use signorini::contact::SOLVERS;

#[test]
fn a_run_repeats_itself_to_the_last_bit() {
    // The load and with it the contact travel: factors age, and are replaced many times.
    let travelling = r#"boundary.load.traction=["0","-160*max(0,1-abs(x-8*t)/2)"]"#;
    let directory = example("lshape");
    let alone = SOLVERS.map(|solver| (solver, 1));
    for (solver, ranks) in alone.into_iter().chain([(SOLVERS[0], 2)]) {
        // Names of other lengths move what is allocated behind them.
        let [first, second] = ["first", "once-more"].map(|out| {
            let set = ["--set", travelling, "--set", "time.step=0.1"];
            let arguments = [&["run", "scene.toml", "--solver", solver, "--out", out], &set[..]];
            let said = match ranks {
                1 => directory.say(&arguments.concat()),
                _ => ProgramOutput::of(&mut on_ranks(&directory, ranks, &arguments.concat())),
            };
            assert_eq!(said.code, Some(0), "{said:?}");
            directory.results(out)
        });
        assert!(first.len() > 10 && first.keys().eq(second.keys()));
        for (name, bytes) in &first {
            assert!(*bytes == second[name], "{solver} on {ranks} ranks: {name} differs");
        }
    }
}

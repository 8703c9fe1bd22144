//! The program on several ranks, from outside: the same answers, whole results, one voice.

mod vtu_pieces;
mod repeat;

#[path = "../cli/test_directory.rs"]
#[allow(dead_code, reason = "the command line's tests use the rest of it")]
mod test_directory;

use signorini::petsc::Communicator;
use std::{
    fs::{self, File},
    path::Path,
    process::{Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};
use test_directory::{ProgramOutput, TestDirectory};

/// Answers on several ranks may differ by this, relative to the largest value of a run.
const SAME: f64 = 1e-8;

/// After so many seconds a run is ended: it would never end by itself.
const LONGEST: &str = "300";

/// A coarser mesh of the scenes that are graded.
const COARSE: [&str; 4] = ["--set", "mesh.size=0.5", "--set", "mesh.parameters.grading=8"];

/// The program on `ranks` ranks, on a machine that may have fewer cores.
pub fn on_ranks(test_directory: &TestDirectory, ranks: usize, arguments: &[&str]) -> Command {
    let mut command = Command::new("mpiexec");
    command
        .args(["-n", &ranks.to_string(), "--oversubscribe", "--timeout", LONGEST])
        .arg(env!("CARGO_BIN_EXE_signorini"))
        .args(arguments)
        .current_dir(test_directory.path(""))
        .envs([("OMPI_ALLOW_RUN_AS_ROOT", "1"), ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")])
        .env("LC_ALL", "C");
    command
}

/// The program on two ranks with arguments of their own.
fn unlike(test_directory: &TestDirectory, first: &[&str], second: &[&str]) -> ProgramOutput {
    let program = env!("CARGO_BIN_EXE_signorini");
    let mut command = on_ranks(test_directory, 1, &[&["run", "scene.toml"], first].concat());
    command.args([":", "-n", "1", program, "run", "scene.toml"]).args(second);
    ProgramOutput::of(&mut command)
}

/// A test_directory with a scene of `geo/` called `scene.toml` and its geometry.
fn example(name: &str) -> TestDirectory {
    let test_directory = TestDirectory::new();
    let geo = Path::new(env!("CARGO_MANIFEST_DIR")).join("geo");
    let scene = fs::read_to_string(geo.join(format!("{name}.toml"))).expect("the scene");
    for entry in fs::read_dir(&geo).expect("the folder").flatten() {
        let file = entry.file_name().to_string_lossy().into_owned();
        if file.ends_with(".geo") && scene.contains(&file) {
            test_directory.write(&file, &fs::read_to_string(entry.path()).expect("the geometry"));
        }
    }
    test_directory.write("scene.toml", &scene);
    test_directory
}

/// Columns of `history.csv` that tell the answer and not how it was found.
const ANSWER: [&str; 8] = [
    "step",
    "time",
    "zeta_min",
    "zeta_mean",
    "displacement_max",
    "work",
    "contact_force",
    "active_nodes",
];

#[track_caller]
fn same_history(test_directory: &TestDirectory, folder: &str, reference: &str) {
    let (names, rows) = test_directory.history(folder);
    let (_, expected) = test_directory.history(reference);
    assert_eq!(rows.len(), expected.len(), "{folder}");
    // Besides, resultants, probes and contact: `name.quantity`. Equal pressures may have their peak at any of their nodes.
    let is_observed = |name: &&str| name.contains('.') && !name.contains(".peak_");
    let observed = names.iter().map(String::as_str).filter(is_observed);
    for name in ANSWER.into_iter().chain(observed) {
        let column = names.iter().position(|n| n == name).expect("the column");
        // One force may be zero where another is not.
        let group = |other: &String| other == name || (name.contains('.') && other.contains('.'));
        let columns: Vec<usize> = (0..names.len()).filter(|&i| group(&names[i])).collect();
        let values = expected.iter().flat_map(|row| columns.iter().map(|&i| row[i].abs()));
        let size = values.fold(f64::MIN_POSITIVE, f64::max);
        for (row, expected) in rows.iter().zip(&expected) {
            // Places without contact are NaN.
            let is_none = row[column].is_nan() && expected[column].is_nan();
            let off = if is_none { 0.0 } else { (row[column] - expected[column]).abs() / size };
            assert!(off <= SAME, "{folder}: {name} at t = {} is off by {off:.1e}", row[1]);
        }
    }
}

/// A scene of `geo/` with every solver on one to four ranks, with so few steps that this is quick.
fn every_solver(name: &str, few: &[&str]) -> TestDirectory {
    let test_directory = example(name);
    for solver in ["active-set", "penalty-duality", "tao"] {
        for ranks in 1..=4 {
            let out = format!("out/{name}-{solver}-{ranks}");
            let run = ["run", "scene.toml", "--solver", solver, "--out", &out];
            let arguments = [&run[..], few].concat();
            let said = match ranks {
                1 => test_directory.say(&arguments),
                _ => ProgramOutput::of(&mut on_ranks(&test_directory, ranks, &arguments)),
            };
            assert_eq!(said.code, Some(0), "{out}: {said:?}");
            assert!(said.err.is_empty(), "{out}: {said:?}");
            if ranks > 1 {
                same_history(&test_directory, &out, &format!("out/{name}-{solver}-1"));
            }
        }
    }
    test_directory
}

#[test]
fn the_square_that_stops() {
    // The printed scene reaches ζ_* in the first steps.
    every_solver("square", &["--set", "mesh.size=0.125", "--set", "time.step=0.02"]);
}

#[test]
fn the_mild_square() {
    every_solver("square-mild", &["--set", "mesh.size=0.125", "--set", "time.step=0.25"]);
}

/// Diffusion so strong that the mass is lost in the rounding of M + kκL: no damage may be lost with it.
#[test]
fn the_mild_square_with_uniform_damage() {
    let test_directory = example("square-mild");
    let few = ["--set", "mesh.size=0.125", "--set", "time.step=0.25"];
    for ranks in [1, 2] {
        let out = format!("out/{ranks}");
        let run = ["run", "scene.toml", "--set", "damage.diffusion=1e13", "--out", &out];
        let said =
            ProgramOutput::of(&mut on_ranks(&test_directory, ranks, &[&run[..], &few].concat()));
        assert_eq!(said.code, Some(0), "{said:?}");
        same_history(&test_directory, &out, "out/1");
    }
}

#[test]
fn the_lshape() {
    every_solver("lshape", &[&COARSE[..], &["--set", "time.step=0.25"]].concat());
}

/// Whether the number of active nodes changes from step to step.
#[track_caller]
fn contact_travels(test_directory: &TestDirectory, folder: &str) {
    let (names, rows) = test_directory.history(folder);
    let column = names.iter().position(|n| n == "active_nodes").expect("the column");
    let changes = rows.windows(2).filter(|pair| pair[0][column] != pair[1][column]).count();
    assert!(changes >= 5, "{folder}: the contact set changes in {changes} steps only");
}

#[test]
fn the_lshape_under_a_rolling_load() {
    let test_directory =
        every_solver("lshape-rolling", &["--set", "mesh.size=0.25", "--set", "time.step=0.1"]);
    contact_travels(&test_directory, "out/lshape-rolling-active-set-1");
}

/// Contact unknowns are eliminated last: without damage the factor of the first step is kept for every set
/// of active nodes.
#[test]
fn a_rolling_load_without_damage_takes_one_factorisation() {
    let test_directory = example("lshape-rolling");
    let sound = ["--set", "damage.lambda_d=0", "--set", "damage.lambda_u=0"];
    let few = ["--set", "mesh.size=0.25", "--set", "time.step=0.05"];
    for ranks in 1..=3 {
        let out = format!("out/{ranks}");
        let run = ["run", "scene.toml", "--solver", "active-set", "--out", &out];
        let arguments = [&run[..], &sound, &few].concat();
        let said = ProgramOutput::of(&mut on_ranks(&test_directory, ranks, &arguments));
        assert_eq!(said.code, Some(0), "{said:?}");
        contact_travels(&test_directory, &out);
        same_history(&test_directory, &out, "out/1");
        let (names, rows) = test_directory.history(&out);
        let column = names.iter().position(|n| n == "factorisations").expect("the column");
        let factorisations: f64 = rows.iter().map(|row| row[column]).sum();
        assert_eq!(factorisations, 1.0, "{ranks} ranks");
    }
}

#[test]
fn the_beam_under_a_wave() {
    let test_directory =
        every_solver("beam", &["--set", "mesh.size=0.25", "--set", "time.step=0.125"]);
    contact_travels(&test_directory, "out/beam-active-set-1");
}

#[test]
fn the_half_bridge() {
    every_solver("bridge-half", &[&COARSE[..], &["--set", "time.step=0.25"]].concat());
}

#[test]
fn the_bridge_that_may_slide() {
    let linear = ["--set", "discretisation.displacement=1", "--set", "mesh.parameters.grading=1"];
    every_solver("bridge", &[&linear[..], &["--set", "time.step=0.25"]].concat());
}

#[test]
fn the_disc() {
    every_solver("hertz", &[]);
}

#[test]
fn quadratic_displacements_under_a_rolling_load() {
    let test_directory = example("lshape-rolling");
    let quadratic = ["--set", "discretisation.displacement=2"];
    let few = ["--set", "mesh.size=0.5", "--set", "time.step=0.1"];
    let mut errors = Vec::new();
    for (ranks, solver) in
        [(1, "active-set"), (2, "active-set"), (3, "tao"), (3, "penalty-duality")]
    {
        let out = format!("{solver}-{ranks}");
        let run = ["run", "scene.toml", "--solver", solver, "--out", &out];
        let arguments = [&run[..], &quadratic, &few].concat();
        let said = ProgramOutput::of(&mut on_ranks(&test_directory, ranks, &arguments));
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{out}: {said:?}");
        same_history(&test_directory, &out, "active-set-1");
        let summary = test_directory.summary(&out);
        let error = |name: &str| summary["errors"][name].as_f64().expect("a number");
        errors.push([error("displacement_mesh"), error("damage_steps")]);
    }
    contact_travels(&test_directory, "active-set-1");
    // The estimated errors know the undivided body, too.
    for of_ranks in &errors {
        for (error, expected) in of_ranks.iter().zip(errors[0]) {
            assert!((error / expected - 1.0).abs() < 1e-6, "{errors:?}");
        }
    }
}

#[test]
fn a_body_that_may_slide_and_turn_is_the_same_on_all_ranks() {
    let test_directory = TestDirectory::new();
    let scene = |load: &str| {
        format!(
            "mesh.file = 'square.msh'
             material = {{ young = 100, poisson = 0.3, plane = 'stress' }}
             time = {{ end = 1, step = 0.5 }}
             boundary = [
                {{ name = 'bottom', gap = '0.01*x' }}, {{ name = 'top', traction = [{load}, '-2*t'] }},
                {{ name = 'right', traction = ['t', 0] }}, {{ name = 'left', traction = ['-t', 0] }},
             ]"
        )
    };
    test_directory.write("scene.toml", &scene("0"));
    for solver in ["active-set", "penalty-duality", "tao"] {
        for ranks in 1..=2 {
            let out = format!("{solver}-{ranks}");
            let arguments = ["run", "scene.toml", "--solver", solver, "--out", &out];
            let said = ProgramOutput::of(&mut on_ranks(&test_directory, ranks, &arguments));
            assert_eq!(said.code, Some(0), "{out}: {said:?}");
            if out != "active-set-1" {
                same_history(&test_directory, &out, "active-set-1");
            }
        }
    }
    test_directory.write("scene.toml", &scene("'t'"));
    let said = ProgramOutput::of(&mut on_ranks(&test_directory, 2, &["run", "scene.toml"]));
    one_message(&said, 2, "against the horizontal translation");
}

/// Two squares that meet in the node (1, 1).
const HINGED: &str = r#"
Point(1) = {0, 0, 0, 0.5}; Point(2) = {1, 0, 0, 0.5};
Point(3) = {1, 1, 0, 0.5}; Point(4) = {0, 1, 0, 0.5};
Point(5) = {2, 1, 0, 0.5}; Point(6) = {2, 2, 0, 0.5}; Point(7) = {1, 2, 0, 0.5};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Line(5) = {3, 5}; Line(6) = {5, 6}; Line(7) = {6, 7}; Line(8) = {7, 3};
Curve Loop(1) = {1:4}; Curve Loop(2) = {5:8}; Plane Surface(1) = {1}; Plane Surface(2) = {2};
Physical Surface("body") = {1, 2}; Physical Curve("bottom") = {1}; Physical Curve("left") = {4};
Physical Curve("top") = {7};
"#;

#[test]
fn several_bodies_are_refused_on_any_number_of_ranks() {
    let test_directory = TestDirectory::new();
    test_directory.write("hinged.geo", HINGED);
    let scene = test_directory.read("scene.toml").replace("square.msh", "hinged.geo");
    test_directory.write("scene.toml", &scene);
    for ranks in 1..=3 {
        let said = ProgramOutput::of(&mut on_ranks(&test_directory, ranks, &["run", "scene.toml"]));
        one_message(
            &said,
            2,
            "hinged.msh: parts of the mesh meet in a single node only, at (1, 1)",
        );
    }
}

#[test]
fn two_step_differences_are_the_same_on_all_ranks() {
    let test_directory = TestDirectory::new();
    let chosen = ["--set", "time.step=\"auto\"", "--set", "time.tolerance=1e-3"];
    let uniform = ["--set", "time.scheme=\"bdf2\""];
    for steps in [&chosen[..], &uniform] {
        test_directory.run(&[steps, &["--out", "one"]].concat());
        let arguments = [&["run", "scene.toml", "--out", "three"], steps].concat();
        assert_eq!(ProgramOutput::of(&mut on_ranks(&test_directory, 3, &arguments)).code, Some(0));
        same_history(&test_directory, "three", "one");
    }
}

#[test]
fn the_first_rank_makes_the_mesh_for_all() {
    let test_directory = example("square-mild");
    let arguments = ["run", "scene.toml", "--set", "mesh.size=0.25", "--set", "time.step=0.5"];
    let said = ProgramOutput::of(&mut on_ranks(&test_directory, 3, &arguments));
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(said.out.contains("25 nodes, 32 triangles, on 3 ranks"), "{}", said.out);
}

/// mpiexec forwards SIGUSR1 and SIGUSR2 to its ranks (mpiexec(1), "Signal Propagation").
#[test]
fn signals_end_ranks_with_their_state_and_a_restart_goes_on() {
    let test_directory = TestDirectory::new();
    let endless = ["run", "scene.toml", "--set", "time.step=1e-6"];
    for (name, meant, code, restart) in
        [("USR1", "SIGINT", 130, &[][..]), ("USR2", "SIGTERM", 143, &["--restart"])]
    {
        let said = File::create(test_directory.path("said")).expect("a file");
        let mut run = on_ranks(&test_directory, 2, &[&endless, restart].concat());
        let mut run = run.stdout(said).stderr(Stdio::null()).spawn().expect("mpiexec starts");
        let started = Instant::now();
        while !test_directory.read("said").contains("time  ")
            || !test_directory.path("out/scene/fields.pvd").exists()
        {
            assert!(started.elapsed() < Duration::from_secs(60), "no frame appears");
            sleep(Duration::from_millis(5));
        }
        let kill = Command::new("kill").args(["-s", name, &run.id().to_string()]).status();
        assert!(kill.expect("kill").success());
        assert_eq!(run.wait().expect("it ends").code(), Some(code));
        let error = test_directory.summary("out/scene")["error"].to_string();
        assert!(error.contains(meant), "{error}");
        let names = test_directory.names("out/scene");
        assert!(names.iter().any(|file| file.starts_with("checkpoint_")), "{names:?}");
    }
    assert!(test_directory.read("said").contains("restart       from step"));
}

/// Open MPI ends all ranks if one dies.
#[test]
fn a_rank_that_is_killed_ends_the_others_and_leaves_a_restart() {
    let directory = TestDirectory::new();
    let long = ["run", "scene.toml", "--set", "time.step=1e-3", "--set", "output.checkpoint=0.1"];
    let mut run = on_ranks(&directory, 2, &long);
    let mut run = run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("mpiexec starts");
    let has_checkpoint = || {
        directory.path("out/scene").exists()
            && directory.names("out/scene").iter().any(|file| file.starts_with("checkpoint_"))
    };
    let started = Instant::now();
    while !has_checkpoint() {
        assert!(started.elapsed() < Duration::from_secs(60), "no checkpoint appears");
        sleep(Duration::from_millis(5));
    }
    let ranks = Command::new("pgrep").args(["-P", &run.id().to_string()]).output().expect("pgrep");
    let ranks = String::from_utf8_lossy(&ranks.stdout).into_owned();
    let last = ranks.lines().last().expect("a rank");
    assert!(Command::new("kill").args(["-s", "KILL", last]).status().expect("kill").success());
    let killed = Instant::now();
    assert!(!run.wait().expect("it ends").success());
    assert!(killed.elapsed() < Duration::from_secs(20), "the other rank lives on");
    let restart = [&long[..], &["--restart"]].concat();
    let said = ProgramOutput::of(&mut on_ranks(&directory, 2, &restart));
    assert!(said.code == Some(0) && said.out.contains("restart       from step"), "{said:?}");
    assert_eq!(directory.summary("out/scene")["steps"], 1000);
}

/// One message, whatever `mpiexec` adds of its own.
#[track_caller]
fn one_message(said: &ProgramOutput, code: i32, fragment: &str) {
    assert_eq!(said.code, Some(code), "{said:?}");
    let told: Vec<&str> = said.err.lines().filter(|line| line.starts_with("error: ")).collect();
    assert!(told.len() == 1 && told[0].contains(fragment), "{said:?}");
}

#[test]
fn bad_input_is_told_once() {
    let test_directory = TestDirectory::new();
    let run = |arguments: &[&str]| {
        let arguments = [&["run", "scene.toml"], arguments].concat();
        ProgramOutput::of(&mut on_ranks(&test_directory, 2, &arguments))
    };
    one_message(&run(&["--set", "material.young=-1"]), 2, "material.young");
    one_message(&run(&["--solver", "magic"]), 2, "magic");
    one_message(&run(&["--mesh", "none.msh"]), 2, "none.msh");
    assert!(!test_directory.path("out").exists(), "nothing is written");
}

#[test]
fn a_solver_that_fails_is_told_once_and_the_state_before_is_saved() {
    let test_directory = TestDirectory::new();
    let arguments = [
        "run",
        "scene.toml",
        "--set",
        "contact.tolerance=1e-30",
        "--set",
        "boundary.top.traction=[0, '-max(0, t - 0.2)']",
    ];
    let said = ProgramOutput::of(&mut on_ranks(&test_directory, 2, &arguments));
    one_message(&said, 1, "the tolerance 1.0e-30 is missed by");
    assert_eq!(test_directory.summary("out/scene")["end_time"], 0.2);
    assert_eq!(test_directory.frames("out/scene").pop().expect("frames").0, 0.2);
}

#[test]
fn what_fails_on_one_rank_ends_all_with_its_message() {
    let test_directory = TestDirectory::new();
    // While it reads, while it writes, and before it solves.
    let said = unlike(&test_directory, &[], &["--set", "material.young=-1"]);
    one_message(&said, 2, "material.young");
    std::fs::create_dir_all(test_directory.path("full/fields_0000_1.vtu")).unwrap();
    let said = unlike(&test_directory, &[], &["--out", "full"]);
    one_message(&said, 1, "cannot write full/fields_0000_1.vtu");
    let said = unlike(&test_directory, &[], &["--", "-elastic_pc_type", "none_such"]);
    one_message(&said, 2, "none_such");
}

#[test]
fn every_kind_of_factor_gives_the_same_answer() {
    let test_directory = example("square-mild");
    let few = ["--set", "mesh.size=0.0625", "--set", "time.step=0.25"];
    test_directory.run(&[&few[..], &["--out", "one"]].concat());
    for kind in ["cholesky", "gamg", "jacobi"] {
        let options = ["--", "-elastic_pc_type", kind, "-damage_pc_type", kind];
        let arguments = [&["run", "scene.toml", "--out", kind], &few[..], &options].concat();
        let said = ProgramOutput::of(&mut on_ranks(&test_directory, 3, &arguments));
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
        assert!(!said.out.contains("in its place"), "another solver answered: {said:?}");
        same_history(&test_directory, kind, "one");
    }
}

#[test]
fn other_commands_refuse_ranks() {
    let test_directory = TestDirectory::new();
    let said = ProgramOutput::of(&mut on_ranks(&test_directory, 2, &["compare", "scene.toml"]));
    one_message(&said, 2, "without mpiexec");
}

#[test]
fn on_one_rank_every_reduction_is_the_value_itself() {
    let comm = Communicator::serial();
    assert_eq!((comm.total(0.1), comm.max(0.2), comm.min(0.3)), (0.1, 0.2, 0.3));
    assert_eq!((comm.min_with_rank(-1.0), comm.broadcast(0, 5.0)), ((-1.0, 0), 5.0));
    assert_eq!((comm.any(true), comm.all(false), comm.count(7)), (true, false, 7));
    assert_eq!(comm.gather(&[1.0, 2.0]), [1.0, 2.0]);
}

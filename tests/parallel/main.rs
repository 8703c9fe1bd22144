//! The program on several ranks, from outside: the same answers, whole results, one voice.

mod vtu_pieces;
mod repeat;

#[path = "../cli/test_directory.rs"]
#[allow(dead_code, reason = "the command line's tests use the rest of it")]
mod test_directory;

use signorini::{
    contact::SOLVERS,
    petsc::{Communicator, Session},
};
use std::{env, fs, path::Path, process::Command, thread::available_parallelism};
use test_directory::{ProgramOutput, TestDirectory, sets, signal, square, start, wait_until};

/// Answers on several ranks may differ by this, relative to the largest value of a run.
const SAME: f64 = 1e-8;

/// The program on `ranks` ranks, on a machine that may have fewer cores.
pub fn on_ranks(test_directory: &TestDirectory, ranks: usize, arguments: &[&str]) -> Command {
    launched(test_directory, ranks, env!("CARGO_BIN_EXE_signorini"), arguments)
}

/// A program on `ranks` ranks.
fn launched(
    test_directory: &TestDirectory,
    ranks: usize,
    program: &str,
    arguments: &[&str],
) -> Command {
    let ranks = ranks.to_string();
    let arguments = [&["-n", &ranks, "--oversubscribe", program], arguments].concat();
    in_directory(test_directory, "mpiexec", &arguments)
}

/// A program whose ranks exchange their messages through memory: Open MPI complains about some networks.
fn in_directory(test_directory: &TestDirectory, program: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(program);
    command
        .args(arguments)
        .current_dir(test_directory.path(""))
        .envs([("OMPI_ALLOW_RUN_AS_ROOT", "1"), ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")])
        .env("OMPI_MCA_btl", "^tcp")
        // Ranks that wait leave the processor to those that work.
        .env("OMPI_MCA_mpi_yield_when_idle", "1")
        .env("LC_ALL", "C");
    command
}

/// A run of `scene.toml` on several ranks.
pub fn run_on_ranks(directory: &TestDirectory, ranks: usize, arguments: &[&str]) -> ProgramOutput {
    let arguments = [&["run", "scene.toml"], arguments].concat();
    ProgramOutput::of(&mut on_ranks(directory, ranks, &arguments))
}

/// The program on two ranks with arguments of their own. A shell chooses them: `mpiexec a : b` of Open MPI 5.0.7
/// crashes.
fn unlike(test_directory: &TestDirectory, first: &[&str], second: &[&str]) -> ProgramOutput {
    let [first, second] = [first, second].map(|arguments| {
        let program = [env!("CARGO_BIN_EXE_signorini"), "run", "scene.toml"];
        [&program, arguments].concat().iter().map(|word| format!(" '{word}'")).collect::<String>()
    });
    let choice = format!("case $OMPI_COMM_WORLD_RANK in 0) exec{first} ;; *) exec{second} ;; esac");
    ProgramOutput::of(&mut launched(test_directory, 2, "sh", &["-c", &choice]))
}

/// A test_directory with a scene of `geo/` called `scene.toml` and its geometry.
pub fn example(name: &str) -> TestDirectory {
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
    let time = names.iter().position(|name| name == "time").expect("a time");
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
            assert!(off <= SAME, "{folder}: {name} at t = {} is off by {off:.1e}", row[time]);
        }
    }
}

/// A scene of `geo/` with these keys: the histories of a run on several ranks and of one on a single rank are the same.
/// The first rank makes the mesh for all.
fn same_on_ranks(name: &str, solver: &str, ranks: usize, keys: &[&str]) -> TestDirectory {
    same_on_ranks_with(&[], name, solver, ranks, keys)
}

/// The same with more arguments.
#[track_caller]
fn same_on_ranks_with(
    more: &[&str],
    name: &str,
    solver: &str,
    ranks: usize,
    keys: &[&str],
) -> TestDirectory {
    let directory = example(name);
    let keys = [keys, &["contact.rescue=false"]].concat();
    let arguments = [more, &["--solver", solver], &sets(&keys)].concat();
    let said = run_on_ranks(&directory, ranks, &[&arguments[..], &["--out", "many"]].concat());
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
    assert!(said.out.contains(&format!(" triangles, on {ranks} ranks")), "{}", said.out);
    directory.run(&[&arguments[..], &["--out", "one"]].concat());
    same_history(&directory, "many", "one");
    directory
}

/// Checks that the number of active nodes changes from step to step.
#[track_caller]
fn contact_travels(directory: &TestDirectory) {
    let active = directory.column("many", "active_nodes");
    let changes = active.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!(changes >= 5, "the contact set changes in {changes} steps only");
}

#[test]
fn the_square_that_stops() {
    // The printed scene reaches ζ_* in the first steps.
    same_on_ranks("square", "active-set", 2, &["mesh.size=0.125", "time.step=0.02"]);
}

#[test]
fn the_mild_square_in_two_step_differences() {
    let keys = ["mesh.size=0.125", "time.step=0.25", "time.scheme='bdf2'"];
    same_on_ranks("square-mild", "penalty-duality", 4, &keys);
}

/// Diffusion so strong that the mass is lost in the rounding of M + kκL: no damage may be lost with it.
#[test]
fn the_mild_square_with_uniform_damage() {
    let keys = ["mesh.size=0.125", "time.step=0.25", "damage.diffusion=1e13"];
    same_on_ranks("square-mild", "active-set", 2, &keys);
}

#[test]
fn the_lshape_in_steps_that_are_chosen() {
    let keys = ["mesh.size=0.5", "mesh.parameters.grading=8", "time.step='auto'"];
    same_on_ranks("lshape", "tao", 3, &keys);
}

/// Contact unknowns are eliminated last: without damage the factor of the first step is kept for every set
/// of active nodes.
#[test]
fn a_rolling_load_without_damage_takes_one_factorisation() {
    let sound = ["damage.lambda_d=0", "damage.lambda_u=0", "mesh.size=0.25", "time.step=0.05"];
    let directory = same_on_ranks("lshape-rolling", "active-set", 3, &sound);
    contact_travels(&directory);
    for folder in ["one", "many"] {
        assert_eq!(directory.column(folder, "factorisations").iter().sum::<f64>(), 1.0, "{folder}");
    }
}

#[test]
fn the_beam_under_a_wave() {
    contact_travels(&same_on_ranks(
        "beam",
        "active-set",
        4,
        &["mesh.size=0.25", "time.step=0.125"],
    ));
}

#[test]
fn the_half_bridge_by_every_solver() {
    let keys = ["mesh.size=0.5", "mesh.parameters.grading=8", "time.step=0.25"];
    for (solver, ranks) in SOLVERS.into_iter().flat_map(|solver| [2, 3, 4].map(|n| (solver, n))) {
        same_on_ranks("bridge-half", solver, ranks, &keys);
    }
}

#[test]
fn the_bridge_that_may_slide() {
    let keys = ["discretisation.displacement=1", "mesh.parameters.grading=1", "time.step=0.25"];
    same_on_ranks("bridge", "penalty-duality", 2, &keys);
}

#[test]
fn the_disc() {
    same_on_ranks("hertz", "tao", 4, &["mesh.size=0.008"]);
}

#[test]
fn quadratic_displacements_under_a_rolling_load() {
    let keys = ["discretisation.displacement=2", "mesh.size=0.5", "time.step=0.1"];
    let directory = same_on_ranks_with(&["--bound"], "lshape-rolling", "tao", 2, &keys);
    contact_travels(&directory);
    // The estimated errors know the undivided body, too.
    for name in ["displacement_mesh", "damage_steps"] {
        let error = |out| directory.summary(out)["errors"][name].as_f64().expect("a number");
        let (many, one) = (error("many"), error("one"));
        assert!((many / one - 1.0).abs() < 1e-6, "{name}: {many} is not {one}");
    }
    // The ranks improve the tractions in another order, which gives nearly the same bound.
    let bound = |out| directory.summary(out)["errors"]["displacement_bound"].as_f64().unwrap();
    let (many, one) = (bound("many"), bound("one"));
    assert!((0.9..1.1).contains(&(many / one)), "{many} is far from {one}");
}

#[test]
fn a_body_that_may_slide_and_turn() {
    let directory = TestDirectory::new();
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
    directory.write("scene.toml", &scene("0"));
    let said = run_on_ranks(&directory, 2, &["--out", "many"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    directory.run(&["--out", "one"]);
    same_history(&directory, "many", "one");
    directory.write("scene.toml", &scene("'t'"));
    one_message(&run_on_ranks(&directory, 2, &[]), 2, "against the horizontal translation");
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

/// mpiexec forwards SIGUSR1 and SIGUSR2 to its ranks (mpiexec(1), "Signal Propagation") and ends all ranks if one dies.
#[test]
fn signals_and_a_killed_rank_end_all_ranks_and_a_restart_goes_on() {
    let directory = TestDirectory::new();
    let long = ["--set", "time.step=1e-3", "--set", "output.checkpoint=1e-9"];
    let endings =
        [("USR1", Some(130), "SIGINT"), ("USR2", Some(143), "SIGTERM"), ("KILL", None, "")];
    let mut step = 0;
    for (name, code, meant) in endings {
        let arguments = [&["run", "scene.toml"], &long[..], &["--restart"]].concat();
        let mut run = start(&mut on_ranks(&directory, 2, &arguments));
        wait_until(&mut run, "a checkpoint", || directory.has_checkpoint("out/scene", step + 1));
        let ranks = Command::new("pgrep").args(["-P", &run.id().to_string()]).output();
        let ranks = String::from_utf8_lossy(&ranks.expect("pgrep").stdout).into_owned();
        let last = ranks.lines().last().and_then(|rank| rank.parse().ok()).expect("a rank");
        signal(if name == "KILL" { last } else { run.id() }, name);
        let status = run.wait().expect("no rank lives on");
        assert!(!status.success() && (code.is_none() || status.code() == code), "{name}: {status}");
        if code.is_some() {
            let summary = directory.summary("out/scene");
            assert!(summary["error"].to_string().contains(meant), "{summary}");
            step = summary["steps"].as_u64().expect("a number") as usize;
            assert!(directory.has_checkpoint("out/scene", step), "{name}: of the last step");
        }
    }
    let said = run_on_ranks(&directory, 2, &[&long[..], &["--restart"]].concat());
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
fn a_bad_mesh_is_told_once() {
    let directory = TestDirectory::new();
    directory.write("hinged.geo", HINGED);
    let said = run_on_ranks(&directory, 2, &["--mesh", "hinged.geo"]);
    one_message(&said, 2, "pieces without common edges");
    assert!(!directory.path("out").exists(), "nothing is written");
}

#[test]
fn a_solver_that_fails_is_told_once_and_the_state_before_is_saved() {
    let directory = TestDirectory::new();
    let load = "boundary.top.traction=[0, '-max(0, t - 0.2)']";
    let said = run_on_ranks(&directory, 2, &sets(&["contact.tolerance=1e-30", load]));
    one_message(&said, 1, "the tolerance 1.0e-30 is missed by");
    assert_eq!(directory.summary("out/scene")["end_time"], 0.2);
    assert_eq!(directory.frames("out/scene").pop().expect("frames").0, 0.2);
}

#[test]
fn what_fails_on_one_rank_ends_all_with_its_message() {
    let directory = TestDirectory::new();
    // While it reads, while it writes, and before it solves.
    let said = unlike(&directory, &[], &["--set", "material.young=-1"]);
    one_message(&said, 2, "material.young");
    fs::create_dir_all(directory.path("full/fields_0000_1.vtu")).unwrap();
    let said = unlike(&directory, &[], &["--out", "full"]);
    one_message(&said, 1, "cannot write full/fields_0000_1.vtu");
    let said = unlike(&directory, &[], &["--", "-elastic_pc_type", "none_such"]);
    one_message(&said, 2, "none_such");
}

#[test]
fn every_kind_of_factor_gives_the_same_answer() {
    let directory = example("square-mild");
    let few = sets(&["mesh.size=0.125", "time.step=0.25"]);
    directory.run(&[&few[..], &["--out", "one"]].concat());
    for kind in ["cholesky", "gamg", "jacobi"] {
        let options = ["--out", kind, "--", "-elastic_pc_type", kind, "-damage_pc_type", kind];
        let said = run_on_ranks(&directory, 3, &[&few[..], &options].concat());
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
        assert!(!said.out.contains("in its place"), "another solver answered: {said:?}");
        same_history(&directory, kind, "one");
    }
}

#[test]
fn a_run_starts_itself_on_several_ranks() {
    let directory = TestDirectory::new();
    let itself = |more: &[&str]| {
        let arguments = [&["run", "scene.toml"], more].concat();
        in_directory(&directory, env!("CARGO_BIN_EXE_signorini"), &arguments)
    };
    if available_parallelism().is_ok_and(|cores| cores.get() > 1) {
        let said = ProgramOutput::of(&mut itself(&["--ranks=2", "--out", "itself"]));
        assert!(said.code == Some(0) && said.out.contains("on 2 ranks"), "{said:?}");
        assert_eq!(run_on_ranks(&directory, 2, &["--out", "mpiexec"]).code, Some(0));
        assert!(directory.results("itself") == directory.results("mpiexec"));
        one_message(&ProgramOutput::of(itself(&["--ranks", "2"]).env("PATH", "")), 2, "mpiexec");
    }
    // The mesh is small.
    let said = ProgramOutput::of(&mut itself(&["--ranks", "auto"]));
    assert!(said.code == Some(0) && !said.out.contains("ranks"), "{said:?}");
    for (ranks, fragment) in [("0", "from 1 on"), ("many", "auto"), ("4096", "cores")] {
        one_message(&ProgramOutput::of(&mut itself(&["--ranks", ranks])), 2, fragment);
    }
    one_message(&run_on_ranks(&directory, 2, &["--ranks", "2"]), 2, "leave --ranks out");
}

#[test]
fn other_commands_refuse_ranks() {
    let directory = TestDirectory::new();
    let mut command = on_ranks(&directory, 2, &["compare", "scene.toml"]);
    one_message(&ProgramOutput::of(&mut command), 2, "without mpiexec");
}

#[test]
fn on_one_rank_every_reduction_is_the_value_itself() {
    let comm = Communicator::serial();
    assert_eq!((comm.total(0.1), comm.max(0.2), comm.min(0.3)), (0.1, 0.2, 0.3));
    assert_eq!((comm.min_with_rank(-1.0), comm.broadcast(0, 5.0)), ((-1.0, 0), 5.0));
    assert_eq!((comm.any(true), comm.all(false), comm.count(7)), (true, false, 7));
    assert_eq!(comm.gather(&[1.0, 2.0]), [1.0, 2.0]);
}

/// More ranks than nodes: some have neither nodes nor triangles.
#[test]
fn a_rank_without_triangles_changes_nothing() {
    let cases = [
        ("discretisation.displacement=1", None),
        ("discretisation.displacement=2", Some("--bars")),
        ("contact.solver='tao'", None),
        ("contact.solver='penalty-duality'", Some("--bound")),
    ];
    for (setting, option) in cases {
        let directory = TestDirectory::new();
        directory.write("square.msh", &square(1));
        let arguments = [sets(&["time.step=0.5", setting]), Vec::from_iter(option)].concat();
        directory.run(&[&arguments[..], &["--out", "one"]].concat());
        let said = run_on_ranks(&directory, 6, &[&arguments[..], &["--out", "six"]].concat());
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
        same_history(&directory, "six", "one");
    }
}

/// A NaN on one rank is the extreme on all ranks, and its rank is known.
#[test]
fn a_number_that_is_none_stays_none_on_all_ranks() {
    if env::var_os("OMPI_COMM_WORLD_SIZE").is_none() {
        let (directory, own) = (TestDirectory::new(), env::current_exe().unwrap());
        let name = "a_number_that_is_none_stays_none_on_all_ranks";
        let program = own.to_string_lossy().into_owned();
        let mut command = launched(&directory, 3, &program, &["--color", "never", "--exact", name]);
        let said = ProgramOutput::of(&mut command);
        assert_eq!(said.code, Some(0), "{said:?}");
        assert_eq!(said.out.matches("1 passed").count(), 3, "each rank has run it: {said:?}");
        return;
    }
    let session = Session::start(&[]).unwrap();
    let (comm, own) = (session.comm(), session.comm().rank() as f64);
    assert_eq!((comm.size(), comm.max(own), comm.min(own)), (3, 2.0, 0.0));
    for nan in [f64::NAN, -f64::NAN] {
        let value = if own == 1.0 { nan } else { own };
        let (extremes, (least, rank)) =
            ([comm.max(value), comm.min(value)], comm.min_with_rank(value));
        assert!(extremes.iter().all(|of| of.is_nan()) && least.is_nan() && rank == 1);
        assert!(comm.total(value).is_nan() && comm.broadcast(1, value).is_nan());
    }
    assert_eq!(comm.max(if own == 2.0 { f64::INFINITY } else { own }), f64::INFINITY);
    session.finalize().unwrap();
}

//! Nothing is lost: full disks, closed terminals, two runs in one folder, a gmsh that hangs.

use crate::{
    failing::LATE,
    test_directory::{ProgramOutput, SCENE, TestDirectory, signal, start, wait_until},
};
use std::{
    fs::{self, File, Permissions},
    os::unix::{fs::PermissionsExt, process::ExitStatusExt},
    process::Command,
    thread::sleep,
    time::Duration,
};

/// So many steps that the run lasts until it is ended.
pub const ENDLESS: [&str; 4] = ["run", "scene.toml", "--set", "time.step=1e-6"];

#[test]
fn a_folder_has_one_run_at_a_time() {
    let directory = TestDirectory::new();
    let mut first = start(&mut directory.command(&ENDLESS));
    wait_until(&mut first, "a frame", || directory.path("out/scene/fields.pvd").exists());
    directory.say(&["run", "scene.toml"]).fails(2, &["out/scene: another run writes there"]);
    first.kill().expect("it lives");
    assert_eq!(first.wait().expect("it ends").signal(), Some(9));
    directory.run(&[]);
}

#[test]
fn nobody_listens() {
    let directory = TestDirectory::new();
    for arguments in [&["run", "scene.toml", "--", "-none_such", "1"][..], &["run", "none.toml"]] {
        let full = || File::options().write(true).open("/dev/full").expect("the device");
        let mut command = directory.command(arguments);
        let status = command.stdout(full()).stderr(full()).status().expect("the program starts");
        let expected = if arguments[1] == "none.toml" { 2 } else { 1 };
        assert_eq!(status.code(), Some(expected), "{arguments:?}");
    }
}

#[test]
fn files_may_not_become_larger() {
    let directory = TestDirectory::new();
    let limited = |blocks: usize, out: &str| {
        let program = env!("CARGO_BIN_EXE_signorini");
        let script = format!("ulimit -f {blocks}; exec {program} run scene.toml {out}");
        let mut command = Command::new("bash");
        command.args(["-c", &script]).current_dir(directory.path("")).env("LC_ALL", "C");
        ProgramOutput::of(&mut command)
    };
    // A block has 1024 bytes; the mesh fits into three but no frame, and the rows of `history.csv` soon do not.
    limited(3, "--out no_frame").fails(1, &["cannot write no_frame/fields_0000.vtu", "large"]);
    limited(2, "--set output.every=0 --set time.step=0.01 --out no_row")
        .fails(1, &["cannot write no_row/", "large"]);
    for folder in ["no_frame", "no_row"] {
        let names = directory.names(folder);
        assert!(names.iter().all(|name| !name.starts_with('.')), "{names:?}");
        // Whole rows only.
        let text = directory.read(&format!("{folder}/history.csv"));
        assert!(text.ends_with('\n'), "{text}");
        directory.history(folder);
    }
}

#[test]
fn what_a_killed_run_left_unfinished_goes_with_the_next() {
    let directory = TestDirectory::new();
    directory.write("out/scene/.signorini-partial-abc", "half a frame");
    directory.write("out/scene/.partial-x", "of the user");
    directory.run(&["--set", "time.end=0.1"]);
    assert!(!directory.path("out/scene/.signorini-partial-abc").exists());
    assert_eq!(directory.read("out/scene/.partial-x"), "of the user");
}

#[test]
fn many_frames_have_names_that_sort() {
    let directory = TestDirectory::new();
    let many = ["run", "scene.toml", "--set", "time.step=5e-5", "--set", "output.every=1"];
    let failing = ["--set", "boundary.top.traction=[0, '-max(0, t - 2e-4)']"];
    let failing = [&failing[..], &["--set", "contact.tolerance=1e-30"]].concat();
    directory.say(&[&many[..], &failing].concat()).fails(1, &["step 5 (t = 0.00025"]);
    let (_, files): (Vec<_>, Vec<_>) = directory.frames("out/scene").into_iter().unzip();
    assert_eq!(files[..2], ["fields_00000.vtu", "fields_00001.vtu"]);
    assert_eq!(files.len(), 5);
    // As many as before where they are few.
    directory.say(&["run", "scene.toml", "--set", LATE]);
    assert_eq!(directory.frames("out/scene")[0].1, "fields_0000.vtu");
}

#[test]
fn gmsh_hangs() {
    let directory = TestDirectory::new();
    directory.write("bin/gmsh", "#!/bin/sh\n: > \"$0.started\"\nexec sleep 1000\n");
    fs::set_permissions(directory.path("bin/gmsh"), Permissions::from_mode(0o755)).expect("mine");
    directory.write("geo/square.geo", "// empty");
    directory.write("geo/scene.toml", &SCENE.replace("square.msh", "square.geo"));
    let path = format!("{}:/usr/bin:/bin", directory.path("bin").display());
    let mut command = directory.command(&["run", "geo/scene.toml"]);
    command.env("PATH", &path).env("SIGNORINI_GMSH_SECONDS", "0.2");
    let said = ProgramOutput::of(&mut command);
    said.fails(2, &["square.geo: gmsh could not mesh it in 0.2 s", "SIGNORINI_GMSH_SECONDS"]);
    assert_eq!(directory.names("geo"), ["scene.toml", "square.geo"]);

    fs::remove_file(directory.path("bin/gmsh.started")).expect("gmsh was started");
    let mut child = start(directory.command(&["run", "geo/scene.toml"]).env("PATH", &path));
    wait_until(&mut child, "gmsh", || directory.names("bin").len() == 2);
    sleep(Duration::from_millis(50));
    signal(child.id(), "TERM");
    assert_eq!(child.wait().expect("it ends").code(), Some(143));
    assert_eq!(directory.names("geo"), ["scene.toml", "square.geo"]);
}

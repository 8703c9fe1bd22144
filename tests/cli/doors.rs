//! Nothing is let in that the user did not start, and nothing of the user's is lost.

use crate::{
    meshes::GEO,
    test_directory::{ProgramOutput, SCENE, TestDirectory, signal, square, wait_until},
};
use std::{
    collections::BTreeSet,
    fs::{self, File, Permissions},
    io::Write,
    os::unix::fs::{PermissionsExt, symlink},
    process::Stdio,
    thread::sleep,
    time::Duration,
};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
/// Whoever executes a file of a stranger leaves this file behind.
const MARK: &str = "MARK";

/// The names of all modules that a script imports, at any place.
fn imported() -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for path in fs::read_dir(format!("{ROOT}/scripts")).expect("the scripts").flatten() {
        let text = fs::read_to_string(path.path()).unwrap_or_default();
        for line in text.lines().filter(|_| path.path().extension().is_some_and(|e| e == "py")) {
            let words: Vec<&str> = line.split_whitespace().collect();
            let found = match &words[..] {
                ["import", modules @ ..] => modules,
                ["from", module, "import", ..] => &[*module],
                _ => &[],
            };
            let top =
                |name: &&str| name.split('.').next().map(|n| n.trim_end_matches(',').to_owned());
            names.extend(found.iter().filter_map(top));
        }
    }
    names
}

/// A folder whose files are named after everything that a program may look for in the current folder. Each leaves the mark.
fn hostile() -> TestDirectory {
    let directory = TestDirectory::new();
    let mark = directory.path(MARK).display().to_string();
    let module = format!("open({mark:?}, 'a').write(__file__ + '\\n')\n");
    let names = imported();
    assert!(
        ["json", "re", "meshio", "matplotlib", "numpy"].iter().all(|name| names.contains(*name))
    );
    let more = ["sitecustomize", "usercustomize", "encodings", "site", "PIL", "h5py", "stranger"];
    for name in names.iter().map(String::as_str).chain(more) {
        directory.write(&format!("{name}.py"), &module);
        directory.write(&format!("{name}/__init__.py"), &module);
    }
    let program = format!("#!/bin/sh\necho $0 >> {mark}\n");
    for name in ["gmsh", "python3", "sh", "git", "ffmpeg", "target/release/signorini"] {
        directory.write(name, &program);
        fs::set_permissions(directory.path(name), Permissions::from_mode(0o755)).expect("mine");
    }
    directory
        .write("matplotlibrc", "backend: module://stranger\nanimation.ffmpeg_path: ./ffmpeg\n");
    for name in [".petscrc", "petscrc"] {
        directory.write(name, &format!("-log_view ascii:{mark}\n"));
    }
    for name in [".gmshrc", ".gmsh-options", "square.step.opt"] {
        directory.write(name, &format!("SystemCall \"echo {name} >> {mark}\";\n"));
    }
    directory.write("square.geo", GEO);
    directory
}

/// Every subcommand works in such a folder, also without a home, and executes nothing there.
#[test]
fn a_folder_full_of_modules_and_settings_of_strangers() {
    let directory = hostile();
    let mut module = std::process::Command::new("/usr/bin/python3");
    let _ = module.args(["-c", "import json"]).current_dir(directory.path(".")).output();
    if fs::remove_file(directory.path(MARK)).is_err() {
        // Without this Python the modules prove nothing; the rest of the test does.
        eprintln!("/usr/bin/python3 is missing");
    }
    directory.write("by_gmsh.toml", &SCENE.replace("square.msh", "square.geo"));
    let inp = "*NODE\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n*ELEMENT,TYPE=CPS3,ELSET=BODY\n1,1,2,3\n2,1,3,4\n\
               *NSET,NSET=bottom\n1,2\n*NSET,NSET=top\n3,4\n*NSET,NSET=left\n4,1\n";
    directory.write("square.inp", inp);
    directory.write("by_inp.toml", &SCENE.replace("square.msh", "square.inp"));
    let commands: [&[&str]; 18] = [
        &["run", "scene.toml"],
        &["run", "by_gmsh.toml", "--accuracy", "0.3"],
        &["check", "by_inp.toml"],
        &["mesh", "by_gmsh.toml"],
        &["info", "out/scene"],
        &["table", "out/scene"],
        &["plot", "out/scene", "--mesh", "--evolution"],
        &["plot", "out/scene", "--animate", "mp4"],
        &["plot", "out/scene", "--along", "top"],
        &["plot", "out/scene", "--paraview"],
        &["report", "out/scene", "--pdf"],
        &["study", "scene.toml", "--set", "time.end=0.1,0.2", "--plot", "work"],
        &["compare", "scene.toml", "--solvers", "active-set"],
        &["export", "scene.toml", "--out", "matrices"],
        &["keys"],
        &["solvers"],
        &["completions", "bash"],
        &["new", "dam"],
    ];
    for arguments in commands {
        runs_nothing(&directory, arguments, &[("PYTHONPATH", ".")]);
    }
    // Without a home, and without the mesh that was kept.
    for arguments in
        [&["mesh", "by_gmsh.toml"][..], &["check", "by_inp.toml"], &["info", "out/scene"]]
    {
        directory.write("square.geo", &format!("{GEO}// again\n"));
        runs_nothing(&directory, arguments, &[("HOME", "")]);
    }
}

/// A command works and leaves no mark.
#[track_caller]
fn runs_nothing(directory: &TestDirectory, arguments: &[&str], variables: &[(&str, &str)]) {
    let said = ProgramOutput::of(directory.command(arguments).envs(variables.iter().copied()));
    assert!(!directory.path(MARK).exists(), "{arguments:?}: {}", directory.read(MARK));
    let lacks = said.err.contains("apt install");
    assert!(said.code == Some(0) || lacks, "{arguments:?}: {said:?}");
}

/// A file runs as a program of gmsh only if it is called .geo: neither the case of an ending, nor the contents, nor a file
/// beside it decide otherwise.
#[test]
fn a_geometry_that_is_a_script() {
    let directory = TestDirectory::new();
    let mark = directory.path(MARK).display().to_string();
    let script = format!("SystemCall \"touch {mark}\";\n{GEO}");
    let names = [
        "e.step", "e.Step", "e.STEP", "e.stp", "e.Stp", "e.brep", "e.Brep", "e.BREP", "e.iges",
        "e.Iges", "e.igs", "e.IGS", "e.Igs", "e.msh", "e.Msh", "e.inp", "e.unv", "e.vtk", "e.vtu",
        "e.bdf", "e.xdmf", "e.med",
    ];
    for name in names {
        let beginnings = [
            "",
            "$Comments\n$EndComments\n",
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n",
            "$PostFormat\n",
        ];
        // The contents decide about each reader once; the case of an ending about none.
        let is_small = !name.contains(char::is_uppercase);
        for before in beginnings.into_iter().take(if is_small { 4 } else { 1 }) {
            directory.write(name, &format!("{before}{script}"));
            directory.write(&format!("{name}.opt"), &script);
            let said = directory.say(&["check", "scene.toml", "--mesh", name]);
            assert_eq!(said.code, Some(2), "{name}: {said:?}");
            assert!(!directory.path(MARK).exists(), "{name} after {before:?} was executed");
        }
    }
    // The law can fail: a .geo is a program.
    directory.write("e.geo", &script);
    directory.say(&["check", "scene.toml", "--mesh", "e.geo"]);
    assert!(directory.path(MARK).exists());
}

/// Each writer, with the names of files that it writes, on a folder in which a file of the user, or a link to one, has such
/// a name: it refuses by name, and changes nothing.
#[test]
fn files_and_links_of_the_user_stay_under_every_writer() {
    let made = TestDirectory::new();
    made.run(&["--set", "output.checkpoint=0"]);
    made.say(&["export", "scene.toml", "--out", "matrices"]);
    let mut results = made.names("out/scene");
    // One frame is as good as another.
    results.retain(|name| !name.contains("_000") || name.contains("_0000"));
    results.push("checkpoint_3_0".to_owned());
    let writers: [(&[&str], &str, Vec<String>); 5] = [
        (&["run", "scene.toml", "--out", "mine"], "mine", results),
        (&["export", "scene.toml", "--out", "mine"], "mine", made.names("matrices")),
        (
            &[
                "study",
                "scene.toml",
                "--set",
                "time.end=0.1,0.2",
                "--out",
                "mine",
                "--plot",
                "work",
            ],
            "mine",
            names(".locks study.csv curves_work.csv curves_work.png"),
        ),
        (
            &["compare", "scene.toml", "--solvers", "tao", "--out", "mine"],
            "mine",
            names("comparison.csv scene-tao/history.csv scene-tao/scene.toml"),
        ),
        (&["new", "mine/dam"], "mine", names("dam.geo dam.toml")),
    ];
    for (arguments, folder, names) in writers {
        for name in names {
            is_refused(&TestDirectory::new(), arguments, &format!("{folder}/{name}"), true);
        }
    }
}

/// In a folder of results the names of results belong to the program; but it has made no links.
#[test]
fn links_in_a_folder_of_results() {
    let directory = TestDirectory::new();
    directory.run(&["--set", "output.every=5"]);
    if directory.say_python(&["info", "out/scene"]).is_none() {
        return;
    }
    // The first and the last picture: one writer makes all.
    let pictures = "setting.png force-displacement.png";
    let writers: [(&[&str], &str); 8] = [
        (&["plot", "out/scene"], pictures),
        (&["plot", "out/scene", "--animate"], "damage.gif pressure.gif"),
        (
            &["plot", "out/scene", "--along", "top"],
            "curves_along_top_von_mises.csv curves_along_top_von_mises.png",
        ),
        (
            &["plot", "out/scene", "--together"],
            "force-displacement-together.png pressure-together.png",
        ),
        (&["plot", "out/scene", "--figure", "work"], "curves_work.csv curves_work.png"),
        (&["plot", "out/scene", "--paraview"], "open_in_paraview.py"),
        (&["report", "out/scene", "--pdf"], "report.html report.pdf"),
        (&["run", "scene.toml"], "history.csv setting.png scene.toml checkpoint_3_0"),
    ];
    for (arguments, names) in writers {
        for name in names.split_whitespace() {
            let path = format!("out/scene/{name}");
            let kept = fs::read(directory.path(&path));
            is_refused(&directory, arguments, &path, false);
            let _ = fs::remove_file(directory.path(&path));
            kept.into_iter()
                .for_each(|content| fs::write(directory.path(&path), content).expect("mine"));
        }
    }
    for _ in 0..2 {
        let said = directory.say(&["report", "out/scene", "--pdf"]);
        assert_eq!(said.code, Some(0), "its own files are replaced: {said:?}");
    }
    assert!(directory.names("out/scene").iter().all(|name| !name.starts_with('.')));
    // Without the scene of a run the folder is one of the user.
    fs::remove_file(directory.path("out/scene/scene.toml")).expect("mine");
    directory.say(&["report", "out/scene"]).fails(2, &["out/scene/report.html: ", "left it there"]);
}

/// A link in the place of a folder of outputs is not followed: the folder there may be that of another run.
#[test]
fn links_in_the_place_of_folders() {
    let directory = TestDirectory::new();
    directory.run(&["--out", "other"]);
    let before = directory.results("other");
    symlink("other", directory.path("mine")).expect("a link");
    let sets = ["scene.toml", "--set", "time.end=0.5", "--out", "mine"];
    for (command, more) in
        [("run", &[][..]), ("export", &[]), ("study", &[]), ("compare", &["--solvers", "tao"])]
    {
        let said = directory.say(&[&[command], &sets[..], more].concat());
        if !said.err.contains("apt install python3-matplotlib") {
            said.fails(2, &["mine: ", "a link is there"]);
        }
        assert_eq!(directory.results("other"), before, "{command}");
    }
}

/// A pipe or a device as an input may never end: it is refused by its name.
#[test]
fn pipes_and_devices_as_inputs() {
    let directory = TestDirectory::new();
    directory.run(&[]);
    let pipe = |name: &str| {
        let made = std::process::Command::new("mkfifo").arg(directory.path(name)).status();
        assert!(made.expect("mkfifo").success());
    };
    for name in
        ["pipe.toml", "pipe.msh", "pipe.geo", "pipe.step", "pipe.inp", "pipe.vtu", "pipe.csv"]
    {
        pipe(name);
    }
    let table = "boundary.top.traction=[0, \"table('pipe.csv')\"]";
    let cases: [&[&str]; 9] = [
        &["run", "pipe.toml"],
        &["study", "pipe.toml", "--set", "time.end=0.1"],
        &["check", "/dev/zero"],
        &["check", "scene.toml", "--mesh", "pipe.msh"],
        &["check", "scene.toml", "--mesh", "pipe.geo"],
        &["check", "scene.toml", "--mesh", "pipe.step"],
        &["check", "scene.toml", "--mesh", "pipe.inp"],
        &["check", "scene.toml", "--mesh", "pipe.vtu"],
        &["check", "scene.toml", "--set", table],
    ];
    for arguments in cases {
        let said = directory.say(arguments);
        let is_named = said.err.contains("it is a pipe or a device")
            || said.out.contains("it is a pipe or a device");
        let lacks = said.err.contains("apt install");
        assert!(said.code != Some(0) && (is_named || lacks), "{arguments:?}: {said:?}");
    }
    for name in ["scene.toml", "history.csv", "fields_0000.vtu"] {
        let path = format!("out/scene/{name}");
        fs::remove_file(directory.path(&path)).expect("mine");
        pipe(&path);
        for arguments in [["info", "out/scene"], ["run", "scene.toml"]] {
            let said = directory.say(&arguments);
            let refused = said.code == Some(2) && said.err.contains(&path);
            assert!(refused || said.err.contains("apt install"), "{arguments:?}: {said:?}");
        }
        fs::remove_file(directory.path(&path)).expect("mine");
        directory.run(&["--out", "again"]);
        fs::copy(directory.path(&format!("again/{name}")), directory.path(&path)).expect("mine");
    }
    directory.write("matrices/README.md", "");
    pipe("matrices/export.json");
    let said = directory.say(&["export", "scene.toml", "--out", "matrices"]);
    said.fails(2, &["matrices/export.json: ", "left it there"]);
    // The scene may come from another program.
    let mut command = directory.command(&["check", "/dev/stdin"]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::null()).spawn().expect("it starts");
    let mut input = child.stdin.take().expect("a pipe");
    let scene = SCENE.replace("square.msh", &directory.path("square.msh").display().to_string());
    input.write_all(scene.as_bytes()).expect("it reads");
    drop(input);
    assert!(child.wait().expect("it ends").success());
}

/// A table of the user stays where it is called study.csv, also beside an empty file `.locks`.
#[test]
fn a_table_beside_locks() {
    let directory = TestDirectory::new();
    let arguments = ["study", "scene.toml", "--set", "time.end=0.1,0.2", "--out", "mine"];
    directory.write("mine/.locks", "");
    directory.write("mine/study.csv", "load,status\n1,good\n");
    let said = directory.say(&arguments);
    if said.err.contains("apt install python3-matplotlib") {
        return;
    }
    said.fails(2, &["mine/study.csv: ", "left it there"]);
    assert_eq!(directory.read("mine/study.csv"), "load,status\n1,good\n");
    fs::remove_file(directory.path("mine/study.csv")).expect("mine");
    for _ in 0..2 {
        let said = directory.say(&arguments);
        assert_eq!(said.code, Some(0), "{said:?}");
    }
}

fn names(words: &str) -> Vec<String> {
    words.split_whitespace().map(str::to_owned).collect()
}

/// A command refuses a file of the user at `path`, and links there, and changes nothing.
#[track_caller]
fn is_refused(directory: &TestDirectory, arguments: &[&str], path: &str, with_file: bool) {
    directory.write("precious", "of the user");
    let _ = fs::remove_file(directory.path(path));
    directory.write(&format!("{path}/below"), "");
    let _ = fs::remove_dir_all(directory.path(path));
    let put: [&dyn Fn(); 3] = [
        &|| directory.write(path, "of the user"),
        &|| symlink(directory.path("precious"), directory.path(path)).expect("a link"),
        &|| symlink(directory.path("absent"), directory.path(path)).expect("a link"),
    ];
    for put in &put[if with_file { 0 } else { 1 }..] {
        let _ = fs::remove_file(directory.path(path));
        put();
        let link = fs::read_link(directory.path(path)).ok();
        let said = directory.say(arguments);
        if said.err.contains("apt install python3-matplotlib") {
            return;
        }
        assert_eq!(said.code, Some(2), "{path}: {said:?}");
        assert!(said.err.contains(path), "{path}: {said:?}");
        assert!(said.err.contains("there"), "{path}: {said:?}");
        assert_eq!(fs::read_link(directory.path(path)).ok(), link, "{path}");
        assert_eq!(directory.read("precious"), "of the user", "{path}");
        assert!(!directory.path("absent").exists(), "{path}");
        if link.is_none() {
            assert_eq!(directory.read(path), "of the user");
        }
    }
}

/// What cannot be printed is an error of every command that prints.
#[test]
fn a_full_device_as_standard_output() {
    let directory = TestDirectory::new();
    directory.run(&[]);
    let commands: [&[&str]; 20] = [
        &["run", "scene.toml"],
        &["check", "scene.toml"],
        &["mesh", "scene.toml"],
        &["export", "scene.toml", "--out", "matrices"],
        &["keys"],
        &["keys", "--schema"],
        &["keys", "--figures"],
        &["solvers"],
        &["completions", "bash"],
        &["new", "dam"],
        &["--help"],
        &["run", "--help"],
        &["--version"],
        &["info", "out/scene"],
        &["table", "out/scene"],
        &["plot", "out/scene", "--only", "pressure"],
        &["report", "out/scene"],
        &["study", "scene.toml", "--set", "time.end=0.1,0.2"],
        &["compare", "scene.toml", "--solvers", "tao"],
        &["study", "--help"],
    ];
    for arguments in commands {
        let full = File::create("/dev/full").expect("a device");
        let said = directory.command(arguments).stdout(full).output().expect("the program starts");
        let err = String::from_utf8_lossy(&said.stderr);
        if err.contains("apt install python3-matplotlib") {
            continue;
        }
        assert!(
            said.status.code().is_some_and(|code| [1, 2].contains(&code)),
            "{arguments:?}: {said:?}"
        );
        let sentence = "error: standard output: No space left on device";
        assert!(err.contains(sentence), "{arguments:?}: {err}");
        assert!(!err.contains("Traceback") && !err.contains("Exception"), "{arguments:?}: {err}");
    }
}

/// Does a terminal obey this character, or not show it?
fn is_hidden(c: char) -> bool {
    c.is_control()
        || ('\u{200b}'..='\u{200f}').contains(&c)
        || ('\u{2028}'..='\u{202e}').contains(&c)
}

/// Names, titles and units that are commands for a terminal, a browser or a typesetter are nothing but text everywhere.
#[test]
fn names_that_are_commands() {
    let hostile =
        "a\u{1b}]0;owned\u{7}\u{9b}31m\u{202e}\u{2028}</script><script>alert(1)</script>$\\frac{$";
    let directory = TestDirectory::new();
    let quoted = toml::Value::from(hostile).to_string();
    let mesh = square(4).replace("\"top\"", &format!("\"{hostile}\""));
    directory.write("square.msh", &mesh);
    let scene = SCENE
        .replace("\"top\"", &quoted)
        .replace("\"Pressed square\"", &quoted)
        .replace("[mesh]", &format!("[units]\nlength = {quoted}\ntime = {quoted}\n[mesh]"));
    directory.write("scene.toml", &scene);
    let path = format!("{hostile}.toml").replace('/', "_");
    directory.write(&path, &scene);
    // The helper refuses escape codes in all that is said.
    let said = directory.say(&["run", "scene.toml", "--set", "output.every=5"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(said.out.contains("\\x1b"), "{said:?}");
    let out = format!("out/{}", path.trim_end_matches(".toml"));
    let commands: [&[&str]; 13] = [
        &["check", "scene.toml"],
        &["check", &path],
        &["run", &path],
        &["check", "scene.toml", "--mesh", &path],
        &["check", "scene.toml", hostile],
        &["info", &out],
        &["table", &out, "out/scene", "--columns", "work,\u{1b}[31m"],
        &["table", &out, "out/scene", "--csv"],
        &["plot", &out, "out/scene", "--evolution", "--mesh"],
        &["plot", &out, "--along", hostile],
        &["report", &out, "out/scene", "--pdf", "--author", hostile],
        &["study", &path, "--set", "time.end=0.1"],
        &["compare", &path, "--solvers", "tao"],
    ];
    for arguments in commands {
        let said = directory.say(arguments);
        let has_control = |text: &str| text.chars().any(|c| is_hidden(c) && !"\r\n\t".contains(c));
        assert!(!has_control(&said.out) && !has_control(&said.err), "{arguments:?}: {said:?}");
        assert!(
            !said.err.contains("Traceback") && !said.err.contains("of another version"),
            "{arguments:?}: {said:?}"
        );
        let is_wrong = said.err.contains(": a mesh is") || said.err.contains("unexpected argument");
        let lacks = said.err.contains("apt install") || said.err.contains("no summary has");
        assert!(said.code == Some(0) || is_wrong || lacks, "{arguments:?}: {said:?}");
    }
    // A title is one line, also in edited results.
    let lines = "title = \"\"\"A\nerror: B\"\"\"";
    directory.write("lines.toml", &SCENE.replace("title = \"Pressed square\"", lines));
    directory
        .say(&["run", "lines.toml"])
        .fails(2, &["lines.toml:1: title must be", "in one line, but is \"\"\"\\nA"]);
    directory.run(&["--out", "edited"]);
    let mut summary = directory.summary("edited");
    summary["title"] = "A\n  work 3\\n".into();
    directory.write("edited/summary.json", &summary.to_string());
    if let Some(said) = directory.say_python(&["info", "edited"]) {
        assert!(said.out.contains(r"A\n  work 3\n"), "{said:?}");
    }
    for folder in [&out, "out/scene"] {
        let page = directory.read(&format!("{folder}/report.html"));
        assert!(!page.contains("<script>alert"), "{folder}");
        assert!(page.contains("&lt;script&gt;alert"), "{folder}: the name is there, as text");
        let [begun, ended] = ["<script", "</script>"].map(|tag| page.matches(tag).count());
        assert_eq!(begun, ended, "{folder}: a name ends no script");
    }
}

/// A file of results with one thing changed: every command of Python works, or says a sentence that names the folder.
#[test]
fn results_that_were_edited_or_damaged() {
    let made = TestDirectory::new();
    made.run(&["--set", "output.every=5"]);
    if made.say_python(&["info", "out/scene"]).is_none() {
        return;
    }
    let summary = made.summary("out/scene");
    let values = ["null", "true", "-3", "1e999", "\"text\"", "[]", "[[1]]", "{}", "[null, \"x\"]"];
    let mut cases = Vec::new();
    for key in summary.as_object().expect("an object").keys() {
        // Each value of a table is enough for one of its kind.
        let number = cases.len();
        for value in values.iter().skip(number % 3).step_by(3) {
            let mut other = summary.clone();
            other[key] = serde_json::from_str(value).unwrap_or(serde_json::Value::Null);
            cases.push(("summary.json", other.to_string()));
        }
        let mut without = summary.clone();
        without.as_object_mut().expect("an object").remove(key);
        cases.push(("summary.json", without.to_string()));
    }
    for (n, key) in
        ["value", "bar", "at", "governing", "unit", "label", "singular"].iter().enumerate()
    {
        let mut other = summary.clone();
        other["plot"]["work"][key] = serde_json::from_str(values[n]).unwrap_or_default();
        cases.push(("summary.json", other.to_string()));
    }
    for text in [
        "",
        "{",
        "[]",
        "3",
        "null",
        "{\"steps\": 1}",
        &"[".repeat(100_000),
        "{\"steps\": NaN}",
        "\u{0}",
    ] {
        cases.push(("summary.json", text.to_owned()));
    }
    let texts = [
        "history.csv",
        "contact.csv",
        "fields.pvd",
        "scene.toml",
        "fields_0000.vtu",
        "fields_0002.vtu",
    ];
    for name in texts.into_iter().filter(|name| made.path(&format!("out/scene/{name}")).exists()) {
        let text = made.read(&format!("out/scene/{name}"));
        let lines: Vec<&str> = text.lines().collect();
        cases.push((name, String::new()));
        cases.push((name, text[..text.len() / 2].to_owned()));
        cases.push((name, lines[0].to_owned()));
        cases.push((name, text.replace("0.", "x.")));
        cases.push((name, text.replace("work", "other").replace("zeta", "other")));
        cases.push((name, text.replace("\"3\"", "\"2\"").replace("Float64", "Int8")));
        cases.push((name, format!("{text}{}", lines[lines.len() - 1])));
        cases.push((name, "\u{0}\u{1}\u{2}".to_owned()));
    }
    let mut folders = Vec::new();
    for (number, (name, text)) in cases.iter().enumerate() {
        let folder = format!("out/case{number}");
        for file in made.names("out/scene") {
            made.write(&format!("{folder}/{file}"), "");
            let [from, to] = ["out/scene", &folder].map(|of| made.path(&format!("{of}/{file}")));
            fs::copy(from, to).expect("written");
        }
        made.write(&format!("{folder}/{name}"), text);
        folders.push(folder);
    }
    let all: Vec<&str> = folders.iter().map(String::as_str).collect();
    let columns = ["--columns", "work,work.governing,errors.solver,steps"];
    let drawn = ["--only", "pressure,force-displacement", "--format", "svg"];
    let some: Vec<&str> = all.iter().step_by(5).copied().collect();
    let mut commands =
        vec![[&["table"][..], &all, &columns].concat(), [&["plot"][..], &some, &drawn].concat()];
    // These are slower: a folder of each kind.
    commands.extend(all.iter().skip(1).step_by(7).map(|folder| vec!["info", *folder]));
    commands.push([vec!["report"], all.iter().skip(3).step_by(25).copied().collect()].concat());
    commands.extend(all.iter().skip(2).step_by(11).map(|f| vec!["plot", *f, "--along", "bottom"]));
    for arguments in commands {
        let said = made.say(&arguments);
        let asked = &arguments[..2];
        assert!(
            !said.err.contains("Traceback") && !said.err.contains("Warning"),
            "{asked:?}: {said:?}"
        );
        assert!([Some(0), Some(2)].contains(&said.code), "{asked:?}: {said:?}");
        assert_eq!(said.code == Some(0), said.err.is_empty(), "{asked:?}: {said:?}");
        for line in said.err.lines() {
            let named = line.contains("out/case") || line.contains("no summary has");
            assert!(line.starts_with("error: ") && named, "{asked:?}: {line}");
        }
        // The undamaged files beside them are read.
        if arguments.contains(&"out/case0") {
            assert!(said.err.lines().count() > 8 && !said.out.is_empty(), "{asked:?}: {said:?}");
        }
    }
}

/// Arguments that are no names, numbers or files.
#[test]
fn arguments_of_the_scripts() {
    let directory = TestDirectory::new();
    directory.run(&[]);
    let (long, line) = ("x".repeat(200_000), "a\nb");
    directory.write("long.csv", &format!("label,time.end\n{},1\n", "ä".repeat(200)));
    directory.write("cell.csv", &format!("time.end\n{}\n", "9".repeat(150_000)));
    directory.write("quote.csv", "time.end\n\"1\n");
    directory.write("empty.csv", "");
    let text = format!("{SCENE}# \"{}.csv\"\n", "y".repeat(400));
    directory.write("long.toml", &text);
    directory.write("latin.toml", SCENE);
    fs::write(directory.path("latin.toml"), [SCENE.as_bytes(), b"# \xe4\n"].concat())
        .expect("mine");
    let cases: [&[&str]; 12] = [
        &["table", "out/scene", "--columns", &long[..100_000]],
        &["table", "out/scene", "--columns", line],
        &["table", "out/scene", "--columns", "\"work"],
        &["table", &long[..300]],
        &["info", &long[..300]],
        &["plot", &long[..300]],
        &["plot", "out/scene", "--along", &long[..300]],
        &["study", "scene.toml", "--cases", "long.csv"],
        &["study", "scene.toml", "--cases", "cell.csv"],
        &["study", "scene.toml", "--cases", "quote.csv"],
        &["study", "long.toml", "--set", "time.end=0.1"],
        &["study", "latin.toml", "--set", "time.end=0.1"],
    ];
    for arguments in cases.iter().chain(&[&["study", "scene.toml", "--cases", "empty.csv"][..]]) {
        let said = directory.say(arguments);
        let shown: Vec<&str> = arguments.iter().map(|word| &word[..word.len().min(30)]).collect();
        let err: String = said.err.chars().take(500).collect();
        assert!(
            !err.contains("Traceback") && !err.contains("of another version"),
            "{shown:?}: {err}"
        );
        assert!([Some(0), Some(1), Some(2)].contains(&said.code), "{shown:?}: {err}");
        // A study names the runs that failed in its table.
        let all = err.clone() + &said.out;
        assert!(said.code == Some(0) || all.contains("error"), "{shown:?}: {all}");
    }
}

/// Ctrl-C at any moment of a command of Python ends it without a traceback.
#[test]
fn a_signal_while_python_starts() {
    let directory = TestDirectory::new();
    directory.run(&["--set", "output.every=5"]);
    if directory.say_python(&["info", "out/scene"]).is_none() {
        return;
    }
    for (command, pause) in
        ["info", "report"].iter().flat_map(|c| (0..10).map(move |k| (c, 50 * k)))
    {
        let mut command = directory.command(&[command, "out/scene"]);
        let child =
            command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
        sleep(Duration::from_millis(pause));
        signal(child.id(), "INT");
        let ended = child.wait_with_output().expect("it ends");
        let err = String::from_utf8_lossy(&ended.stderr);
        assert!(err.is_empty(), "after {pause} ms: {err}");
    }
}

/// Processes that draw end with the one that has started them, however that ends.
#[test]
fn a_report_that_is_killed_leaves_no_processes() {
    let directory = TestDirectory::new();
    directory.run(&["--set", "output.every=1"]);
    if directory.say_python(&["info", "out/scene"]).is_none() {
        return;
    }
    // Forked processes have the same arguments.
    let folder = directory.path("out/scene").display().to_string();
    let alive = || {
        let processes = fs::read_dir("/proc").expect("Linux").flatten();
        let lines = processes.filter_map(|of| fs::read(of.path().join("cmdline")).ok());
        lines.filter(|line| String::from_utf8_lossy(line).contains(&folder)).count()
    };
    for name in ["KILL", "TERM"] {
        let mut command = directory.command(&["report", &folder]);
        let mut child =
            command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
        wait_until(&mut child, "processes that draw", || alive() > 1);
        signal(child.id(), name);
        child.wait().expect("it ends");
        while alive() > 0 {
            sleep(Duration::from_millis(20));
        }
    }
}

/// The module says which package it lacks.
#[test]
fn a_table_without_pandas() {
    let directory = TestDirectory::new();
    directory.run(&[]);
    let program = "import sys; sys.modules['pandas'] = sys.modules['scipy.io'] = None\n\
                   from signorini_results import load, table\n\
                   for call in (lambda: table(['out/scene']), lambda: load('out/scene').matrices()):\n\
                   \x20   try: call()\n    except ImportError as error: print(error)";
    let mut command = std::process::Command::new("/usr/bin/python3");
    command.args(["-c", program]).current_dir(directory.path("."));
    let output = command.env("PYTHONPATH", format!("{ROOT}/scripts")).output().expect("Python");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    if String::from_utf8_lossy(&output.stderr).contains("No module named") {
        return;
    }
    assert!(said.contains("needs pandas") && said.contains("needs scipy"), "{output:?}");
}

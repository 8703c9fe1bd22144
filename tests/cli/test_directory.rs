//! A folder with a scene and a mesh, and the program run in it.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread::sleep,
    time::Duration,
};
use tempfile::TempDir;

#[path = "../common/msh.rs"]
mod msh41;

/// A square pressed on its foundation: a scene that takes ten quick steps.
pub const SCENE: &str = include_str!("scene.toml");

/// Entries of `summary.json` that depend on the clock and the machine.
const CLOCK: [&str; 5] =
    ["provenance", "wall_seconds", "peak_megabytes", "seconds_per_step", "phases"];

/// A temporary folder that holds `scene.toml` and `square.msh`.
pub struct TestDirectory(TempDir);

/// What the program said, and its exit code.
#[derive(Debug)]
pub struct ProgramOutput {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl TestDirectory {
    pub fn new() -> Self {
        let test_directory = Self(tempfile::tempdir().expect("a temporary folder"));
        test_directory.write("scene.toml", SCENE);
        test_directory.write("square.msh", &square(4));
        test_directory
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, content: &str) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a folder"))
            .expect("the test_directory is writable");
        fs::write(path, content).expect("the test_directory is writable");
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub fn summary(&self, folder: &str) -> serde_json::Value {
        serde_json::from_str(&self.read(&format!("{folder}/summary.json"))).expect("JSON")
    }

    /// `history.csv`: column names, and the rows as numbers, NaN where a cell is empty.
    pub fn history(&self, folder: &str) -> (Vec<String>, Vec<Vec<f64>>) {
        let text = self.read(&format!("{folder}/history.csv"));
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let names = reader.headers().expect("a header").iter().map(str::to_owned).collect();
        let rows: Vec<Vec<Option<f64>>> =
            reader.deserialize().map(|row| row.expect("numbers")).collect();
        let rows =
            rows.into_iter().map(|r| r.iter().map(|v| v.unwrap_or(f64::NAN)).collect()).collect();
        (names, rows)
    }

    /// A column of `history.csv`.
    #[track_caller]
    pub fn column(&self, folder: &str, name: &str) -> Vec<f64> {
        let (names, rows) = self.history(folder);
        let column = names.iter().position(|other| other == name).expect("the column");
        rows.iter().map(|row| row[column]).collect()
    }

    /// The files of a run's folder by name, without the entries that depend on the clock and the machine.
    pub fn results(&self, folder: &str) -> BTreeMap<String, Vec<u8>> {
        let content = |name: String| {
            let bytes = match &name[..] {
                "summary.json" => {
                    let mut summary = self.summary(folder);
                    let entries = summary.as_object_mut().expect("an object");
                    CLOCK.iter().for_each(|key| assert!(entries.remove(*key).is_some(), "{key}"));
                    summary.to_string().into_bytes()
                }
                "history.csv" => {
                    let (names, mut rows) = self.history(folder);
                    assert_eq!(names.last().map(String::as_str), Some("seconds"));
                    rows.iter_mut().for_each(|row| row.truncate(row.len() - 1));
                    format!("{rows:?}").into_bytes()
                }
                _ => fs::read(self.path(&format!("{folder}/{name}"))).expect("readable"),
            };
            (name, bytes)
        };
        self.names(folder).into_iter().map(content).collect()
    }

    /// True if the folder has a checkpoint of a step from `step` on.
    pub fn has_checkpoint(&self, folder: &str, step: usize) -> bool {
        let steps =
            |name: &String| name.strip_prefix("checkpoint_")?.split('_').next()?.parse().ok();
        self.path(folder).exists()
            && self.names(folder).iter().filter_map(steps).max() >= Some(step)
    }

    /// Times and files in `fields.pvd`.
    pub fn frames(&self, folder: &str) -> Vec<(f64, String)> {
        let text = self.read(&format!("{folder}/fields.pvd"));
        let attribute = |line: &str, name: &str| {
            let rest = line.split(&format!("{name}=\"")).nth(1).expect("the attribute");
            rest.split('"').next().expect("its end").to_owned()
        };
        let sets = text.lines().filter(|line| line.contains("<DataSet"));
        sets.map(|l| (attribute(l, "timestep").parse().expect("a time"), attribute(l, "file")))
            .collect()
    }

    /// The names of the files in a folder, sorted.
    pub fn names(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(folder)).expect("the folder is there");
        let mut names: Vec<String> =
            entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// All files below the test_directory with their content.
    pub fn everything(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        fn add(folder: &Path, all: &mut BTreeMap<PathBuf, Vec<u8>>) {
            for path in fs::read_dir(folder).expect("readable").flatten().map(|e| e.path()) {
                if path.is_dir() {
                    add(&path, all);
                    all.insert(path, Vec::new());
                } else {
                    let content = fs::read(&path).expect("readable");
                    all.insert(path, content);
                }
            }
        }
        let mut all = BTreeMap::new();
        add(self.0.path(), &mut all);
        all
    }

    /// The program with these arguments; no terminal, English messages.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_signorini"));
        command.args(arguments).current_dir(self.0.path()).stdin(Stdio::null()).env("LC_ALL", "C");
        command
    }

    pub fn say(&self, arguments: &[&str]) -> ProgramOutput {
        ProgramOutput::of(&mut self.command(arguments))
    }

    /// The output of a command that draws or reads results by Python; `None` where Python lacks its packages.
    pub fn say_python(&self, arguments: &[&str]) -> Option<ProgramOutput> {
        let said = self.say(arguments);
        (!said.err.contains("apt install python3-matplotlib")).then_some(said)
    }

    /// Runs the scene, which must go well.
    #[track_caller]
    pub fn run(&self, arguments: &[&str]) -> ProgramOutput {
        let said = self.say(&[&["run", "scene.toml"], arguments].concat());
        assert_eq!(said.code, Some(0), "{said:?}");
        said
    }
}

impl ProgramOutput {
    pub fn of(command: &mut Command) -> Self {
        let output = command.output().expect("the program starts");
        let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
        // On a busy machine a run is long enough to tell how far it is.
        let err = text(output.stderr);
        let err = err.split_inclusive('\n').filter(|line| !line.contains(" % after ")).collect();
        // A long fact of the screen goes on in further lines.
        let mut out = text(output.stdout);
        if out.contains("\n  mesh  ") {
            out = out.replace(&format!("\n{}", " ".repeat(18)), " ");
        }
        let said = Self { code: output.status.code(), out, err };
        assert!(!said.err.contains("panicked"), "{}", said.err);
        assert!(!said.out.contains('\x1b') && !said.err.contains('\x1b'), "escape codes: {said:?}");
        said
    }

    /// It failed with `code` and one error on standard error that has all `fragments`.
    #[track_caller]
    pub fn fails(&self, code: i32, fragments: &[&str]) {
        assert_eq!(self.code, Some(code), "{self:?}");
        assert!(self.err.starts_with("error: "), "{self:?}");
        for fragment in fragments {
            assert!(self.err.contains(fragment), "`{fragment}` is not in: {}", self.err);
        }
    }
}

/// Starts a run whose output nobody reads.
pub fn start(command: &mut Command) -> Child {
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program starts")
}

/// Waits for a condition of a run, as long as the run lives: a busy machine may need any time.
#[track_caller]
pub fn wait_until(run: &mut Child, what: &str, is_met: impl Fn() -> bool) {
    while !is_met() {
        let has_ended = run.try_wait().expect("a child").is_some();
        assert!(!has_ended || is_met(), "{what}: the run has ended without it");
        sleep(Duration::from_millis(2));
    }
}

/// Sends a signal (kill(1)).
pub fn signal(process: u32, name: &str) {
    let status = Command::new("kill").args(["-s", name, &process.to_string()]).status();
    assert!(status.expect("kill").success());
}

/// Each key as an argument of `--set`.
pub fn sets<'a>(keys: &[&'a str]) -> Vec<&'a str> {
    keys.iter().flat_map(|key| ["--set", *key]).collect()
}

/// The unit square in n × n cells of two triangles, sides and body named.
pub fn square(n: usize) -> String {
    let node = |i: usize, j: usize| j * (n + 1) + i + 1;
    let mut nodes = Vec::new();
    for (j, i) in (0..=n).flat_map(|j| (0..=n).map(move |i| (j, i))) {
        let (x, y) = (i as f64 / n as f64, j as f64 / n as f64);
        nodes.push(format!("{} {x} {y} 0", node(i, j)));
    }
    let mut elements = Vec::new();
    let mut add = |kind: &str, nodes: String| {
        elements.push(format!("{} {kind} {nodes}", elements.len() + 1));
    };
    for k in 0..n {
        for (group, a, b) in [
            (1, node(k, 0), node(k + 1, 0)),
            (2, node(n, k), node(n, k + 1)),
            (3, node(k, n), node(k + 1, n)),
            (4, node(0, k), node(0, k + 1)),
        ] {
            add(&format!("1 {group}"), format!("{a} {b}"));
        }
    }
    for (j, i) in (0..n).flat_map(|j| (0..n).map(move |i| (j, i))) {
        let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
        add("2 5", format!("{a} {b} {c}"));
        add("2 5", format!("{a} {c} {d}"));
    }
    msh(&nodes, &elements)
}

/// A text file of version 4.1 with these nodes and elements and the names of the square's groups.
pub fn msh(nodes: &[impl AsRef<str>], elements: &[impl AsRef<str>]) -> String {
    let names = ["1 1 \"bottom\"", "1 2 \"right\"", "1 3 \"top\"", "1 4 \"left\"", "2 5 \"body\""];
    msh41::msh(&names, nodes, elements)
}

//! The reference of keys is what the schema says, the program prints both, and editors check scenes by the schema.

use crate::test_directory::TestDirectory;
use std::{
    fs,
    io::{Write, stderr},
    path::Path,
    process::Command,
};

#[test]
fn the_reference_is_made_of_the_schema_and_the_program_prints_both() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |file: &str| fs::read_to_string(root.join(file)).expect("it is there");
    let python = std::env::var("PYTHON").unwrap_or("python3".to_owned());
    let made = Command::new(python)
        .args(["scripts/keys.py", "geo/scene.schema.json", env!("CARGO_BIN_EXE_signorini")])
        .current_dir(root)
        .output()
        .expect("Python");
    let page = read("geo/KEYS.md");
    assert!(String::from_utf8_lossy(&made.stdout) == page, "out of date: make keys");
    let directory = TestDirectory::new();
    assert_eq!(directory.say(&["keys"]).out, page);
    assert_eq!(directory.say(&["keys", "--schema"]).out, read("geo/scene.schema.json"));

    directory.run(&["--set", "time.step=1"]);
    let (columns, _) = directory.history("out/scene");
    // All columns stand in its tables, with general names for their parts.
    let told = page.lines().filter_map(|row| row.strip_prefix("| `")?.split('`').next());
    let told = Vec::from_iter(told.map(|name| name.rsplit('.').next().unwrap()));
    let lacking = columns.iter().filter(|of| !told.contains(&of.rsplit('.').next().unwrap()));
    assert_eq!(lacking.collect::<Vec<_>>(), [""; 0]);
}

/// A text of the scene that `signorini new` writes, and what replaces it: misspelt keys and values.
const MISSPELT: [(&str, &str); 10] = [
    ("title", "tittle"),
    ("[mesh]", "[msh]"),
    ("size", "siez"),
    ("poisson", "poison"),
    ("\"strain\" ", "\"strian\" "),
    ("diffusion", "difusion"),
    ("lambda_u", "lamda_u"),
    ("[[boundary]]", "[[boundaries]]"),
    ("symmetry = true", "symmetry = \"true\""),
    ("traction", "tracton"),
];

/// Validators of other authors find the schema by the first line of a scene. They accept all shipped scenes and the new one; they refuse
/// what the program refuses, and print the names of these.
#[test]
fn editors_accept_all_scenes_and_refuse_misspelt_keys_by_the_schema_beside_them() {
    let directory = TestDirectory::new();
    assert_eq!(directory.say(&["new", "dam"]).code, Some(0));
    let new = directory.read("dam.toml");
    let first = new.lines().next().expect("a line");
    let mut good = vec!["dam.toml".to_owned()];
    for path in
        fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("geo")).expect("geo").flatten()
    {
        let name = path.file_name().into_string().expect("UTF-8");
        if name.ends_with(".toml") {
            let text = fs::read_to_string(path.path()).expect("a scene");
            directory.write(&name, &format!("{first}\n{text}"));
            good.push(name);
        }
    }
    assert!(good.len() >= 10, "{good:?}");
    let mut wrong = Vec::new();
    for (k, (text, misspelt)) in MISSPELT.into_iter().enumerate() {
        let name = format!("wrong{k}.toml");
        assert!(new.contains(text), "{text}");
        directory.write(&name, &new.replace(text, misspelt));
        assert_eq!(directory.say(&["check", &name]).code, Some(2), "{misspelt}");
        wrong.push(name);
    }
    let by_python = "import json, sys, tomllib, jsonschema\nfor name in sys.argv[1:]:\n\
        \x20   with open(name) as file: schema = json.load(open(file.readline().removeprefix('#:schema ').strip()))\n\
        \x20   with open(name, 'rb') as file: scene = tomllib.load(file)\n\
        \x20   if list(jsonschema.validators.validator_for(schema)(schema).iter_errors(scene)): print(name)";
    let python = std::env::var("PYTHON").unwrap_or("/usr/bin/python3".to_owned());
    for (program, arguments) in [(&*python, &["-c", by_python][..]), ("taplo", &["check"])] {
        let mut command = Command::new(program);
        command.args(arguments).args(&good).args(&wrong).current_dir(directory.path("."));
        let printed = command.output().map(|of| [of.stdout, of.stderr].concat());
        let printed = printed.map(|text| String::from_utf8_lossy(&text).into_owned());
        match printed.ok().filter(|text| !text.contains("No module named")) {
            Some(printed) => {
                let refused = good.iter().chain(&wrong).filter(|name| printed.contains(*name));
                assert_eq!(Vec::from_iter(refused), Vec::from_iter(&wrong), "{program}: {printed}");
            }
            // Not by `eprintln`, which cargo shows for failed tests only.
            None => writeln!(stderr(), "skipped: {program} or its jsonschema is missing")
                .expect("stderr"),
        }
    }
}

//! The reference of keys is what the schema says, and the program prints both.

use crate::test_directory::TestDirectory;
use std::{fs, path::Path, process::Command};

const COLUMNS: &str = "| column | meaning |\n|---|---|\n";

#[test]
fn the_reference_is_made_of_the_schema_and_the_program_prints_both() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |file: &str| fs::read_to_string(root.join(file)).expect("it is there");
    let python = std::env::var("PYTHON").unwrap_or("python3".to_owned());
    let made = Command::new(python)
        .args(["scripts/keys.py", "geo/scene.schema.json"])
        .current_dir(root)
        .output()
        .expect("Python");
    let page = read("geo/KEYS.md");
    assert!(
        String::from_utf8_lossy(&made.stdout) == page,
        "out of date: scripts/keys.py geo/scene.schema.json > geo/KEYS.md"
    );
    let directory = TestDirectory::new();
    assert_eq!(directory.say(&["keys"]).out, page);
    assert_eq!(directory.say(&["keys", "--schema"]).out, read("geo/scene.schema.json"));

    directory.run(&["--set", "time.step=1"]);
    let (columns, _) = directory.history("out/scene");
    let told = page.split_once(COLUMNS).expect("a table").1.lines();
    let told: Vec<_> = told.filter_map(|row| row.split('`').nth(1)).collect();
    let [first @ .., "NAME.…", last] = &told[..] else { panic!("{told:?}") };
    let (own, others) = columns.split_at(first.len());
    assert_eq!(own, first);
    let [others @ .., seconds] = others else { panic!("{columns:?}") };
    assert!(others.iter().all(|other| other.contains('.')) && seconds == last, "{columns:?}");
}

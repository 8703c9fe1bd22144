//! The reference of keys is what the schema says, and the program prints both.

use crate::test_directory::TestDirectory;
use std::{fs, path::Path, process::Command};

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

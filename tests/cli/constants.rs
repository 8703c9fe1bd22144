//! Pages about the code are right: the register of tuned constants, the order of the rooms, names of files and functions.

use std::{env, fs, path::Path, process::Command};

#[test]
fn the_register_of_tuned_constants_is_made_of_their_comments_and_each_name_means_one_thing() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = env::var("PYTHON").unwrap_or("python3".to_owned());
    let made = Command::new(python).arg("validation/constants.py").current_dir(root).output();
    let made = made.expect("Python");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let page = fs::read_to_string(root.join("validation/CONSTANTS.md")).expect("it is there");
    assert!(String::from_utf8_lossy(&made.stdout) == page, "out of date: make constants");
    assert!(page.matches("\n| `").count() > 15, "the register is nearly empty");
}

#[test]
fn a_room_uses_only_rooms_before_it_and_the_names_in_pages_about_the_code_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let picture = tempfile::NamedTempFile::with_suffix(".svg").expect("a file");
    let drawn = Command::new(env::var("PYTHON").unwrap_or("/usr/bin/python3".to_owned()))
        .arg("scripts/architecture.py")
        .arg(picture.path())
        .current_dir(root)
        .output()
        .expect("Python");
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
}

//! `signorini new`, and the tutorial and the README as they are typed.

use crate::test_directory::{ProgramOutput, TestDirectory};
use std::{env, fs, path::Path, process::Command};

/// Blocks of the tutorial between fences: the text before it, what stands behind the opening fence, and the content.
fn blocks<'a>(page: &'a str) -> Vec<(&'a str, &'a str, &'a str)> {
    let parts: Vec<&str> = page.split("\n```").collect();
    let (pairs, _) = parts.as_chunks::<2>();
    let block = |&[before, fenced]: &[&'a str; 2]| {
        let (kind, content) = fenced.split_once('\n').expect("a fenced block");
        (before, kind, content)
    };
    pairs.iter().map(block).collect()
}

/// The last file with this ending that a text names in backticks.
fn named<'a>(text: &'a str, ending: &str) -> &'a str {
    text.rsplit('`').skip(1).step_by(2).find(|name| name.ends_with(ending)).expect("a file")
}

/// The words of a text with a blank between them.
fn spaced(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn every_command_of_the_tutorial_does_what_it_says() {
    let (said, commands) = typed("geo/TUTORIAL.md", true);
    assert!(commands >= 9 && said.contains("sum of contact reactions"), "{commands}: {said}");
}

#[test]
fn the_first_commands_of_the_readme_do_what_it_says() {
    assert_eq!(typed("README.md", false).1, 2);
}

/// Types the commands of a page, with its files or without, and checks that they print what the page says. Returns their output
/// and their number.
fn typed(page: &str, writes: bool) -> (String, usize) {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join(page);
    let page = fs::read_to_string(page).expect("a page");
    let test_directory = TestDirectory::new();
    let (mut said, mut commands) = (String::new(), 0);
    for (before, kind, content) in blocks(&page) {
        match kind {
            "geo" | "toml" if writes => test_directory.write(named(before, kind), content),
            "toml" | "rust,no_run" => {}
            "sh" => {
                for line in content.lines().filter(|line| line.starts_with("signorini ")) {
                    // Figures have tests of their own.
                    if line.starts_with("signorini plot") {
                        continue;
                    }
                    let (typed, comment) = line.split_once('#').unwrap_or((line, ""));
                    // Blanks between double quotes do not separate words.
                    let words = typed.split('"').enumerate().flat_map(|(i, part)| match i % 2 {
                        0 => part.split_whitespace().collect(),
                        _ => vec![part],
                    });
                    let words: Vec<&str> = words.skip(1).collect();
                    let output = test_directory.say(&words);
                    let code = if comment.contains("refused") { 2 } else { 0 };
                    assert_eq!(output.code, Some(code), "{line}: {output:?}");
                    said += &(output.out + &output.err);
                    commands += 1;
                }
            }
            // What the program is said to print, up to an ellipsis.
            _ => {
                for line in content.lines() {
                    let line = spaced(line.split(" …").next().expect("a part"));
                    assert!(spaced(&said).contains(&line), "not printed: {line}\nbut: {said}");
                }
            }
        }
    }
    (said, commands)
}

#[test]
fn a_new_scene_overwrites_nothing() {
    let test_directory = TestDirectory::new();
    test_directory.write("wall.toml", "mine");
    test_directory.say(&["new", "wall"]).fails(2, &["wall.toml is there already"]);
    test_directory.say(&["new", "."]).fails(2, &[". is no name"]);
    assert!(!test_directory.path("wall.geo").exists());
    // A name with a folder, a blank and a quote.
    fs::create_dir(test_directory.path("my walls")).expect("a folder");
    let name = "my walls/the \"old\" one";
    assert_eq!(test_directory.say(&["new", name]).code, Some(0));
    let checked = test_directory.say(&["check", &format!("{name}.toml")]);
    assert_eq!((checked.code, checked.err.as_str()), (Some(0), ""), "{checked:?}");
    let unwritable = ProgramOutput::of(&mut test_directory.command(&["new", "nowhere/wall"]));
    unwritable.fails(2, &["cannot write nowhere/", "No such file"]);
}

#[test]
fn every_scene_of_the_gallery_is_a_start_that_passes_check() {
    let test_directory = TestDirectory::new();
    let listed = test_directory.say(&["new", "--list"]);
    let names = listed.out.lines().map(|line| line.split_once(' ').expect("a name and a title"));
    let names = Vec::from_iter(names);
    assert!((12..=16).contains(&names.len()), "{listed:?}");
    for (name, title) in names {
        let [scene, geometry] = ["toml", "geo"].map(|ending| format!("{name}.{ending}"));
        let written = test_directory.say(&["new", "--from", name]);
        assert_eq!((written.code, written.err.as_str()), (Some(0), ""), "{written:?}");
        assert!(test_directory.read(&scene).contains(&format!("\"{geometry}\"")), "{scene}");
        let checked = test_directory.say(&["check", &scene]);
        assert_eq!(checked.code, Some(0), "{checked:?}");
        assert!(checked.out.starts_with(title.trim()) && !title.trim().is_empty(), "{checked:?}");
        test_directory.say(&["new", "--from", name]).fails(2, &["is there already"]);
    }
    // Under a name of the user's own, and an unknown start.
    assert_eq!(test_directory.say(&["new", "my/cook", "--from", "cook"]).code, Some(2));
    assert_eq!(test_directory.say(&["new", "mine", "--from", "cook"]).code, Some(0));
    assert!(test_directory.read("mine.toml").contains("\"mine.geo\""));
    test_directory.say(&["new", "--from", "cok"]).fails(2, &["did you mean `cook`?", "nafems_le1"]);
    test_directory.say(&["new"]).fails(2, &["NAME"]);
}

/// Cheap scenes of the gallery have their published or closed answers within their bars; `make docs` runs all of them.
#[test]
fn answers_of_the_gallery_are_within_their_bars() {
    let test_directory = TestDirectory::new();
    let made = Command::new(env::var("PYTHON").unwrap_or("/usr/bin/python3".to_owned()))
        .args(["scripts/site/gallery.py", "--binary", env!("CARGO_BIN_EXE_signorini"), "--out"])
        .arg(test_directory.path("site"))
        .args(["levy_dam", "damage_stop", "overturn"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("Python");
    let said = String::from_utf8_lossy(&made.stdout);
    assert!(made.status.success(), "{said}{}", String::from_utf8_lossy(&made.stderr));
    for agrees in ["levy_dam", "5 of 5 agree", "damage_stop", "1 of 1 agree", "overturn"] {
        assert!(said.contains(agrees), "{agrees}: {said}");
    }
    let page = test_directory.read("site/gallery/levy_dam.md");
    assert!(
        page.contains("| agrees |") && page.contains("signorini new --from levy_dam"),
        "{page}"
    );
}

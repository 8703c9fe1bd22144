//! The lines of the screen, and `signorini explain`, which notes name.

use crate::test_directory::{SCENE, TestDirectory, sets};
use std::{collections::BTreeSet, fs, path::Path};

/// The text that the program prints, with its line breaks.
fn printed(directory: &TestDirectory, words: &[&str]) -> String {
    let output =
        directory.command(&[&["run", "scene.toml"], words].concat()).output().expect("it starts");
    assert!(output.status.success(), "{words:?}: {output:?}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Closing lines begin with the end and end with the results, the cost and the next step; none is longer than 80 columns.
#[test]
fn closing_lines_have_an_order_and_eighty_columns() {
    let directory = TestDirectory::new();
    let names = SCENE.replace("top", "the_top_of_the_square_that_is_pressed_down");
    directory.write(
        "square.msh",
        &crate::test_directory::square(4)
            .replace("top", "the_top_of_the_square_that_is_pressed_down"),
    );
    directory.write("scene.toml", &names);
    let groups = [
        "end",
        "damage",
        "displacement",
        "work",
        "stress",
        "contact",
        "boundary",
        "errors",
        "residuals",
        "solver",
    ];
    let last = ["note", "results", "cost", "more", "next"];
    for (words, further) in [
        (&[][..], &[][..]),
        (&["--verbose"], &["residuals", "solver"]),
        (&["--bars"], &[]),
        (&["--accuracy", "0.05"], &[]),
        (&["--set", "material.young=10", "-v"], &["residuals", "more", "next"]),
    ] {
        let text = printed(&directory, words);
        let long = text.lines().find(|line| line.chars().count() > 80);
        assert_eq!(long, None, "{words:?}");
        let closing = &text[text.find("\n  end ").expect("an end") + 1..];
        let names =
            closing.lines().filter(|line| !line.starts_with("     ") && line.starts_with("  "));
        let names = Vec::from_iter(names.map(|line| line[2..15].trim_end()));
        let order = Vec::from_iter(groups.iter().chain(&["in the run"]).chain(&last));
        let place = |name: &str| order.iter().position(|known| **known == name);
        let places = Vec::from_iter(
            names.iter().filter(|name| **name != "in the run").map(|name| place(name)),
        );
        assert!(places.is_sorted() && places.iter().all(Option::is_some), "{words:?}: {names:?}");
        for name in ["residuals", "solver", "more"] {
            let is_asked = further.contains(&name) || (name == "solver" && words.contains(&"-v"));
            assert!(!is_asked || names.contains(&name), "{words:?} lacks {name}: {text}");
        }
        assert_eq!(names.contains(&"residuals"), !further.is_empty(), "{words:?}: {text}");
    }
}

/// A force that is zero by symmetry is 0, whatever the tolerance of the solver.
#[test]
fn a_zero_has_no_rounding() {
    let directory = TestDirectory::new();
    let (damage, contact) = (SCENE.find("[damage]").unwrap(), SCENE.find("[contact]").unwrap());
    directory.write("scene.toml", &format!("{}{}", &SCENE[..damage], &SCENE[contact..]));
    let text = directory.run(&["--bars"]).out;
    assert!(text.contains("± ") && text.contains("resultant of bottom (0, 3"), "{text}");
    assert!(!text.contains("(0 ±") && !text.contains("0.0000 ±"), "{text}");
}

#[test]
fn quiet_runs_print_one_line() {
    let directory = TestDirectory::new();
    for (words, fragments) in [
        (&[][..], &["scene: finished at t = 1 after 10 steps", "results in out/scene"][..]),
        (&["--accuracy", "0.05"], &["finished at t = 1", "accuracy 0.05 reached"]),
        (&["--set", "damage.lambda_u=1e4"], &["STOPPED at t = "]),
    ] {
        let said = directory.run(&[&["--quiet"], words].concat());
        assert!(said.out.lines().count() == 1 && said.err.is_empty(), "{said:?}");
        assert!(fragments.iter().all(|text| said.out.contains(text)), "{said:?}");
    }
    directory.say(&["run", "scene.toml", "-q", "-v"]).fails(2, &["cannot be used with"]);
}

/// An error of the arguments has no usage, for the program as for its scripts.
#[test]
fn errors_of_arguments_have_three_lines() {
    let directory = TestDirectory::new();
    for words in [
        &["run", "--slver", "tao", "scene.toml"][..],
        &["run"],
        &["rnu"],
        &["plot", "--only", "x", "out"],
        &["table"],
    ] {
        let said = directory.say(words);
        if said.err.contains("apt install") {
            continue;
        }
        said.fails(2, &["--help"]);
        let lines = said.err.lines().filter(|line| !line.is_empty()).count();
        assert!(lines <= 3 && !said.err.contains("sage"), "{said:?}");
    }
}

/// The topics that the sources name in notes.
fn topics(folder: &Path, found: &mut BTreeSet<String>) {
    for path in fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path())
    {
        if path.is_dir() {
            topics(&path, found);
        } else if let Ok(text) = fs::read_to_string(&path) {
            let named = text.split("(explain ").skip(1).filter_map(|rest| rest.split(')').next());
            let is_topic = |name: &&str| name.chars().all(|c| c.is_ascii_lowercase() || c == '-');
            found.extend(named.filter(is_topic).map(str::to_owned));
        }
    }
}

#[test]
fn every_topic_of_a_note_has_a_page_and_every_page_is_a_topic() {
    let (directory, root) = (TestDirectory::new(), Path::new(env!("CARGO_MANIFEST_DIR")));
    let mut named = BTreeSet::new();
    ["src", "scripts"].iter().for_each(|folder| topics(&root.join(folder), &mut named));
    assert!(named.len() > 5, "{named:?}");
    let list = directory.say(&["explain"]).out;
    let listed: BTreeSet<_> =
        list.lines().map(|line| line.split(' ').next().expect("a topic").to_owned()).collect();
    let pages = fs::read_dir(root.join("geo/how-to"))
        .expect("the pages")
        .map(|entry| entry.expect("a page").path());
    let pages: BTreeSet<_> = pages
        .map(|page| page.file_stem().expect("a name").to_string_lossy().into_owned())
        .collect();
    assert_eq!(listed, pages);
    assert!(named.is_subset(&listed), "{:?}", named.difference(&listed));
    for topic in &listed {
        let page = fs::read_to_string(root.join(format!("geo/how-to/{topic}.md"))).expect("a page");
        let output = directory.command(&["explain", topic]).output().expect("it starts");
        let shown = String::from_utf8(output.stdout).expect("UTF-8");
        let first = Vec::from_iter(page.lines().take(20)).join("\n");
        assert!(shown.starts_with(first.trim_end()), "{topic}: {shown}");
        assert!(shown.lines().count() <= 21, "{topic}: {shown}");
    }
    directory.say(&["explain", "singulr"]).fails(2, &["`singulr`", "did you mean `singular`?"]);
}

/// A note of a run ends with its topic, and a last line has the command for it.
#[test]
fn notes_end_with_their_topics() {
    let directory = TestDirectory::new();
    let said = directory.run(&sets(&["boundary.top.traction=[0, '-20*t']"])).out;
    assert!(said.contains("(explain large-rotation)\n"), "{said}");
    assert!(said.contains("  more          signorini explain large-rotation\n"), "{said}");
}

//! Files that are no mesh of a plane body: each must say what is wrong and where.

use std::fs;

use crate::common::{Random, fixture, msh::msh, read_bytes};
use signorini::mesh::{MeshError, read};

const HEAD: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";

/// A text file without names and with these nodes and elements.
fn text(nodes: &[impl AsRef<str>], elements: &[impl AsRef<str>]) -> String {
    msh(&[], nodes, elements)
}

const NODES: [&str; 5] = ["1 0 0 0", "2 1 0 0", "3 1 1 0", "4 0 1 0", "5 2 0 0"];
const FIRST: &str = "1 2 1 1 2 3";

#[track_caller]
fn complains(bytes: impl AsRef<[u8]>, fragments: &[&str]) {
    let message = read_bytes(bytes).expect_err("an error").to_string();
    for fragment in fragments {
        assert!(message.contains(fragment), "`{fragment}` is not in `{message}`");
    }
}

#[test]
fn files_that_are_no_mesh() {
    complains("", &["x.msh: the file is empty"]);
    complains(" \n\n", &["the file is empty"]);
    complains("<html>404</html>", &["x.msh:1: not a gmsh mesh"]);
    complains([0_u8, 159, 146, 150, 255, 1, 2], &["not a gmsh mesh"]);
    complains("$Mesh\n", &["x.msh:1: not a gmsh mesh"]);
    complains(HEAD, &["no $Nodes section"]);
    complains(format!("{HEAD}$Nodes\n0 0 0 0\n$EndNodes\n"), &["no $Elements section"]);
    complains(text(&NODES, &[""; 0]), &["there are no triangles", "gmsh -2"]);
    let missing = read(&fixture("there-is-none")).unwrap_err();
    assert!(matches!(missing, MeshError::Io { .. }));
    assert!(missing.to_string().contains("there-is-none.msh"));
}

#[test]
fn versions_and_byte_orders() {
    let format = |line: &str| format!("$MeshFormat\n{line}\n$EndMeshFormat\n");
    complains(fs::read(fixture("partitioned")).unwrap(), &["partitioned", "-part"]);
    complains(format("abc 0 8"), &["x.msh:2: expected a version such as 4.1, found `abc`"]);
    complains(format("4.1"), &["expected version, file type and data size"]);
    complains(format("4.1 7 8"), &["file type 0 (text) or 1 (binary), found `7`"]);
    complains(
        format("9.9 0 8"),
        &["x.msh:2: version 9.9 is not read; write the mesh as version 4.1"],
    );
    complains(format("2.2 0 8"), &["x.msh: there is no $Nodes section"]);

    let mut bytes = fs::read(fixture("plate-41-binary")).unwrap();
    let one = "$MeshFormat\n4.1 1 8\n".len();
    bytes[one..one + 4].fill(7);
    complains(&bytes, &["expected the number 1, found `117901063`"]);
    let four_bytes = "$MeshFormat\n4.1 1 4\n\x01\0\0\0\n$EndMeshFormat\n";
    complains(four_bytes, &["expected numbers of 8 bytes, found `4`"]);
}

#[test]
fn a_mesh_runs_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let [path, options, ran] = ["x.msh", "x.msh.opt", "ran"].map(|name| folder.path().join(name));
    let command = format!("SystemCall \"touch {}\";\n", ran.display());
    let old = fs::read_to_string(fixture("plate-22")).unwrap();
    fs::write(options, &command).unwrap();
    for before in ["", "\n", "\t"] {
        let comments = format!("{before}$Comments\n{command}$EndComments\n");
        fs::write(&path, comments + &old).unwrap();
        assert!(read(&path).is_ok() && !ran.exists(), "{before:?}");
    }
}

#[test]
fn elements_nobody_can_use() {
    complains(fs::read(fixture("tetrahedra")).unwrap(), &["(solid)", "gmsh -2"]);
    let unknown = text(&NODES, &["7 99 1 1 2 3"]);
    complains(unknown, &["x.msh:28: element 7 is of gmsh's type 99 (unknown)"]);
    let cubic = text(&NODES, &["7 21 1 1 2 3"]);
    complains(cubic, &["type 21 (an element of higher order)", "Mesh.ElementOrder = 1 or 2"]);
}

#[test]
fn elements_of_second_order() {
    const SECOND: &str = "1 9 1 1 2 3 4 5 6";
    let with = |midpoint: &str, elements: &[&str]| {
        let vertices = ["1 0 0 0", "2 1 0 0", "3 0 1 0", "10 1 1 0"];
        let midpoints = [midpoint, "5 0.5 0.5 0", "6 0 0.5 0", "7 1 0.5 0", "8 0.5 1 0"];
        text(&[&vertices[..], &midpoints].concat(), elements)
    };
    assert!(read_bytes(with("4 0.5 0 0", &[SECOND])).unwrap().curved.is_empty());
    let curved = read_bytes(with("4 0.5 -0.1 0", &[SECOND])).unwrap().curved;
    assert_eq!(curved, [([0, 1], [0.5, -0.1])].into());
    // det ∂x/∂λ = 1 − 4·0.3 at the second vertex.
    complains(with("4 0.5 0.3 0", &[SECOND]), &["x.msh:36: curved triangle 1 is folded"]);
    complains(with("4 0.5 0.25 0", &[SECOND]), &["x.msh:36: curved triangle 1 is folded"]);
    assert!(read_bytes(with("4 0.5 0.24 0", &[SECOND])).is_ok());
    complains(with("4 1e300 1e300 0", &[SECOND]), &["curved triangle 1 is folded"]);
    complains(with("4 1e308 1e308 0", &[SECOND]), &["curved triangle 1 is folded"]);
    complains(with("5 0.5 0.5 0", &[SECOND]), &["x.msh:19: node 5 is listed twice"]);
    complains(with("4 0.5 nan 0", &[SECOND]), &["node 4 is not a finite number"]);
    complains(with("4 0.5 0 0.1", &[SECOND]), &["x.msh:18: node 4 has z = 0.1"]);
    complains(with("40 0.5 0 0", &[SECOND]), &["x.msh:36: element 1 refers to node 4, which"]);
    complains(with("4 0.5 0 0", &["1 9 1 1 2 3 4 5"]), &["expected a node tag, but $Elements"]);

    let with = |elements: &[&str]| with("4 0.5 0 0", elements);
    assert!(read_bytes(with(&[SECOND, "2 9 1 10 3 2 8 5 7"])).is_ok());
    let gap = with(&[SECOND, "2 9 1 10 3 2 8 4 7"]);
    complains(gap, &["x.msh:38: element 2 has node 4 between nodes 3 and 2", "node 5"]);
    complains(with(&["9 8 1 1 2 7", SECOND]), &["element 1 has node 4", "has node 7"]);
    let mixed = with(&[SECOND, "2 2 1 10 3 2"]);
    complains(mixed, &["x.msh:38: triangle 2 is of order 1, others are of order 2"]);
}

#[test]
fn nodes() {
    let with = |node: &str| text(&["1 0 0 0", "2 1 0 0", node], &[FIRST]);
    assert!(read_bytes(with("3 1 1 0")).is_ok());
    complains(with("3 1 1 0.5"), &["x.msh:16: node 3 has z = 0.5"]);
    complains(with("2 1 1 0"), &["x.msh:16: node 2 is listed twice"]);
    complains(with("3 nan 1 0"), &["x.msh:16: a coordinate of node 3 is not a finite"]);
    complains(with("3 1e999 1 0"), &["node 3 is not a finite"]);
    complains(with("3 one 1 0"), &["x.msh:19: expected a number, found `one`"]);
    complains(with("-3 1 1 0"), &["x.msh:16: expected a node tag, found `-3`"]);
    complains(with("4 1 1 0"), &["x.msh:24: element 1 refers to node 3, which"]);
    complains(with("3 0.5 0 0"), &["x.msh:24: triangle 1 has no area"]);
    complains(with("3 0.5 1e-12 0"), &["triangle 1 has no area"]);
    complains(with("3 1e300 1e300 0"), &["triangle 1 has no area"]);
    complains(text(&NODES, &["1 2 1 1 2 2"]), &["triangle 1 has no area"]);
}

#[test]
fn overlapping_triangles() {
    // A triangle of several groups is listed once for each, and is no duplicate.
    let twice = text(&NODES, &[FIRST, "8 2 1 3 1 2", "9 2 2 1 2 3", "10 2 3 1 2 3"]);
    let mesh = read_bytes(twice).unwrap();
    assert_eq!((mesh.triangles.len(), mesh.surfaces.len()), (1, 3));

    let folded = text(&NODES, &[FIRST, "8 2 1 1 2 4"]);
    complains(folded, &["triangles 1 and 8 lie on the same side", "nodes 1 and 2"]);
    let nodes = ["1 0 0 0", "2 1 0 0", "3 0 1 0", "4 0 -1 0", "5 0 2 0"];
    let three = [FIRST, "8 2 1 1 2 4", "9 2 1 1 2 5"];
    complains(text(&nodes, &three), &["x.msh:32: triangles 1 and 9 lie on", "nodes 1 and 2"]);
}

#[test]
fn more_than_one_body() {
    let nodes = [
        "1 0 0 0", "2 1 0 0", "3 0 1 0", "4 1 1 0", "5 2 1 0", "6 1 2 0", "7 4 0 0", "8 5 0 0",
        "9 4 3 0",
    ];
    // One body: two triangles with a common edge.
    assert!(read_bytes(text(&nodes, &[FIRST, "2 2 1 2 4 3"])).is_ok());
    let two = text(&nodes, &[FIRST, "2 2 1 7 8 9"]);
    complains(
        two,
        &[
            "x.msh: the mesh has 2 pieces without common edges, as around (0.3333, 0.3333) and (4.3333, 1.0000); \
         join them along edges (gmsh: Coherence), or solve them one by one",
        ],
    );
    let three = text(&nodes, &[FIRST, "2 2 1 7 8 9", "3 2 1 4 5 6"]);
    complains(three, &["has 3 pieces", "as around (0.3333, 0.3333) and (4.3333, 1.0000)"]);
    // Two triangles that meet in the node (1, 0).
    let hinged = text(&nodes, &[FIRST, "2 2 1 2 7 5"]);
    complains(hinged, &["x.msh: the mesh has 2 pieces without common edges"]);
    // A ring closed in a node is one body: two of its triangles meet there, all in edges elsewhere.
    let nodes = ["1 0 0 0", "2 2 0 0", "3 1 1 0", "4 -1 1 0", "5 0 2 0", "6 -2 0 0", "7 0 3 0"];
    let ring =
        ["1 2 1 1 2 3", "2 2 1 2 7 3", "3 2 1 3 7 5", "4 2 1 5 7 4", "5 2 1 4 7 6", "6 2 1 4 6 1"];
    assert!(read_bytes(text(&nodes, &ring)).is_ok());
    complains(text(&nodes, &[ring[0], ring[5]]), &["2 pieces without common edges"]);
    // A physical surface chooses the body: the other triangle does not count.
    let chosen = text(&nodes, &[ring[0], "6 2 0 4 6 1"]);
    assert_eq!(read_bytes(chosen).unwrap().triangles.len(), 1);
}

#[test]
fn lines_off_the_body() {
    // Such a curve may show an obstacle; a scene cannot name it as a boundary.
    for line in ["2 1 7 2 5", "2 1 7 2 6"] {
        let mesh = read_bytes(text(&NODES, &[FIRST, line])).unwrap();
        assert_eq!((mesh.curves["7"].edges.len(), mesh.curves["7"].other_edges), (0, 1), "{line}");
    }
}

#[test]
fn counts() {
    let valid = text(&NODES, &[FIRST]);
    assert!(read_bytes(&valid).is_ok());
    let more = |more: &str| valid.replace("2 1 0 5", &format!("2 1 0 {more}"));
    for count in ["6", "18446744073709551615"] {
        complains(more(count), &["expected a n", ", but $Nodes ends here"]);
    }
    complains(more("-5"), &["x.msh:13: expected a count, found `-5`"]);
    complains(more("4"), &["expected 5 nodes as announced, found `4`"]);
    let longer = valid.replace("$EndElements", "1\n$EndElements");
    complains(longer, &["x.msh:29: expected the end of the section", "`1`"]);
    let groups = valid.replace("0 0 0 0 0 0 1 1 0", "0 0 0 0 0 0 2000000 1 0");
    complains(groups, &["x.msh:10: expected a physical tag, but $Entities ends here"]);
    complains(
        format!("{HEAD}$PhysicalNames\n1\n1 x \"a\"\n$EndPhysicalNames\n"),
        &["x.msh:6: expected dimension, tag"],
    );

    let four = String::from_utf8(fs::read(fixture("plate-41")).unwrap()).unwrap();
    let wrong = four.replacen("\n23 21 1 21\n", "\n23 20 1 21\n", 1);
    complains(wrong, &["expected 20 nodes as announced, found `21`"]);

    // A binary count of nearly everything, where the blocks of nodes are counted.
    let mut bytes = fs::read(fixture("plate-41-binary")).unwrap();
    let at = bytes.windows(7).position(|w| w == b"$Nodes\n").unwrap() + 7;
    bytes[at..at + 8].fill(0x7f);
    complains(&bytes, &["in $Nodes: expected", "but $Nodes ends here"]);
}

#[test]
fn places_stand_apart_from_problems() {
    let error = read_bytes(text(&NODES, &["1 99 0 1 2 3"])).unwrap_err();
    let MeshError::File { place, .. } = error else { panic!("{error}") };
    assert_eq!(place, ":28");
}

/// Per version: the lines of the counts of its text, from which a file may lack elements or have too many.
#[test]
fn a_count_that_the_file_does_not_keep_is_refused_in_every_version() {
    for name in ["version-1", "plate-22", "parametric-22", "save-all-22", "version-40", "plate-41"]
    {
        let text = fs::read_to_string(fixture(name)).unwrap();
        assert!(read_bytes(&text).is_ok(), "{name}");
        let lines: Vec<&str> = text.lines().collect();
        let heads = ["$Nodes", "$ParametricNodes", "$NOD", "$Elements", "$ELM"];
        for at in (0..lines.len()).filter(|&at| heads.contains(&lines[at])) {
            let words: Vec<&str> = lines[at + 1].split(' ').collect();
            // The number of items is the second one where blocks are counted as well.
            let place = usize::from(words.len() > 1);
            let count: i64 = words[place].parse().unwrap();
            for change in [-2, -1, 1, 2] {
                let mut other = words.clone();
                let changed = (count + change).to_string();
                other[place] = &changed;
                let other = other.join(" ");
                let other = [&lines[..=at], &[&*other], &lines[at + 2..]].concat();
                let message = read_bytes(other.join("\n")).unwrap_err().to_string();
                assert!(
                    message.contains("x.msh:") && message.contains("expected"),
                    "{name}: {message}"
                );
            }
            // A line that is lost or listed again.
            for line in [at + 6, at + 9] {
                let lost = [&lines[..line], &lines[line + 1..]].concat().join("\n");
                assert!(read_bytes(lost).is_err(), "{name} without line {line}");
                let twice = [&lines[..line], &lines[line - 1..]].concat().join("\n");
                assert!(read_bytes(twice).is_err(), "{name} with line {line} twice");
            }
        }
    }
}

const VALID: [&str; 14] = [
    "plate-22",
    "plate-22-binary",
    "parametric-22",
    "version-1",
    "version-40",
    "quadrangles",
    "disc-22-binary",
    "plate-41",
    "plate-41-binary",
    "newer-41",
    "parametric-41",
    "parametric-41-binary",
    "disc-41",
    "disc-41-binary",
];

#[test]
fn a_truncated_file_is_an_error() {
    for name in VALID {
        let bytes = fs::read(fixture(name)).unwrap();
        for cut in (0..bytes.len()).step_by(23).chain(bytes.len() - 20..bytes.len()) {
            let kept = bytes[..cut].trim_ascii_end();
            let complete = kept.ends_with(b"$EndElements") || kept.ends_with(b"$ENDELM");
            assert_eq!(read_bytes(&bytes[..cut]).is_ok(), complete, "{name} cut at {cut}");
        }
    }
    let bytes = fs::read(fixture("plate-41")).unwrap();
    complains(&bytes[..bytes.len() - 4], &["ends inside $Elements: it was cut off"]);
}

#[test]
fn damaged_files_never_panic() {
    let mut random = Random::new(1);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.msh");
    for name in VALID {
        let bytes = fs::read(fixture(name)).unwrap();
        for _ in 0..300 {
            let mut damaged = bytes.clone();
            for _ in 0..1 + random.below(4) {
                let at = random.below(damaged.len());
                damaged[at] = random.below(256) as u8;
            }
            fs::write(&path, &damaged).unwrap();
            // Either answer will do: a flipped digit can leave a valid mesh.
            if let Err(error) = read(&path) {
                assert!(!error.to_string().is_empty());
            }
        }
    }
}

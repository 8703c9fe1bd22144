//! Frames in pieces: together they are the frame that one rank writes.

#[path = "../common/vtu.rs"]
#[allow(dead_code, reason = "tests of other files read more of a frame")]
mod vtu;

use crate::{
    run_on_ranks,
    test_directory::{TestDirectory, sets, square},
};
use std::{collections::BTreeMap, path::Path};

/// Values at a point by the name of their array.
type Values = BTreeMap<String, Vec<f64>>;

/// What a file holds at its points and in its cells, by where these are.
#[derive(Default)]
struct Frame {
    points: BTreeMap<[i64; 2], Values>,
    cells: BTreeMap<[i64; 2], Values>,
}

/// Coordinates in millionths: two points are one if they have the same.
fn place(x: &[f64]) -> [i64; 2] {
    [0, 1].map(|i| (1e6 * x[i]).round() as i64)
}

/// Adds a file's points and cells; those that are there already must have the same values.
fn add(path: &Path, frame: &mut Frame) {
    let file = vtu::frame(path);
    let at = |i: usize| &file.points[3 * i..3 * i + 2];
    // The values of the i-th of `count` points or cells.
    let values = |data: &[(String, Vec<f64>)], count: usize, i: usize| -> Values {
        let own = data.iter().filter(|(name, _)| name != "global_node").map(|(name, all)| {
            let width = all.len() / count;
            (name.clone(), all[width * i..width * (i + 1)].to_vec())
        });
        own.collect()
    };
    let count = file.points.len() / 3;
    for i in 0..count {
        let new = values(&file.point_data, count, i);
        let old = frame.points.entry(place(at(i))).or_insert_with(|| new.clone());
        close(&new, old);
    }
    for (t, nodes) in file.nodes.iter().enumerate() {
        let middle = [0, 1].map(|k| nodes[..3].iter().map(|&i| at(i)[k]).sum::<f64>() / 3.0);
        let new = values(&file.cell_data, file.nodes.len(), t);
        assert!(frame.cells.insert(place(&middle), new).is_none(), "a triangle in two pieces");
    }
}

fn close(a: &Values, b: &Values) {
    assert!(a.keys().eq(b.keys()));
    for (name, (a, b)) in a.iter().map(|(name, a)| (name, (a, &b[name]))) {
        for (a, b) in a.iter().zip(b) {
            let same = a.is_nan() && b.is_nan() || (a - b).abs() <= 1e-8 * (1.0 + b.abs());
            assert!(same, "{name}: {a} is not {b}");
        }
    }
}

#[test]
fn pieces_together_are_the_frame_of_one_rank() {
    // Linear triangles, fewer than ranks: meshio reads no empty piece. Quadratic ones.
    for (order, cells, ranks) in [(1, 1, 4), (2, 4, 3)] {
        let directory = TestDirectory::new();
        directory.write("square.msh", &square(cells));
        // Not uniform, and pressed on a part of the bottom.
        let order = format!("discretisation.displacement={order}");
        let keys =
            sets(&["boundary.top.traction=['t', '-2*t*x']", "time.step=0.5", order.as_str()]);
        directory.run(&[&keys[..], &["--out", "one"]].concat());
        // A frame of an earlier run on more ranks must not stay.
        directory.run(&[&keys[..], &["--out", "many"]].concat());
        directory.write("many/fields_0001_7.vtu", "old");
        directory.write("many/fields_0099.pvtu", "old");
        let said = run_on_ranks(&directory, ranks, &[&keys[..], &["--out", "many"]].concat());
        assert_eq!(said.code, Some(0), "{said:?}");

        let (frames, lists) = (directory.frames("one"), directory.frames("many"));
        assert_eq!(frames.len(), lists.len());
        let mut expected_names: Vec<String> =
            "contact.csv contact.pvd fields.pvd history.csv scene.msh scene.toml summary.json"
                .split(' ')
                .map(String::from)
                .collect();
        for ((time, file), (listed, list)) in frames.iter().zip(&lists) {
            assert_eq!(time, listed);
            let mut whole = Frame::default();
            add(&directory.path(&format!("one/{file}")), &mut whole);
            let text = directory.read(&format!("many/{list}"));
            let sources: Vec<&str> =
                text.split("Source=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
            assert!(cells == 1 && (1..=2).contains(&sources.len()) || sources.len() == ranks);
            let mut joined = Frame::default();
            sources
                .iter()
                .for_each(|file| add(&directory.path(&format!("many/{file}")), &mut joined));
            assert!(whole.points.keys().eq(joined.points.keys()));
            assert!(whole.cells.keys().eq(joined.cells.keys()));
            whole.points.iter().for_each(|(at, values)| close(&joined.points[at], values));
            whole.cells.iter().for_each(|(at, values)| close(&joined.cells[at], values));
            for name in whole.points.values().chain(whole.cells.values()).flat_map(Values::keys) {
                assert!(text.contains(&format!("Name=\"{name}\"")), "{name} is not listed");
            }
            expected_names.extend(sources.iter().map(|&name| name.to_owned()));
            expected_names.push(list.clone());
            expected_names.push(file.replace("fields_", "contact_"));
        }
        expected_names.sort();
        assert_eq!(directory.names("many"), expected_names);
    }
}

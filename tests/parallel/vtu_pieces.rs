//! Frames in pieces: together they are the frame that one rank writes.

use crate::{
    run_on_ranks,
    test_directory::{TestDirectory, sets, square},
};
use std::{collections::BTreeMap, path::Path};
use vtkio::model::{Attribute, DataSet, Piece, Vtk};

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
    let vtk = Vtk::import(path).unwrap_or_else(|e| panic!("{}: {e:?}", path.display()));
    let DataSet::UnstructuredGrid { mut pieces, .. } = vtk.data else { panic!("another data set") };
    let Some(Piece::Inline(piece)) = pieces.pop() else { panic!("no piece") };
    let points: Vec<f64> = piece.points.cast_into().expect("real numbers");
    let at = |i: usize| &points[3 * i..3 * i + 2];
    let values = |attributes: &[Attribute], count: usize| -> Vec<Values> {
        let mut all = vec![Values::new(); count];
        for attribute in attributes {
            let Attribute::DataArray(array) = attribute else { panic!("a field") };
            if array.name == "global_node" {
                continue;
            }
            let data: Vec<f64> = array.data.clone().cast_into().expect("real numbers");
            let width = data.len() / count;
            for (values, data) in all.iter_mut().zip(data.chunks(width)) {
                values.insert(array.name.clone(), data.to_vec());
            }
        }
        all
    };
    for (i, new) in values(&piece.data.point, points.len() / 3).into_iter().enumerate() {
        let old = frame.points.entry(place(at(i))).or_insert_with(|| new.clone());
        close(&new, old);
    }
    let (_, corners) = piece.cells.cell_verts.into_legacy();
    let corners: Vec<usize> = corners.into_iter().map(|i| i as usize).collect();
    // Each cell is its number of nodes and these, the vertices first.
    let triangles: Vec<&[usize]> = corners.chunks(1 + corners[0]).map(|t| &t[1..]).collect();
    for (t, new) in triangles.iter().zip(values(&piece.data.cell, triangles.len())) {
        let middle = [0, 1].map(|k| t[..3].iter().map(|&i| at(i)[k]).sum::<f64>() / 3.0);
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
    // Linear triangles, fewer than ranks: vtkio and meshio read no empty piece. Quadratic ones.
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

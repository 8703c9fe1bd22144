//! The figures of every shipped scene at its shipped settings, as they were when the laws
//! beside this file passed. A change here is a change of what users get.
//!
//! To regenerate the table after a change that is meant:
//! `cargo test --test laws regression -- --nocapture`, and paste the rows it prints.
//!
//! The unstructured meshes are those of gmsh 4.8.4. Another release may triangulate otherwise, so its
//! figures on them are printed but not compared; `square.geo` is structured and the same for every gmsh.

use crate::support::{run, shipped, shipped_names};
use signorini::contact::SOLVERS;
use std::process::Command;

/// A scene; 1 − min ζ, 1 − mean ζ, displacement_max, work and contact_force; active_nodes; stopped_at.
type Figures = (&'static str, [f64; 5], usize, Option<f64>);

#[rustfmt::skip]
const TABLE: &[Figures] = &[
    ("beam", [1.555082367e-1, 2.020457392e-2, 3.804936736e-3, 2.558576680e1, 1.304157024e4], 35, None),
    ("bridge", [4.495255245e-5, 9.939503583e-6, 7.568266632e-3, 2.088084838e0, 3.200000000e2], 40, None),
    ("bridge-half", [4.495255245e-5, 9.939503583e-6, 7.568266632e-3, 1.044042419e0, 1.600000000e2], 20, None),
    ("hertz", [0.000000000e0, 0.000000000e0, 1.353938970e-3, 1.750222618e4, 1.750000000e7], 34, None),
    ("lshape", [1.866120011e-3, 4.236637496e-4, 1.813987307e-2, 5.357032452e0, 3.533929045e2], 58, None),
    ("lshape-rolling", [1.850287577e-3, 5.712468433e-4, 2.250029134e-2, 4.332354399e0, 1.755244024e2], 3, None),
    ("square", [9.841058733e-1, 3.755233454e-2, 2.472740206e-1, 2.684630536e0, 1.203301848e1], 32, Some(0.025)),
    ("square-mild", [1.916826814e-1, 3.099979741e-2, 2.442266919e-1, 2.597053915e0, 1.200221374e1], 32, None),
    ("square-table1", [5.291404145e-1, 2.836470037e-1, 1.003797981e-1, 4.296668585e-1, 4.871636054e-1], 19, None),
];

/// Rounding, the KKT tolerance and the order of sums: solvers differ by 10⁻⁹ here.
const SAME_MESH: f64 = 1e-6;

fn gmsh_is_the_tables() -> bool {
    let output = Command::new("gmsh").arg("--version").output().unwrap();
    String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).contains("4.8.4")
}

#[test]
fn the_shipped_scenes_give_the_figures_they_gave() {
    let mut wrong = Vec::new();
    for name in shipped_names() {
        let outcome = run(&shipped(&name, &[]), SOLVERS[0]);
        let record = outcome.last.record;
        let stopped = outcome.stopped.map(|stop| stop.time);
        let found = [
            1.0 - record.zeta_min,
            1.0 - record.zeta_mean,
            record.displacement_max,
            record.work,
            record.contact_force,
        ];
        let row = found.map(|value| format!("{value:.9e}")).join(", ");
        println!("    ({name:?}, [{row}], {}, {stopped:?}),", record.active_nodes);
        let Some((_, expected, active, stop)) = TABLE.iter().find(|row| row.0 == name) else {
            wrong.push(format!("{name} is not in the table"));
            continue;
        };
        if !name.starts_with("square") && !gmsh_is_the_tables() {
            continue;
        }
        for (found, expected) in found.iter().zip(expected) {
            let error = (found - expected).abs();
            if error.is_nan() || error > SAME_MESH * expected.abs() {
                wrong.push(format!("{name}: {found:e} was {expected:e}"));
            }
        }
        if record.active_nodes != *active {
            wrong.push(format!("{name}: {} nodes active, not as before", record.active_nodes));
        }
        if stopped.is_some() != stop.is_some()
            || stopped.zip(*stop).is_some_and(|(a, b)| (a - b).abs() > 1e-9)
        {
            wrong.push(format!("{name}: stopped at {stopped:?}, not at {:?}", *stop));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for row in TABLE {
        let known = shipped_names().iter().any(|name| name == row.0);
        assert!(known, "{} is no longer shipped", row.0);
    }
}

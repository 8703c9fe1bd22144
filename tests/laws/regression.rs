//! The figures of every shipped scene at its shipped settings, as they were when the laws
//! beside this file passed. A change here is a change of what users get.
//!
//! To regenerate the table after a change that is meant:
//! `cargo test --test laws regression -- --nocapture`, and paste the rows it prints.
//!
//! The unstructured meshes are those of gmsh 4.8.4. Another release may triangulate
//! otherwise; then their figures are compared within the discretisation error only.

use crate::support::{run, shipped, shipped_names};
use signorini::contact::SOLVERS;
use std::process::Command;

/// `active_nodes` and `stopped` as in the summary; the losses are 1 − min ζ and 1 − mean ζ.
struct Figures {
    scene: &'static str,
    greatest_loss: f64,
    mean_loss: f64,
    displacement_max: f64,
    work: f64,
    contact_force: f64,
    active_nodes: usize,
    stopped: Option<f64>,
}

#[rustfmt::skip]
const TABLE: &[Figures] = &[
    Figures { scene: "beam", greatest_loss: 1.555082367e-1, mean_loss: 2.020457392e-2, displacement_max: 3.804936736e-3, work: 2.558576680e1, contact_force: 1.277860476e4, active_nodes: 35, stopped: None },
    Figures { scene: "bridge", greatest_loss: 4.495255245e-5, mean_loss: 9.939503583e-6, displacement_max: 7.568266632e-3, work: 2.088084838e0, contact_force: 3.200000000e2, active_nodes: 40, stopped: None },
    Figures { scene: "bridge-half", greatest_loss: 4.495255245e-5, mean_loss: 9.939503583e-6, displacement_max: 7.568266632e-3, work: 1.044042419e0, contact_force: 1.600000000e2, active_nodes: 20, stopped: None },
    Figures { scene: "hertz", greatest_loss: 0.000000000e0, mean_loss: 0.000000000e0, displacement_max: 1.353938970e-3, work: 1.750222618e4, contact_force: 1.750000000e7, active_nodes: 34, stopped: None },
    Figures { scene: "lshape", greatest_loss: 1.866120011e-3, mean_loss: 4.236637496e-4, displacement_max: 1.813987307e-2, work: 5.357032452e0, contact_force: 3.533929045e2, active_nodes: 58, stopped: None },
    Figures { scene: "lshape-rolling", greatest_loss: 1.850287577e-3, mean_loss: 5.712468433e-4, displacement_max: 2.250029134e-2, work: 4.332354399e0, contact_force: 1.755244024e2, active_nodes: 3, stopped: None },
    Figures { scene: "square", greatest_loss: 9.841058733e-1, mean_loss: 3.755233454e-2, displacement_max: 2.472740206e-1, work: 2.684630536e0, contact_force: 1.196051485e1, active_nodes: 32, stopped: Some(0.025) },
    Figures { scene: "square-mild", greatest_loss: 1.916826814e-1, mean_loss: 3.099979741e-2, displacement_max: 2.442266919e-1, work: 2.597053915e0, contact_force: 1.196901233e1, active_nodes: 32, stopped: None },
    Figures { scene: "square-table1", greatest_loss: 5.291404145e-1, mean_loss: 2.836470037e-1, displacement_max: 1.003797981e-1, work: 4.296668585e-1, contact_force: 4.656221682e-1, active_nodes: 19, stopped: None },
];

/// Rounding, the KKT tolerance and the order of sums: solvers differ by 10⁻⁹ here.
const SAME_MESH: f64 = 1e-6;
/// Another mesh of the same size.
const OTHER_MESH: f64 = 2e-2;

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
        let [greatest_loss, mean_loss, displacement_max, work, contact_force] = found;
        println!(
            "    Figures {{ scene: {name:?}, greatest_loss: {greatest_loss:.9e}, \
             mean_loss: {mean_loss:.9e}, displacement_max: {displacement_max:.9e}, \
             work: {work:.9e}, contact_force: {contact_force:.9e}, \
             active_nodes: {}, stopped: {stopped:?} }},",
            record.active_nodes
        );
        let Some(row) = TABLE.iter().find(|row| row.scene == name) else {
            wrong.push(format!("{name} is not in the table"));
            continue;
        };
        // square.geo is structured: the same for every gmsh.
        let same = name.starts_with("square") || gmsh_is_the_tables();
        let tolerance = if same { SAME_MESH } else { OTHER_MESH };
        let expected =
            [row.greatest_loss, row.mean_loss, row.displacement_max, row.work, row.contact_force];
        for (found, expected) in found.iter().zip(expected) {
            let error = (found - expected).abs();
            if error.is_nan() || error > tolerance * expected.abs() {
                wrong.push(format!("{name}: {found:e} was {expected:e}"));
            }
        }
        if same && record.active_nodes != row.active_nodes {
            wrong.push(format!("{name}: {} nodes active, not as before", record.active_nodes));
        }
        if stopped.is_some() != row.stopped.is_some()
            || stopped.zip(row.stopped).is_some_and(|(a, b)| (a - b).abs() > 1e-9)
        {
            wrong.push(format!("{name}: stopped at {stopped:?}, not at {:?}", row.stopped));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for row in TABLE {
        let known = shipped_names().iter().any(|name| name == row.scene);
        assert!(known, "{} is no longer shipped", row.scene);
    }
}

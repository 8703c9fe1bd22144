//! A small chart: n = 8 against n = 16.

use super::{Study, options};
use signorini::petsc::Session;
use signorini_study::{ChartRow, chart};

#[test]
fn what_changes_the_cost_alone_does_not_change_the_error() {
    let study = Study::of("square-mild", "square.geo");
    // The scene as it stands has n = 8, so that n = 2 and 4 go with it.
    let spec = study.try_spec(&["mesh.size=0.125"], options(0.25, 2, 0.001)).unwrap();
    study.compute(&spec);
    let session = Session::start(&[]).unwrap();
    let rows = chart(&session, &study.load(&spec), &mut |_, _| ()).unwrap();
    assert!(rows.iter().all(|row| row.error.is_none() && row.kkt <= row.tolerance));
    assert!(rows.iter().all(|row| row.size >= 0.125), "coarser than the reference");
    let finest = |row: &&ChartRow| row.size / row.grading < 0.999 * 0.0625 / 4.0;
    assert!(!rows.iter().any(|row| finest(&row)), "coarser at the walls too");
    let default: Vec<_> = rows.iter().filter(|row| row.default).collect();
    assert_eq!(default.len(), 1);
    assert_eq!((default[0].size, default[0].grading, default[0].step), (0.125, 4.0, Some(0.01)));

    let uniform = |solver: &str, k: f64| -> &ChartRow {
        let same = |row: &&ChartRow| {
            row.solver == solver && row.step == Some(k) && row.grading == 1.0 && row.size == 0.125
        };
        rows.iter().find(same).unwrap()
    };
    for k in [0.1, 0.01, 0.002] {
        let ours = uniform("active-set", k);
        for solver in ["penalty-duality", "tao"] {
            let apart = (uniform(solver, k).sum / ours.sum - 1.0).abs();
            assert!(apart < 1e-6, "{solver} at k = {k}: {apart}");
        }
    }
    // Chosen steps err in time as uniform ones do: less as their tolerance tightens.
    let auto = |tolerance: f64| {
        let same = |row: &&ChartRow| {
            row.step_tolerance == Some(tolerance) && row.grading == 1.0 && row.size == 0.125
        };
        rows.iter().find(same).unwrap()
    };
    let limit = uniform("active-set", 0.001);
    let off = |row: &ChartRow| (row.zeta / limit.zeta - 1.0).abs();
    assert!(off(auto(1e-3)) <= off(auto(0.1)), "{} {}", off(auto(1e-3)), off(auto(0.1)));
    assert!(off(auto(1e-3)) < off(uniform("active-set", 0.1)));

    for row in rows.iter().filter(|row| row.front) {
        let better = |other: &&ChartRow| other.seconds < row.seconds && other.sum <= row.sum;
        assert!(!rows.iter().any(|other| better(&other)), "{row:?} is no member of the front");
    }
    assert!(rows.iter().any(|row| row.front) && rows.iter().any(|row| row.front_zeta));
}

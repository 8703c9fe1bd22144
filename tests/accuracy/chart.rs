//! A small chart: n = 8 against n = 16.

use signorini::{
    petsc::Session,
    study::{ChartRow, Plan, chart},
};

#[test]
fn what_changes_the_cost_alone_does_not_change_the_error() {
    let folder = tempfile::tempdir().unwrap();
    let plan = Plan { cells: 16, grading: 1.0, step: 0.001 };
    let session = Session::start(&[]).unwrap();
    plan.compute(&session, folder.path(), &mut |_| ()).unwrap();
    let rows = chart(&session, &plan.load(folder.path()).unwrap(), &mut |_, _| ()).unwrap();
    assert!(rows.iter().all(|row| row.error.is_none() && row.kkt <= row.tolerance && row.n == 8));

    let uniform = |solver: &str, k: f64| -> &ChartRow {
        let same =
            |row: &&ChartRow| row.solver == solver && row.step == Some(k) && row.grading == 1.0;
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
        rows.iter().find(|row| row.step_tolerance == Some(tolerance) && row.grading == 1.0).unwrap()
    };
    let limit = uniform("active-set", 0.001);
    let off = |row: &ChartRow| (row.zeta / limit.zeta - 1.0).abs();
    assert!(off(auto(5e-5)) <= off(auto(1e-2)), "{} {}", off(auto(5e-5)), off(auto(1e-2)));
    assert!(off(auto(5e-5)) < off(uniform("active-set", 0.1)));

    for row in rows.iter().filter(|row| row.front) {
        let better = |other: &&ChartRow| other.seconds < row.seconds && other.sum <= row.sum;
        assert!(!rows.iter().any(|other| better(&other)), "{row:?} is no member of the front");
    }
    assert!(rows.iter().any(|row| row.front) && rows.iter().any(|row| row.front_zeta));
}

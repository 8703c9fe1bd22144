//! A reference that is kept is the one computed, or is refused with a reason.

use signorini::{
    petsc::Session,
    study::{Plan, ReferenceError, StudyError},
};
use std::{fs, path::Path};

const PLAN: Plan = Plan { cells: 4, grading: 1.0, step: 0.02 };

fn compute(plan: Plan, folder: &Path) -> Result<(), StudyError> {
    plan.compute(&Session::start(&[]).unwrap(), folder, &mut |_| ())
}

#[test]
fn states_come_back_bit_by_bit_and_start_from_a_sound_body() {
    let folder = tempfile::tempdir().unwrap();
    let mut seen = Vec::new();
    let session = Session::start(&[]).unwrap();
    PLAN.compute(&session, folder.path(), &mut |record| seen.push(*record)).unwrap();
    let reference = PLAN.load(folder.path()).unwrap();
    assert_eq!((reference.states.len(), reference.times.len(), seen.len()), (51, 51, 51));
    assert!(reference.states[0].zeta.iter().all(|&zeta| zeta == 1.0));
    for (state, record) in reference.states.iter().zip(&seen) {
        let least = state.zeta.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = state.u.chunks(2).map(|u| u[0] * u[0] + u[1] * u[1]).fold(0.0, f64::max);
        assert_eq!((least, largest.sqrt()), (record.zeta_min, record.displacement_max));
    }
    assert!(seen[50].zeta_min < 0.99, "nothing was damaged");
}

#[test]
fn a_reference_of_finer_steps_keeps_the_same_times() {
    let folder = tempfile::tempdir().unwrap();
    let fine = Plan { step: 0.005, ..PLAN };
    let mut records = Vec::new();
    let session = Session::start(&[]).unwrap();
    fine.compute(&session, folder.path(), &mut |record| records.push(*record)).unwrap();
    let reference = fine.load(folder.path()).unwrap();
    for (j, state) in reference.states.iter().enumerate() {
        let least = state.zeta.iter().copied().fold(f64::INFINITY, f64::min);
        assert_eq!(least, records[4 * j].zeta_min, "state {j}");
    }
}

#[test]
fn a_file_that_is_missing_foreign_or_damaged_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = PLAN.path(folder.path());
    let load = || PLAN.load(folder.path()).unwrap_err();
    assert!(matches!(load(), ReferenceError::Missing { .. }));
    assert!(load().to_string().contains("signorini reference"));

    // Another mesh under this name.
    let other = Plan { grading: 2.0, ..PLAN };
    compute(other, folder.path()).unwrap();
    fs::rename(other.path(folder.path()), &path).unwrap();
    assert!(matches!(load(), ReferenceError::Other { .. }), "{}", load());
    assert!(load().to_string().contains("another scene or mesh"));

    compute(PLAN, folder.path()).unwrap();
    let whole = fs::read(&path).unwrap();
    PLAN.load(folder.path()).unwrap();
    for length in [0, 10, 150, whole.len() / 2, whole.len() - 5, whole.len() - 1] {
        fs::write(&path, &whole[..length]).unwrap();
        assert!(matches!(load(), ReferenceError::Damaged { .. }), "cut to {length} bytes");
    }
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    fs::write(&path, &flipped).unwrap();
    assert!(matches!(load(), ReferenceError::Damaged { .. }), "a flipped bit");
}

#[test]
fn steps_that_miss_the_times_of_the_states_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for step in [0.03, 0.015, 0.0, -0.01, f64::NAN, f64::INFINITY] {
        let plan = Plan { step, ..PLAN };
        assert!(matches!(plan.load(folder.path()), Err(ReferenceError::Plan(_))), "{step}");
    }
    for plan in [Plan { cells: 1, ..PLAN }, Plan { grading: 0.0, ..PLAN }] {
        assert!(matches!(plan.check(), Err(ReferenceError::Plan(_))), "{plan:?}");
    }
}

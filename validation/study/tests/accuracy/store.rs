//! A reference that is kept is the one computed, or is refused with a reason.

use super::{Study, options};
use signorini_study::{ReferenceError, ReferenceOptions, ReferenceSpec, StudyError};
use std::fs;

fn study() -> Study {
    Study::of("square-mild", "square.geo")
}

#[test]
fn states_come_back_bit_by_bit_and_start_from_a_sound_body() {
    let study = study();
    let spec = study.spec(options(0.25, 0, 0.02));
    let (seen, reference) = (study.compute(&spec), study.load(&spec));
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
    let study = study();
    let fine = study.spec(options(0.25, 0, 0.005));
    let (records, reference) = (study.compute(&fine), study.load(&fine));
    for (j, state) in reference.states.iter().enumerate() {
        let least = state.zeta.iter().copied().fold(f64::INFINITY, f64::min);
        assert_eq!(least, records[4 * j].zeta_min, "state {j}");
    }
}

#[test]
fn a_file_that_is_missing_foreign_or_damaged_is_refused() {
    let study = study();
    let spec = study.spec(options(0.25, 0, 0.02));
    let folder = study.folder.path();
    let path = spec.path(folder);
    let load = |spec: &ReferenceSpec| match spec.load(folder).unwrap_err() {
        StudyError::Reference(error) => error,
        other => panic!("{other}"),
    };
    assert!(matches!(load(&spec), ReferenceError::Missing(_)));
    assert!(load(&spec).to_string().contains("signorini-study reference"));

    // Another mesh under this name.
    let other = study.spec(ReferenceOptions { grading: Some(2.0), ..options(0.25, 0, 0.02) });
    study.compute(&other);
    fs::rename(other.path(folder), &path).unwrap();
    assert!(matches!(load(&spec), ReferenceError::Useless(..)), "{}", load(&spec));
    assert!(load(&spec).to_string().contains("another scene or mesh"));

    study.compute(&spec);
    let whole = fs::read(&path).unwrap();
    spec.load(folder).unwrap();
    for length in [0, 10, 150, whole.len() / 2, whole.len() - 5, whole.len() - 1] {
        fs::write(&path, &whole[..length]).unwrap();
        assert!(load(&spec).to_string().contains("is damaged"), "cut to {length} bytes");
    }
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    fs::write(&path, &flipped).unwrap();
    assert!(load(&spec).to_string().contains("is damaged"), "a flipped bit");
}

#[test]
fn what_the_states_depend_on_makes_a_reference_foreign_and_nothing_else_does() {
    let study = study();
    let choice = options(0.25, 0, 0.02);
    study.compute(&study.spec(choice));
    let load = |set: &[&str]| study.try_spec(set, choice).unwrap().load(study.folder.path());
    for same in ["title=Another", "output.every=7", "time.step=0.1"] {
        load(&[same]).unwrap();
    }
    let load_traction = "boundary.right.traction=[\"-1\", \"0\"]";
    for other in ["damage.lambda_u=3", "contact.tolerance=1e-8", load_traction] {
        let error = load(&[other]).unwrap_err();
        let foreign = error.to_string().contains("another scene or mesh");
        assert!(foreign, "{other}: {error}");
    }
    // Comments are not among it; a material is.
    let path = study.folder.path().join("square-mild.toml");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, format!("# A comment.\n{text}")).unwrap();
    load(&[]).unwrap();
    fs::write(&path, text.replace("young = 80", "young = 81")).unwrap();
    load(&[]).unwrap_err();
}

#[test]
fn steps_and_scenes_that_suit_no_study_are_refused() {
    let study = study();
    let refused = |set: &[&str], options| match study.try_spec(set, options).unwrap_err() {
        StudyError::Unsuitable(problem) => problem,
        other => panic!("{other}"),
    };
    for step in [0.03, 0.015, 0.0, -0.01, f64::NAN, f64::INFINITY] {
        assert!(refused(&[], options(0.25, 1, step)).contains("must divide 0.02"), "{step}");
    }
    assert!(refused(&["time.end=0.5"], options(0.25, 1, 0.02)).contains("must divide 0.01"));
    let hertz = Study::of("hertz", "hertz.geo");
    let error = hertz.try_spec(&[], ReferenceOptions::default()).unwrap_err();
    assert!(error.to_string().contains("[time]"), "{error}");
    // A .msh has one size.
    let path = study.folder.path().join("square-mild.toml");
    let text = fs::read_to_string(&path).unwrap();
    let text = text.replace("square.geo", "square.msh");
    let kept = |line: &&str| !line.starts_with("size") && !line.starts_with("parameters");
    fs::write(&path, text.lines().filter(kept).collect::<Vec<_>>().join("\n")).unwrap();
    assert!(refused(&[], options(0.25, 1, 0.02)).contains(".msh"));
}

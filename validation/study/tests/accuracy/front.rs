//! Pareto fronts and their knees.

use signorini_study::Front;

#[test]
fn dominated_and_missing_points_are_not_on_the_front() {
    let points =
        [[3.0, 1.0], [1.0, 3.0], [2.0, 3.0], [1.0, 4.0], [f64::NAN, 0.1], [2.0, 2.0], [0.5, 0.0]];
    assert_eq!(Front::of(&points).members, [1, 5, 0]);
}

#[test]
fn the_knee_is_where_the_front_bends() {
    // Error ~ 1/seconds to 10 s, then hardly less.
    let points = [[1.0, 1.0], [3.0, 0.33], [10.0, 0.1], [100.0, 0.09], [1000.0, 0.08]];
    assert_eq!(Front::of(&points).knee, Some(2));
}

#[test]
fn a_front_that_bends_outwards_or_ends_at_once_has_no_knee() {
    assert_eq!(Front::of(&[[1.0, 1.0], [10.0, 0.9], [100.0, 0.1]]).knee, None);
    assert_eq!(Front::of(&[[1.0, 1.0]]).knee, None);
    assert_eq!(Front::of(&[]), Front { members: vec![], knee: None });
}

//! The active set on random problems.

use signorini::petsc::Session;
use signorini_study::stability::random_sample;

#[test]
fn no_answer_to_a_random_problem_is_wrong() {
    let session = Session::start(&[]).unwrap();
    let counts = random_sample(&session, 30).unwrap();
    assert_eq!((counts.correct, counts.refused, counts.wrong), (30, 0, 0));
}

//! TAO's types: each is right.

use super::solve;
use signorini::{contact::TAO_TYPES, petsc::Session};
use signorini_study::stability::problems::difference;

#[test]
fn every_type_is_right() {
    let session = Session::start(&[]).unwrap();
    let exact = solve(&session, 8, "active-set", &[]).unwrap();
    for kind in TAO_TYPES {
        let step = solve(&session, 8, &format!("tao:{kind}"), &[]).unwrap();
        assert!(difference(&step.state.u, &exact.state.u) < 1e-6, "{kind}");
    }
}

//! TAO's types: each is right or says that it is not.

use super::solve;
use signorini::{contact::TAO_TYPES, petsc::Session};
use signorini_study::stability::problems::difference;

#[test]
fn every_type_is_right_or_refuses() {
    let session = Session::start(&[]).unwrap();
    let exact = solve(&session, 8, "active-set", &[]).unwrap();
    for kind in TAO_TYPES {
        match solve(&session, 8, &format!("tao:{kind}"), &[]) {
            Ok(step) => assert!(difference(&step.state.u, &exact.state.u) < 1e-6, "{kind}"),
            Err(refused) => assert!(refused.to_string().contains(kind), "{refused}"),
        }
    }
    for kind in ["tron", "bnls", "bntr", "bntl", "gpcg", "bqpip"] {
        assert!(solve(&session, 8, &format!("tao:{kind}"), &[]).is_ok(), "{kind}");
    }
}

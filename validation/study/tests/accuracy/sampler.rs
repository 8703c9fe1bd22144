//! Fields at given times, out of a run.

use signorini::evolution::State;
use signorini_study::Sampler;

/// u = (t, t²) and ζ = 1 − t at one node, seen at steps of 0.3.
#[test]
fn fields_between_two_steps_lie_on_the_line_through_both() {
    let times = [0.0, 0.1, 0.3, 0.5, 0.6];
    let mut sampler = Sampler::new(&times);
    // 0.1 + 0.2 is not 0.3.
    for time in [0.0, 0.1 + 0.2, 0.6] {
        sampler.observe(&State {
            time,
            u: vec![time, time * time],
            zeta: vec![1.0 - time],
            contact: Vec::new(),
        });
    }
    let squares = [0.0, 0.03, 0.09, 0.27, 0.36];
    assert_eq!(sampler.states.len(), times.len());
    for ((state, time), square) in sampler.states.iter().zip(times).zip(squares) {
        for (found, expected) in [(state.u[0], time), (state.u[1], square)] {
            assert!((found - expected).abs() < 1e-15, "{found} is not {expected} at {time}");
        }
        assert!((state.zeta[0] - 1.0 + time).abs() < 1e-15);
    }
}

//! Expressions: one that can be evaluated, or a message.
#![no_main]

use libfuzzer_sys::fuzz_target;
use signorini::scene::Expression;

fuzz_target!(|text: &str| {
    match Expression::parse(text) {
        Ok(expression) => {
            let value = expression.eval(0.3, -1.7, 0.5);
            if !expression.depends_on_space() && !expression.depends_on_time() {
                let other = expression.eval(2.0, 5.0, 11.0);
                assert!(value == other || value.is_nan() && other.is_nan());
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});

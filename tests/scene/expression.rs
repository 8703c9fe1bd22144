//! The laws of expressions: precedence, names, numbers, and what is refused.

#[path = "../common/mod.rs"]
mod common;

use common::Random;
use signorini::scene::Expression;

fn value(text: &str) -> f64 {
    at(text, 0.0, 0.0, 0.0)
}

fn at(text: &str, x: f64, y: f64, t: f64) -> f64 {
    let parsed = Expression::parse(text).unwrap_or_else(|e| panic!("`{text}` {e}"));
    parsed.eval(x, y, t)
}

fn refusal(text: &str) -> String {
    match Expression::parse(text) {
        Ok(parsed) => panic!("`{text}` was read as {parsed:?}"),
        Err(e) => e.to_string(),
    }
}

#[test]
fn precedence_and_associativity_are_those_of_mathematics() {
    for (text, expected) in [
        ("1+2*3", 7.0),
        ("(1+2)*3", 9.0),
        ("7-4-2", 1.0),
        ("7-4+2", 5.0),
        ("16/4/2", 2.0),
        ("16/4*2", 8.0),
        ("1-2*3^2/4+5", 1.5),
        ("2^3^2", 512.0),
        ("(2^3)^2", 64.0),
        ("-3^2", -9.0),
        ("(-3)^2", 9.0),
        ("2*-3^2", -18.0),
        ("2^-1", 0.5),
        ("2^-2^2", 0.0625),
        ("--3", 3.0),
        ("-+3", -3.0),
        ("4--3", 7.0),
        ("-2*-3", 6.0),
        ("-(1+2)^2", -9.0),
        ("sqrt(9)^2", 9.0),
        ("-sqrt(9)^2", -9.0),
        ("2^sqrt(9)", 8.0),
        // Functions of two arguments nest on either side.
        ("min(1,2)", 1.0),
        ("min(1, max(2, 0))", 1.0),
        ("min(max(2,0),1)", 1.0),
        ("max(min(5,6), max(3,4))", 5.0),
        ("min(max(min(3,2),1),max(0,min(7,9)))", 2.0),
        ("1-min(1,2)*3", -2.0),
        ("max(1+1,3*2)^2", 36.0),
        ("-min(-1,(2))", 1.0),
        ("sin(min(0,1))+max(sin(0),2)", 2.0),
        ("max ( 3 , ( 1 + 2 ) * 2 ) * 10", 60.0),
        // Numbers may carry a point and an exponent.
        ("1e-3", 1e-3),
        ("2.5E+2", 250.0),
        (".5", 0.5),
        ("3.", 3.0),
        ("1e3*2", 2000.0),
        ("1e-3-1e-3", 0.0),
        ("1e2^2", 1e4),
    ] {
        assert_eq!(value(text), expected, "{text}");
    }
    assert_eq!(at("min(max(x,0),1)", -0.5, 0.0, 0.0), 0.0);
    assert_eq!(at("min(max(x,0),1)", 0.25, 0.0, 0.0), 0.25);
    assert_eq!(at("min(max(x,0),1)", 7.0, 0.0, 0.0), 1.0);
    assert_eq!(at("atan2(y,x)", -1.0, 0.0, 0.0), std::f64::consts::PI);
}

#[test]
fn every_function_is_the_one_its_name_says() {
    let (x, y, t): (f64, f64, f64) = (0.7, -1.3, 0.4);
    for (text, expected) in [
        ("sin(x)", x.sin()),
        ("cos(x)", x.cos()),
        ("tan(x)", x.tan()),
        ("sqrt(x)", x.sqrt()),
        ("exp(y)", y.exp()),
        ("log(x)", x.ln()),
        ("abs(y)", 1.3),
        ("atan2(y, x)", y.atan2(x)),
        ("min(x, y)", y),
        ("max(x, y)", x),
        ("x^t", x.powf(t)),
        ("t*10 + x - y", t * 10.0 + x - y),
        ("cos(pi)", -1.0),
    ] {
        assert_eq!(at(text, x, y, t), expected, "{text}");
    }
}

#[test]
fn constants_and_time_are_recognised() {
    let constant = |text: &str| Expression::parse(text).expect(text).as_constant();
    assert_eq!(constant("2*pi/pi"), Some(2.0));
    assert_eq!(constant("0*x"), None);
    assert_eq!(Expression::constant(-3.5).as_constant(), Some(-3.5));
    assert_eq!(Expression::constant(-3.5).eval(1.0, 2.0, 3.0), -3.5);
    let timed = |text: &str| Expression::parse(text).expect(text).depends_on_time();
    assert!(timed("x*tan(t)"));
    assert!(!timed("tan(x)+sqrt(y)"));
}

#[test]
fn what_is_undefined_stays_visible() {
    assert!(value("0/0").is_nan());
    assert!(value("1/0").is_infinite());
    assert!(at("min(sqrt(x), 1)", -1.0, 0.0, 0.0).is_nan());
    assert!(at("min(1, sqrt(x))", -1.0, 0.0, 0.0).is_nan());
    assert!(at("max(sqrt(x), 1)", -1.0, 0.0, 0.0).is_nan());
    assert!(at("max(1, sqrt(x))", -1.0, 0.0, 0.0).is_nan());
}

#[test]
fn malformed_texts_are_refused_where_they_go_wrong() {
    for (text, fragment) in [
        ("", "is empty"),
        ("  ", "is empty"),
        ("2 x", "`x` at column 3"),
        ("2x", "`x` at column 2"),
        ("x(2)", "`(` at column 2"),
        ("pi(2)", "`(` at column 3"),
        ("(1+2", "the end at column 5"),
        ("1+2)", "`)` at column 4"),
        ("1+", "the end at column 3"),
        ("x**2", "`*` at column 3"),
        ("1,2", "`,` at column 2"),
        ("1..2", "`.` at column 3"),
        (".", "`.` at column 1"),
        ("()", "`)` at column 2"),
        ("sin x", "calls `sin` with 0 arguments; it takes 1"),
        ("sin(1,2)", "calls `sin` with 2 arguments"),
        ("min(1)", "calls `min` with 1 arguments; it takes 2"),
        ("min(1,2,3)", "calls `min` with 3 arguments"),
        ("1 min 2", "`m` at column 3"),
        ("1e999", "1e999, which is too large"),
        ("0 < t < 1", "compares a second time by `<` at column 7; write `a < b and b < c`"),
        ("t = 1", "`=` at column 3"),
        ("t < ", "the end at column 5"),
        ("t && x", "`&` at column 3"),
        ("x and or y", "unknown variable `or`"),
        ("if(t < 1, 2)", "calls `if` with 2 arguments; it takes 3"),
        ("table", "a table without a file"),
        ("table(x)", "a table without a file"),
        ("table('load.csv)", "a table without a file"),
        ("table('no such.csv')", "the table no such.csv: No such file"),
        ("free", "unknown variable `free`"),
        ("2*z", "unknown variable `z`"),
        ("Pi*x", "unknown variable `Pi`"),
        ("E", "unknown variable `E`"),
        ("τ", "unknown variable `τ`"),
        ("{x}", "`{` at column 1"),
        ("sinh(x)", "unknown function `sinh`"),
        ("ln(x)", "unknown function `ln`"),
        ("x1", "unknown variable `x1`"),
        ("pit", "unknown variable `pit`"),
        ("2*z", "known: x, y, t, pi, sin"),
        ("Pi*x", "did you mean `pi`?"),
        ("{x}", "a number, a name"),
        ("sinh(x)", "did you mean `sin`?"),
        ("x1", "did you mean `x`?"),
        ("pit", "did you mean `pi`?"),
    ] {
        let refusal = refusal(text);
        assert!(refusal.contains(fragment), "`{text}` {refusal}");
    }
}

#[test]
fn length_and_depth_do_not_exhaust_the_stack() {
    let long = "x+".repeat(9_000) + "1";
    assert_eq!(at(&long, 0.5, 0.0, 0.0), 4501.0);
    let deep = |n: usize| "(1+sin(".repeat(n) + "0" + &"))".repeat(n);
    assert_eq!(value(&deep(1)), 1.0);
    assert!(Expression::parse(&deep(30)).is_ok());
    assert!(refusal(&deep(1000)).contains("nested more than"));
    assert!(refusal(&("-".repeat(5000) + "1")).contains("nested"));
    assert!(refusal(&("2^".repeat(4000) + "1")).contains("nested"));
}

#[test]
fn a_long_expression_is_refused_at_once() {
    assert!(refusal(&("x".to_owned() + &"+x".repeat(10_000_000))).contains("20000001 bytes long"));
}

#[test]
fn conditions_are_one_or_zero_and_choose() {
    for (text, expected) in [
        ("1 < 2", 1.0),
        ("2 <= 1", 0.0),
        ("2 >= 2", 1.0),
        ("1 + 1 > 3 - 2", 1.0),
        ("1 == 1 and 2 != 2", 0.0),
        ("0 and 0 or 1", 1.0),
        ("1 or 0 and 0", 1.0),
        ("(1 or 0) and 0", 0.0),
        ("5 * (1 < 2)", 5.0),
        ("-1 < 0", 1.0),
        ("if(1 < 2, 3, 4)", 3.0),
        ("if(1 > 2, 3, if(0, 5, 6)) + 1", 7.0),
        ("if(0, sqrt(-1), 2)", 2.0),
    ] {
        assert_eq!(value(text), expected, "{text}");
        assert_eq!(Expression::parse(text).expect(text).as_constant(), Some(expected), "{text}");
    }
    let pulse = "if(t >= 0.2 and t < 0.4, x, -y)";
    for (t, expected) in [(0.1, -3.0), (0.2, 2.0), (0.3, 2.0), (0.4, -3.0)] {
        assert_eq!(at(pulse, 2.0, 3.0, t), expected, "{t}");
    }
    for text in ["sqrt(x) < 1", "if(sqrt(x) < 1, 2, 3)", "1 or sqrt(x)", "if(1, sqrt(x), 3)"] {
        assert!(at(text, -1.0, 0.0, 0.0).is_nan(), "{text}");
    }
    // Three deep in `if`, each with two values that wait.
    let deep = "if(x < 1, 2, 1 + ".repeat(40) + "x" + &")".repeat(40);
    assert_eq!(at(&deep, 3.0, 0.0, 0.0), 43.0);
}

/// The breaks in a run of one second, on the unit square.
fn breaks(text: &str) -> Vec<f64> {
    Expression::parse(text).expect(text).breaks([[0.0, 1.0]; 2], 1.0)
}

#[test]
fn the_times_of_jumps_are_known() {
    assert_eq!(breaks("if(t >= 0.1*2 and t < 0.4, x < 3, exp(t))"), [0.2, 0.4]);
    assert_eq!(breaks("if(2*t < 1, 0, 1)"), [0.5]);
    assert_eq!(breaks("(t >= 0.3) - (t >= 0.3 + 1e-8)"), [0.3, 0.3 + 1e-8]);
    // In a corner of the square, far below the thousandth of the run and of the side.
    let blow = "if(abs(t - 0.5) < 1e-5 and x > 0.999 and y > 0.999, 500, 0)";
    let [from, to] = breaks(blow)[..] else { panic!("two breaks") };
    assert!((from - 0.49999).abs() < 1e-12 && (to - 0.50001).abs() < 1e-12, "{from} {to}");
}

#[test]
fn pulses_are_followed_by_times_between_which_they_are_nearly_linear() {
    for width in [1e-3, 1e-4, 1e-5] {
        for text in [
            format!("1 + exp(-((t - 0.5678)/{width})^2)"),
            format!("-3 - x*max(0, 1 - abs(t - 0.5678)/{width})"),
            format!("x*y/(1 + ((t - 0.5678)/{width})^4)"),
        ] {
            let (f, mut times) = (Expression::parse(&text).expect(&text), breaks(&text));
            assert!((3..100).contains(&times.len()), "{text}: {}", times.len());
            times.insert(0, 0.0);
            times.push(1.0);
            let at = |t: f64| f.eval(1.0, 1.0, t);
            let range = (at(0.5678) - at(0.0)).abs();
            for pair in times.windows(2) {
                for i in 1..20 {
                    let part = f64::from(i) / 20.0;
                    let [from, to] = [pair[0], pair[1]];
                    let line = (1.0 - part) * at(from) + part * at(to);
                    let deviation = (at(from + part * (to - from)) - line).abs();
                    assert!(deviation < 0.15 * range, "{text}: {deviation} in {pair:?}");
                }
            }
        }
    }
}

#[test]
fn smooth_functions_and_rolling_ones_have_no_breaks_to_speak_of() {
    for smooth in ["t", "x*sin(20*t)", "t*t - t + x*t", "exp(-((t - 0.5)/0.1)^2)", "min(t, 2)", "x"]
    {
        assert_eq!(breaks(smooth), [0.0; 0], "{smooth}");
    }
    for rolling in [
        "if(x < t, 1, 2)",
        "if(abs(x - t) < 1e-3, 1, 0)",
        "max(0, 1 - abs(x - 0.5 + abs(0.5 - t))/0.01)",
        "exp(-((x - 0.2 - 0.6*t)/1e-4)^2)",
    ] {
        assert!(breaks(rolling).len() < 10, "{rolling}: {:?}", breaks(rolling));
    }
}

/// An expression of the operations of `random` that is at most so deep.
fn random_expression(random: &mut Random, depth: usize) -> String {
    if depth == 0 {
        return match random.below(4) {
            0 => format!("{:.3}", 3.0 * random.next()),
            i => ["x", "y", "t"][i - 1].to_owned(),
        };
    }
    let a = random_expression(random, depth - 1);
    let b = random_expression(random, depth - 1);
    let c = random_expression(random, depth - 1);
    let unary = ["sin", "cos", "tan", "sqrt", "exp", "log", "abs", "-"];
    let binary = ["+", "-", "*", "/", "^", "<", "<=", ">", ">=", "==", "!=", "and", "or"];
    match random.below(25) {
        i @ 0..8 => format!("{}({a})", unary[i]),
        i @ 8..21 => format!("(({a}) {} ({b}))", binary[i - 8]),
        21 => format!("min({a}, {b})"),
        22 => format!("max({a}, {b})"),
        23 => format!("atan2({a}, {b})"),
        _ => format!("if({a}, {b}, {c})"),
    }
}

#[test]
fn the_range_contains_all_values_in_a_box() {
    let mut random = Random::new(7);
    let (mut bounded, mut decided) = (0, 0);
    for _ in 0..3000 {
        let depth = 1 + random.below(3);
        let text = random_expression(&mut random, depth);
        let f = Expression::parse(&text).unwrap_or_else(|e| panic!("`{text}` {e}"));
        let scale = [1e-6, 0.1, 3.0][random.below(3)];
        let space = [(); 3].map(|()| {
            let from = [3.0 * random.next(), 0.0][usize::from(random.below(4) == 0)];
            [from, from + scale * (1.0 + random.next())]
        });
        let [low, high] = f.range(space);
        assert!(low <= high, "`{text}`");
        bounded += usize::from(low.is_finite() && high.is_finite());
        decided += usize::from(low == high);
        let near = |bound: f64| 1e-12 * (1.0 + bound.abs());
        for sample in 0..60 {
            // Corners of the box, then points within.
            let [x, y, t] = [0, 1, 2].map(|k| {
                let [from, to] = space[k];
                let part =
                    if sample < 8 { f64::from(sample >> k & 1) } else { 0.5 + 0.5 * random.next() };
                (from + part * (to - from)).min(to)
            });
            let value = f.eval(x, y, t);
            let inside = value.is_nan()
                || value == low
                || value == high
                || (value >= low - near(low) && value <= high + near(high));
            assert!(inside, "`{text}` is {value} at ({x}, {y}, {t}), not in [{low}, {high}]");
        }
    }
    assert!(bounded > 2000 && decided > 300, "{bounded} bounded, {decided} decided");
}

#[test]
fn differences_of_one_more_order_than_the_degree_vanish_on_all_lines() {
    // Of a polynomial of degree d in x and y the differences of order d + 1 along any line are zero.
    let mut random = Random::new(11);
    let mut of_degree = [0; 4];
    for _ in 0..4000 {
        let depth = 1 + random.below(3);
        let text = random_expression(&mut random, depth);
        let f = Expression::parse(&text).unwrap_or_else(|e| panic!("`{text}` {e}"));
        let space = [(); 2].map(|()| {
            let from = 2.0 * random.next();
            [from, from + [0.1, 2.0][random.below(2)]]
        });
        let t = random.next();
        let Some(degree) = f.degree([space[0], space[1], [t, t]]).filter(|d| *d < 4) else {
            continue;
        };
        of_degree[degree as usize] += 1;
        let mut place = || space.map(|[from, to]| from + (0.5 + 0.5 * random.next()) * (to - from));
        let (a, b) = (place(), place());
        let count = degree as usize + 1;
        let mut values = Vec::from_iter((0..=count).map(|k| {
            let s = k as f64 / count as f64;
            f.eval(a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), t)
        }));
        let size = values.iter().fold(1e-300, |most, value| f64::max(most, value.abs()));
        for _ in 0..count {
            values = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        }
        let is_zero = values[0].abs() <= 1e-9 * size || !values[0].is_finite();
        assert!(is_zero, "`{text}` of degree {degree}: {values:?} of {size} in {space:?}");
    }
    assert!(of_degree[..3].iter().all(|count| *count > 10), "{of_degree:?}");
    let degree = |text: &str, y: [f64; 2]| {
        Expression::parse(text).unwrap().degree([[1.0, 2.0], y, [0.5; 2]])
    };
    for (text, inside, on_a_line) in [
        ("x*y^2/3 - t*x", Some(3), Some(1)),
        ("sin(y) + x^2", None, Some(2)),
        ("max(x, 0) + min(y, 9)", Some(1), Some(1)),
        ("if(x > 1.5, 1, 0)", None, None),
        ("if(x < 3, x*x, sin(x))", Some(2), Some(2)),
        ("1/x", None, None),
    ] {
        assert_eq!(
            [degree(text, [0.0, 1.0]), degree(text, [1.0; 2])],
            [inside, on_a_line],
            "{text}"
        );
    }
}

#[test]
fn the_range_is_sharp_where_each_variable_occurs_once() {
    let range = |text: &str, x: [f64; 2]| {
        Expression::parse(text).expect(text).range([x, [0.5, 0.5], [0.0, 0.0]])
    };
    for (text, x, expected) in [
        ("x^2", [-1.0, 2.0], [0.0, 4.0]),
        ("x^3", [-1.0, 2.0], [-1.0, 8.0]),
        ("abs(x - 1)", [0.0, 3.0], [0.0, 2.0]),
        ("sin(x)", [0.0, 3.0], [0.0, 1.0]),
        ("cos(x)", [1.0, 4.0], [-1.0, 1.0_f64.cos()]),
        ("sqrt(x)", [-1e-17, 4.0], [0.0, 2.0]),
        ("1/x", [2.0, 4.0], [0.25, 0.5]),
        ("1/x", [-1.0, 1.0], [f64::NEG_INFINITY, f64::INFINITY]),
        ("x < 1", [0.0, 0.5], [1.0, 1.0]),
        ("x < 1", [1.0, 2.0], [0.0, 0.0]),
        ("x < 1", [0.0, 1.0], [0.0, 1.0]),
        ("if(x < 1, 3, 5 + x)", [0.0, 2.0], [3.0, 7.0]),
        ("max(x, y)", [0.0, 2.0], [0.5, 2.0]),
        ("atan2(y, x)", [-1.0, 1.0], [0.5_f64.atan2(1.0), 0.5_f64.atan2(-1.0)]),
    ] {
        assert_eq!(range(text, x), expected, "{text}");
    }
    let table = table("0,0\n1,3\n1,-1\n2,1", "table('load.csv', x)").expect("a table");
    assert_eq!(table.range([[0.5, 1.5], [0.0; 2], [0.0; 2]]), [-1.0, 3.0]);
    assert_eq!(table.range([[1.2, 1.5], [0.0; 2], [0.0; 2]]), [table.eval(1.2, 0.0, 0.0), 0.0]);
    assert_eq!(table.range([[3.0, 4.0], [0.0; 2], [0.0; 2]]), [1.0, 1.0]);
}

/// The function of the table with the `content`.
fn table(content: &str, expression: &str) -> Result<Expression, String> {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("load.csv"), content).expect("written");
    Expression::parse_in(expression, folder.path()).map_err(|e| e.to_string())
}

#[test]
fn a_table_is_piecewise_linear_and_constant_beyond_its_ends() {
    let text = "t, f\n# a comment\n0, 1\n 1, 3\n1, 5\n\n2.5e0, 2\n";
    let of_t = table(text, "2*table(\"load.csv\")").expect("a table");
    for (t, expected) in
        [(-1.0, 2.0), (0.0, 2.0), (0.25, 3.0), (1.0, 10.0), (1.75, 7.0), (2.5, 4.0), (9.0, 4.0)]
    {
        assert_eq!(of_t.eval(0.0, 0.0, t), expected, "{t}");
    }
    assert!(of_t.depends_on_time() && !of_t.depends_on_space());
    // The jump; the kinks are as far apart as chosen steps look.
    assert_eq!(of_t.breaks([[0.0; 2]; 2], 2.0), [1.0]);
    let of_x = table(text, "table('load.csv', abs(x))").expect("a table");
    assert_eq!(of_x.eval(-0.25, 7.0, 9.0), 1.5);
    assert!(
        of_x.depends_on_space()
            && !of_x.depends_on_time()
            && of_x.breaks([[0.0, 3.0]; 2], 2.0).is_empty()
    );
    assert!(of_x.eval(f64::NAN, 0.0, 0.0).is_nan());
}

#[test]
fn malformed_tables_are_refused_with_their_line() {
    for (content, fragment) in [
        ("", "load.csv: has no rows of numbers"),
        ("t,f\n", "load.csv: has no rows of numbers"),
        ("0,1\n1\n", "load.csv:2: must be two numbers"),
        ("t,f\n0,1\nx,2\n", "load.csv:3: must be two numbers"),
        ("0,1,2\n", "load.csv:1: must be two numbers"),
        ("0;1\n1;2\n", "load.csv:1: must be two numbers"),
        ("0 0\n1,2\n", "load.csv:1: must be two numbers"),
        ("0,1\n1,nan\n", "load.csv:2: has a number that is not finite"),
        ("0,1\n2,1\n1,1\n", "load.csv:3: the numbers of the first column must not fall"),
        ("0,1\n0,2\n0,3\n", "load.csv:3: is a third row"),
    ] {
        let refusal = table(content, "table('load.csv')").expect_err(content);
        assert!(refusal.contains(fragment), "{content:?} {refusal}");
    }
}

/// The function called `name` through points (a, f).
fn through(name: &str, points: &[[f64; 2]]) -> impl Fn(f64) -> f64 + use<> {
    let rows: Vec<String> = points.iter().map(|[a, f]| format!("{a:?},{f:?}")).collect();
    let function = table(&rows.join("\n"), &format!("{name}('load.csv', x)")).expect("a table");
    move |x| function.eval(x, 0.0, 0.0)
}

/// Points that rise, fall and stay, at uneven distances.
const UNEVEN: [[f64; 2]; 8] = [
    [-2.0, 3.0],
    [-1.5, 1.0],
    [-0.25, -0.5],
    [0.0, -0.5],
    [0.75, 0.25],
    [2.0, 0.125],
    [2.125, 2.0],
    [4.0, 2.5],
];

/// Values of scipy.interpolate.CubicSpline (SciPy 1.10), whose ends are no knots: a cubic function is itself, as is the
/// parabola of three points.
#[test]
fn splines_are_those_of_other_programs() {
    let f = through("spline", &UNEVEN);
    for (x, expected) in [
        (-1.75, 1.850062254571168),
        (-1.0, -0.0002490182846720812),
        (-0.125, -0.5342232544827777),
        (0.5, 0.2898626143606293),
        (1.25, -1.6419287430813299),
        (2.0625, 0.9963044879161446),
        (2.75, 15.274511419395264),
        (3.9, 8.01289811936607),
    ] {
        assert!((f(x) - expected).abs() < 1e-13, "{x}: {} is not {expected}", f(x));
    }
    let exact = |count: i32, of: fn(f64) -> f64| {
        let at = |i: i32| f64::from(i) + 0.3 * f64::from(i).sin();
        let points = Vec::from_iter((0..count).map(|i| [at(i), of(at(i))]));
        let f = through("spline", &points);
        for i in 0..50 {
            let x = at(count - 1) * f64::from(i) / 50.0;
            assert!(
                (f(x) - of(x)).abs() < 1e-12,
                "{count} points at {x}: {} is not {}",
                f(x),
                of(x)
            );
        }
    };
    exact(2, |x| 1.0 - 0.5 * x);
    exact(3, |x| x * x - x);
    exact(4, |x| x * x * (x - 2.0));
    exact(9, |x| x * (x - 4.0) * (x - 7.0));
}

/// Points with random distances and values.
fn random_points(random: &mut Random, count: usize) -> Vec<[f64; 2]> {
    let mut a = random.next();
    let next = |_| {
        a += 1.2 + random.next();
        // Equal values, too.
        [a, (4.0 * random.next()).round() / 2.0]
    };
    (0..count).map(next).collect()
}

/// Values of scipy.interpolate.PchipInterpolator (SciPy 1.15).
#[test]
fn monotone_cubics_are_those_of_other_programs() {
    let f = through("pchip", &UNEVEN);
    for (x, expected) in [
        (-1.75, 1.825),
        (-1.0, 0.112),
        (-0.125, -0.5),
        (0.5, 0.05555555555555558),
        (1.25, 0.206),
        (2.0625, 1.051104710053178),
        (2.75, 2.332212562017576),
        (3.9, 2.4995671844161205),
    ] {
        assert!((f(x) - expected).abs() < 1e-14, "{x}: {} is not {expected}", f(x));
    }
    let f = through("pchip", &[[0.0, 0.0], [1.0, 5.0], [3.0, 4.0]]);
    assert!((f(0.25) - 1.7421875).abs() < 1e-14 && (f(2.5) - 4.578125).abs() < 1e-14);
    // Ends whose slopes are limited to 0.
    let f = through("pchip", &[[0.0, 0.0], [1.0, 1.0], [2.0, 5.0]]);
    assert!((f(0.5) - 0.3).abs() < 1e-14);
}

/// Between two points the function goes from one value to the other without turning, and its derivative is continuous.
#[test]
fn a_monotone_cubic_passes_its_points_without_overshoot_and_without_kinks() {
    let mut random = Random::new(5);
    for count in [1, 2, 3, 4, 9, 30] {
        for _ in 0..40 {
            let points = random_points(&mut random, count);
            let f = through("pchip", &points);
            assert!(points.iter().all(|&[a, value]| f(a) == value), "{points:?}");
            for pair in points.windows(2) {
                let [[p, from], [q, to]] = [pair[0], pair[1]];
                let at = |i: usize| f(p + (q - p) * i as f64 / 100.0);
                let rises = (1..=100).map(|i| (at(i) - at(i - 1)) * (to - from).signum());
                assert!(rises.into_iter().all(|rise| rise >= -1e-12), "{pair:?} in {points:?}");
            }
            let last = points.len().saturating_sub(1);
            for [a, value] in points.iter().take(last).skip(1) {
                let h = 1e-6;
                let [before, after] = [(value - f(a - h)) / h, (f(a + h) - value) / h];
                let scale = 1.0 + before.abs().max(after.abs());
                assert!(
                    (after - before).abs() < 0.02 * scale,
                    "{before}, {after} at {a}: {points:?}"
                );
            }
            let [[first, start], [last, end]] = [points[0], points[last]];
            assert_eq!([f(first - 1.0), f(last + 1.0)], [start, end], "constant beyond the ends");
        }
    }
}

/// A jump divides the points: the functions on both sides know nothing of each other.
#[test]
fn a_smooth_function_jumps_where_its_points_do() {
    let [left, right] =
        [[[0.0, 1.0], [1.0, 3.0], [2.0, 4.0]], [[2.0, -1.0], [3.0, 7.0], [5.0, 0.0]]];
    let [f, g] = [left, right].map(|points| through("pchip", &points));
    let both = through("pchip", &[left, right].concat());
    [-1.0, 0.3, 1.5, 1.999].iter().for_each(|&x| assert_eq!(both(x), f(x), "{x}"));
    [2.001, 2.7, 4.0, 6.0].iter().for_each(|&x| assert_eq!(both(x), g(x), "{x}"));
    assert_eq!(both(2.0), -1.0);
}

/// Lines are exact. The error of a smooth function decreases with the fourth power of the distance of its points, if it is
/// monotone with the third, that of a piecewise linear one with the second.
#[test]
fn smooth_functions_are_exact_for_lines_and_of_their_order_for_monotone_ones() {
    let mut random = Random::new(6);
    let mut points = random_points(&mut random, 12);
    points.iter_mut().for_each(|[a, f]| *f = 3.0 - 0.7 * *a);
    let (f, [first, last]) = (through("pchip", &points), [points[0][0], points[11][0]]);
    for i in 0..=200 {
        let x = first + (last - first) * f64::from(i) / 200.0;
        assert!((f(x) - (3.0 - 0.7 * x)).abs() < 1e-13, "{x}");
    }
    for (function, orders) in [("spline", 3.8..4.2), ("pchip", 2.8..3.3), ("table", 1.9..2.1)] {
        let error = |n: i32| {
            let row = |i: i32| {
                format!(
                    "{0:?},{1:?}\n",
                    f64::from(i) / f64::from(n),
                    (f64::from(i) / f64::from(n)).exp()
                )
            };
            let rows: String = (0..=n).map(row).collect();
            let f = table(&rows, &format!("{function}('load.csv', x)")).expect("a table");
            let errors = (0..=3000).map(|i| f64::from(i) / 3000.0);
            errors.map(|x| (f.eval(x, 0.0, 0.0) - x.exp()).abs()).fold(0.0, f64::max)
        };
        let order = (error(20) / error(40)).log2();
        assert!(orders.contains(&order), "{function}: {order}");
    }
}

#[test]
fn the_range_of_a_smooth_function_has_all_its_values_and_is_reached() {
    let mut random = Random::new(7);
    for name in ["spline", "pchip"].repeat(100) {
        let points = random_points(&mut random, 7);
        let rows: Vec<String> = points.iter().map(|[a, f]| format!("{a:?},{f:?}")).collect();
        let f = table(&rows.join("\n"), &format!("{name}('load.csv', x)")).expect("a table");
        let [from, length] = [8.0 + 8.0 * random.next(), 2.0 + 2.0 * random.next()];
        let [low, high] = f.range([[from, from + length], [0.0; 2], [0.0; 2]]);
        let samples = (0..=500).map(|i| f.eval(from + length * f64::from(i) / 500.0, 0.0, 0.0));
        let [least, most] =
            samples.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], f| [a.min(f), b.max(f)]);
        assert!(low <= least && most <= high, "[{least}, {most}] in [{low}, {high}]");
        assert!(least - low < 0.1 && high - most < 0.1, "[{low}, {high}] for [{least}, {most}]");
    }
}

/// A smooth function of time has a break at a jump, and none of its points is one; those of a table are kinks.
#[test]
fn the_breaks_of_a_spline_are_its_jumps() {
    let rows = "0,0\n0.5,0.2\n1,1\n1,5\n1.5,5.3\n2,6\n";
    let breaks = |function: &str| {
        let f = table(rows, &format!("{function}('load.csv')")).expect("a table");
        f.breaks([[0.0; 2]; 2], 2.0)
    };
    assert_eq!(breaks("spline"), [1.0]);
    // A pulse that is shorter than the parts that are searched.
    let rows = "0,0\n0.7,0\n0.7005,3\n0.701,0\n2,0\n";
    let f = table(rows, "pchip('load.csv')").expect("a table");
    let breaks = f.breaks([[0.0; 2]; 2], 2.0);
    let near = |time: f64| breaks.iter().any(|found| (found - time).abs() < 1e-4);
    assert!(near(0.7005) && breaks.iter().all(|t| (0.69..0.71).contains(t)), "{breaks:?}");
}

/// Kinks along a line are found by the form of an expression, wherever they are, and smooth expressions have none.
#[test]
fn kinks_along_a_line_are_those_of_the_form() {
    let rows = "-1,1\n0.2,1\n0.7,3\n2,0\n";
    for (text, t, expected) in [
        ("table('load.csv', x)", 0.0, &[(0.2, 4.0), (0.7, -4.0 - 3.0 / 1.3)][..]),
        ("y + 2*table('load.csv', x + t)", 0.1, &[(0.1, 8.0), (0.6, -8.0 - 6.0 / 1.3)]),
        ("x + y*table('load.csv')", 0.5, &[]),
        ("pchip('load.csv', x)", 0.0, &[]),
        ("spline('load.csv', x)", 0.0, &[]),
        // The ends of a table.
        ("pchip('load.csv', 4*x - 1)*0 + spline('load.csv', 3*x)", 0.0, &[(2.0 / 3.0, f64::NAN)]),
        ("abs(x - 0.3)", 0.0, &[(0.3, 2.0)]),
        ("abs(x - 0.25*t)", 2.0, &[(0.5, 2.0)]),
        ("3*max(x^2, 0.5*x) + exp(x)", 0.0, &[(0.5, 1.5)]),
        ("sqrt((x - 0.6)^2)", 0.0, &[(0.6, 2.0)]),
        ("if(x < 0.4, 0, x - 0.4)", 0.0, &[(0.4, 1.0)]),
        // Kinks of the form whose slopes agree.
        ("max(0, x - 0.4)^2", 0.0, &[(0.4, 0.0)]),
        ("1000*(x - 0.5)^4 + cos(50*x) + sqrt(1 + x) + x^0.5*0", 0.0, &[]),
        ("max(x, x + y)", 0.0, &[]),
    ] {
        let found = table(rows, text).expect(text).kinks([[0.0, 0.0], [1.0, 0.0]], t);
        assert_eq!(found.len(), expected.len(), "{text}: {found:?}");
        for ((s, change), (place, value)) in found.iter().zip(expected) {
            assert!((s - place).abs() < 1e-8, "{text}: {found:?}");
            assert!(value.is_nan() || (change - value).abs() < 1e-5, "{text}: {found:?}");
        }
    }
}

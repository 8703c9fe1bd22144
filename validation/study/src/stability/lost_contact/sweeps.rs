//! The bodies of the map, and what changes along each of its rows.

use super::super::problems::square;
use signorini::evolution::{ObservedProblem, SetupError};

/// A unit square; BOUNDARY and LOAD are filled in.
const SCENE: &str = r#"
body = { force = [0, "WEIGHT"] }
boundary = [
    SIDE
    { name = "bottom", gap = "GAP" },
    { name = "top", traction = [0, "LOAD"] },
]
"#;
/// Cells along a side.
pub(super) const CELLS: usize = 16;

/// A square and what is changed about its load.
pub(super) struct Sweep {
    pub(super) name: &'static str,
    /// Of the parameter of `load`.
    pub(super) values: &'static [f64],
    /// The values from, to which there are many answers.
    pub(super) many: Option<[f64; 2]>,
    young: f64,
    weight: f64,
    pub(super) side: &'static str,
    pub(super) gap: &'static str,
    pub(super) load: fn(f64) -> String,
}

pub(super) const CLAMPED: &str = r#"{ name = "left", displacement = [0, 0] },"#;
const AXIS: &str = r#"{ name = "left", symmetry = true },"#;

const WEDGE: &str = "0.01*abs(x - 0.5)";

/// Around a threshold at 0: beyond it for positive values.
const AROUND: [f64; 16] = [
    -1.0, -0.1, -1e-3, -1e-6, -1e-8, -1e-10, -1e-12, 0.0, 1e-12, 1e-10, 1e-8, 1e-6, 1e-3, 0.1, 1.0,
    2.0,
];
const BESIDE: [f64; 13] =
    [0.0, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1];
const ECCENTRICITIES: [f64; 15] = [
    0.0,
    0.1,
    0.3,
    0.4,
    0.49,
    0.499,
    0.5 - 1e-6,
    0.5 - 1e-8,
    0.5,
    0.5 + 1e-8,
    0.5 + 1e-6,
    0.501,
    0.51,
    0.6,
    1.0,
];

/// A pressure of resultant 1 whose centre is at x = ½ + e.
fn eccentric(e: f64) -> String {
    format!("-1 - 12*({e:e})*(x - 0.5)")
}

const SWEEP: Sweep = Sweep {
    name: "",
    values: &BESIDE,
    many: None,
    young: 1e4,
    weight: 0.0,
    side: "",
    gap: "0",
    load: eccentric,
};

pub(super) const SWEEPS: [Sweep; 7] = [
    Sweep {
        name: "clamped, lifted",
        values: &AROUND,
        young: 80.0,
        side: CLAMPED,
        gap: "0.01",
        load: |lift| format!("-TOUCH*(1 - ({lift:e}))"),
        ..SWEEP
    },
    Sweep {
        name: "free, lifted",
        values: &AROUND,
        // Tension draws in the foot until it rests on its middle node alone.
        many: Some([-1e-6, 0.0]),
        weight: -1.0,
        load: |lift| format!("1 + ({lift:e})"),
        ..SWEEP
    },
    Sweep {
        name: "one point and an axis",
        values: &[0.0, 0.3, 0.6],
        side: AXIS,
        gap: "0.01*x",
        ..SWEEP
    },
    Sweep { name: "on a wedge", many: Some([0.0; 2]), gap: WEDGE, ..SWEEP },
    Sweep { name: "on a curve", many: Some([0.0; 2]), gap: "0.1*(x - 0.5)^2", ..SWEEP },
    Sweep {
        name: "on a wedge, lighter",
        values: &[1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8],
        gap: WEDGE,
        load: |size| format!("{size:e}*({})", eccentric(1e-3)),
        ..SWEEP
    },
    Sweep { name: "on a flat foot", values: &ECCENTRICITIES, many: Some([0.5; 2]), ..SWEEP },
];

impl Sweep {
    pub(super) fn problem(&self, load: &str, contact: bool) -> Result<ObservedProblem, SetupError> {
        let text = SCENE
            .replace("WEIGHT", &self.weight.to_string())
            .replace("SIDE", self.side)
            .replace("LOAD", load);
        let text = match contact {
            true => text.replace("GAP", self.gap),
            false => text.replace(r#"{ name = "bottom", gap = "GAP" },"#, ""),
        };
        square(CELLS, &text, &[format!("material.young={}", self.young)])
    }
}

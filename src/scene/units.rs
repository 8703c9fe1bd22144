//! The names of the units of a scene.

/// Units that are checked, in SI units.
const LENGTH_UNITS: [(&str, f64); 7] = [
    ("µm", 1e-6),
    ("mm", 1e-3),
    ("cm", 1e-2),
    ("m", 1.0),
    ("km", 1e3),
    ("in", 0.0254),
    ("ft", 0.3048),
];
const FORCE_UNITS: [(&str, f64); 5] =
    [("mN", 1e-3), ("N", 1.0), ("kN", 1e3), ("MN", 1e6), ("lbf", 4.448_222)];
const STRESS_UNITS: [(&str, f64); 7] = [
    ("Pa", 1.0),
    ("kPa", 1e3),
    ("MPa", 1e6),
    ("GPa", 1e9),
    ("bar", 1e5),
    ("psi", 6_894.757),
    ("ksi", 6_894_757.0),
];

/// The names of a scene's units. They label the results; the program converts no units.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Units {
    /// The unit of lengths and displacements, by default m.
    pub length: String,
    /// The unit of forces, by default N.
    pub force: String,
    /// The unit of time, by default s.
    pub time: String,
    /// The unit of stresses and pressures: by default Pa, or force/length² if one of these is given.
    pub stress: String,
}

impl Default for Units {
    fn default() -> Self {
        let [length, force, time, stress] = ["m", "N", "s", "Pa"].map(str::to_owned);
        Self { length, force, time, stress }
    }
}

impl Units {
    /// The unit of work per thickness.
    pub fn work(&self) -> String {
        match *self == Self::default() {
            true => "J/m".to_owned(),
            false => format!("{0}·{1}/{1}", self.force, self.length),
        }
    }

    /// A remark on a unit of stress that is not force/length². Units that the program does not know are right.
    pub fn contradiction(&self) -> Option<String> {
        let si = |table: &[(&str, f64)], unit: &str| {
            table.iter().find(|(name, _)| *name == unit).map(|(_, si)| *si)
        };
        let [force, length] = [si(&FORCE_UNITS, &self.force)?, si(&LENGTH_UNITS, &self.length)?];
        let stress = si(&STRESS_UNITS, &self.stress)?;
        let ratio = force / (length * length) / stress;
        ((ratio - 1.0).abs() > 1e-3).then(|| {
            format!(
                "units: {0}/{1}² is {ratio:.3e} {2}, so stresses and moduli in {0}/{1}² are no {2}; [units] only \
                 names them, nothing is converted",
                self.force, self.length, self.stress
            )
        })
    }
}

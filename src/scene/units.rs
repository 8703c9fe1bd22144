//! The names of the units of a scene.

/// Prefixes of m, N and Pa in units that are checked, and their powers of ten.
const PREFIXES: [(&str, i32); 7] =
    [("", 0), ("µ", -6), ("m", -3), ("c", -2), ("k", 3), ("M", 6), ("G", 9)];

/// The power of ten of a unit with this base. `None` if the program does not know it.
fn power(unit: &str, base: &str) -> Option<i32> {
    let prefix = unit.strip_suffix(base)?;
    PREFIXES.iter().find(|(known, _)| *known == prefix).map(|(_, power)| *power)
}

/// The end of a message about a number with a unit: `30e9 (Pa)` in place of `30 GPa`.
pub(super) fn without_prefix(text: &str) -> Option<String> {
    let (number, unit) = text.split_at(text.rfind(|c: char| c.is_ascii_digit())? + 1);
    let power = |base: &&str| power(unit.trim(), base);
    let base = ["Pa", "N", "m"].into_iter().find(|base| power(base).is_some())?;
    let number = format!("{}e{}", number.trim(), power(&base)?);
    number.parse::<f64>().is_ok().then(|| format!(": write {number} ({base}), without a unit"))
}

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
        let quotient =
            |force: &str, length: &str| Some(power(force, "N")? - 2 * power(length, "m")?);
        let stress = match self.stress.trim_end_matches(['²', '^', '2']).split_once('/') {
            Some((force, length)) => quotient(force, length)?,
            None => power(&self.stress, "Pa")?,
        };
        let ratio = quotient(&self.force, &self.length)? - stress;
        (ratio != 0).then(|| {
            format!(
                "units: {0}/{1}² is 1e{ratio} {2}, so stresses and moduli in {0}/{1}² are not in {2}; [units] only \
                 names units and converts nothing (explain large-rotation)",
                self.force, self.length, self.stress
            )
        })
    }
}

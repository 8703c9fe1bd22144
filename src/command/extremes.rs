//! The lines of a run's extreme stresses and of its contact.

use super::screen::{Shown, row};
use signorini::{
    estimate::{Extreme, Extremes},
    scene::Units,
};

/// The lines of the extreme stresses of the body, and a line for each of several materials.
pub(super) fn stresses(extremes: &Extremes, units: &Units, shown: &Shown) -> Vec<String> {
    let [von_mises, most, least, others @ ..] = &extremes.of_points[..] else { return Vec::new() };
    if von_mises.value == 0.0 {
        return Vec::new();
    }
    let unit = &units.stress;
    let largest = extreme(von_mises, unit, shown);
    let grows = match von_mises.singular.as_deref() {
        Some(place) => format!(" at {place}, grows as the mesh is refined"),
        None => String::new(),
    };
    let [most, least] = [most, least].map(|of| extreme(of, unit, shown));
    let of_material = |of: &[Extreme; 3]| {
        let name = of[0].name.strip_suffix(".von_mises_max")?;
        let [von_mises, most, least] = of.each_ref().map(|of| extreme(of, unit, shown));
        Some(row("", format!("{name}: von Mises {von_mises}, σ₁ {most}, σ₂ {least}")))
    };
    let body = [
        row("stress", format!("largest von Mises {largest}{grows}")),
        row("", format!("largest σ₁ {most}")),
        row("", format!("smallest σ₂ {least}")),
    ];
    body.into_iter().chain(others.as_chunks().0.iter().map_while(of_material)).collect()
}

/// The lines of the length of contact and of the largest pressure, of all contact and of each of several foundations.
pub(super) fn contact(extremes: &Extremes, units: &Units, shown: &Shown) -> Vec<String> {
    let pressures = extremes.of_points.iter().filter(|of| of.name.ends_with("pressure_max"));
    let line = |(pressure, (name, length)): (&Extreme, &(String, f64))| {
        let of =
            name.strip_suffix(".contact_length").map_or_else(String::new, |of| format!("{of}: "));
        let (length, unit) = (shown.figure(*length, name, 6), &units.length);
        let largest = match pressure.value {
            0.0 => String::new(),
            _ => format!(", largest pressure {}", extreme(pressure, &units.stress, shown)),
        };
        row("", format!("{of}length {length} {unit}{largest}"))
    };
    pressures.zip(&extremes.contact_lengths).map(line).collect()
}

/// The place of which `name` is the x in `quantities` and the next entry the y; `None` without one.
pub(super) fn place(quantities: &[(String, f64)], name: &str, shown: &Shown) -> Option<String> {
    let i = quantities.iter().position(|(other, _)| other == name)?;
    let (x, y) = (quantities[i].1, quantities[i + 1].1);
    x.is_finite().then(|| shown.mesh.place([x, y]))
}

/// An extreme with its place: with its bar, or with two digits if the mesh does not determine it.
fn extreme(extreme: &Extreme, unit: &str, shown: &Shown) -> String {
    let Extreme { name, value, at, singular, unresolved } = extreme;
    let reason = match (singular, unresolved) {
        (Some(_), _) => ": singular",
        (None, Some(_)) => ": not resolved",
        (None, None) => "",
    };
    let value = match extreme.is_known() {
        true => shown.extreme(*value, name),
        false => format!("{value:.1e}"),
    };
    format!("{value} {unit} at {}{reason}", shown.mesh.place(*at))
}

//! Suggestions for unknown names in messages.

/// Longer lists of names are not shown.
const LIST: usize = 20;

/// How alike two names are that differ by swapped, wrong, absent or further letters: from 0 to 1.
fn likeness(a: &str, b: &str) -> f64 {
    strsim::normalized_damerau_levenshtein(&a.to_lowercase(), &b.to_lowercase())
}

/// The most similar of the `known` names, if it is similar.
pub fn most_similar<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let near = known.filter(|known| likeness(name, known) >= 0.5);
    near.max_by(|a, b| likeness(name, a).total_cmp(&likeness(name, b)))
}

/// The end of a message about an unknown `name`: the most similar `known` name, and the list of all, or of the nearest three
/// of many.
pub fn suggestion(name: &str, known: &[impl AsRef<str>]) -> String {
    let known = Vec::from_iter(known.iter().map(AsRef::as_ref));
    let list = match known.len() {
        0 => return " (there are none)".to_owned(),
        1..=LIST => format!("known: {}", known.join(", ")),
        all => {
            let mut nearest = known.clone();
            nearest.sort_by(|a, b| likeness(name, b).total_cmp(&likeness(name, a)));
            format!("nearest of {all}: {}", nearest[..3].join(", "))
        }
    };
    match most_similar(name, known.iter().copied().rev()) {
        Some(near) => format!("; did you mean `{near}`? ({list})"),
        None => format!(" ({list})"),
    }
}

//! Suggestions for unknown names in messages.

/// Longer lists of names are not shown.
const LIST: usize = 20;

/// The end of a message about an unknown `name`: the most similar `known` name, and the list of all, or of the nearest three
/// of many.
pub(crate) fn suggestion(name: &str, known: &[impl AsRef<str>]) -> String {
    let known = Vec::from_iter(known.iter().map(AsRef::as_ref));
    let likeness = |known: &&str| {
        strsim::normalized_damerau_levenshtein(&name.to_lowercase(), &known.to_lowercase())
    };
    let mut nearest = known.clone();
    nearest.sort_by(|a, b| likeness(b).total_cmp(&likeness(a)));
    let list = match known.len() {
        0 => return " (there are none)".to_owned(),
        1..=LIST => format!("known: {}", known.join(", ")),
        all => format!("nearest of {all}: {}", nearest[..3].join(", ")),
    };
    match likeness(&nearest[0]) >= 0.5 {
        true => format!("; did you mean `{}`? ({list})", nearest[0]),
        false => format!(" ({list})"),
    }
}

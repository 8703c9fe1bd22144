//! Suggestions for unknown names in messages.

/// The end of a message about an unknown `name`: the most similar `known` name, and the list of all.
pub(crate) fn suggestion(name: &str, known: &[impl AsRef<str>]) -> String {
    let (name, known) = (name.to_lowercase(), Vec::from_iter(known.iter().map(AsRef::as_ref)));
    let likeness = |known: &str| strsim::normalized_damerau_levenshtein(&name, known);
    let rated = known.iter().map(|known| (likeness(&known.to_lowercase()), known));
    let nearest = rated.reduce(|best, other| if other.0 > best.0 { other } else { best });
    match nearest {
        None => " (there are none)".to_owned(),
        Some((likeness, meant)) if likeness >= 0.5 => {
            format!("; did you mean `{meant}`? (known: {})", known.join(", "))
        }
        Some(_) => format!(" (known: {})", known.join(", ")),
    }
}

//! Effects by the names that people give.
//!
//! A name that the catalogue does not have is answered with the effect that was probably meant: the one that has the name
//! among its synonyms, else the one whose name or synonym has the smallest edit distance (V. I. Levenshtein, 1966: the
//! number of characters that are inserted, deleted or changed), if that is at most a third of the characters.

use super::{CATALOGUE, Entry};
use crate::Error;

/// The entries of these names.
///
/// # Errors
/// A name that is not in the catalogue; the message says which one was probably meant, and lists them all.
pub(crate) fn entries(
    parameter: &'static str,
    names: &[String],
) -> Result<Vec<&'static Entry>, Error> {
    let find = |name: &String| {
        CATALOGUE.iter().find(|entry| entry.name == name).ok_or_else(|| {
            let known: Vec<&str> = CATALOGUE.iter().map(|entry| entry.name).collect();
            let meant = meant(name).map_or_else(String::new, |entry| {
                format!("did you mean `{}` ({})? ", entry.name, entry.what)
            });
            Error::parameter(parameter, name, format!("{meant}Give one of {}", known.join(", ")))
        })
    };
    names.iter().map(find).collect()
}

/// The effect that a wrong name probably means.
fn meant(name: &str) -> Option<&'static Entry> {
    let wanted = plain(name);
    let distance = |entry: &Entry| {
        let words = std::iter::once(&entry.name).chain(entry.synonyms);
        words.map(|word| edits(&wanted, &plain(word))).min().unwrap_or(usize::MAX)
    };
    let nearest = CATALOGUE.iter().min_by_key(|entry| distance(entry))?;
    (3 * distance(nearest) <= wanted.len()).then_some(nearest)
}

/// The letters and digits of a name, in lower case.
fn plain(name: &str) -> Vec<char> {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The edit distance of two words.
fn edits(a: &[char], b: &[char]) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.iter().enumerate() {
            let change = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = change.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn the_edit_distance_counts_insertions_deletions_and_changes() {
        let distance = |a: &str, b: &str| edits(&plain(a), &plain(b));
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("Dead Time", "dead-time"), 0);
    }

    #[test]
    fn every_synonym_means_its_own_effect_alone() {
        let mut seen = HashSet::new();
        for entry in CATALOGUE {
            for word in std::iter::once(&entry.name).chain(entry.synonyms) {
                assert_eq!(word.to_lowercase(), *word);
                let is_new = seen.insert(plain(word));
                assert!(is_new || entry.synonyms.contains(word), "`{word}` is said of two effects");
                assert_eq!(meant(word).unwrap().name, entry.name, "{word}");
            }
        }
    }

    #[test]
    fn a_wrong_name_is_answered_with_the_one_that_was_meant() {
        for entry in CATALOGUE {
            // a letter too many, and one that is missing
            for wrong in [format!("{}x", entry.name), entry.name[1..].to_owned()] {
                let error = entries("effects", &[wrong]).unwrap_err().to_string();
                assert!(error.contains(&format!("did you mean `{}`", entry.name)), "{error}");
            }
        }
        let error = entries("effects", &["magic".to_owned()]).unwrap_err().to_string();
        assert!(!error.contains("did you mean") && error.contains("Give one of"), "{error}");
    }
}

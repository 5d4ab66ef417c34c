//! The check of names, units and other texts that come from files.
//!
//! A text is refused if it has a character that no printed name has: a control character (newline, NUL and escape among
//! them), a line or paragraph separator, or a mark that changes the direction of writing. It is also refused if it is longer
//! than [`LONGEST`]. All other characters are allowed, and each writer escapes those that have a meaning in its format.

use crate::{Channel, Error};

/// The largest number of characters of a text. Names are labels of axes and columns; sentences of a model file, such as the
/// method behind a noise floor, stay far below it too.
const LONGEST: usize = 1000;

/// The number of characters of a refused text that its message shows.
const SHOWN: usize = 40;

/// Rejects a text that no honest file contains; `what` says what it is, such as "a name".
pub(crate) fn require_text(what: &str, text: &str) -> Result<(), Error> {
    let is_foreign = |c: char| {
        let changes_direction = matches!(c, '\u{61c}' | '\u{200e}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        c.is_control() || changes_direction || matches!(c, '\u{2028}' | '\u{2029}')
    };
    let reason = if let Some(found) = text.chars().find(|&c| is_foreign(c)) {
        format!("contains the character U+{:04X}", u32::from(found))
    } else if text.chars().nth(LONGEST).is_some() {
        format!("has more than {LONGEST} characters")
    } else {
        return Ok(());
    };
    let shown = text.chars().take(SHOWN).flat_map(|c| {
        let escaped: Box<dyn Iterator<Item = char>> =
            if is_foreign(c) { Box::new(c.escape_unicode()) } else { Box::new(std::iter::once(c)) };
        escaped
    });
    let what = what.to_owned();
    Err(Error::Name { what, text: shown.collect(), reason })
}

/// Rejects channels with such a name or unit.
pub(crate) fn require_names(channels: &[Channel]) -> Result<(), Error> {
    channels.iter().try_for_each(|channel| {
        require_text("the name", &channel.name)?;
        require_text(&format!("the unit of `{}`", channel.name), &channel.unit)
    })
}

/// Rejects a model file with such a text anywhere: besides names and units, a file has labels of effects and of estimates.
/// The error says where the text is, such as `inputs[0].unit`.
pub(crate) fn require_texts(value: &serde_json::Value) -> Result<(), Error> {
    require_texts_at("", value)
}

fn require_texts_at(place: &str, value: &serde_json::Value) -> Result<(), Error> {
    match value {
        serde_json::Value::String(text) => require_text(&format!("the text at `{place}`"), text),
        serde_json::Value::Array(values) => values
            .iter()
            .enumerate()
            .try_for_each(|(index, value)| require_texts_at(&format!("{place}[{index}]"), value)),
        serde_json::Value::Object(values) => values.iter().try_for_each(|(key, value)| {
            require_text("a key of the model file", key)?;
            let dot = if place.is_empty() { "" } else { "." };
            require_texts_at(&format!("{place}{dot}{key}"), value)
        }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Experiment, Matrix, Record};

    #[test]
    fn honest_texts_are_accepted() {
        for text in
            ["", "y_um", "µm", "°C", "位", "β²", "u [$/h]", "*/", "<b>", "=1+1", "u\\", "😀"]
        {
            assert_eq!(require_text("the name", text), Ok(()), "{text}");
        }
        assert!(require_text("the name", &"x".repeat(LONGEST)).is_ok());
    }

    #[test]
    fn foreign_characters_are_named_and_not_repeated() {
        for foreign in
            "\0\u{7}\t\n\r\u{1b}\u{7f}\u{85}\u{9b}\u{2028}\u{202e}\u{2066}\u{200f}".chars()
        {
            let error = require_text("the unit", &format!("V{foreign}x")).unwrap_err();
            let said = error.to_string();
            assert!(said.contains(&format!("U+{:04X}", u32::from(foreign))), "{said}");
            assert!(!said.contains(foreign), "{said:?}");
            assert_eq!(error.kind(), crate::error::ErrorKind::Data);
        }
        let long = require_text("the name", &"x".repeat(LONGEST + 1)).unwrap_err().to_string();
        assert!(long.len() < 200 && long.contains("1000"), "{long}");
    }

    #[test]
    fn records_and_model_files_refuse_them() {
        let signal = Matrix::from_fn(9, 1, |k, _| k as f64);
        let run =
            Experiment { covariates: signal.clone(), ..Experiment::new(signal.clone(), signal) };
        let record = |names: [&str; 3]| {
            let [u, y, x] = names.map(|name| vec![Channel::new("a", name)]);
            Record::new(vec![run.clone()], 1.0, u, y, x)
        };
        assert!(record(["V", "um", "K"]).is_ok());
        for place in 0..3 {
            let mut names = ["V", "um", "K"];
            names[place] = "a\nb";
            assert!(
                matches!(record(names), Err(Error::Name { what, .. }) if what.starts_with("the unit"))
            );
        }
        let nested = serde_json::json!({"effects": [{"label": "\u{1b}[2J"}]});
        let what = "the text at `effects[0].label`";
        assert!(
            matches!(require_texts(&nested), Err(Error::Name { what: found, .. }) if found == what)
        );
        let key = serde_json::json!({"\u{1b}": 1});
        assert!(matches!(require_texts(&key), Err(Error::Name { .. })));
    }
}

//! What makes the numbers of an effect invalid, wherever they come from.

/// The longest delay of an effect's own delay line, in samples. A model keeps so many past samples for every effect
/// that has one, and no dead time of an actuator comes near to it.
const LONGEST: usize = 1_000_000;

/// Names the first number that is not positive and finite.
pub(super) fn positive(numbers: &[(&str, f64)]) -> Option<String> {
    let (name, value) = numbers.iter().find(|(_, value)| !(value.is_finite() && *value > 0.0))?;
    Some(format!("its {name} of {value} must be positive"))
}

/// Refuses a dead time whose delay line would not fit into memory.
pub(super) fn late(dead_time: usize) -> Option<String> {
    (dead_time > LONGEST)
        .then(|| format!("its dead time of {dead_time} samples must be at most {LONGEST}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_number_that_is_wrong_is_named() {
        assert_eq!(positive(&[("rate", 1.0), ("span", 1e-300)]), None);
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let found = positive(&[("rate", 1.0), ("span", wrong)]).unwrap();
            assert_eq!(found, format!("its span of {wrong} must be positive"));
        }
    }

    #[test]
    fn a_delay_line_has_a_longest_length() {
        assert_eq!(late(LONGEST), None);
        assert!(late(usize::MAX).is_some());
    }
}

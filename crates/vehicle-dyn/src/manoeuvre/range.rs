//! Range checks of manoeuvre files.

use super::ManoeuvreError;

/// Refuses a value outside `[low, high]`, and what is no number.
pub(super) fn within(
    field: &str,
    value: f64,
    [low, high]: [f64; 2],
    unit: &str,
) -> Result<(), ManoeuvreError> {
    if value >= low && value <= high {
        return Ok(());
    }
    Err(refused(
        field,
        &value.to_string(),
        &format!("in [{low}, {high}] {unit}"),
    ))
}

/// Refuses a list that is empty, or not in rising order, or with a value outside `[low, high]`.
pub(super) fn rising(
    field: &str,
    values: &[f64],
    [low, high]: [f64; 2],
    unit: &str,
) -> Result<(), ManoeuvreError> {
    if values.is_empty() {
        return Err(refused(field, "[]", "a list of at least one number"));
    }
    for (index, value) in values.iter().enumerate() {
        within(&format!("{field}[{index}]"), *value, [low, high], unit)?;
    }
    if let Some([before, after]) = values.windows(2).find(|pair| pair[0] >= pair[1]) {
        let found = format!("{before}, {after}");
        return Err(refused(field, &found, "in rising order"));
    }
    Ok(())
}

/// Refuses a pair that is not rising.
pub(super) fn ordered(
    fields: &str,
    lower: f64,
    upper: f64,
    unit: &str,
) -> Result<(), ManoeuvreError> {
    if lower < upper {
        return Ok(());
    }
    let allowed = format!("rising, the first below the second, in {unit}");
    Err(refused(fields, &format!("{lower}, {upper}"), &allowed))
}

/// The error for a refused value.
pub(super) fn refused(field: &str, value: &str, allowed: &str) -> ManoeuvreError {
    ManoeuvreError::OutOfRange {
        field: format!("manoeuvre.{field}"),
        value: value.to_owned(),
        allowed: allowed.trim_end().to_owned(),
    }
}

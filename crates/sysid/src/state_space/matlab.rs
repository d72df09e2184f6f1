//! The model as a script for MATLAB and GNU Octave.

use std::fmt::Write as _;

use deepc_core::faer::MatRef;

use super::{Channel, StateSpace};
use crate::error::SysidError;

/// Words that cannot name a variable there.
const RESERVED: [&str; 20] = [
    "break",
    "case",
    "catch",
    "classdef",
    "continue",
    "else",
    "elseif",
    "end",
    "for",
    "function",
    "global",
    "if",
    "otherwise",
    "parfor",
    "persistent",
    "return",
    "spmd",
    "switch",
    "try",
    "while",
];

/// Longest name of a variable, less what the script appends.
const LONGEST_NAME: usize = 56;

impl StateSpace {
    /// A script that builds the struct `name` with the fields A, B, C, D, K, Ts, `NoiseVariance`,
    /// `InputName`, `OutputName` and the offsets and scales of the channels, all in full precision,
    /// and from it `name_idss` and `name_ss` where the toolboxes for `idss` and `ss` are there. The
    /// last `MeasuredDisturbances` inputs are measured disturbances.
    ///
    /// # Errors
    /// `name` is not an ASCII letter followed by at most 55 letters, digits and underscores, or is
    /// a reserved word.
    pub fn to_matlab(&self, name: &str) -> Result<String, SysidError> {
        let letter = name.starts_with(|c: char| c.is_ascii_alphabetic());
        let rest = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !letter || !rest || name.len() > LONGEST_NAME || RESERVED.contains(&name) {
            return Err(SysidError::Setting {
                field: "name",
                found: format!("`{}`", name.escape_debug()),
                allowed: format!(
                    "name the variable by a letter and at most {} letters, digits and underscores, \
                     and not by a reserved word",
                    LONGEST_NAME - 1
                ),
            });
        }
        let inputs: Vec<&Channel> = self.inputs.iter().chain(&self.disturbances).collect();
        let outputs: Vec<&Channel> = self.outputs.iter().collect();
        let system = &self.matrices;
        let mut text = String::from(
            "% A discrete state-space model in innovation form, about its offsets:\n\
             %   x(k+1) = A x(k) + B (u(k) - InputOffset) + K e(k)\n\
             %   y(k)   = C x(k) + D (u(k) - InputOffset) + e(k) + OutputOffset\n\
             % y(k) is measured one sample time after u(k) began to act.\n",
        );
        let mut field = |field: &str, value: &str| {
            text = format!("{text}{name}.{field} = {value};\n");
        };
        for (letter, values) in [
            ("A", system.a.as_ref()),
            ("B", system.b.as_ref()),
            ("C", system.c.as_ref()),
            ("D", system.d.as_ref()),
            ("K", system.k.as_ref()),
            ("NoiseVariance", self.innovation_covariance()),
        ] {
            field(letter, &matrix(values));
        }
        field("Ts", &number(self.sample_time_s));
        for (kind, channels) in [("Input", &inputs), ("Output", &outputs)] {
            let names = channels.iter().map(|c| quoted(&c.name));
            let names = names.collect::<Vec<_>>().join("; ");
            field(&format!("{kind}Name"), &format!("{{{names}}}"));
            let column = |value: fn(&Channel) -> f64| {
                let values = channels.iter().map(|c| number(value(c)));
                format!("[{}]", values.collect::<Vec<_>>().join("; "))
            };
            field(&format!("{kind}Offset"), &column(|c| c.offset));
            field(&format!("{kind}Scale"), &column(|c| c.scale));
        }
        field("MeasuredDisturbances", &self.disturbances.len().to_string());
        let n = self.order();
        let built = write!(
            text,
            "% The toolboxes' own models; they are about the offsets, which stay in {name}.\n\
             if exist('idss') ~= 0\n  \
             {name}_idss = idss({name}.A, {name}.B, {name}.C, {name}.D, {name}.K, zeros({n}, 1), {name}.Ts);\n  \
             {name}_idss.NoiseVariance = {name}.NoiseVariance;\n  \
             {name}_idss.InputName = {name}.InputName;\n  \
             {name}_idss.OutputName = {name}.OutputName;\n\
             end\n\
             if exist('ss') ~= 0\n  \
             {name}_ss = ss({name}.A, {name}.B, {name}.C, {name}.D, {name}.Ts);\n  \
             {name}_ss.InputName = {name}.InputName;\n  \
             {name}_ss.OutputName = {name}.OutputName;\n\
             end\n"
        );
        debug_assert!(built.is_ok(), "writing to a string does not fail");
        Ok(text)
    }
}

/// The shortest decimal that reads back as the same number.
fn number(value: f64) -> String {
    format!("{value:e}")
}

fn matrix(values: MatRef<'_, f64>) -> String {
    if values.nrows() == 0 || values.ncols() == 0 {
        return format!("zeros({}, {})", values.nrows(), values.ncols());
    }
    let row = |i: usize| {
        let row = values.row(i);
        let numbers = row.iter().map(|&value| number(value));
        numbers.collect::<Vec<_>>().join(", ")
    };
    let rows: Vec<_> = (0..values.nrows()).map(row).collect();
    format!("[\n  {}\n]", rows.join(";\n  "))
}

/// A string of the language: quotes doubled, and characters that would end the line by number.
fn quoted(text: &str) -> String {
    let mut parts = vec![String::new()];
    for c in text.chars() {
        if c.is_control() {
            parts.push(format!("char({})", u32::from(c)));
            parts.push(String::new());
        } else if let Some(part) = parts.last_mut() {
            part.push(c);
            if c == '\'' {
                part.push(c);
            }
        }
    }
    // Every other part is text; the ones between are numbers.
    let texts = parts
        .iter()
        .enumerate()
        .map(|(index, part)| match index % 2 {
            0 => format!("'{part}'"),
            _ => part.clone(),
        });
    match parts.len() {
        1 => texts.collect(),
        _ => format!("[{}]", texts.collect::<Vec<_>>().join(", ")),
    }
}

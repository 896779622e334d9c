//! Figures on standard output: lines for people, or JSON for programs.

use scenecast_core::{UserError, out, outln};
use serde::Serialize;
use serde_json::Value;
use std::io::IsTerminal;

/// Prints figures: lines at a terminal, one line of JSON in a pipe or a file, or with `json` anywhere.
pub fn print_figures(figures: &impl Serialize, json: bool) -> Result<(), UserError> {
    let as_json = json || !std::io::stdout().is_terminal();
    let failed = |e: serde_json::Error| UserError::Failed(e.to_string());
    if as_json {
        // A struct keeps the order of its members only if it is written at once.
        outln!("{}", serde_json::to_string(figures).map_err(failed)?);
    } else {
        out!("{}", lines(&serde_json::to_value(figures).map_err(failed)?));
    }
    Ok(())
}

/// One line for each member with its name in words.
fn lines(figures: &Value) -> String {
    let members: Vec<(String, String)> = match figures.as_object() {
        Some(object) => object.iter().map(|(name, value)| (name.replace('_', " "), text(value))).collect(),
        None => vec![(String::new(), text(figures))],
    };
    let width = members.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    members.iter().map(|(name, value)| format!("{name:<width$}  {value}\n")).collect()
}

fn text(value: &Value) -> String {
    match value {
        Value::Null => "not known".to_owned(),
        Value::String(text) => text.clone(),
        Value::Number(number) if number.is_f64() => format!("{:.4}", number.as_f64().unwrap_or_default()),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_read_one_line_for_each_figure() {
        let figures =
            serde_json::json!({ "bytes": 70, "png_full_bytes": 1200, "nats": 0.5, "codec": "ours", "score": null });
        let expected = "bytes           70\ncodec           ours\nnats            0.5000\npng full bytes  1200\nscore           not known\n";
        assert_eq!(lines(&figures), expected);
    }
}

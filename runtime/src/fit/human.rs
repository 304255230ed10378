//! The outcome of a fit to read.

use std::fmt::Write;

use super::outcome::Outcome;
use crate::study::short;

/// A table of estimates, how good they are, and what to know before they are used.
pub fn human(o: &Outcome) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "fit {} of {} in {}: {} values of {}", o.fit, o.workflow, o.lab, o.values, o.data);
    let mut rows: Vec<[String; 4]> = vec![["", "estimate", "std error", "95 % interval"].map(str::to_string)];
    for e in &o.estimates {
        let name = if e.unit.is_empty() { e.name.clone() } else { format!("{} [{}]", e.name, e.unit) };
        let error = e.std_error.map_or_else(|| "not determined".to_string(), short2);
        let interval = e.low95.zip(e.high95).map_or_else(String::new, |(a, b)| format!("{} .. {}", short(a), short(b)));
        rows.push([name, matterix_ir::quantity::show_number(e.value), error, interval]);
    }
    let widths: Vec<usize> = (0..4).map(|i| rows.iter().map(|r| r[i].chars().count()).max().unwrap_or(0)).collect();
    out.push('\n');
    for row in &rows {
        let [name, value, error, interval] = row;
        let line = format!("  {name:<0$}  {value:>1$}  {error:>2$}  {interval}", widths[0], widths[1], widths[2]);
        let _ = writeln!(out, "{}", line.trim_end());
    }
    out.push('\n');
    let freedom = o.degrees_of_freedom;
    match (o.learnt_noise, o.chi2_per_degree) {
        (Some(noise), _) => {
            let _ =
                writeln!(out, "  noise estimated from the residuals: {} ({freedom} degrees of freedom)", short(noise));
        }
        (None, Some(v)) => {
            let _ = writeln!(out, "  chi2 per degree of freedom: {} ({freedom} of them)", short(v));
        }
        (None, None) => {
            let _ = writeln!(out, "  as many parameters as values: no residuals are left to judge the model");
        }
    }
    for (i, row) in o.correlation.iter().enumerate() {
        for (j, r) in row.iter().enumerate().skip(i + 1) {
            if let (Some(r), Some(a), Some(b)) = (r, o.estimates.get(i), o.estimates.get(j)) {
                let _ = writeln!(out, "  correlation of {} and {}: {r:.4}", a.name, b.name);
            }
        }
    }
    let _ = writeln!(out, "  {} runs; {} of {} starts led here", o.evaluations, o.agreed, o.starts);
    for note in &o.notes {
        let _ = writeln!(out, "\nnote: {note}");
    }
    out
}

/// Two significant digits, as errors have them.
fn short2(value: f64) -> String {
    let rounded: f64 = format!("{value:.1e}").parse().unwrap_or(value);
    matterix_ir::quantity::show_number(rounded)
}

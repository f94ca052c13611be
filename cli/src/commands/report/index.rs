//! The index of a folder of reports.

use lamp_pipeline::heights::time_text;
use maud::html;

use super::gather::StackReport;
use super::page::document;
use crate::terminal::progress::printable;

/// A line of the index.
pub(super) struct Entry {
    name: String,
    /// The page, or why it is missing.
    page: Result<Row, String>,
}

struct Row {
    file: String,
    layers: u64,
    top_mm: Option<f64>,
    volume_mm3: Option<f64>,
    build_s: Option<f64>,
    findings: Option<usize>,
    stray_rows: u64,
}

impl Entry {
    pub(super) fn of(report: &StackReport, file: String) -> Self {
        let totals = &report.totals;
        let page = Row {
            file,
            layers: totals.pages,
            top_mm: totals.top_mm(),
            volume_mm3: totals.volume_mm3,
            build_s: report.time.sum_s(),
            findings: report.found.as_ref().ok().map(|drawn| drawn.found.count()),
            stray_rows: totals.stray_rows,
        };
        Self { name: report.name.clone(), page: Ok(page) }
    }

    pub(super) fn faulty(name: String, why: String) -> Self {
        Self { name, page: Err(why) }
    }

    pub(super) fn is_faulty(&self) -> bool {
        self.page.is_err()
    }
}

/// Returns the name of a stack's page: its number and what of its name any system takes.
pub(super) fn file_name(number: usize, stack: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    // Names of files have 255 bytes on most systems. Numbers keep names apart that begin alike.
    let stem: String = stack.chars().take(60).map(plain).collect();
    format!("report_{number:03}_{stem}.html")
}

/// Returns the index: stacks that cannot be read first.
pub(super) fn html(entries: &[Entry]) -> String {
    let faults = entries.iter().filter_map(|entry| Some((entry, entry.page.as_ref().err()?)));
    let pages = entries.iter().filter_map(|entry| Some((entry, entry.page.as_ref().ok()?)));
    let faulty = entries.iter().filter(|entry| entry.is_faulty()).count();
    let known = |number: Option<String>| number.unwrap_or_else(|| "not known".to_owned());
    let content = html! {
        h1 { "Reports" }
        p.subtitle { (entries.len()) " stacks" }
        @if faulty > 0 {
            section.warnings {
                h2 { "Look at this first" }
                ul { @for (entry, why) in faults { li { b { (printable(&entry.name)) } ": " (printable(why)) } } }
            }
        }
        table.index {
            thead { tr {
                th { "stack" } th { "findings" } th { "stray rows" } th { "layers" } th { "top (mm)" }
                th { "volume (mm³)" } th { "build time" }
            } }
            tbody {
                @for (entry, row) in pages {
                    tr {
                        td { a href=(row.file) { (printable(&entry.name)) } }
                        td { (known(row.findings.map(|count| count.to_string()))) }
                        td { (row.stray_rows) }
                        td { (row.layers) }
                        td { (known(row.top_mm.map(|mm| format!("{mm:.3}")))) }
                        td { (known(row.volume_mm3.map(|mm3| format!("{mm3:.3}")))) }
                        td { (known(row.build_s.map(time_text))) }
                    }
                }
            }
        }
    };
    document("Reports", &content)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_pages_are_plain() {
        assert_eq!(file_name(7, "night/a <b>.tif"), "report_007_night_a__b__tif.html");
        assert_eq!(file_name(1000, "\u{202e}.."), "report_1000____.html");
    }
}

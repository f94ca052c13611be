//! The licenses of all that is in the program: `lamp --licenses`.

use crate::started;

/// The notices of the crates, as `licences/update` wrote them.
const CRATES: &str = include_str!("../../licences/notices.txt");

const OWN: &str = include_str!("../../licences/LICENSE-MIT");

const RULE: &str =
    "--------------------------------------------------------------------------------";

/// Whether the process is only to print [`licences`]. This is not a command, and clap wants one.
pub(crate) fn are_asked_for() -> bool {
    // Alone only: behind a command, it is an option of that.
    matches!(&started::words()[..], [_, word] if word == "--licenses" || word == "--licences")
}

/// Returns the name, version, license and notice of all that is in the program.
pub(crate) fn licences() -> String {
    let version = env!("CARGO_PKG_VERSION");
    let own = OWN.trim_end();
    let page = lamp_view::licences();
    let page = page.trim_end();
    format!(
        "lamp {version} (MIT OR Apache-2.0)\n\n{own}\n\n\
         {RULE}\nRoboto 2.138 (Apache-2.0), https://github.com/googlefonts/roboto-2\n\n\
         Copyright Google. The terms are the terms of ab_glyph, below.\n\n\
         {RULE}\n{page}\n\n{CRATES}"
    )
}

//! What to try on the command line when a library reports an error.
//!
//! Libraries state facts and know no options; this is the one place that adds them.

use std::error::Error;

use lamp_adaptive::HeightsError;

/// Returns what to try about an error, to stand after its message.
pub(crate) fn hint(error: &(dyn Error + 'static)) -> Option<String> {
    if let Some(error) = error.downcast_ref() {
        return heights(error);
    }
    None
}

fn heights(error: &HeightsError) -> Option<String> {
    match error {
        HeightsError::TooManyRows { .. } => Some("give a wider --row-pitch".to_owned()),
        _ => None,
    }
}

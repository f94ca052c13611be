//! Formats positions and excerpts of text files for messages.

use std::ops::Range;

/// Returns the line, from 1, at which a byte range begins, or 1 if there is no range.
pub fn line_of(text: &str, bytes: Option<Range<usize>>) -> usize {
    let before = bytes.map_or(0, |bytes| bytes.start);
    1 + text.bytes().take(before).filter(|&byte| byte == b'\n').count()
}

/// Joins a file's text to one line without control characters, which could control the
/// terminal.
pub fn one_line(text: &str) -> String {
    let clean: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    clean.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_counted_and_made_one() {
        assert_eq!([1..2, 2..3, 9..9].map(|bytes| line_of("a\nb\nc", Some(bytes))), [1, 2, 3]);
        assert_eq!(line_of("a\nb", None), 1);
        assert_eq!(one_line(" a\n\tb\u{1b}[2J "), "a b [2J");
    }
}

//! Words of commands as stacks record them, quoted as POSIX shells want it.

use std::borrow::Cow;

/// Returns a word as a shell reads it.
///
/// ```
/// use lamp_stack::{quoted, words};
///
/// assert_eq!(quoted("it's a part.stl"), r"'it'\''s a part.stl'");
/// assert_eq!(words(r"slice 'it'\''s a part.stl' --dpi 1500").unwrap()[1], "it's a part.stl");
/// ```
pub fn quoted(word: &str) -> Cow<'_, str> {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-_./:=,+@%".contains(letter);
    // Without quotes, an empty word would be none.
    if !word.is_empty() && word.chars().all(is_plain) {
        return Cow::Borrowed(word);
    }
    // POSIX knows no escape within single quotes (XCU 2.2.2), so they end and begin again.
    Cow::Owned(format!("'{}'", word.replace('\'', r"'\''")))
}

/// Returns a file's name as a word that no command takes for an option or for standard input.
pub fn file_word(name: &str) -> Cow<'_, str> {
    if name.starts_with('-') { Cow::Owned(format!("./{name}")) } else { Cow::Borrowed(name) }
}

/// Splits a command into its words. Quotes of either kind keep blanks; a backslash outside of them
/// keeps a blank, a quote or a backslash behind it, and stays where it is part of a path.
///
/// # Errors
/// Returns the quote that is not closed.
pub fn words(text: &str) -> Result<Vec<String>, char> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quote = None;
    let mut letters = text.chars();
    while let Some(letter) = letters.next() {
        match quote {
            Some(end) if letter == end => quote = None,
            Some(_) => word.get_or_insert_default().push(letter),
            None if letter.is_whitespace() => words.extend(word.take()),
            None if matches!(letter, '\'' | '"') => {
                quote = Some(letter);
                // Quotes with nothing between them make a word, too.
                word.get_or_insert_default();
            }
            None if letter == '\\' => {
                let kept = letters.clone().next().filter(|&next| is_special(next));
                word.get_or_insert_default().push(kept.unwrap_or(letter));
                if kept.is_some() {
                    letters.next();
                }
            }
            None => word.get_or_insert_default().push(letter),
        }
    }
    words.extend(word);
    quote.map_or(Ok(words), Err)
}

fn is_special(letter: char) -> bool {
    letter.is_whitespace() || matches!(letter, '\'' | '"' | '\\')
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn words_are_those_of_a_shell() {
        let words = |text: &str| words(text).unwrap();
        assert_eq!(words(" slice\t--dpi  1500 "), ["slice", "--dpi", "1500"]);
        assert_eq!(
            words(r#"edit 'my edits.toml' --a="b c"d '' e\ f C:\x"#),
            ["edit", "my edits.toml", "--a=b cd", "", "e f", "C:\\x"]
        );
        assert!(words("").is_empty());
        assert_eq!(super::words("slice 'a"), Err('\''));
        assert_eq!(["-a.tif", "a.tif"].map(file_word), ["./-a.tif", "a.tif"]);
        for (word, expected) in
            [("a/b-z15.tif", "a/b-z15.tif"), ("", "''"), ("$HOME", "'$HOME'"), ("a\\b", "'a\\b'")]
        {
            assert_eq!(quoted(word), expected);
        }
    }

    proptest! {
        #[test]
        fn quoted_words_come_back(all in prop::collection::vec("\\PC{0,9}|[ '\"\\\\@-]{0,9}", 0..5)) {
            let line: Vec<_> = all.iter().map(|word| quoted(word)).collect();
            prop_assert_eq!(words(&line.join(" ")), Ok(all));
        }
    }
}

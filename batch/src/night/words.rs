//! Splits a command line into words, as shells do.

/// Splits a text at blanks; quotes of either kind keep them.
///
/// # Errors
/// Returns what is wrong with it.
pub(super) fn split(text: &str) -> Result<Vec<String>, String> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quote = None;
    for letter in text.chars() {
        match quote {
            Some(end) if letter == end => quote = None,
            Some(_) => word.get_or_insert_default().push(letter),
            None if letter.is_whitespace() => words.extend(word.take()),
            None if matches!(letter, '\'' | '"') => {
                quote = Some(letter);
                word.get_or_insert_default();
            }
            None => word.get_or_insert_default().push(letter),
        }
    }
    words.extend(word);
    match quote {
        Some(quote) => Err(format!("the quote {quote} is not closed")),
        None => Ok(words),
    }
}

#[cfg(test)]
mod tests {
    use super::split;

    #[test]
    fn quotes_keep_blanks() {
        let words = |text| split(text).unwrap();
        assert_eq!(words(" slice\t--dpi  1500 "), ["slice", "--dpi", "1500"]);
        assert_eq!(
            words("edit 'my edits.toml' --a=\"b c\"d ''"),
            ["edit", "my edits.toml", "--a=b cd", ""]
        );
        assert!(words("").is_empty());
        assert!(split("fix 'a").unwrap_err().contains("not closed"));
    }
}

//! Secrets: one for each first address, and one for the cookie that replaces them.

use std::fmt;

/// 128 random bits that only the person who started the viewer knows.
pub struct Token([u8; 16]);

impl Token {
    /// Takes random bits from the system.
    ///
    /// # Errors
    /// Returns an error if the system has none.
    pub fn new() -> std::io::Result<Self> {
        let mut bits = [0; 16];
        getrandom::fill(&mut bits).map_err(std::io::Error::other)?;
        Ok(Self(bits))
    }

    /// Returns whether a text is the token, in a time that does not depend on how much of it is.
    pub(super) fn is(&self, text: &str) -> bool {
        let digits = self.to_string();
        let differs = digits.bytes().zip(text.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
        // The compiler must not leave the comparison at the first difference.
        std::hint::black_box(differs) == 0 && text.len() == digits.len()
    }
}

impl fmt::Display for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_differ_and_only_the_whole_one_is_it() {
        let token = Token::new().unwrap();
        let text = token.to_string();
        assert!(text.len() == 32 && text.bytes().all(|digit| digit.is_ascii_hexdigit()));
        assert!(token.is(&text));
        for wrong in ["", &text[1..], &format!("{text}0"), &text.to_uppercase().replace('A', "a")] {
            assert_eq!(token.is(wrong), wrong == text, "{wrong}");
        }
        assert!(!Token::new().unwrap().is(&text));
    }
}

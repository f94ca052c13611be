//! Reads ASCII STL as words: any number of solids, in any case, with any line breaks.

use std::io::{self, Read};

use crate::error::{AsciiFault, SliceError};
use crate::facet::Facet;
use crate::number::{NumberFault, NumberFormat};
use crate::read_note::ReadNote;
use crate::words::Words;

/// The facets of a text, and notes on skipped parts.
pub(crate) type ReadFacets = (Vec<Facet>, Vec<ReadNote>);

/// Reads the facets of all solids of an ASCII file, which `open` opens.
///
/// # Errors
/// Returns an error if it ends within a facet, has other words in one, or cannot be read.
pub(crate) fn read<R: Read>(open: impl Fn() -> R) -> Result<ReadFacets, SliceError> {
    match AsciiReader::new(open(), NumberFormat::default())?.read() {
        // Only all numbers together show the meaning of commas.
        Err(SliceError::Ascii { fault: AsciiFault::Comma, .. }) => {
            AsciiReader::new(open(), NumberFormat::with_commas())?.read()
        }
        read => read,
    }
}

/// A word with a meaning in STL.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Keyword {
    Solid,
    EndSolid,
    Facet,
    EndFacet,
    Normal,
    Outer,
    Loop,
    EndLoop,
    Vertex,
    /// It begins `end loop` and other keywords of two words.
    End,
}

impl Keyword {
    #[inline]
    fn of(word: &[u8]) -> Option<Self> {
        // No keyword has more than 8 letters. Longer words end here.
        let mut lower = [0; 8];
        let lower = lower.get_mut(..word.len())?;
        lower.copy_from_slice(word);
        lower.make_ascii_lowercase();
        Some(match &*lower {
            b"solid" => Self::Solid,
            b"endsolid" => Self::EndSolid,
            b"facet" => Self::Facet,
            b"endfacet" => Self::EndFacet,
            b"normal" => Self::Normal,
            b"outer" => Self::Outer,
            b"loop" => Self::Loop,
            b"endloop" => Self::EndLoop,
            b"vertex" => Self::Vertex,
            b"end" => Self::End,
            _ => return None,
        })
    }
}

/// Words that begin a property of a solid or a facet; words and numbers follow.
const PROPERTIES: [&[u8]; 5] = [b"color", b"colour", b"rgb", b"material", b"attribute"];

fn begins_with(word: &[u8], beginning: &[u8]) -> bool {
    word.len() >= beginning.len() && word[..beginning.len()].eq_ignore_ascii_case(beginning)
}

fn is_property(word: &[u8]) -> bool {
    PROPERTIES.iter().any(|property| word.eq_ignore_ascii_case(property))
}

fn is_comment(word: &[u8]) -> bool {
    matches!(word, [b'#' | b';' | b'!', ..] | [b'/', b'/', ..])
}

struct AsciiReader<R> {
    words: Words<R>,
    numbers: NumberFormat,
    facets: Vec<Facet>,
    notes: Vec<ReadNote>,
    /// Whether a solid has begun and not ended.
    is_in_solid: bool,
}

impl<R: Read> AsciiReader<R> {
    fn new(text: R, numbers: NumberFormat) -> io::Result<Self> {
        let (facets, notes) = (Vec::new(), Vec::new());
        Ok(Self { words: Words::new(text)?, numbers, facets, notes, is_in_solid: false })
    }

    fn read(mut self) -> Result<ReadFacets, SliceError> {
        while self.words.advance()? {
            match Keyword::of(self.words.word()) {
                Some(Keyword::Facet) => self.facet()?,
                Some(Keyword::Solid) => self.solid()?,
                Some(Keyword::EndSolid) => self.end_solid()?,
                Some(Keyword::End) => match self.next_keyword()? {
                    Some(Keyword::Solid) => self.end_solid()?,
                    // The file was cut off within `end solid`, after its last facet.
                    _ if self.words.word().is_empty() => {}
                    _ => return Err(self.unexpected("`facet` or `endsolid`")),
                },
                Some(_) => return Err(self.unexpected("`facet` or `endsolid`")),
                None => self.other_statement()?,
            }
        }
        if self.numbers.is_ambiguous() {
            return Err(self.failed(AsciiFault::Comma));
        }
        if self.numbers.has_commas {
            self.notes.push(ReadNote::DecimalCommas);
        }
        if self.is_in_solid && !self.facets.is_empty() {
            self.notes.push(ReadNote::NoEnd);
        }
        Ok((self.facets, self.notes))
    }

    fn failed(&self, fault: AsciiFault) -> SliceError {
        SliceError::Ascii { facet: self.facets.len(), fault }
    }

    /// Returns the fault of a word found where another should be.
    fn unexpected(&self, expected: &'static str) -> SliceError {
        let found = self.words.word();
        self.failed(if found.is_empty() {
            AsciiFault::CutOff
        } else {
            AsciiFault::Unexpected { found: AsciiFault::start_of(found), expected }
        })
    }

    fn next_keyword(&mut self) -> Result<Option<Keyword>, SliceError> {
        self.words.advance()?;
        Ok(Keyword::of(self.words.word()))
    }

    fn solid(&mut self) -> Result<(), SliceError> {
        self.is_in_solid = true;
        self.name()
    }

    fn end_solid(&mut self) -> Result<(), SliceError> {
        self.is_in_solid = false;
        self.name()
    }

    /// Skips the name of a solid: the rest of the line, or everything before a facet on it.
    fn name(&mut self) -> Result<(), SliceError> {
        while self.words.advance()? {
            if self.words.begins_line() {
                self.words.hold();
                break;
            }
            // A name may hold the word `facet`. Only the word after it shows where a facet begins.
            if Keyword::of(self.words.word()) != Some(Keyword::Facet) {
                continue;
            }
            let behind = self.next_keyword()?;
            let is_facet =
                matches!(behind, Some(Keyword::Normal | Keyword::Outer | Keyword::Vertex))
                    && !self.words.begins_line();
            self.words.hold();
            if is_facet {
                self.is_in_solid = true;
                return self.facet();
            }
        }
        Ok(())
    }

    /// Reads a facet after its first word.
    fn facet(&mut self) -> Result<(), SliceError> {
        if self.next_keyword()? == Some(Keyword::Normal) {
            // A normal has no meaning, and may not be a number.
            for _ in 0..3 {
                if self.next_keyword()?.is_some() {
                    break;
                }
            }
            if Keyword::of(self.words.word()).is_some() {
                self.words.hold();
            }
        } else {
            self.words.hold();
        }
        let mut facet = Facet::default();
        let (mut corners, mut has_loop, mut has_ended) = (0, false, false);
        loop {
            let mut keyword = self.next_keyword()?;
            if keyword == Some(Keyword::End) {
                keyword = match self.next_keyword()? {
                    Some(Keyword::Loop) => Some(Keyword::EndLoop),
                    Some(Keyword::Facet) => Some(Keyword::EndFacet),
                    _ => return Err(self.unexpected("`endloop` or `endfacet`")),
                };
            }
            match keyword {
                Some(Keyword::Vertex) if corners < 3 && !has_ended => {
                    facet[corners] = self.corner()?;
                    corners += 1;
                }
                Some(Keyword::Outer | Keyword::Loop) if corners == 0 && !has_loop => {
                    has_loop = true;
                    if keyword == Some(Keyword::Outer)
                        && self.next_keyword()? != Some(Keyword::Loop)
                    {
                        return Err(self.unexpected("`loop`"));
                    }
                }
                Some(Keyword::EndLoop) if corners == 3 && !has_ended => has_ended = true,
                Some(Keyword::EndFacet) if corners == 3 => {
                    self.facets.push(facet);
                    return Ok(());
                }
                None if is_comment(self.words.word()) => self.words.skip_line()?,
                None if is_property(self.words.word()) => self.property()?,
                _ if corners < 3 => return Err(self.unexpected("a `vertex`")),
                _ if has_ended => return Err(self.unexpected("`endfacet`")),
                _ => return Err(self.unexpected("`endloop`")),
            }
        }
    }

    #[inline]
    fn corner(&mut self) -> Result<[f32; 3], SliceError> {
        let mut corner = [0.0; 3];
        for number in &mut corner {
            self.words.advance()?;
            let word = self.words.word();
            *number = match self.numbers.parse(word) {
                Ok(number) => number,
                Err(NumberFault::Comma) => return Err(self.failed(AsciiFault::Comma)),
                Err(NumberFault::NoNumber) => return Err(self.unexpected("a number")),
            };
        }
        Ok(corner)
    }

    /// Skips a property after its first word: the rest of the line, or everything before an STL
    /// keyword on it.
    fn property(&mut self) -> Result<(), SliceError> {
        ReadNote::count_statement(&mut self.notes, self.words.word());
        while self.words.advance()? {
            if self.words.begins_line() || Keyword::of(self.words.word()).is_some() {
                self.words.hold();
                break;
            }
        }
        Ok(())
    }

    /// Skips a statement between facets that STL does not define.
    fn other_statement(&mut self) -> Result<(), SliceError> {
        if self.words.begins_padding() {
            let bytes = self.words.padding()?.ok_or_else(|| self.failed(AsciiFault::Zeros));
            self.notes.push(ReadNote::BytesAfter { bytes: bytes? });
            return Ok(());
        }
        let word = self.words.word();
        // Some names follow `solid` without a space.
        if begins_with(word, b"solid") {
            return self.solid();
        }
        if begins_with(word, b"endsolid") {
            return self.end_solid();
        }
        if is_comment(word) {
            return Ok(self.words.skip_line()?);
        }
        if is_property(word) {
            return self.property();
        }
        // A file cut off within `facet` lacks a facet; one cut off within `endsolid` lacks nothing.
        if self.words.ends_text() && b"facet".starts_with(&word.to_ascii_lowercase()) {
            return Err(self.failed(AsciiFault::CutOff));
        }
        let is_cut_end =
            self.words.ends_text() && b"endsolid".starts_with(&word.to_ascii_lowercase());
        if !is_cut_end {
            ReadNote::count_statement(&mut self.notes, word);
        }
        while self.words.advance()? {
            let keyword = Keyword::of(self.words.word());
            if self.words.begins_line() {
                self.words.hold();
                break;
            }
            // Facets are not skipped.
            if !matches!(keyword, None | Some(Keyword::Solid | Keyword::EndSolid | Keyword::End)) {
                return Err(self.unexpected("a line of another kind"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solid(name: &str) -> String {
        format!(
            "solid{name}\n facet normal 0 0 1\n outer loop\n vertex 0 0 0\n vertex 1e0 0 0\n \
             vertex 0 1.5 -2\n endloop\n endfacet\nendsolid{name}\n"
        )
    }

    const FACET: Facet = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.5, -2.0]];

    fn read_text(text: &str) -> Result<ReadFacets, String> {
        read(|| text.as_bytes()).map_err(|error| error.to_string())
    }

    fn facets_of(text: &str) -> Vec<Facet> {
        read_text(text).unwrap_or_else(|error| panic!("{error}: {text}")).0
    }

    fn notes_of(text: &str) -> Vec<String> {
        read_text(text).unwrap().1.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn several_solids_in_any_case_are_one_part() {
        let text = solid("") + &solid(" Two Words").to_uppercase() + "\r\n" + &solid(" c");
        assert_eq!(read_text(&text).unwrap(), (vec![FACET; 3], vec![]));
    }

    #[test]
    fn lines_break_anywhere() {
        let text = solid(" a facet endsolid") + &solid(" b");
        for text in [
            text.replace('\n', "\r"),
            text.replace('\n', "\r\n"),
            text.replace("\n vertex", " vertex"),
            text.replace("\n outer", " outer"),
            text.replace("1e0 0 0", "1e0\n0\n0"),
            text.replace(' ', "\t").replace("facet\tnormal", "facet\n\nnormal"),
            text.replace('\n', " "),
        ] {
            assert_eq!(facets_of(&text), [FACET; 2], "{text}");
        }
    }

    #[test]
    fn words_may_be_missing_or_apart() {
        let text = solid(" a");
        for text in [
            text.replace("endloop", "end loop").replace("endfacet", "end facet"),
            text.replace("endsolid", "END SOLID"),
            text.replace(" normal 0 0 1", ""),
            text.replace("normal 0 0 1", "normal"),
            text.replace("normal 0 0 1", "normal -nan(ind) 1.#QNAN"),
            text.replace(" outer loop\n", ""),
            text.replace(" outer", ""),
            text.replace(" endloop\n", ""),
            text.replace("solid a\n", ""),
            text.replace("endsolid a", "endsolid"),
            text.replace("solid a", "solid"),
            text.replace("solid a", "solid_a"),
            text.replace("1.5", "+15.0D-01").replace("1e0", "1,"),
        ] {
            assert_eq!(read_text(&text), Ok((vec![FACET], vec![])), "{text}");
        }
        let open = text.replace("endsolid a\n", "");
        assert_eq!(read_text(&open), Ok((vec![FACET], vec![ReadNote::NoEnd])));
    }

    #[test]
    fn comments_say_nothing_and_properties_are_noted() {
        let text = solid(" a");
        for comment in ["# a vertex 1", "// facet", "; x", "!"] {
            let text = text.replace('\n', &format!(" {comment}\n{comment}\n"));
            let text = format!("{comment}\n{text}");
            assert_eq!(read_text(&text), Ok((vec![FACET], vec![])), "{text}");
        }
        let colors = text.replace('\n', "\ncolor 0.1 0.2 red\n");
        assert_eq!(facets_of(&colors), [FACET]);
        assert_eq!(notes_of(&colors), ["9 statements that begin with `color` are left out"]);
        let colors = text.replace("1 0 0", "1 0 0 COLOR 1 2 3").replace('\n', " ");
        assert_eq!(facets_of(&colors), [FACET]);
        let more = text + "made by a program\n";
        assert_eq!(notes_of(&more), ["1 statement that begins with `made` is left out"]);
    }

    #[test]
    fn padding_is_counted() {
        for (padding, note) in [
            ("\0\0\0\0 \n\0", "5 bytes after the last facet are left out"),
            ("\u{1a}", "1 byte after the last facet is left out"),
        ] {
            let text = solid(" a") + padding;
            assert_eq!(facets_of(&text), [FACET]);
            assert_eq!(notes_of(&text), [note]);
            let within = text + &solid(" b");
            assert!(read_text(&within).is_err(), "{within:?}");
        }
    }

    #[test]
    fn decimal_commas_are_read_where_nothing_else_is_meant() {
        let text = solid(" a").replace("1.5", "1,5");
        assert_eq!(facets_of(&text), [FACET]);
        assert_eq!(notes_of(&text), ["commas in its numbers are read as decimal points"]);
        let ambiguous = text.replace("1,5", "1,500");
        assert!(read_text(&ambiguous).unwrap_err().contains("commas"));
        assert!(read_text(&text.replace("-2", "-2.0")).is_err());
    }

    #[test]
    fn a_text_cut_within_a_facet_is_refused() {
        let text = solid(" a") + &solid(" b");
        let end = text.rfind("endfacet").unwrap() + "endfacet".len();
        let begin = text.rfind("facet normal").unwrap();
        for length in begin + 1..end {
            let message = read_text(&text[..length]).unwrap_err();
            assert!(message.starts_with("facet 1 "), "{length}: {message}");
        }
        for length in end..text.rfind("endsolid").unwrap() + "endsolid".len() - 1 {
            assert_eq!(read_text(&text[..length]), Ok((vec![FACET; 2], vec![ReadNote::NoEnd])));
        }
    }

    #[test]
    fn a_refusal_is_short_however_long_the_line() {
        for bad in ["endloop\u{8}".repeat(90), "endloop ".repeat(9000), "9".repeat(9000)] {
            let text = solid(" a").replace("endloop", &bad);
            let message = read_text(&text).unwrap_err();
            assert!(message.starts_with("facet 0 ") && message.len() < 300, "{message}");
        }
    }

    #[test]
    fn other_words_in_facets_are_refused() {
        let text = solid(" a");
        for (from, to) in [
            ("outer", "inner"),
            ("vertex 1", "corner 1"),
            ("vertex 1", "vertex x"),
            ("vertex 1e0 0 0", "vertex 1e0 0"),
            ("vertex 1e0 0 0", "vertex 1e0 0 0 0"),
            ("endloop", "vertex 0 0 0 endloop"),
            (" endfacet\n", ""),
            ("facet normal 0 0 1", "facet 0 0 1"),
            ("solid a\n facet", "solid a\n x facet"),
            ("solid a\n", "solid a\n vertex 0 0 0\n"),
        ] {
            let broken = text.replacen(from, to, 1);
            assert_ne!(broken, text);
            assert!(read_text(&broken).is_err(), "{broken}");
        }
    }
}

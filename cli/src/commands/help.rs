//! `lamp help`: prints pages of the book, and the help of commands.

use std::fmt::Write as _;
use std::io;

use anstream::{AutoStream, ColorChoice};
use clap::builder::styling::{AnsiColor, Style};
use clap::{Args, CommandFactory};
use lamp_pipeline::documents::nearest;

use crate::Lamp;
use crate::exit::Exit;
use crate::streams::print;
use crate::terminal::help::{LAMP, formed};

/// The pages of the book: names and texts.
const PAGES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/pages.rs"));

/// The book's list of its pages.
const SUMMARY: &str = include_str!(concat!(env!("OUT_DIR"), "/SUMMARY.md"));

/// The most columns of text, which is hard to read in long lines.
const MOST_COLUMNS: usize = 100;

/// Print a page of the book, such as printers or json
///
/// lamp help topics lists the pages. A command without a page gets its --help.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp help topics
  lamp help printers
  lamp help plan voxels")]
pub(crate) struct HelpArgs {
    /// A page or a command [default: the commands]
    #[arg(value_name = "TOPIC")]
    topic: Vec<String>,
}

pub(crate) fn run(args: &HelpArgs) -> Result<(), Exit> {
    let topic = args.topic.join(" ").to_lowercase();
    if topic.is_empty() {
        return print(LAMP);
    }
    let is_styled = AutoStream::choice(&io::stdout()) != ColorChoice::Never;
    let columns = terminal_size::terminal_size().map_or(80, |(width, _)| width.0.into());
    let form = Form { columns: columns.clamp(40, MOST_COLUMNS), is_styled };
    if topic == "topics" {
        return print(&topics());
    }
    if let Some((name, text)) = PAGES.iter().find(|(name, _)| *name == topic) {
        let mut page = form.page(text, name);
        if command(&args.topic[..1]).is_some() {
            let _ = writeln!(page, "\nlamp {name} --help lists its options.");
        }
        return print(&page);
    }
    if let Some(mut command) = command(&args.topic) {
        let help = command.render_long_help();
        return print(&if is_styled { help.ansi().to_string() } else { help.to_string() });
    }
    Err(Exit::usage(format!("no page or command is called {topic}: {}", near(&topic))))
}

/// Returns the command of these words, with its name as it is called.
fn command(words: &[String]) -> Option<clap::Command> {
    let mut lamp = formed(Lamp::command());
    lamp.build();
    words.iter().try_fold(lamp, |command, word| command.find_subcommand(word).cloned())
}

/// Returns advice for a topic that is not there: the page that is meant, or pages with a section of
/// this name.
fn near(topic: &str) -> String {
    if let Some(name) = nearest(topic, PAGES.iter().map(|(name, _)| *name)) {
        return format!("did you mean {name}?");
    }
    let has_section = |text: &str| {
        let mut sections = text.lines().filter(|line| line.starts_with('#'));
        sections.any(|section| section.to_lowercase().contains(topic))
    };
    let pages = PAGES.iter().filter(|(_, text)| has_section(text));
    let names: Vec<_> = pages.map(|(name, _)| format!("lamp help {name}")).collect();
    match names.is_empty() {
        true => "lamp help topics lists the pages".to_owned(),
        false => format!("see {}", names.join(", ")),
    }
}

/// Returns the list of pages: each part of the book, with the names and titles of its pages.
fn topics() -> String {
    let mut text = String::new();
    for line in SUMMARY.lines().skip(1) {
        if let Some(part) = line.strip_prefix("# ") {
            let _ = writeln!(text, "\n{part}:");
        }
        let link = line.split_once('[').and_then(|(_, link)| link.split_once("]("));
        if let Some((title, file)) = link
            && let Some((name, _)) = file.split_once(".md")
            && PAGES.iter().any(|(page, _)| *page == name)
        {
            let _ = writeln!(text, "  {name:<18}{title}");
        }
    }
    text.trim_start_matches('\n').to_owned()
}

/// How a page is printed.
#[derive(Clone, Copy)]
struct Form {
    columns: usize,
    /// Whether headings, code and emphasis have the styles of terminals.
    is_styled: bool,
}

/// How a sign looks.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Look {
    Plain,
    Code,
    Strong,
    Emphasis,
}

type Signs = Vec<(char, Look)>;

impl Form {
    /// Returns a page of the book as text. It knows the part of Markdown that the book uses.
    fn page(self, markdown: &str, name: &str) -> String {
        let mut text = String::new();
        let mut links = Vec::new();
        let mut lines = markdown.lines().peekable();
        while let Some(line) = lines.next() {
            let body = line.trim_start();
            let indent = line.len() - body.len();
            if body.starts_with("```") {
                let code = lines.by_ref().take_while(|line| !line.trim_start().starts_with("```"));
                code.for_each(|code| writeln!(text, "    {code}").unwrap_or_default());
            } else if indent >= 4 || body.is_empty() {
                let _ = writeln!(text, "{line}");
            } else if line.starts_with('#') {
                let heading = without_links(line.trim_start_matches('#').trim(), &mut links);
                let strong: Signs = heading.chars().map(|sign| (sign, Look::Strong)).collect();
                let _ = writeln!(text, "{}", self.shown(&strong));
            } else if body.starts_with('|') {
                let mut rows = vec![self.cells(body, &mut links)];
                while let Some(row) = lines.next_if(|line| line.trim_start().starts_with('|')) {
                    rows.push(self.cells(row, &mut links));
                }
                self.table(&mut text, &rows);
            } else if body.starts_with("![") || body.starts_with("<img") {
                text += "(A picture is in the book.)\n";
            } else {
                let mut paragraph = body.to_owned();
                while let Some(next) = lines.next_if(|line| goes_on(line)) {
                    paragraph += &format!(" {}", next.trim());
                }
                let hang = if body.starts_with("- ") { 2 } else { number_width(body) };
                let paragraph = self.looks(&without_links(&paragraph, &mut links));
                for (place, line) in self.broken(&paragraph, indent, hang).iter().enumerate() {
                    let blanks = if place == 0 { indent } else { indent + hang };
                    let _ = writeln!(text, "{:blanks$}{}", "", self.shown(line));
                }
            }
        }
        links.retain(|link| link != name && PAGES.iter().any(|(page, _)| page == link));
        links.sort_unstable();
        links.dedup();
        let mut text = text.trim_end().to_owned() + "\n";
        if !links.is_empty() {
            let links = self.looks(&format!("See also: lamp help {}", links.join(", ")));
            for line in self.broken(&links, 0, 2) {
                let _ = write!(text, "\n{}", self.shown(&line));
            }
            text.push('\n');
        }
        text
    }

    /// Adds a table. A column has room for its longest word, and columns share what is left of a line.
    fn table(self, text: &mut String, rows: &[Vec<Signs>]) {
        let is_rule = |row: &[Signs]| row.iter().flatten().all(|(sign, _)| "-: ".contains(*sign));
        let rows: Vec<_> = rows.iter().filter(|row| !is_rule(row)).collect();
        let count = rows.iter().map(|row| row.len()).max().unwrap_or(0);
        let longest_word =
            |cell: &Signs| cell.split(|(sign, _)| *sign == ' ').map(<[_]>::len).max().unwrap_or(0);
        let widest = |column: usize, width: &dyn Fn(&Signs) -> usize| {
            rows.iter().filter_map(|row| row.get(column)).map(width).max().unwrap_or(0).max(1)
        };
        let least: Vec<_> = (0..count).map(|column| widest(column, &longest_word)).collect();
        let mut widths: Vec<_> = (0..count).map(|column| widest(column, &Vec::len)).collect();
        let gaps = 2 * count.saturating_sub(1);
        let mut left = self.columns.saturating_sub(gaps + least.iter().sum::<usize>());
        let mut order: Vec<_> = (0..count).collect();
        order.sort_by_key(|&column| widths[column] - least[column]);
        for (done, column) in order.into_iter().enumerate() {
            let more = (widths[column] - least[column]).min(left / (count - done));
            widths[column] = least[column] + more;
            left -= more;
        }
        for row in rows {
            let cell =
                |(cell, &columns): (&Signs, &usize)| Self { columns, ..self }.broken(cell, 0, 0);
            let cells: Vec<_> = row.iter().zip(&widths).map(cell).collect();
            for line in 0..cells.iter().map(Vec::len).max().unwrap_or(0) {
                let mut out = String::new();
                for (cell, width) in cells.iter().zip(&widths) {
                    let signs = cell.get(line).map_or(&[][..], Vec::as_slice);
                    out += &self.shown(signs);
                    out += &" ".repeat(width.saturating_sub(signs.len()) + 2);
                }
                let _ = writeln!(text, "{}", out.trim_end());
            }
        }
    }

    /// Returns the cells of a table's row.
    fn cells(self, row: &str, links: &mut Vec<String>) -> Vec<Signs> {
        let row = without_links(row.trim().trim_start_matches('|').trim_end_matches('|'), links);
        // A bar within a cell has a backslash.
        let cells = row.replace("\\|", "\0");
        cells.split('|').map(|cell| self.looks(&cell.trim().replace('\0', "|"))).collect()
    }

    /// Returns the signs of a text, without the marks of their looks. Without styles, the marks of code
    /// stay.
    fn looks(self, text: &str) -> Signs {
        let mut signs = Signs::new();
        let mut look = Look::Plain;
        let mut rest = text.chars().peekable();
        let mut last = ' ';
        while let Some(sign) = rest.next() {
            let is_word_next = rest.peek().is_some_and(|next| !next.is_whitespace());
            let turned = match (sign, look) {
                ('`', Look::Code) => Some(Look::Plain),
                ('`', _) => Some(Look::Code),
                (_, Look::Code) => None,
                ('*', Look::Strong) if rest.next_if_eq(&'*').is_some() => Some(Look::Plain),
                ('*', Look::Emphasis) if !last.is_whitespace() => Some(Look::Plain),
                ('*', Look::Plain) if rest.next_if_eq(&'*').is_some() => Some(Look::Strong),
                ('*', Look::Plain) if is_word_next && !last.is_alphanumeric() => {
                    Some(Look::Emphasis)
                }
                _ => None,
            };
            match turned {
                Some(turned) if sign == '`' && !self.is_styled => {
                    signs.push(('`', Look::Code));
                    look = turned;
                }
                Some(turned) => look = turned,
                None if sign == '\\' && look != Look::Code => {
                    signs.extend(rest.next().map(|sign| (sign, look)));
                }
                None => signs.push((sign, look)),
            }
            last = sign;
        }
        signs
    }

    /// Breaks a text into lines, of which the first is `indent` and the others `indent + hang` narrower
    /// than the form.
    fn broken(self, text: &[(char, Look)], indent: usize, hang: usize) -> Vec<Signs> {
        let mut lines = vec![Signs::new()];
        for word in text.split(|(sign, _)| *sign == ' ').filter(|word| !word.is_empty()) {
            let blanks = if lines.len() == 1 { indent } else { indent + hang };
            let line = lines.last_mut().expect("there is one");
            if line.is_empty() {
                line.extend(word);
            } else if blanks + line.len() + 1 + word.len() <= self.columns {
                // A blank within code or emphasis belongs to it.
                let look = line.last().filter(|(_, look)| *look == word[0].1);
                line.push((' ', look.map_or(Look::Plain, |(_, look)| *look)));
                line.extend(word);
            } else {
                lines.push(word.to_vec());
            }
        }
        lines
    }

    /// Returns signs with their looks.
    fn shown(self, signs: &[(char, Look)]) -> String {
        let mut text = String::new();
        for same in signs.chunk_by(|(_, a), (_, b)| a == b) {
            let style = match same[0].1 {
                Look::Plain => Style::new(),
                Look::Code => AnsiColor::Cyan.on_default(),
                Look::Strong => Style::new().bold(),
                Look::Emphasis => Style::new().italic(),
            };
            let style = if self.is_styled { style } else { Style::new() };
            let words: String = same.iter().map(|(sign, _)| sign).collect();
            let _ = write!(text, "{style}{words}{style:#}");
        }
        text
    }
}

/// Returns the width of an item's number with what follows it, such as `1. `, or 0.
fn number_width(line: &str) -> usize {
    let number = line.split_once(". ").map_or("", |(number, _)| number);
    let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    if is_number { number.len() + 2 } else { 0 }
}

/// Returns whether a line goes on with the paragraph above it.
fn goes_on(line: &str) -> bool {
    let body = line.trim_start();
    let is_item = body.starts_with("- ") || number_width(body) > 0;
    !(body.is_empty() || is_item || body.starts_with(['|', '#']) || body.starts_with("```"))
}

/// Returns a text with only the words of its links, and adds the names of the pages that they lead to.
fn without_links(text: &str, links: &mut Vec<String>) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("](") {
        let mut depth = 0;
        // The words of a link may have brackets of their own.
        let start = before.rfind(|sign| {
            depth += i32::from(sign == ']') - i32::from(sign == '[');
            depth < 0
        });
        let (Some(start), Some((target, tail))) = (start, after.split_once(')')) else { break };
        out += &before[..start];
        out += &before[start + 1..];
        let page = target.split('#').next().and_then(|file| file.strip_suffix(".md"));
        links.extend(page.map(str::to_owned));
        rest = tail;
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Form = Form { columns: 40, is_styled: false };

    #[test]
    fn pages_become_text() {
        let page = "# A page\n\nRead **this** and [`[times]` of *tile*](tile.md#times), which\ngoes on.\n\n\
                    - one item that is longer than a line has room\n  for it\n- two\n\n    $ code *as it is*\n\n\
                    | key | meaning |\n|---|---|\n| `a` | the first [of](json.md) all keys that this table has |\n\
                    | `b\\|c` | 2 * 3 |\n";
        let text = "A page\n\nRead this and `[times]` of tile, which\ngoes on.\n\n\
                    - one item that is longer than a line\n  has room for it\n- two\n\n    $ code *as it is*\n\n\
                    key    meaning\n`a`    the first of all keys that this\n       table has\n`b|c`  2 * 3\n\n\
                    See also: lamp help json, tile\n";
        assert_eq!(PLAIN.page(page, "mine"), text);
        let styled = Form { is_styled: true, ..PLAIN }.page(page, "mine");
        assert!(styled.contains("\u{1b}[1mA page\u{1b}[0m"), "{styled:?}");
        assert!(
            !styled.contains('`') && styled.contains("Read \u{1b}[1mthis\u{1b}[0m and"),
            "{styled:?}"
        );
    }

    #[test]
    fn all_pages_are_there_and_fit_their_columns() {
        assert!(topics().contains("  printers          Printers with a panel\n"), "{}", topics());
        for (name, markdown) in PAGES {
            assert!(topics().contains(&format!("  {name} ")), "{name}");
            let text = Form { columns: 80, is_styled: false }.page(markdown, name);
            let is_code = |line: &str| line.starts_with("    ");
            for line in text.lines().filter(|line| !is_code(line)) {
                // The longest words of a table's columns may need more, and a word may be a line.
                let most = if line.trim().contains("  ") { 100 } else { 80 };
                let is_word = !line.trim().contains(' ');
                assert!(line.chars().count() <= most || is_word, "{name}: {line}");
                assert!(!line.contains("]("), "{name}: {line}");
            }
        }
    }

    #[test]
    fn a_wrong_topic_gets_a_page_that_is_near() {
        assert_eq!(near("printer"), "did you mean printers?");
        assert!(near("elephant").contains("topics"), "{}", near("elephant"));
        assert_eq!(near("how long it takes"), "see lamp help tile");
    }
}

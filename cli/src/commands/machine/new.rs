//! `lamp machine new`: makes a machine's file from a few answers.

use std::fs;
use std::io::{self, BufRead, IsTerminal, Write};
use std::path::PathBuf;

use anyhow::{Context, anyhow};
use clap::Args;
use lamp_machine::Machine;
use lamp_pipeline::documents::own_folder;
use lamp_pipeline::heights::Seconds;
use lamp_stack::{Catalogued, Length, Pitch, Size};
use toml::Value;

use crate::args::options::{parse_thickness, parse_time};
use crate::exit::Exit;
use crate::streams::{print, write_file};
use crate::terminal::progress::printable;

#[derive(Args, Clone)]
pub(super) struct NewArgs {
    /// Its name, for --machine: small letters, digits and -
    #[arg(value_name = "NAME")]
    name: String,

    /// Build area, such as 100x60mm
    #[arg(long, value_name = "WxH")]
    area: Option<Size>,

    /// Height that it builds, such as 80mm
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness)]
    height: Option<Length>,

    /// Resolution or distance of its pixels, such as 1500 or 14x19um
    #[arg(long, alias = "pitch", value_name = "DPI")]
    dpi: Option<Pitch>,

    /// Usual thickness of layers, such as 50um
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness)]
    thickness: Option<Length>,

    /// Time from a layer's exposure to the next one's, such as 9s
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    recoat: Option<Seconds>,

    /// Exposure of layers that state none, such as 1.5s
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    expose: Option<Seconds>,

    /// Where the numbers are from
    #[arg(long, value_name = "TEXT", default_value = "measured")]
    source: String,

    /// Where to write the file [default: NAME.toml in the machines of your settings folder, where every
    /// command finds it by its name]
    #[arg(short, long, value_name = "FILE.toml")]
    output: Option<PathBuf>,

    /// Replace a file
    #[arg(long, alias = "overwrite")]
    force: bool,
}

pub(super) fn run(args: &NewArgs) -> Result<(), Exit> {
    let mut args = args.clone();
    let name = &args.name;
    if Machine::builtin(name).is_some() {
        return Err(Exit::usage(format!("{name} is a built-in machine: give yours another name")));
    }
    let unknown = || anyhow!("no settings folder is known here: name a file with -o");
    let is_own = args.output.is_none();
    let path = match args.output.take() {
        Some(path) => path,
        None => own_folder::<Machine>().with_context(unknown)?.join(format!("{name}.toml")),
    };
    if path.exists() && !args.force {
        let path = path.display();
        return Err(Exit::usage(format!("{path} exists: give --force to replace it")));
    }
    if io::stdin().is_terminal() && io::stderr().is_terminal() {
        args.ask(&mut io::stdin().lock(), &mut io::stderr()).context("the terminal")?;
    }
    let text = args.text()?;
    if let Some(folder) = path.parent().filter(|_| is_own) {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    write_file(&path, |out| out.write_all(text.as_bytes()))?;
    let path = path.display().to_string();
    let path = printable(&path);
    let word = if is_own { args.name.as_str() } else { &path };
    print(&format!(
        "{path}: add what else is known of it (docs/machines.md), and use --machine {word}\n"
    ))
}

impl NewArgs {
    /// Asks for the numbers that no option gives. An empty line leaves a number out.
    fn ask(&mut self, input: &mut dyn BufRead, output: &mut dyn Write) -> io::Result<()> {
        let mut asked = Questions { input, output };
        let parse_length = |text: &str| parse_thickness(text);
        asked.one("Build area, such as 100x60mm", &mut self.area, true, from_text)?;
        asked.one("Height that it builds, such as 80mm", &mut self.height, false, parse_length)?;
        asked.one("Resolution, such as 1500 or 14x19um", &mut self.dpi, false, from_text)?;
        let thickness = "Usual thickness of layers, such as 50um";
        asked.one(thickness, &mut self.thickness, false, parse_length)?;
        let recoat = "Time from a layer's exposure to the next one's, such as 9s";
        asked.one(recoat, &mut self.recoat, false, parse_time)?;
        let expose = "Exposure of layers that state none, such as 1.5s";
        asked.one(expose, &mut self.expose, false, parse_time)
    }

    /// Returns the text of the machine's file.
    fn text(&self) -> Result<String, Exit> {
        let Some(area) = self.area else {
            return Err(Exit::usage("the build area is missing: give --area, such as 100x60mm"));
        };
        let quoted = |text: &str| Value::String(text.to_owned()).to_string();
        let source = format!("source = {}\n", quoted(&self.source));
        let mut text = format!("name = {}\ndescription = \"\"\n", quoted(&self.name));
        text += &format!("\n[area]\nvalue = \"{area}\"\n{source}");
        if let Some(height) = self.height {
            text += &format!("\n[height]\nvalue = \"{height}\"\n{source}");
        }
        let times = [("recoat_s", self.recoat), ("expose_s", self.expose)];
        if times.iter().any(|(_, time)| time.is_some()) {
            text += "\n[times]\n";
            for (key, time) in times {
                text += &time.map_or(String::new(), |Seconds(s)| format!("{key} = {s}\n"));
            }
            text += &source;
        }
        if self.dpi.is_some() || self.thickness.is_some() {
            text += "\n[defaults]\n";
            text += &self.dpi.map_or(String::new(), |pitch| format!("pitch = \"{pitch}\"\n"));
            let thickness = self.thickness;
            text += &thickness.map_or(String::new(), |it| format!("thickness = \"{it}\"\n"));
        }
        Machine::from_toml(&text).map_err(|error| Exit::usage(error.to_string()))?;
        Ok(text)
    }
}

fn from_text<T: std::str::FromStr<Err: ToString>>(text: &str) -> Result<T, String> {
    text.parse().map_err(|error: T::Err| error.to_string())
}

/// Questions at a terminal.
struct Questions<'a> {
    input: &'a mut dyn BufRead,
    output: &'a mut dyn Write,
}

impl Questions<'_> {
    /// Asks for a value that is not there, until the answer is one, or is empty where it may be. The
    /// end of the input is an empty answer.
    fn one<T>(
        &mut self,
        question: &str,
        value: &mut Option<T>,
        is_needed: bool,
        parse: impl Fn(&str) -> Result<T, String>,
    ) -> io::Result<()> {
        let empty = if is_needed { "" } else { " (Enter if it is not known)" };
        while value.is_none() {
            write!(self.output, "{question}{empty}: ")?;
            self.output.flush()?;
            let mut line = String::new();
            let is_end = self.input.read_line(&mut line)? == 0;
            match line.trim() {
                "" if is_end || !is_needed => break,
                "" => {}
                answer => match parse(answer) {
                    Ok(answer) => *value = Some(answer),
                    Err(why) => writeln!(self.output, "{why}")?,
                },
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_make_a_machine() {
        let mut args = NewArgs {
            name: "mine".to_owned(),
            area: None,
            height: None,
            dpi: None,
            thickness: "50um".parse().ok(),
            recoat: None,
            expose: None,
            source: "stopwatch \"A\"".to_owned(),
            output: None,
            force: false,
        };
        let answers = "\n100 by 60\n100x60mm\n\n14x19um\n9\n9s\n1500ms\n";
        let mut shown = Vec::new();
        args.ask(&mut answers.as_bytes(), &mut shown).unwrap();
        let machine = Machine::from_toml(&args.text().unwrap()).unwrap();
        assert_eq!(machine.area.value, "100x60mm".parse().unwrap());
        assert_eq!((machine.height, machine.defaults.pitch), (None, "14x19um".parse().ok()));
        assert_eq!(machine.defaults.thickness, "50um".parse().ok());
        let times = machine.times.unwrap();
        assert_eq!((times.recoat_s, times.expose_s), (Some(9.0), Some(1.5)));
        assert_eq!(times.source, "stopwatch \"A\"");
        // The area is asked for three times, the time twice, and what is given never.
        let shown = String::from_utf8(shown).unwrap();
        assert_eq!(shown.matches("Build area").count(), 3, "{shown}");
        assert_eq!(shown.matches("next one's").count(), 2, "{shown}");
        assert!(!shown.contains("thickness"), "{shown}");

        args.area = None;
        args.ask(&mut io::empty(), &mut Vec::new()).unwrap();
        assert!(args.text().is_err());
    }
}

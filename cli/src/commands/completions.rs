//! `lamp completions`: prints what a shell needs to complete the commands.

use clap::Args;
use clap_complete::{Shell, generate};

use crate::exit::Exit;
use crate::programs;
use crate::streams::print;

/// Print the completions of lamp, slice, fix, dither and tile for a shell
///
/// Let the shell read them when it starts.
#[derive(Args)]
#[command(after_help = "\
Examples:
  echo 'source <(lamp completions bash)' >> ~/.bashrc
  echo 'source <(lamp completions zsh)' >> ~/.zshrc
  lamp completions fish > ~/.config/fish/conf.d/lamp.fish")]
pub(crate) struct CompletionsArgs {
    /// The shell
    shell: Shell,
}

pub(crate) fn run(args: &CompletionsArgs) -> Result<(), Exit> {
    let mut scripts = String::new();
    for (k, mut program) in programs().into_iter().enumerate() {
        let (name, mut script) = (program.get_name().to_owned(), Vec::new());
        generate(args.shell, &mut program, name, &mut script);
        let script = String::from_utf8(script).expect("names and help are text");
        // PowerShell takes such lines only at the top, where the first program has them.
        let wanted = |line: &&str| k == 0 || !line.starts_with("using namespace ");
        script.lines().filter(wanted).for_each(|line| scripts += &format!("{line}\n"));
    }
    print(&scripts)
}

//! Checks, before the work, that options go together and files are not written twice.

use std::path::{Path, PathBuf};

use crate::exit::Exit;
use crate::streams::{check_beside, check_not_input};
use lamp_plots as plots;

use super::TileArgs;

impl TileArgs {
    /// Checks, before the work, what can be checked.
    pub(super) fn check(&self) -> Result<(), Exit> {
        let counted = self.stacks.iter().any(|stack| stack.copies.is_some());
        if self.settings.copies.is_some() && (counted || self.stacks.len() > 1) {
            return Err(Exit::usage(
                "--copies is for one stack without a count: write blade.tif:120 core.tif:40",
            ));
        }
        if self.settings.layout.is_some() && counted {
            return Err(Exit::usage("--layout gives the number of copies: leave out the counts"));
        }
        if self.settings.shares && self.stacks.len() < 2 {
            return Err(Exit::usage(
                "--shares is for several stacks: one stack is placed as often as it fits anyway",
            ));
        }
        if let Some(name) = self.times.given().next()
            && !self.time
            && self.report.path().is_none()
        {
            return Err(Exit::usage(format!(
                "{name} counts in --time and --report: add one of them"
            )));
        }
        self.check_plan()?;
        self.settings.mesh.check()?;
        self.cut.check(
            self.output.as_ref(),
            self.time || self.report.is_printed() || self.recipe.is_some(),
        )?;
        let inputs = || {
            self.stacks
                .iter()
                .map(|stack| &stack.path)
                .chain(&self.settings.layout)
                .chain(&self.settings.machine)
                .chain(self.settings.mesh.file())
        };
        let output = self.output().map(|output| output.output);
        let main = output.as_ref().or(self.cut_folder()).or(self.recipe.as_ref());
        let main = main.map_or(Path::new("-"), PathBuf::as_path);
        output.as_deref().map_or(Ok(()), |output| self.report.check_output(output))?;
        self.check_by_products()?;
        for beside in self.layout_out.iter().chain(&self.layout_picture).chain(self.report.path()) {
            check_beside(beside, main, inputs())?;
        }
        if let (Some(output), Some(folder)) = (&output, self.cut_folder()) {
            check_beside(folder, output, inputs())?;
        }
        self.check_recipe(output.as_ref().or(self.cut_folder()), inputs())?;
        self.layout_picture.as_deref().map(plots::check_picture_name).transpose()?;
        let read = self
            .settings
            .layout
            .iter()
            .chain(&self.settings.machine)
            .chain(self.settings.mesh.file());
        check_not_input(main, read)
    }

    /// Checks that what is written beside the build goes to several files.
    fn check_by_products(&self) -> Result<(), Exit> {
        let files = self.layout_out.iter().chain(&self.layout_picture);
        let files: Vec<&PathBuf> = files.chain(self.report.path()).chain(&self.recipe).collect();
        for (k, file) in files.iter().enumerate() {
            check_beside(file, Path::new("-"), files[..k].iter().copied())?;
        }
        Ok(())
    }
}

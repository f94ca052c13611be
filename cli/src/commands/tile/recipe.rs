//! Writes the recipe of a build.

use std::fs::{self, File};
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, anyhow};
use lamp_build::{HeightOptions, Layout, MeshOptions, Recipe, RecipePart};
use lamp_machine::Machine;
use lamp_pipeline::documents::document_and_word;
use lamp_stack::digest_of;

use super::TileArgs;
use crate::exit::Exit;
use crate::streams::{check_beside, input_name, is_stream};

impl TileArgs {
    /// Returns whether a stack of the build is written, so that its images are needed.
    pub(super) fn needs_images(&self) -> bool {
        self.output().is_some() || self.cut_folder().is_some()
    }

    /// Checks, before the work, that a recipe can be written beside `main`, if that is written.
    pub(super) fn check_recipe<'a>(
        &'a self,
        main: Option<&PathBuf>,
        inputs: impl Iterator<Item = &'a PathBuf>,
    ) -> Result<(), Exit> {
        let Some(recipe) = &self.recipe else { return Ok(()) };
        if !self.needs_images()
            && let Some(option) = [
                ("--format", self.format.is_some()),
                ("--classic", self.classic),
                ("--packbits", self.packbits),
            ]
            .iter()
            .find_map(|(option, is_given)| is_given.then_some(option))
        {
            return Err(Exit::usage(format!(
                "{option} is for a stack, and --recipe by itself writes none: give it to lamp \
                 compose"
            )));
        }
        for stack in &self.stacks {
            let name = input_name(&stack.path);
            if is_stream(&stack.path) {
                return Err(Exit::usage(
                    "--recipe names the files of stacks, and standard input has none: write it to a \
                     file first",
                ));
            }
            if stack.path.is_dir() {
                return Err(Exit::usage(format!(
                    "--recipe names stacks that are one file, and {name} is a folder: lamp convert \
                     makes a file from it"
                )));
            }
        }
        check_beside(recipe, main.map_or(Path::new("-"), PathBuf::as_path), inputs)
    }

    /// Returns the recipe of a layout, if one is wanted.
    pub(super) fn recipe_of(
        &self,
        layout: &Layout,
        heights: HeightOptions,
        mesh: Option<&MeshOptions>,
    ) -> Result<Option<Recipe>, Exit> {
        let Some(path) = &self.recipe else { return Ok(None) };
        let parts = self.stacks.iter().map(|stack| part_of(&stack.path, path));
        let parts = parts.collect::<Result<Vec<_>, _>>()?;
        let recipe = Recipe::new(layout, parts, heights, mesh, self.layers.clone());
        Ok(Some(match &self.settings.machine {
            Some(machine) => recipe.for_machine(&document_and_word::<Machine>(machine)?.1),
            None => recipe,
        }))
    }
}

/// Returns a stack as a recipe names it.
fn part_of(stack: &Path, recipe: &Path) -> Result<RecipePart, Exit> {
    let named = || -> anyhow::Result<RecipePart> {
        let file = from_folder(folder_of(recipe), stack)?;
        let names: Option<Vec<&str>> = file.iter().map(|name| name.to_str()).collect();
        let names =
            names.ok_or_else(|| anyhow!("its name is not UTF-8 text, which recipes need"))?;
        Ok(RecipePart::new(names.join("/"), digest_of(File::open(stack)?)?))
    };
    Ok(named().with_context(|| input_name(stack))?)
}

fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Returns a file's name from a folder; a link keeps its name.
fn from_folder(folder: &Path, file: &Path) -> anyhow::Result<PathBuf> {
    let name = file.file_name().ok_or_else(|| anyhow!("this is no file"))?;
    let [from, to] = [fs::canonicalize(folder)?, fs::canonicalize(folder_of(file))?];
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    // Nothing leads from one drive to another.
    if shared == 0 {
        return Ok(to.join(name));
    }
    let up = from.components().skip(shared).map(|_| Component::ParentDir);
    Ok(up.chain(to.components().skip(shared)).collect::<PathBuf>().join(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_named_from_the_recipe_s_folder() {
        let root = tempfile::tempdir().unwrap();
        let path = |name: &str| root.path().join(name);
        fs::create_dir_all(path("a/b")).unwrap();
        fs::create_dir(path("c")).unwrap();
        let named = |recipe: &str, file: &str| {
            let file = path(file);
            fs::write(&file, "x").unwrap();
            let name = from_folder(folder_of(&path(recipe)), &file).unwrap();
            assert!(folder_of(&path(recipe)).join(&name).is_file());
            name.to_str().unwrap().to_owned()
        };
        assert_eq!(named("build.json", "x.tif"), "x.tif");
        assert_eq!(named("build.json", "a/b/x.tif"), "a/b/x.tif");
        assert_eq!(named("a/b/build.json", "c/x.tif"), "../../c/x.tif");
        assert_eq!(named("c/../a/build.json", "a/x.tif"), "x.tif");
    }
}

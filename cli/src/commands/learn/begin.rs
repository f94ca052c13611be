//! Begins a job.

use std::path::Path;

use anyhow::{Context, anyhow};
use lamp_grayscale::resin::ExposureTime;
use lamp_pipeline::documents::document;
use lamp_pipeline::glass::job_kind;
use lamp_planning::Light;
use lamp_planning::learn::{JobFile, digest_of_stack, profile_name};
use lamp_planning::speed::{PartPages, times_table};
use lamp_stack::{Destination, FolderBeside, Format, sealed, write_stack};

use super::KeptOptions;
use crate::args::options::InputArgs;
use crate::exit::Exit;
use crate::streams::{input_name, new_folder, read_layers};
use crate::terminal::progress::Progress;

/// Begins a job.
pub(super) fn begin(
    folder: &Path,
    stack: &Path,
    material: &Path,
    kept: &KeptOptions,
    progress: &Progress,
) -> Result<(), Exit> {
    let (material, lamp_doubt) = kept.lamp.material(document(material)?)?;
    lamp_doubt.iter().for_each(|doubt| progress.say(doubt));
    let light = Light::of(&material, kept.dose_at.unwrap_or_default())?;
    light.check().map_err(|error| Exit::Failed(error.into()).at(material.name.clone()))?;
    let name = input_name(stack);
    let input = InputArgs { stack: stack.to_owned(), layers: None };
    let wanted = kept.wanted.map_or(128, std::num::NonZeroU8::get);
    let mut pages = PartPages::new(wanted);
    let (mut part, mut origin_mm) = (String::new(), None);
    // The stack may be standard input: it is kept while it is read.
    let new = new_folder_of(folder)?;
    let file = new.path().join(JobFile::STACK);
    let layers = read_layers(&input, progress)?.map(|layer| -> Result<_, Exit> {
        let layer = layer?;
        if layer.info.exposure_ms.is_none() {
            let silent = anyhow!(
                "{} states no exposure, so no profile was printed: lamp plan speed gives \
                 times",
                layer.info.name()
            );
            return Err(Exit::Failed(silent).at(name.clone()));
        }
        if let Some(info) = &layer.info.stack {
            part.clone_from(&info.part);
        }
        origin_mm = origin_mm.or(layer.info.origin_mm);
        pages.push(layer.clone()).map_err(|error| Exit::from(error).at(name.clone()))?;
        progress.layer_done();
        Ok(layer)
    });
    let written = write_stack(layers, Destination::File(file.clone()), Format::Big);
    progress.done();
    written?;
    let digest = digest_of_stack(&file)?;
    // Only now, as the digest shows whether it is a job of the same stack.
    if folder.join(JobFile::NAME).exists() {
        return Err(refuse_second(folder, stack, &digest)?);
    }
    let part_pages = pages.finish().map_err(|error| Exit::from(error).at(name.clone()))?;
    let platform = kept.platform();
    let seconds: Vec<_> = part_pages
        .layers()
        .iter()
        .map(|layer| layer.time.map_or(0.0, |time| time.ms() / 1000.0))
        .collect();
    platform.check(part_pages.layers(), &seconds).map_err(|error| {
        let limits = "--speed and --max-change of the platform that prints, or plan other times";
        Exit::Failed(anyhow!("{error}: give {limits}")).at(name.clone())
    })?;
    let margin = kept.dose_margin.unwrap_or(0.05);
    let job = JobFile {
        part,
        digest,
        origin_mm,
        wanted,
        at: light.at,
        margin,
        slowest_um_per_s: platform.slowest,
        fastest_um_per_s: platform.fastest,
        max_change: platform.max_change,
    };
    let texts = || -> anyhow::Result<()> {
        let (job, material) = (job.to_text(), sealed(&material.to_toml()?));
        new.add(JobFile::NAME, |out| out.write_all(job.as_bytes()))?;
        new.add(JobFile::MATERIAL, |out| out.write_all(material.as_bytes()))?;
        let times = part_pages.layers().iter().map(|layer| layer.time.unwrap_or_default());
        let times: Vec<ExposureTime> = times.collect();
        let profile = sealed(&times_table(&part_pages, &times));
        Ok(new.add(&profile_name(0), |out| out.write_all(profile.as_bytes()))?)
    };
    texts().with_context(|| folder.display().to_string())?;
    new.persist().map_err(|error| Exit::Failed(error.into()).at(folder.display().to_string()))?;
    progress.say(&format!(
        "{} is begun: print 0 has the exposures of the stack's {} layers",
        folder.display(),
        part_pages.layers().len()
    ));
    Ok(())
}

/// A folder for a job, under another name at first. If there is a job, one that is never used.
fn new_folder_of(folder: &Path) -> Result<FolderBeside, Exit> {
    let already = folder.join(JobFile::NAME).exists();
    let unused = folder.join("begun-again");
    new_folder(if already { &unused } else { folder }, false)
}

/// Returns the reason why a job cannot be begun a second time.
fn refuse_second(folder: &Path, stack: &Path, digest: &str) -> Result<Exit, Exit> {
    let (folder, stack) = (folder.to_owned(), input_name(stack));
    if job_kind(&folder).is_some() {
        let folder = folder.display();
        let error = anyhow!("{folder} is the job of a plan of bitmaps: name another folder");
        return Ok(Exit::Failed(error));
    }
    let there = JobFile::read(&folder)?;
    let error = if there.digest == digest {
        anyhow!("{} is the job of {stack} already: leave out --start", folder.display())
    } else {
        let part = if there.part.is_empty() { "another stack" } else { &there.part };
        anyhow!(
            "{} is the job of {part}, whose stack is not {stack}: name another folder",
            folder.display()
        )
    };
    Ok(Exit::Failed(error))
}

//! Reads stages as they stand on a command line.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory, FromArgMatches};
use lamp_batch::{StageError, Stages};
use lamp_grayscale::material::Material;
use lamp_machine::Machine;

use lamp_pipeline::check::CheckSettings;
use lamp_pipeline::compensate::{CompensateSettings, Compensating};
use lamp_pipeline::documents::{Document, find_own, is_file};
use lamp_pipeline::edit::{EditSettings, Editing};
use lamp_pipeline::part_file::PartFile;
use lamp_pipeline::slice::SliceStage;
use lamp_pipeline::{Stage, StageChain};
use lamp_planning::speed::MOST_SPEED_MEMORY;
use lamp_supports::DesignRules;

use super::after::After;
use crate::Lamp;
use crate::args::arguments::{settings_of_machine, with_signed_values, words_left_open};
use crate::args::planning_options::PlanningOptions;
use crate::args::slicing::SliceStageArgs;
use crate::args::stages::{CompensateStageArgs, DitherStageArgs, EditStageArgs, FixStageArgs};
use crate::commands::check::CheckArgs;
use crate::commands::plan::speed::SpeedArgs;
use crate::commands::plan::voxels::VoxelsArgs;
use crate::commands::support::SupportArgs;
use crate::commands::tile::TileArgs;
use crate::exit::Exit;
use crate::streams::is_stream;
use crate::terminal::help::formed;
use crate::terminal::usage::sentence;

/// The stages that there are.
const STAGES: [&str; 8] =
    ["slice", "fix", "compensate", "dither", "edit", "support", "plan voxels", "plan speed"];

/// The name that stages of two words share.
const PLAN: &str = "plan";

/// The memory of a plan of gray levels, if the stage gives none. Levels depend on it a little, so it
/// must be the same on every machine.
const VOXELS_MEMORY: u64 = 2_000_000_000;

/// Options that make no sense in a list of stages, and what to do instead.
const REFUSED: [(&str, &str); 27] = [
    ("output", "leave out -o: results go where the whole list of stages sends them"),
    ("format", "leave out --format: results are stored packed"),
    ("classic", "leave out --classic: results are stored packed"),
    ("packbits", "leave out --packbits: results are stored packed"),
    ("force", "leave out --force: no existing file is replaced"),
    ("report", "leave out --report: findings are with the results"),
    ("json", "leave out --json: findings are with the results"),
    ("evidence", "leave out --evidence: run this stage by hand for pictures of its findings"),
    ("strict", "leave out --strict: findings are reported, and decide the status at the end"),
    ("layers", "leave out --layers: a part is cut into ranges of layers by itself"),
    ("options", "leave out --options: write its options into the stage"),
    ("plan", "leave out --plan: run lamp support by hand for its plan"),
    ("cell", "leave out --cell: run dither by hand, for cells look at layers far above and below"),
    ("variants", "leave out --variants: a part's stages make one stack"),
    ("vent", "leave out --vent: run lamp support by hand for holes that drain pockets"),
    ("avoid", "leave out --avoid: run lamp support by hand around surfaces to avoid"),
    ("stl", "leave out --stl: run lamp support by hand for only its supports"),
    (
        "strips",
        "leave out --strips: cut strips from the finished build, with lamp tile or lamp join",
    ),
    ("fields", "leave out --fields: cut fields from the finished build, with lamp tile"),
    ("recipe", "leave out --recipe: run lamp tile by hand for the recipe"),
    ("time", "leave out --time: run lamp tile by hand for the time of the build"),
    ("expose", "leave out --expose: run lamp tile by hand for the time of the build"),
    ("recoat", "leave out --recoat: run lamp tile by hand for the time of the build"),
    ("layout_out", "leave out --layout-out: run lamp tile by hand for the layout"),
    ("layout_picture", "leave out --layout-picture: run lamp tile by hand for the picture"),
    ("name", "leave out --name: a stack's part is named after its file"),
    ("part", "leave out --part: the part is the one that the stages are for"),
];

/// Options of plans that make no sense in a list of stages. They come before [`REFUSED`].
const REFUSED_IN_PLANS: [(&str, &str); 6] = [
    (
        "report",
        "leave out --report: report.html has the plan's lines; run lamp plan by hand for more",
    ),
    ("json", "leave out --json: report.html has the plan's lines; run lamp plan by hand for more"),
    ("plot", "leave out --plot: run lamp plan by hand for the plot"),
    ("map", "leave out --map: run lamp plan by hand for the map"),
    (
        "profile",
        "leave out --profile: pages have their times; run lamp plan speed by hand for the table",
    ),
    ("strict", "leave out --strict: report.html has the voxels that white light cannot cure"),
];

/// Reads stages. Files that options name stand in `folder`, unless their paths are absolute.
pub(crate) fn parse(stages: &[Vec<String>], folder: &Path) -> Result<Stages<After>, StageError> {
    let (mut slice, mut per_layer, mut after) = (None, Vec::new(), Vec::new());
    for (stage, words) in stages.iter().enumerate() {
        let first = words.first().map_or("", String::as_str);
        let refused = |why: String| StageError { stage, name: first.to_owned(), why };
        let (name, words) = match first {
            PLAN => plan_and_words(words).map_err(refused)?,
            _ => (first, &words[..]),
        };
        let refused = |why: String| StageError { stage, name: name.to_owned(), why };
        if !STAGES.contains(&name) {
            let stages = STAGES.join(", ");
            return Err(refused(format!("it is not a stage of a part: these are {stages}")));
        }
        let reader = StageReader::new(name, words, folder).map_err(refused)?;
        if (name == "slice") != (stage == 0) {
            return Err(refused(match stage {
                0 => "a part's first stage is slice".to_owned(),
                _ => "slice is a part's first stage, and its only one of that name".to_owned(),
            }));
        }
        match name {
            "slice" => slice = Some(reader.slice().map_err(refused)?),
            "support" => after.push(After::Support(reader.support())),
            "plan voxels" => after.push(After::Voxels(reader.voxels().map_err(refused)?)),
            "plan speed" => after.push(After::Speed(reader.speed().map_err(refused)?)),
            _ => {
                let stage = reader.per_layer(name).map_err(refused)?;
                // Stages after a stage of the whole stack work on the whole stack, too.
                if after.is_empty() {
                    per_layer.push(stage);
                } else {
                    after.push(After::Layers(stage));
                }
            }
        }
    }
    let none = || StageError {
        stage: 0,
        name: "stages".to_owned(),
        why: "there are no stages: a part needs at least slice".to_owned(),
    };
    Ok(Stages { chain: StageChain { slice: slice.ok_or_else(none)?, stages: per_layer }, after })
}

/// Returns the name of a plan's stage, and its words with its own name at the beginning.
fn plan_and_words(words: &[String]) -> Result<(&'static str, &[String]), String> {
    let kind = words.get(1).map_or("", String::as_str);
    let mut plans = STAGES.iter().filter_map(|stage| Some((stage, stage.strip_prefix("plan ")?)));
    match kind {
        _ if let Some((stage, _)) = plans.find(|(_, plan)| *plan == kind) => {
            Ok((stage, &words[1..]))
        }
        "column-cure" | "ecpl" => Err(format!(
            "{kind} plans a target on a glass, and takes no layers of a part: run lamp plan {kind} \
             by hand"
        )),
        "simulate" => Err("simulate shows bitmaps on a glass, and makes no layers of a part: run \
                           lamp plan simulate by hand"
            .to_owned()),
        _ => Err("write plan voxels for gray levels, or plan speed for times of layers".to_owned()),
    }
}

/// A stage's words, read.
struct StageReader<'a> {
    matches: ArgMatches,
    folder: &'a Path,
}

impl<'a> StageReader<'a> {
    fn new(name: &str, words: &[String], folder: &'a Path) -> Result<Self, String> {
        // Built once: a night may have hundreds of stages.
        static LAMP: OnceLock<clap::Command> = OnceLock::new();
        let lamp = LAMP.get_or_init(|| formed(Lamp::command()));
        let mut command = crate::stage(lamp, name);
        command.build();
        let mut words = with_signed_values(words.iter().map(OsString::from));
        // The words that the list of stages leaves out.
        match name {
            "slice" => words.push(PART.into()),
            "support" => words.push(format!("--part={PART}").into()),
            _ => {}
        }
        let matches = |words: &[OsString]| {
            // Help and version come as errors, too.
            command.clone().try_get_matches_from(words).map_err(|error| match error.use_stderr() {
                true => sentence(error),
                false => "help and version are for the command line".to_owned(),
            })
        };
        let mut found = matches(&words)?;
        check(&found, name)?;
        if name == "slice"
            && let Some(machine) = found.get_one::<PathBuf>("machine")
        {
            let settings = settings_of_machine(&placed::<Machine>(machine, folder))
                .map_err(|error| error.to_string())?;
            words.extend(words_left_open(&command, &found, &settings));
            // A machine's settings are words like others, so that the same parser checks them.
            found = matches(&words)?;
        }
        Ok(Self { matches: found, folder })
    }

    /// Returns the arguments of that command.
    fn read<T: FromArgMatches>(&self) -> T {
        T::from_arg_matches(&self.matches).expect("the words are of that command")
    }

    fn slice(&self) -> Result<SliceStage, String> {
        let said = |error: lamp_pipeline::Error| Exit::from(error).to_string();
        let args: SliceStageArgs = self.read();
        let mut stage = SliceStage::try_from(&args).map_err(|error| error.to_string())?;
        if stage.parts.len() > 1 {
            return Err("leave out the part's file: the stages are for one".to_owned());
        }
        // The word in the place of the part: each part of the night stands there later.
        stage.parts.clear();
        stage.machine.iter_mut().for_each(find_own::<Machine>);
        stage.settings.exposure.find_own();
        stage.named_mut().for_each(|path| *path = self.folder.join(&*path));
        // Materials and tables are read now: a slip in them must show before the night, not in it.
        stage.settings.exposure().map_err(said)?;
        Ok(stage)
    }

    fn voxels(&self) -> Result<Box<VoxelsArgs>, String> {
        let mut args: VoxelsArgs = self.read();
        args.memory.get_or_insert(VOXELS_MEMORY);
        self.check_planning(&mut args.planning)?;
        Ok(Box::new(args))
    }

    fn speed(&self) -> Result<Box<SpeedArgs>, String> {
        let mut args: SpeedArgs = self.read();
        // With more, a plan is the same.
        args.memory = Some(args.memory.unwrap_or(u64::MAX).min(MOST_SPEED_MEMORY));
        self.check_planning(&mut args.planning)?;
        Ok(Box::new(args))
    }

    /// Finds the material of a plan, and tries it: a slip in it must show before the night.
    fn check_planning(&self, planning: &mut PlanningOptions) -> Result<(), String> {
        find_own::<Material>(&mut planning.material);
        planning.file_mut().into_iter().for_each(|path| *path = self.folder.join(&*path));
        planning.resin().map(drop).map_err(|error| error.to_string())
    }

    fn support(&self) -> Box<SupportArgs> {
        let mut args: SupportArgs = self.read();
        args.machine = placed::<Machine>(&args.machine, self.folder);
        Box::new(args)
    }

    fn per_layer(&self, name: &str) -> Result<Stage, String> {
        let said = |error: lamp_pipeline::Error| Exit::from(error).to_string();
        let in_folder = |path: &mut PathBuf| *path = self.folder.join(&*path);
        Ok(match name {
            "fix" => Stage::Fix((&self.read::<FixStageArgs>()).into()),
            "dither" => Stage::Dither((&self.read::<DitherStageArgs>()).into()),
            "compensate" => {
                let mut settings = CompensateSettings::from(&self.read::<CompensateStageArgs>());
                settings.inputs_mut().for_each(find_own::<Material>);
                settings.inputs_mut().for_each(in_folder);
                // Tried now, as a night must not begin with a file that is wrong.
                Compensating::new(&settings).map_err(said)?;
                Stage::Compensate(settings)
            }
            _ => {
                let mut settings = EditSettings::from(&self.read::<EditStageArgs>());
                in_folder(settings.named_mut());
                Editing::new(&settings).map_err(said)?;
                Stage::Edit(settings)
            }
        })
    }
}

/// Reads the options of `tile`, without stacks.
pub(super) fn parse_tile(options: &[String], folder: &Path) -> Result<TileArgs, String> {
    let mut args: TileArgs = StageReader::new("tile", &with_name("tile", options), folder)?.read();
    args.settings.machine.iter_mut().for_each(find_own::<Machine>);
    args.settings.files_mut().for_each(|path| *path = folder.join(&*path));
    Ok(args)
}

/// Reads the options of `check`, without stacks.
pub(crate) fn parse_check(options: &[String], folder: &Path) -> Result<CheckSettings, String> {
    let args: CheckArgs = StageReader::new("check", &with_name("check", options), folder)?.read();
    let mut settings = CheckSettings::clone(&args.settings);
    settings.machine = placed::<Machine>(&settings.machine, folder);
    settings.rules = placed::<DesignRules>(&settings.rules, folder);
    // A slip in their files must show before the night.
    settings.machine().map_err(|error| Exit::from(error).to_string())?;
    settings.options(None).map_err(|error| Exit::from(error).to_string())?;
    Ok(settings)
}

fn with_name(name: &str, options: &[String]) -> Vec<String> {
    [name.to_owned()].into_iter().chain(options.iter().cloned()).collect()
}

/// A word in the place of the part.
const PART: &str = "part";

/// Refuses options that make no sense in a list of stages.
fn check(matches: &ArgMatches, name: &str) -> Result<(), String> {
    let ids: Vec<&str> = matches.ids().map(clap::Id::as_str).collect();
    let is_given =
        |id: &str| ids.contains(&id) && matches.value_source(id) == Some(ValueSource::CommandLine);
    // The word in the place of the part counts as one: only a second is somebody's.
    let of_part = |id: &str| {
        id == "part" && matches.get_many::<PartFile>(id).is_none_or(|parts| parts.len() < 2)
    };
    let is_plan = name.starts_with(PLAN);
    // Pages without an exposure need one to be planned.
    let of_plan = |id: &str| is_plan && id == "expose";
    let of_plans = REFUSED_IN_PLANS.iter().filter(|_| is_plan);
    let mut refused = of_plans.chain(REFUSED.iter().filter(|(id, _)| !of_plan(id)));
    let refused = refused.find(|(id, _)| is_given(id) && !of_part(id));
    if let Some((_, why)) = refused {
        return Err((*why).to_owned());
    }
    if is_given("stacks") || is_given("inputs") {
        return Err("leave out the stacks: its input is known".to_owned());
    }
    // Left out, it is `-`, which means the stage before.
    if ids.contains(&"stack")
        && let Some(stack) = matches.get_one::<PathBuf>("stack")
        && !is_stream(stack)
    {
        let stack = stack.display();
        return Err(match name {
            "edit" => format!("write edit - {stack}: it takes layers from the stage before"),
            _ => format!("leave out {stack}: it takes layers from the stage before"),
        });
    }
    Ok(())
}

/// Returns where a document's file stands, or the name of a built-in one.
fn placed<T: Document>(word: &Path, folder: &Path) -> PathBuf {
    let mut word = word.to_owned();
    find_own::<T>(&mut word);
    if is_file::<T>(&word) { folder.join(word) } else { word }
}

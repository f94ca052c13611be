//! Defines the notes of readers on a stack, besides its layers.

use std::fmt;

/// A note of a reader on a stack's file or folder: a reason to doubt that the layers belong to one
/// whole stack, or something that is left out because it is no layer.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StackNote {
    /// The numbers in the names of a folder's pages do not run on.
    Gaps(Vec<PageGap>),
    /// Pictures in a folder are no pages by their names, and are left out.
    OtherPictures(Vec<String>),
    /// The names of a folder's pages differ in more than a number. One name of each form.
    Forms(Vec<String>),
    /// Files in a folder are no pictures, and are left out.
    OtherFiles(Vec<String>),
    /// Images of TIFFs are no layers, and are left out.
    Images(ImagesBeside),
}

impl StackNote {
    /// Returns whether the note is a reason to doubt that the layers belong to one whole stack.
    pub fn is_doubt(&self) -> bool {
        match self {
            Self::Gaps(_) | Self::OtherPictures(_) | Self::Forms(_) => true,
            Self::OtherFiles(_) | Self::Images(_) => false,
        }
    }
}

/// Two pages of a folder between which the numbers in the names do not run on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageGap {
    /// The name of the page before the gap.
    pub before: String,
    /// The name of the page after it.
    pub after: String,
    /// The names of the first and the last page that would fill the gap, if the step of the other
    /// pages fills it.
    pub missing: Option<[String; 2]>,
}

/// The number of images in TIFFs that are no layers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImagesBeside {
    /// Images of reduced resolution.
    pub reduced: u64,
    /// Transparency masks.
    pub masks: u64,
    /// Images in directories below a page's directory.
    pub sub_images: u64,
}

impl ImagesBeside {
    /// Returns the number of all images.
    pub fn count(&self) -> u64 {
        // A file may claim any number of images below its pages.
        self.reduced.saturating_add(self.masks).saturating_add(self.sub_images)
    }

    /// Adds other images.
    pub(crate) fn add(&mut self, other: &Self) {
        let Self { reduced, masks, sub_images } = other;
        self.reduced = self.reduced.saturating_add(*reduced);
        self.masks = self.masks.saturating_add(*masks);
        self.sub_images = self.sub_images.saturating_add(*sub_images);
    }
}

/// The number of names or gaps that a message lists.
const LISTED: usize = 4;

impl fmt::Display for StackNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gaps(gaps) => {
                let gaps: Vec<String> = gaps.iter().map(ToString::to_string).collect();
                f.write_str(&listed(&gaps, "; "))
            }
            Self::OtherPictures(files) => {
                let noun = if files.len() == 1 {
                    "is left out: its name is not a page name"
                } else {
                    "are left out: their names are not page names"
                };
                write!(f, "{} {noun}", listed(files, ", "))
            }
            Self::Forms(files) => write!(
                f,
                "the names of the pages have several forms ({}): check that they are the pages of \
                 one stack, in the order of their names",
                listed(files, ", ")
            ),
            Self::OtherFiles(files) => {
                let noun = if files.len() == 1 {
                    "is left out: it is not a picture"
                } else {
                    "are left out: they are not pictures"
                };
                write!(f, "{} {noun}", listed(files, ", "))
            }
            Self::Images(images) => {
                let verb = if images.count() == 1 {
                    "is left out: it is not a layer"
                } else {
                    "are left out: they are not layers"
                };
                write!(f, "{images} {verb}")
            }
        }
    }
}

impl fmt::Display for PageGap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { before, after, missing } = self;
        match missing {
            Some([first, last]) if first == last => write!(f, "page {first} is missing")?,
            Some([first, last]) => write!(f, "pages {first} to {last} are missing")?,
            None => f.write_str("the page numbers do not continue")?,
        }
        write!(f, " ({after} follows {before})")
    }
}

impl fmt::Display for ImagesBeside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { reduced, masks, sub_images } = *self;
        let kinds = [
            (reduced, ["image of reduced resolution", "images of reduced resolution"]),
            (masks, ["transparency mask", "transparency masks"]),
            (sub_images, ["image in a subdirectory", "images in subdirectories"]),
        ];
        let kinds = kinds.into_iter().filter(|(count, _)| *count > 0);
        let kinds =
            kinds.map(|(count, words)| format!("{count} {}", words[usize::from(count > 1)]));
        f.write_str(&kinds.collect::<Vec<_>>().join(", "))
    }
}

/// Lists the first texts, and says how many follow.
fn listed(texts: &[String], between: &str) -> String {
    let more = match texts.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!("{between}and {more} more"),
    };
    texts.iter().take(LISTED).map(String::as_str).collect::<Vec<_>>().join(between) + &more
}

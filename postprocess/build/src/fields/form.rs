//! How builds are cut into fields, and the fields of a folder, as its index lists them.

use std::fmt;
use std::ops::Range;
use std::path::Path;

use lamp_stack::{FieldRecord, MAX_SIDE, PageInfo, StripRecord};

use super::index::{FieldIndex, MAX_FIELD_SIDE, MAX_FIELDS};
use super::{FieldDifference, Fields, FieldsError, Seam, Swaths};

/// How a build is cut into fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldForm {
    /// The width of a field in pixels; of a strip, the number of mirrors across.
    pub width: u32,
    /// The height of a field in pixels; none of strips, which are as high as the build.
    pub height: Option<u32>,
    /// The number of columns, and of rows, that a field shares with the next.
    pub overlap: u32,
    /// How they share them.
    pub seam: Seam,
}

/// The two kinds of fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldKind {
    /// One row of fields as high as the build, for a projector that scans.
    Strip,
    /// Rows and columns of fields, for a projector that steps.
    Field,
}

impl FieldKind {
    /// Both of them.
    pub(super) const ALL: [Self; 2] = [Self::Strip, Self::Field];

    /// Returns the name of a folder's index.
    pub(super) fn index(self) -> &'static str {
        match self {
            Self::Strip => "strips.json",
            Self::Field => "fields.json",
        }
    }
}

impl fmt::Display for FieldKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Strip => "strip",
            Self::Field => "field",
        })
    }
}

/// Where a field lies among the fields of a build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldPlace {
    /// The row of fields, from the top.
    pub row: u32,
    /// The column of fields, from the left.
    pub column: u32,
}

impl FieldForm {
    /// Reads how the fields of a folder were cut.
    ///
    /// # Errors
    /// Returns an error if the folder has no index, or a malformed one.
    pub fn of(folder: &Path) -> Result<Self, FieldsError> {
        Ok(FieldIndex::read(folder)?.fields.form())
    }

    /// Returns the fields of layers of this width and height.
    ///
    /// # Errors
    /// Returns an error if fields share half of a side or more, are larger than what is read again,
    /// or are too many to be written.
    pub fn fields(&self, [width, height]: [u32; 2]) -> Result<Fields, FieldsError> {
        let (overlap, seam) = (self.overlap, self.seam);
        let (across, down) = match self.height {
            None => (Swaths::new(self.width, overlap, width)?, Swaths::whole(height)),
            Some(rows) => {
                let size = [self.width, rows];
                let overlaps = |_| FieldsError::Overlap { size, overlap };
                (
                    Swaths::new(self.width, overlap, width).map_err(overlaps)?,
                    Swaths::new(rows, overlap, height).map_err(overlaps)?,
                )
            }
        };
        self.check_size()?;
        let fields =
            Fields { form: *self, across: across.with_seam(seam), down: down.with_seam(seam) };
        if fields.count() <= MAX_FIELDS { Ok(fields) } else { Err(too_many(&fields)) }
    }

    fn check_size(&self) -> Result<(), FieldsError> {
        match self.height {
            None if self.width > MAX_SIDE => {
                Err(FieldsError::Mirrors { mirrors: self.width, max: MAX_SIDE })
            }
            Some(height) if self.width.max(height) > MAX_FIELD_SIDE => {
                Err(FieldsError::LargeField { size: [self.width, height] })
            }
            _ => Ok(()),
        }
    }

    /// Returns what its fields are.
    pub fn kind(&self) -> FieldKind {
        if self.height.is_some() { FieldKind::Field } else { FieldKind::Strip }
    }

    /// Returns the name of a field's file.
    pub(super) fn file_name(&self, FieldPlace { row, column }: FieldPlace) -> String {
        // There are fewer than a thousand fields, so names sort as the fields lie.
        match self.kind() {
            FieldKind::Strip => format!("strip_{column:03}.tif"),
            FieldKind::Field => format!("field_{row:03}_{column:03}.tif"),
        }
    }

    /// Returns the command that a field's first page records.
    pub(super) fn command(&self, place: FieldPlace) -> String {
        let Self { width, height, overlap, seam } = self;
        let start = self.command_start(place);
        let command = match height {
            None => format!("{start}--mirrors {width} --overlap {overlap}"),
            Some(height) => format!("{start}--fields {width}x{height} --overlap {overlap}"),
        };
        // Fields that share nothing have no seam.
        if *overlap > 0 { format!("{command} --seam {seam}") } else { command }
    }

    /// Returns what the command of a field begins with.
    pub(super) fn command_start(&self, FieldPlace { row, column }: FieldPlace) -> String {
        match self.kind() {
            FieldKind::Strip => format!("strip {column} "),
            FieldKind::Field => format!("field {row},{column} "),
        }
    }

    /// Checks that a page says that it is of a field of this form, with its columns and rows of the
    /// build.
    pub(super) fn check(
        &self,
        page: &PageInfo,
        at: FieldPlace,
        [columns, rows]: [&Range<u32>; 2],
    ) -> Result<(), FieldDifference> {
        let [columns, rows] = [columns, rows].map(|range| [range.start, range.end]);
        let is_of = match self.kind() {
            FieldKind::Strip => page
                .record()
                .is_some_and(|of: StripRecord| (of.number, of.columns) == (at.column, columns)),
            FieldKind::Field => page.record().is_some_and(|of: FieldRecord| {
                (of.row, of.column, of.columns, of.rows) == (at.row, at.column, columns, rows)
            }),
        };
        match is_of {
            true => Ok(()),
            false => {
                let field = match self.kind() {
                    FieldKind::Strip => format!("strip {}", at.column),
                    FieldKind::Field => {
                        format!("the field of row {}, column {}", at.row, at.column)
                    }
                };
                Err(FieldDifference::Place { layer: page.name(), field })
            }
        }
    }
}

fn too_many(fields: &Fields) -> FieldsError {
    let (build, grid, size) = (fields.layer_size(), fields.grid(), fields.size());
    match fields.form().kind() {
        FieldKind::Strip => {
            FieldsError::TooManyStrips { width: build[0], strips: grid[0], mirrors: size[0] }
        }
        FieldKind::Field => FieldsError::TooManyFields { build, grid, size },
    }
}

impl Swaths {
    /// Returns one swath of so many columns.
    fn whole(columns: u32) -> Self {
        // No swath is without columns.
        Self { mirrors: columns.max(1), overlap: 0, seam: Seam::default(), width: columns }
    }
}

/// A field that an index lists.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldFile {
    /// The name of its file in the folder.
    pub name: String,
    /// Where it lies among the fields.
    pub place: FieldPlace,
    /// The columns of the build that it exposes.
    pub columns: Range<u32>,
    /// The rows of the build that it exposes.
    pub rows: Range<u32>,
    form: FieldForm,
}

impl FieldFile {
    /// Checks that a page says that it is of this field.
    ///
    /// # Errors
    /// Returns an error if it says anything else.
    pub fn check(&self, page: &PageInfo) -> Result<(), FieldsError> {
        let place = [&self.columns, &self.rows];
        self.form.check(page, self.place, place).map_err(|difference| self.unlike(difference))
    }

    /// Returns the error that this file's input differs from the first field's.
    pub fn of_other_input(&self) -> FieldsError {
        self.unlike(FieldDifference::Input(self.form.kind()))
    }

    fn unlike(&self, difference: FieldDifference) -> FieldsError {
        FieldsError::Unlike { file: self.name.clone(), kind: self.form.kind(), difference }
    }
}

/// Returns the fields of a folder, row by row from the top, each from the left.
///
/// # Errors
/// Returns an error if the folder has no index, or a malformed one.
pub fn field_files(folder: &Path) -> Result<Vec<FieldFile>, FieldsError> {
    let fields = FieldIndex::read(folder)?.fields;
    let form = fields.form();
    let file = |field| {
        let place = fields.place(field);
        let (columns, rows) = (fields.columns(field), fields.rows(field));
        FieldFile { name: form.file_name(place), place, columns, rows, form }
    };
    Ok((0..fields.count()).map(file).collect())
}

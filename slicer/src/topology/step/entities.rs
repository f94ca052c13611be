//! Writes the entities of a STEP file one after the other.

use std::fmt;
use std::io::{self, Write};

use lamp_brep::vector::Vec3;

/// The number of references per line.
const PER_LINE: usize = 100;

/// Writes entities, and counts them.
pub(super) struct EntityWriter<'a> {
    out: &'a mut dyn Write,
    last: u64,
}

impl<'a> EntityWriter<'a> {
    pub(super) fn new(out: &'a mut dyn Write) -> Self {
        Self { out, last: 0 }
    }

    pub(super) fn head(&mut self) -> io::Result<()> {
        self.out.write_all(
            b"ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n\
              FILE_NAME('','',(''),(''),'','','');\nFILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\n\
              ENDSEC;\nDATA;\n",
        )
    }

    pub(super) fn end(&mut self) -> io::Result<()> {
        self.out.write_all(b"ENDSEC;\nEND-ISO-10303-21;\n")
    }

    /// Adds an entity, and returns its number.
    pub(super) fn add(
        &mut self,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> io::Result<u64> {
        self.last += 1;
        write!(self.out, "#{}=", self.last)?;
        write(self.out)?;
        self.out.write_all(b";\n")?;
        Ok(self.last)
    }

    /// Adds an entity that contains a list of others.
    pub(super) fn with_list(&mut self, start: &str, list: &[u64], end: &str) -> io::Result<u64> {
        self.add(|out| {
            out.write_all(start.as_bytes())?;
            write_list(list, out)?;
            out.write_all(end.as_bytes())
        })
    }

    /// Adds a plane through a point.
    pub(super) fn plane(&mut self, point: u64, normal: Vec3) -> io::Result<u64> {
        // Across a meter, one digit more is a hundredth of a nanometer.
        let [x, y, z] = normal.map(|c| StepReal((c * 1e11).round() / 1e11));
        let normal = self.add(|out| write!(out, "DIRECTION('',({x},{y},{z}))"))?;
        let place = self.add(|out| write!(out, "AXIS2_PLACEMENT_3D('',#{point},#{normal},$)"))?;
        self.add(|out| write!(out, "PLANE('',#{place})"))
    }

    /// Adds a solid with its shells.
    pub(super) fn solid(&mut self, outer: u64, voids: &[u64]) -> io::Result<u64> {
        if voids.is_empty() {
            return self.add(|out| write!(out, "FACETED_BREP('',#{outer})"));
        }
        // Not written as a faceted B-rep: OpenCASCADE 7.6 omits the voids of such solids.
        self.with_list(&format!("BREP_WITH_VOIDS('',#{outer},"), voids, ")")
    }

    /// Adds the product whose shape consists of the solids.
    pub(super) fn product(&mut self, name: &str, solids: &[u64]) -> io::Result<()> {
        let mut add = |entity: String| self.add(|out| out.write_all(entity.as_bytes()));
        let length = add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))".to_owned())?;
        let angle = add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))".to_owned())?;
        let context = add(format!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)\
             GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle}))REPRESENTATION_CONTEXT('',''))"
        ))?;
        let design = "core data for automotive mechanical design processes";
        let all = add(format!("APPLICATION_CONTEXT('{design}')"))?;
        let of_product = add(format!("PRODUCT_CONTEXT('',#{all},'mechanical')"))?;
        let product = add(format!("PRODUCT('{name}','{name}','',(#{of_product}))"))?;
        let formation = add(format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"))?;
        let of_definition =
            add(format!("PRODUCT_DEFINITION_CONTEXT('part definition',#{all},'design')"))?;
        let definition = add(format!("PRODUCT_DEFINITION('','',#{formation},#{of_definition})"))?;
        let of_shape = add(format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"))?;
        let end = format!(",#{context})");
        let shape = self.with_list("FACETED_BREP_SHAPE_REPRESENTATION('',", solids, &end)?;
        self.add(|out| write!(out, "SHAPE_DEFINITION_REPRESENTATION(#{of_shape},#{shape})"))?;
        Ok(())
    }
}

fn write_list(list: &[u64], out: &mut dyn Write) -> io::Result<()> {
    out.write_all(b"(")?;
    for (k, entity) in list.iter().enumerate() {
        let between = match k {
            0 => "",
            k if k % PER_LINE == 0 => ",\n",
            _ => ",",
        };
        write!(out, "{between}#{entity}")?;
    }
    out.write_all(b")")
}

/// A number as STEP writes it: with a point, without zeros after it, and with a capital E. It has
/// just enough digits to identify it.
#[derive(Clone, Copy, Debug)]
pub(super) struct StepReal(pub(super) f64);

impl fmt::Display for StepReal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Adding zero turns -0 into 0.
        let number = self.0 + 0.0;
        let size = number.abs();
        if size != 0.0 && !(1e-5..1e15).contains(&size) {
            let text = format!("{number:E}");
            let (digits, power) = text.split_once('E').unwrap_or((&text, "0"));
            let point = if digits.contains('.') { "" } else { "." };
            return write!(f, "{digits}{point}E{power}");
        }
        let point = if number == number.trunc() { "." } else { "" };
        write!(f, "{number}{point}")
    }
}

/// Returns a text as STEP writes it between quotes.
pub(super) fn text(text: &str) -> String {
    let mut written = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\'' => written += "''",
            '\\' => written += "\\\\",
            ' '..='~' => written.push(c),
            c => {
                let mut units = [0; 2];
                let units = c.encode_utf16(&mut units).iter().map(|unit| format!("{unit:04X}"));
                written += &format!("\\X2\\{}\\X0\\", units.collect::<String>());
            }
        }
    }
    written
}

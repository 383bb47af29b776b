//! Elements of a PLY file, one by one: `ply-rs-bw` reads binary ones, words of a text are taken here.

use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{
    ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};
use umbel_core::glam::DVec3;

use crate::error::{CORRECT_LINE, Problem};

/// Names of the texture coordinates of a vertex.
pub(crate) const UV_NAMES: [[&str; 2]; 4] =
    [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];
/// The type of which f32 holds every number.
pub(crate) const FLOAT: PropertyType = PropertyType::Scalar(ScalarType::Float);

/// What is kept of a vertex.
#[derive(Default)]
pub(crate) struct Vertex {
    pub(crate) position: [f32; 3],
    pub(crate) wide: DVec3,
    pub(crate) normal: [f32; 3],
    pub(crate) uv: [f32; 2],
}

/// What is kept of a face.
#[derive(Default)]
pub(crate) struct Face {
    /// The vertices of its corners, as the file has them.
    pub(crate) indices: Vec<i64>,
    /// Texture coordinates of its corners, one number after the other.
    pub(crate) uvs: Vec<f32>,
}

/// An element of which nothing is kept.
#[derive(Default)]
pub(crate) struct Skipped;

/// A number of a file, in both precisions: a text rounds to each of them by itself.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Number {
    narrow: f32,
    wide: f64,
}

/// What takes the properties of an element.
pub(crate) trait Take: PropertyAccess {
    fn number(&mut self, name: &str, number: Number);
    fn list(&mut self, name: &str, numbers: &[Number]);
}

impl Take for Vertex {
    fn number(&mut self, name: &str, number: Number) {
        let axis = ["x", "y", "z"].iter().position(|&known| known == name);
        if let Some(k) = axis {
            (self.position[k], self.wide[k]) = (number.narrow, number.wide);
        } else if let Some(k) = ["nx", "ny", "nz"].iter().position(|&known| known == name) {
            self.normal[k] = number.narrow;
        } else if let Some(k) =
            UV_NAMES.iter().find_map(|names| names.iter().position(|&known| known == name))
        {
            self.uv[k] = number.narrow;
        }
    }

    fn list(&mut self, _: &str, _: &[Number]) {}
}

impl Take for Face {
    fn number(&mut self, _: &str, _: Number) {}

    fn list(&mut self, name: &str, numbers: &[Number]) {
        match name {
            // What is no integer becomes one that names no vertex.
            "vertex_indices" | "vertex_index" => self.indices.extend(numbers.iter().map(|number| {
                let index = number.wide as i64;
                if index as f64 == number.wide { index } else { -1 }
            })),
            "texcoord" => self.uvs.extend(numbers.iter().map(|number| number.narrow)),
            _ => {}
        }
    }
}

impl Take for Skipped {
    fn number(&mut self, _: &str, _: Number) {}

    fn list(&mut self, _: &str, _: &[Number]) {}
}

/// Passes what `ply-rs-bw` has read on.
fn take(target: &mut impl Take, name: &str, property: Property) -> PropertyAccessResult {
    macro_rules! list {
        ($values:expr) => {{
            let numbers: Vec<Number> =
                $values.into_iter().map(|x| Number { narrow: x as f32, wide: f64::from(x) }).collect();
            target.list(name, &numbers);
            return PropertyAccessResult::Set;
        }};
    }
    let wide = match property {
        Property::Char(x) => f64::from(x),
        Property::UChar(x) => f64::from(x),
        Property::Short(x) => f64::from(x),
        Property::UShort(x) => f64::from(x),
        Property::Int(x) => f64::from(x),
        Property::UInt(x) => f64::from(x),
        Property::Float(x) => f64::from(x),
        Property::Double(x) => x,
        Property::ListChar(values) => list!(values),
        Property::ListUChar(values) => list!(values),
        Property::ListShort(values) => list!(values),
        Property::ListUShort(values) => list!(values),
        Property::ListInt(values) => list!(values),
        Property::ListUInt(values) => list!(values),
        Property::ListFloat(values) => list!(values),
        Property::ListDouble(values) => list!(values),
    };
    target.number(name, Number { narrow: wide as f32, wide });
    PropertyAccessResult::Set
}

macro_rules! access {
    ($($element:ty),*) => {
        $(impl PropertyAccess for $element {
            fn new() -> Self {
                Self::default()
            }

            fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
                take(self, name, property)
            }
        })*
    };
}

access!(Vertex, Face, Skipped);

/// What stands behind the header.
pub(crate) struct Elements<'a> {
    rest: &'a [u8],
    encoding: Encoding,
    /// The line of the last word of a text, counted from 1.
    line: u64,
}

impl<'a> Elements<'a> {
    /// Those in `rest`, which begins in this line.
    pub(crate) fn new(rest: &'a [u8], encoding: Encoding, line: u64) -> Self {
        Self { rest, encoding, line }
    }

    pub(crate) fn is_text(&self) -> bool {
        self.encoding == Encoding::Ascii
    }

    /// The next element.
    pub(crate) fn next<T: Take>(&mut self, definition: &ElementDef) -> Result<T, Problem> {
        let parser = Parser::<T>::new();
        let read = match self.encoding {
            Encoding::Ascii => return self.next_of_text(definition),
            Encoding::BinaryBigEndian => parser.read_big_endian_element(&mut self.rest, definition),
            Encoding::BinaryLittleEndian => parser.read_little_endian_element(&mut self.rest, definition),
        };
        read.map_err(|error| {
            self.problem(format!("an element `{}` cannot be read: {error}", definition.name))
        })
    }

    fn next_of_text<T: Take>(&mut self, definition: &ElementDef) -> Result<T, Problem> {
        let mut element = T::new();
        let mut numbers = Vec::new();
        for (name, property) in &definition.properties {
            match property.data_type {
                PropertyType::Scalar(_) => element.number(name, self.number(definition)?),
                PropertyType::List(..) => {
                    let count = self.number(definition)?.wide;
                    // More numbers than bytes cannot follow.
                    if !(count >= 0.0 && count <= self.rest.len() as f64 && count.fract() == 0.0) {
                        return Err(self.problem(format!("a list `{name}` has no {count} entries")));
                    }
                    numbers.clear();
                    for _ in 0..count as usize {
                        numbers.push(self.number(definition)?);
                    }
                    element.list(name, &numbers);
                }
            }
        }
        Ok(element)
    }

    /// The next word as a number.
    fn number(&mut self, definition: &ElementDef) -> Result<Number, Problem> {
        let start = self.rest.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(self.rest.len());
        self.line += self.rest[..start].iter().filter(|&&byte| byte == b'\n').count() as u64;
        let rest = &self.rest[start..];
        let (word, rest) = rest.split_at(rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len()));
        self.rest = rest;
        if word.is_empty() {
            return Err(self.problem(format!("the file ends within the elements `{}`", definition.name)));
        }
        let parsed =
            str::from_utf8(word).ok().and_then(|word| Some((word.parse().ok()?, word.parse().ok()?)));
        match parsed {
            Some((narrow, wide)) => Ok(Number { narrow, wide }),
            None => Err(self.problem(format!("`{}` is no number", String::from_utf8_lossy(word)))),
        }
    }

    pub(crate) fn problem(&self, what: String) -> Problem {
        Problem { line: self.is_text().then_some(self.line), what, remedy: CORRECT_LINE }
    }
}

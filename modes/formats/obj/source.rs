//! An OBJ file as `tobj` shall see it.
//!
//! tobj parses numbers and indices well, but keeps less of a file than a `Scene` does. So it reads the file through
//! [`Source`], which passes each statement on in the form that tobj gets right and notes the rest:
//! - tobj numbers positions anew for each model, by first use, and drops the others. Here all faces are one model, and
//!   before the file's own lines come polygons with the corners 1, 2, 3 ... n: first use is then the order of the file.
//! - tobj gives a corner without a normal that of the corner before. Here such a corner names one more normal, past the
//!   file's own. Texture coordinates likewise.
//! - tobj resolves indices when a model ends. Here they are checked at their line.
//! - tobj takes lines (`l`) for polygons, and no `\` at a line's end, comments behind numbers or stray vertex colours.
//! - tobj divides a position by its fourth number. That is the weight of a point of a rational curve or surface, and says
//!   nothing about polygons: it is not passed on. Where it is not 1 that is said, as other readers might divide.
//! - tobj passes over what it does not know. Here it is counted, with the first line: see [`crate::formats::obj::left_out`].
//!
//! Based on: Wavefront Technologies, "Advanced Visualizer Manual", appendix B1 "Object Files", 1992.

use std::fmt::Write as _;
use std::io::{self, BufRead, Read};

use crate::error::{CORRECT_LINE, Problem};
use crate::formats::obj::left_out::{Kind, LeftOut};
use crate::formats::obj::mesh::Parts;
use crate::formats::obj::tags::take_tag;
use crate::formats::obj::text::{Statements, keyword, words};
use crate::scene::Creases;
use crate::scene::NO_INDEX;

/// Corners per polygon of the preamble. Any number would do; this one keeps lines short.
const PREAMBLE_CORNERS: u64 = 1000;

/// Positions, texture coordinates and normals: three of something, in the order of a face's fields.
pub(crate) const KEYWORDS: [&str; 3] = ["v", "vt", "vn"];
pub(crate) const KINDS: [&str; 3] = ["position", "texture coordinate", "normal"];

/// How much of everything a text has.
#[derive(Debug, Default)]
pub(crate) struct Extent {
    /// Positions, texture coordinates and normals.
    pub(crate) counts: [u64; 3],
    /// Faces, and a bound on their corners.
    pub(crate) faces: u64,
    pub(crate) corners: u64,
}

/// Bytes of a position while tobj makes a mesh of it: as parsed, by its place, and as kept; and in the scene.
const POSITION_BYTES: u64 = 12 + 64 + 24 + 12;
/// Bytes of a texture coordinate or a normal, likewise.
const OTHER_BYTES: u64 = 12 + 64 + 24 + 12;
/// Bytes of a face: as parsed, its arity, its first corner.
const FACE_BYTES: u64 = 104 + 16;
/// Bytes of a corner: as parsed, its three indices twice while lists grow, and the triangle in the scene that it makes.
const CORNER_BYTES: u64 = 24 + 24 + 48;

impl Extent {
    /// The memory that reading the text takes, beside the text.
    pub(crate) fn bytes(&self) -> u64 {
        let [positions, others @ ..] = self.counts;
        let preamble: u64 = self.counts.iter().max().copied().unwrap_or(0);
        positions * POSITION_BYTES
            + others.iter().sum::<u64>() * OTHER_BYTES
            + self.faces * FACE_BYTES
            + (self.corners + preamble) * CORNER_BYTES
    }
}

/// Counts what the whole text has.
pub(crate) fn measure(text: &[u8]) -> Result<Extent, Problem> {
    let mut extent = Extent::default();
    for (_, statement) in Statements::new(text) {
        let (keyword, rest) = keyword(&statement);
        if let Some(kind) = KEYWORDS.iter().position(|&known| known == keyword) {
            extent.counts[kind] += 1;
        } else if matches!(keyword, "f" | "fo") {
            extent.faces += 1;
            extent.corners += 1 + rest.bytes().filter(u8::is_ascii_whitespace).count() as u64;
        }
    }
    if extent.counts.iter().any(|&count| count >= u64::from(NO_INDEX)) {
        return Err(Problem {
            line: None,
            what: "the file has more vertices than 32-bit indices can name".to_owned(),
            remedy: "Split it into several files.",
        });
    }
    Ok(extent)
}

/// The file as tobj shall see it, read statement by statement, and what tobj shall not see.
pub(crate) struct Source<'a> {
    statements: Statements<'a>,
    /// The line of the last statement passed on.
    line: u64,
    /// What of it tobj has not read yet starts at `taken`.
    buffer: String,
    taken: usize,
    pub(crate) problem: Option<Problem>,
    /// How many positions, texture coordinates and normals the file has, and how many were passed on.
    counts: [u64; 3],
    seen: [u64; 3],
    /// Corners of the preamble that were passed on, and the polygons that hold them.
    preamble: u64,
    pub(crate) preamble_faces: usize,
    finished: bool,
    pub(crate) faces: usize,
    pub(crate) parts: Parts,
    pub(crate) libraries: Vec<String>,
    pub(crate) creases: Creases,
    /// What is not passed on, to be counted in warnings.
    pub(crate) left_out: LeftOut,
    /// Whether a corner names a texture coordinate or a normal though the file has none at all.
    pub(crate) dangling: [bool; 3],
}

impl<'a> Source<'a> {
    pub(crate) fn new(text: &'a [u8], counts: [u64; 3]) -> Self {
        Self {
            statements: Statements::new(text),
            line: 0,
            buffer: String::new(),
            taken: 0,
            problem: None,
            counts,
            seen: [0; 3],
            preamble: 0,
            preamble_faces: 0,
            finished: false,
            faces: 0,
            parts: Parts::default(),
            libraries: Vec::new(),
            creases: Creases::default(),
            left_out: LeftOut::default(),
            dangling: [false; 3],
        }
    }

    /// Puts what comes next into the buffer: nothing for a statement that tobj need not see.
    fn advance(&mut self) -> Result<(), Problem> {
        if self.advance_preamble() {
            return Ok(());
        }
        let Some((line, statement)) = self.statements.next() else {
            self.finish();
            return Ok(());
        };
        self.line = line;
        let (keyword, rest) = keyword(&statement);
        match keyword {
            // What follows are a weight, or colours, which tobj refuses unless every vertex has one.
            "v" => {
                self.left_out.weight(rest, line);
                self.numbers(0, rest, 3);
            }
            "vt" => self.numbers(1, rest, 2),
            "vn" => self.numbers(2, rest, 3),
            "f" => self.face(rest)?,
            // How faces were written before 1992.
            "fo" => {
                self.left_out.note(Kind::OldFace, line, &statement);
                self.face(rest)?;
            }
            "t" => take_tag(rest, (self.line, self.counts[0]), &mut self.creases)?,
            "o" | "g" => self.parts.next(self.faces).name = rest.trim_end().to_owned(),
            "usemtl" => self.parts.next(self.faces).material = rest.trim_end().to_owned(),
            "mtllib" => self.libraries.push(rest.trim_end().to_owned()),
            other => self.left_out.statement(other, line, &statement),
        }
        Ok(())
    }

    /// Passes on the next polygon of the preamble, which names every vertex of the file in order. tobj resolves indices
    /// at the end, so they may point ahead.
    fn advance_preamble(&mut self) -> bool {
        let named = [0, 1, 2].map(|kind| self.counts[kind] + u64::from(kind > 0 && self.counts[kind] > 0));
        let total = if named[0] == 0 { 0 } else { named.into_iter().fold(0, u64::max) };
        if self.preamble == total {
            return false;
        }
        let end = total.min(self.preamble + PREAMBLE_CORNERS);
        self.buffer.push('f');
        for corner in self.preamble + 1..=end {
            for (mark, count) in [' ', '/', '/'].into_iter().zip(named) {
                self.buffer.push(mark);
                if count > 0 {
                    // Writing to a string cannot fail.
                    let _ = write!(self.buffer, "{}", corner.min(count));
                }
            }
        }
        self.buffer.push('\n');
        self.preamble = end;
        self.preamble_faces += 1;
        true
    }

    /// Ends the file with the texture coordinate and the normal that stand for none.
    fn finish(&mut self) {
        self.finished = true;
        for (count, line) in self.counts.into_iter().zip(["", "vt 0 0\n", "vn 0 0 0\n"]) {
            if count > 0 {
                self.buffer.push_str(line);
            }
        }
    }

    fn numbers(&mut self, kind: usize, rest: &str, keep: usize) {
        self.seen[kind] += 1;
        self.buffer.push_str(KEYWORDS[kind]);
        for word in words(rest).take(keep) {
            let is_nan = word.contains(".#") || word.contains("nan(");
            self.buffer.push(' ');
            self.buffer.push_str(if is_nan { "nan" } else { word });
        }
        // The second texture coordinate is optional.
        let pad = kind == 1 && words(rest).count() == 1;
        self.buffer.push_str(if pad { " 0\n" } else { "\n" });
    }

    fn face(&mut self, rest: &str) -> Result<(), Problem> {
        self.buffer.push('f');
        let mut corners = 0;
        for corner in words(rest) {
            self.corner(corner)?;
            corners += 1;
        }
        if corners < 3 {
            self.buffer.clear();
            self.left_out.note(Kind::Thin, self.line, "f");
        } else {
            self.buffer.push('\n');
            self.faces += 1;
        }
        Ok(())
    }

    /// Checks a corner `v`, `v/vt`, `v//vn` or `v/vt/vn` and fills in the fields that it leaves out.
    fn corner(&mut self, corner: &str) -> Result<(), Problem> {
        let mut fields = corner.split('/');
        for (kind, mark) in [' ', '/', '/'].into_iter().enumerate() {
            let field = fields.next().unwrap_or_default();
            self.buffer.push(mark);
            if self.counts[kind] == 0 && kind > 0 {
                self.dangling[kind] |= !field.is_empty();
            } else if kind > 0 && (field.is_empty() || is_zero(field)) {
                if !field.is_empty() {
                    self.left_out.note(Kind::Zero, self.line, corner);
                }
                let _ = write!(self.buffer, "{}", self.counts[kind] + 1);
            } else {
                self.check_index(kind, field, corner)?;
                self.buffer.push_str(field);
            }
        }
        match fields.next() {
            None => Ok(()),
            Some(_) => Err(self.error(format!("face corner `{corner}` has more than three indices"))),
        }
    }

    fn check_index(&self, kind: usize, field: &str, corner: &str) -> Result<(), Problem> {
        let (count, seen) = (self.counts[kind], self.seen[kind]);
        let what = KINDS[kind];
        let Ok(index) = field.parse::<i64>() else {
            return Err(self.error(format!("`{field}` in face corner `{corner}` is no {what} index")));
        };
        let problem = match index {
            0 => format!("{what} index 0: indices start at 1"),
            1.. if index.unsigned_abs() > count => {
                format!("{what} index {index} is out of range: the file has {count}")
            }
            ..0 if index.unsigned_abs() > seen => {
                format!("{what} index {index} is out of range: {seen} stand before this line")
            }
            _ => return Ok(()),
        };
        Err(self.error(problem))
    }

    pub(crate) fn error(&self, what: String) -> Problem {
        Problem { line: Some(self.line), what, remedy: CORRECT_LINE }
    }
}

/// Whether an index is 0, which some exporters write for "none".
fn is_zero(field: &str) -> bool {
    field.parse::<i64>() == Ok(0)
}

impl BufRead for Source<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        while self.taken == self.buffer.len() && !self.finished {
            self.buffer.clear();
            self.taken = 0;
            if let Err(problem) = self.advance() {
                self.problem = Some(problem);
                return Err(io::ErrorKind::InvalidData.into());
            }
        }
        Ok(&self.buffer.as_bytes()[self.taken..])
    }

    fn consume(&mut self, amount: usize) {
        self.taken += amount;
    }
}

impl Read for Source<'_> {
    fn read(&mut self, target: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(target)?;
        self.consume(count);
        Ok(count)
    }
}

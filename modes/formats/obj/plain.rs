//! Reads plain OBJ text, in parallel: what nearly all files are.
//!
//! The text is cut into pieces at ends of lines, each piece is read by itself, and the pieces are put together in their
//! order. Plain is: positions, texture coordinates and normals that are finite numbers; faces whose corners are all counted
//! from the start of the file or, within a piece, all from their line; names, materials and libraries; comments and what changes no
//! triangle. At the first sign of anything else (a `\` at a line's end, an index out of range, a word that is no number) this
//! reader gives up, and the file goes to the reader that knows how to warn, to mend and to say what is wrong
//! ([`crate::formats::obj::source`]). So the answer is that one's, to the bit, or none.
//!
//! Cost: one pass over the text, on all threads.
//!
//! Based on: Wavefront Technologies, "Advanced Visualizer Manual", appendix B1 "Object Files", 1992.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use crate::error::Problem;
use crate::files::budget::Budget;
use crate::formats::obj::decimal::{decimal, is_end};
use crate::formats::obj::left_out::is_silent;
use crate::formats::obj::mesh::{ObjMesh, Parts};
use crate::formats::obj::text::keyword;
use crate::formats::polygons::faces::Faces;
use crate::scene::NO_INDEX;

/// Bytes of a piece.
const PIECE: usize = 1 << 18;
/// Counts stay below this, so that they and [`BEFORE`] fit into 32 bits together.
const MOST: usize = 1 << 31;
/// More than the greatest index that is read, 999,999,999.
const BEFORE: u32 = 1 << 30;

/// The mesh of a plain text; `None` where it is not plain. A problem where the mesh, and the scene made of it, would take more
/// than the budget has left: then pieces are still read, to say how much it would be, but not kept.
pub(crate) fn read_plain(text: &[u8], budget: &Budget) -> Result<Option<ObjMesh>, Problem> {
    let (taken, limit) = (AtomicU64::new(0), budget.left());
    let read = |text: &[u8]| {
        let piece = Piece::read(text)?;
        let (bytes, size) = (piece.bytes(), [piece.faces.count, piece.positions.len()]);
        // In any order: once the limit is passed it stays so.
        let is_kept = taken.fetch_add(bytes, Ordering::Relaxed) + bytes <= limit;
        Some((if is_kept { piece } else { Piece::default() }, size))
    };
    let Some(pieces) = cut(text).into_par_iter().map(read).collect::<Option<Vec<_>>>() else {
        return Ok(None);
    };
    let (pieces, sizes): (Vec<Piece>, Vec<[usize; 2]>) = pieces.into_iter().unzip();
    let [faces, vertices] = sizes.iter().fold([0; 2], |[f, v], [faces, vertices]| [f + faces, v + vertices]);
    budget.check(taken.into_inner(), &format!("{faces} faces and {vertices} vertices"))?;
    Ok(join(pieces))
}

/// Cuts a text into pieces that end with a line.
fn cut(mut text: &[u8]) -> Vec<&[u8]> {
    let mut pieces = Vec::new();
    while text.len() > PIECE {
        let end = text[PIECE..].iter().position(|&byte| byte == b'\n').map_or(text.len(), |k| PIECE + k + 1);
        let (piece, rest) = text.split_at(end);
        pieces.push(piece);
        text = rest;
    }
    pieces.push(text);
    pieces
}

/// Puts pieces together; `None` where an index is out of range or there are no positions.
fn join(mut pieces: Vec<Piece>) -> Option<ObjMesh> {
    let count = |length: fn(&Piece) -> usize| pieces.iter().map(length).sum::<usize>();
    let counts = [
        count(|piece| piece.positions.len()),
        count(|piece| piece.uvs.len()),
        count(|piece| piece.normals.len()),
    ];
    let corners = count(|piece| piece.faces.corners[0].len());
    if counts[0] == 0 || counts.iter().chain([&corners]).any(|&count| count >= MOST) {
        return None;
    }
    let mut mesh = ObjMesh {
        positions: Vec::with_capacity(counts[0]),
        uvs: Vec::with_capacity(counts[1]),
        normals: Vec::with_capacity(counts[2]),
        ..ObjMesh::default()
    };
    let (mut parts, mut faces) = (Parts::default(), 0);
    for piece in &mut pieces {
        piece.resolve([mesh.positions.len(), mesh.uvs.len(), mesh.normals.len()], counts)?;
        for (kind, dangling) in mesh.dangling.iter_mut().enumerate().filter(|&(kind, _)| counts[kind] == 0) {
            *dangling |= !std::mem::take(&mut piece.faces.corners[kind]).is_empty();
        }
        mesh.positions.append(&mut piece.positions);
        mesh.uvs.append(&mut piece.uvs);
        mesh.normals.append(&mut piece.normals);
        for (before, change) in piece.changes.drain(..) {
            match change {
                Change::Name(name) => parts.next(faces + before).name = name,
                Change::Material(material) => parts.next(faces + before).material = material,
                Change::Library(names) => mesh.libraries.push(names),
            }
        }
        faces += piece.faces.count;
    }
    mesh.faces = pieces.into_iter().map(|piece| piece.faces).collect();
    mesh.parts = parts.0;
    Some(mesh)
}

/// What changes between two faces.
enum Change {
    Name(String),
    Material(String),
    Library(String),
}

/// What a piece of the text says.
#[derive(Default)]
struct Piece {
    positions: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    faces: Faces,
    /// Each with the faces of the piece before it.
    changes: Vec<(usize, Change)>,
    /// Whether indices are counted from the start of the piece, and kept with [`BEFORE`] added, as they may lie before it. Or
    /// from the start of the file. `None` as long as no corner has been read.
    is_relative: Option<bool>,
    /// The greatest index of each kind, where they are counted from the start of the file.
    greatest: [u32; 3],
}

impl Piece {
    fn read(text: &[u8]) -> Option<Self> {
        let (mut piece, mut cursor) = (Self::default(), Cursor { text, at: 0 });
        while cursor.at < text.len() {
            piece.statement(&mut cursor)?;
        }
        let corners = piece.faces.corners[0].len();
        for list in piece.faces.corners[1..].iter_mut().filter(|list| !list.is_empty()) {
            list.resize(corners, NO_INDEX);
        }
        Some(piece)
    }

    /// Bytes of the piece, and of the scene that is made of it.
    fn bytes(&self) -> u64 {
        let vectors = 2 * (12 * (self.positions.len() + self.normals.len()) + 8 * self.uvs.len());
        let kinds = self.faces.corners.iter().filter(|list| !list.is_empty()).count();
        let corners = self.faces.corners[0].len();
        let triangles = corners.saturating_sub(2 * self.faces.count);
        (vectors + kinds * (4 * corners + 2 * 12 * triangles) + 8 * self.faces.arities.len()) as u64
    }

    fn statement(&mut self, cursor: &mut Cursor<'_>) -> Option<()> {
        cursor.skip_blanks();
        match cursor.rest() {
            [] => Some(()),
            [b'\r' | b'\n', ..] => cursor.end_line(),
            [b'#', ..] => cursor.take_line().map(|_| ()),
            [b'v', b' ' | b'\t', ..] => {
                cursor.at += 1;
                self.positions.push(cursor.numbers()?);
                cursor.skip_colours()
            }
            [b'v', b't', b' ' | b'\t', ..] => {
                cursor.at += 2;
                self.uvs.push(cursor.uv()?);
                cursor.take_line().map(|_| ())
            }
            [b'v', b'n', b' ' | b'\t', ..] => {
                cursor.at += 2;
                self.normals.push(cursor.numbers()?);
                cursor.take_line().map(|_| ())
            }
            [b'f', b' ' | b'\t', ..] => {
                cursor.at += 1;
                self.face(cursor)
            }
            _ => self.other(cursor.take_line()?),
        }
    }

    /// A statement that is neither a number of vertices nor a face.
    fn other(&mut self, line: &[u8]) -> Option<()> {
        let line = String::from_utf8_lossy(line);
        let (keyword, rest) = keyword(&line);
        let rest = || rest.trim_end().to_owned();
        let change = match keyword {
            "o" | "g" => Change::Name(rest()),
            "usemtl" => Change::Material(rest()),
            "mtllib" => Change::Library(rest()),
            // Tags may be creases.
            "t" => return None,
            other => return is_silent(other).then_some(()),
        };
        self.changes.push((self.faces.count, change));
        Some(())
    }

    fn face(&mut self, cursor: &mut Cursor<'_>) -> Option<()> {
        let before = self.faces.corners[0].len();
        loop {
            cursor.skip_blanks();
            match cursor.rest() {
                [] | [b'\r' | b'\n', ..] => break cursor.end_line()?,
                [b'#', ..] => {
                    cursor.take_line()?;
                    break;
                }
                _ => self.corner(cursor)?,
            }
        }
        let arity = u32::try_from(self.faces.corners[0].len() - before).ok().filter(|&arity| arity >= 3)?;
        let faces = &mut self.faces;
        if arity != 3 && faces.arities.is_empty() {
            faces.arities.resize(faces.count, 3);
        }
        if arity != 3 || !faces.arities.is_empty() {
            faces.arities.push(arity);
        }
        faces.count += 1;
        Some(())
    }

    /// A corner `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&mut self, cursor: &mut Cursor<'_>) -> Option<()> {
        let number = self.faces.corners[0].len();
        let seen = [self.positions.len(), self.uvs.len(), self.normals.len()];
        for (kind, seen) in seen.into_iter().enumerate() {
            if kind > 0 {
                match cursor.rest().first() {
                    Some(b'/') => cursor.at += 1,
                    Some(&byte) if !is_end(byte) => return None,
                    _ => return Some(()),
                }
            }
            let index = match cursor.rest().first() {
                None | Some(b'/' | b' ' | b'\t' | b'\r' | b'\n') if kind > 0 => continue,
                _ => self.index(cursor.integer()?, kind, seen)?,
            };
            let list = &mut self.faces.corners[kind];
            list.resize(number, NO_INDEX);
            list.push(index);
        }
        cursor.rest().first().is_none_or(|&byte| is_end(byte)).then_some(())
    }

    /// An index as it is kept, given how many vertices of its kind the piece has so far.
    fn index(&mut self, index: i64, kind: usize, seen: usize) -> Option<u32> {
        let is_relative = index < 0;
        if *self.is_relative.get_or_insert(is_relative) != is_relative || index == 0 {
            return None;
        }
        if is_relative {
            return u32::try_from(seen as i64 + index + i64::from(BEFORE))
                .ok()
                .filter(|&kept| kept != NO_INDEX);
        }
        let index = u32::try_from(index - 1).ok()?;
        self.greatest[kind] = self.greatest[kind].max(index);
        Some(index)
    }

    /// Makes indices count from the start of the file, given how many vertices stand before the piece and in the whole file.
    /// Kinds that the file has none of are left alone.
    fn resolve(&mut self, before: [usize; 3], counts: [usize; 3]) -> Option<()> {
        for kind in (0..3).filter(|&kind| kind == 0 || counts[kind] > 0) {
            let list = &mut self.faces.corners[kind];
            if self.is_relative == Some(true) {
                // Counts are below 2³¹.
                let (before, count) = (before[kind] as u32, counts[kind] as u32);
                for index in list.iter_mut().filter(|index| **index != NO_INDEX) {
                    *index = (*index + before).checked_sub(BEFORE).filter(|&index| index < count)?;
                }
            } else if !list.is_empty() && self.greatest[kind] as usize >= counts[kind] {
                return None;
            }
        }
        Some(())
    }
}

/// A place in a text.
struct Cursor<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn rest(&self) -> &'a [u8] {
        &self.text[self.at..]
    }

    fn skip_blanks(&mut self) {
        while matches!(self.rest().first(), Some(b' ' | b'\t')) {
            self.at += 1;
        }
    }

    /// Steps over the end of a line; there must be one, or the end of the text.
    fn end_line(&mut self) -> Option<()> {
        self.at += match self.rest() {
            [] => 0,
            [b'\n', ..] => 1,
            [b'\r', b'\n', ..] => 2,
            _ => return None,
        };
        Some(())
    }

    /// The rest of the line, which is stepped over. `None` where it goes on behind its end, or where `\r` alone ends it.
    fn take_line(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest();
        let end = rest.iter().position(|&byte| byte == b'\n');
        let line = &rest[..end.unwrap_or(rest.len())];
        self.at += end.map_or(rest.len(), |end| end + 1);
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        let goes_on = line.trim_ascii_end().ends_with(b"\\");
        (!goes_on && !line.contains(&b'\r')).then_some(line)
    }

    /// Three numbers.
    fn numbers(&mut self) -> Option<[f32; 3]> {
        Some([self.number()?, self.number()?, self.number()?])
    }

    fn number(&mut self) -> Option<f32> {
        self.skip_blanks();
        let (number, length) = decimal(self.rest())?;
        self.at += length;
        Some(number)
    }

    /// One or two numbers; the second one is 0 if it is not there.
    fn uv(&mut self) -> Option<[f32; 2]> {
        let u = self.number()?;
        self.skip_blanks();
        let is_last = self.rest().first().is_none_or(|byte| matches!(byte, b'\r' | b'\n' | b'#'));
        Some([u, if is_last { 0.0 } else { self.number()? }])
    }

    /// Steps over what may follow a position: colours, or a weight, which is told of unless it is 1.
    fn skip_colours(&mut self) -> Option<()> {
        self.skip_blanks();
        if let [b'\r' | b'\n', ..] = self.rest() {
            return self.end_line();
        }
        let line = self.take_line()?;
        // Other blanks than these would make other words.
        if !line.iter().all(|&byte| byte == b'\t' || (b' '..=b'~').contains(&byte)) {
            return None;
        }
        let words = line.split(|&byte| is_end(byte)).filter(|word| !word.is_empty());
        let mut words = words.take_while(|word| !word.starts_with(b"#"));
        match (words.next(), words.next()) {
            (Some(weight), None) => str::from_utf8(weight).ok()?.parse() == Ok(1.0_f64),
            _ => true,
        }
        .then_some(())
    }

    /// An integer of at most nine digits.
    fn integer(&mut self) -> Option<i64> {
        let is_negative = self.rest().first() == Some(&b'-');
        self.at += usize::from(is_negative);
        let digits = self.rest().iter().take_while(|byte| byte.is_ascii_digit()).take(10).count();
        if !(1..10).contains(&digits) {
            return None;
        }
        let value = self.rest()[..digits].iter().fold(0, |value, byte| 10 * value + i64::from(byte - b'0'));
        self.at += digits;
        Some(if is_negative { -value } else { value })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::obj::odd::read_odd;
    use proptest::prelude::*;
    use proptest::sample::select;

    /// A mesh as both readers must agree on it: lists over all faces.
    fn flat(mesh: &ObjMesh) -> String {
        let corners = |kind: usize| -> Vec<u32> {
            let lists = mesh.faces.iter().flat_map(|faces| match &faces.corners[kind][..] {
                [] => vec![NO_INDEX; faces.corners[0].len()],
                list => list.to_vec(),
            });
            lists.collect()
        };
        let arities = mesh.faces.iter().flat_map(|faces| match &faces.arities[..] {
            [] => vec![3; faces.count],
            arities => arities.to_vec(),
        });
        let arities: Vec<u32> = arities.collect();
        let bits = |numbers: &[[f32; 3]]| -> Vec<_> { numbers.iter().map(|v| v.map(f32::to_bits)).collect() };
        let uvs: Vec<_> = mesh.uvs.iter().map(|uv| uv.map(f32::to_bits)).collect();
        format!(
            "{:?} {:?} {uvs:?} {arities:?} {:?} {:?} {:?} {:?} {:?}",
            bits(&mesh.positions),
            bits(&mesh.normals),
            [0, 1, 2].map(corners),
            mesh.parts,
            mesh.libraries,
            mesh.dangling,
            mesh.left_out.warnings().collect::<Vec<_>>(),
        )
    }

    /// Compares both readers. Says whether the text was plain.
    fn agree(text: &str) -> bool {
        let budget = Budget::new(Some(u64::MAX));
        let plain = read_plain(text.as_bytes(), &budget).unwrap_or_else(|problem| panic!("{}", problem.what));
        let Some(plain) = plain else { return false };
        let odd = read_odd(text.as_bytes(), &budget);
        let odd = odd.unwrap_or_else(|problem| panic!("{}\n{text}", problem.what));
        assert_eq!(flat(&plain), flat(&odd), "{text}");
        assert!(odd.creases.edges.is_empty() && odd.creases.corners.is_empty());
        true
    }

    #[test]
    fn plain_is_plain() {
        for text in [
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "v 0 0 0\r\nv 1 0 0\r\n\tv 0 1 0 \r\n\r\nf -3 -2 -1\r\n",
            "# a\\b\nmtllib a b.mtl\nv 0 0 0 1 0 0.5\nv 1 0 0 1\nv 0 1 0 # c\nvt 1\nvt 0 1 0\nvn 0 0 1\no x\nusemtl y \nf 1/2/1 2//1 3/ 3\ng\nf 1 2 3",
            "v 1 2 3\nv 1 2 4\nv 3 2 3\nf 1/7 2 3\ns off\nf 1 2 3 # end",
        ] {
            assert!(agree(text), "{text}");
        }
    }

    #[test]
    fn odd_is_not_plain() {
        let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        for text in [
            "f 1 2 4",
            "f 1 2",
            "f 1 2 -4",
            "f 0 1 2",
            "f 1 2 3 \\\n",
            "l 1 2",
            "v 1 2 3 0.5\nf 1 2 3",
            "f 1 2 x",
            "f 1/1/1/1 2 3",
            "vn 1 2\n",
            "vt nan 0\n",
            "v inf 0 0\n",
            "t crease 2/1/0 0 1 2\n",
            "fo 1 2 3\n",
            "f 1 2 3\rf 1 2 3",
            "f 1 -2 3",
            "curv 0 1",
            "V 1 2 3",
            "f 1\u{a0}2 3 3",
            "f 1/0 2 3",
        ] {
            assert!(!agree(&format!("{triangle}{text}")), "{text}");
        }
        assert!(!agree("") && !agree("vt 0 0\n"));
    }

    /// Pieces of statements that are mostly right.
    fn line() -> impl Strategy<Value = String> {
        let number = prop_oneof![8 => "-?[0-9]{1,3}(\\.[0-9]{0,7})?", 1 => select(vec!["1e3", "nan", ".5", "x", "1.#QNAN"]).prop_map(String::from)];
        let corner = prop_oneof![
            6 => "[1-9]", 3 => "[1-4](/[1-4])?", 3 => "[1-4]//[1-3]", 3 => "[1-4]/[1-3]/[1-3]", 1 => "-[1-3]", 1 => "[0-9]/?/?-?[0-9]?",
        ];
        prop_oneof![
            6 => prop::collection::vec(number.clone(), 3..=3).prop_map(|words| format!("v {}", words.join(" "))),
            1 => prop::collection::vec(number.clone(), 1..8).prop_map(|words| format!("v\t{}", words.join("  "))),
            2 => prop::collection::vec(number.clone(), 1..4).prop_map(|words| format!("vt {}", words.join(" "))),
            2 => prop::collection::vec(number, 3..4).prop_map(|words| format!("vn {}", words.join(" "))),
            8 => prop::collection::vec(corner, 3..6).prop_map(|words| format!("f {}", words.join(" "))),
            2 => select(vec!["o a", "g b c", "usemtl m", "usemtl  n ", "mtllib l.mtl", "s 1", "", "# f", " \t", "p 1", "g"]).prop_map(String::from),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        /// What is taken for plain is what the other reader makes of it.
        #[test]
        fn as_the_other_reader(lines in prop::collection::vec((line(), select(vec!["\n", "\r\n", " \n", "# c\n", "\r"])), 1..40)) {
            let start = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvn 0 1 0\nvn 1 0 0\n";
            let ends = |(k, (line, end)): (usize, &(String, &str))| format!("{line}{}", if k % 7 == 3 { end } else { "\n" });
            let text: String = lines.iter().enumerate().map(ends).collect();
            agree(&text);
            agree(&format!("{start}{text}"));
        }
    }

    /// Many pieces: indices from the start of the file and from each line, names across pieces.
    #[test]
    fn pieces_are_one_file() {
        for relative in [false, true] {
            let mut text = String::new();
            for k in 0..40_000 {
                let (a, b, c) = if relative { (-3, -2, -1) } else { (3 * k + 1, 3 * k + 2, 3 * k + 3) };
                text += &format!("v {k}.5 0 0\nv 0 {k} 0.25\nvn 0 0 1\nv 1 1 {k}\n");
                text += &match k % 4 {
                    0 => format!("usemtl m{}\nf {a} {b} {c}\n", k / 997),
                    1 => format!("f {a}//{0} {b}//{0} {c}//{0}\n", if relative { -1 } else { k + 1 }),
                    2 => format!("g {}\nf {a} {b} {c} {a}\n", k / 1009),
                    _ => "# nothing\n".to_owned(),
                };
            }
            assert!(text.len() > 4 * PIECE && agree(&text));
            assert!(read_plain(text.as_bytes(), &Budget::new(Some(1 << 20))).is_err());
        }
    }
}

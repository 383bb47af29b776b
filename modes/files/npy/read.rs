//! Arrays from NPY files: floating-point numbers or integers of 4 or 8 bytes, little-endian, C order, versions 1 to 3 of the
//! format.
//!
//! The header is a Python dictionary of three fields. It is read by hand, strictly: what is not one of these arrays is
//! refused before its numbers are looked at, and no memory is asked for that the file does not fill.
//!
//! Based on: NumPy Enhancement Proposal 1, "A Simple File Format for NumPy Arrays", Robert Kern, 2007.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use crate::error::Error;

/// The longest header that is read, in bytes; that of a plain array has 118.
const LONGEST_HEADER: usize = 1 << 12;

/// What is wrong with a file, and what to do about it.
struct Problem(String, &'static str);

/// What numbers a reader takes.
struct Wanted {
    /// Their types, as the format has them.
    types: &'static [&'static str],
    /// How to save such an array.
    remedy: &'static str,
}

/// Numbers.
const FLOATS: Wanted =
    Wanted { types: &["<f4", "<f8"], remedy: "save it as numpy.save(FILE, array.astype(\"<f4\"))" };

/// Ids.
const INTEGERS: Wanted = Wanted {
    types: &["<u4", "<i4", "<u8", "<i8"],
    remedy: "save it as numpy.save(FILE, array.astype(\"<u4\"))",
};

impl Wanted {
    /// The types in words.
    fn list(&self) -> String {
        self.types.iter().map(|name| format!("'{name}'")).collect::<Vec<_>>().join(", ")
    }
}

/// What stands before the numbers.
struct Header {
    /// The type of the numbers: one of those that are wanted.
    type_name: &'static str,
    shape: Vec<usize>,
}

impl Header {
    /// Bytes of a number: 4 or 8.
    fn width(&self) -> usize {
        if self.type_name.ends_with('4') { 4 } else { 8 }
    }
}

/// Reads an array: its extents, the slowest first, and its numbers, the last index running fastest. `f4` become `f64`,
/// exactly.
///
/// # Errors
/// [`Error::Input`] says what is wrong with the file and how to write it in NumPy.
pub fn read_npy(path: &Path) -> Result<(Vec<usize>, Vec<f64>), Error> {
    let (header, bytes) = read(path, &FLOATS).map_err(|problem| problem.of(path))?;
    let numbers = match header.width() {
        4 => bytes.as_chunks().0.iter().map(|&b| f64::from(f32::from_le_bytes(b))).collect(),
        _ => bytes.as_chunks().0.iter().map(|&b| f64::from_le_bytes(b)).collect(),
    };
    Ok((header.shape, numbers))
}

/// Reads an array of integers: `u4`, `i4`, `u8` or `i8`. Those above `i64::MAX`, which are no ids, become `i64::MAX`.
///
/// # Errors
/// As [`read_npy`].
pub fn read_npy_ids(path: &Path) -> Result<(Vec<usize>, Vec<i64>), Error> {
    let (header, bytes) = read(path, &INTEGERS).map_err(|problem| problem.of(path))?;
    let (fours, eights) = (bytes.as_chunks().0.iter(), bytes.as_chunks().0.iter());
    let numbers = match header.type_name {
        "<u4" => fours.map(|&b| i64::from(u32::from_le_bytes(b))).collect(),
        "<i4" => fours.map(|&b| i64::from(i32::from_le_bytes(b))).collect(),
        "<u8" => eights.map(|&b| i64::try_from(u64::from_le_bytes(b)).unwrap_or(i64::MAX)).collect(),
        _ => eights.map(|&b| i64::from_le_bytes(b)).collect(),
    };
    Ok((header.shape, numbers))
}

impl Problem {
    /// The error of a file.
    fn of(self, path: &Path) -> Error {
        let Self(problem, remedy) = self;
        Error::Input { path: path.to_owned(), line: None, problem, remedy: remedy.into() }
    }
}

/// Reads and checks the file: its header, and the bytes of its numbers.
fn read(path: &Path, wanted: &Wanted) -> Result<(Header, Vec<u8>), Problem> {
    const WHOLE: &str = "write the file again; numpy.load can check it";
    let from_system =
        |error: std::io::Error| Problem(error.to_string(), "check the name and the permissions");
    let mut file = BufReader::new(File::open(path).map_err(from_system)?);
    let header = read_header(&mut file, wanted)?;
    let (width, shape) = (header.width(), &header.shape);
    let count = shape.iter().try_fold(width, |bytes, &extent| bytes.checked_mul(extent));
    let expected =
        count.ok_or_else(|| Problem(format!("an array of shape {shape:?} fits no memory"), WHOLE))?;
    let mut bytes = Vec::new();
    // One byte more than there should be shows what follows.
    let limit = u64::try_from(expected).unwrap_or(u64::MAX).saturating_add(1);
    file.take(limit).read_to_end(&mut bytes).map_err(from_system)?;
    if bytes.len() < expected {
        let (found, whole) = (bytes.len() / width, expected / width);
        return Err(Problem(format!("the file ends after {found} of {whole} numbers"), WHOLE));
    }
    if bytes.len() > expected {
        return Err(Problem(
            format!("bytes follow the {} numbers of shape {shape:?}", expected / width),
            WHOLE,
        ));
    }
    Ok((header, bytes))
}

/// Reads all that comes before the numbers.
fn read_header(file: &mut impl Read, wanted: &Wanted) -> Result<Header, Problem> {
    const NOT_NPY: &str = "give a file that numpy.save has written";
    let mut start = [0; 8];
    let is_npy = file.read_exact(&mut start).is_ok() && start.starts_with(b"\x93NUMPY");
    if !is_npy {
        return Err(Problem("this is no NPY file: it does not begin with \\x93NUMPY".into(), NOT_NPY));
    }
    let cut = |_| Problem("the file ends in its header".into(), "write the file again");
    let [.., major, minor] = start;
    let length = match (major, minor) {
        (1, 0) => {
            let mut bytes = [0; 2];
            file.read_exact(&mut bytes).map_err(cut)?;
            usize::from(u16::from_le_bytes(bytes))
        }
        (2 | 3, 0) => {
            let mut bytes = [0; 4];
            file.read_exact(&mut bytes).map_err(cut)?;
            usize::try_from(u32::from_le_bytes(bytes)).unwrap_or(usize::MAX)
        }
        _ => return Err(Problem(format!("version {major}.{minor} of the format is not read"), NOT_NPY)),
    };
    if length > LONGEST_HEADER {
        let problem = format!("its header has {length} bytes; that of an array of numbers has 118");
        return Err(Problem(problem, "save a plain array, without fields"));
    }
    let mut text = vec![0; length];
    file.read_exact(&mut text).map_err(cut)?;
    parse_header(&String::from_utf8_lossy(&text), wanted)
}

/// The dictionary `{'descr': '<f4', 'fortran_order': False, 'shape': (5, 3), }`, its fields in any order.
fn parse_header(text: &str, wanted: &Wanted) -> Result<Header, Problem> {
    let unreadable =
        || Problem(format!("its header cannot be read: {}", text.trim()), "write the file again");
    let inner = text.trim().strip_prefix('{').and_then(|text| text.strip_suffix('}'));
    let mut rest = inner.ok_or_else(unreadable)?.trim();
    let (mut descr, mut order, mut shape) = (None, None, None);
    while !rest.is_empty() {
        let (key, value, after) = next_field(rest).ok_or_else(unreadable)?;
        let slot = match key {
            "descr" => &mut descr,
            "fortran_order" => &mut order,
            "shape" => &mut shape,
            _ => return Err(unreadable()),
        };
        if slot.replace(value).is_some() {
            return Err(unreadable());
        }
        rest = after;
    }
    let (Some(descr), Some(order), Some(shape)) = (descr, order, shape) else {
        return Err(unreadable());
    };
    let given = descr.trim_matches(['\'', '"']);
    let type_name = wanted.types.iter().copied().find(|name| *name == given).ok_or_else(|| {
        Problem(format!("its numbers are {descr}; {} are read", wanted.list()), wanted.remedy)
    })?;
    match order {
        "False" => {}
        "True" => {
            let problem = "it is in Fortran order; C order is read".into();
            return Err(Problem(problem, "save it as numpy.save(FILE, numpy.ascontiguousarray(array))"));
        }
        _ => return Err(unreadable()),
    }
    Ok(Header { type_name, shape: extents(shape).ok_or_else(unreadable)? })
}

/// The first `'key': value` of a list of fields, and what follows it.
fn next_field(text: &str) -> Option<(&str, &str, &str)> {
    let quote = text.chars().next().filter(|c| ['\'', '"'].contains(c))?;
    let (key, rest) = text[1..].split_once(quote)?;
    let rest = rest.trim_start().strip_prefix(':')?.trim_start();
    let end = match rest.chars().next()? {
        quote @ ('\'' | '"') => rest[1..].find(quote)? + 2,
        '(' => rest.find(')')? + 1,
        '[' => rest.rfind(']')? + 1,
        _ => rest.find(',').unwrap_or(rest.len()),
    };
    let (value, rest) = rest.split_at(end);
    let rest = rest.trim_start();
    let after = if rest.is_empty() { rest } else { rest.strip_prefix(',')? };
    Some((key, value.trim_end(), after.trim_start()))
}

/// The numbers of a tuple. Python 2 writes some of them as `5L`.
fn extents(tuple: &str) -> Option<Vec<usize>> {
    let inner = tuple.strip_prefix('(')?.strip_suffix(')')?.trim();
    let inner = inner.strip_suffix(',').unwrap_or(inner);
    if inner.is_empty() {
        return Some(Vec::new());
    }
    inner.split(',').map(|extent| extent.trim().trim_end_matches('L').parse().ok()).collect()
}

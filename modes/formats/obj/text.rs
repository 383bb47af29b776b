//! Cuts the text of an OBJ or MTL file into statements.
//!
//! Based on: Wavefront Technologies, "Advanced Visualizer Manual", appendix B1 "Object Files", 1992.

use std::borrow::Cow;

use crate::error::Problem;

/// The text behind a byte order mark, if the bytes are text in UTF-8 or in anything that shares ASCII with it.
pub(crate) fn text_of(bytes: &[u8]) -> Result<&[u8], Problem> {
    if bytes.starts_with(&[0xFE, 0xFF]) || bytes.starts_with(&[0xFF, 0xFE]) {
        return Err(Problem {
            line: None,
            what: "this is UTF-16 text; OBJ is read as UTF-8".to_owned(),
            remedy: "Convert it, for example with `iconv -f UTF-16 -t UTF-8`.",
        });
    }
    if bytes.contains(&0) {
        return Err(Problem {
            line: None,
            what: "this is binary data, not OBJ text: it contains zero bytes".to_owned(),
            remedy: "Export the scene as Wavefront OBJ, which is plain text.",
        });
    }
    Ok(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes))
}

/// The statements of a text, each with the line on which it starts, counted from 1.
///
/// Lines end in LF, CR LF or CR. One that ends in `\`, with or without blanks behind it, goes on in the next, unless it
/// holds a comment: comments often end in the name of a folder.
#[derive(Clone)]
pub(crate) struct Statements<'a> {
    rest: &'a [u8],
    lines_read: u64,
}

impl<'a> Statements<'a> {
    pub(crate) fn new(rest: &'a [u8]) -> Self {
        Self { rest, lines_read: 0 }
    }

    fn next_line(&mut self) -> &'a [u8] {
        self.lines_read += 1;
        let end = self.rest.iter().position(|&byte| byte == b'\n' || byte == b'\r');
        let (line, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = rest.strip_prefix(b"\r\n").or(rest.get(1..)).unwrap_or_default();
        line
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = (u64, Cow<'a, str>);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let mut line = self.next_line();
        let first = self.lines_read;
        let mut joined = String::new();
        while let Some(begun) =
            line.trim_ascii_end().strip_suffix(b"\\").filter(|begun| !begun.contains(&b'#'))
        {
            joined.push_str(&String::from_utf8_lossy(begun));
            joined.push(' ');
            line = self.next_line();
        }
        let last = String::from_utf8_lossy(line);
        Some((first, if joined.is_empty() { last } else { Cow::Owned(joined + &last) }))
    }
}

/// A statement's keyword and what follows it.
pub(crate) fn keyword(statement: &str) -> (&str, &str) {
    let statement = statement.trim();
    let (keyword, rest) = statement.split_once(char::is_whitespace).unwrap_or((statement, ""));
    (keyword, rest.trim_start())
}

/// The words of a statement up to a comment. A `#` inside a word is none: Microsoft's runtime prints NaN as `1.#QNAN`.
pub(crate) fn words(rest: &str) -> impl Iterator<Item = &str> {
    rest.split_whitespace().take_while(|word| !word.starts_with('#'))
}

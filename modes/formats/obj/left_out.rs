//! What a reader of OBJ leaves out or reads otherwise than it stands there: counted, with the first place, so that nothing
//! is missing in silence.
//!
//! Statements that change no geometry (smoothing groups, levels of detail, texture maps) are passed over without a word.
//!
//! Based on: Wavefront Technologies, "Advanced Visualizer Manual", appendix B1 "Object Files", 1992.

use std::fmt::Write as _;

use crate::formats::obj::text::words;

/// Kinds of what is left out or read otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Lines, points, and faces with fewer than three corners.
    Thin,
    /// Curves and surfaces.
    FreeForm,
    /// Other files and commands.
    Call,
    /// Statements that are not known.
    Unknown,
    /// Faces written `fo`.
    OldFace,
    /// Corners with the index 0 for a texture coordinate or a normal.
    Zero,
    /// Positions with a fourth number that is not 1.
    Weight,
}

/// What to say of each kind, in the order of [`Kind`].
const SAYINGS: [&str; 7] = [
    "lines, points and faces with fewer than three corners are left out",
    "curves and surfaces are not read and left out",
    "statements that call other files or programs are left out",
    "statements that are not known are left out",
    "statements `fo` are read as faces `f`",
    "corners with the index 0, which names nothing, are read without that texture coordinate or normal",
    "positions with a weight other than 1: weights belong to curves and surfaces and are left out",
];

/// Statements that make curves and surfaces, those of before 1992 as well.
const FREE_FORM: &[&str] = &["curv", "curv2", "surf", "bsp", "bzp", "cdc", "cdp"];
/// Statements without triangles of their own: attributes of free forms and of rendering, groups, names, tags.
const SILENT: &[&str] = &[
    "",
    "vp",
    "cstype",
    "deg",
    "bmat",
    "step",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "res",
    "s",
    "mg",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "usemap",
    "maplib",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
    "t",
];
/// Whether a statement may be passed over without a word: a comment, or one that changes no triangle. Creases are tags, `t`.
pub(crate) fn is_silent(keyword: &str) -> bool {
    SILENT.contains(&keyword) || keyword.starts_with('#')
}

/// The most characters of a statement that are shown.
const SHOWN: usize = 40;

/// Counts and first places, in the order of [`Kind`].
#[derive(Debug, Default)]
pub(crate) struct LeftOut([Option<(u64, u64, String)>; 7]);

impl LeftOut {
    /// Counts something that stands in a line.
    pub(crate) fn note(&mut self, kind: Kind, line: u64, text: &str) {
        let shown = || text.trim().chars().take(SHOWN).collect();
        self.0[kind as usize].get_or_insert_with(|| (0, line, shown())).0 += 1;
    }

    /// Counts a statement that is not passed on, if that matters.
    pub(crate) fn statement(&mut self, keyword: &str, line: u64, statement: &str) {
        let kind = match keyword {
            "l" | "p" => Kind::Thin,
            "call" | "csh" => Kind::Call,
            _ if FREE_FORM.contains(&keyword) => Kind::FreeForm,
            _ if is_silent(keyword) => return,
            _ => Kind::Unknown,
        };
        self.note(kind, line, statement);
    }

    /// Counts a position that has a fourth number which is not 1, given what follows its keyword.
    pub(crate) fn weight(&mut self, rest: &str, line: u64) {
        let mut further = words(rest).skip(3);
        if let (Some(weight), None) = (further.next(), further.next())
            && weight.parse::<f64>() != Ok(1.0)
        {
            self.note(Kind::Weight, line, rest);
        }
    }

    /// A sentence for each kind that there is.
    pub(crate) fn warnings(&self) -> impl Iterator<Item = String> + '_ {
        let found = self.0.iter().zip(SAYINGS).enumerate();
        found.filter_map(|(kind, (found, saying))| {
            let (count, line, text) = found.as_ref()?;
            let mut said = format!("{saying}: {count}");
            if kind != Kind::Thin as usize {
                // Writing to a string cannot fail.
                let _ = write!(said, ", the first in line {line}: `{text}`");
            }
            Some(said)
        })
    }
}

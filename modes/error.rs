//! What can go wrong outside the engine, and the exit code it leads to.

use std::path::PathBuf;

/// An error of the modes. Each says what is wrong, where, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Options that contradict each other or lie outside their range.
    #[error("{0}")]
    Usage(String),

    /// A file that cannot be read as a scene.
    #[error("{}{}: {problem}\n  {remedy}", path.display(), line.map(|l| format!(":{l}")).unwrap_or_default())]
    Input {
        /// The file.
        path: PathBuf,
        /// The line of the file, counted from 1, where it is known.
        line: Option<u64>,
        /// What is wrong there.
        problem: String,
        /// What the user can do about it.
        remedy: String,
    },

    /// A file that cannot be written. Nothing was changed under its name.
    #[error("{}: cannot write: {problem}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system or the encoder said.
        problem: String,
    },

    /// The engine refused its input.
    #[error(transparent)]
    Engine(#[from] umbel_core::Error),

    /// A limit that the user set was hit.
    #[error("{0}")]
    Limit(String),

    /// `verify` or a comparison found a difference.
    #[error("{0}")]
    Difference(String),
}

impl Error {
    /// The exit code of the command line: 1 runtime failure, 2 usage, 3 bad input, 4 limit, 5 difference.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Write { .. } => 1,
            Self::Usage(_) => 2,
            Self::Input { .. } => 3,
            Self::Engine(error) if error.is_about_rays() => 2,
            Self::Engine(_) => 3,
            Self::Limit(_) => 4,
            Self::Difference(_) => 5,
        }
    }
}

/// The remedy for a line of text that cannot be read.
pub(crate) const CORRECT_LINE: &str = "Correct the line, or export the file again.";

/// What is wrong in a file whose path the caller knows.
#[derive(Debug)]
pub(crate) struct Problem {
    pub(crate) line: Option<u64>,
    pub(crate) what: String,
    pub(crate) remedy: &'static str,
}

impl Problem {
    /// The error that names the file as well.
    pub(crate) fn at(self, path: &std::path::Path) -> Error {
        let Self { line, what: problem, remedy } = self;
        Error::Input { path: path.to_owned(), line, problem, remedy: remedy.to_owned() }
    }
}

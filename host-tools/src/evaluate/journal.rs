//! What an interrupted evaluation leaves: finished landmarks, one JSON object per line, after a line that says what is
//! evaluated. A line that was not finished does not count.

use std::{
    collections::BTreeMap,
    fs::{File, OpenOptions},
    io::{self, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use serde::{Deserialize, Serialize};

use super::evaluation::Evaluated;

/// The largest journal that is read: a million landmarks.
const MAX_BYTES: u64 = 4 << 30;

/// Finished landmarks of one evaluation.
#[derive(Debug, Default)]
pub struct Journal {
    known: BTreeMap<u32, Vec<Evaluated>>,
    file: Option<(PathBuf, Mutex<File>)>,
}

/// Why a journal cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// It cannot be read or written.
    #[error("{}: cannot read or write the journal: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// It is of something else.
    #[error("{}: a journal of another evaluation: expected {expected}, found {found}", path.display())]
    OtherEvaluation {
        /// The file.
        path: PathBuf,
        /// What is evaluated.
        expected: String,
        /// What it says it is of.
        found: String,
    },
    /// It is damaged.
    #[error("{}: line {line} is not an evaluated landmark: {error}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The line, 1-based.
        line: usize,
        /// What is wrong with it.
        error: serde_json::Error,
    },
}

/// A line about a landmark.
#[derive(Debug, Serialize, Deserialize)]
struct Line<E> {
    /// Its rank, 0-based.
    index: u32,
    /// By judge.
    evaluated: E,
}

impl Journal {
    /// No journal: nothing is known, and nothing is written.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// Opens the journal at `path`, or begins one. `of` says in one line what is evaluated.
    ///
    /// # Errors
    /// When it cannot be read or written, is of something else, or damaged.
    pub fn open(path: &Path, of: &str) -> Result<Self, JournalError> {
        let io = |source| JournalError::Io {
            path: path.to_owned(),
            source,
        };
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(io)?;
        let mut text = String::new();
        if file.metadata().map_err(io)?.len() > MAX_BYTES {
            return Err(io(io::Error::other("longer than any journal")));
        }
        (&mut file)
            .take(MAX_BYTES)
            .read_to_string(&mut text)
            .map_err(io)?;
        // What comes after the last end of a line was being written when the evaluation ended.
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let mut lines = text[..whole].lines();
        match lines.next() {
            Some(found) if found != of => {
                return Err(JournalError::OtherEvaluation {
                    path: path.to_owned(),
                    expected: of.to_owned(),
                    found: found.chars().take(200).collect(),
                });
            }
            None if !text.is_empty() && !of.starts_with(&text) => {
                return Err(JournalError::OtherEvaluation {
                    path: path.to_owned(),
                    expected: of.to_owned(),
                    found: text.chars().take(200).collect(),
                });
            }
            _ => {}
        }
        let mut known = BTreeMap::new();
        for (line, number) in lines.zip(2..) {
            let line: Line<Vec<Evaluated>> =
                serde_json::from_str(line).map_err(|error| JournalError::Damaged {
                    path: path.to_owned(),
                    line: number,
                    error,
                })?;
            known.insert(line.index, line.evaluated);
        }
        file.set_len(whole as u64).map_err(io)?;
        file.seek(SeekFrom::End(0)).map_err(io)?;
        if whole == 0 {
            writeln!(file, "{of}").map_err(io)?;
        }
        Ok(Self {
            known,
            file: Some((path.to_owned(), Mutex::new(file))),
        })
    }

    /// Number of landmarks that are finished.
    #[must_use]
    pub fn len(&self) -> usize {
        self.known.len()
    }

    /// Whether none is.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// What it knows about a landmark (0-based), by judge.
    #[must_use]
    pub fn known(&self, landmark: u32) -> Option<&[Evaluated]> {
        self.known.get(&landmark).map(Vec::as_slice)
    }

    /// Writes down a finished landmark.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn append(&self, landmark: u32, evaluated: &[Evaluated]) -> Result<(), JournalError> {
        let Some((path, file)) = &self.file else {
            return Ok(());
        };
        let line = serde_json::to_string(&Line {
            index: landmark,
            evaluated,
        });
        let written = line.map_err(io::Error::from).and_then(|line| {
            // A thread that panicked left at most an unfinished line.
            let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
            file.write_all(format!("{line}\n").as_bytes())
        });
        written.map_err(|source| JournalError::Io {
            path: path.clone(),
            source,
        })
    }
}

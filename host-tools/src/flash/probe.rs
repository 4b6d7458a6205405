//! A board's flash through a debug probe, by the program `probe-rs`.
//!
//! The program, not the library of that name: that is several hundred crates, and would take minutes to compile with every
//! build of ours. Used are `read`, `download` and `reset`, as versions from 0.27 on understand them.

use std::{
    env,
    ffi::{OsStr, OsString},
    io,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use eigenmark_core::slots::{RECORD_LEN, Record};

use super::{Board, Records, Slot};

/// The variable of the environment that names the program; without it, it is looked for on the path.
pub const PROGRAM_VARIABLE: &str = "EIGENMARK_PROBE_RS";

/// How to come by the program.
pub const INSTALL: &str = "install it with `cargo install probe-rs-tools --locked`, or as https://probe.rs/docs/getting-started/installation says";

/// What the program is called.
const PROGRAM: &str = "probe-rs";

/// Characters of what the program says that are told: its last ones.
const TOLD_LEN: usize = 800;

/// A debug probe that is connected to a board.
#[derive(Clone, Debug)]
pub struct Probe {
    program: PathBuf,
    board: &'static Board,
    selector: Option<String>,
}

/// Why the program did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum ProbeError {
    /// It is not there.
    #[error("{}: there is no such program: {INSTALL}; or name it in {PROGRAM_VARIABLE}", program.display())]
    Missing {
        /// What was looked for.
        program: PathBuf,
    },
    /// It cannot be started.
    #[error("{}: cannot be started: {source}", program.display())]
    Start {
        /// The program.
        program: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// It failed.
    #[error("{command} failed: {told}")]
    Failed {
        /// What it was asked.
        command: String,
        /// What it says.
        told: String,
    },
    /// It printed something else than what was asked for.
    #[error("{command}: expected {RECORD_LEN} bytes in hexadecimal, found {found:?}")]
    Unreadable {
        /// What it was asked.
        command: String,
        /// What it printed.
        found: String,
    },
}

impl Probe {
    /// The program that the environment names, for a board; `selector` (vendor:product, or vendor:product:serial) tells
    /// probes apart when there are several.
    #[must_use]
    pub fn new(board: &'static Board, selector: Option<String>) -> Self {
        let program = env::var_os(PROGRAM_VARIABLE).filter(|name| !name.is_empty());
        Self::by(
            program.unwrap_or_else(|| PROGRAM.into()).into(),
            board,
            selector,
        )
    }

    /// The same with a given program.
    #[must_use]
    pub fn by(program: PathBuf, board: &'static Board, selector: Option<String>) -> Self {
        Self {
            program,
            board,
            selector,
        }
    }

    /// Reads the records of both slots.
    ///
    /// # Errors
    /// When the program is missing or fails, or prints something else.
    pub fn records(&self) -> Result<Records, ProbeError> {
        Ok([self.record(Slot::A)?, self.record(Slot::B)?])
    }

    /// Writes what an Intel HEX file holds, and reads it back.
    ///
    /// # Errors
    /// When the program is missing or fails; also when it reads something else back.
    pub fn download(&self, file: &Path) -> Result<(), ProbeError> {
        self.run(&self.download_arguments(file)).map(drop)
    }

    /// Starts the board anew.
    ///
    /// # Errors
    /// When the program is missing or fails.
    pub fn reset(&self) -> Result<(), ProbeError> {
        self.run(&self.arguments("reset")).map(drop)
    }

    /// The commands, as for a shell, that read the records of both slots, write `file`, and reset.
    #[must_use]
    pub fn commands(&self, file: &Path) -> Vec<String> {
        let arguments = [
            self.read_arguments(Slot::A),
            self.read_arguments(Slot::B),
            self.download_arguments(file),
            self.arguments("reset"),
        ];
        arguments
            .iter()
            .map(|arguments| self.written(arguments))
            .collect()
    }

    fn record(&self, slot: Slot) -> Result<Option<Record>, ProbeError> {
        let arguments = self.read_arguments(slot);
        let printed = self.run(&arguments)?;
        let bytes = bytes_of(&printed).ok_or_else(|| ProbeError::Unreadable {
            command: self.written(&arguments),
            found: told(&printed),
        })?;
        Ok(Record::decode(&bytes))
    }

    /// The beginning of every command.
    fn arguments(&self, command: &str) -> Vec<OsString> {
        let mut arguments = vec![command, "--non-interactive", "--chip", self.board.chip];
        if let Some(selector) = &self.selector {
            arguments.extend(["--probe", selector]);
        }
        arguments.into_iter().map(OsString::from).collect()
    }

    fn read_arguments(&self, slot: Slot) -> Vec<OsString> {
        let address = format!("{:#010x}", self.board.record_at(slot));
        let mut arguments = self.arguments("read");
        arguments.extend(["b8".into(), address.into(), RECORD_LEN.to_string().into()]);
        arguments
    }

    fn download_arguments(&self, file: &Path) -> Vec<OsString> {
        let mut arguments = self.arguments("download");
        let options = [
            "--binary-format",
            "hex",
            "--verify",
            "--disable-progressbars",
        ];
        arguments.extend(options.map(OsString::from));
        arguments.push(file.into());
        arguments
    }

    /// Runs the program; gives what it prints.
    fn run(&self, arguments: &[OsString]) -> Result<String, ProbeError> {
        let ran = Command::new(&self.program)
            .args(arguments)
            .stdin(Stdio::null())
            .output();
        let output = ran.map_err(|source| {
            let program = self.program.clone();
            match source.kind() {
                io::ErrorKind::NotFound => ProbeError::Missing { program },
                _ => ProbeError::Start { program, source },
            }
        })?;
        let [stdout, stderr] = [output.stdout, output.stderr]
            .map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        if output.status.success() {
            return Ok(stdout);
        }
        let said = if stderr.trim().is_empty() {
            stdout
        } else {
            stderr
        };
        let told = match told(&said) {
            told if told.is_empty() => output.status.to_string(),
            told => told,
        };
        Err(ProbeError::Failed {
            command: self.written(arguments),
            told,
        })
    }

    /// A command as for a shell.
    fn written(&self, arguments: &[OsString]) -> String {
        let words = std::iter::once(self.program.as_os_str())
            .chain(arguments.iter().map(OsString::as_os_str));
        words.map(quoted).collect::<Vec<_>>().join(" ")
    }
}

/// A word as a shell takes it.
fn quoted(word: &OsStr) -> String {
    let word = word.to_string_lossy();
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-_./:=@+".contains(letter);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.into_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// The end of what the program says, on one line.
fn told(said: &str) -> String {
    let line = said.split_whitespace().collect::<Vec<_>>().join(" ");
    let skipped = line.chars().count().saturating_sub(TOLD_LEN);
    line.chars().skip(skipped).collect()
}

/// The bytes that `probe-rs read b8` prints: two digits each, in lines that may begin with their address and a colon.
fn bytes_of(printed: &str) -> Option<[u8; RECORD_LEN]> {
    let words = printed.lines().flat_map(|line| {
        line.split_once(':')
            .map_or(line, |(_, bytes)| bytes)
            .split_whitespace()
    });
    let is_byte =
        |word: &str| word.len() == 2 && word.bytes().all(|digit| digit.is_ascii_hexdigit());
    let bytes: Option<Vec<u8>> = words
        .map(|word| u8::from_str_radix(word, 16).ok().filter(|_| is_byte(word)))
        .collect();
    bytes?.try_into().ok()
}

#[cfg(test)]
mod tests;

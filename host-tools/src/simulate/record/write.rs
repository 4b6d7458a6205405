//! Writing a recording: into a temporary directory beside the target, which gets its name at the end.

use std::{
    fs::{self, File},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use image::{
    ExtendedColorType, ImageEncoder,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};
use tempfile::TempDir;

use super::{FRAMES, HEADER, Header, LOG, RecordError, line::Line};
use crate::{
    output::{OutputError, write_file},
    simulate::{CameraFrame, End, Flight, FlightSettings, Pilot, Step, World, fly_watched},
};

/// A recording that is being written; nothing is left of one that is not finished.
#[derive(Debug)]
pub struct Recorder {
    header: Header,
    target: PathBuf,
    directory: TempDir,
    log: BufWriter<File>,
}

/// Flies, and records the flight in the directory `target`.
///
/// # Errors
/// When the settings make no sense, or the recording cannot be written; also when `target` exists and is not empty.
pub fn fly_recorded(
    world: &World<'_>,
    settings: &FlightSettings,
    pilot: &mut impl Pilot,
    atlas_crc: Option<u32>,
    target: &Path,
) -> Result<Flight, RecordError> {
    let mut recorder = Recorder::create(target, Header::new(world, settings, atlas_crc))?;
    let mut steps = Vec::new();
    let end = fly_watched(world, settings, pilot, |step, frame| {
        recorder.add(&step, frame)?;
        steps.push(step);
        Ok(())
    })?;
    recorder.finish(Some(end))?;
    Ok(Flight {
        settings: *settings,
        steps,
        end,
    })
}

impl Recorder {
    /// Checks that a recording of that name could be written: before long work, not after it. Gives the directory that
    /// it would be in.
    ///
    /// # Errors
    /// When that directory does not exist, or `target` exists and is not empty.
    pub fn check(target: &Path) -> Result<&Path, OutputError> {
        let error = at(target);
        match fs::read_dir(target).map(|mut entries| entries.next().is_some()) {
            Ok(true) => return Err(error(io::ErrorKind::DirectoryNotEmpty.into())),
            Ok(false) => {}
            Err(missing) if missing.kind() == io::ErrorKind::NotFound => {}
            Err(other) => return Err(error(other)),
        }
        let parent = match target.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        if !parent.is_dir() {
            return Err(error(io::ErrorKind::NotFound.into()));
        }
        Ok(parent)
    }

    /// Begins a recording that will have the name `target`.
    ///
    /// # Errors
    /// When that cannot be written, or exists and is not empty.
    pub fn create(target: &Path, header: Header) -> Result<Self, OutputError> {
        let error = at(target);
        let parent = Self::check(target)?;
        let directory = TempDir::with_prefix_in(".recording-", parent).map_err(&error)?;
        fs::create_dir(directory.path().join(FRAMES)).map_err(&error)?;
        let log = File::create_new(directory.path().join(LOG)).map_err(&error)?;
        Ok(Self {
            header,
            target: target.to_owned(),
            directory,
            log: BufWriter::new(log),
        })
    }

    /// Adds a step.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn add(&mut self, step: &Step, frame: Option<&CameraFrame>) -> Result<(), OutputError> {
        let error = at(&self.target);
        let name = frame.map(|_| format!("{:06}.png", self.header.steps));
        if let (Some(frame), Some(name)) = (frame, &name) {
            let path = self.directory.path().join(FRAMES).join(name);
            write_png(&path, frame).map_err(&error)?;
        }
        serde_json::to_writer(&mut self.log, &Line::of(step, name.as_deref()))
            .map_err(io::Error::from)
            .and_then(|()| self.log.write_all(b"\n"))
            .map_err(&error)?;
        self.header.steps += 1;
        Ok(())
    }

    /// What it will say about the whole flight, if that becomes known only on the way.
    pub fn header_mut(&mut self) -> &mut Header {
        &mut self.header
    }

    /// Ends the recording: from now on it is there. Also says how the flight ended, if that is known.
    ///
    /// # Errors
    /// When it cannot be written, or something got its name meanwhile.
    pub fn finish(mut self, end: Option<End>) -> Result<(), OutputError> {
        self.header.end = end;
        self.log.flush().map_err(at(&self.target))?;
        write_file(&self.directory.path().join(HEADER), |file| {
            serde_json::to_writer_pretty(&mut *file, &self.header)?;
            file.write_all(b"\n")
        })?;
        make_readable(self.directory.path()).map_err(at(&self.target))?;
        fs::rename(self.directory.path(), &self.target).map_err(at(&self.target))?;
        // What had the temporary name is gone.
        let _ = self.directory.keep();
        Ok(())
    }
}

fn at(path: &Path) -> impl Fn(io::Error) -> OutputError + use<> {
    let path = path.to_owned();
    move |source| OutputError {
        path: path.clone(),
        source,
    }
}

/// Noise does not compress: quickly instead of tightly.
fn write_png(path: &Path, frame: &CameraFrame) -> io::Result<()> {
    let file = BufWriter::new(File::create_new(path)?);
    PngEncoder::new_with_quality(file, CompressionType::Fast, FilterType::Sub)
        .write_image(
            &frame.pixels,
            frame.width.into(),
            frame.height.into(),
            ExtendedColorType::L8,
        )
        .map_err(io::Error::other)
}

/// Temporary directories are private; results are as readable as any new one would usually be.
#[cfg(unix)]
fn make_readable(directory: &Path) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(directory, fs::Permissions::from_mode(0o755))
}

#[cfg(not(unix))]
fn make_readable(_: &Path) -> io::Result<()> {
    Ok(())
}

//! The emulated board: firmware and atlases in the flash of QEMU's Netduino Plus 2, as a flashed board would have them.
//!
//! Its wires (USART1 to a host, USART2 to an autopilot) are TCP connections to this process; defmt logs come over
//! semihosting on the emulator's stdout and are decoded with the firmware's own table. Camera and flash are files.

use std::{
    fs,
    io::{BufReader, ErrorKind, Read, Write},
    net::{TcpListener, TcpStream},
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::mpsc,
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, Result, bail, ensure};
use defmt_decoder::{DecodeError, Table};
use eigenmark::{atlas::AtlasBuffer, link::BoardLink, simulate::CameraFrame};
use eigenmark_core::link::{PART_LEN, Reply, Report, Request};
use object::{Object, ObjectSegment, ObjectSymbol};

use crate::cli;

/// The emulator.
pub const QEMU: &str = "qemu-system-arm";

/// Symbols of the atlas region's start, of its second slot, and of its end: what `memory.x` exports.
const REGION: [&str; 3] = ["__atlas_start", "__atlas_slot_b", "__atlas_end"];

/// The files that stand for what the emulator does not have, in the directory where it is started.
const FLASH: &str = "flash.bin";
const CAMERA: &str = "camera.bin";

/// How long the board may take to answer, or a program to end; many times what either needs.
const PATIENCE: Duration = Duration::from_secs(600);

/// How long a question may go unanswered before it is asked again.
const RETRY: Duration = Duration::from_millis(300);

/// A board to be started. Its flash stays what it is between starts.
#[derive(Debug)]
pub struct Board {
    firmware: PathBuf,
    files: tempfile::TempDir,
    /// Where the region lies in memory, and the offset of its second slot.
    start: u64,
    slot_len: usize,
    region_len: usize,
}

/// A board that runs, and its wires.
#[derive(Debug)]
pub struct Running {
    emulator: Emulator,
    link: BoardLink,
    stream: TcpStream,
    camera: PathBuf,
    frames: u32,
}

/// The emulator's process; it ends with this.
#[derive(Debug)]
struct Emulator(Child);

/// One decoded log message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Log {
    /// Its level; `None` for plain output.
    pub level: Option<String>,
    /// Its text.
    pub text: String,
}

/// Builds one binary of the firmware.
///
/// # Errors
/// When cargo fails.
pub fn firmware(name: &str) -> Result<PathBuf> {
    firmware_with(name, &[])
}

/// The same with more arguments for cargo.
///
/// # Errors
/// When cargo fails.
pub fn firmware_with(name: &str, more: &[&str]) -> Result<PathBuf> {
    let arguments = [
        "--package",
        "eigenmark-firmware",
        "--profile",
        "firmware",
        "--bin",
        name,
    ];
    let target = ["--target", "thumbv7em-none-eabihf"];
    Ok(cli::build(&[&arguments[..], &target, more].concat())?.remove(0))
}

/// Bytes of flash that a firmware file fills: the segments that are loaded.
///
/// # Errors
/// When it is not an ELF file.
pub fn flash_bytes(elf: &[u8]) -> Result<u64> {
    let file = object::File::parse(elf)?;
    Ok(file.segments().map(|segment| segment.file_range().1).sum())
}

/// Whether the emulator is there: false, and said, when it is missing and may be.
///
/// # Panics
/// When it is missing and must not be.
#[must_use]
pub fn is_there() -> bool {
    let is_there = has_emulator();
    if !is_there {
        let absent = format!("{QEMU} is missing; tests/run says how to install it");
        assert!(
            std::env::var_os("EIGENMARK_REQUIRE_EMULATOR").is_none(),
            "{absent}"
        );
        println!("skipped: {absent}");
    }
    is_there
}

/// Whether the emulator can be started.
fn has_emulator() -> bool {
    Command::new(QEMU)
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|s| s.success())
}

impl Board {
    /// A board flashed with a firmware file and an empty atlas region.
    ///
    /// # Errors
    /// When the file is not firmware.
    pub fn flashed(firmware: &Path) -> Result<Self> {
        let elf = fs::read(firmware).with_context(|| firmware.display().to_string())?;
        let elf = object::File::parse(&*elf)?;
        let address = |name: &str| {
            let symbol = elf.symbol_by_name(name);
            symbol
                .map(|symbol| symbol.address())
                .with_context(|| format!("the firmware has no symbol {name}"))
        };
        let [start, second, end] = REGION.map(address);
        let (start, second, end) = (start?, second?, end?);
        let board = Self {
            // The emulator is started elsewhere.
            firmware: fs::canonicalize(firmware)?,
            files: tempfile::tempdir()?,
            start,
            slot_len: usize::try_from(second - start)?,
            region_len: usize::try_from(end - start)?,
        };
        fs::write(board.flash(), vec![0xff; board.region_len])?;
        fs::write(board.camera(), [])?;
        Ok(board)
    }

    /// Flashes an atlas to a slot (0 or 1), as a probe does that writes no record.
    ///
    /// # Errors
    /// When it does not fit, or the file of the flash cannot be written.
    pub fn flash_atlas(&self, slot: usize, atlas: &AtlasBuffer) -> Result<()> {
        let offset = slot * self.slot_len;
        let (len, room) = (atlas.bytes().len(), self.region_len - offset);
        ensure!(
            len <= room,
            "an atlas of {len} bytes does not fit into the {room} bytes from slot {slot} on"
        );
        self.change_flash(|flash| flash[offset..offset + len].copy_from_slice(atlas.bytes()))
    }

    /// The same for the first slot, with a new board.
    ///
    /// # Errors
    /// As for both.
    pub fn with_atlas(firmware: &Path, atlas: &AtlasBuffer) -> Result<Self> {
        let board = Self::flashed(firmware)?;
        board.flash_atlas(0, atlas)?;
        Ok(board)
    }

    /// Changes what is in the atlas region.
    ///
    /// # Errors
    /// When the file of the flash cannot be read or written.
    pub fn change_flash(&self, change: impl FnOnce(&mut [u8])) -> Result<()> {
        let mut flash = fs::read(self.flash())?;
        change(&mut flash);
        Ok(fs::write(self.flash(), flash)?)
    }

    /// Bytes of a slot.
    #[must_use]
    pub fn slot_len(&self) -> usize {
        self.slot_len
    }

    fn flash(&self) -> PathBuf {
        self.files.path().join(FLASH)
    }

    fn camera(&self) -> PathBuf {
        self.files.path().join(CAMERA)
    }

    /// Runs a program that ends by itself, hands every log to `log` as it comes, and gives the exit code.
    ///
    /// # Errors
    /// When the emulator does not start, the logs do not decode, or the program does not end in time.
    pub fn run(&self, mut log: impl FnMut(Log)) -> Result<i32> {
        let mut command = self.command();
        // An instruction takes a nanosecond, so that timers, too, are deterministic.
        command.args(["-icount", "shift=0"]);
        let mut emulator = Emulator::start(&mut command)?;
        let (sender, received) = mpsc::channel();
        let decoder = self.decode_logs(&mut emulator.0, move |log| drop(sender.send(log)))?;
        let deadline = Instant::now() + PATIENCE;
        loop {
            match received.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(message) => log(message),
                Err(mpsc::RecvTimeoutError::Disconnected) => break,
                Err(mpsc::RecvTimeoutError::Timeout) => {
                    bail!("the program did not end within {PATIENCE:?}");
                }
            }
        }
        decoder
            .join()
            .map_err(|_| anyhow::anyhow!("the log decoder panicked"))??;
        let status = emulator.0.wait()?;
        Ok(status.code().unwrap_or(-1))
    }

    /// Starts the navigator, and connects to its host's wire.
    ///
    /// # Errors
    /// When the emulator does not start or connect.
    pub fn start(&self, log: impl FnMut(Log) + Send + 'static) -> Result<Running> {
        self.start_wired(None, log)
    }

    /// The same, with somebody who listens at that address for the wire to the autopilot, and reads what it is told.
    ///
    /// # Errors
    /// When the emulator does not start or connect.
    pub fn start_with_autopilot(
        &self,
        address: &str,
        log: impl FnMut(Log) + Send + 'static,
    ) -> Result<Running> {
        self.start_wired(Some(address), log)
    }

    fn start_wired(
        &self,
        autopilot: Option<&str>,
        log: impl FnMut(Log) + Send + 'static,
    ) -> Result<Running> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let host = listener.local_addr()?.to_string();
        let mut command = self.command();
        for address in [Some(&*host), autopilot] {
            let device = address.map_or("null".to_owned(), |address| format!("tcp:{address}"));
            command.arg("-serial").arg(device);
        }
        let mut emulator = Emulator::start(&mut command)?;
        let stream = emulator.accept(&listener)?;
        stream.set_nodelay(true)?;
        self.decode_logs(&mut emulator.0, log)?;
        let mut running = Running {
            emulator,
            link: BoardLink::over("the emulated board", Box::new(stream.try_clone()?)),
            stream,
            camera: self.camera(),
            frames: 0,
        };
        running.wait_until_ready()?;
        Ok(running)
    }

    /// The emulator with this board's flash.
    fn command(&self) -> Command {
        let mut command = Command::new(QEMU);
        command
            .current_dir(self.files.path())
            .args(["-machine", "netduinoplus2", "-display", "none"])
            .args(["-monitor", "none"])
            .args(["-semihosting-config", "enable=on,target=native"])
            .arg("-kernel")
            .arg(&self.firmware)
            .arg("-device")
            .arg(format!(
                "loader,file={FLASH},addr={:#x},force-raw=on",
                self.start
            ))
            .stdin(Stdio::null());
        command
    }

    /// Decodes the emulator's stdout on a thread of its own.
    fn decode_logs(
        &self,
        emulator: &mut Child,
        mut log: impl FnMut(Log) + Send + 'static,
    ) -> Result<thread::JoinHandle<Result<()>>> {
        let elf = fs::read(&self.firmware).with_context(|| self.firmware.display().to_string())?;
        let table = Table::parse(&elf)?.context("the firmware has no defmt table")?;
        let mut stdout = BufReader::new(emulator.stdout.take().context("stdout is piped")?);
        Ok(thread::spawn(move || {
            let mut decoder = table.new_stream_decoder();
            let mut buffer = [0; 4096];
            loop {
                let len = stdout.read(&mut buffer)?;
                if len == 0 {
                    return Ok(());
                }
                decoder.received(&buffer[..len]);
                loop {
                    match decoder.decode() {
                        Ok(frame) => log(Log {
                            level: frame.level().map(|level| level.as_str().to_owned()),
                            text: frame.display_message().to_string(),
                        }),
                        Err(DecodeError::UnexpectedEof) => break,
                        Err(DecodeError::Malformed) => bail!("a log does not decode"),
                    }
                }
            }
        }))
    }
}

impl Running {
    /// Asks who is there until someone is: bytes that arrive before the firmware has started its link are lost.
    fn wait_until_ready(&mut self) -> Result<()> {
        let is_answer = |reply: &Reply| matches!(reply, Reply::Identity(_));
        self.insist(&Request::Identify, is_answer)?;
        Ok(())
    }

    /// The link to the host.
    pub fn link(&mut self) -> &mut BoardLink {
        &mut self.link
    }

    /// Sends a request once, and waits for its reply.
    ///
    /// # Errors
    /// When the link breaks, or the board says nothing in time.
    pub fn ask(&mut self, request: &Request<'_>) -> Result<Reply> {
        self.link.send(request)?;
        let is_identify = matches!(request, Request::Identify);
        self.reply_that(|reply| is_identify || !matches!(reply, Reply::Identity(_)))
    }

    /// Asks until there is the reply that is asked for: a board that starts anew loses what it is sent meanwhile.
    ///
    /// # Errors
    /// When the link breaks, or the board does not answer in time.
    pub fn insist(
        &mut self,
        request: &Request<'_>,
        is_it: impl Fn(&Reply) -> bool,
    ) -> Result<Reply> {
        let deadline = Instant::now() + PATIENCE;
        loop {
            match self.link.ask(request, 3 * RETRY, &is_it) {
                Ok(reply) => return Ok(reply),
                Err(error) => ensure!(Instant::now() < deadline, "{error}"),
            }
        }
    }

    /// Waits for a reply. Late answers to the first question of all are skipped.
    ///
    /// # Errors
    /// When the link breaks, or the board says nothing in time.
    pub fn reply(&mut self) -> Result<Reply> {
        self.reply_that(|reply| !matches!(reply, Reply::Identity(_)))
    }

    /// Waits for a reply that is neither a report nor something else than asked for.
    fn reply_that(&mut self, is_asked_for: impl Fn(&Reply) -> bool) -> Result<Reply> {
        loop {
            match self.link.receive(PATIENCE)? {
                None => bail!("the board said nothing for {PATIENCE:?}"),
                Some(Reply::Report(_) | Reply::Picture { .. }) => {}
                Some(reply) if is_asked_for(&reply) => return Ok(reply),
                Some(_) => {}
            }
        }
    }

    /// Leaves out what comes until nothing has for a while.
    ///
    /// # Errors
    /// When the link breaks.
    pub fn drain(&mut self) -> Result<()> {
        while self.link.receive(RETRY)?.is_some() {}
        Ok(())
    }

    /// Waits for the next report.
    ///
    /// # Errors
    /// When the link breaks, or the board says nothing in time.
    pub fn report(&mut self) -> Result<Report> {
        loop {
            match self.link.receive(PATIENCE)? {
                None => bail!("the board reported nothing for {PATIENCE:?}"),
                Some(Reply::Report(report)) => return Ok(report),
                Some(_) => {}
            }
        }
    }

    /// Sends a frame to be located, and waits for the answer.
    ///
    /// # Errors
    /// When the link breaks, or the board says nothing in time.
    pub fn locate(&mut self, sequence: u32, frame: &CameraFrame) -> Result<Reply> {
        let (width, height) = (frame.width, frame.height);
        self.link.send(&Request::Frame {
            sequence,
            width,
            height,
        })?;
        for (bytes, offset) in frame.pixels.chunks(PART_LEN).zip((0..).step_by(PART_LEN)) {
            self.link.send(&Request::Pixels { offset, bytes })?;
        }
        self.reply()
    }

    /// Shows the camera a frame, taken at that time.
    ///
    /// # Errors
    /// When the camera's file cannot be written.
    pub fn show(&mut self, frame: &CameraFrame, time_us: u64) -> Result<()> {
        self.show_part(frame, time_us, usize::MAX)
    }

    /// Shows it so many bytes of a frame, its number in front included: 24 more than its pixels are all.
    ///
    /// # Errors
    /// When the camera's file cannot be written.
    pub fn show_part(&mut self, frame: &CameraFrame, time_us: u64, len: usize) -> Result<()> {
        self.frames += 1;
        let number = self.frames.to_le_bytes();
        let mut bytes = Vec::with_capacity(frame.pixels.len() + 24);
        bytes.extend([0; 8]);
        bytes.extend(time_us.to_le_bytes());
        bytes.extend(frame.width.to_le_bytes());
        bytes.extend(frame.height.to_le_bytes());
        bytes.extend(&frame.pixels);
        bytes.extend(number);
        bytes.truncate(len);
        // The number in front comes last: it says that all the rest is there.
        let file = fs::OpenOptions::new().write(true).open(&self.camera)?;
        file.write_all_at(&bytes[4..], 4)?;
        Ok(file.write_all_at(&number, 0)?)
    }

    /// The file of the camera, for whoever wants to break it.
    #[must_use]
    pub fn camera(&self) -> &Path {
        &self.camera
    }

    /// Sends bytes to the host's wire as they are.
    ///
    /// # Errors
    /// When the link breaks.
    pub fn send(&mut self, bytes: &[u8]) -> Result<()> {
        Ok(self.stream.write_all(bytes)?)
    }

    /// Cuts power.
    pub fn cut(self) {
        drop(self);
    }

    /// Waits until the firmware ends the emulator, as it does to start anew with what is in flash by then.
    ///
    /// # Errors
    /// When it does not in time.
    pub fn wait_for_restart(mut self) -> Result<()> {
        let deadline = Instant::now() + PATIENCE;
        while self.emulator.0.try_wait()?.is_none() {
            ensure!(
                Instant::now() < deadline,
                "the board did not start anew within {PATIENCE:?}"
            );
            thread::sleep(Duration::from_millis(5));
        }
        Ok(())
    }
}

impl Emulator {
    fn start(command: &mut Command) -> Result<Self> {
        Ok(Self(command.stdout(Stdio::piped()).spawn().context(QEMU)?))
    }

    /// Waits for the emulator to connect.
    fn accept(&mut self, listener: &TcpListener) -> Result<TcpStream> {
        listener.set_nonblocking(true)?;
        let deadline = Instant::now() + PATIENCE;
        loop {
            match listener.accept() {
                Ok((stream, _)) => {
                    stream.set_nonblocking(false)?;
                    return Ok(stream);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    thread::sleep(Duration::from_millis(5));
                }
                Err(error) => return Err(error.into()),
            }
            if let Some(status) = self.0.try_wait()? {
                bail!("{QEMU} ended at once: {status}");
            }
            ensure!(
                Instant::now() < deadline,
                "{QEMU} did not connect within {PATIENCE:?}"
            );
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

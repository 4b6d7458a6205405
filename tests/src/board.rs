//! The emulated board: firmware and atlases in the flash of QEMU's Netduino Plus 2, as a flashed board would have them.
//!
//! The link (USART1) is a TCP connection to this process; defmt logs come over semihosting on the emulator's stdout and
//! are decoded with the firmware's own table.

use std::{
    io::{BufReader, ErrorKind, Read, Write},
    net::{TcpListener, TcpStream},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::mpsc,
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, Result, bail, ensure};
use defmt_decoder::{DecodeError, Table};
use eigenmark::atlas::AtlasBuffer;
use eigenmark_core::link::{MAX_REPLY_LEN, MAX_REQUEST_LEN, Receiver, Reply, Request, encode};
use object::{Object, ObjectSegment, ObjectSymbol};

use crate::cli;

/// The emulator.
pub const QEMU: &str = "qemu-system-arm";

/// Symbols of the slots' starts, and of the region's end: what `memory.x` exports.
const SLOTS: [&str; 2] = ["__atlas_start", "__atlas_slot_b"];
const REGION_END: &str = "__atlas_end";

/// How long the board may take to answer, or a program to end; many times what either needs.
const PATIENCE: Duration = Duration::from_secs(600);

/// How long a question may go unanswered before it is asked again.
const RETRY: Duration = Duration::from_millis(300);

/// A board to be started.
#[derive(Debug)]
pub struct Board {
    firmware: PathBuf,
    slots: [Option<AtlasBuffer>; 2],
}

/// A board that runs, and its link.
#[derive(Debug)]
pub struct Running {
    _emulator: Emulator,
    stream: TcpStream,
    receiver: Receiver<MAX_REPLY_LEN>,
    _files: tempfile::TempDir,
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

/// Whether the emulator can be started.
#[must_use]
pub fn has_emulator() -> bool {
    Command::new(QEMU)
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|s| s.success())
}

impl Board {
    /// A board flashed with a firmware file and an empty atlas region.
    #[must_use]
    pub fn flashed(firmware: &Path) -> Self {
        Self {
            firmware: firmware.to_owned(),
            slots: [None, None],
        }
    }

    /// The same with an atlas in its next empty slot.
    ///
    /// # Panics
    /// When both slots are taken.
    #[must_use]
    pub fn with_atlas(mut self, atlas: &AtlasBuffer) -> Self {
        let empty = self.slots.iter_mut().find(|slot| slot.is_none());
        *empty.expect("a board has two slots") = Some(atlas.clone());
        self
    }

    /// The same with an atlas in its second slot, whatever is in the first.
    #[must_use]
    pub fn with_atlas_in_second_slot(mut self, atlas: &AtlasBuffer) -> Self {
        self.slots[1] = Some(atlas.clone());
        self
    }

    /// Runs a program that ends by itself, hands every log to `log` as it comes, and gives the exit code.
    ///
    /// # Errors
    /// When the emulator does not start, the logs do not decode, or the program does not end in time.
    pub fn run(&self, mut log: impl FnMut(Log)) -> Result<i32> {
        let files = tempfile::tempdir()?;
        let mut command = self.command(files.path())?;
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

    /// Starts a program that serves the link, and connects to it.
    ///
    /// # Errors
    /// When the emulator does not start or connect.
    pub fn start(&self, log: impl FnMut(Log) + Send + 'static) -> Result<Running> {
        let files = tempfile::tempdir()?;
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let address = listener.local_addr()?;
        let mut command = self.command(files.path())?;
        command.arg("-serial").arg(format!("tcp:{address}"));
        let mut emulator = Emulator::start(&mut command)?;
        let stream = emulator.accept(&listener)?;
        stream.set_nodelay(true)?;
        self.decode_logs(&mut emulator.0, log)?;
        let mut running = Running {
            _emulator: emulator,
            stream,
            receiver: Receiver::new(),
            _files: files,
        };
        running.wait_until_ready()?;
        Ok(running)
    }

    /// The emulator with this board's flash.
    fn command(&self, directory: &Path) -> Result<Command> {
        let mut command = Command::new(QEMU);
        command
            .args([
                "-machine",
                "netduinoplus2",
                "-display",
                "none",
                "-monitor",
                "none",
            ])
            .args(["-semihosting-config", "enable=on,target=native"])
            .arg("-kernel")
            .arg(&self.firmware)
            .stdin(Stdio::null());
        let elf =
            std::fs::read(&self.firmware).with_context(|| self.firmware.display().to_string())?;
        let elf = object::File::parse(&*elf)?;
        let address = |name: &str| {
            let symbol = elf.symbol_by_name(name);
            symbol
                .map(|symbol| symbol.address())
                .with_context(|| format!("the firmware has no symbol {name}"))
        };
        for (slot, name) in self.slots.iter().zip(SLOTS) {
            let Some(atlas) = slot else { continue };
            let start = address(name)?;
            // The first atlas may fill the whole region when there is no second one.
            let is_split = name == SLOTS[0] && self.slots[1].is_some();
            let room = address(if is_split { SLOTS[1] } else { REGION_END })? - start;
            let len = atlas.bytes().len() as u64;
            ensure!(
                len <= room,
                "an atlas of {len} bytes does not fit into the {room} bytes at {name}"
            );
            let file = directory.join(format!("{name}.atlas"));
            std::fs::write(&file, atlas.bytes())?;
            let device = format!(
                "loader,file={},addr={start:#x},force-raw=on",
                file.display()
            );
            command.arg("-device").arg(device);
        }
        Ok(command)
    }

    /// Decodes the emulator's stdout on a thread of its own.
    fn decode_logs(
        &self,
        emulator: &mut Child,
        mut log: impl FnMut(Log) + Send + 'static,
    ) -> Result<thread::JoinHandle<Result<()>>> {
        let elf =
            std::fs::read(&self.firmware).with_context(|| self.firmware.display().to_string())?;
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
        self.stream.set_read_timeout(Some(RETRY))?;
        let deadline = Instant::now() + PATIENCE;
        while self.ask(&Request::Identify).is_err() {
            ensure!(
                Instant::now() < deadline,
                "the board did not identify itself within {PATIENCE:?}"
            );
        }
        self.stream.set_read_timeout(Some(PATIENCE))?;
        Ok(())
    }

    /// Sends a request and waits for its reply. Late answers to earlier questions are skipped.
    ///
    /// # Errors
    /// When the link breaks or the reply is damaged.
    pub fn ask(&mut self, request: &Request<'_>) -> Result<Reply> {
        let (mut scratch, mut packet) = (vec![0; MAX_REQUEST_LEN], vec![0; MAX_REQUEST_LEN]);
        let packet = encode(request, &mut scratch, &mut packet)?;
        self.send(packet)?;
        loop {
            let reply = self.reply()?;
            let is_identity = matches!(reply, Reply::Identity(_));
            if is_identity == matches!(request, Request::Identify) {
                return Ok(reply);
            }
        }
    }

    /// Sends bytes as they are.
    ///
    /// # Errors
    /// When the link breaks.
    pub fn send(&mut self, bytes: &[u8]) -> Result<()> {
        Ok(self.stream.write_all(bytes)?)
    }

    /// Waits for the next reply.
    ///
    /// # Errors
    /// When the link breaks, the board says nothing in time, or the reply is damaged.
    pub fn reply(&mut self) -> Result<Reply> {
        let mut byte = [0];
        loop {
            ensure!(self.stream.read(&mut byte)? == 1, "the board hung up");
            if let Some(reply) = self.receiver.push::<Reply>(byte[0]) {
                return Ok(reply?);
            }
        }
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

//! What carries bytes to a board and back: a serial line or TCP.

use std::{
    io::{self, Read, Write},
    net::{TcpStream, ToSocketAddrs},
    time::Duration,
};

use serialport::SerialPort;

/// Bits per second of a board's serial line, unless it is told otherwise.
pub const DEFAULT_BAUD: u32 = 115_200;

/// How long a connection may take to come about, and a write to be taken.
const PATIENCE: Duration = Duration::from_secs(5);

/// Begins the names of TCP connections: `tcp:HOST:PORT`.
const TCP: &str = "tcp:";

/// Bytes both ways, with a time-out for reading.
pub trait Wire: Read + Write + Send {
    /// Reading gives up with [`io::ErrorKind::TimedOut`] or [`io::ErrorKind::WouldBlock`] after that long; longer than 0.
    ///
    /// # Errors
    /// What the system says.
    fn set_patience(&mut self, patience: Duration) -> io::Result<()>;
}

impl Wire for TcpStream {
    fn set_patience(&mut self, patience: Duration) -> io::Result<()> {
        self.set_read_timeout(Some(patience))
    }
}

impl Wire for Box<dyn SerialPort> {
    fn set_patience(&mut self, patience: Duration) -> io::Result<()> {
        Ok(self.set_timeout(patience)?)
    }
}

/// Opens the serial port or TCP connection of that name.
pub(super) fn open(name: &str, baud: u32) -> io::Result<Box<dyn Wire>> {
    match name.strip_prefix(TCP) {
        Some(address) => Ok(Box::new(connect(address)?)),
        None => {
            let port = serialport::new(name, baud).timeout(PATIENCE).open()?;
            Ok(Box::new(port))
        }
    }
}

fn connect(address: &str) -> io::Result<TcpStream> {
    let mut last = io::Error::new(io::ErrorKind::InvalidInput, "expected tcp:HOST:PORT");
    if !address.contains(':') {
        return Err(last);
    }
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, PATIENCE) {
            Ok(stream) => {
                stream.set_nodelay(true)?;
                stream.set_write_timeout(Some(PATIENCE))?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

use std::{cell::RefCell, collections::VecDeque, rc::Rc, vec, vec::Vec};

use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::{
    delay::NoopDelay,
    i2c::{Mock, Transaction},
};
use hm01b0::registers::DEFAULT_REGISTERS;
use proptest::prelude::*;

use super::*;

const ADDRESS: u8 = 0x24;
const FILTERS: [Filter; 2] = [Filter::None, Filter::Bayer];

type Received = Result<Option<Vec<u8>>, PortError>;

/// Gives what a list says, then nothing.
#[derive(Clone, Debug, Default)]
struct Port(Rc<RefCell<Script>>);

#[derive(Debug, Default)]
struct Script {
    received: VecDeque<Received>,
    is_broken: bool,
    is_running: bool,
    starts: u32,
}

/// A port with the frame that it lends.
#[derive(Debug, Default)]
struct Lender {
    port: Port,
    frame: Vec<u8>,
}

impl PixelPort for Lender {
    fn start(&mut self) -> Result<(), PortError> {
        let script = &mut *self.port.0.borrow_mut();
        (script.is_running, script.starts) = (true, script.starts + 1);
        if script.is_broken {
            return Err(PortError::Fault);
        }
        Ok(())
    }

    fn frame(&mut self) -> Result<Option<&[u8]>, PortError> {
        let script = &mut *self.port.0.borrow_mut();
        assert!(script.is_running, "the port was not started");
        let Some(frame) = script.received.pop_front().unwrap_or(Ok(None))? else {
            return Ok(None);
        };
        self.frame = frame;
        Ok(Some(&self.frame))
    }

    fn stop(&mut self) {
        self.port.0.borrow_mut().is_running = false;
    }
}

fn writes(register: u16, value: u8) -> Transaction {
    let [high, low] = register.to_be_bytes();
    Transaction::write(ADDRESS, vec![high, low, value])
}

fn reads(register: u16, value: u8) -> Transaction {
    Transaction::write_read(ADDRESS, register.to_be_bytes().to_vec(), vec![value])
}

fn identity(id: u16) -> [Transaction; 2] {
    let [high, low] = id.to_be_bytes();
    [reads(0x0000, high), reads(0x0001, low)]
}

fn set_up(filter: Filter) -> Vec<Transaction> {
    let mut transactions = vec![];
    transactions.extend(identity(0x01B0));
    // The crate: reset, gated clock, its table, no motion detection, no shift.
    transactions.extend(identity(0x01B0));
    transactions.extend([writes(0x0103, 0), reads(0x3060, 0x0A), writes(0x3060, 0x2A)]);
    transactions.extend(DEFAULT_REGISTERS.map(|(register, value)| writes(register, value)));
    transactions.extend([writes(0x2150, 0), writes(0x1012, 0)]);
    // Ours: window and binning; then it streams.
    transactions.push(writes(0x3010, 1));
    if filter == Filter::None {
        transactions.extend([writes(0x0383, 3), writes(0x0387, 3), writes(0x0390, 3)]);
    }
    transactions.push(writes(0x0100, 1));
    transactions
}

fn camera_on(
    transactions: &[Transaction],
    filter: Filter,
) -> (Mock, Port, Hm01b0<Mock, NoopDelay, Lender>) {
    let (i2c, port) = (Mock::new(transactions), Port::default());
    let lender = Lender {
        port: port.clone(),
        ..Lender::default()
    };
    let camera = Hm01b0::new(i2c.clone(), NoopDelay::new(), lender, filter);
    (i2c, port, camera)
}

/// A camera that is set up and asked for a frame.
fn asked(filter: Filter) -> (Mock, Port, Hm01b0<Mock, NoopDelay, Lender>) {
    let (mut i2c, port, mut camera) = camera_on(&set_up(filter), filter);
    camera.begin().expect("present");
    i2c.done();
    (i2c, port, camera)
}

fn raw(filter: Filter) -> Vec<u8> {
    let (columns, rows) = match filter {
        Filter::None => (162, 122),
        Filter::Bayer => (324, 244),
    };
    (0..columns * rows).map(|i| (i * 31 % 251) as u8).collect()
}

/// The definition, pixel by pixel.
fn reference(filter: Filter, raw: &[u8]) -> Vec<u8> {
    let at = |x: usize, y: usize| match filter {
        Filter::None => raw[y * 162 + x],
        Filter::Bayer => {
            let cell = [(0, 0), (1, 0), (0, 1), (1, 1)]
                .map(|(right, down)| f64::from(raw[(2 * y + down) * 324 + 2 * x + right]));
            (cell.iter().sum::<f64>() / 4.0).round() as u8
        }
    };
    (1..121)
        .flat_map(|y| (1..161).map(move |x| (x, y)))
        .map(|(x, y)| at(x, y))
        .collect()
}

#[test]
fn a_frame_is_set_up_once_and_received_each_time() {
    for filter in FILTERS {
        let (_, port, mut camera) = asked(filter);
        let mut pixels = vec![0; 19_200];
        for starts in 1..4 {
            port.0.borrow_mut().received = [Ok(None), Ok(Some(raw(filter)))].into();
            assert_eq!(camera.take(&mut pixels), Ok(None));
            let size = camera
                .take(&mut pixels)
                .expect("no error")
                .expect("a frame");
            assert_eq!((size.width(), size.height()), (160, 120));
            assert_eq!(pixels, reference(filter, &raw(filter)), "{filter:?}");
            assert!(!port.0.borrow().is_running);
            assert_eq!(camera.take(&mut pixels), Ok(None), "none was asked for");
            assert_eq!(port.0.borrow().starts, starts);
            // No more transfers over I2C: the list is empty.
            camera.begin().expect("present");
        }
    }
}

#[test]
fn frames_that_are_not_whole_are_told_and_the_next_one_comes() {
    for filter in FILTERS {
        let whole = raw(filter);
        let expected = whole.len() as u32;
        let longer = [&whole[..], &[0]].concat();
        for (received, error) in [
            (Ok(Some(vec![])), CameraError::Short { expected, found: 0 }),
            (
                Ok(Some(whole[1..].to_vec())),
                CameraError::Short {
                    expected,
                    found: expected - 1,
                },
            ),
            (Ok(Some(longer)), CameraError::Torn),
            (Err(PortError::Overrun), CameraError::Torn),
            (Err(PortError::Fault), CameraError::Bus),
        ] {
            let (_, port, mut camera) = asked(filter);
            let mut pixels = vec![0; 19_200];
            port.0.borrow_mut().received = [received, Ok(Some(whole.clone()))].into();
            assert_eq!(camera.take(&mut pixels), Err(error));
            assert_eq!(camera.take(&mut pixels), Ok(None), "the frame is gone");
            camera.begin().expect("present");
            assert!(matches!(camera.take(&mut pixels), Ok(Some(_))));
            assert_eq!(pixels, reference(filter, &whole));
        }
    }
}

#[test]
fn a_sensor_that_is_not_there_is_absent_and_found_later() {
    let nobody = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    for (transactions, error) in [
        (identity(0xFFFF).to_vec(), CameraError::Absent),
        (identity(0x0360).to_vec(), CameraError::Absent),
        (
            vec![reads(0x0000, 1).with_error(nobody)],
            CameraError::Absent,
        ),
        (
            vec![reads(0x0000, 1).with_error(ErrorKind::Bus)],
            CameraError::Bus,
        ),
    ] {
        let transactions = [transactions, set_up(Filter::Bayer)].concat();
        let (mut i2c, _, mut camera) = camera_on(&transactions, Filter::Bayer);
        assert_eq!(camera.begin(), Err(error));
        assert_eq!(camera.take(&mut []), Ok(None));
        camera.recover();
        camera.begin().expect("present");
        i2c.done();
    }
}

#[test]
fn a_bus_that_fails_anywhere_after_the_reset_is_told_and_all_is_written_again() {
    for filter in FILTERS {
        let transactions = set_up(filter);
        // Before, the crate tries again by itself.
        for at in 5..transactions.len() {
            let mut failing = transactions[..=at].to_vec();
            failing[at] = failing[at].clone().with_error(ErrorKind::ArbitrationLoss);
            let (mut i2c, port, mut camera) =
                camera_on(&[failing, transactions.clone()].concat(), filter);
            assert_eq!(camera.begin(), Err(CameraError::Bus), "at {at}");
            assert_eq!(port.0.borrow().starts, 0);
            camera.begin().expect("present");
            i2c.done();
        }
    }
}

#[test]
fn recovery_sets_up_again() {
    let twice = [set_up(Filter::None), set_up(Filter::None)].concat();
    let (mut i2c, port, mut camera) = camera_on(&twice, Filter::None);
    camera.begin().expect("present");
    camera.recover();
    assert!(!port.0.borrow().is_running);
    assert_eq!(camera.take(&mut []), Ok(None));
    camera.begin().expect("present");
    i2c.done();
}

#[test]
fn a_port_that_does_not_start_is_told() {
    let (mut i2c, port, mut camera) = camera_on(&set_up(Filter::None), Filter::None);
    port.0.borrow_mut().is_broken = true;
    assert_eq!(camera.begin(), Err(CameraError::Bus));
    assert_eq!(camera.take(&mut []), Ok(None));
    i2c.done();
}

#[test]
fn a_buffer_without_room_is_told() {
    let (_, port, mut camera) = asked(Filter::None);
    port.0.borrow_mut().received = [Ok(Some(raw(Filter::None)))].into();
    let room = CameraError::Room {
        needed: 19_200,
        have: 19_199,
    };
    assert_eq!(camera.take(&mut vec![0; 19_199]), Err(room));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    #[test]
    fn frames_match_reference(
        is_bayer in any::<bool>(), bytes in proptest::collection::vec(any::<u8>(), MAX_RAW_LEN),
    ) {
        let filter = FILTERS[usize::from(is_bayer)];
        let (_, port, mut camera) = asked(filter);
        let raw = bytes[..filter.raw_len()].to_vec();
        port.0.borrow_mut().received = [Ok(Some(raw.clone()))].into();
        let mut pixels = vec![0; 19_200];
        prop_assert!(matches!(camera.take(&mut pixels), Ok(Some(_))));
        prop_assert_eq!(pixels, reference(filter, &raw));
    }
}

use std::{
    io::{Read, Write},
    net::TcpListener,
    thread,
};

use super::{
    super::simulated::{Flash, Trouble, serve},
    *,
};

const SOON: Duration = Duration::from_millis(60);

/// More than a busy machine needs to answer.
const LONG: Duration = Duration::from_secs(5);

fn is_slots(reply: &Reply) -> bool {
    matches!(reply, Reply::Slots(_))
}

#[test]
fn a_question_is_answered_whatever_else_the_board_says() {
    let trouble = Trouble {
        is_talkative: true,
        ..Trouble::default()
    };
    let (name, board) = serve(Flash::default(), trouble);
    let mut link = BoardLink::open(&name, 0).expect("listens");
    for _ in 0..20 {
        let reply = link.ask(&Request::Slots, LONG, is_slots).expect("answers");
        assert!(is_slots(&reply));
    }
    drop(link);
    assert_eq!(board.join().expect("ends").requests, 20);
}

#[test]
fn a_lost_answer_is_asked_for_again_and_noise_is_counted() {
    let trouble = Trouble {
        reply_lost: 3,
        noise: 4,
        ..Trouble::default()
    };
    let (name, _board) = serve(Flash::default(), trouble);
    let mut link = BoardLink::open(&name, 0).expect("listens");
    for _ in 0..6 {
        link.ask(&Request::Slots, 8 * SOON, is_slots)
            .expect("answers");
    }
    assert!(link.damaged() > 0);
}

#[test]
fn silence_is_an_error_that_says_how_long() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let name = format!("tcp:{}", listener.local_addr().expect("bound"));
    let mut link = BoardLink::open(&name, 0).expect("listens");
    assert_eq!(link.receive(SOON).expect("open"), None);
    let error = link
        .ask(&Request::Identify, SOON, |_| true)
        .expect_err("silent");
    let expected = format!("{name}: no answer from the board: asked 3 times, waited 0.1 s each");
    assert_eq!(error.to_string(), expected);
}

#[test]
fn endless_noise_ends_at_the_time_out() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let name = format!("tcp:{}", listener.local_addr().expect("bound"));
    let noise = thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("connects");
        while stream.write_all(&[0x11; 100]).is_ok() {}
    });
    let mut link = BoardLink::open(&name, 0).expect("listens");
    assert_eq!(link.receive(SOON).expect("open"), None);
    drop(link);
    noise.join().expect("ends");
}

#[test]
fn a_board_that_hangs_up_is_told_from_a_silent_one() {
    let (name, _board) = serve(
        Flash::default(),
        Trouble {
            hang_up: 1,
            ..Trouble::default()
        },
    );
    let mut link = BoardLink::open(&name, 0).expect("listens");
    let error = link
        .ask(&Request::Slots, SOON, is_slots)
        .expect_err("hangs up");
    assert!(
        matches!(error, LinkError::Closed { .. } | LinkError::Broken { .. }),
        "{error}"
    );
}

#[test]
fn links_that_do_not_exist_are_named() {
    for (name, what) in [
        ("tcp:localhost", "expected tcp:HOST:PORT"),
        ("tcp:127.0.0.1:1", "refused"),
        ("/nonexistent/port", "cannot open the link"),
    ] {
        let error = BoardLink::open(name, 115_200)
            .expect_err("is none")
            .to_string();
        assert!(
            error.starts_with(&format!("{name}: ")) && error.contains(what),
            "{error}"
        );
    }
}

/// A pseudoterminal is a serial port of which a program holds the other end.
#[cfg(unix)]
#[test]
fn serial_ports_carry_packets_and_time_out() {
    use eigenmark_core::link::MAX_REPLY_LEN;
    use serialport::{SerialPort, TTYPort};

    let (mut board, host) = TTYPort::pair().expect("pseudoterminals");
    let name = host.name().expect("has a name");
    // It is locked while it is open.
    drop(host);
    let mut link = BoardLink::open(&name, 115_200).expect("opens");
    assert_eq!(link.receive(SOON).expect("open"), None);

    link.send(&Request::Slots).expect("open");
    board
        .set_timeout(Duration::from_secs(5))
        .expect("a terminal");
    let mut receiver = Box::new(Receiver::<MAX_REQUEST_LEN>::new());
    let mut byte = [0];
    loop {
        board.read_exact(&mut byte).expect("bytes");
        if let Some(request) = receiver.push::<Request<'_>>(byte[0]) {
            assert_eq!(request, Ok(Request::Slots));
            break;
        }
    }
    let (mut scratch, mut packet) = ([0; MAX_REPLY_LEN], [0; MAX_REPLY_LEN]);
    let packet = encode(&Reply::Done, &mut scratch, &mut packet).expect("fits");
    board.write_all(packet).expect("open");
    let reply = link.receive(Duration::from_secs(5)).expect("open");
    assert_eq!(reply, Some(Reply::Done));
}

//! Whatever is asked in whatever order, with power cut at any time: what is flown by stays.

use super::*;
use proptest::prelude::*;

/// Numbers of landmarks of the atlases that are sent.
const ATLASES: [u8; 3] = [1, 4, 9];

#[derive(Clone, Copy, Debug)]
enum Action {
    /// One of the atlases, its CRC right or wrong.
    Begin(usize, bool),
    /// Some pages.
    Step(usize),
    /// From the next byte on, or so much off; so many bytes; some of them damaged.
    Chunk(i32, usize, bool),
    /// All that is missing.
    Rest,
    Finish,
    Abandon,
    Power(u64, Cut),
    Restart,
}

fn action() -> impl Strategy<Value = Action> {
    let cut = prop_oneof![
        Just(Cut::Before),
        Just(Cut::FirstHalf),
        Just(Cut::SecondHalf),
        Just(Cut::After),
        any::<u64>().prop_map(Cut::Random),
    ];
    prop_oneof![
        3 => (0..ATLASES.len(), prop::bool::weighted(0.9)).prop_map(|(a, b)| Action::Begin(a, b)),
        4 => (0_usize..6).prop_map(Action::Step),
        4 => (-80_i32..80, 0_usize..512, prop::bool::weighted(0.1))
            .prop_map(|(off, len, bad)| Action::Chunk(if off.abs() < 40 { 0 } else { off }, len, bad)),
        3 => Just(Action::Rest),
        3 => Just(Action::Finish),
        1 => Just(Action::Abandon),
        1 => (0_u64..600, cut).prop_map(|(steps, cut)| Action::Power(steps, cut)),
        1 => Just(Action::Restart),
    ]
}

fn content() -> impl Strategy<Value = Content> {
    prop_oneof![
        Just(Content::Erased),
        Just(Content::Zeros),
        (1_u8..9).prop_map(Content::Flashed),
        (1_u8..9, any::<u32>()).prop_map(|(a, s)| Content::Recorded(a, s)),
        (1_u8..9).prop_map(Content::Stale),
        (1_u8..9).prop_map(Content::Uncommitted),
    ]
}

fn act<const W: usize>(
    board: &mut Board<W>,
    flown: &mut Option<Slot>,
    sent: &mut (usize, Slot),
    action: Action,
) {
    let bytes = atlas(ATLASES[sent.0]);
    let next = match board.writer.progress() {
        Ok(Progress::Writing { next }) => next as usize,
        _ => 0,
    };
    match action {
        Action::Begin(number, is_right) => {
            let target = board.region().target(*flown).expect("not covered");
            let bytes = atlas(ATLASES[number]);
            *sent = (number, target.slot());
            let crc = crc_of(&bytes) ^ u32::from(!is_right);
            let _ = board.writer.begin(target, bytes.len() as u32, crc, SETUP);
        }
        Action::Step(pages) => {
            for _ in 0..pages {
                let _ = board.writer.step(&mut board.flash);
            }
        }
        Action::Chunk(off, len, is_damaged) => {
            let from = next.saturating_add_signed(off as isize);
            let mut part: Vec<u8> = bytes.iter().copied().skip(from).take(len).collect();
            if is_damaged {
                part.iter_mut().step_by(11).for_each(|byte| *byte ^= 4);
            }
            let _ = board.writer.chunk(&mut board.flash, from as u32, &part);
        }
        Action::Rest => {
            if let Some(rest) = bytes.get(next..) {
                let _ = board.writer.chunk(&mut board.flash, next as u32, rest);
            }
        }
        Action::Finish => {
            let _ = board.finish(sent.1);
        }
        Action::Abandon => board.writer.abandon(),
        Action::Power(steps, cut) => board.flash.power_after(steps, cut),
        Action::Restart => {
            board.restart();
            *flown = board.region().newest();
        }
    }
    if board.flash.is_off() {
        board.restart();
        *flown = board.region().newest();
    }
}

fn go<const W: usize>(contents: [Content; 2], actions: &[Action]) -> Result<(), TestCaseError> {
    let mut board = Board::<W>::new(contents);
    let mut flown = board.region().newest();
    let mut sent = (0, Slot::A);
    let mut known: Vec<u32> = ATLASES.map(|landmarks| crc_of(&atlas(landmarks))).to_vec();
    known.extend(board.chosen().map(|(_, crc)| crc));
    for &action in actions {
        let (before, chosen) = (board.clone(), board.chosen());
        let was_flown = flown;
        act(&mut board, &mut flown, &mut sent, action);

        let now = board.chosen();
        prop_assert!(now.is_some() || chosen.is_none(), "{:?}", action);
        if let Some(slot) = was_flown {
            prop_assert_eq!(board.slot(slot), before.slot(slot));
        }
        if let Some((slot, crc)) = now {
            prop_assert!(known.contains(&crc));
            // What is new has a record, and came whole.
            if now != chosen && was_flown != Some(slot) {
                let region = board.region();
                prop_assert_eq!(region.found(slot).setup(), SETUP);
                prop_assert!(matches!(action, Action::Finish));
            }
        }
    }
    board.restart();
    let new = atlas(2);
    let flown = board.region().newest();
    prop_assert!(board.upload(flown, &new).is_ok());
    prop_assert_eq!(board.chosen().map(|(_, crc)| crc), Some(crc_of(&new)));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn what_is_flown_by_stays_valid(
        contents in [content(), content()],
        actions in proptest::collection::vec(action(), 0..60),
    ) {
        go::<1>(contents, &actions)?;
        go::<8>(contents, &actions)?;
        go::<32>(contents, &actions)?;
    }
}

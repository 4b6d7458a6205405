use std::{collections::VecDeque, vec::Vec};

use proptest::prelude::*;

use super::*;

const SIZE: FrameSize = match FrameSize::new(32, 32) {
    Some(size) => size,
    None => panic!("valid"),
};
const ROOM: usize = SIZE.len();

/// What becomes of a request.
#[derive(Clone, Copy, Debug)]
enum Answer {
    /// A frame after so many calls.
    Frame(u32),
    /// An error after so many calls.
    Error(u32, CameraError),
    /// Nothing.
    Silence,
    /// No request is taken.
    Refusal(CameraError),
}

/// Answers as a list says, then with frames.
#[derive(Debug, Default)]
struct Scripted {
    answers: VecDeque<Answer>,
    current: Option<Answer>,
    begun: u32,
    recovered: u32,
}

impl Scripted {
    fn supervised(answers: impl IntoIterator<Item = Answer>) -> Supervised<Self> {
        let answers = answers.into_iter().collect();
        let camera = Self {
            answers,
            ..Self::default()
        };
        Supervised::new(camera, Limits::DEFAULT)
    }
}

impl Camera for Scripted {
    fn begin(&mut self) -> Result<(), CameraError> {
        self.begun += 1;
        match self.answers.pop_front().unwrap_or(Answer::Frame(0)) {
            Answer::Refusal(error) => Err(error),
            answer => {
                self.current = Some(answer);
                Ok(())
            }
        }
    }

    fn take(&mut self, _: &mut [u8]) -> Result<Option<FrameSize>, CameraError> {
        let (waits, end) = match &mut self.current {
            Some(Answer::Frame(waits)) => (waits, Ok(Some(SIZE))),
            Some(Answer::Error(waits, error)) => (waits, Err(*error)),
            _ => return Ok(None),
        };
        if *waits > 0 {
            *waits -= 1;
            return Ok(None);
        }
        self.current = None;
        end
    }

    fn recover(&mut self) {
        self.current = None;
        self.recovered += 1;
    }
}

/// What is told, and when, in milliseconds, when it is asked every millisecond.
fn told_in(
    camera: &mut Supervised<Scripted>,
    ms: core::ops::Range<u64>,
) -> Vec<(u64, Result<FrameSize, CameraError>)> {
    ms.filter_map(|now_ms| {
        let told = camera.poll(now_ms * 1_000, &mut [0; ROOM])?;
        Some((now_ms, told))
    })
    .collect()
}

#[test]
fn frames_come_one_after_the_other() {
    let mut camera = Scripted::supervised([Answer::Frame(9), Answer::Frame(0)]);
    assert_eq!(
        told_in(&mut camera, 0..14),
        [(10, Ok(SIZE)), (12, Ok(SIZE))]
    );
    assert_eq!(camera.camera().recovered, 0);
    assert_eq!((camera.error(), camera.losses()), (None, 0));
}

#[test]
fn the_next_frame_is_asked_for_only_when_this_one_was_given_time() {
    let mut camera = Scripted::supervised([]);
    told_in(&mut camera, 0..2);
    assert_eq!(camera.camera().begun, 1, "the buffer is in use");
    told_in(&mut camera, 2..3);
    assert_eq!(camera.camera().begun, 2);
}

#[test]
fn a_late_frame_is_told_once_and_the_camera_recovered() {
    let mut camera = Scripted::supervised([Answer::Frame(0), Answer::Silence]);
    let told = told_in(&mut camera, 0..300);
    // Asked for at 2 ms.
    assert_eq!(told[..2], [(1, Ok(SIZE)), (202, Err(CameraError::Late))]);
    assert!(told[2..].iter().all(|(_, told)| told.is_ok()));
    assert_eq!(camera.camera().recovered, 1);
    assert_eq!((camera.is_lost(), camera.error()), (false, None));
}

#[test]
fn the_first_frame_after_a_set_up_has_more_time() {
    let mut camera = Scripted::supervised([Answer::Silence, Answer::Frame(1_900)]);
    let told = told_in(&mut camera, 0..4_000);
    assert_eq!(told[0], (2_000, Err(CameraError::Late)));
    assert_eq!(told[1].1, Ok(SIZE));
    assert!((3_900..3_910).contains(&told[1].0));
}

#[test]
fn a_bad_frame_is_told_and_the_next_one_asked_for_at_once() {
    let short = CameraError::Short {
        expected: 2,
        found: 1,
    };
    for error in [short, CameraError::Torn] {
        let answers = [Answer::Frame(0), Answer::Error(3, error), Answer::Frame(0)];
        let mut camera = Scripted::supervised(answers);
        assert_eq!(
            told_in(&mut camera, 0..9),
            [(1, Ok(SIZE)), (6, Err(error)), (8, Ok(SIZE))]
        );
        assert_eq!(camera.camera().recovered, 0);
    }
}

#[test]
fn three_failures_in_a_row_are_a_loss_told_once() {
    let absent = CameraError::Absent;
    let mut camera = Scripted::supervised([Answer::Refusal(absent); 5]);
    // Refused at once, and tried again after a rest; lost with the third.
    let told = told_in(&mut camera, 0..500);
    let times: Vec<_> = told.iter().map(|&(ms, _)| ms).collect();
    assert_eq!(times, [0, 201, 402]);
    assert!(told.iter().all(|&(_, told)| told == Err(absent)));
    assert_eq!((camera.is_lost(), camera.losses()), (true, 1));

    // Tried every second, in silence.
    assert_eq!(told_in(&mut camera, 500..3_404), []);
    assert_eq!((camera.camera().begun, camera.camera().recovered), (5, 5));
    assert_eq!(camera.error(), Some(absent));

    // And it is back.
    let told = told_in(&mut camera, 3_404..3_410);
    assert_eq!(told[0], (3_406, Ok(SIZE)));
    assert_eq!((camera.is_lost(), camera.losses()), (false, 1));
    assert_eq!(camera.error(), None);
}

#[test]
fn failures_of_all_kinds_count_and_a_frame_forgives() {
    let torn = Answer::Error(0, CameraError::Torn);
    let bus = Answer::Refusal(CameraError::Bus);
    let good = Answer::Frame(0);
    let mut camera = Scripted::supervised([torn, bus, good, bus, torn, good, torn, torn, torn]);
    told_in(&mut camera, 0..1_000);
    assert_eq!((camera.is_lost(), camera.losses()), (true, 1));
    // Bad frames that do not end are recovered from, too: twice the bus, once the loss.
    assert_eq!(camera.camera().recovered, 3);
}

#[test]
fn losses_are_counted() {
    let absent = Answer::Refusal(CameraError::Absent);
    let loss = [absent, absent, absent, Answer::Frame(0)];
    let mut camera = Scripted::supervised(loss.repeat(3));
    let told = told_in(&mut camera, 0..10_000);
    assert_eq!(camera.losses(), 3);
    let errors = told.iter().filter(|(_, told)| told.is_err()).count();
    assert_eq!(errors, 9);
}

proptest! {
    #[test]
    fn a_clock_that_wraps_changes_nothing(
        answers in proptest::collection::vec(
            prop_oneof![
                (0_u32..400).prop_map(Answer::Frame),
                (0_u32..400).prop_map(|waits| Answer::Error(waits, CameraError::Torn)),
                Just(Answer::Silence),
                Just(Answer::Refusal(CameraError::Absent)),
            ],
            0..12,
        ),
        start_us in any::<u64>(), before_wrap_us in 0_u64..20_000_000,
    ) {
        let run = |start_us: u64| {
            let mut camera = Scripted::supervised(answers.clone());
            // 12 requests take 3 s each at most.
            let told: Vec<_> = (0..8_000_u64)
                .map(|step| camera.poll(start_us.wrapping_add(step * 5_000), &mut [0; ROOM]))
                .collect();
            (told, camera.losses(), camera.is_lost())
        };
        let plain = run(0);
        prop_assert_eq!(&run(start_us), &plain);
        prop_assert_eq!(&run(u64::MAX - before_wrap_us), &plain);
        prop_assert!(!plain.2, "it ends with frames");
    }
}

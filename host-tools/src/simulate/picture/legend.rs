//! The panel below the map: title, caption, scale bar, and what the signs mean.

use super::{
    AMBER, CYAN, DARK, GREEN, PALE, RED, STEEL, VIOLET,
    canvas::{Canvas, Ink, dashes},
    font,
};

const MARGIN_PX: f32 = 28.0;
const TITLE_CAP_PX: f32 = 16.0;
const TEXT_CAP_PX: f32 = 12.0;

/// Distances of the lines of writing from the top of the panel, and between rows of signs.
const TITLE_PX: f32 = 40.0;
const CAPTION_PX: f32 = 68.0;
const SIGNS_PX: f32 = 106.0;
const ROW_PX: f32 = 30.0;

/// Width of a sign, and of the space between it and its word, and after that.
const SIGN_PX: f32 = 34.0;
const SPACE_PX: f32 = 9.0;
const AFTER_PX: f32 = 22.0;

/// What a scale bar is at least, and at most five halves of, in pixels.
const BAR_PX: f64 = 120.0;

const PANEL: Ink = Ink::new([16, 20, 28]);
const GRAY: Ink = Ink::new([168, 178, 194]);

/// A sign that the legend explains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sign {
    Truth,
    Belief,
    Unsure,
    Wrong,
    Odometry,
    Places,
    Start,
    Goal,
    Kidnapping,
}

impl Sign {
    fn word(self) -> &'static str {
        match self {
            Self::Truth => "true way",
            Self::Belief => "believed, confident",
            Self::Unsure => "believed, unsure",
            Self::Wrong => "confident and wrong",
            Self::Odometry => "path integration",
            Self::Places => "places",
            Self::Start => "start",
            Self::Goal => "goal",
            Self::Kidnapping => "kidnapped",
        }
    }

    /// Draws the sign, its left end at `at`.
    fn draw(self, canvas: &mut Canvas, [x, y]: [f32; 2]) {
        let ends = [[x + 4.0, y], [x + SIGN_PX - 4.0, y]];
        let middle = [x + SIGN_PX / 2.0, y];
        let line = vec![ends[0], ends[1]];
        match self {
            Self::Truth => canvas.stroke(&[line], 6.0, PALE.faint(0.85)),
            Self::Belief => canvas.stroke(&[line], 2.8, AMBER),
            Self::Unsure => canvas.stroke(&dashes(&ends, 4.0), 2.8, AMBER),
            Self::Wrong => canvas.stroke(&[line], 2.8, RED),
            Self::Odometry => canvas.stroke(&[line], 2.2, CYAN),
            Self::Places => {
                canvas.stroke(&[line], 1.5, STEEL.faint(0.6));
                canvas.stroke(&ends.map(|end| vec![end]), 6.0, STEEL);
            }
            Self::Start => start(canvas, middle),
            Self::Goal => goal(canvas, middle),
            Self::Kidnapping => arrow(canvas, ends[0], ends[1]),
        }
    }
}

/// Where the flight begins.
pub(super) fn start(canvas: &mut Canvas, at: [f32; 2]) {
    canvas.disc(at, 9.5, DARK.faint(0.8));
    canvas.disc(at, 7.5, GREEN);
    canvas.disc(at, 3.0, DARK);
}

/// Where it should end.
pub(super) fn goal(canvas: &mut Canvas, at: [f32; 2]) {
    canvas.disc(at, 11.5, DARK.faint(0.8));
    canvas.ring(at, 8.5, 2.6, RED);
    canvas.disc(at, 3.6, RED);
}

/// The way the vehicle was carried.
pub(super) fn arrow(canvas: &mut Canvas, from: [f32; 2], to: [f32; 2]) {
    let way = [to[0] - from[0], to[1] - from[1]];
    let length = way[0].hypot(way[1]).max(1e-3);
    let [x, y] = way.map(|part| part / length * 10.0);
    // Turned by about 35° to either side.
    let barb = |side: f32| [to[0] - x + side * 0.7 * y, to[1] - y - side * 0.7 * x];
    let head = vec![barb(1.0), to, barb(-1.0)];
    let lines = dashes(&[from, to], 7.0);
    canvas.stroke(&lines, 4.4, DARK.faint(0.6));
    canvas.stroke(&lines, 2.4, VIOLET);
    canvas.stroke(std::slice::from_ref(&head), 5.0, DARK.faint(0.6));
    canvas.stroke(&[head], 3.0, VIOLET);
}

/// The panel, laid out for a width.
pub(super) struct Panel {
    signs: Vec<(Sign, [f32; 2])>,
    width: u32,
    rows: u16,
}

impl Panel {
    pub(super) fn new(signs: &[Sign], width: u32) -> Self {
        let (mut x, mut rows) = (MARGIN_PX, 1_u16);
        let mut placed = Vec::new();
        for &sign in signs {
            let length = SIGN_PX + SPACE_PX + font::width(TEXT_CAP_PX, sign.word());
            if x + length > width as f32 - MARGIN_PX && x > MARGIN_PX {
                (x, rows) = (MARGIN_PX, rows + 1);
            }
            placed.push((sign, [x, SIGNS_PX + f32::from(rows - 1) * ROW_PX]));
            x += length + AFTER_PX;
        }
        Self {
            signs: placed,
            width,
            rows,
        }
    }

    pub(super) fn height(&self) -> u32 {
        (SIGNS_PX + f32::from(self.rows) * ROW_PX - 2.0) as u32
    }

    /// Draws it from the row `top` on.
    pub(super) fn draw(
        &self,
        canvas: &mut Canvas,
        top: u32,
        [title, caption]: [&str; 2],
        bar: &ScaleBar,
    ) {
        // Ways may lead off the map.
        canvas.fill_below(top, PANEL);
        let top = top as f32;
        canvas.text([MARGIN_PX, top + TITLE_PX], TITLE_CAP_PX, PALE, title);
        canvas.text([MARGIN_PX, top + CAPTION_PX], TEXT_CAP_PX, GRAY, caption);
        for &(sign, [x, y]) in &self.signs {
            sign.draw(canvas, [x, top + y]);
            let at = [x + SIGN_PX + SPACE_PX, top + y + TEXT_CAP_PX / 2.0];
            canvas.text(at, TEXT_CAP_PX, PALE, sign.word());
        }
        bar.draw(canvas, [self.width as f32 - MARGIN_PX, top + TITLE_PX]);
    }
}

/// A length to compare with.
pub(super) struct ScaleBar {
    length_px: f32,
    word: String,
}

impl ScaleBar {
    /// One, two or five times a power of ten meters: the shortest that is long enough to see.
    pub(super) fn new(meters_per_px: f64) -> Self {
        let least = BAR_PX * meters_per_px;
        let power = 10.0_f64.powf(least.log10().floor());
        let factor = [1.0, 2.0, 5.0, 10.0]
            .into_iter()
            .find(|factor| factor * power >= least);
        let meters = factor.unwrap_or(10.0) * power;
        Self {
            length_px: (meters / meters_per_px) as f32,
            word: if meters < 1000.0 {
                format!("{meters} m")
            } else {
                format!("{} km", meters / 1000.0)
            },
        }
    }

    /// Draws it with its word to its left, its right end at `end`.
    fn draw(&self, canvas: &mut Canvas, [x, y]: [f32; 2]) {
        let left = x - self.length_px;
        let tick = |x: f32| vec![[x, y - 10.0], [x, y]];
        canvas.stroke(&[vec![[left, y], [x, y]], tick(left), tick(x)], 2.4, PALE);
        let word = [left - SPACE_PX - font::width(TEXT_CAP_PX, &self.word), y];
        canvas.text(word, TEXT_CAP_PX, PALE, &self.word);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bars_are_of_round_length_and_readable() {
        for (meters_per_px, word, length_px) in [
            (0.25, "50 m", 200.0),
            (0.35, "50 m", 142.9),
            (0.94, "200 m", 212.8),
            (12.0, "2 km", 166.7),
        ] {
            let bar = ScaleBar::new(meters_per_px);
            assert_eq!(bar.word, word);
            assert!((bar.length_px - length_px).abs() < 0.1, "{}", bar.length_px);
        }
    }

    #[test]
    fn signs_that_do_not_fit_go_to_the_next_row() {
        let signs = [Sign::Truth, Sign::Belief, Sign::Odometry, Sign::Kidnapping];
        assert_eq!(Panel::new(&signs, 1600).rows, 1);
        let narrow = Panel::new(&signs, 500);
        assert!(narrow.rows > 1);
        for (sign, [x, _]) in &narrow.signs {
            let end = x + SIGN_PX + SPACE_PX + font::width(TEXT_CAP_PX, sign.word());
            assert!(end <= 500.0 - MARGIN_PX, "{sign:?}");
        }
    }
}

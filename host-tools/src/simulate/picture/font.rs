//! Letters as strokes.
//!
//! Each letter is a few lines of points on a grid: a digit for the column, a digit for the row; row 2 is the line that
//! letters stand on, 7 the height of small ones, 9 that of capitals, 0 the depth of descenders. Lines marked ~ are
//! rounded by cutting corners twice (Chaikin, 1974).

use super::canvas::Line;

/// Width of the strokes over the height of capitals.
pub(super) const WEIGHT: f32 = 0.13;

/// Height of capitals in units of the grid.
const CAP: f32 = 7.0;

/// Space between two letters, and for a blank, in units of the grid.
const GAP: f32 = 2.0;
const BLANK: f32 = 3.0;

/// What stands for a letter that is not here.
const UNKNOWN: &str = "02 42 49 09 02";

const LETTERS: [(char, &str); 82] = [
    ('a', "~46 37 17 06 03 12 32 43; 47 42"),
    ('b', "09 02; ~06 17 37 46 43 32 12 03"),
    ('c', "~46 37 17 06 03 12 32 43"),
    ('d', "~46 37 17 06 03 12 32 43; 49 42"),
    ('e', "05 45; ~45 46 37 17 06 03 12 32 43"),
    ('f', "~39 29 19 18 12; 07 37"),
    ('g', "~46 37 17 06 03 12 32 43; ~47 41 30 10 01"),
    ('h', "09 02; ~05 17 37 46 42"),
    ('i', "07 02; 09"),
    ('j', "~17 11 10 00; 19"),
    ('k', "09 02; 37 04; 15 32"),
    ('l', "~09 03 12"),
    ('m', "07 02; ~05 17 27 36 32; ~35 47 57 66 62"),
    ('n', "07 02; ~05 17 37 46 42"),
    ('o', "~27 37 46 43 32 12 03 06 17 27"),
    ('p', "07 00; ~06 17 37 46 43 32 12 03"),
    ('q', "~46 37 17 06 03 12 32 43; 47 40"),
    ('r', "07 02; ~05 16 27 37"),
    ('s', "~46 37 17 06 15 34 43 32 12 03"),
    ('t', "~19 13 22 32; 07 37"),
    ('u', "~07 03 12 32 44; 47 42"),
    ('v', "07 22 47"),
    ('w', "07 12 36 52 67"),
    ('x', "07 42; 02 47"),
    ('y', "07 22; 47 10"),
    ('z', "07 47 02 42"),
    ('A', "02 39 62; 14 54"),
    ('B', "09 02; ~09 39 48 47 36 06; ~06 36 45 43 32 02"),
    ('C', "~48 39 19 08 03 12 32 43"),
    ('D', "09 02; ~09 29 47 44 22 02"),
    ('E', "49 09 02 42; 06 36"),
    ('F', "49 09 02; 06 36"),
    ('G', "~48 39 19 08 03 12 32 43 45; 45 25"),
    ('H', "09 02; 49 42; 06 46"),
    ('I', "09 02"),
    ('J', "~29 23 12 03"),
    ('K', "09 02; 49 05; 16 42"),
    ('L', "09 02 42"),
    ('M', "02 09 35 69 62"),
    ('N', "02 09 42 49"),
    ('O', "~29 39 48 43 32 12 03 08 19 29"),
    ('P', "09 02; ~09 39 48 46 35 05"),
    ('Q', "~29 39 48 43 32 12 03 08 19 29; 34 51"),
    ('R', "09 02; ~09 39 48 46 35 05; 25 42"),
    ('S', "~48 39 19 08 07 16 35 44 43 32 12 03"),
    ('T', "09 49; 29 22"),
    ('U', "~09 03 12 32 43 49"),
    ('V', "09 32 69"),
    ('W', "09 12 37 52 69"),
    ('X', "09 42; 02 49"),
    ('Y', "09 26 49; 26 22"),
    ('Z', "09 49 02 42"),
    ('0', "~29 39 48 43 32 12 03 08 19 29"),
    ('1', "07 29 22"),
    ('2', "~08 19 39 48 46 02; 02 42"),
    ('3', "~08 19 39 48 47 36 26; ~26 36 45 43 32 12 03"),
    ('4', "32 39 04 44"),
    ('5', "49 09 06; ~06 36 45 43 32 12 03"),
    ('6', "~48 39 19 08 03 12 32 43 45 36 16 05"),
    ('7', "09 49 12"),
    (
        '8',
        "~26 36 47 48 39 19 08 07 16 26; ~26 36 45 43 32 12 03 05 16 26",
    ),
    ('9', "~03 12 32 43 48 39 19 08 06 15 35 46"),
    ('.', "02"),
    (',', "12 01"),
    (':', "02; 06"),
    (';', "06; 12 01"),
    ('!', "09 04; 02"),
    ('-', "05 25"),
    ('−', "05 45"),
    ('–', "05 45"),
    ('+', "05 45; 27 23"),
    ('±', "06 46; 28 24; 02 42"),
    ('×', "03 36; 06 33"),
    ('=', "04 44; 06 46"),
    ('/', "01 39"),
    ('%', "02 69; ~19 28 17 08 19; ~54 63 52 43 54"),
    ('(', "~19 08 03 12"),
    (')', "~09 18 13 02"),
    ('°', "~19 28 17 08 19"),
    ('·', "05"),
    ('_', "01 41"),
    ('\'', "09 07"),
];

/// The strokes of a line of text whose capitals are `cap` pixels high and stand on `at`, its left end.
pub(super) fn lines(at: [f32; 2], cap: f32, text: &str) -> Vec<Line> {
    let unit = cap / CAP;
    let mut lines = Vec::new();
    let mut across = 0.0;
    for letter in text.chars() {
        let (strokes, advance) = strokes(letter);
        let place = |[x, y]: [f32; 2]| [at[0] + unit * (across + x), at[1] - unit * (y - 2.0)];
        lines.extend(
            strokes
                .into_iter()
                .map(|line| line.into_iter().map(place).collect()),
        );
        across += advance;
    }
    lines
}

/// How wide a line of text is.
pub(super) fn width(cap: f32, text: &str) -> f32 {
    let advances = text.chars().map(|letter| strokes(letter).1);
    (advances.sum::<f32>() - GAP).max(0.0) * cap / CAP
}

/// A letter on the grid, and where the next begins.
fn strokes(letter: char) -> (Vec<Line>, f32) {
    if letter == ' ' {
        return (Vec::new(), BLANK);
    }
    let known = LETTERS.iter().find(|(known, _)| *known == letter);
    let parse = |text: &str| {
        let (points, is_round) = match text.strip_prefix('~') {
            Some(points) => (points, true),
            None => (text, false),
        };
        let digit = |byte: u8| f32::from(byte.saturating_sub(b'0'));
        let points = points.split(' ').map(|point| match point.as_bytes() {
            [column, row] => [digit(*column), digit(*row)],
            _ => [0.0, 0.0],
        });
        let line: Line = points.collect();
        if is_round {
            rounded(&rounded(&line))
        } else {
            line
        }
    };
    let lines: Vec<Line> = known
        .map_or(UNKNOWN, |(_, text)| text)
        .split("; ")
        .map(parse)
        .collect();
    let widest = lines.iter().flatten().map(|[x, _]| *x).fold(0.0, f32::max);
    (lines, widest + GAP)
}

/// The line with its corners cut: every inner point gives way to two, at a quarter of the way to its neighbors.
fn rounded(line: &[[f32; 2]]) -> Line {
    let toward = |a: [f32; 2], b: [f32; 2]| [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) / 4.0);
    let mut points: Line = line.first().copied().into_iter().collect();
    for triple in line.windows(3) {
        let [before, corner, after] = [triple[0], triple[1], triple[2]];
        points.extend([toward(corner, before), toward(corner, after)]);
    }
    points.extend(line.last());
    points
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn every_letter_is_well_formed_and_unlike_the_others() {
        let mut seen = HashSet::new();
        for (letter, text) in LETTERS {
            for point in text
                .split("; ")
                .flat_map(|line| line.trim_start_matches('~').split(' '))
            {
                let is_point = point.len() == 2 && point.bytes().all(|byte| byte.is_ascii_digit());
                assert!(is_point, "{letter}: {point}");
            }
            let is_twin = matches!(letter, '0' | '–'); // as O, and as the minus sign
            assert!(seen.insert(text) || is_twin, "{letter}");
        }
        let needed = ('a'..='z')
            .chain('A'..='Z')
            .chain('0'..='9')
            .chain(".,:%+-×°±()".chars());
        for letter in needed {
            assert!(
                LETTERS.iter().any(|(known, _)| *known == letter),
                "{letter}"
            );
        }
    }

    #[test]
    fn text_is_as_wide_as_said_and_as_high() {
        let text = "Hamburg 17 %";
        let points: Vec<[f32; 2]> = lines([10.0, 50.0], 14.0, text).concat();
        let right = points.iter().map(|point| point[0]).fold(f32::MIN, f32::max);
        assert!((right - 10.0 - width(14.0, text)).abs() < 1e-3);
        let top = points.iter().map(|point| point[1]).fold(f32::MAX, f32::min);
        assert!((top - 36.0).abs() < 1e-3, "{top}");
    }
}

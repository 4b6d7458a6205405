//! 8-bit sRGB to CIE Lab under D65, and back.

use palette::{FromColor, LinSrgb, Srgb, white_point::D65};

/// Lightness L from 0 to 100, and a and b.
pub(super) type Lab = [f64; 3];

/// A color in Lab.
#[inline]
pub(super) fn of([red, green, blue]: [u8; 3]) -> Lab {
    let linear: LinSrgb<f64> = Srgb::new(red, green, blue).into_linear();
    palette::Lab::<D65, f64>::from_color(linear).into()
}

/// The sRGB color nearest to one in Lab, sample by sample.
pub(super) fn to_rgb(color: Lab) -> [u8; 3] {
    let linear = LinSrgb::<f64>::from_color(palette::Lab::<D65, f64>::from(color));
    Srgb::<u8>::from_linear(linear).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_are_where_the_standard_has_them() {
        // Computed from IEC 61966-2-1 and CIE 15.
        for (rgb, expected) in [
            ([255, 255, 255], [100.0, 0.0, 0.0]),
            ([255, 0, 0], [53.24, 80.09, 67.20]),
            ([0, 255, 0], [87.73, -86.18, 83.18]),
            ([0, 0, 255], [32.30, 79.19, -107.86]),
            ([119, 119, 119], [50.03, 0.0, 0.0]),
        ] {
            for (found, expected) in of(rgb).into_iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 0.05,
                    "{rgb:?}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn the_way_back_is_exact() {
        for step in 0..4096_u32 {
            let rgb = [step, step >> 4, step >> 8].map(|bits| (bits % 16 * 17) as u8);
            assert_eq!(to_rgb(of(rgb)), rgb);
        }
    }
}

//! Milliseconds of microseconds, without dividing 64 bits.

/// 2³² = 1000 · 4,294,967 + 296.
const HIGH_MS: u32 = 4_294_967;
const HIGH_REST_US: u32 = 296;

/// Whole milliseconds, which come round after 49 days. For times of up to 1,100 years.
///
/// A division of 64 bits is a kilobyte of flash that nothing else needs.
#[must_use]
pub fn ms(us: u64) -> u32 {
    let (high, low) = ((us >> 32) as u32, us as u32);
    let rest_us = (low % 1000).wrapping_add(high.wrapping_mul(HIGH_REST_US));
    high.wrapping_mul(HIGH_MS)
        .wrapping_add(low / 1000)
        .wrapping_add(rest_us / 1000)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::ms;

    proptest! {
        #[test]
        fn milliseconds_are_those_of_a_division(us in 0..1_u64 << 55) {
            prop_assert_eq!(ms(us), (us / 1000) as u32);
            prop_assert_eq!(ms(us >> 24), (us >> 24) as u32 / 1000);
        }
    }
}

//! A decimal number in text, as the f32 nearest to it: what `str::parse` gives, to the bit, in a quarter of the time.
//!
//! A number of at most 15 digits is an integer w < 2⁵³ by a power of ten 10ˢ, s ≤ 15: both are exact in f64, so that their
//! quotient d is the f64 nearest to the number x. Rounding d to f32 is rounding x, unless d lies in the middle between two
//! neighbours in f32: every such middle m is an f64, so x < m would give d ≤ m, and with d ≠ m both lie on one side of it. (Numbers below the
//! normal range of f32 do not occur: |x| ≥ 10⁻¹⁵ or x = 0.) What has more digits, an exponent or a d in the middle goes to the
//! standard library.
//!
//! Based on: William Clinger, "How to Read Floating Point Numbers Accurately", 1990 (the fast path); Samuel Figueroa, "When
//! is Double Rounding Innocuous?", 1995.

/// Powers of ten that are exact in f64.
const POWERS: [f64; DIGITS + 1] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
/// Digits that are below 2⁵³ in any case.
const DIGITS: usize = 15;
/// The bits of an f64 that f32 does not have, and their value in the middle between two neighbours in f32.
const BELOW: u64 = (1 << 29) - 1;
const MIDDLE: u64 = 1 << 28;

/// The number at the start of a text and the bytes that it takes: up to a blank, the end of the line or of the text. `None`
/// where the word there is no finite number.
pub(crate) fn decimal(text: &[u8]) -> Option<(f32, usize)> {
    let is_negative = text.first() == Some(&b'-');
    let digits = &text[usize::from(is_negative)..];
    let (mut value, mut count, mut scale, mut length) = (0_u64, 0_usize, None, 0_usize);
    for &byte in digits {
        match byte {
            b'0'..=b'9' => {
                count += 1;
                value = value.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
            }
            b'.' if scale.is_none() => scale = Some(count),
            _ => break,
        }
        length += 1;
    }
    let scale = scale.map_or(0, |point| count - point);
    let ends = digits.get(length).is_none_or(|&byte| is_end(byte));
    if !ends || count == 0 || count > DIGITS {
        return by_library(text);
    }
    // Exact: below 2⁵³.
    let quotient = value as f64 / POWERS[scale];
    if quotient.to_bits() & BELOW == MIDDLE {
        return by_library(text);
    }
    let number = quotient as f32;
    Some((if is_negative { -number } else { number }, length + usize::from(is_negative)))
}

/// Whether a byte ends a word.
pub(crate) fn is_end(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r' | b'\n')
}

fn by_library(text: &[u8]) -> Option<(f32, usize)> {
    let length = text.iter().position(|&byte| is_end(byte)).unwrap_or(text.len());
    let number: f32 = str::from_utf8(&text[..length]).ok()?.parse().ok()?;
    number.is_finite().then_some((number, length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The standard library's answer to the whole text.
    fn expected(text: &str) -> Option<u32> {
        text.parse::<f32>().ok().filter(|number| number.is_finite()).map(f32::to_bits)
    }

    fn got(text: &str) -> Option<u32> {
        decimal(format!("{text} 7\n").as_bytes()).map(|(number, length)| {
            assert_eq!(length, text.len());
            number.to_bits()
        })
    }

    #[test]
    fn odd_numbers() {
        for text in [
            "0",
            "-0",
            "+1.5",
            ".5",
            "5.",
            "-.25",
            ".",
            "-",
            "1e5",
            "1E-45",
            "1.0.0",
            "nan",
            "inf",
            "0x10",
            "16777217",
            "16777217.0",
            "33554434.5",
            "999999999999999",
            "0.000000000000001",
            "1/2",
            "9999999999999999",
            "3.4028236e38",
            "8388608.5",
            "8388609.5",
            "1_0",
            "١",
        ] {
            assert_eq!(got(text), expected(text), "{text}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn as_the_library(text in "-?[0-9]{0,9}\\.?[0-9]{0,8}(e-?[0-9]{1,2})?") {
            prop_assert_eq!(got(&text), expected(&text));
        }

        /// Middles between neighbours and what lies close by.
        #[test]
        fn near_middles(bits in 0x3000_0000_u32..0x4c00_0000, step in -2_i64..=2) {
            let low = f32::from_bits(bits);
            let middle = (f64::from(low) + f64::from(f32::from_bits(bits + 1))) / 2.0;
            let text = format!("{}", f64::from_bits(middle.to_bits().wrapping_add_signed(step)));
            prop_assert_eq!(got(&text), expected(&text));
        }
    }
}

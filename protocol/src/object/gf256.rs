//! The field of 256 elements in which the erasure code calculates.

/// x^8 + x^4 + x^3 + x^2 + 1, in which x generates every element but 0.
const POLYNOMIAL: u16 = 0x11D;

/// Two periods of the powers of x, and the exponents of all elements.
const POWERS: ([u8; 510], [u8; 256]) = powers();

/// All products; a row holds all multiples of one factor.
static PRODUCTS: [[u8; 256]; 256] = products();

const fn powers() -> ([u8; 510], [u8; 256]) {
    let (mut power, mut exponent) = ([0; 510], [0; 256]);
    let (mut value, mut i) = (1u16, 0);
    while i < 255 {
        power[i] = value as u8;
        power[i + 255] = value as u8;
        exponent[value as usize] = i as u8;
        value <<= 1;
        if value > 255 {
            value ^= POLYNOMIAL;
        }
        i += 1;
    }
    (power, exponent)
}

const fn products() -> [[u8; 256]; 256] {
    let (power, exponent) = POWERS;
    let mut all = [[0; 256]; 256];
    let mut a = 1;
    while a < 256 {
        let mut b = 1;
        while b < 256 {
            all[a][b] = power[exponent[a] as usize + exponent[b] as usize];
            b += 1;
        }
        a += 1;
    }
    all
}

fn multiples(factor: u8) -> &'static [u8; 256] {
    &PRODUCTS[usize::from(factor)]
}

/// The product of two elements; the sum is their exclusive or.
pub(super) fn product(a: u8, b: u8) -> u8 {
    multiples(a)[usize::from(b)]
}

/// The element whose product with `a` is 1; for 0 the result is 1.
pub(super) fn inverse(a: u8) -> u8 {
    POWERS.0[255 - usize::from(POWERS.1[usize::from(a)])]
}

/// Adds `factor` times `from` to `to`, element by element; the shorter slice decides the length.
pub(super) fn add_multiple(to: &mut [u8], factor: u8, from: &[u8]) {
    let multiple = multiples(factor);
    for (t, &f) in to.iter_mut().zip(from) {
        *t ^= multiple[usize::from(f)];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_polynomials() {
        for a in 0..=255u8 {
            for b in 0..=255u8 {
                let mut expected = (0..8).filter(|i| b >> i & 1 != 0).fold(0u16, |sum, i| sum ^ u16::from(a) << i);
                for bit in (8..16).rev() {
                    if expected >> bit & 1 != 0 {
                        expected ^= POLYNOMIAL << (bit - 8);
                    }
                }
                assert_eq!(u16::from(product(a, b)), expected, "{a} times {b}");
            }
        }
    }

    #[test]
    fn every_element_but_zero_has_an_inverse() {
        assert!((1..=255).all(|a| product(a, inverse(a)) == 1));
        assert_eq!(inverse(0), 1);
    }
}

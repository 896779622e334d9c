//! Frame numbers: a few bits on the wire, unbounded inside.

/// The unbounded number nearest to `near` whose low 8 or 16 bits are `low`.
pub fn unwrap_number(low: u16, bits: u32, near: u64) -> u64 {
    let shift = 16 - bits;
    let ahead = (low.wrapping_sub(near as u16) << shift).cast_signed() >> shift;
    near.checked_add_signed(i64::from(ahead)).unwrap_or(u64::from(low))
}

#[cfg(test)]
mod tests {
    use super::unwrap_number;

    #[test]
    fn numbers_unwrap_across_a_wrap_of_the_counter() {
        assert_eq!(unwrap_number(3, 16, 65_530), 65_539);
        assert_eq!(unwrap_number(65_530, 16, 65_540), 65_530);
        assert_eq!(unwrap_number(5, 16, 5), 5);
        assert_eq!(unwrap_number(65_535, 16, 0), 65_535, "nothing lies before the first number");
        assert_eq!(unwrap_number(3, 8, 250), 259);
        assert_eq!(unwrap_number(250, 8, 259), 250);
        assert_eq!(unwrap_number(127, 8, 1000), 1000 - 1000 % 256 + 127);
    }
}

//! Frame numbers: 16 bits on the wire, unbounded inside.

/// The unbounded number nearest to `near` whose low 16 bits are `low`.
pub fn unwrap_number(low: u16, near: u64) -> u64 {
    let ahead = low.wrapping_sub(near as u16) as i16;
    near.checked_add_signed(i64::from(ahead)).unwrap_or(u64::from(low))
}

#[cfg(test)]
mod tests {
    use super::unwrap_number;

    #[test]
    fn numbers_unwrap_across_a_wrap_of_the_counter() {
        assert_eq!(unwrap_number(3, 65_530), 65_539);
        assert_eq!(unwrap_number(65_530, 65_540), 65_530);
        assert_eq!(unwrap_number(5, 5), 5);
        assert_eq!(unwrap_number(65_535, 0), 65_535, "nothing lies before the first number");
    }
}

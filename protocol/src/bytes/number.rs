//! Numbers of 24 bits.

/// Metres as whole decimetres, clamped to 24 bits in two's complement.
pub(crate) fn decimetres(metres: f64) -> i32 {
    (metres * 10.0).round().clamp(-8_388_608.0, 8_388_607.0) as i32
}

/// Appends the low 24 bits, big-endian.
pub(crate) fn put24(out: &mut Vec<u8>, value: u32) {
    out.extend_from_slice(value.to_be_bytes().get(1..).unwrap_or_default());
}

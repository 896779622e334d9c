//! What each sample carries beside its message.
//!
//! ```text
//!  0           8           16   17          33
//! +-----------+-----------+----+-----------+
//! | sequence  | time      | 16 | gid       |
//! | i64, from | i64, ns   |    | XXH3-128  |
//! | 1 on      | UTC       |    | of token  |
//! +-----------+-----------+----+-----------+
//! ```
//!
//! Numbers are little-endian. Source: rmw_zenoh, `docs/design.md` and `attachment_helpers.cpp`.

const BYTES: usize = 33;

/// By which peers tell the publishers of a topic apart.
pub(super) type Gid = [u8; 16];

/// The gid of the publisher with this liveliness token.
pub(super) fn gid(token: &str) -> Gid {
    twox_hash::XxHash3_128::oneshot(token.as_bytes()).to_le_bytes()
}

/// `sequence` counts the samples of the publisher from 1 on.
pub(super) fn attachment(sequence: i64, nanos: i64, gid: &Gid) -> [u8; BYTES] {
    let mut bytes = [0; BYTES];
    bytes[..8].copy_from_slice(&sequence.to_le_bytes());
    bytes[8..16].copy_from_slice(&nanos.to_le_bytes());
    bytes[16] = gid.len() as u8;
    bytes[17..].copy_from_slice(gid);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attachments_have_thirty_three_known_bytes() {
        let bytes = attachment(1, 0x0102_0304_0506_0708, &[0xab; 16]);
        let expected = [[1, 0, 0, 0, 0, 0, 0, 0], [8, 7, 6, 5, 4, 3, 2, 1]].concat();
        assert_eq!(bytes[..16], expected);
        assert_eq!((bytes[16], &bytes[17..]), (16, [0xab; 16].as_slice()));
    }

    #[test]
    fn a_gid_is_the_hash_of_the_token() {
        // As the package xxhash of PyPI computes it.
        let token = concat!(
            "@ros2_lv/0/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/",
            "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18/::,7:,:,:,,"
        );
        let expected = 0x62d0_0a89_0145_8a44_dc46_783b_88fa_85eb_u128;
        assert_eq!(u128::from_le_bytes(gid(token)), expected);
    }
}

//! Ascon-AEAD128 as the standard defines it and as a keyed function: the tag of an empty plaintext.

use ascon_aead::TruncatedAsconAead128;
use ascon_aead::aead::array::ArraySize;
use ascon_aead::aead::array::typenum::{IsGreaterOrEqual, IsLessOrEqual};
use ascon_aead::aead::consts::{True, U4, U8, U16};
use ascon_aead::aead::{AeadInOut, KeyInit};
use zeroize::Zeroizing;

pub(super) type ShortTagged = TruncatedAsconAead128<U8>;

pub(super) type Secret = Zeroizing<[u8; 16]>;

/// A pseudorandom function of `nonce` and `data` under `key`: the whole tag of an empty plaintext with `data`
/// associated.
///
/// It is sound even if a nonce is used again with other data. A repeated nonce endangers Ascon through the key stream,
/// which an empty plaintext never reveals. The rest is a sponge that starts from a keyed permutation, absorbs 16 bytes
/// at a time over 192 hidden bits, and ends in a permutation between two additions of the key, of which only the tag is
/// revealed: a pseudorandom function up to about 2^96 calls and 2^128 guesses of the key. Proofs with repeated nonces:
/// Lefevre and Mennink, "Generic Security of the Ascon Mode: On the Power of Key Blinding", SAC 2024 (eprint 2023/796)
/// and "SoK: Security of the Ascon Modes" (eprint 2024/1969).
pub(super) fn prf(key: &[u8; 16], nonce: &[u8; 16], data: &[u8]) -> Secret {
    Zeroizing::new(mac::<U16>(&TruncatedAsconAead128::new(&(*key).into()), nonce, data).into())
}

/// The tag of `data` with an empty plaintext.
pub(super) fn mac<N>(
    cipher: &TruncatedAsconAead128<N>,
    nonce: &[u8; 16],
    data: &[u8],
) -> ascon_aead::aead::Tag<TruncatedAsconAead128<N>>
where
    N: ArraySize + IsLessOrEqual<U16, Output = True> + IsGreaterOrEqual<U4, Output = True>,
{
    encrypt(cipher, nonce, data, &mut [])
}

/// Encrypts `body` in place; the tag covers it and `data`.
#[allow(clippy::expect_used)]
pub(super) fn encrypt<N>(
    cipher: &TruncatedAsconAead128<N>,
    nonce: &[u8; 16],
    data: &[u8],
    body: &mut [u8],
) -> ascon_aead::aead::Tag<TruncatedAsconAead128<N>>
where
    N: ArraySize + IsLessOrEqual<U16, Output = True> + IsGreaterOrEqual<U4, Output = True>,
{
    cipher
        .encrypt_inout_detached(&(*nonce).into(), data, body.into())
        .expect("the only error is a length of 2^64 bytes, which no slice has")
}

/// Joins parts so that their boundaries count too: each follows its length in 4 bytes, the most significant first.
pub(super) fn join(parts: &[&[u8]]) -> Vec<u8> {
    let mut joined = Vec::with_capacity(parts.iter().map(|p| p.len() + 4).sum());
    for part in parts {
        joined.extend_from_slice(&(part.len() as u32).to_be_bytes());
        joined.extend_from_slice(part);
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counting<const N: usize>() -> [u8; N] {
        std::array::from_fn(|i| i as u8)
    }

    fn hex(text: &str) -> Vec<u8> {
        text.as_bytes().chunks(2).map(|d| u8::from_str_radix(str::from_utf8(d).unwrap(), 16).unwrap()).collect()
    }

    /// Known answers of the standard's Ascon-AEAD128, from the designers' reference code (github.com/ascon/ascon-c,
    /// crypto_aead/asconaead128/LWC_AEAD_KAT_128_128.txt, Count = 1, 2, 34 and 1089): key and nonce are 00 01 .. 0F.
    #[test]
    fn the_variant_is_that_of_the_standard() {
        let (long, byte, none) = (&counting::<32>()[..], &[0][..], &[][..]);
        let vectors = [
            (none, none, "4427D64B8E1E1451FC445960F0839BB0"),
            (none, byte, "103AB79D913A0321287715A979BB8585"),
            (byte, none, "E79F58F1F541FC51B5D438F8E1DD03F147"),
            (
                long,
                long,
                "4C086D27A3B51A2333CFC7F22172A9BCAD88B8D4D77E50622D788345FA7BEE4468915D3F9422289F2349D6A3B4160397",
            ),
        ];
        for (plain, data, expected) in vectors {
            let (mut body, expected) = (plain.to_vec(), hex(expected));
            let key = counting::<16>().into();
            let tag = encrypt(&TruncatedAsconAead128::<U16>::new(&key), &counting(), data, &mut body);
            assert_eq!([&body, &tag[..]].concat(), expected);
            let mut body = plain.to_vec();
            let short = encrypt(&ShortTagged::new(&key), &counting(), data, &mut body);
            assert_eq!([&body, &short[..]].concat(), expected[..plain.len() + 8], "a short tag is a cut one");
        }
    }

    #[test]
    fn the_function_is_the_tag_of_an_empty_plaintext() {
        let out = prf(&Zeroizing::new(counting()), &counting(), &[0]);
        assert_eq!(out.to_vec(), hex("103AB79D913A0321287715A979BB8585"));
    }

    #[test]
    fn joined_parts_keep_their_boundaries() {
        assert_eq!(join(&[b"ab", b"", b"c"]), [0, 0, 0, 2, b'a', b'b', 0, 0, 0, 0, 0, 0, 0, 1, b'c']);
        assert_ne!(join(&[b"ab", b"c"]), join(&[b"a", b"bc"]));
    }
}

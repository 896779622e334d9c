//! The bytes of messages, and bytes that are no messages.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{RngCore, SeedableRng};
use scenecast_messages::builtin_interfaces::Time;
use scenecast_messages::nav_msgs::OccupancyGrid;
use scenecast_messages::sensor_msgs::{CameraInfo, Image};
use scenecast_messages::std_msgs::Header;
use scenecast_messages::{CATALOGUE, CdrError, decode, encode};

/// Inputs of an ordinary run; a long run has `SCENECAST_CDR_INPUTS=10000000`.
const INPUTS: u64 = 100_000;
/// Bytes of a random input at most.
const MAX_INPUT: u64 = 400;

#[test]
fn fields_are_aligned_to_their_size_after_the_header() {
    let header = Header { stamp: Time { sec: 1, nanosec: 2 }, frame_id: "a".to_owned() };
    let image = Image { header, height: 3, width: 4, is_bigendian: 1, step: 5, data: vec![6, 7], ..Default::default() };
    let golden = [
        [0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0].as_slice(),
        &[b'a', 0, 0, 0, 3, 0, 0, 0, 4, 0, 0, 0, 1, 0, 0, 0],
        &[0, 1, 0, 0, 5, 0, 0, 0, 2, 0, 0, 0, 6, 7],
    ];
    assert_eq!(encode(&image), golden.concat());
    assert_eq!(decode::<Image>(&golden.concat()), Ok(image));
}

#[test]
fn both_byte_orders_and_padding_are_read() {
    let big = [0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 2, b'a', 0];
    let header = Header { stamp: Time { sec: 1, nanosec: 2 }, frame_id: "a".to_owned() };
    assert_eq!(decode::<Header>(&big), Ok(header.clone()));
    let little = encode(&header);
    assert_eq!(decode::<Header>(&[little.as_slice(), &[0; 3]].concat()), Ok(header));
    assert_eq!(decode::<Header>(&[little.as_slice(), &[0; 4]].concat()), Err(CdrError::Trailing(4)));
}

#[test]
fn wrong_headers_and_cut_messages_are_refused() {
    assert_eq!(decode::<Header>(&[0, 1]), Err(CdrError::NoHeader(2)));
    assert_eq!(decode::<Header>(&[0, 3, 0, 0, 0]), Err(CdrError::Encoding(0, 3)));
    let whole = encode(&OccupancyGrid { data: vec![-1, 0, 100], ..Default::default() });
    for length in 0..whole.len() {
        assert!(decode::<OccupancyGrid>(&whole[..length]).is_err(), "{length} of {} bytes", whole.len());
    }
}

#[test]
fn a_length_beyond_the_input_is_refused() {
    let mut bytes = encode(&CameraInfo::default());
    // The number of distortion parameters follows 8 + 4 + 1 bytes of header, 8 of size and 4 + 1 of the model.
    let at = 4 + 8 + 8 + 8 + 8;
    assert_eq!(bytes[at..at + 4], [0; 4]);
    bytes[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(decode::<CameraInfo>(&bytes).is_err());
}

#[test]
fn times_are_nanoseconds_since_1970_within_their_range() {
    for nanos in [0, 1, -1, 1_700_000_000_123_456_789, -1_500_000_000] {
        assert_eq!(Time::from_nanos(nanos).nanos(), nanos);
    }
    assert_eq!(Time::from_nanos(-1), Time { sec: -1, nanosec: 999_999_999 });
    assert_eq!(Time::from_nanos(i64::MAX).sec, i32::MAX);
    assert_eq!(Time::from_nanos(i64::MIN).sec, i32::MIN);
}

/// Random bytes, and messages with a few random changes, never panic; all that decodes encodes to bytes that decode again.
#[test]
fn random_and_damaged_bytes_never_panic() {
    let inputs = std::env::var("SCENECAST_CDR_INPUTS").ok().and_then(|n| n.parse().ok()).unwrap_or(INPUTS);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(18);
    let mut decoded: Vec<Vec<u8>> = vec![vec![0, 1, 0, 0]; CATALOGUE.len()];
    let (mut accepted, mut refused) = (0, 0);
    for _ in 0..inputs {
        let at = (random.next_u64() % CATALOGUE.len() as u64) as usize;
        let mut input = match random.next_u64() % 4 {
            0 => random_bytes(&mut random),
            _ => decoded[at].clone(),
        };
        damage(&mut input, &mut random);
        match (CATALOGUE[at].recode)(&input) {
            Ok(bytes) => {
                accepted += 1;
                assert_eq!((CATALOGUE[at].recode)(&bytes).as_ref(), Ok(&bytes), "{}", CATALOGUE[at].definition.name);
                // Short ones only: inputs that grow from change to change would make the test slow.
                decoded[at] = if bytes.len() < 4096 { bytes } else { vec![0, 1, 0, 0] };
            }
            Err(_) => refused += 1,
        }
    }
    println!("{accepted} inputs decoded, {refused} refused");
    assert!(accepted > inputs / 50, "only {accepted} of {inputs} inputs decoded: the test reaches too little");
}

fn random_bytes(random: &mut Xoshiro256PlusPlus) -> Vec<u8> {
    let length = (random.next_u64() % MAX_INPUT) as usize;
    let mut bytes = vec![0; length + 4];
    if random.next_u64().is_multiple_of(2) {
        random.fill_bytes(&mut bytes[4..]);
    }
    bytes[1] = 1;
    bytes
}

/// Overwrites, inserts or removes a few bytes; some of the new ones are small, as lengths are.
fn damage(bytes: &mut Vec<u8>, random: &mut Xoshiro256PlusPlus) {
    for _ in 0..random.next_u64() % 5 {
        let at = (random.next_u64() % (bytes.len() as u64 + 1)) as usize;
        let byte = random.next_u64() as u8 >> (random.next_u64() % 8);
        match random.next_u64() % 4 {
            0 => bytes.insert(at, byte),
            1 if at < bytes.len() => drop(bytes.remove(at)),
            2 => bytes.resize(at + 40, 0),
            _ if at < bytes.len() => bytes[at] = byte,
            _ => {}
        }
    }
}

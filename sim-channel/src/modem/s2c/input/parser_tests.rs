use super::*;
use proptest::prelude::*;

fn read_all(parser: &mut InputParser, bytes: &[u8], mode: ReadMode) -> Vec<HostInput> {
    parser.push(bytes, Duration::from_secs(10));
    std::iter::from_fn(|| parser.next(mode)).collect()
}

fn read(bytes: &[u8], mode: ReadMode) -> Vec<HostInput> {
    read_all(&mut InputParser::default(), bytes, mode)
}

fn command(text: &str) -> HostInput {
    HostInput::Command(text.to_string())
}

fn instant(dst: u8, flag: InstantFlag, data: &[u8]) -> HostInput {
    let service = SendService::Instant(flag);
    HostInput::Send(Ok(SendCommand { service, pid: None, length: data.len(), dst, data: data.to_vec() }))
}

#[test]
fn commands_end_in_cr_or_lf_or_both() {
    let inputs = read(b"AT?MODE\rAT?AL\nAT!L3\r\nAT@ZX1\r", ReadMode::Commands);
    assert_eq!(inputs, [command("?MODE"), command("?AL"), command("!L3"), command("@ZX1")]);
}

#[test]
fn empty_lines_are_ignored_and_other_lines_refused() {
    assert_eq!(read(b"\r\n\r\rhello\r", ReadMode::Commands), [HostInput::WrongFormat]);
    assert_eq!(read(b"+++AT?MODE\r", ReadMode::Commands), [HostInput::WrongFormat]);
}

#[test]
fn payload_is_counted_not_searched() {
    let data = b"a\r\n,+++AT\0";
    let mut line = b"AT*SENDIM,10,2,ack,".to_vec();
    line.extend(data);
    line.extend(b"\rAT?T\r");
    assert_eq!(read(&line, ReadMode::Commands), [instant(2, InstantFlag::Ack, data), command("?T")]);
}

#[test]
fn commands_may_come_byte_by_byte() {
    let mut parser = InputParser::default();
    let line = b"AT*SENDIM,p3,3,9,noack,a\rb\nAT?MODE\n";
    let inputs: Vec<_> = line.iter().flat_map(|byte| read_all(&mut parser, &[*byte], ReadMode::Commands)).collect();
    let sent = SendCommand {
        service: SendService::Instant(InstantFlag::NoAck),
        pid: Some(3),
        length: 3,
        dst: 9,
        data: b"a\rb".to_vec(),
    };
    assert_eq!(inputs, [HostInput::Send(Ok(sent)), command("?MODE")]);
}

#[test]
fn every_message_command_is_read() {
    let line = b"AT*SEND,1,4,x\rAT*SENDPBM,1,4,x\rAT*SENDIMS,1,4,,x\rAT*SENDIMS,1,4,123456,x\r";
    let services: Vec<_> = read(line, ReadMode::Commands)
        .into_iter()
        .map(|input| match input {
            HostInput::Send(Ok(command)) => command.service,
            other => panic!("{other:?}"),
        })
        .collect();
    let expected = [
        SendService::Burst,
        SendService::Piggyback,
        SendService::Synchronous(None),
        SendService::Synchronous(Some(123_456)),
    ];
    assert_eq!(services, expected);
}

#[test]
fn wrong_length_is_refused_and_the_next_line_read() {
    let wrong = HostInput::Send(Err(HeaderError { name: "*SENDIM", kind: HeaderErrorKind::Format }));
    assert_eq!(read(b"AT*SENDIM,3,2,ack,abcdef\rAT?T\r", ReadMode::Commands), [wrong.clone(), command("?T")]);
    assert_eq!(read(b"AT*SENDIM,3,2,maybe,abc\rAT?T\r", ReadMode::Commands), [wrong.clone(), command("?T")]);
    assert_eq!(read(b"AT*SENDIM,3\rAT?T\r", ReadMode::Commands), [wrong, command("?T")]);
}

#[test]
fn payload_of_wrong_size_is_refused_and_skipped() {
    let mut line = b"AT*SENDIM,65,2,ack,".to_vec();
    line.extend([b'\r'; 65]);
    line.extend(b"\rAT*SENDIM,0,2,ack,\rAT?T\r");
    let range = HostInput::Send(Err(HeaderError { name: "*SENDIM", kind: HeaderErrorKind::Range }));
    assert_eq!(read(&line, ReadMode::Commands), [range.clone(), range, command("?T")]);
}

#[test]
fn data_mode_separates_commands_from_data() {
    let inputs = read(b"abc+++AT?MODE\rdef+++xyz", ReadMode::Data);
    let data = |bytes: &[u8]| HostInput::Data(bytes.to_vec());
    assert_eq!(inputs, [data(b"abc"), command("?MODE"), data(b"def+++xyz")]);
}

#[test]
fn partial_escape_waits_for_more_bytes() {
    let mut parser = InputParser::default();
    assert_eq!(read_all(&mut parser, b"ab++", ReadMode::Data), [HostInput::Data(b"ab".to_vec())]);
    assert_eq!(read_all(&mut parser, b"+A", ReadMode::Data), []);
    assert_eq!(read_all(&mut parser, b"T?AL\n", ReadMode::Data), [command("?AL")]);
    assert_eq!(read_all(&mut parser, b"++", ReadMode::Data), []);
    assert_eq!(read_all(&mut parser, b"x", ReadMode::Data), [HostInput::Data(b"++x".to_vec())]);
}

#[test]
fn plus_signs_between_silences_are_an_escape() {
    let mut parser = InputParser::default();
    parser.push(b"+++", Duration::from_secs(5));
    assert_eq!(parser.next(ReadMode::Data), None);
    assert_eq!(parser.timeout(ReadMode::Data), Some(Duration::from_secs(6)));
    assert_eq!(parser.handle_timeout(Duration::from_secs(6), ReadMode::Data), Some(HostInput::Escape));
}

#[test]
fn plus_signs_without_silence_before_are_data() {
    let mut parser = InputParser::default();
    parser.push(b"x", Duration::from_millis(4500));
    assert!(parser.next(ReadMode::Data).is_some());
    parser.push(b"+++", Duration::from_secs(5));
    assert_eq!(parser.next(ReadMode::Data), None);
    let silence = parser.handle_timeout(Duration::from_secs(6), ReadMode::Data);
    assert_eq!(silence, Some(HostInput::Data(b"+++".to_vec())));
}

#[test]
fn overlong_line_is_refused_once() {
    for piece in [7, 600, 2000] {
        let mut parser = InputParser::default();
        let inputs: Vec<_> =
            [b'X'; 2000].chunks(piece).flat_map(|bytes| read_all(&mut parser, bytes, ReadMode::Commands)).collect();
        assert_eq!(inputs, [HostInput::WrongFormat], "{piece}");
        assert_eq!(read_all(&mut parser, b"\rAT?T\r", ReadMode::Commands), [command("?T")]);
    }
}

#[test]
fn endless_line_is_not_kept() {
    let mut parser = InputParser::default();
    for mode in [ReadMode::Commands, ReadMode::Data] {
        for _ in 0..200 {
            read_all(&mut parser, &[b'A'; 1000], mode);
            assert!(parser.buffer.len() <= 10_000);
        }
    }
    assert_eq!(read_all(&mut parser, b"\r", ReadMode::Commands), []);
    assert_eq!(read_all(&mut parser, b"AT?T\r", ReadMode::Commands), [command("?T")]);
}

proptest! {
    #[test]
    fn any_bytes_are_survived_in_bounded_memory(
        pieces in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..200), 0..40),
        data in any::<bool>(),
    ) {
        let mode = if data { ReadMode::Data } else { ReadMode::Commands };
        let mut parser = InputParser::default();
        for piece in pieces {
            read_all(&mut parser, &piece, mode);
            prop_assert!(parser.buffer.len() < 10_000);
        }
    }

    #[test]
    fn next_command_is_read_after_a_mutated_line(
        at in 0usize..40, byte in any::<u8>(), cut in 0usize..40, data in any::<bool>(),
    ) {
        let mode = if data { ReadMode::Data } else { ReadMode::Commands };
        let mut line = b"+++AT*SENDIMS,p1,12,2,4000000,hello, world\r".to_vec();
        line[at] = byte;
        line.truncate(line.len() - cut);
        let mut parser = InputParser::default();
        read_all(&mut parser, &line, mode);
        read_all(&mut parser, &[b'\r'; 9000], mode);
        read_all(&mut parser, b"+++\r", mode);
        let inputs = read_all(&mut parser, if data { b"+++AT?T\r" } else { b"AT?T\r" }, mode);
        prop_assert_eq!(inputs.last(), Some(&command("?T")));
    }
}

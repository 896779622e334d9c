//! `*SEND`, `*SENDIM`, `*SENDIMS`, `*SENDPBM`: the fields before the payload.

/// Longest payload that is counted and skipped although it is too long to send.
const MAX_COUNTED_BYTES: usize = 8192;
/// Longest field before a comma; `*SENDIMS` and 32-bit times fit.
const MAX_FIELD_BYTES: usize = 12;

#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct SendCommand {
    pub service: SendService,
    pub pid: Option<u8>,
    pub length: usize,
    pub dst: u8,
    pub data: Vec<u8>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum SendService {
    Burst,
    Instant(InstantFlag),
    /// At this time of the modem's clock, us, or as soon as possible.
    Synchronous(Option<u32>),
    Piggyback,
}

/// Whether an instant message is acknowledged, and whether it is sent in back-off.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum InstantFlag {
    Ack,
    NoAck,
    Force,
}

impl InstantFlag {
    pub(crate) const ALL: [InstantFlag; 3] = [InstantFlag::Ack, InstantFlag::NoAck, InstantFlag::Force];

    pub(crate) fn name(self) -> &'static str {
        match self {
            InstantFlag::Ack => "ack",
            InstantFlag::NoAck => "noack",
            InstantFlag::Force => "force",
        }
    }

    fn parse(text: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|flag| flag.name() == text)
    }
}

impl SendService {
    /// The command's name, as TIES replies repeat it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            SendService::Burst => "*SEND",
            SendService::Instant(_) => "*SENDIM",
            SendService::Synchronous(_) => "*SENDIMS",
            SendService::Piggyback => "*SENDPBM",
        }
    }

    fn max_length(self) -> usize {
        if self == SendService::Burst { 1024 } else { 64 }
    }
}

/// An error in a message, with the name of the command for the reply.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct HeaderError {
    pub name: &'static str,
    pub kind: HeaderErrorKind,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum HeaderErrorKind {
    Format,
    Range,
}

pub(crate) enum HeaderParse {
    /// The line is not a message command.
    NoSend,
    Incomplete,
    Wrong(HeaderError),
    /// The fields and their length in bytes.
    Message(SendCommand, usize),
}

impl SendCommand {
    /// Refuses a payload that is empty or longer than the service carries.
    pub(crate) fn check_length(self) -> Result<Self, HeaderError> {
        let fits = (1..=self.service.max_length()).contains(&self.length);
        if fits { Ok(self) } else { Err(HeaderError { name: self.service.name(), kind: HeaderErrorKind::Range }) }
    }
}

/// Reads `AT*SEND..` up to the comma before the payload.
pub(crate) fn parse_header(text: &[u8]) -> HeaderParse {
    const START: &[u8] = b"AT*SEND";
    if !text.starts_with(START) {
        return if START.starts_with(text) { HeaderParse::Incomplete } else { HeaderParse::NoSend };
    }
    let mut fields = HeaderFields { rest: text.get(2..).unwrap_or_default() };
    match message(&mut fields) {
        Ok(command) => HeaderParse::Message(command, text.len() - fields.rest.len()),
        Err(FieldError::Incomplete) => HeaderParse::Incomplete,
        Err(FieldError::Wrong) => {
            HeaderParse::Wrong(HeaderError { name: name_of(text), kind: HeaderErrorKind::Format })
        }
    }
}

/// The longest command name that `AT*SEND..` begins with.
fn name_of(text: &[u8]) -> &'static str {
    let names = ["*SENDIMS", "*SENDIM", "*SENDPBM"];
    names
        .into_iter()
        .find(|name| text.get(2..).is_some_and(|text| text.starts_with(name.as_bytes())))
        .unwrap_or("*SEND")
}

enum FieldError {
    Incomplete,
    Wrong,
}

/// The rest of a header, of which each field ends in a comma.
struct HeaderFields<'a> {
    rest: &'a [u8],
}

impl<'a> HeaderFields<'a> {
    fn next(&mut self) -> Result<&'a str, FieldError> {
        let end = self.rest.iter().position(|byte| matches!(byte, b',' | b'\r' | b'\n'));
        match end {
            Some(end) if self.rest.get(end) == Some(&b',') && end <= MAX_FIELD_BYTES => {
                let (field, rest) = self.rest.split_at_checked(end).ok_or(FieldError::Wrong)?;
                self.rest = rest.get(1..).unwrap_or_default();
                std::str::from_utf8(field).map_err(|_| FieldError::Wrong)
            }
            None if self.rest.len() <= MAX_FIELD_BYTES => Err(FieldError::Incomplete),
            _ => Err(FieldError::Wrong),
        }
    }

    fn number<N: std::str::FromStr>(&mut self) -> Result<N, FieldError> {
        digits(self.next()?).ok_or(FieldError::Wrong)
    }
}

/// A number that consists of decimal digits only.
fn digits<N: std::str::FromStr>(text: &str) -> Option<N> {
    text.parse().ok().filter(|_| text.bytes().all(|byte| byte.is_ascii_digit()))
}

fn message(fields: &mut HeaderFields<'_>) -> Result<SendCommand, FieldError> {
    let name = fields.next()?;
    let mut length = fields.next()?;
    let mut pid = None;
    if let Some(id) = length.strip_prefix('p') {
        pid = Some(digits(id).filter(|id| *id <= 7).ok_or(FieldError::Wrong)?);
        length = fields.next()?;
    }
    let length = digits(length).filter(|length| *length <= MAX_COUNTED_BYTES).ok_or(FieldError::Wrong)?;
    let dst = fields.number()?;
    let service = match name {
        "*SEND" => SendService::Burst,
        "*SENDPBM" => SendService::Piggyback,
        "*SENDIM" => SendService::Instant(InstantFlag::parse(fields.next()?).ok_or(FieldError::Wrong)?),
        "*SENDIMS" => SendService::Synchronous(match fields.next()? {
            "" => None,
            time => Some(digits(time).ok_or(FieldError::Wrong)?),
        }),
        _ => return Err(FieldError::Wrong),
    };
    Ok(SendCommand { service, pid, length, dst, data: Vec::new() })
}

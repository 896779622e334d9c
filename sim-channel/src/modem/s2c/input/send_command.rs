//! `*SEND`, `*SENDIM`, `*SENDIMS`, `*SENDPBM`: the fields before the payload.

/// The longest payload that is still counted out when it is too long to send.
const COUNTED_LIMIT: usize = 8192;
/// The longest field before a comma: `*SENDIMS` and 32-bit times fit.
const FIELD_LIMIT: usize = 12;

/// A message to send.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct SendCommand {
    pub service: SendService,
    pub pid: Option<u8>,
    pub length: usize,
    pub dst: u8,
    pub data: Vec<u8>,
}

/// How it is to be sent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum SendService {
    Burst,
    Instant(InstantFlag),
    /// At a time of the modem's clock in us, or as soon as possible.
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

/// What is wrong with a message, and the command's name for the reply.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct HeaderError {
    pub name: &'static str,
    pub kind: HeaderErrorKind,
}

/// How a message can be wrong.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum HeaderErrorKind {
    Format,
    Range,
}

/// How far the fields were understood.
pub(crate) enum HeaderParse {
    /// Not a message command at all.
    NoSend,
    Incomplete,
    Wrong(HeaderError),
    /// The fields, and how many bytes they took.
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

/// HeaderFields that end in a comma.
struct HeaderFields<'a> {
    rest: &'a [u8],
}

impl<'a> HeaderFields<'a> {
    fn next(&mut self) -> Result<&'a str, FieldError> {
        let end = self.rest.iter().position(|byte| matches!(byte, b',' | b'\r' | b'\n'));
        match end {
            Some(end) if self.rest.get(end) == Some(&b',') && end <= FIELD_LIMIT => {
                let (field, rest) = self.rest.split_at_checked(end).ok_or(FieldError::Wrong)?;
                self.rest = rest.get(1..).unwrap_or_default();
                std::str::from_utf8(field).map_err(|_| FieldError::Wrong)
            }
            None if self.rest.len() <= FIELD_LIMIT => Err(FieldError::Incomplete),
            _ => Err(FieldError::Wrong),
        }
    }

    fn number<N: std::str::FromStr>(&mut self) -> Result<N, FieldError> {
        digits(self.next()?).ok_or(FieldError::Wrong)
    }
}

/// A number of decimal digits and nothing else.
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
    let length = digits(length).filter(|length| *length <= COUNTED_LIMIT).ok_or(FieldError::Wrong)?;
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

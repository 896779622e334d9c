//! The command interpreter: carries out each input of a host and replies exactly once.

use super::S2c;
use super::base::{Interpreter, PortMode, ReceiverMode, S2cTask, SettingError, Settings};
use super::input::{HeaderErrorKind, HostInput, SendCommand, SendService};
use std::time::Duration;

const UNKNOWN_COMMAND: &str = "ERROR UNKNOWN COMMAND";
const WRONG_FORMAT: &str = "ERROR WRONG FORMAT";
const OUT_OF_RANGE: &str = "ERROR OUT OF RANGE";
/// Bytes that `@ZL` accepts for the pool.
const POOL_RANGE: std::ops::RangeInclusive<usize> = 8096..=2_097_152;

/// The reply to a command.
enum CommandReply {
    Bytes(Vec<u8>),
    /// Lines, closed by an empty one.
    Lines(String),
    None,
}

impl From<&str> for CommandReply {
    fn from(text: &str) -> Self {
        CommandReply::Bytes(text.as_bytes().to_vec())
    }
}

impl From<String> for CommandReply {
    fn from(text: String) -> Self {
        CommandReply::Bytes(text.into_bytes())
    }
}

impl S2c {
    /// Carries out an input of the requesting host; the reply comes before the notifications that follow from it.
    pub(super) fn on_input(&mut self, input: HostInput, now: Duration) {
        match input {
            HostInput::Data(bytes) => self.bursts.submit_raw(&mut self.base, &bytes, now),
            HostInput::WrongFormat if self.base.port.in_data_mode() => self.base.reply("", WRONG_FORMAT, now),
            HostInput::WrongFormat => self.base.reply_unwrapped(WRONG_FORMAT, now),
            HostInput::Escape => {
                self.base.port.set_mode(PortMode::Command);
                self.base.reply_unwrapped("OK", now);
            }
            HostInput::Send(Ok(command)) => {
                let name = command.service.name();
                let reply = self.on_send(command, now);
                self.base.reply(name, reply, now);
            }
            HostInput::Send(Err(error)) => {
                let text = match error.kind {
                    HeaderErrorKind::Format => WRONG_FORMAT,
                    HeaderErrorKind::Range => OUT_OF_RANGE,
                };
                self.base.reply(error.name, text, now);
            }
            HostInput::Command(text) => self.on_command(&text, now),
        }
    }

    fn on_send(&mut self, command: SendCommand, now: Duration) -> &'static str {
        let Self { base, messages, bursts, .. } = self;
        if let Some(refusal) = base.condition.refusal(now) {
            return refusal;
        }
        let in_backoff = bursts.in_backoff(command.dst, now);
        match command.service {
            SendService::Burst => bursts.submit(base, command, now),
            SendService::Instant(flag) => messages.instant.submit(base, command, flag, in_backoff, now),
            SendService::Synchronous(time) => messages.synchronous.submit(base, command, time, in_backoff, now),
            SendService::Piggyback => messages.piggyback.submit(base, command, now),
        }
    }

    fn on_command(&mut self, text: &str, now: Duration) {
        let (name, value) = split(text);
        let key = name.get(1..).unwrap_or_default();
        let reply = match name.as_bytes() {
            [] if text.is_empty() => "OK".into(),
            [b'?', ..] => self.query(key, now),
            [b'!', ..] => self.set(key, value, now).into(),
            [b'@', ..] => self.set_option(key, value).into(),
            [b'&', ..] => self.store(key),
            _ => self.plain_command(&name, value, now),
        };
        match reply {
            CommandReply::Bytes(body) => self.base.reply(&name, body, now),
            CommandReply::Lines(body) => self.base.reply(&name, body, now),
            CommandReply::None => {}
        }
    }

    fn query(&mut self, key: &str, now: Duration) -> CommandReply {
        match key {
            "S" if self.base.config.interpreter == Interpreter::Net => CommandReply::Lines(self.status(now)),
            "S" => self.status(now).into(),
            "P" => CommandReply::Lines(self.reception.multipath()),
            "ZSL" => CommandReply::Lines(self.protocol_ids()),
            "NOISE" => CommandReply::Bytes(self.noise()),
            _ => self.value(key, now).map_or(UNKNOWN_COMMAND.into(), CommandReply::from),
        }
    }

    /// `AT?S`: one line in the AT interpreter; five lines and an empty one in NET.
    fn status(&self, now: Duration) -> String {
        let Self { base, bursts, .. } = self;
        let state = bursts.state_name(base.condition.receiver(), now);
        let free = bursts.free(base);
        if base.config.interpreter == Interpreter::At {
            return format!("{state} {free}");
        }
        let remote = bursts.peer().unwrap_or_else(|| base.settings.byte("AR"));
        let promiscuous = if base.settings.get("RP") == 1 { "ON" } else { "OFF" };
        format!(
            "Local Address: {}\r\nRemote Address: {remote}\r\nAcoustic Link: {state}\r\nPool Status: {free}\r\n\
             Promiscuous Mode: {promiscuous}\r\n",
            base.address()
        )
    }

    /// `AT?ZSL`: protocol ids and the bytes free for each.
    fn protocol_ids(&self) -> String {
        format!("{}: {}\r\n", self.base.settings.get("ZS"), self.bursts.free(&self.base))
    }

    /// `AT?NOISE`: a binary sample of the ambient noise.
    fn noise(&mut self) -> Vec<u8> {
        const SAMPLES: usize = 64;
        let mut out = format!("NOISE,{SAMPLES},1,0,0,").into_bytes();
        out.extend((0..SAMPLES).map(|_| self.base.board.rng.below(256) as u8));
        out
    }

    /// A value on one line; each part knows the values of its own state.
    fn value(&self, key: &str, now: Duration) -> Option<String> {
        let Self { base, reception, usbl, messages, bursts } = self;
        Some(match key {
            "MODE" => if base.config.interpreter == Interpreter::At { "AT" } else { "NET" }.to_string(),
            "PID" => base.settings.shown("ZS")?,
            "BV" => "23.9".to_string(),
            "BL" | "BR" => if bursts.is_online() { base.config.bit_rate } else { 0 }.to_string(),
            "ZL" => base.settings.pool.to_string(),
            "UT" => format!("{:.6}", base.clock(now).as_secs_f64()),
            "CLOCK" => base.clock_us(now).to_string(),
            _ => {
                return reception
                    .value(key)
                    .or_else(|| bursts.value(key))
                    .or_else(|| messages.value(key))
                    .or_else(|| usbl.value(key))
                    .or_else(|| base.options.value(key))
                    .or_else(|| base.settings.shown(key));
            }
        })
    }

    fn set(&mut self, key: &str, value: &str, now: Duration) -> &'static str {
        if self.base.config.needs_control && !self.base.options.control() {
            return "ERROR NOT ACCEPTED";
        }
        if key == "UT" {
            return self.set_clock(value, now);
        }
        match self.base.settings.set(key, value, self.bursts.is_online()) {
            Ok(true) => "OK",
            Ok(false) => "[*]OK",
            Err(SettingError::Unknown) => UNKNOWN_COMMAND,
            Err(SettingError::NotANumber) => WRONG_FORMAT,
            Err(SettingError::OutOfRange) => OUT_OF_RANGE,
        }
    }

    /// Sets the physical clock: `!UT<seconds>[.fraction]`.
    fn set_clock(&mut self, value: &str, now: Duration) -> &'static str {
        match value.parse().ok().and_then(|seconds: f64| Duration::try_from_secs_f64(seconds).ok()) {
            Some(time) if time < Duration::from_secs(1 << 40) => {
                self.base.set_clock(time, now);
                "OK"
            }
            Some(_) => OUT_OF_RANGE,
            None => WRONG_FORMAT,
        }
    }

    fn set_option(&mut self, key: &str, value: &str) -> &'static str {
        if key == "ZL" {
            return self.set_pool(value);
        }
        if value.is_empty() && self.bursts.reset_counter(key) {
            return "OK";
        }
        self.base.options.set(key, value)
    }

    fn set_pool(&mut self, bytes: &str) -> &'static str {
        match bytes.parse() {
            Ok(bytes) if !POOL_RANGE.contains(&bytes) => OUT_OF_RANGE,
            Ok(_) if self.bursts.undelivered() > 0 => "ERROR BUFFER IS NOT EMPTY",
            Ok(bytes) => {
                self.base.settings.pool = bytes;
                "OK"
            }
            Err(_) => WRONG_FORMAT,
        }
    }

    fn store(&mut self, key: &str) -> CommandReply {
        let base = &mut self.base;
        match key {
            "W" => base.stored = base.settings.clone(),
            "F" => base.settings = Settings::factory(base.config.address, base.config.remote),
            "V" => return CommandReply::Lines(base.settings.listing()),
            _ => return UNKNOWN_COMMAND.into(),
        }
        "OK".into()
    }

    fn plain_command(&mut self, name: &str, value: &str, now: Duration) -> CommandReply {
        let at_interpreter = self.base.config.interpreter == Interpreter::At;
        match (name, value) {
            ("A", "") => self.enter(ReceiverMode::Listen).into(),
            ("N", "") => self.enter(ReceiverMode::Noise).into(),
            ("D", "") => self.enter(ReceiverMode::Deaf).into(),
            ("O", "") if at_interpreter => {
                self.base.port.set_mode(PortMode::Data);
                CommandReply::None
            }
            ("C", "") if at_interpreter => {
                self.base.port.set_mode(PortMode::Command);
                "OK".into()
            }
            ("I0", "") => "1.9".into(),
            ("I1", "") => "phy:S2C PHY 0.9, mac:D-MAC v1.8".into(),
            ("I7", "") => "EvoLogics GmbH (emulated)".into(),
            ("Z0", "") => {
                self.base.board.schedule(now, S2cTask::Reboot);
                CommandReply::None
            }
            ("Z1", "") => self.drop_bursts(now).into(),
            ("Z3", "") => {
                self.base.board.schedule(now, S2cTask::CancelMessages);
                "OK".into()
            }
            ("Z4", "") => {
                self.base.board.schedule(now, S2cTask::CancelMessages);
                self.drop_bursts(now).into()
            }
            ("H", "0" | "1" | "") => {
                self.bursts.close(&mut self.base, &mut self.messages, now);
                "OK".into()
            }
            _ => UNKNOWN_COMMAND.into(),
        }
    }

    fn enter(&mut self, mode: ReceiverMode) -> &'static str {
        self.base.condition.set_receiver(mode);
        match mode {
            ReceiverMode::Listen => "INITIATION LISTEN",
            ReceiverMode::Noise => "INITIATION NOISE",
            ReceiverMode::Deaf => "INITIATION DEAF",
        }
    }

    /// The number of bytes dropped is reported after the reply.
    fn drop_bursts(&mut self, now: Duration) -> &'static str {
        let bytes = self.bursts.drop_all(&mut self.base, &mut self.messages, now);
        if bytes > 0 {
            self.base.board.schedule(now, S2cTask::Notify(format!("DROPCNT,{bytes}")));
        }
        "OK"
    }
}

/// The name, which TIES replies repeat, and the value behind it: a sign and letters; for `Z` and `I` also the digit.
fn split(text: &str) -> (String, &str) {
    let sign = usize::from(text.starts_with(['!', '?', '@', '&', '%', '$', '*']));
    let letters = text.bytes().skip(sign).take_while(u8::is_ascii_uppercase).count();
    let plain = text.get(..sign + letters).unwrap_or_default();
    let digit = matches!(plain, "Z" | "I") && text.as_bytes().get(1).is_some_and(u8::is_ascii_digit);
    let (name, value) = text.split_at_checked(sign + letters + usize::from(digit)).unwrap_or((text, ""));
    (name.to_string(), value)
}

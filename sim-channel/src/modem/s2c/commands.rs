//! The commands that carry no message.

use super::config::Interpreter;
use super::input::Input;
use super::reply::Mode;
use super::send_command::{Problem, SendCommand, Service};
use super::settings::Refusal;
use super::{Event, Physical, S2c};
use crate::Duration;

/// What there is to say to a command.
enum Answer {
    Text(String),
    Bytes(Vec<u8>),
    /// Lines, closed by an empty one.
    Lines(String),
    Silence,
}

impl From<&str> for Answer {
    fn from(text: &str) -> Self {
        Answer::Text(text.to_string())
    }
}

impl S2c {
    /// Does what the host wrote and answers exactly once, before anything that follows from it.
    pub(super) fn on_input(&mut self, input: Input, now: Duration) {
        match input {
            Input::Data(bytes) => self.send_raw(&bytes, now),
            Input::WrongFormat if self.in_data_mode() => self.reply("", "ERROR WRONG FORMAT", now),
            Input::WrongFormat => self.plain_line("ERROR WRONG FORMAT", now),
            Input::Escape => {
                self.mode = Mode::Command;
                self.plain_line("OK", now);
            }
            Input::Send(Ok(command)) => {
                let name = command.service.name();
                let answer = self.on_send(command, now);
                self.reply(name, answer, now);
            }
            Input::Send(Err(error)) => {
                let text = match error.problem {
                    Problem::Format => "ERROR WRONG FORMAT",
                    Problem::Range => "ERROR OUT OF RANGE",
                };
                self.reply(error.name, text, now);
            }
            Input::Command(text) => self.on_command(&text, now),
        }
    }

    fn on_send(&mut self, command: SendCommand, now: Duration) -> &'static str {
        if now < self.busy_until {
            return "BUSY BACKOFF STATE";
        }
        if self.physical != Physical::Listen {
            return "ERROR PHY OFF";
        }
        match command.service {
            Service::Burst => self.send_burst(command, now),
            Service::Instant(flag) => self.send_instant(command, flag, now),
            Service::Synchronous(time) => self.send_synchronous(command, time, now),
            Service::Piggyback => self.send_piggyback(command, now),
        }
    }

    fn on_command(&mut self, text: &str, now: Duration) {
        let (name, value) = split(text);
        let answer = match name.as_bytes() {
            [] if text.is_empty() => "OK".into(),
            [b'?', ..] => self.query(&name, now),
            [b'!', ..] => self.set(name.get(1..).unwrap_or_default(), value, now),
            [b'@', ..] => self.option(name.get(1..).unwrap_or_default(), value),
            [b'&', ..] => self.store(&name),
            _ => self.plain_command(&name, value, now),
        };
        match answer {
            Answer::Text(body) => self.reply(&name, body, now),
            Answer::Bytes(body) => self.reply(&name, body, now),
            Answer::Lines(body) => self.reply(&name, body, now),
            Answer::Silence => {}
        }
    }

    fn query(&mut self, name: &str, now: Duration) -> Answer {
        match name {
            "?S" if self.config.interpreter == Interpreter::Net => Answer::Lines(self.status(now)),
            "?S" => Answer::Text(self.status(now)),
            "?P" => Answer::Lines(self.multipath()),
            "?ZSL" => Answer::Lines(self.channels()),
            "?NOISE" => Answer::Bytes(self.noise()),
            _ => match self.value(name.get(1..).unwrap_or_default(), now) {
                Some(value) => Answer::Text(value),
                None => "ERROR UNKNOWN COMMAND".into(),
            },
        }
    }

    fn set(&mut self, key: &str, value: &str, now: Duration) -> Answer {
        if self.config.needs_control && !self.controls {
            return "ERROR NOT ACCEPTED".into();
        }
        if key == "UT" {
            return self.set_clock(value, now);
        }
        match self.settings.set(key, value, self.is_online()) {
            Ok(true) => "OK".into(),
            Ok(false) => "[*]OK".into(),
            Err(Refusal::Unknown) => "ERROR UNKNOWN COMMAND".into(),
            Err(Refusal::NotANumber) => "ERROR WRONG FORMAT".into(),
            Err(Refusal::OutOfRange) => "ERROR OUT OF RANGE".into(),
        }
    }

    /// `!UT<seconds>[.fraction]`; only ever forward of the run's own clock.
    fn set_clock(&mut self, value: &str, now: Duration) -> Answer {
        match value.parse().ok().and_then(|seconds: f64| Duration::try_from_secs_f64(seconds).ok()) {
            Some(time) if time < Duration::from_secs(1 << 40) => {
                self.clock_offset = time.saturating_sub(now);
                "OK".into()
            }
            Some(_) => "ERROR OUT OF RANGE".into(),
            None => "ERROR WRONG FORMAT".into(),
        }
    }

    fn option(&mut self, key: &str, value: &str) -> Answer {
        let switch = match (key, value) {
            ("CTRL", "") => {
                self.controls = true;
                return "OK".into();
            }
            ("ZD", "") => {
                self.burst.dropped = 0;
                return "OK".into();
            }
            ("ZO", "") => {
                self.burst.overflowed = 0;
                return "OK".into();
            }
            ("ZL", bytes) => return self.set_pool(bytes),
            (_, "0") => false,
            (_, "1") => true,
            ("ZX" | "ZU" | "ZF" | "ZA", _) => return "ERROR OUT OF RANGE".into(),
            _ => return "ERROR UNKNOWN COMMAND".into(),
        };
        match key {
            "ZX" => self.options.extended = switch,
            "ZU" => self.options.usbl = switch,
            "ZF" => self.options.networking = switch,
            "ZA" => self.options.other = switch,
            _ => return "ERROR UNKNOWN COMMAND".into(),
        }
        "OK".into()
    }

    fn set_pool(&mut self, bytes: &str) -> Answer {
        match bytes.parse() {
            Ok(8096..=2_097_152) if self.burst.bytes() > 0 => "ERROR BUFFER IS NOT EMPTY".into(),
            Ok(bytes @ 8096..=2_097_152) => {
                self.settings.pool = bytes;
                "OK".into()
            }
            Ok(_) => "ERROR OUT OF RANGE".into(),
            Err(_) => "ERROR WRONG FORMAT".into(),
        }
    }

    fn store(&mut self, name: &str) -> Answer {
        match name {
            "&W" => self.stored = self.settings.clone(),
            "&F" => self.settings = super::settings::Settings::factory(self.config.address, self.config.remote),
            "&V" => return Answer::Lines(self.all_settings()),
            _ => return "ERROR UNKNOWN COMMAND".into(),
        }
        "OK".into()
    }

    fn plain_command(&mut self, name: &str, value: &str, now: Duration) -> Answer {
        match (name, value) {
            ("A", "") => self.enter(Physical::Listen),
            ("N", "") => self.enter(Physical::Noise),
            ("D", "") => self.enter(Physical::Deaf),
            ("O", "") if self.config.interpreter == Interpreter::At => {
                self.mode = Mode::Data;
                Answer::Silence
            }
            ("C", "") if self.config.interpreter == Interpreter::At => {
                self.mode = Mode::Command;
                "OK".into()
            }
            ("I0", "") => "1.9".into(),
            ("I1", "") => "phy:S2C PHY 0.9, mac:D-MAC v1.8".into(),
            ("I7", "") => "EvoLogics GmbH (emulated)".into(),
            ("Z0", "") => {
                self.board.plan(now, Event::Reboot);
                Answer::Silence
            }
            ("Z1", "") => self.drop_and_tell(now),
            ("Z3", "") => {
                self.board.plan(now, Event::CancelMessages);
                "OK".into()
            }
            ("Z4", "") => {
                self.board.plan(now, Event::CancelMessages);
                self.drop_and_tell(now)
            }
            ("H", "0" | "1" | "") => {
                self.close_connection(now);
                "OK".into()
            }
            _ => "ERROR UNKNOWN COMMAND".into(),
        }
    }

    fn enter(&mut self, physical: Physical) -> Answer {
        self.physical = physical;
        match physical {
            Physical::Listen => "INITIATION LISTEN".into(),
            Physical::Noise => "INITIATION NOISE".into(),
            Physical::Deaf => "INITIATION DEAF".into(),
        }
    }

    /// The bytes dropped are told after the reply.
    fn drop_and_tell(&mut self, now: Duration) -> Answer {
        let bytes = self.drop_bursts(now);
        if bytes > 0 {
            self.board.plan(now, Event::Notify(format!("DROPCNT,{bytes}")));
        }
        "OK".into()
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

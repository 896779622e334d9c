//! Answers of more than one line, or of bytes.

use super::S2c;
use super::config::Interpreter;
use super::reception::VELOCITY;
use crate::Duration;

/// Names and keys of `AT&V`, in the order of firmware 1.9.
const LISTED: [(&str, &str); 18] = [
    ("Source Level", "L"),
    ("Source Level Control", "LC"),
    ("Gain", "G"),
    ("Carrier Waveform ID", "C"),
    ("Local Address", "AL"),
    ("Highest Address", "AM"),
    ("Cluster Size", "ZC"),
    ("Packet Time", "ZP"),
    ("Retry Count", "RC"),
    ("Retry Timeout", "RT"),
    ("Wake Up Active Time", "DA"),
    ("Wake Up Period", "DT"),
    ("Promiscuous Mode", "RP"),
    ("Sound Speed", "CA"),
    ("IM Retry Count", "RI"),
    ("Pool Size", "ZL"),
    ("Hold Timeout", "ZH"),
    ("Idle Timeout", "ZI"),
];

impl S2c {
    /// `AT?S`: one line in the AT interpreter; five lines and an empty one in NET.
    pub(super) fn status(&self, now: Duration) -> String {
        let state = self.state_name(now);
        let free = self.settings.pool.saturating_sub(self.burst.waiting());
        if self.config.interpreter == Interpreter::At {
            return format!("{state} {free}");
        }
        let remote = self.burst.link.peer().unwrap_or_else(|| self.settings.byte("AR"));
        let promiscuous = if self.settings.get("RP") == 1 { "ON" } else { "OFF" };
        format!(
            "Local Address: {}\r\nRemote Address: {remote}\r\nAcoustic Link: {state}\r\nPool Status: {free}\r\n\
             Promiscuous Mode: {promiscuous}\r\n",
            self.address()
        )
    }

    /// `AT&V`: `Name: value` lines and an empty one; values that wait are marked before the name, as in `[*]Gain: 1`.
    pub(super) fn all_settings(&self) -> String {
        let line = |(name, key): &(&str, &str)| {
            let told =
                if *key == "ZL" { self.settings.pool.to_string() } else { self.settings.told(key).unwrap_or_default() };
            match told.strip_prefix("[*]") {
                Some(waits) => format!("[*]{name}: {waits}\r\n"),
                None => format!("{name}: {told}\r\n"),
            }
        };
        LISTED.iter().map(line).collect()
    }

    /// `AT?P`: eight paths of the last reception, delay in us and strength; LF only, 96 bytes.
    pub(super) fn multipath(&self) -> String {
        let strength = u32::try_from(self.last.integrity).unwrap_or_default();
        (0..8u32).map(|path| format!("{:<6} {:<4}\n", path * 470, strength >> path)).collect()
    }

    /// `AT?ZSL`: protocol ids and the bytes free for each.
    pub(super) fn channels(&self) -> String {
        let free = self.settings.pool.saturating_sub(self.burst.waiting());
        format!("{}: {free}\r\n", self.settings.get("ZS"))
    }

    /// `AT?NOISE`: a binary sample of the ambient noise.
    pub(super) fn noise(&mut self) -> Vec<u8> {
        const SAMPLES: usize = 64;
        let mut out = format!("NOISE,{SAMPLES},1,0,0,").into_bytes();
        out.extend((0..SAMPLES).map(|_| self.board.chance.below(256) as u8));
        out
    }

    /// The plain values behind `?` that are no settings.
    pub(super) fn value(&self, key: &str, now: Duration) -> Option<String> {
        let clock_s = (now + self.clock_offset).as_secs_f64();
        Some(match key {
            "MODE" => if self.config.interpreter == Interpreter::At { "AT" } else { "NET" }.to_string(),
            "PID" => self.settings.told("ZS")?,
            "PC" => self.burst.last_count.to_string(),
            "BV" => "23.9".to_string(),
            "T" => self.last.travel_us.to_string(),
            "E" => self.last.rssi.to_string(),
            "I" => self.last.integrity.to_string(),
            "V" => VELOCITY.to_string(),
            "BL" | "BR" => if self.is_online() { self.config.bit_rate } else { 0 }.to_string(),
            "ZD" => self.burst.dropped.to_string(),
            "ZO" => self.burst.overflowed.to_string(),
            "ZE" => self.burst.delivered.to_string(),
            "ZL" => self.settings.pool.to_string(),
            "ZX" => u8::from(self.options.extended).to_string(),
            "ZU" => u8::from(self.options.usbl).to_string(),
            "ZF" => u8::from(self.options.networking).to_string(),
            "ZA" => u8::from(self.options.other).to_string(),
            "UP" => self.last_fix_line(false),
            "UPX" => self.last_fix_line(true),
            "UT" => format!("{clock_s:.6}"),
            "CLOCK" => self.clock_us(now).to_string(),
            "DI" => self.instant_state().to_string(),
            "DP" => if self.piggyback.is_some() { "DELIVERING" } else { "EMPTY" }.to_string(),
            _ => return self.settings.told(key),
        })
    }

    fn instant_state(&self) -> &'static str {
        if self.instant.pending.is_some() { "DELIVERING" } else { self.instant.outcome.unwrap_or("EMPTY") }
    }
}

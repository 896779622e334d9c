//! Configuration, clock, sleep and reboot, and the sentences that are only repeated.

use super::clock::Civil;
use super::sentence::Sentence;
use super::{Event, Generation, Micromodem};
use crate::Duration;

impl Micromodem {
    pub(super) fn on_housekeeping(&mut self, sentence: &Sentence, now: Duration) {
        match sentence.name.as_str() {
            "CCCFG" => self.on_configure(sentence, now),
            "CCCFQ" => self.on_configuration_query(sentence, now),
            "CCMSC" => self.on_sleep(sentence, now),
            "CCCLK" => self.on_set_clock(sentence, now),
            "CCTMS" => self.on_set_time(sentence, now),
            "CCTMQ" => {
                // It takes half a second to answer, with the time of the question.
                let reply = format!("CATMQ,{},USER_CMD,RTC", self.clock.iso(now));
                self.board.plan(now + Duration::from_millis(500), Event::Tell(reply));
            }
            "CCALQ" => self.tell("CAALQ,MICROMODEM2,16", now),
            "CCMEC" | "CCRSP" | "CCPDT" | "CCPNT" | "CCPGT" | "CCSWP" | "CCMSQ" | "CCCFR" => {
                self.tell(&sentence.echo(), now);
            }
            // Position and navigation sentences that some hosts pass through.
            name if name.starts_with("GP") || name.starts_with("SN") => {}
            _ => self.complain("NMEA", 1, "Unknown command", now),
        }
    }

    /// `$CCCFG,<name>,<value>`, repeated literally; `ALL,0` restores the factory's values but for `SRC`.
    fn on_configure(&mut self, sentence: &Sentence, now: Duration) {
        let (name, value) = (sentence.text(0), sentence.text(1));
        if name.is_empty() || value.is_empty() {
            return self.complain("NMEA", 1, "CCCFG: name and value expected", now);
        }
        if (name, value) == ("ALL", "0") {
            self.nvram = super::Nvram::factory(self.address());
        } else if name != "ALL" {
            self.nvram.set(name, value);
        }
        self.tell(&sentence.echo(), now);
    }

    /// `$CCCFQ,<name>`, or `ALL`, or `TOP`.
    fn on_configuration_query(&mut self, sentence: &Sentence, now: Duration) {
        let name = sentence.text(0);
        if name == "ALL" || (name == "TOP" && self.config.generation == Generation::Two) {
            let all: Vec<_> = self.nvram.all().map(|(name, value)| format!("CACFG,{name},{value}")).collect();
            all.iter().for_each(|line| self.tell(line, now));
            return;
        }
        match self.nvram.get(name).map(|value| format!("CACFG,{name},{value}")) {
            Some(line) => self.tell(&line, now),
            None => self.complain("NMEA", 1, "CCCFQ: unknown name", now),
        }
    }

    /// `$CCMSC,<src>,<dst>,<minutes>`: 0 reboots now, -1 sleeps until the host writes.
    fn on_sleep(&mut self, sentence: &Sentence, now: Duration) {
        let Some(minutes) = sentence.number::<i32>(2).filter(|minutes| *minutes >= -1) else {
            return self.complain("NMEA", 1, "CCMSC: wrong field", now);
        };
        self.tell(&sentence.echo(), now);
        if sentence.number::<u8>(1) != Some(self.address()) {
            return;
        }
        if minutes == 0 {
            return self.board.plan(now, Event::Reboot);
        }
        self.fall_silent(now);
        match u64::try_from(minutes) {
            Ok(minutes) => self.board.plan(now + Duration::from_secs(60 * minutes), Event::Reboot),
            Err(_) => self.wakes_on_host = true,
        }
    }

    /// `$CCCLK,yyyy,mm,dd,HH,MM,SS`
    fn on_set_clock(&mut self, sentence: &Sentence, now: Duration) {
        let mut numbers = [0; 6];
        let whole = numbers.iter_mut().enumerate().all(|(index, slot)| {
            let number = sentence.number(index);
            *slot = number.unwrap_or_default();
            number.is_some()
        });
        match Civil::new(numbers).filter(|_| whole) {
            Some(civil) => {
                self.clock.set(civil, now);
                self.tell(&sentence.echo(), now);
            }
            None => self.complain("NMEA", 1, "CCCLK: no such time", now),
        }
    }

    /// `$CCTMS,<time>,<0 now, 1 at the next pulse>`
    fn on_set_time(&mut self, sentence: &Sentence, now: Duration) {
        let text = sentence.text(0);
        let civil = Civil::parse_iso(text);
        if let Some(civil) = civil {
            self.clock.set(civil, now);
        }
        self.tell(&format!("CATMS,{},{text}", u8::from(civil.is_none())), now);
    }
}

//! Configuration, clock, sleep and reboot, and the sentences that are only repeated.

use super::base::{CivilTime, MicromodemBase, MicromodemTask};
use super::nvram::Nvram;
use super::sentence::NmeaSentence;
use std::time::Duration;

pub(super) enum Sleep {
    Until(Duration),
    UntilHostWrites,
}

pub(super) fn on_sentence(base: &mut MicromodemBase, sentence: &NmeaSentence, now: Duration) {
    match sentence.name.as_str() {
        "CCCFG" => on_configure(base, sentence, now),
        "CCCFQ" => on_configuration_query(base, sentence, now),
        "CCCLK" => on_set_clock(base, sentence, now),
        "CCTMS" => on_set_time(base, sentence, now),
        "CCTMQ" => {
            // The reply takes half a second and holds the time of the query.
            let reply = format!("CATMQ,{},USER_CMD,RTC", base.clock.iso(now));
            base.board.schedule(now + Duration::from_millis(500), MicromodemTask::Report(reply));
        }
        "CCALQ" => base.report("CAALQ,MICROMODEM2,16", now),
        "CCMEC" | "CCRSP" | "CCPDT" | "CCPNT" | "CCPGT" | "CCSWP" | "CCMSQ" | "CCCFR" => {
            base.report(&sentence.echo(), now);
        }
        // Position and navigation sentences that some hosts pass through.
        name if name.starts_with("GP") || name.starts_with("SN") => {}
        _ => base.report_error("NMEA", 1, "Unknown command", now),
    }
}

/// `$CCCFG,<name>,<value>`, repeated literally; `ALL,0` restores the factory values except `SRC`.
fn on_configure(base: &mut MicromodemBase, sentence: &NmeaSentence, now: Duration) {
    let (name, value) = (sentence.text(0), sentence.text(1));
    if name.is_empty() || value.is_empty() {
        return base.report_error("NMEA", 1, "CCCFG: name and value expected", now);
    }
    if (name, value) == ("ALL", "0") {
        base.nvram = Nvram::factory(base.address());
    } else if name != "ALL" {
        base.nvram.set(name, value);
    }
    base.report(&sentence.echo(), now);
}

/// `$CCCFQ,<name>`, or `ALL`, or `TOP`.
fn on_configuration_query(base: &mut MicromodemBase, sentence: &NmeaSentence, now: Duration) {
    let name = sentence.text(0);
    if name == "ALL" || (name == "TOP" && !base.is_first_generation()) {
        let all: Vec<_> = base.nvram.all().map(|(name, value)| format!("CACFG,{name},{value}")).collect();
        all.iter().for_each(|line| base.report(line, now));
        return;
    }
    match base.nvram.get(name).map(|value| format!("CACFG,{name},{value}")) {
        Some(line) => base.report(&line, now),
        None => base.report_error("NMEA", 1, "CCCFQ: unknown name", now),
    }
}

/// `$CCMSC,<src>,<dst>,<minutes>`: 0 reboots now, -1 sleeps until the host writes.
pub(super) fn on_sleep(base: &mut MicromodemBase, sentence: &NmeaSentence, now: Duration) -> Option<Sleep> {
    let Some(minutes) = sentence.number::<i32>(2).filter(|minutes| *minutes >= -1) else {
        base.report_error("NMEA", 1, "CCMSC: wrong field", now);
        return None;
    };
    base.report(&sentence.echo(), now);
    if sentence.number::<u8>(1) != Some(base.address()) {
        return None;
    }
    match u64::try_from(minutes) {
        Ok(0) => {
            base.board.schedule(now, MicromodemTask::Reboot);
            None
        }
        Ok(minutes) => Some(Sleep::Until(now + Duration::from_secs(60 * minutes))),
        Err(_) => Some(Sleep::UntilHostWrites),
    }
}

/// The host sets the clock: `$CCCLK,yyyy,mm,dd,HH,MM,SS`.
fn on_set_clock(base: &mut MicromodemBase, sentence: &NmeaSentence, now: Duration) {
    let mut numbers = [0; 6];
    let whole = numbers.iter_mut().enumerate().all(|(index, slot)| {
        let number = sentence.number(index);
        *slot = number.unwrap_or_default();
        number.is_some()
    });
    match CivilTime::new(numbers).filter(|_| whole) {
        Some(civil) => {
            base.clock.set(civil, now);
            base.report(&sentence.echo(), now);
        }
        None => base.report_error("NMEA", 1, "CCCLK: no such time", now),
    }
}

/// The host sets the clock: `$CCTMS,<time>,<0 now, 1 at the next pulse>`.
fn on_set_time(base: &mut MicromodemBase, sentence: &NmeaSentence, now: Duration) {
    let text = sentence.text(0);
    let civil = CivilTime::parse_iso(text);
    if let Some(civil) = civil {
        base.clock.set(civil, now);
    }
    base.report(&format!("CATMS,{},{text}", u8::from(civil.is_none())), now);
}

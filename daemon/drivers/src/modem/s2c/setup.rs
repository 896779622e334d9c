//! Commands to an S2C modem at the start, and its regular queries: it does not report a restart.

use super::config::S2cConfig;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Expect {
    Ok,
    /// That, or an error: older firmware does not know it.
    Tolerated,
    /// A number, now or once the connection is over.
    Value(u32),
    /// The address that we were given.
    Address,
    Counter,
}

/// A command with its expected reply.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Step {
    pub command: String,
    pub expect: Expect,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Verdict {
    Good,
    Counter(u32),
    /// The modem has another address.
    WrongAddress(String),
    /// The setting was refused or has been lost.
    Bad,
}

fn step(command: impl Into<String>, expect: Expect) -> Step {
    Step { command: command.into(), expect }
}

/// The start-up sequence; the `first` time, data in the modem belongs to another run.
pub(super) fn start_up(config: &S2cConfig, first: bool) -> Vec<Step> {
    // Later it is still good, and throwing it away would end the connection.
    let drop = if first { "Z4" } else { "Z3" };
    let mut steps = vec![
        step("?AL", Expect::Address),
        step("@CTRL", Expect::Tolerated),
        step(drop, Expect::Tolerated),
        step("@ZF0", Expect::Tolerated),
        step("@ZX1", Expect::Ok),
        step("@ZU1", Expect::Tolerated),
    ];
    for (key, value) in config.settings() {
        steps.push(step(format!("!{key}{value}"), Expect::Ok));
        steps.push(step(format!("?{key}"), Expect::Value(value)));
    }
    steps.push(step("?PC", Expect::Counter));
    steps
}

/// The regular query of a modem at work: every second time the packet counter, which a restart resets.
pub(super) fn beat(config: &S2cConfig, number: usize) -> Step {
    if number.is_multiple_of(2) {
        return step("?PC", Expect::Counter);
    }
    let settings = config.settings();
    match (number / 2) % (settings.len() + 3) {
        0 => step("?AL", Expect::Address),
        1 => step("@ZX1", Expect::Ok),
        2 => step("@ZU1", Expect::Tolerated),
        i => settings
            .get(i - 3)
            .map_or(step("?PC", Expect::Counter), |(key, value)| step(format!("?{key}"), Expect::Value(*value))),
    }
}

impl Step {
    pub(super) fn judge(&self, reply: &str, config: &S2cConfig) -> Verdict {
        let number: Option<u32> = reply.strip_prefix("[*]").unwrap_or(reply).trim().parse().ok();
        let good = match self.expect {
            Expect::Ok => matches!(reply, "OK" | "[*]OK"),
            Expect::Tolerated => matches!(reply, "OK" | "[*]OK") || reply.starts_with("ERROR"),
            Expect::Value(value) => number == Some(value),
            Expect::Address => match number {
                Some(n) if n == u32::from(config.address) => true,
                Some(n) => return Verdict::WrongAddress(n.to_string()),
                None => false,
            },
            Expect::Counter => return number.map_or(Verdict::Bad, Verdict::Counter),
        };
        if good { Verdict::Good } else { Verdict::Bad }
    }
}

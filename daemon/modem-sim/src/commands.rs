//! Commands on the standard input: faults and positions on demand.

use super::scenario::ModemFault;
use sim_channel::NodePosition;
use std::io::BufRead;
use tokio::sync::mpsc;

#[derive(Debug, Clone, PartialEq)]
pub enum EmulatorCommand {
    Fault(String, ModemFault),
    /// `move NAME EAST NORTH DOWN`
    Move(String, NodePosition),
    Quit,
}

const HELP: &str = "fault NAME WHAT [SECONDS or ADDRESS], move NAME EAST NORTH DOWN (m), quit";

/// Reads commands; a process in the background of a terminal reads none, for reading would stop it.
pub fn listen() -> mpsc::Receiver<EmulatorCommand> {
    let (sender, receiver) = mpsc::channel(16);
    if !is_in_background() {
        // A thread of its own: a read of the standard input cannot be cancelled when the emulation ends.
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines().map_while(Result::ok) {
                match parse(&line) {
                    Ok(None) => {}
                    Ok(Some(command)) => {
                        if sender.blocking_send(command).is_err() {
                            return;
                        }
                    }
                    Err(error) => eprintln!("{error}"),
                }
            }
        });
    }
    receiver
}

/// Whether reading from the terminal would stop the process.
fn is_in_background() -> bool {
    #[cfg(unix)]
    if let Ok(group) = nix::unistd::tcgetpgrp(std::io::stdin()) {
        return group != nix::unistd::getpgrp();
    }
    false
}

/// Why a line is no command.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
enum CommandFault {
    #[error(
        "fault {0}: it takes one of {names}, and seconds or an address behind those that have one",
        names = ModemFault::names()
    )]
    Fault(String),
    #[error("move {0}: it takes three numbers from -1000000 to 1000000 m")]
    Move(String),
    #[error("{0}: it takes {HELP}; WHAT is one of {names}", names = ModemFault::names())]
    Unknown(String),
}

/// `None` for an empty line.
fn parse(line: &str) -> Result<Option<EmulatorCommand>, CommandFault> {
    let words: Vec<&str> = line.split_whitespace().collect();
    match words.as_slice() {
        [] => Ok(None),
        ["quit"] => Ok(Some(EmulatorCommand::Quit)),
        ["fault", name, words @ ..] => match ModemFault::parse(words) {
            Some(fault) => Ok(Some(EmulatorCommand::Fault((*name).to_owned(), fault))),
            None => Err(CommandFault::Fault(words.join(" "))),
        },
        ["move", name, place @ ..] => {
            let numbers: Option<Vec<f64>> =
                place.iter().map(|n| n.parse().ok().filter(|n: &f64| n.abs() <= 1e6)).collect();
            match numbers.as_deref() {
                Some([x, y, z]) => Ok(Some(EmulatorCommand::Move((*name).to_owned(), NodePosition::new(*x, *y, *z)))),
                _ => Err(CommandFault::Move(place.join(" "))),
            }
        }
        _ => Err(CommandFault::Unknown(line.to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn commands_are_read_word_by_word() {
        assert_eq!(parse("quit"), Ok(Some(EmulatorCommand::Quit)));
        assert_eq!(parse("  "), Ok(None));
        let freeze = ModemFault::Freeze(Duration::from_secs(60));
        assert_eq!(parse("fault auv freeze 60"), Ok(Some(EmulatorCommand::Fault("auv".into(), freeze))));
        assert_eq!(parse("fault auv freeze"), Ok(Some(EmulatorCommand::Fault("auv".into(), freeze))));
        assert_eq!(parse("fault a reboot"), Ok(Some(EmulatorCommand::Fault("a".into(), ModemFault::Reboot))));
        assert_eq!(
            parse("move a 1 -2 3.5"),
            Ok(Some(EmulatorCommand::Move("a".into(), NodePosition::new(1.0, -2.0, 3.5))))
        );
    }

    #[test]
    fn wrong_commands_are_refused_with_the_allowed_ones() {
        for wrong in [
            "sink auv",
            "fault auv",
            "fault auv melt",
            "fault auv freeze x",
            "fault auv wrong_address 300",
            "move a 1 2",
        ] {
            let error = parse(wrong).expect_err(wrong).to_string();
            assert!(error.contains("it takes"), "{error}");
        }
    }
}

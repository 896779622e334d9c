//! Lines on the standard input: faults and places on demand.

use super::scenario::Trouble;
use sim_channel::NodePosition;
use std::io::BufRead;
use tokio::sync::mpsc;

#[derive(Debug, Clone, PartialEq)]
pub enum Order {
    Fault(String, Trouble),
    /// `move NAME EAST NORTH DOWN`
    Move(String, NodePosition),
    Quit,
}

const HELP: &str = "fault NAME WHAT [SECONDS or ADDRESS], move NAME EAST NORTH DOWN (m), quit";

/// The orders that come; none if nobody may ask, as from the background of a terminal.
pub fn listen() -> mpsc::Receiver<Order> {
    let (sender, receiver) = mpsc::channel(16);
    if !is_in_background() {
        // A thread of its own: a read of the standard input cannot be given up when the emulation ends.
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines().map_while(Result::ok) {
                match parse(&line) {
                    Ok(None) => {}
                    Ok(Some(order)) => {
                        if sender.blocking_send(order).is_err() {
                            return;
                        }
                    }
                    Err(what) => eprintln!("{what}"),
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

/// `None` for an empty line.
fn parse(line: &str) -> Result<Option<Order>, String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    match words.as_slice() {
        [] => Ok(None),
        ["quit"] => Ok(Some(Order::Quit)),
        ["fault", name, what @ ..] => match Trouble::parse(what) {
            Ok(trouble) => Ok(Some(Order::Fault((*name).to_owned(), trouble))),
            Err(takes) => Err(format!("fault {}: {takes}", what.join(" "))),
        },
        ["move", name, place @ ..] => {
            let numbers: Option<Vec<f64>> =
                place.iter().map(|n| n.parse().ok().filter(|n: &f64| n.abs() <= 1e6)).collect();
            match numbers.as_deref() {
                Some([x, y, z]) => Ok(Some(Order::Move((*name).to_owned(), NodePosition::new(*x, *y, *z)))),
                _ => Err(format!("move {}: it takes three numbers from -1000000 to 1000000 m", place.join(" "))),
            }
        }
        _ => Err(format!("{line}: it takes {HELP}; WHAT is one of {}", Trouble::names())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn orders_are_read_word_by_word() {
        assert_eq!(parse("quit"), Ok(Some(Order::Quit)));
        assert_eq!(parse("  "), Ok(None));
        let freeze = Trouble::Freeze(Duration::from_secs(60));
        assert_eq!(parse("fault auv freeze 60"), Ok(Some(Order::Fault("auv".into(), freeze))));
        assert_eq!(parse("fault auv freeze"), Ok(Some(Order::Fault("auv".into(), freeze))));
        assert_eq!(parse("fault a reboot"), Ok(Some(Order::Fault("a".into(), Trouble::Reboot))));
        assert_eq!(parse("move a 1 -2 3.5"), Ok(Some(Order::Move("a".into(), NodePosition::new(1.0, -2.0, 3.5)))));
    }

    #[test]
    fn wrong_orders_tell_what_is_taken() {
        for wrong in [
            "sink auv",
            "fault auv",
            "fault auv melt",
            "fault auv freeze x",
            "fault auv wrong_address 300",
            "move a 1 2",
        ] {
            let said = parse(wrong).expect_err(wrong);
            assert!(said.contains("it takes"), "{said}");
        }
    }
}

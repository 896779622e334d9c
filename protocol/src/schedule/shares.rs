//! Shares of the classes in what is sent.

/// What bits are spent on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// Slots of the directive.
    Directive,
    /// The vehicle's status.
    Status,
    /// The label map.
    Map,
    /// Representative images.
    Exemplar,
    /// Headers, acknowledgements, checks, padding.
    Overhead,
}

impl Class {
    /// Every class.
    pub const ALL: [Self; 5] = [Self::Directive, Self::Status, Self::Map, Self::Exemplar, Self::Overhead];

    /// Name for people and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Directive => "directive",
            Self::Status => "status",
            Self::Map => "map",
            Self::Exemplar => "exemplar",
            Self::Overhead => "overhead",
        }
    }
}

/// Minimum shares of map and exemplars when both have something to send; a class with nothing to send lends its share.
#[derive(Debug, Clone)]
pub struct ClassShares {
    exemplar: f64,
    /// Bytes by which exemplars are ahead of their share.
    ahead: f64,
}

impl ClassShares {
    /// Most bytes of lead or arrears that are remembered.
    const MEMORY: f64 = 4096.0;

    /// Exemplars get `exemplar` (0..=1) of the bytes, the map the rest.
    pub fn new(exemplar: f64) -> Self {
        Self { exemplar: exemplar.clamp(0.0, 1.0), ahead: 0.0 }
    }

    /// Which of the two comes next when both have something to send.
    pub fn turn(&self) -> Class {
        if self.ahead < 0.0 { Class::Exemplar } else { Class::Map }
    }

    /// Counts bytes sent for a class while both had something to send.
    pub fn spend(&mut self, class: Class, bytes: usize) {
        let bytes = bytes as f64;
        match class {
            Class::Exemplar => self.ahead += bytes * (1.0 - self.exemplar),
            Class::Map => self.ahead -= bytes * self.exemplar,
            _ => {}
        }
        self.ahead = self.ahead.clamp(-Self::MEMORY, Self::MEMORY);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exemplars_get_their_share_and_no_more_while_both_are_backlogged() {
        let mut shares = ClassShares::new(0.2);
        let (mut map, mut exemplar) = (0, 0);
        for _ in 0..1000 {
            let class = shares.turn();
            shares.spend(class, 50);
            *(if class == Class::Map { &mut map } else { &mut exemplar }) += 50;
        }
        let share = f64::from(exemplar) / f64::from(map + exemplar);
        assert!((0.19..0.21).contains(&share), "{share}");
    }
}

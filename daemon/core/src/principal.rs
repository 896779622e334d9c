//! Who uses the surface, from which client, and the role that decides which actions are allowed.

use std::fmt;

/// Characters in the name of a principal or of a client at most.
const MAX_NAME: usize = 32;

/// A role. Each one may do everything that the roles before it may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Role {
    /// Reads everything and changes no state.
    Viewer,
    /// Gives orders, and reads everything.
    Operator,
    /// Changes settings and keys, and gives orders.
    Administrator,
}

impl Role {
    pub const ALL: [Self; 3] = [Self::Viewer, Self::Operator, Self::Administrator];

    pub fn name(self) -> &'static str {
        match self {
            Self::Viewer => "viewer",
            Self::Operator => "operator",
            Self::Administrator => "administrator",
        }
    }

    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|role| role.name() == name)
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The holder of a token, or a peer that gives orders in another way. Its name is unique at one surface.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Principal {
    name: String,
    role: Role,
}

impl Principal {
    /// A principal; `None` unless the name has 1 to 32 letters, digits, dots, hyphens or underscores of ASCII.
    pub fn new(name: &str, role: Role) -> Option<Self> {
        is_name(name).then(|| Self { name: name.to_owned(), role })
    }

    /// Every client of a surface without tokens, which only this machine can reach.
    pub fn local() -> Self {
        Self { name: "local".to_owned(), role: Role::Administrator }
    }

    /// Every client of a record that is replayed without tokens.
    pub fn local_viewer() -> Self {
        Self { name: "local".to_owned(), role: Role::Viewer }
    }

    /// The holder of the only token of a file that names neither roles nor people.
    pub fn sole_administrator() -> Self {
        Self { name: "administrator".to_owned(), role: Role::Administrator }
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    pub fn role(&self) -> Role {
        self.role
    }
}

fn is_allowed(c: char) -> bool {
    c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_')
}

fn is_name(name: &str) -> bool {
    (1..=MAX_NAME).contains(&name.len()) && name.chars().all(is_allowed)
}

/// The name that a browser, a terminal or a program gives itself, so that the clients of one principal are told apart. It is empty for
/// a client that gives none.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct ClientName(String);

impl ClientName {
    /// A name; `None` unless it has 1 to 32 letters, digits, dots, hyphens or underscores of ASCII.
    pub fn new(name: &str) -> Option<Self> {
        is_name(name).then(|| Self(name.to_owned()))
    }

    /// The name of a program, without the characters that no name has.
    pub fn of_program(name: &str) -> Self {
        Self(name.chars().filter(|&c| is_allowed(c)).take(MAX_NAME).collect())
    }

    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// Who gives an order: a principal at one of his clients.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Giver {
    pub principal: Principal,
    pub client: ClientName,
}

impl Giver {
    pub fn name(&self) -> &str {
        self.principal.name()
    }

    pub fn role(&self) -> Role {
        self.principal.role()
    }
}

/// A principal at a client that gives no name.
impl From<Principal> for Giver {
    fn from(principal: Principal) -> Self {
        Self { principal, client: ClientName::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_name_is_reduced_to_allowed_characters() {
        assert_eq!(ClientName::of_program("ctl-R/V Wave").as_str(), "ctl-RVWave");
        assert_eq!(ClientName::of_program(&"x".repeat(64)).as_str().len(), MAX_NAME);
        assert!(
            ClientName::new("page-3f").is_some() && ClientName::new("").is_none() && ClientName::new("a b").is_none()
        );
    }

    #[test]
    fn names_have_few_characters_and_roles_are_ordered() {
        let is_name = |name: &str| Principal::new(name, Role::Viewer).is_some();
        assert!(is_name("anna") && is_name("bridge-2.ros_a"));
        assert!(!is_name("") && !is_name("a b") && !is_name("<b>") && !is_name("é") && !is_name(&"a".repeat(33)));
        assert!(Role::Viewer < Role::Operator && Role::Operator < Role::Administrator);
        assert!(Role::ALL.into_iter().all(|role| Role::from_name(role.name()) == Some(role)));
        assert_eq!(Role::from_name("Viewer"), None);
    }
}

//! Keys, each described once in the tables beside this file.

use super::Config;
use crate::rule::Rule;
use crate::setting::Setting;
use toml::Value;

/// Which process reads a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// `scenecast auv`, the program on the vehicle.
    Auv,
    /// `scenecast asv`, the program at the surface.
    Asv,
    /// `scenecast sim` and `scenecast demo`: the rehearsal.
    Scenario,
}

/// A key of the configuration.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Section and name, as in `link.budget_bps`.
    pub name: &'static str,
    pub rule: Rule,
    /// The processes that read it.
    pub roles: &'static [Role],
    pub(crate) doc: &'static str,
    pub(crate) operations: Operations,
}

/// How the type of a key reads and describes values.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Operations {
    /// Sets the value, or one member of a table.
    pub set: fn(&mut Config, Option<&str>, &Value, &Rule) -> Option<()>,
    pub get: fn(&Config) -> Value,
    pub allowed: fn(&Rule) -> String,
    pub schema: fn(&Rule) -> serde_json::Value,
    /// Names of the members of a table; empty for other types.
    pub members: fn() -> Vec<&'static str>,
}

impl Operations {
    /// The operations of `T`; the two arguments find the value in a configuration.
    pub const fn of<T: Setting>(
        set: fn(&mut Config, Option<&str>, &Value, &Rule) -> Option<()>,
        get: fn(&Config) -> Value,
    ) -> Self {
        Self { set, get, allowed: T::allowed, schema: T::schema, members: T::members }
    }
}

impl Key {
    /// The key with this section and name.
    pub fn find(name: &str) -> Option<&'static Self> {
        Self::all().find(|key| key.name == name)
    }

    /// Every key, in the order of the files.
    pub fn all() -> impl Iterator<Item = &'static Self> {
        Section::ALL.iter().flat_map(|section| section.keys)
    }

    /// What the key means, for operators.
    pub fn doc(&self) -> &'static str {
        self.doc.trim_start()
    }

    /// The values that it allows, for operators.
    pub fn allowed(&self) -> String {
        (self.operations.allowed)(&self.rule)
    }

    pub(crate) fn value(&self, config: &Config) -> Value {
        (self.operations.get)(config)
    }

    /// Whether its value is a table whose members are set one by one.
    pub(crate) fn is_table(&self) -> bool {
        !(self.operations.members)().is_empty()
    }

    /// Its name without the section.
    pub(crate) fn leaf(&self) -> &'static str {
        self.name.split_once('.').map_or(self.name, |(_, leaf)| leaf)
    }
}

/// A section of the configuration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Section {
    pub name: &'static str,
    pub doc: &'static str,
    pub keys: &'static [Key],
}

/// Makes the struct of a section, its defaults and its table of keys from one description.
macro_rules! section {
    (
        $(#[doc = $section_doc:literal])*
        $section:ident: $name:ident {
            $($(#[doc = $doc:literal])* $field:ident: $type:ty = $default:expr, $rule:expr, [$($role:ident)*];)*
        }
    ) => {
        $(#[doc = $section_doc])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name { $($(#[doc = $doc])* pub $field: $type,)* }

        impl Default for $name {
            fn default() -> Self { Self { $($field: $default,)* } }
        }

        impl $name {
            pub(crate) const SECTION: $crate::sections::key::Section = $crate::sections::key::Section {
                name: stringify!($section),
                doc: concat!($($section_doc),*),
                keys: &[$($crate::sections::key::Key {
                    name: concat!(stringify!($section), ".", stringify!($field)),
                    rule: $rule,
                    roles: &[$($crate::sections::key::Role::$role),*],
                    doc: concat!($($doc),*),
                    operations: $crate::sections::key::Operations::of::<$type>(
                        |config, member, value, rule| {
                            $crate::setting::Setting::set(&mut config.$section.$field, member, value, rule)
                        },
                        |config| $crate::setting::Setting::write(&config.$section.$field),
                    ),
                },)*],
            };
        }
    };
}

pub(crate) use section;

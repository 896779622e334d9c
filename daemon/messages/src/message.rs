//! The form in which a message is written once.

use crate::definition::Definition;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Debug;

/// A message of ROS 2.
pub trait Message: Serialize + DeserializeOwned + Default + Clone + PartialEq + Debug + Send + Sync + 'static {
    const DEFINITION: &'static Definition;
}

/// Declares the messages of a package: `message Name { field: type, } constants { kind NAME: type = value; }`.
///
/// `= "Other"` after a name gives the name in ROS 2 where a Rust type of the same name is in the way.
macro_rules! messages {
    (package $package:literal; $(
        $(#[doc = $doc:literal])*
        message $name:ident $(= $ros_name:literal)? {
            $( $(#[doc = $field_doc:literal])* $field:ident: $type:ty, )*
        }
        $(constants { $( $kind:ident $constant:ident: $constant_type:ty = $value:expr; )* })?
    )*) => {$(
        $(#[doc = $doc])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        pub struct $name {
            $(
                $(#[doc = $field_doc])*
                #[serde(with = "crate::field")]
                pub $field: $type,
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: <$type as crate::field::FieldType>::zero(),)* }
            }
        }

        $(impl $name {
            $(pub const $constant: $constant_type = $value;)*
        })?

        impl crate::field::Element for $name {
            const ELEMENT: crate::Kind = crate::Kind::Message(<Self as crate::Message>::DEFINITION);
        }

        impl crate::Message for $name {
            const DEFINITION: &'static crate::Definition = &crate::Definition {
                package: $package,
                name: crate::message::ros_name!($name $($ros_name)?),
                text: &[$($doc),*],
                constants: &[$($(crate::Constant {
                    kind: stringify!($kind),
                    name: stringify!($constant),
                    value: $value as i64,
                },)*)?],
                fields: &[$(crate::Field {
                    name: stringify!($field),
                    kind: <$type as crate::field::FieldType>::KIND,
                    text: &[$($field_doc),*],
                },)*],
            };
        }
    )*};
}

macro_rules! ros_name {
    ($name:ident) => {
        stringify!($name)
    };
    ($name:ident $ros_name:literal) => {
        $ros_name
    };
}

pub(crate) use {messages, ros_name};

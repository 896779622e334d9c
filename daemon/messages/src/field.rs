//! The Rust types that fields have, and their form in serde's data model.
//!
//! A sequence of octets is one block of bytes, and an array is a tuple of any length (serde's own ends at 32).

use crate::definition::{Kind, Primitive};
use serde::de::{DeserializeOwned, Error, SeqAccess, Visitor};
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::marker::PhantomData;

/// A type of a field: an [`Element`], a `Vec` of them, or an array of them.
pub trait FieldType: Sized {
    const KIND: Kind;

    /// The value of a field that was not set: zero, false, or empty.
    fn zero() -> Self;
    fn write<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error>;
    fn read<'de, D: Deserializer<'de>>(from: D) -> Result<Self, D::Error>;
}

/// A type of one value, which sequences and arrays can have as elements.
pub trait Element: Serialize + DeserializeOwned + Default {
    const ELEMENT: Kind;

    fn write_sequence<S: Serializer>(elements: &[Self], to: S) -> Result<S::Ok, S::Error> {
        elements.serialize(to)
    }

    fn read_sequence<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Self>, D::Error> {
        Vec::deserialize(from)
    }
}

pub(crate) fn serialize<T: FieldType, S: Serializer>(value: &T, to: S) -> Result<S::Ok, S::Error> {
    value.write(to)
}

pub(crate) fn deserialize<'de, T: FieldType, D: Deserializer<'de>>(from: D) -> Result<T, D::Error> {
    T::read(from)
}

impl<T: Element> FieldType for T {
    const KIND: Kind = T::ELEMENT;

    fn zero() -> Self {
        Self::default()
    }

    fn write<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        self.serialize(to)
    }

    fn read<'de, D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        Self::deserialize(from)
    }
}

impl<T: Element> FieldType for Vec<T> {
    const KIND: Kind = Kind::Sequence(&T::ELEMENT);

    fn zero() -> Self {
        Self::new()
    }

    fn write<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        T::write_sequence(self, to)
    }

    fn read<'de, D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        T::read_sequence(from)
    }
}

impl<T: Element, const N: usize> FieldType for [T; N] {
    const KIND: Kind = Kind::Array(&T::ELEMENT, N);

    fn zero() -> Self {
        std::array::from_fn(|_| T::default())
    }

    fn write<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let mut tuple = to.serialize_tuple(N)?;
        for element in self {
            tuple.serialize_element(element)?;
        }
        tuple.end()
    }

    fn read<'de, D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_tuple(N, ArrayVisitor(PhantomData))
    }
}

struct ArrayVisitor<T, const N: usize>(PhantomData<T>);

impl<'de, T: Element, const N: usize> Visitor<'de> for ArrayVisitor<T, N> {
    type Value = [T; N];

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{N} elements")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Self::Value, A::Error> {
        let mut array = <[T; N]>::zero();
        for (at, element) in array.iter_mut().enumerate() {
            *element = sequence.next_element()?.ok_or_else(|| A::Error::invalid_length(at, &self))?;
        }
        Ok(array)
    }
}

struct BytesVisitor;

impl Visitor<'_> for BytesVisitor {
    type Value = Vec<u8>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("bytes")
    }

    fn visit_bytes<E>(self, bytes: &[u8]) -> Result<Vec<u8>, E> {
        Ok(bytes.to_vec())
    }

    fn visit_byte_buf<E>(self, bytes: Vec<u8>) -> Result<Vec<u8>, E> {
        Ok(bytes)
    }
}

impl Element for u8 {
    const ELEMENT: Kind = Kind::Primitive(Primitive::Uint8);

    fn write_sequence<S: Serializer>(elements: &[Self], to: S) -> Result<S::Ok, S::Error> {
        to.serialize_bytes(elements)
    }

    fn read_sequence<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Self>, D::Error> {
        from.deserialize_byte_buf(BytesVisitor)
    }
}

impl Element for i8 {
    const ELEMENT: Kind = Kind::Primitive(Primitive::Int8);

    fn write_sequence<S: Serializer>(elements: &[Self], to: S) -> Result<S::Ok, S::Error> {
        let bytes: Vec<u8> = elements.iter().map(|&element| element.cast_unsigned()).collect();
        to.serialize_bytes(&bytes)
    }

    fn read_sequence<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Self>, D::Error> {
        let bytes = from.deserialize_byte_buf(BytesVisitor)?;
        Ok(bytes.into_iter().map(u8::cast_signed).collect())
    }
}

macro_rules! elements {
    ($($element:ty: $primitive:ident,)*) => {
        $(impl Element for $element {
            const ELEMENT: Kind = Kind::Primitive(Primitive::$primitive);
        })*
    };
}

elements! {
    i16: Int16,
    u16: Uint16,
    i32: Int32,
    u32: Uint32,
    i64: Int64,
    u64: Uint64,
    f32: Float32,
    f64: Float64,
    bool: Bool,
    Byte: Byte,
    String: String,
}

/// One octet of the type `byte`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Byte(pub u8);

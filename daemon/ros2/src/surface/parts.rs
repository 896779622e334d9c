//! The vehicles' parts of the names of topics: each belongs to one vehicle.

use crate::valid_part;
use scenecast_core::UserError;
use std::collections::BTreeMap;

/// Which vehicle has which part, with its address and its name.
#[derive(Debug, Default)]
pub(super) struct Parts(BTreeMap<String, (u8, String)>);

impl Parts {
    /// The parts of these vehicles, by address and name.
    ///
    /// # Errors
    ///
    /// Two vehicles whose topics would be the same.
    pub fn new(vehicles: impl IntoIterator<Item = (u8, String)>) -> Result<Self, UserError> {
        let mut parts = Self::default();
        vehicles.into_iter().try_for_each(|(address, name)| parts.claim(address, &name).map(drop))?;
        Ok(parts)
    }

    /// The part of a vehicle.
    ///
    /// # Errors
    ///
    /// Another vehicle has it, so that an order to one would go to both.
    pub fn claim(&mut self, address: u8, name: &str) -> Result<String, UserError> {
        let part = valid_part(name);
        let (owner, other) = self.0.entry(part.clone()).or_insert_with(|| (address, name.to_owned()));
        if *owner == address {
            return Ok(part);
        }
        let vehicles = format!("{other:?} (address {owner}) and {name:?} (address {address})");
        Err(UserError::Input(format!(
            "ROS 2: the vehicles {vehicles} would share the topics {part}/...; choose a vehicle.name that differs in letters \
             or digits"
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(names: &[&str]) -> Result<Parts, UserError> {
        Parts::new((1..).zip(names.iter().map(|&name| name.to_owned())))
    }

    #[test]
    fn vehicles_with_the_same_topics_are_refused() {
        assert!(parts(&["auv-1", "auv-2"]).is_ok());
        let refusal = parts(&["auv-1", "auv_1"]).unwrap_err();
        assert!(matches!(refusal, UserError::Input(_)));
        let text = refusal.to_string();
        assert!(
            text.contains("\"auv-1\" (address 1) and \"auv_1\" (address 2)") && text.contains("auv_1/..."),
            "{text}"
        );
        assert!(parts(&["auv", "auv"]).is_err());
        let long = "a".repeat(64);
        assert!(parts(&[&format!("{long}1"), &format!("{long}2")]).is_err(), "names are cut");
    }

    #[test]
    fn a_vehicle_that_is_found_later_takes_no_topics_of_others() {
        let mut parts = parts(&["vehicle-2"]).unwrap();
        assert!(parts.claim(2, "vehicle 2").is_err());
        assert_eq!(parts.claim(1, "vehicle-2").unwrap(), "vehicle_2");
        assert_eq!(parts.claim(3, "vehicle 3").unwrap(), "vehicle_3");
    }
}

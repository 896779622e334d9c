//! The surface's end.

use scenecast_config::Config;
use scenecast_console::PendingRequest;
use scenecast_core::{Principal, Role, UserError};
use scenecast_surface::Snapshot;
use std::sync::Arc;

/// ROS 2 at the surface, if it is switched on.
pub(crate) struct SurfaceRos2 {
    #[cfg(feature = "ros2")]
    outlet: Option<scenecast_ros2::SurfaceOutlet>,
}

impl SurfaceRos2 {
    /// Adds the principal of orders from ROS 2 to those of the page.
    ///
    /// # Errors
    ///
    /// A name of the principal that is not allowed, two vehicles whose names give the same topics, a thread that does not
    /// start, or a build without ROS 2.
    pub fn start(config: &Config, principals: &mut Vec<Principal>) -> Result<Self, UserError> {
        let is_enabled = super::is_enabled(config)?;
        let principal = principal(&config.ros2.principal, principals)?.filter(|_| is_enabled);
        if let Some(principal) = &principal {
            if principals.is_empty() {
                principals.push(Principal::local());
            }
            principals.push(principal.clone());
        }
        Ok(Self {
            #[cfg(feature = "ros2")]
            outlet: is_enabled.then(|| start(config, principal)).transpose()?,
        })
    }

    pub fn is_on(&self) -> bool {
        #[cfg(feature = "ros2")]
        return self.outlet.is_some();
        #[cfg(not(feature = "ros2"))]
        false
    }

    pub fn publish(&self, snapshot: Arc<Snapshot>) {
        #[cfg(feature = "ros2")]
        if let Some(outlet) = &self.outlet {
            outlet.snapshots.send_replace(snapshot);
        }
        #[cfg(not(feature = "ros2"))]
        drop(snapshot);
    }

    /// The next request from ROS 2.
    pub async fn next_request(&mut self) -> PendingRequest {
        #[cfg(feature = "ros2")]
        if let Some(request) = match &mut self.outlet {
            Some(outlet) => outlet.requests.recv().await,
            None => None,
        } {
            return request;
        }
        std::future::pending().await
    }
}

#[cfg(feature = "ros2")]
fn start(config: &Config, principal: Option<Principal>) -> Result<scenecast_ros2::SurfaceOutlet, UserError> {
    let vehicles = scenecast_config::vehicle_names(config)?;
    let vehicles = vehicles.into_iter().map(|(address, name)| (address.number(), name));
    scenecast_ros2::start_surface(&config.ros2, principal, vehicles)
}

/// The principal with this name; `None` without a name.
fn principal(name: &str, others: &[Principal]) -> Result<Option<Principal>, UserError> {
    if name.is_empty() {
        return Ok(None);
    }
    let refused = |reason: &str| Err(UserError::Input(format!("ros2.principal = {name:?}: {reason}")));
    let local = Principal::local();
    match Principal::new(name, Role::Operator) {
        None => refused("a name has 1 to 32 letters, digits, dots, hyphens or underscores"),
        Some(_) if name == local.name() => refused("the page has that name without tokens; choose another"),
        Some(_) if others.iter().any(|other| other.name() == name) => {
            refused("a token of console.token_file has that name; choose another")
        }
        principal => Ok(principal),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_from_ros_need_a_name_of_their_own() {
        let anna = Principal::new("anna", Role::Viewer).unwrap();
        let named = |name: &str| principal(name, std::slice::from_ref(&anna)).map_err(|e| e.to_string());
        assert_eq!(named(""), Ok(None));
        assert_eq!(named("ros"), Ok(Principal::new("ros", Role::Operator)));
        assert!(named("anna").unwrap_err().contains("console.token_file"));
        assert!(named("local").is_err() && named("a b").is_err());
    }
}

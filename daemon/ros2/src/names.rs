//! Names of topics: namespace, remaps and names of vehicles.

use scenecast_config::{Remap, RosName};
use scenecast_core::UserError;

/// A topic by its whole name, such as `/camera/image_raw`.
///
/// # Errors
///
/// One line that gives the name and the allowed form.
pub fn topic(name: &str) -> Result<RosName, UserError> {
    let rule = "a topic of ROS 2 is such as /camera/image_raw: parts of letters, digits and underscores after slashes";
    RosName::parse(name).ok_or_else(|| UserError::Input(format!("{name:?}: {rule}")))
}

/// The name under which a topic is used.
pub(crate) fn remapped<'a>(name: &'a RosName, remaps: &'a [Remap]) -> &'a RosName {
    remaps.iter().find(|remap| remap.from == *name).map_or(name, |remap| &remap.to)
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_messages::contents::valid_part;

    #[test]
    fn vehicle_names_become_parts_of_topics() {
        assert_eq!(valid_part("auv-1"), "auv_1");
        assert_eq!(valid_part("2nd"), "_2nd");
        assert_eq!(valid_part(""), "_");
        assert!(topic(&format!("/scenecast/{}/map", valid_part("Möwe 3"))).is_ok());
        assert!(topic("map").unwrap_err().to_string().contains("/camera/image_raw"));
    }

    #[test]
    fn a_remap_replaces_a_whole_name() {
        let remaps = [Remap { from: topic("/a/map").unwrap(), to: topic("/map").unwrap() }];
        assert_eq!(remapped(&topic("/a/map").unwrap(), &remaps).as_str(), "/map");
        assert_eq!(remapped(&topic("/a/map2").unwrap(), &remaps).as_str(), "/a/map2");
    }
}

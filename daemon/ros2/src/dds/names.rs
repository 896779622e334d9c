//! Names of topics and types on DDS.

/// The name of a topic on DDS: `/map` becomes `rt/map`.
pub(super) fn dds_topic(name: &str) -> String {
    format!("rt{name}")
}

/// `rt/map` as `/map`; `None` for what is no topic of messages.
pub(super) fn ros_topic(dds_name: &str) -> Option<String> {
    dds_name.strip_prefix("rt").filter(|name| name.starts_with('/')).map(str::to_owned)
}

/// The name of a type in ROS 2: `std_msgs::msg::dds_::Header_` becomes `std_msgs/msg/Header`.
pub(crate) fn ros_type(dds_name: &str) -> String {
    dds_name.trim_end_matches('_').replace("::dds_::", "::").replace("::", "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_on_dds_become_names_of_ros() {
        assert_eq!(ros_topic("rt/camera/image_raw").as_deref(), Some("/camera/image_raw"));
        assert_eq!(dds_topic("/camera/image_raw"), "rt/camera/image_raw");
        assert_eq!(ros_topic("rq/get_parametersRequest"), None);
        assert_eq!(ros_topic("ros_discovery_info"), None);
        assert_eq!(ros_type("sensor_msgs::msg::dds_::Image_"), "sensor_msgs/msg/Image");
    }
}

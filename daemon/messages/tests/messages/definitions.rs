//! The definitions and hashes are those of ROS 2, and the files of `scenecast_msgs` are those of the structs.
#![expect(clippy::disallowed_methods, reason = "a test reads and writes the files of the package")]

use scenecast_messages::{CATALOGUE, Definition, Message, nav_msgs, std_msgs};
use std::path::Path;

/// Type hashes by the name of the message, one a line: those that `rosbags` computes from the definitions of ROS 2 Jazzy, of
/// `grid_map` and of the files of `scenecast_msgs`.
const GOLDEN: &str = include_str!("type_hashes.txt");

#[test]
fn type_hashes_are_those_of_ros() {
    let mut hashes: Vec<String> = CATALOGUE
        .iter()
        .map(|entry| format!("{} {}", entry.definition.full_name(), entry.definition.type_hash()))
        .collect();
    hashes.sort();
    let golden: Vec<&str> = GOLDEN.lines().collect();
    assert_eq!(hashes, golden);
}

#[test]
fn a_schema_lists_each_dependency_once_after_a_separator() {
    let schema = nav_msgs::Odometry::DEFINITION.ros2msg();
    let separator = "=".repeat(80);
    let parts: Vec<&str> = schema.split(&format!("{separator}\nMSG: ")).collect();
    let names: Vec<&str> = parts[1..].iter().map(|part| part.lines().next().unwrap()).collect();
    let expected = [
        "std_msgs/Header",
        "builtin_interfaces/Time",
        "geometry_msgs/PoseWithCovariance",
        "geometry_msgs/Pose",
        "geometry_msgs/Point",
        "geometry_msgs/Quaternion",
        "geometry_msgs/TwistWithCovariance",
        "geometry_msgs/Twist",
        "geometry_msgs/Vector3",
    ];
    assert_eq!(names, expected);
    assert!(parts[0].ends_with("geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n"));
}

#[test]
fn names_are_those_of_ros_and_dds() {
    let definition = std_msgs::Text::DEFINITION;
    assert_eq!(definition.full_name(), "std_msgs/msg/String");
    assert_eq!(definition.dds_name(), "std_msgs::msg::dds_::String_");
}

#[test]
fn the_package_of_own_messages_is_the_structs() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenecast_msgs/msg");
    let own: Vec<&Definition> =
        CATALOGUE.iter().map(|e| e.definition).filter(|d| d.package == "scenecast_msgs").collect();
    for definition in &own {
        let (file, text) = (folder.join(format!("{}.msg", definition.name)), definition.msg());
        if std::env::var_os("SCENECAST_UPDATE_DOCS").is_some() {
            std::fs::write(&file, &text).unwrap();
        }
        let written = std::fs::read_to_string(&file).unwrap_or_default();
        assert_eq!(written, text, "{}: SCENECAST_UPDATE_DOCS=1 writes it again", file.display());
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), own.len(), "files without a message");
}

"""Starts the surface of scenecast and RViz.

ros2 launch scenecast.launch.py config:=asv.toml vehicle:=auv_1 namespace:=/scenecast domain:=0 rviz:=true
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, SetEnvironmentVariable
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node

HERE = Path(__file__).parent
TOPICS = ["map", "layers", "cloud", "pose", "path", "plan", "exemplars", "diagnostics"]


def generate_launch_description():
    value = LaunchConfiguration
    remaps = [(f"/vehicle/{topic}", PathJoinSubstitution([value("namespace"), value("vehicle"), topic])) for topic in TOPICS]
    return LaunchDescription([
        DeclareLaunchArgument("config", default_value=str(HERE / "asv.toml"), description="configuration of the surface"),
        DeclareLaunchArgument("vehicle", default_value="auv_1", description="name of the vehicle in topics"),
        DeclareLaunchArgument("namespace", default_value="/scenecast", description="ros2.namespace of the configuration"),
        DeclareLaunchArgument("domain", default_value="0", description="domain of DDS"),
        DeclareLaunchArgument("rviz", default_value="true", description="whether RViz is started"),
        SetEnvironmentVariable("ROS_DOMAIN_ID", value("domain")),
        ExecuteProcess(
            cmd=["scenecast", "asv", "--config", value("config"),
                 "--set", ["ros2.domain=", value("domain")], "--set", ["ros2.namespace=", value("namespace")]],
            output="screen",
            sigterm_timeout="5",
        ),
        Node(
            package="rviz2",
            executable="rviz2",
            arguments=["-d", str(HERE / "scenecast.rviz")],
            remappings=remaps,
            condition=IfCondition(value("rviz")),
        ),
    ])

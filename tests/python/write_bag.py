"""Writes a recorded folder as a bag of ROS 2 in MCAP, by rosbags: write_bag.py FOLDER BAG [--compressed]"""

import csv
import math
import sys
from pathlib import Path

import numpy
from PIL import Image as Picture
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

store = get_typestore(Stores.ROS2_JAZZY)
T = store.types


def header(t_s, frame):
    nanos = round(t_s * 1e9) + 1000 * 10**9
    return T["std_msgs/msg/Header"](T["builtin_interfaces/msg/Time"](nanos // 10**9, nanos % 10**9), frame), nanos


def odometry(row):
    yaw = math.pi / 2 - math.radians(float(row["heading_deg"]))
    turn = T["geometry_msgs/msg/Quaternion"](0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    place = T["geometry_msgs/msg/Point"](float(row["x_m"]), float(row["y_m"]), -float(row["depth_m"]))
    still = T["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
    zero = numpy.zeros(36)
    pose = T["geometry_msgs/msg/PoseWithCovariance"](T["geometry_msgs/msg/Pose"](place, turn), zero)
    twist = T["geometry_msgs/msg/TwistWithCovariance"](T["geometry_msgs/msg/Twist"](still, still), zero)
    return T["nav_msgs/msg/Odometry"](header(float(row["t_s"]), "odom")[0], "base_link", pose, twist)


folder, bag = Path(sys.argv[1]), Path(sys.argv[2])
compressed = "--compressed" in sys.argv
kind = "sensor_msgs/msg/CompressedImage" if compressed else "sensor_msgs/msg/Image"
with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
    images = writer.add_connection("/camera/image", kind, typestore=store)
    poses = writer.add_connection("/odometry", "nav_msgs/msg/Odometry", typestore=store)
    for row in csv.DictReader(open(folder / "poses.csv", newline="")):
        head, nanos = header(float(row["t_s"]), "camera")
        path = folder / row["file"]
        if compressed:
            image = T[kind](head, "png", numpy.frombuffer(path.read_bytes(), dtype=numpy.uint8))
        else:
            picture = Picture.open(path).convert("RGB")
            data = numpy.frombuffer(picture.tobytes(), dtype=numpy.uint8)
            image = T[kind](head, picture.height, picture.width, "rgb8", 0, 3 * picture.width, data)
        writer.write(images, nanos, store.serialize_cdr(image, kind))
        writer.write(poses, nanos, store.serialize_cdr(odometry(row), "nav_msgs/msg/Odometry"))

#!/usr/bin/env python3
"""Writes the images of a ROS 2 bag, with the pose of each one, as a recording that scenecast plays back.

Usage: export_bag.py BAG OUT --images TOPIC --odometry TOPIC [--period SECONDS]

Needs the Python packages rosbags, numpy and pillow, and no ROS installation. BAG is a folder with metadata.yaml.
Images: sensor_msgs/msg/Image (rgb8, bgr8, mono8) or sensor_msgs/msg/CompressedImage, of a camera that looks straight down.
Odometry: nav_msgs/msg/Odometry in a frame with x east, y north, z up (ROS REP 103), z = 0 at the water surface.
"""
import argparse
import csv
import io
import math
import pathlib

import numpy
from PIL import Image
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore


def image_of(message):
    """The image of a message as an RGB or grey PIL image."""
    if hasattr(message, "format"):
        return Image.open(io.BytesIO(message.data.tobytes())).convert("RGB")
    channels = {"rgb8": 3, "bgr8": 3, "mono8": 1}.get(message.encoding)
    if channels is None:
        raise SystemExit(f"image encoding {message.encoding}: rgb8, bgr8 or mono8 is expected")
    rows = numpy.asarray(message.data, numpy.uint8).reshape(message.height, message.step)
    pixels = rows[:, : message.width * channels].reshape(message.height, message.width, channels)
    if message.encoding == "bgr8":
        pixels = pixels[:, :, ::-1]
    return Image.fromarray(numpy.ascontiguousarray(pixels.squeeze()))


def pose_of(message):
    """East, north and depth in metres, and the heading in degrees clockwise from north."""
    p, q = message.pose.pose.position, message.pose.pose.orientation
    yaw = math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
    return p.x, p.y, -p.z, (90 - math.degrees(yaw)) % 360


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bag", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--images", required=True, help="topic of the camera")
    parser.add_argument("--odometry", required=True, help="topic of nav_msgs/msg/Odometry")
    parser.add_argument("--period", type=float, default=2.0, help="shortest time between two images, in seconds [default: 2]")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    poses, times = [], []
    with AnyReader([options.bag], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, _, raw in reader.messages([c for c in reader.connections if c.topic == options.odometry]):
            message = reader.deserialize(raw, connection.msgtype)
            stamp = message.header.stamp
            times.append(stamp.sec + stamp.nanosec * 1e-9)
            poses.append(pose_of(message))
        if not poses:
            raise SystemExit(f"{options.odometry}: the bag has no such messages")
        order = numpy.argsort(times)
        clock, count, due = numpy.asarray(times)[order], 0, -math.inf
        with open(options.out / "poses.csv", "w", newline="", encoding="ascii") as table:
            rows = csv.writer(table, lineterminator="\n")
            rows.writerow(["t_s", "file", "x_m", "y_m", "depth_m", "heading_deg"])
            for connection, _, raw in reader.messages([c for c in reader.connections if c.topic == options.images]):
                message = reader.deserialize(raw, connection.msgtype)
                t = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
                nearest = int(numpy.argmin(numpy.abs(clock - t)))
                if t < due or abs(clock[nearest] - t) > 0.5:
                    continue
                began = t if count == 0 else began
                name = f"frame-{count:06}.png"
                image_of(message).save(options.out / name)
                x, y, depth, heading = poses[order[nearest]]
                rows.writerow([f"{t - began:.3f}", name, f"{x:.3f}", f"{y:.3f}", f"{depth:.3f}", f"{heading:.2f}"])
                count, due = count + 1, t + options.period - 1e-6
    print(f"{count} images in {options.out}")


if __name__ == "__main__":
    main()

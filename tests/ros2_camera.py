"""Publishes a recorded folder as a robot's camera and odometry would come, by Cyclone DDS without a ROS installation.

Usage: ros2_camera.py FOLDER --domain N --log FILE [--pace S] [--compressed] [--rest S] [--rows FROM:TO] [--faulty] [--transforms]

The folder has poses.csv with t_s, file, x_m, y_m, depth_m and heading_deg. Each image has the stamp t_s + 1000 s; its
odometry is published a moment later, as estimators do. With --faulty, wrong images come between the good ones, and some good ones
have 16 bits a channel. With --transforms, the poses are transforms from map to odom and from there to base_link; one from
world to map, which stays, is published before. The log of the vehicle tells how many images it has mapped.
"""

import argparse
import csv
import math
import time
from pathlib import Path

from ros2_messages import (  # first: it sets the network of Cyclone DDS
    CompressedImage,
    Header,
    Image,
    Odometry,
    Point,
    Quaternion,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Vector3,
)
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from PIL import Image as Picture

from ros2_recorded import header, odometry_at, wait_for_model, wait_for_reader

def odometry(row):
    # Axes of ROS: the heading is clockwise from north, yaw counts counter-clockwise from east.
    yaw = math.pi / 2 - math.radians(float(row["heading_deg"]))
    turn = Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    place = Point(float(row["x_m"]), float(row["y_m"]), -float(row["depth_m"]))
    return odometry_at(float(row["t_s"]), place, turn)


def link(head, child, place, turn):
    return TransformStamped(head, child, Transform(Vector3(place.x, place.y, place.z), turn))


def transforms(row):
    pose = odometry(row).pose.pose
    t_s, still = float(row["t_s"]), Quaternion(0.0, 0.0, 0.0, 1.0)
    to_odom = link(header(t_s - 0.1, "map"), "odom", Point(0.0, 0.0, 0.0), still)
    return TFMessage([to_odom, link(header(t_s, "odom"), "base_link", pose.position, pose.orientation)])


def write_static(participant):
    lasting = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.TransientLocal, Policy.History.KeepLast(1))
    writer = DataWriter(participant, Topic(participant, "rt/tf_static", TFMessage), qos=lasting)
    still = Quaternion(0.0, 0.0, 0.0, 1.0)
    writer.write(TFMessage([link(Header(Time(0, 0), "world"), "map", Point(0.0, 0.0, 0.0), still)]))
    return writer


def faulty(number, t_s, picture):
    """An image that must not be mapped."""
    grey = bytes(3 * picture.width * picture.height)
    wrong = Image(header(t_s, "camera"), picture.height, picture.width, "rgb8", 0, 3 * picture.width, grey)
    match number % 5:
        case 0:
            wrong.header = Header(Time(0, 0), "camera")
        case 1:
            wrong.encoding = "nv21"
        case 2:
            wrong.header = header(t_s + 3600, "camera")
        case 3:
            wrong.header = header(t_s - 60, "camera")
        case 4:
            wrong.data = grey[:100]
    return wrong


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--domain", type=int, required=True)
    parser.add_argument("--log", type=Path, required=True)
    parser.add_argument("--pace", type=float, default=0.25)
    parser.add_argument("--compressed", action="store_true")
    parser.add_argument("--rest", type=float, default=5.0)
    parser.add_argument("--rows", default=":")
    parser.add_argument("--faulty", action="store_true")
    parser.add_argument("--transforms", action="store_true")
    options = parser.parse_args()
    begin, end = (int(part) if part else None for part in options.rows.split(":"))
    rows = list(csv.DictReader(open(options.folder / "poses.csv", newline="")))[begin:end]
    participant = DomainParticipant(options.domain)
    reliable = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(5))
    kind, name = (CompressedImage, "rt/camera/image_raw/compressed") if options.compressed else (Image, "rt/camera/image_raw")
    images = DataWriter(participant, Topic(participant, name, kind), qos=reliable)
    kind, name = (TFMessage, "rt/tf") if options.transforms else (Odometry, "rt/odometry")
    poses = DataWriter(participant, Topic(participant, name, kind), qos=reliable)
    lasting = write_static(participant) if options.transforms else None
    wait_for_reader(images)
    wait_for_reader(poses)
    time.sleep(0.5)
    for number, row in enumerate(rows, begin or 0):
        wait_for_model(options.log, number)
        path = options.folder / row["file"]
        head = header(float(row["t_s"]), "camera")
        if options.compressed:
            images.write(CompressedImage(head, "png", path.read_bytes()))
        else:
            picture = Picture.open(path).convert("RGB")
            if options.faulty:
                images.write(faulty(number, float(row["t_s"]), picture))
            if options.faulty and number % 2 == 1:
                # The high and the low byte are the same, which is the same level in 16 bits.
                doubled = bytes(byte for byte in picture.tobytes() for _ in range(2))
                images.write(Image(head, picture.height, picture.width, "rgb16", 1, 6 * picture.width, doubled))
            else:
                images.write(Image(head, picture.height, picture.width, "rgb8", 0, 3 * picture.width, picture.tobytes()))
        poses.write(transforms(row) if options.transforms else odometry(row))
        time.sleep(options.pace)
    time.sleep(options.rest)
    del lasting


main()

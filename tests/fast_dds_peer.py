"""A peer of scenecast in ROS 2: Fast DDS, with messages in the CDR of rosbags.

usage: fast_dds_peer.py PROGRAM map DOMAIN TOPIC SECONDS
           waits for a map with at least one label; prints its size, frame, labels and the seconds until it arrived, as JSON
       fast_dds_peer.py PROGRAM camera DOMAIN TOPIC COUNT HERTZ WIDTH HEIGHT
           publishes COUNT images, their calibration beside them, and odometry at 10 times the rate

PROGRAM is fast_dds_peer.cpp, compiled.
"""

import json
import subprocess
import sys
import time

import numpy
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
T = STORE.types


def dds_name(kind):
    package, message, name = kind.split("/")
    return f"{package}::{message}::dds_::{name}_"


class Peer:
    def __init__(self, program, domain):
        self.process = subprocess.Popen([program, domain], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def write(self, topic, message, qos):
        kind = message.__msgtype__
        data = bytes(STORE.serialize_cdr(message, kind))
        self.process.stdin.write(f"write {topic} {dds_name(kind)} {qos} {len(data)}\n".encode() + data)
        self.process.stdin.flush()

    def read(self, topic, kind, qos, seconds):
        self.process.stdin.write(f"read {topic} {dds_name(kind)} {qos} {seconds}\n".encode())
        self.process.stdin.flush()
        length = int(self.process.stdout.readline() or 0)
        return STORE.deserialize_cdr(self.process.stdout.read(length), kind) if length else None

    def wait(self, seconds):
        self.process.stdin.write(f"wait {seconds}\n".encode())

    def close(self):
        self.process.stdin.close()
        if self.process.wait() != 0:
            sys.exit(1)


def stamp(moment):
    return T["builtin_interfaces/msg/Time"](int(moment), int(moment % 1 * 1e9))


def header(time_of_it, frame):
    return T["std_msgs/msg/Header"](time_of_it, frame)


def map_(peer, topic, seconds):
    began = time.monotonic()
    while (left := float(seconds) - (time.monotonic() - began)) > 0:
        grid = peer.read(topic, "nav_msgs/msg/OccupancyGrid", "latched", left)
        if grid is not None and max(grid.data, default=-1) > 0:
            break
    else:
        sys.exit(f"{topic}: not within {seconds} s")
    print(json.dumps({"seconds": round(time.monotonic() - began, 3), "width": grid.info.width, "height": grid.info.height,
                      "frame": grid.header.frame_id, "data": [int(label) for label in grid.data]}))


def camera(peer, topic, count, hertz, width, height):
    count, hertz, width, height = int(count), float(hertz), int(width), int(height)
    point, pose, turn = (T[f"geometry_msgs/msg/{name}"] for name in ("Point", "Pose", "Quaternion"))
    vector = T["geometry_msgs/msg/Vector3"]
    none = numpy.zeros(36)
    pixels = numpy.tile(numpy.arange(width * 3) % 251, height).astype(numpy.uint8)
    k = numpy.array([800.0, 0.0, width / 2, 0.0, 800.0, height / 2, 0.0, 0.0, 1.0])
    p = numpy.array([800.0, 0.0, width / 2, 0.0, 0.0, 800.0, height / 2, 0.0, 0.0, 0.0, 1.0, 0.0])
    region = T["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    still = T["geometry_msgs/msg/TwistWithCovariance"](
        T["geometry_msgs/msg/Twist"](vector(0.5, 0.0, 0.0), vector(0.0, 0.0, 0.0)), none)
    began = time.monotonic()
    for number in range(count * 10):
        now = stamp(time.time())
        at = pose(point(0.1 * number, 0.0, -5.0), turn(0.0, 0.0, 0.0, 1.0))
        measured = T["geometry_msgs/msg/PoseWithCovariance"](at, none)
        peer.write("/odometry", T["nav_msgs/msg/Odometry"](header(now, "odom"), "base_link", measured, still), "sensor")
        if number == 0:
            # The other topics find their subscribers too, before the images come.
            peer.wait(1)
            began = time.monotonic() + 1
        if number % 10 == 0:
            info = T["sensor_msgs/msg/CameraInfo"](header(now, "camera"), height, width, "plumb_bob", numpy.zeros(5), k,
                                                   numpy.eye(3).ravel(), p, 0, 0, region)
            peer.write(topic.rsplit("/", 1)[0] + "/camera_info", info, "sensor")
            peer.write(topic, T["sensor_msgs/msg/Image"](header(now, "camera"), height, width, "rgb8", 0, width * 3, pixels),
                       "sensor")
        time.sleep(max(0.0, began + (number + 1) / hertz / 10 - time.monotonic()))
    peer.wait(2)
    print(f"{count} images")


def main():
    program, command, domain, *arguments = sys.argv[1:]
    peer = Peer(program, domain)
    {"map": map_, "camera": camera}[command](peer, *arguments)
    peer.close()


main()

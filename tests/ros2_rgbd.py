"""Publishes an RGB-D folder in the layout of the TUM benchmark as a robot's camera would come, by Cyclone DDS.

Usage: ros2_rgbd.py FOLDER --domain N --matrix FX,FY,CX,CY --log FILE [--cloud] [--without 3,7] [--pace S]

Images, their CameraInfo, and depth images (32FC1) or clouds have the stamp t + 1000 s; odometry of the vehicle, whose camera looks
down with the top of its images to the bow, follows. Images of --without have no depth.
"""

import argparse
import math
import time
from pathlib import Path

import numpy

from ros2_messages import (  # first: it sets the network of Cyclone DDS
    CameraInfo,
    Image,
    Odometry,
    Point,
    PointCloud2,
    PointField,
    Quaternion,
    RegionOfInterest,
)
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from PIL import Image as Picture

from ros2_recorded import header, odometry_at, wait_for_model, wait_for_reader

def lines(path):
    return [line.split() for line in path.read_text().splitlines() if line and not line.startswith("#")]


def product(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def odometry(row):
    t, x, y, z, *camera = (float(field) for field in row)
    # The vehicle's axes to the bow, to port and up are -y, -x and -z of the camera.
    half = math.sqrt(0.5)
    turn = product(camera, (half, -half, 0.0, 0.0))
    return odometry_at(t, Point(x, y, z), Quaternion(*turn))


def cloud(head, metres, matrix):
    """A point in the middle of each pixel."""
    fx, fy, cx, cy = matrix
    rows, columns = metres.shape
    u, v = numpy.meshgrid(numpy.arange(columns) + 0.5, numpy.arange(rows) + 0.5)
    points = numpy.stack([(u - cx) / fx * metres, (v - cy) / fy * metres, metres], axis=-1).astype("<f4")
    points[metres == 0] = numpy.nan
    fields = [PointField(name, 4 * i, 7, 1) for i, name in enumerate("xyz")]
    return PointCloud2(head, rows, columns, fields, False, 12, 12 * columns, points.tobytes(), False)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--domain", type=int, required=True)
    parser.add_argument("--matrix", required=True)
    parser.add_argument("--cloud", action="store_true")
    parser.add_argument("--without", default="")
    parser.add_argument("--log", type=Path, required=True)
    parser.add_argument("--pace", type=float, default=0.25)
    options = parser.parse_args()
    matrix = [float(field) for field in options.matrix.split(",")]
    fx, fy, cx, cy = matrix
    without = {int(field) for field in options.without.split(",") if field}
    participant = DomainParticipant(options.domain)
    reliable = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(5))

    def writer(name, kind):
        return DataWriter(participant, Topic(participant, name, kind), qos=reliable)

    images, infos = writer("rt/camera/image_raw", Image), writer("rt/camera/camera_info", CameraInfo)
    depths = writer("rt/camera/points", PointCloud2) if options.cloud else writer("rt/camera/depth", Image)
    poses = writer("rt/odometry", Odometry)
    for each in (images, infos, depths, poses):
        wait_for_reader(each)
    time.sleep(0.5)
    rows = zip(lines(options.folder / "rgb.txt"), lines(options.folder / "depth.txt"), lines(options.folder / "groundtruth.txt"))
    for number, ((t, colour), (_, depth), pose) in enumerate(rows):
        wait_for_model(options.log, number)
        head = header(float(t), "camera")
        picture = Picture.open(options.folder / colour).convert("RGB")
        width, height = picture.size
        none = RegionOfInterest(0, 0, 0, 0, False)
        k = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
        r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
        p = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
        infos.write(CameraInfo(head, height, width, "plumb_bob", [0.0] * 5, k, r, p, 0, 0, none))
        images.write(Image(head, height, width, "rgb8", 0, 3 * width, picture.tobytes()))
        metres = numpy.asarray(Picture.open(options.folder / depth)).astype(numpy.float64) / 5000
        if number not in without:
            if options.cloud:
                depths.write(cloud(head, metres, matrix))
            else:
                depths.write(Image(head, height, width, "32FC1", 0, 4 * width, metres.astype("<f4").tobytes()))
        poses.write(odometry(pose))
        time.sleep(options.pace)
    time.sleep(5)


main()

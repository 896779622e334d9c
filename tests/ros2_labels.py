"""Publishes labels and bands of another program by Cyclone DDS, without a ROS installation.

usage: ros2_labels.py grids DOMAIN
           publishes whole grids on /labels: one that is kept for late subscribers, one that changes a cell, a turned one and one
           in the frame of the robot; a costmap is on /costmap and layers on /layers, whose publisher keeps none. Waits until the
           vehicle's diagnostics name the last refusal; prints them as JSON
       ros2_labels.py images DOMAIN
           publishes odometry of a vehicle that moves east by 1 m a second, and a segmented image that was taken 1 s before;
           prints where that was, metres east, as JSON
"""

import json
import sys
import time

from ros2_messages import (  # first: it sets the network of Cyclone DDS
    DiagnosticArray,
    Float32MultiArray,
    GridMap,
    GridMapInfo,
    Header,
    Image,
    MapMetaData,
    MultiArrayDimension,
    MultiArrayLayout,
    OccupancyGrid,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Time,
    Twist,
    TwistWithCovariance,
)
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

RELIABLE = Policy.Reliability.Reliable(duration(seconds=10))
LATCHED = Qos(RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepLast(1))
STATE = Qos(RELIABLE, Policy.Durability.Volatile, Policy.History.KeepLast(10))
NO_TURN = Quaternion(0.0, 0.0, 0.0, 1.0)


def stamp(moment):
    return Time(int(moment), int(moment % 1 * 1e9))


def writer(participant, name, kind, qos):
    return DataWriter(participant, Topic(participant, "rt" + name, kind, qos=qos), qos=qos)


def wait_for_reader(writer):
    until = time.monotonic() + 60
    while not writer.get_matched_subscriptions():
        assert time.monotonic() < until, "no subscriber came"
        time.sleep(0.05)


def grid(data, frame="map", turn=NO_TURN):
    origin = Pose(Point(-2.0, 4.0, 0.0), turn)
    now = stamp(time.time())
    return OccupancyGrid(Header(now, frame), MapMetaData(now, 0.5, 40, 30, origin), data)


def grids(domain):
    participant = DomainParticipant(int(domain))
    labels = writer(participant, "/labels", OccupancyGrid, LATCHED)
    # Classes 0 to 100 and unknown, row by row from the south.
    data = [-1 if x == y else (x // 4 + y // 3 * 10) for y in range(30) for x in range(40)]
    labels.write(grid(data))
    layers = writer(participant, "/layers", GridMap, STATE)
    wait_for_reader(labels)
    wait_for_reader(layers)
    time.sleep(1)
    # Columns along y from the north on, rows along x from the east on: elevation grows by 1 m to the east.
    numbers = [float("nan") if (x, y) == (0, 0) else -30.0 + x for y in reversed(range(30)) for x in reversed(range(40))]
    dimensions = [MultiArrayDimension("column_index", 30, 1200), MultiArrayDimension("row_index", 40, 40)]
    array = Float32MultiArray(MultiArrayLayout(dimensions, 0), numbers)
    info = GridMapInfo(0.5, 20.0, 15.0, Pose(Point(8.0, 11.5, 0.0), NO_TURN))
    layers.write(GridMap(Header(stamp(time.time()), "map"), info, ["elevation"], [], [array], 0, 0))
    data[5] = 77
    labels.write(grid(data))
    time.sleep(1)
    labels.write(grid([1] * 1200, frame="base_link"))
    time.sleep(1)
    labels.write(grid([1] * 1200, turn=Quaternion(0.0, 0.0, 0.5, 0.866)))
    diagnostics = DataReader(participant, Topic(participant, "rt/scenecast/diagnostics", DiagnosticArray, qos=STATE), qos=STATE)
    until = time.monotonic() + 60
    while time.monotonic() < until:
        for array in diagnostics.take(10):
            for status in array.status:
                if status.name.endswith(": labels") and "turned" in status.message:
                    values = {pair.key: pair.value for pair in status.values}
                    print(json.dumps({"level": status.level, "message": status.message, "values": values}))
                    # The last message of a publisher that ends goes with it.
                    time.sleep(1)
                    return
        time.sleep(0.05)
    sys.exit("the diagnostics do not name the refusal")


def images(domain):
    participant = DomainParticipant(int(domain))
    poses = writer(participant, "/odometry", Odometry, STATE)
    pictures = writer(participant, "/segmentation", Image, STATE)
    wait_for_reader(poses)
    wait_for_reader(pictures)
    still = TwistWithCovariance(Twist(Point(1.0, 0.0, 0.0), Point(0.0, 0.0, 0.0)), [0.0] * 36)
    began = time.time()
    for step in range(60):
        now = time.time()
        place = Pose(Point(10.0 + now - began, 5.0, -3.0), NO_TURN)
        poses.write(Odometry(Header(stamp(now), "odom"), "base_link", PoseWithCovariance(place, [0.0] * 36), still))
        if step == 50:
            pictures.write(Image(Header(stamp(now - 1.0), "camera"), 8, 8, "mono8", 0, 8, bytes([4] * 64)))
            taken_m = 10.0 + now - 1.0 - began
        time.sleep(0.1)
    print(json.dumps({"east_m": taken_m}))


{"grids": grids, "images": images}[sys.argv[1]](*sys.argv[2:])

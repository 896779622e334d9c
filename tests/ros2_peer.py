"""A peer of scenecast in ROS 2: Cyclone DDS on the loopback network, without multicast.

usage: ros2_peer.py map DOMAIN TOPIC SECONDS
           waits for a map with at least one label; prints its size, frame, labels and the seconds until it arrived, as JSON
       ros2_peer.py camera DOMAIN TOPIC COUNT HERTZ WIDTH HEIGHT
           publishes COUNT images, their calibration beside them, and odometry at 10 times the rate
       ros2_peer.py hold DOMAIN PREFIX SECONDS true|false [AGE]
           orders hold, or its end, on PREFIX/orders/hold with a stamp of AGE seconds ago; prints the event that answers it, as
           JSON
       ros2_peer.py all DOMAIN PREFIX SECONDS
           waits for one message of every topic of a vehicle at the surface; prints their sizes, as JSON
"""

import json
import math
import sys
import time

from ros2_messages import (  # first: it sets the network of Cyclone DDS
    CameraInfo,
    CompressedImage,
    DiagnosticArray,
    Event,
    GridMap,
    Header,
    Hold,
    Image,
    LabelTree,
    NavSatFix,
    OccupancyGrid,
    Odometry,
    Path,
    Point,
    PointCloud2,
    Pose,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    RegionOfInterest,
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

RELIABLE = Policy.Reliability.Reliable(duration(seconds=1))
LATCHED = Qos(RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepLast(1))
STATE = Qos(RELIABLE, Policy.Durability.Volatile, Policy.History.KeepLast(10))
SENSOR = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(5))


def reader(participant, name, kind, qos):
    return DataReader(participant, Topic(participant, "rt" + name, kind, qos=qos), qos=qos)


def writer(participant, name, kind, qos):
    return DataWriter(participant, Topic(participant, "rt" + name, kind, qos=qos), qos=qos)


def wait(found, seconds, what):
    began = time.monotonic()
    while time.monotonic() - began < seconds:
        result = found()
        if result is not None:
            return result, time.monotonic() - began
        time.sleep(0.02)
    sys.exit(f"{what}: not within {seconds} s")


def stamp(moment):
    return Time(int(moment), int(moment % 1 * 1e9))


def map_(domain, topic, seconds):
    participant = DomainParticipant(int(domain))
    maps = reader(participant, topic, OccupancyGrid, LATCHED)

    def found():
        return next((m for m in maps.take(5) if max(m.data, default=-1) > 0), None)

    grid, after = wait(found, float(seconds), topic)
    info = grid.info
    place = [info.origin.position.x, info.origin.position.y]
    print(json.dumps({"seconds": round(after, 3), "width": info.width, "height": info.height, "frame": grid.header.frame_id,
                      "cell_m": info.resolution, "corner": place, "data": list(grid.data)}))


def camera(domain, topic, count, hertz, width, height):
    participant = DomainParticipant(int(domain))
    images = writer(participant, topic, Image, SENSOR)
    infos = writer(participant, topic.rsplit("/", 1)[0] + "/camera_info", CameraInfo, SENSOR)
    odometry = writer(participant, "/odometry", Odometry, SENSOR)
    count, hertz, width, height = int(count), float(hertz), int(width), int(height)
    deadline = time.monotonic() + 30
    while not images.get_matched_subscriptions():
        if time.monotonic() > deadline:
            sys.exit("no subscriber of images within 30 s")
        time.sleep(0.05)
    time.sleep(1)
    none = [0.0] * 36
    zero = Point(0.0, 0.0, 0.0)
    pixels = bytes(i % 251 for i in range(width * 3)) * height
    k = [800.0, 0.0, width / 2, 0.0, 800.0, height / 2, 0.0, 0.0, 1.0]
    p = [800.0, 0.0, width / 2, 0.0, 0.0, 800.0, height / 2, 0.0, 0.0, 0.0, 1.0, 0.0]
    began = time.monotonic()
    for number in range(count * 10):
        header = Header(stamp(time.time()), "camera")
        pose = Pose(Point(0.1 * number, 0.0, -5.0), Quaternion(0.0, 0.0, 0.0, 1.0))
        twist = TwistWithCovariance(Twist(Point(0.5, 0.0, 0.0), zero), none)
        odometry.write(Odometry(Header(header.stamp, "odom"), "base_link", PoseWithCovariance(pose, none), twist))
        if number % 10 == 0:
            infos.write(CameraInfo(header, height, width, "plumb_bob", [0.0] * 5, k,
                                   [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], p, 0, 0,
                                   RegionOfInterest(0, 0, 0, 0, False)))
            images.write(Image(header, height, width, "rgb8", 0, width * 3, pixels))
        time.sleep(max(0.0, began + (number + 1) / hertz / 10 - time.monotonic()))
    print(f"{count} images")
    time.sleep(2)


def hold(domain, prefix, seconds, is_held, age="0"):
    participant = DomainParticipant(int(domain))
    events = reader(participant, prefix + "/events", Event, STATE)
    orders = writer(participant, prefix + "/orders/hold", Hold, STATE)
    ready = lambda: True if orders.get_matched_subscriptions() and events.get_matched_publications() else None
    wait(ready, float(seconds), "orders/hold")
    orders.write(Hold(Header(stamp(time.time() - float(age)), ""), is_held == "true"))
    event, _ = wait(lambda: next(iter(events.take(1)), None), float(seconds), "events")
    print(json.dumps({"level": event.level, "text": event.text, "source": event.source, "vehicle": event.vehicle}))


def all_(domain, prefix, seconds):
    participant = DomainParticipant(int(domain))
    kinds = {"map": (OccupancyGrid, LATCHED), "layers": (GridMap, LATCHED), "cloud": (PointCloud2, LATCHED),
             "label_tree": (LabelTree, LATCHED), "exemplars": (CompressedImage, LATCHED),
             "pose": (PoseWithCovarianceStamped, STATE), "path": (Path, STATE),
             "fix": (NavSatFix, STATE), "diagnostics": (DiagnosticArray, STATE)}
    readers = {name: reader(participant, f"{prefix}/{name}", *kind) for name, kind in kinds.items()}
    found = {}

    def look():
        for name, topic in readers.items():
            for item in topic.take(10):
                # The first map may be of the first cells alone.
                found[name] = item
        return found if len(found) == len(readers) else None

    try:
        wait(look, float(seconds), prefix)
    except SystemExit as missing:
        sys.exit(f"{missing}: only {sorted(found)}")
    fix, cloud, layers, tree = found["fix"], found["cloud"], found["layers"], found["label_tree"]
    print(json.dumps({
        "map": [found["map"].info.width, found["map"].info.height], "layers": list(layers.layers),
        "matrices": [len(m.data) for m in layers.data], "points": cloud.width, "point_bytes": len(cloud.data),
        "jpeg": bytes(found["exemplars"].data[:3]).hex(), "format": found["exemplars"].format,
        "exemplar": found["exemplars"].header.frame_id, "frame": found["pose"].header.frame_id,
        "path": len(found["path"].poses), "tree": [list(tree.into), list(tree.joins)],
        "fix": [fix.latitude, fix.longitude], "no_altitude": math.isnan(fix.altitude),
        "parts": [s.name for s in found["diagnostics"].status],
        "age_s": time.time() - found["pose"].header.stamp.sec}))


{"map": map_, "camera": camera, "hold": hold, "all": all_}[sys.argv[1]](*sys.argv[2:])

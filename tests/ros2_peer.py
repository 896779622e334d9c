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
import os
import sys
import time
from dataclasses import dataclass

os.environ["CYCLONEDDS_URI"] = """<CycloneDDS><Domain><General><Interfaces>
<NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast>
<MaxMessageSize>65000B</MaxMessageSize></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, byte, float32, float64, int8, int32, sequence, uint8, uint16, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    header: Header
    pose: Pose


@dataclass
class PoseWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class PoseWithCovarianceStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovarianceStamped_"):
    header: Header
    pose: PoseWithCovariance


@dataclass
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Point
    angular: Point


@dataclass
class TwistWithCovariance(IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovariance_"):
    twist: Twist
    covariance: array[float64, 36]


@dataclass
class MapMetaData(IdlStruct, typename="nav_msgs::msg::dds_::MapMetaData_"):
    map_load_time: Time
    resolution: float32
    width: uint32
    height: uint32
    origin: Pose


@dataclass
class OccupancyGrid(IdlStruct, typename="nav_msgs::msg::dds_::OccupancyGrid_"):
    header: Header
    info: MapMetaData
    data: sequence[int8]


@dataclass
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@dataclass
class Path(IdlStruct, typename="nav_msgs::msg::dds_::Path_"):
    header: Header
    poses: sequence[PoseStamped]


@dataclass
class Image(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    header: Header
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32
    data: sequence[uint8]


@dataclass
class CompressedImage(IdlStruct, typename="sensor_msgs::msg::dds_::CompressedImage_"):
    header: Header
    format: str
    data: sequence[uint8]


@dataclass
class RegionOfInterest(IdlStruct, typename="sensor_msgs::msg::dds_::RegionOfInterest_"):
    x_offset: uint32
    y_offset: uint32
    height: uint32
    width: uint32
    do_rectify: bool


@dataclass
class CameraInfo(IdlStruct, typename="sensor_msgs::msg::dds_::CameraInfo_"):
    header: Header
    height: uint32
    width: uint32
    distortion_model: str
    d: sequence[float64]
    k: array[float64, 9]
    r: array[float64, 9]
    p: array[float64, 12]
    binning_x: uint32
    binning_y: uint32
    roi: RegionOfInterest


@dataclass
class NavSatStatus(IdlStruct, typename="sensor_msgs::msg::dds_::NavSatStatus_"):
    status: int8
    service: uint16


@dataclass
class NavSatFix(IdlStruct, typename="sensor_msgs::msg::dds_::NavSatFix_"):
    header: Header
    status: NavSatStatus
    latitude: float64
    longitude: float64
    altitude: float64
    position_covariance: array[float64, 9]
    position_covariance_type: uint8


@dataclass
class PointField(IdlStruct, typename="sensor_msgs::msg::dds_::PointField_"):
    name: str
    offset: uint32
    datatype: uint8
    count: uint32


@dataclass
class PointCloud2(IdlStruct, typename="sensor_msgs::msg::dds_::PointCloud2_"):
    header: Header
    height: uint32
    width: uint32
    fields: sequence[PointField]
    is_bigendian: bool
    point_step: uint32
    row_step: uint32
    data: sequence[uint8]
    is_dense: bool


@dataclass
class MultiArrayDimension(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayDimension_"):
    label: str
    size: uint32
    stride: uint32


@dataclass
class MultiArrayLayout(IdlStruct, typename="std_msgs::msg::dds_::MultiArrayLayout_"):
    dim: sequence[MultiArrayDimension]
    data_offset: uint32


@dataclass
class Float32MultiArray(IdlStruct, typename="std_msgs::msg::dds_::Float32MultiArray_"):
    layout: MultiArrayLayout
    data: sequence[float32]


@dataclass
class GridMapInfo(IdlStruct, typename="grid_map_msgs::msg::dds_::GridMapInfo_"):
    resolution: float64
    length_x: float64
    length_y: float64
    pose: Pose


@dataclass
class GridMap(IdlStruct, typename="grid_map_msgs::msg::dds_::GridMap_"):
    header: Header
    info: GridMapInfo
    layers: sequence[str]
    basic_layers: sequence[str]
    data: sequence[Float32MultiArray]
    outer_start_index: uint16
    inner_start_index: uint16


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: byte
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
class Hold(IdlStruct, typename="scenecast_msgs::msg::dds_::Hold_"):
    header: Header
    hold: bool


@dataclass
class Event(IdlStruct, typename="scenecast_msgs::msg::dds_::Event_"):
    header: Header
    vehicle: str
    level: uint8
    source: str
    text: str


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
             "exemplars": (CompressedImage, LATCHED), "pose": (PoseWithCovarianceStamped, STATE), "path": (Path, STATE),
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
    fix, cloud, layers = found["fix"], found["cloud"], found["layers"]
    print(json.dumps({
        "map": [found["map"].info.width, found["map"].info.height], "layers": list(layers.layers),
        "matrices": [len(m.data) for m in layers.data], "points": cloud.width, "point_bytes": len(cloud.data),
        "jpeg": bytes(found["exemplars"].data[:3]).hex(), "format": found["exemplars"].format,
        "exemplar": found["exemplars"].header.frame_id, "frame": found["pose"].header.frame_id,
        "path": len(found["path"].poses), "fix": [fix.latitude, fix.longitude], "no_altitude": math.isnan(fix.altitude),
        "parts": [s.name for s in found["diagnostics"].status],
        "age_s": time.time() - found["pose"].header.stamp.sec}))


{"map": map_, "camera": camera, "hold": hold, "all": all_}[sys.argv[1]](*sys.argv[2:])

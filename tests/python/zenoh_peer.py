"""A peer of scenecast by rmw_zenoh: keys, liveliness tokens and attachments as rmw_zenoh's docs/design.md has them, on the Zenoh of
PyPI, with the CDR and the type hashes of rosbags.

usage: zenoh_peer.py router PORT
           routes on the loopback network until its standard input ends
       zenoh_peer.py camera PORT DOMAIN TOPIC HASH COUNT HERTZ WIDTH HEIGHT
           waits for a subscriber of images, then publishes COUNT of them, and odometry on /odometry at 10 times the rate
       zenoh_peer.py latch PORT DOMAIN TOPIC HASH WIDTH HEIGHT
           publishes one map for subscribers to come, until its standard input ends
       zenoh_peer.py map PORT DOMAIN TOPIC HASH SECONDS
           subscribes to a map; prints it, what came with it and the token of its publisher, as JSON

HASH is `own` for the type hash of ROS 2 Jazzy, `humble` for none, or another text.
"""

import json
import os
import secrets
import sys
import threading
import time

import numpy as np
import xxhash
import zenoh
from rosbags.typesys import Stores, get_typestore
from zenoh.ext import (
    CacheConfig,
    HistoryConfig,
    MissDetectionConfig,
    RecoveryConfig,
    declare_advanced_publisher,
    declare_advanced_subscriber,
)

STORE = get_typestore(Stores.ROS2_JAZZY)
T = STORE.types
RELIABLE, SENSOR, LATCHED = "::,10:,:,:,,", "2::,5:,:,:,,", ":1:,1:,:,:,,"


def ready():
    print("ready", flush=True)


def fail(text):
    """Ends at once: the threads of a session would keep the process alive."""
    print(text, file=sys.stderr, flush=True)
    os._exit(1)


def open_session(port, mode="peer"):
    """As rmw_zenoh's default settings do."""
    config = zenoh.Config()
    endpoint = json.dumps([f"tcp/127.0.0.1:{port}"])
    settings = {"mode": json.dumps(mode), "scouting/multicast/enabled": "false", "timestamping/enabled": "true",
                "scouting/gossip/target": '{"router": ["router", "peer"], "peer": ["router"]}'}
    if mode == "router":
        settings["listen/endpoints"] = endpoint
    else:
        settings |= {"connect/endpoints": endpoint, "listen/endpoints": '["tcp/localhost:0"]'}
    for key, value in settings.items():
        config.insert_json5(key, value)
    return zenoh.open(config)


class Node:
    """A node of ROS 2 with its tokens."""

    def __init__(self, port, domain, name):
        self.session, self.domain, self.name = open_session(port), domain, name
        self.tokens, self.ids, self.graph = [], 0, set()
        self.follower = self.session.liveliness().declare_subscriber(f"@ros2_lv/{domain}/**", self.follow, history=True)
        self.declare_token("NN", "")

    def follow(self, sample):
        change = self.graph.add if sample.kind == zenoh.SampleKind.PUT else self.graph.discard
        change(str(sample.key_expr))

    def tokens_of(self, kind, topic):
        """The tokens of other sessions."""
        parts = [token.split("/") for token in list(self.graph)]
        wanted = [part for part in parts if part[2] != str(self.session.zid()) and part[5] == kind]
        return ["/".join(part) for part in wanted if part[9] == topic.replace("/", "%")]

    def declare_token(self, kind, rest):
        number, self.ids = self.ids, self.ids + 1
        key = f"@ros2_lv/{self.domain}/{self.session.zid()}/0/{number}/{kind}/%/%/{self.name}{rest}"
        self.tokens.append(self.session.liveliness().declare_token(key))
        return key

    def key(self, topic, kind, hash_):
        package, _, name = kind.split("/")
        dds = f"{package}::msg::dds_::{name}_"
        digest = {"own": STORE.hash_rihs01(kind), "humble": "TypeHashNotSupported"}.get(hash_, hash_)
        return f"{self.domain}/{topic.lstrip('/')}/{dds}/{digest}", f"/{topic.replace('/', '%')}/{dds}/{digest}/"

    def publisher(self, topic, kind, hash_, qos=SENSOR):
        key, rest = self.key(topic, kind, hash_)
        self.declare_token("MP", rest + qos)
        latched = {"cache": CacheConfig(max_samples=1), "publisher_detection": True,
                   "sample_miss_detection": MissDetectionConfig(sporadic_heartbeat=0.5)} if qos == LATCHED else {}
        # It waits for slow subscribers, as rmw_zenoh does for what is reliable and keeps all.
        waits = zenoh.CongestionControl.BLOCK
        return Publisher(declare_advanced_publisher(self.session, key, congestion_control=waits, **latched), kind)

    def wait_for_subscription(self, topic, seconds=30):
        deadline = time.monotonic() + seconds
        while not self.tokens_of("MS", topic):
            if time.monotonic() > deadline:
                fail(f"no subscriber of {topic} within {seconds} s")
            time.sleep(0.1)


class Publisher:
    def __init__(self, publisher, kind):
        self.publisher, self.kind, self.count, self.gid = publisher, kind, 0, secrets.token_bytes(16)

    def publish(self, message):
        self.count += 1
        attachment = self.count.to_bytes(8, "little") + time.time_ns().to_bytes(8, "little") + b"\x10" + self.gid
        self.publisher.put(bytes(STORE.serialize_cdr(message, self.kind)), attachment=attachment)


def header(frame):
    now = time.time_ns()
    stamp = T["builtin_interfaces/msg/Time"](sec=now // 10**9, nanosec=now % 10**9)
    return T["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def pose(x, y, z):
    point = T["geometry_msgs/msg/Point"](x=x, y=y, z=z)
    return T["geometry_msgs/msg/Pose"](position=point, orientation=T["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0))


def odometry(x):
    vector = T["geometry_msgs/msg/Vector3"]
    twist = T["geometry_msgs/msg/Twist"](linear=vector(x=0.5, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=0.0))
    none = np.zeros(36)
    return T["nav_msgs/msg/Odometry"](
        header=header("odom"), child_frame_id="base_link",
        pose=T["geometry_msgs/msg/PoseWithCovariance"](pose=pose(x, 0.0, -5.0), covariance=none),
        twist=T["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=none))


def router(port):
    session = open_session(port, "router")
    ready()
    sys.stdin.read()
    session.close()


def camera(port, domain, topic, hash_, count, hertz, width, height):
    node = Node(port, domain, "camera")
    images = node.publisher(topic, "sensor_msgs/msg/Image", hash_)
    poses = node.publisher("/odometry", "nav_msgs/msg/Odometry", hash_, RELIABLE)
    count, hertz, width, height = int(count), float(hertz), int(width), int(height)
    node.wait_for_subscription(topic)
    time.sleep(0.5)
    row = np.arange(width * 3, dtype=np.uint32) % 251
    pixels = np.tile(row.astype(np.uint8), height)
    began = time.monotonic()
    for number in range(count * 10):
        poses.publish(odometry(0.1 * number))
        if number % 10 == 0:
            images.publish(T["sensor_msgs/msg/Image"](
                header=header("camera"), height=height, width=width, encoding="rgb8", is_bigendian=0, step=width * 3,
                data=pixels))
        time.sleep(max(0.0, began + (number + 1) / hertz / 10 - time.monotonic()))
    time.sleep(1)
    print(f"{count} images")


def latch(port, domain, topic, hash_, width, height):
    node = Node(port, domain, "mapper")
    publisher = node.publisher(topic, "nav_msgs/msg/OccupancyGrid", hash_, LATCHED)
    width, height = int(width), int(height)
    stamp = T["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    info = T["nav_msgs/msg/MapMetaData"](map_load_time=stamp, resolution=0.5, width=width, height=height, origin=pose(1.0, 2.0, 0.0))
    labels = (np.arange(width * height) % 7).astype(np.int8)
    publisher.publish(T["nav_msgs/msg/OccupancyGrid"](header=header("map"), info=info, data=labels))
    ready()
    sys.stdin.read()


def map_(port, domain, topic, hash_, seconds):
    kind = "nav_msgs/msg/OccupancyGrid"
    node = Node(port, domain, "viewer")
    key, rest = node.key(topic, kind, hash_)
    began, arrived, found = time.monotonic(), threading.Event(), []

    def take(sample):
        found.append((time.monotonic() - began, sample))
        arrived.set()

    node.declare_token("MS", rest + LATCHED)
    subscriber = declare_advanced_subscriber(
        node.session, key, take, subscriber_detection=True,
        history=HistoryConfig(detect_late_publishers=True, max_samples=1), recovery=RecoveryConfig(heartbeat=True))
    if not arrived.wait(float(seconds)):
        fail(f"no map on {key} within {seconds} s")
    after, sample = found[0]
    grid = STORE.deserialize_cdr(sample.payload.to_bytes(), kind)
    attachment = sample.attachment.to_bytes()
    deadline = time.monotonic() + 5
    while not (tokens := node.tokens_of("MP", topic)) and time.monotonic() < deadline:
        time.sleep(0.05)
    gids = [xxhash.xxh3_128_intdigest(token.encode()).to_bytes(16, "little") for token in tokens]
    print(json.dumps({
        "seconds": round(after, 3), "width": grid.info.width, "height": grid.info.height, "frame": grid.header.frame_id,
        "labels": [int(n) for n in np.bincount(grid.data.astype(np.int64) + 1)], "attachment": len(attachment),
        "sequence": int.from_bytes(attachment[:8], "little"), "gid_length": attachment[16],
        "age_s": (time.time_ns() - int.from_bytes(attachment[8:16], "little")) / 1e9,
        "gid_is_of_token": attachment[17:] in gids, "tokens": tokens}), flush=True)
    del subscriber
    os._exit(0)


{"router": router, "camera": camera, "latch": latch, "map": map_}[sys.argv[1]](*sys.argv[2:])

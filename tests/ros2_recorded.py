"""What publishers of recorded images share: times, odometry, and the waits for a subscriber and for its scene model."""

import time

from ros2_messages import (
    Header,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Time,
    Twist,
    TwistWithCovariance,
)

STILL = TwistWithCovariance(Twist(Point(0.0, 0.0, 0.0), Point(0.0, 0.0, 0.0)), [0.0] * 36)


def header(t_s, frame):
    nanos = round(t_s * 1e9) + 1000 * 10**9
    return Header(Time(nanos // 10**9, nanos % 10**9), frame)


def odometry_at(t_s, place, turn):
    return Odometry(header(t_s, "odom"), "base_link", PoseWithCovariance(Pose(place, turn), [0.0] * 36), STILL)


def wait_for_reader(writer):
    until = time.monotonic() + 60
    while not writer.get_matched_subscriptions():
        assert time.monotonic() < until, "no subscriber came"
        time.sleep(0.05)


def wait_for_model(log, number):
    """Waits until the images before this one are with the scene model: a busy machine drops none."""
    until = time.monotonic() + 300
    while log.read_text().count("goes to the scene model") < number:
        assert time.monotonic() < until, "images are not mapped"
        time.sleep(0.1)

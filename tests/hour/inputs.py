"""What a robot's sensors send in an hour, with the faults of issue 44: a GPS receiver, a gpsd, an ArduSub, a camera.

Each runs in a thread of its own on loopback, at `scale` mission seconds for each second of the wall clock.
"""

import io
import json
import math
import os
import random
import socket
import threading
import time

os.environ["MAVLINK20"] = "1"
from PIL import Image
from pymavlink.dialects.v20 import ardupilotmega as m

# The share of lines, frames and images that are damaged.
DAMAGED = 0.01
FLOOR_M = 20.0
METRES_PER_DEGREE = 111_195.0


class Craft:
    """The boat at the surface: it goes round in a circle."""

    LAT, LON, RADIUS_M, SPEED_M_S = 60.39, 5.32, 40.0, 0.5

    def at(self, t):
        """Latitude, longitude and course in degrees."""
        turn = t * self.SPEED_M_S / self.RADIUS_M
        north, east = self.RADIUS_M * math.sin(turn), self.RADIUS_M * (1 - math.cos(turn))
        shrink = math.cos(math.radians(self.LAT))
        return self.LAT + north / METRES_PER_DEGREE, self.LON + east / METRES_PER_DEGREE / shrink, math.degrees(turn) % 360

    def distance(self, t, lat, lon):
        """Metres from where the boat is to a place."""
        true_lat, true_lon, _ = self.at(t)
        shrink = math.cos(math.radians(self.LAT))
        return math.hypot(lat - true_lat, (lon - true_lon) * shrink) * METRES_PER_DEGREE


class Server:
    """A TCP server that sends the reports of each mission second, those of `reports(second)`, to whoever connects."""

    def __init__(self, kind, reports, scale, greeting=b"", seed=4):
        self.reports, self.scale, self.greeting = reports, scale, greeting
        self.random, self.connections = random.Random(seed), 0
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address, self.began = f"{kind}:127.0.0.1:{self.listener.getsockname()[1]}", time.monotonic()
        threading.Thread(target=self.accept, daemon=True).start()

    def now(self):
        return (time.monotonic() - self.began) * self.scale

    def accept(self):
        while True:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            self.connections += 1
            threading.Thread(target=self.serve, args=(connection,), daemon=True).start()

    def serve(self, connection):
        second = int(self.now())
        try:
            connection.sendall(self.greeting)
            while True:
                connection.sendall(b"".join(self.damage(line) for line in self.reports(second)))
                second += 1
                time.sleep(max(0.0, (second - self.now()) / self.scale))
        except OSError:
            connection.close()

    def damage(self, line):
        """One line in a hundred has a false byte, is cut, or has lost its end and so runs into the next one."""
        if self.random.random() >= DAMAGED:
            return line
        at = self.random.randrange(len(line))
        return self.random.choice([line[:at] + bytes([line[at] ^ 0x55]) + line[at + 1 :], line[:at], line.rstrip(b"\r\n")])


def misplaced(second, lat, lon):
    """The place that a receiver says: the equator at first and now and then, and a jump of 3 km each five minutes."""
    if second < 3 or second % 600 == 250:
        return 0.0, 0.0
    return (lat + 0.0267, lon) if second % 300 == 150 else (lat, lon)


def checksum(text):
    total = 0
    for byte in text.encode():
        total ^= byte
    return total


def sentence(body, lower=False):
    digits = f"{checksum(body):02x}" if lower else f"{checksum(body):02X}"
    return f"${body}*{digits}\r\n".encode()


def tagged(tag, line):
    return f"\\{tag}*{checksum(tag):02X}\\".encode() + line


def nmea(second):
    """A second of NMEA 0183: GGA and RMC of which each fails for a minute of ten, a tag block, AIS, satellites, the heading."""
    lat, lon, course = Craft().at(second)
    lat, lon = misplaced(second, lat, lon)
    clock = f"{(10 + second // 3600) % 24:02d}{second // 60 % 60:02d}{second % 60:02d}.00"
    place = f"{int(lat):02d}{lat % 1 * 60:08.5f},N,{int(lon):03d}{lon % 1 * 60:08.5f},E"
    minute = second // 60 % 10
    quality = "0,00,99.9" if minute == 1 else "9,09,0.9" if minute == 3 else "1,09,0.9"
    talker = ("GN", "GP", "GA", "GB")[second // 900 % 4]
    lines = [sentence(f"{talker}GGA,{clock},{place},{quality},2.0,M,40.0,M,,", lower=second % 2 == 0)]
    lines.append(sentence("GPGSV,3,1,11,03,03,111,00,04,15,270,00,06,01,010,00,13,06,292,00"))
    lines.append(tagged(f"s:ais,c:17{second:08d}", b"!AIVDM,1,1,,A,13u?etPv2;0n:dDPwUM1U1Cb069D,0*24\r\n"))
    if minute != 6:
        status = "V" if minute == 8 else "A"
        lines.append(tagged("s:gps", sentence(f"GNRMC,{clock},{status},{place},1.0,{course:.1f},261126,,,A")))
    lines.append(sentence(f"HEHDT,{course:.1f},T"))
    return lines


def gpsd(second):
    """A second of gpsd: a receiver that only reckons for a minute of ten, another one for that time and the next, sky, heading."""
    true_lat, true_lon, course = Craft().at(second)
    lat, lon = misplaced(second, true_lat, true_lon)
    clock = f"2026-11-26T{10 + second // 3600:02d}:{second // 60 % 60:02d}:{second % 60:02d}.000Z"
    report = {"class": "TPV", "device": "/dev/ttyACM0", "mode": 3, "time": clock, "lat": lat, "lon": lon, "eph": 5.0}
    report |= {"speed": Craft.SPEED_M_S, "track": course}
    minute = second // 60 % 10
    if minute == 1:
        report["status"] = 5
    elif second % 30 == 17:
        report = {"class": "TPV", "device": "/dev/ttyACM0", "mode": 1, "time": clock}
    other = {"class": "TPV", "device": "/dev/ttyUSB1", "mode": 3, "time": clock, "lat": true_lat, "lon": true_lon, "eph": 9.0}
    sky = {"class": "SKY", "device": "/dev/ttyACM0", "hdop": 0.9, "satellites": [{"PRN": n, "used": True} for n in range(9)]}
    reports = [report, sky, {"class": "ATT", "device": "/dev/ttyACM0", "heading": course}]
    reports += [other] if minute in (1, 2) else []
    return [json.dumps(each).encode() + b"\r\n" for each in reports]


GPSD_GREETING = b'{"class":"VERSION","release":"3.25","rev":"3.25","proto_major":3,"proto_minor":15}\r\n'


class Sub:
    """An ArduSub in guided mode that flies to its targets, and what else is heard on its link, ten times a mission second."""

    SPEED_M_S, TURN_RAD = 0.5, math.radians(4.5)
    # North and east of every target of a survey of 100 x 60 m, and 80 m more for the drift of dead reckoning.
    AREA = (-80, 180)

    def __init__(self, port, scale, seed=5):
        self.scale, self.random, self.ends, self.is_running = scale, random.Random(seed), {}, True
        self.destination = ("127.0.0.1", port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.002)
        self.north = self.east = self.yaw = 0.0
        self.down = 5.0
        self.velocity, self.target, self.targets, self.astray = (0.0, 0.0), None, 0, []
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def stop(self):
        self.is_running = False
        self.thread.join()
        self.socket.close()

    def send(self, message, system=1, component=1):
        frame = bytearray(message.pack(self.ends.setdefault((system, component), m.MAVLink(None, system, component))))
        if self.random.random() < DAMAGED:
            frame[self.random.randrange(len(frame))] ^= 0x55
        try:
            self.socket.sendto(frame, self.destination)
        except OSError:
            pass  # nobody listens yet

    def run(self):
        parser, began, tick = m.MAVLink(None), time.monotonic(), 0
        parser.robust_parsing = True
        while self.is_running:
            if tick % 10 == 0:
                self.send_each_second(tick)
            self.fly()
            self.send_motion(tick)
            tick += 1
            until = began + tick / 10 / self.scale
            self.listen(parser)
            while time.monotonic() < until:
                self.listen(parser)

    def listen(self, parser):
        try:
            data = self.socket.recv(4096)
        except OSError:
            return
        for message in parser.parse_buffer(data) or []:
            if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
                self.target, self.targets = (message.x, message.y, message.z), self.targets + 1
                if not (self.AREA[0] < message.x < self.AREA[1] and self.AREA[0] < message.y < self.AREA[1]):
                    self.astray.append((round(message.x), round(message.y)))

    def fly(self):
        if self.target is None:
            return
        north, east, down = (to - at for to, at in zip(self.target, (self.north, self.east, self.down), strict=True))
        slow = self.SPEED_M_S / max(math.hypot(north, east), self.SPEED_M_S)
        self.velocity = (north * slow, east * slow)
        self.north, self.east = self.north + self.velocity[0] / 10, self.east + self.velocity[1] / 10
        self.down += max(-0.05, min(0.05, down))
        if math.hypot(*self.velocity) > 0.1:
            turn = math.remainder(math.atan2(self.velocity[1], self.velocity[0]) - self.yaw, math.tau)
            self.yaw = math.remainder(self.yaw + max(-self.TURN_RAD, min(self.TURN_RAD, turn)), math.tau)

    def send_each_second(self, tick):
        ms = 60_000 + tick * 100
        self.send(m.MAVLink_heartbeat_message(12, 3, 129, 4, 4, 3))
        self.send(m.MAVLink_heartbeat_message(18, 0, 0, 0, 4, 3), component=191)  # companion computer
        self.send(m.MAVLink_heartbeat_message(26, 8, 0, 0, 4, 3), component=154)  # gimbal
        self.send(m.MAVLink_heartbeat_message(30, 0, 0, 0, 4, 3), component=100)  # camera
        self.send(m.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), system=255, component=190)  # ground station
        self.send(m.MAVLink_heartbeat_message(11, 3, 129, 15, 4, 3), system=2)  # the boat's autopilot
        self.send(m.MAVLink_statustext_message(4, (b"EKF variance", b"Leak detected")[tick // 10 % 2]))
        height_m = 45.0 if tick % 2000 == 1000 else FLOOR_M - self.down
        self.send(m.MAVLink_distance_sensor_message(ms, 20, 5000, round(height_m * 100), 0, 0, 25, 0))

    def send_motion(self, tick):
        """Position and attitude, with the jumps; and those of others, by clocks of their own."""
        ms = 60_000 + tick * 100
        north = self.north + (300 if tick % 907 == 300 else 0)
        down = 42.0 if tick % 3000 == 1501 else self.down
        velocity = (9.0, -9.0) if tick % 3500 == 2000 else self.velocity
        yaw = math.remainder(self.yaw + (2.5 if tick % 4000 == 1700 else 0), math.tau)
        self.send(m.MAVLink_attitude_message(ms, 0, 0, yaw, 0, 0, 0))
        self.send(m.MAVLink_local_position_ned_message(ms, north, self.east, down, *velocity, 0))
        if self.target:
            self.send(m.MAVLink_position_target_local_ned_message(ms, 1, 0x0DF8, *self.target, *[0] * 8))
        self.send(m.MAVLink_attitude_message(tick * 100 + 7, 0.1, -0.7, -2.0, 0, 0, 0), component=154)
        if tick % 5 == 0:
            self.send(m.MAVLink_local_position_ned_message(tick * 100 + 3_600_000, -900, 900, 0, 2, 2, 0), system=2)
            self.send(m.MAVLink_attitude_message(tick * 100 + 3_600_000, 0, 0, 1.0, 0, 0, 0), system=2)


class Camera:
    """Writes what the vehicle is above to a folder, each file named by its time."""

    METRES_PER_PIXEL, WIDTH, HEIGHT, SURVEY_M = 0.05, 160, 120, 4.0

    def __init__(self, folder, sub, per_second, seed=6):
        self.folder, self.sub, self.pause, self.random = folder, sub, 1 / per_second, random.Random(seed)
        self.counts = {"whole": 0, "padded": 0, "cut": 0, "no image": 0}
        self.floor, self.is_running = self.sea_floor(), True
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def stop(self):
        self.is_running = False
        self.thread.join()

    def sea_floor(self):
        """A mottled sea floor of 140 x 100 m, whose south-western corner is 20 m away from the map's origin."""
        size = (2800, 2000)
        fine, coarse = (
            Image.frombytes("L", of, self.random.randbytes(of[0] * of[1])).resize(size, Image.Resampling.BICUBIC)
            for of in ((700, 500), (70, 50))
        )
        return Image.blend(fine, coarse, 0.4)

    def image(self):
        """The JPEG of the vehicle's view; its upper edge is ahead."""
        zoom = max(0.2, (FLOOR_M - self.sub.down) / self.SURVEY_M)
        sin, cos = zoom * math.sin(self.sub.yaw), zoom * math.cos(self.sub.yaw)
        column, row = (self.sub.east + 20) / self.METRES_PER_PIXEL, (80 - self.sub.north) / self.METRES_PER_PIXEL
        half_x, half_y = self.WIDTH / 2, self.HEIGHT / 2
        turned = (cos, -sin, column - half_x * cos + half_y * sin, sin, cos, row - half_x * sin - half_y * cos)
        view = self.floor.transform((self.WIDTH, self.HEIGHT), Image.Transform.AFFINE, turned, Image.Resampling.BILINEAR)
        out = io.BytesIO()
        view.save(out, "JPEG", quality=85)
        return out.getvalue()

    def run(self):
        began, number = time.monotonic(), 0
        while self.is_running:
            data, kind = self.image(), "whole"
            if number == 30:
                data, kind = b"this is not an image\n" * 50, "no image"
            elif self.random.random() < DAMAGED:
                data, kind = data[: len(data) * 3 // 5], "cut"
            elif number % 10 == 5:
                data, kind = data + bytes(6000), "padded"
            self.counts[kind] += 1
            self.write(f"{time.time():.6f}.jpg", data)
            number += 1
            time.sleep(max(0.0, began + number * self.pause - time.monotonic()))

    def write(self, name, data):
        """In two parts, as a camera that writes to the file that is watched."""
        with open(self.folder / name, "wb", buffering=0) as file:
            file.write(data[:2000])
            time.sleep(0.02)
            file.write(data[2000:])

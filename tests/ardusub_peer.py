"""An autopilot that behaves as ArduSub does on a BlueROV2, for the tests.

Usage: ardusub_peer.py PORT [SPEED_M_S]

Speaks MAVLink over UDP to 127.0.0.1:PORT, as BlueOS does. What it keeps of ArduSub:
* it starts disarmed in MANUAL, and beats once a second;
* it streams a message only when SET_MESSAGE_INTERVAL has asked for it;
* it acknowledges commands, and refuses to arm in an unknown mode;
* it takes position targets in GUIDED while armed, and no others;
* it takes GPS_INPUT as a receiver: after five good ones its local position jumps to where they say;
* it reports the target that it flies to, if there is one, and the distance to it;
* without a heartbeat of its companion for five seconds it disarms (FS_GCS).

Each line on stdin is an order of the test: `silent` (heartbeats still reach it, so that it does not disarm, however long
that is), `speak`, `pilot MODE`, `refuse` and `accept` (targets, without a word), `lose` and `find` (its position; the frame
has jumped by then), `reboot`, `quit`. Each 0.1 s a line of JSON on stdout tells what it has seen.
"""

import json
import math
import select
import sys
import time

from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as m

MANUAL, GUIDED, ALT_HOLD = 19, 4, 2
KNOWN_MODES = {0, 1, 2, 3, 4, 7, 9, 16, 19, 20}
ORIGIN = (29.5, 34.92)
METRES_PER_DEGREE = 110_856.0
FLOOR_M = 20.0


class Sub:
    def __init__(self, port, speed):
        self.link = mavutil.mavlink_connection(
            f"udpout:127.0.0.1:{port}", source_system=1, source_component=1, dialect="ardupilotmega")
        self.began = time.monotonic()
        self.speed = speed
        self.mode, self.armed, self.silent = MANUAL, False, False
        self.refuses, self.is_lost, self.off_until = False, False, 0.0
        self.north = self.east = self.down = self.yaw = 0.0
        self.true_north = self.true_east = 0.0
        self.v_north = self.v_east = 0.0
        self.target = None
        self.intervals, self.last_sent = {}, {}
        self.heard_beat = None
        self.seen = {"heartbeats": 0, "targets": 0, "targets_refused": 0, "gps_inputs": 0, "bad": 0, "failsafes": 0,
                     "commands": [], "gps": None, "jumped": False}

    def ms(self):
        return max(0, int((time.monotonic() - self.began) * 1000))

    def stream(self, message_id, send):
        interval = self.intervals.get(message_id, 0)
        now = time.monotonic()
        if interval > 0 and now - self.last_sent.get(message_id, 0) >= interval:
            self.last_sent[message_id] = now
            send()

    def is_rebooting(self):
        return time.monotonic() < self.off_until

    def is_off(self):
        return self.silent or self.is_rebooting()

    def distance(self):
        return math.hypot(self.target[0] - self.north, self.target[1] - self.east) if self.target else 0.0

    def speak(self):
        if self.is_off():
            return
        mav = self.link.mav
        now = time.monotonic()
        if now - self.last_sent.get("beat", 0) >= 1.0:
            self.last_sent["beat"] = now
            mav.heartbeat_send(m.MAV_TYPE_SUBMARINE, m.MAV_AUTOPILOT_ARDUPILOTMEGA, 1 | (128 if self.armed else 0),
                               self.mode, m.MAV_STATE_ACTIVE)
        self.stream(30, lambda: mav.attitude_send(self.ms(), 0.1, -0.05, self.yaw, 0, 0, 0))
        self.stream(62, lambda: mav.nav_controller_output_send(0, 0, 0, 0, int(self.distance()), 0, 0, 0))
        self.stream(132, lambda: mav.distance_sensor_send(
            self.ms(), 20, 5000, int((FLOOR_M - self.down) * 100), m.MAV_DISTANCE_SENSOR_ULTRASOUND, 1,
            m.MAV_SENSOR_ROTATION_PITCH_270, 255))
        if self.target and self.mode == GUIDED:
            self.stream(85, lambda: mav.position_target_local_ned_send(
                self.ms(), m.MAV_FRAME_LOCAL_NED, 0x0DF8, *self.target, 0, 0, 0, 0, 0, 0, 0, 0))
        if self.is_lost:
            return
        self.stream(32, lambda: mav.local_position_ned_send(
            self.ms(), self.north, self.east, self.down, self.v_north, self.v_east, 0))
        self.stream(33, lambda: mav.global_position_int_send(
            self.ms(), int((ORIGIN[0] + self.true_north / METRES_PER_DEGREE) * 1e7), int(ORIGIN[1] * 1e7), 0,
            int(-self.down * 1000), int(self.v_north * 100), int(self.v_east * 100), 0, 65535))

    def hear(self):
        while True:
            message = self.link.recv_match(blocking=False)
            if message is None:
                return
            kind = message.get_type()
            if kind == "BAD_DATA":
                self.seen["bad"] += 1
            elif kind == "HEARTBEAT" and not self.is_rebooting():
                self.seen["heartbeats"] += 1
                self.heard_beat = time.monotonic()
            elif self.is_off():
                pass
            elif kind == "COMMAND_LONG" and message.target_system == 1:
                self.command(message)
            elif kind == "SET_POSITION_TARGET_LOCAL_NED" and message.target_system == 1:
                self.position_target(message)
            elif kind == "GPS_INPUT":
                self.gps_input(message)

    def command(self, c):
        self.seen["commands"].append(c.command)
        result = m.MAV_RESULT_ACCEPTED
        if c.command == m.MAV_CMD_SET_MESSAGE_INTERVAL:
            self.intervals[int(c.param1)] = c.param2 / 1e6
        elif c.command == m.MAV_CMD_DO_SET_MODE:
            if int(c.param1) & 1 and int(c.param2) in KNOWN_MODES:
                self.mode = int(c.param2)
            else:
                result = m.MAV_RESULT_FAILED
        elif c.command == m.MAV_CMD_COMPONENT_ARM_DISARM:
            self.armed = c.param1 == 1
        else:
            result = m.MAV_RESULT_UNSUPPORTED
        self.link.mav.command_ack_send(c.command, result)

    def position_target(self, t):
        uses_position = t.type_mask & 0b111 == 0
        if not (self.armed and self.mode == GUIDED and uses_position and t.coordinate_frame == m.MAV_FRAME_LOCAL_NED):
            self.seen["targets_refused"] += 1
            return
        self.seen["targets"] += 1
        if not self.refuses:
            self.target = (t.x, t.y, t.z)

    def gps_input(self, g):
        if g.fix_type < 3 or g.satellites_visible < 6:
            return
        self.seen["gps_inputs"] += 1
        self.seen["gps"] = [g.lat / 1e7, g.lon / 1e7, g.horiz_accuracy]
        if self.seen["gps_inputs"] == 5:
            # The filter takes the position in: its own frame jumps, the vehicle does not.
            self.north += 25.0
            self.seen["jumped"] = True

    def move(self, dt):
        if self.heard_beat and time.monotonic() - self.heard_beat > 5.0 and self.armed and not self.is_off():
            self.armed = False
            self.seen["failsafes"] += 1
        self.v_north = self.v_east = 0.0
        if not (self.armed and self.mode == GUIDED and self.target) or self.is_lost or self.is_off():
            return
        north, east = self.target[0] - self.north, self.target[1] - self.east
        distance = math.hypot(north, east)
        way = min(distance, self.speed * dt)
        if distance > 0.05:
            self.v_north, self.v_east = north / distance * way / dt, east / distance * way / dt
            self.yaw = math.atan2(east, north)
        self.north += self.v_north * dt
        self.east += self.v_east * dt
        self.true_north += self.v_north * dt
        self.true_east += self.v_east * dt
        self.down += max(-0.5 * dt, min(0.5 * dt, self.target[2] - self.down))

    def obey(self, order):
        word = order.split()
        if word[:1] == ["silent"]:
            self.silent = True
        elif word[:1] == ["speak"]:
            self.silent = False
        elif word[:1] == ["pilot"]:
            self.mode = int(word[1])
        elif word[:1] in (["refuse"], ["accept"]):
            self.refuses = word[0] == "refuse"
        elif word[:1] in (["lose"], ["find"]):
            self.is_lost = word[0] == "lose"
            if not self.is_lost:
                self.north += 40.0
        elif word[:1] == ["reboot"]:
            self.reboot()
        elif word[:1] == ["quit"]:
            sys.exit(0)

    def reboot(self):
        self.off_until = time.monotonic() + 2.0
        self.began = self.off_until
        self.mode, self.armed, self.target, self.heard_beat = MANUAL, False, None, None
        self.north = self.east = 0.0
        self.intervals, self.last_sent = {}, {}

    def tell(self):
        state = dict(self.seen, mode=self.mode, armed=self.armed, north=self.true_north, east=self.true_east,
                     down=self.down, target=self.target)
        print(json.dumps(state), flush=True)

    def run(self):
        last = told = time.monotonic()
        while True:
            readable, _, _ = select.select([sys.stdin], [], [], 0.02)
            if readable:
                line = sys.stdin.readline()
                if not line:
                    return
                self.obey(line)
            self.hear()
            now = time.monotonic()
            self.move(max(now - last, 1e-3))
            last = now
            self.speak()
            if now - told >= 0.1:
                told = now
                self.tell()


if __name__ == "__main__":
    Sub(int(sys.argv[1]), float(sys.argv[2]) if len(sys.argv) > 2 else 1.0).run()

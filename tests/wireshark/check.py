#!/usr/bin/env python3
"""Checks docs/wireshark/scenecast.lua with tshark against the frames and parts of protocol/vectors, then with random bytes.

Needs Python 3 and tshark. Exits 0 if everything is as expected, else 1.
"""
import json
import os
import random
import re
import struct
import subprocess
import sys
import tempfile

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')
DISSECTOR = os.path.join(ROOT, 'docs', 'wireshark', 'scenecast.lua')
VECTORS = os.path.join(ROOT, 'protocol', 'vectors')
SEED, RANDOM_FRAMES = 1, 2000

# What each sound frame says; a field without a value must be absent.
SURFACE_HELLO = {'from': '0', 'to': '1', 'session': '0xbeef', 'flag.hello': '1', 'remaining': '0', 'turn': '48',
                 'unread': ['000001', '00c350ffff'], 'chunk.extended': '0', 'intro.edge': '2500',
                 'intro.series': '0a0b0c0d0e0f', 'intro.clock': '498000'}
VEHICLE_HELLO = {'from': '1', 'to': '0', 'session': '0x1234', 'flag.hello': '1', 'remaining': '0', 'turn': None,
                 'chunk.extended': '0', 'intro.edge': '2500', 'intro.clock': '498000'}
HOLD = {'flag.up': '0', 'vehicle': '1', 'base': '1', 'number': '1', 'remaining': '5', 'turn': '48', 'stamp.clock': '55000',
        'stamp.one_way': '667'}
HOLD_SLOT = {'chunk.kind': '3', 'chunk.length': '4', 'slot.number': '1', 'slot.version': '1', 'payload': '80'}
ANSWER = {'flag.up': '1', 'flag.remaining': '0', 'vehicle': '1', 'base': '1', 'number': '1', 'remaining': None, 'turn': '4',
          'stamp.clock': '7200', 'stamp.heard': '2', 'stamp.held': '200', 'ack.horizon': '2', 'ack.lost': None}
STATUS = {'chunk.kind': ['5', '2'], 'report.slot': '1', 'report.version': '1', 'report.decision': '1', 'pose.mode': '1',
          'pose.reason': '1', 'pose.x': '1.5', 'pose.y': '-0.1', 'pose.depth': '18', 'pose.explored': '4000'}
CALL = {'from': '0', 'to': '15', 'session': '0xc0de', 'remaining': '0', 'turn': '8', 'chunk.kind': None}
HERE = {'from': '1', 'to': '0', 'session': '0xc0de', 'remaining': '0', 'turn': None, 'chunk.kind': None}
RIGHT, TAG = {'seal.status': 'CRC right', 'flag.keyed': '0'}, {'seal.status': 'tag cannot be checked', 'flag.keyed': '1'}
EXPECTED = {
    'hello of the surface': SURFACE_HELLO | RIGHT,
    'hello of the vehicle': VEHICLE_HELLO | RIGHT,
    'first numbered frame of the surface': HOLD | HOLD_SLOT | RIGHT | {'number.full': '1'},
    'grant with an ack statement': RIGHT | {
        'flag.up': '0', 'base': '2', 'number': '3', 'number.full': '3', 'remaining': None, 'turn': '48', 'stamp.one_way': '667',
        'ack.horizon': '3', 'ack.lost': '2', 'chunk.kind': None},
    'answer of the vehicle': ANSWER | STATUS | RIGHT,
    'map frame in the middle of a turn': RIGHT | {
        'flag.up': '1', 'base': '2', 'number': '2', 'remaining': '1', 'turn': None, 'chunk.kind': '1', 'map.codec': '0',
        'map.stride': '0', 'map.x': '-1', 'map.y': '2', 'map.width': '2', 'map.height': '1', 'padding': '00' * 29},
    'frame without content': RIGHT | {'flag.up': '1', 'base': '1', 'number': '3', 'turn': '20', 'chunk.kind': None},
    'frame with a base of two bytes': RIGHT | {
        'flag.up': '1', 'base': '200', 'number': '300', 'number.full': '300', 'turn': None, 'chunk.kind': None},
    'call': CALL | RIGHT,
    'here': HERE | RIGHT,
    'keyed hello of the surface': SURFACE_HELLO | TAG | {'nonce': '0102030405060708'},
    'keyed hello of the vehicle': VEHICLE_HELLO | TAG | {'nonce': '1112131415161718'},
    'keyed numbered frame of the surface': HOLD | HOLD_SLOT | TAG,
    'keyed numbered frame of the vehicle': ANSWER | STATUS | TAG,
    'encrypted numbered frame of the surface': HOLD | TAG | {'ciphertext': 'a173501a0e', 'chunk.kind': None},
    'encrypted numbered frame of the vehicle': ANSWER | TAG | {'chunk.kind': None},
    'keyed call': CALL | TAG | {'nonce': '2122232425262728'},
    'keyed here': HERE | TAG | {'nonce': '2122232425262728'},
}


def vectors(name):
    with open(os.path.join(VECTORS, name), encoding='utf-8') as file:
        return json.load(file)


def frames():
    """Name and bytes of each frame, in the order of frames.json."""
    return {vector['name']: bytes.fromhex(vector['bytes']) for vector in vectors('frames.json')['frames']}


def capture_of(folder, chosen):
    """A capture of these frames, of the link type User 0."""
    capture = os.path.join(folder, 'frames.pcap')
    # Not by text2pcap, which writes no packet without bytes.
    with open(capture, 'wb') as out:
        out.write(struct.pack('<IHHiIII', 0xA1B2C3D4, 2, 4, 0, 0, 65535, 147))
        for second, raw in enumerate(chosen):
            out.write(struct.pack('<IIII', second, 0, len(raw), len(raw)) + raw)
    return capture


def tshark(folder, capture, *options):
    """What tshark prints about a capture."""
    # An empty home: preferences and plugins of the user must not decide.
    done = subprocess.run(['tshark', '-X', 'lua_script:' + DISSECTOR, '-o', 'scenecast.mission:0x5CE70001', '-r', capture, *options],
                          env=dict(os.environ, HOME=folder), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=True)
    return done.stdout.decode('utf-8', 'replace')


def fields(folder, capture, *options):
    """Of each frame the fields of scenecast: name and list of the values."""
    names = sorted({name for expected in EXPECTED.values() for name in expected} | {row[4] for row in ROWS})
    options = ['-T', 'json', *options, '-e', '_ws.expert.message']
    for name in names:
        options += ['-e', 'scenecast.' + name]
    printed = tshark(folder, capture, *options)
    layers = [packet['_source']['layers'] for packet in json.loads(printed[printed.index('[\n'):])]
    return [{name.replace('scenecast.', '', 1): values for name, values in one.items()} for one in layers]


def differences(name, found):
    """Lines about each field that is not as expected."""
    wanted = EXPECTED[name] | {'_ws.expert.message': None}
    for key, value in wanted.items():
        value = [] if value is None else value if isinstance(value, list) else [value]
        have = [each.lower().replace(':', '') if key in ('unread', 'nonce', 'padding', 'intro.series') else each
                for each in found.get(key, [])]
        if have != value:
            yield f'{name}: {key} is {have}, not {value}'


def check_frames(folder):
    named = frames()
    sound = [name for name in named if not name.startswith('refused: ')]
    problems = [f'no expectation for the frame: {name}' for name in sound if name not in EXPECTED]
    problems += [f'no frame in frames.json: {name}' for name in EXPECTED.keys() - named.keys()]
    for encrypted in 'FALSE', 'TRUE':
        found = fields(folder, os.path.join(VECTORS, 'frames.pcap'), '-o', 'scenecast.encrypted:' + encrypted)
        if len(found) != len(named):
            problems.append(f'frames.pcap has {len(found)} of {len(named)} frames')
        for (name, raw), one in zip(named.items(), found):
            if name in EXPECTED and name.startswith('encrypted') == (encrypted == 'TRUE'):
                problems += differences(name, one)
            # The dissector has no key: it cannot refuse a frame for its tag.
            if name not in sound and not one.get('_ws.expert.message') and not raw[0] & 1:
                problems.append(f'{name}: nothing shows it')
    return problems


def check_sequence(folder):
    arrived = [vector for vector in vectors('sequence.json')['frames'] if not vector['lost']]
    mission = 'scenecast.mission:0x' + vectors('sequence.json')['mission']
    found = fields(folder, os.path.join(VECTORS, 'sequence.pcap'), '-o', mission)
    if len(found) != len(arrived):
        yield f'sequence.pcap has {len(found)} of {len(arrived)} frames'
    for number, one in enumerate(found, 1):
        if one.get('seal.status') != ['CRC right'] or one.get('_ws.expert.message'):
            yield f'sequence.pcap, frame {number}: {one.get("seal.status")}, {one.get("_ws.expert.message")}'


# The rows of parts.json that are the payload of a chunk, then the map chunks: how the name begins, whether the vehicle sends it,
# the bytes before the payload, a field, and its values over these rows.
ROWS = [
    (('pose: ', 'the same with a waypoint', 'the same with a path', 'the same with an empty', 'the first pose'), True, 0x40, '',
     'path.count', [None, None, '2', '0', None]),
    (('details: ',), True, 0xE0, '03', 'trail.count', [None] * 6 + ['2', '2']),
    (('report: ', 'the same with a summary', 'the same report'), True, 0xA0, '', 'report.budget', ['10000'] * 4),
    (('layer chunk: ', 'the same in two', 'the second'), True, 0xC0, '', 'layer.index', ['1', '0', '0', '0', '2', '1']),
    (('part of the name', ), True, 0xE0, '04', 'label', ['3', '254']),
    (('part of the tree',), True, 0xE0, '05', 'part.first', ['0']),
    (('part of a content',), True, 0xE0, '01', 'part.first', ['300']),
    (('inquiry',), False, 0xE0, '02', 'inquiry.digest', ['0xabcd']),
    (('slot: ',), False, 0x60, '', 'slot.number', list('01168974523332222')),
    (('map: ',), True, 0x20, '', 'map.x', ['2', '0', '0', '0', '4', '0', '0', '0', '-40000', '9', '-1', '2', '0', '0']),
]


def rows():
    """Name, bytes in a numbered frame, field and its value for each row of ROWS; the CRC of the frame is 0."""
    table = [(row['name'], row['bytes']) for row in vectors('parts.json')]
    table += [('map: ' + row['name'], row['chunk']) for name in ('context.json', 'png.json') for row in vectors(name)['chunks']]
    for begins, up, kind, before, field, values in ROWS:
        found = [(name, bytes.fromhex(before + code)) for name, code in table if name.startswith(begins)]
        assert len(found) == len(values), (begins, len(found))
        for (name, payload), value in zip(found, values):
            more = len(payload) - 27
            length = bytes([kind | len(payload)]) if more < 0 else bytes([kind | 27 + (more >> 8), more & 255])
            yield name, bytes([0x80, 0x81 if up else 1, 1, 1]) + length + payload + bytes(4), field, value


def check_rows(folder):
    found = list(rows())
    got = fields(folder, capture_of(folder, [raw for _, raw, _, _ in found]))
    for (name, _, field, value), one in zip(found, got):
        have = one.get(field, [None])[0]
        if have != value or one.get('_ws.expert.message'):
            yield f'{name}: {field} is {have}, not {value}, {one.get("_ws.expert.message")}'


def check_seals(folder):
    """What is no vector: a number far ahead, a damaged frame, a run that was not heard, `down` with a key."""
    named = frames()
    grant = named['grant with an ack statement']
    broken = grant[:5] + bytes([grant[5] ^ 1]) + grant[6:]
    far = bytes.fromhex('80 01 7F 2C')
    far += (crc32c(bytes.fromhex('5CE70001 1234 BEEF 012C') + far)).to_bytes(4, 'big')
    hellos, keyed = [[named[key + 'hello of the ' + end] for end in ('surface', 'vehicle')] for key in ('', 'keyed ')]
    answer = named['answer of the vehicle']
    for what, sequence, wanted in (
            ('a frame without hellos', [grant], 'CRC cannot be checked'),
            ('a frame without a hello of the surface', [hellos[1], grant], 'CRC cannot be checked'),
            ('a damaged frame', [*hellos, broken], 'CRC wrong'),
            ('a number far ahead', [*hellos, far], 'CRC right'),
            ('a frame of `down`', [*keyed, answer], 'CRC right')):
        have = fields(folder, capture_of(folder, sequence))[-1].get('seal.status', ['no seal'])[0]
        if have != wanted:
            yield f'{what}: {have}, not {wanted}'


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def damaged(rng, shipped):
    """Random bytes, a true head with random bytes after it, a true frame with a cut end or with changed bytes."""
    raw = bytearray(rng.choice(shipped))
    noise = rng.randbytes(rng.randrange(201))
    way = rng.randrange(4)
    if way == 0:
        return noise
    if way == 1:
        return bytes(raw[:rng.randrange(len(raw) + 1)]) + noise
    if way == 2:
        return bytes(raw[:rng.randrange(len(raw) + 1)])
    for _ in range(rng.randrange(1, 6)):
        raw[rng.randrange(len(raw))] = rng.randrange(256)
    return bytes(raw)


def check_random(folder):
    rng, shipped = random.Random(SEED), list(frames().values())
    noise = shipped + [damaged(rng, shipped) for _ in range(RANDOM_FRAMES)]
    printed = tshark(folder, capture_of(folder, noise), '-V', '-2')
    count = len(re.findall(r'^Frame \d+: ', printed, re.M))
    problems = sorted({line.strip() for line in printed.split('\n') if 'lua error' in line.lower() or 'lua:' in line.lower()})
    if count != len(noise):
        problems.append(f'tshark printed {count} of {len(noise)} random frames')
    if len(re.findall('^scenecast acoustic link', printed, re.M)) != sum(raw != b'' for raw in noise):
        problems.append('the dissector did not run on each random frame')
    return problems


def main():
    with tempfile.TemporaryDirectory() as folder:
        problems = [*check_frames(folder), *check_sequence(folder), *check_rows(folder), *check_seals(folder), *check_random(folder)]
    for line in problems:
        print(line, file=sys.stderr)
    print(f'wireshark: {len(frames())} frames, a sequence, {len(list(rows()))} parts, {RANDOM_FRAMES} random frames, {len(problems)} problems')
    return 1 if problems else 0


if __name__ == '__main__':
    sys.exit(main())

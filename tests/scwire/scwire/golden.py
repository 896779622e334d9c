"""protocol/vectors, and the examples that WIRE.md itself has, against this package."""
import argparse
import io
import json
import os
import pathlib
import re
from . import cobs, context, frame, keys, mapchunk, objects, status
from .bits import Short
from .passive import Follower
from .replica import Window, fold, term
from .surface import Pair

VECTORS = pathlib.Path(os.environ.get('VECTORS') or pathlib.Path(__file__).parents[3] / 'protocol' / 'vectors')
hx = bytes.fromhex
KINDS = {1: 'Map', 2: 'Pose', 3: 'Slot', 4: 'Object', 5: 'Report', 6: 'Layer'}
EXTENDED = {0: 'Introduction', 1: 'InForce', 2: 'Inquiry', 3: 'Details', 4: 'LabelClass', 5: 'LabelTree', 6: 'Caller', 7: 'NextKey'}


def read(name):
    return json.loads((VECTORS / name).read_text())


def main():
    doc = open(os.environ['WIRE_MD']).read()
    assert cobs.encode(hx('110022')) == hx('2B293A29092B')
    for n in (0, 1, 253, 254, 255, 508, 509, 700):
        for f in (bytes(n) + b'\1', b'\1' * n + b'\2', os.urandom(n + 1)):
            assert cobs.decode(cobs.encode(f)[1:-1], 5000) == f
    numbers()
    turns()
    statements()
    parts({row['name']: hx(row['bytes']) for row in read('parts.json')})
    golden_keys(doc)
    frames(read('frames.json'))
    maps('context.json', doc)
    maps('png.json', doc)
    sequence(read('sequence.json'))
    for o in read('objects.json')['objects']:
        finish(o)


def numbers():
    """The end of 11; 2.1 and 2.2: each form of base and remaining, both lengths of a number, a highest number that is too high."""
    assert frame.nearest(3, 250, 8) == 259 and frame.nearest(250, 259, 8) == 250
    assert frame.nearest(3, 65530) == 65539 and frame.nearest(65530, 65540) == 65530
    for number, base, highest, remaining, n in (300, 3, 299, 6, 7), (300, 4, 299, 7, 9), (300, 127, 173, 0, 8), (300, 127, 2300, 255, 9), (
            300, 128, 2300, 6, 10), (70000, 2048, 68000, 7, 11):
        raw = frame.write(1, 0, 7, number, base, remaining, mission=5, peer=9)
        f = frame.parse(raw)
        assert (f.base, f.src, f.dst, f.remaining, len(raw)) == (base, 1, 0, remaining, n)
        assert frame.number_in(f, 5, 9, 7, highest) == number


def turns():
    """2.1: the turn byte of a vehicle; a wish."""
    def read(turn, ack=None):
        f = frame.parse(frame.write(1, 0, 7, 1, 1, 0, turn=turn, ack=ack, mission=5, peer=9))
        return f.turn, f.ack
    assert [read(0x1F), read(0xC4), read(0x80), read(5, b'\x60')] == [(31, None), (4, (2, 2, [])), (0, (2, 0, [])), (5, (4, 12, []))]
    for turn, ack in (0xC4, b'\x60'), (0x24, None), (0x60, b'\x60'):
        try:
            assert not read(turn, ack), turn
        except Short as e:
            assert str(e) == 'malformed'
    assert [frame.quarters(w) for w in (0, 7, 8, 11, 12, 20, 31)] == [0, 7, 8, 14, 16, 64, 448]


def statements():
    """3.3: near where it may be; 3.4: one that is not far in the order of the frames alone."""
    def window(base, closed, lost, highest=20):
        w = Window()
        w.base, w.closed, w.highest, w.held = base, closed, highest, {*range(base + 1, highest + 1)} - {*lost}
        return len(w.statement(9))
    assert [window(5, 5, ()), window(4, 4, ()), window(5, 20, (17, 18, 19)), window(5, 20, (16,)), window(5, 21, ()), window(5, 5, (20,))] == [
        1, 2, 1, 3, 2, 3]
    pair = Pair(argparse.Namespace(key=None), 1, b'')
    pair.number = 40
    for number, ack, why, n in ((2, (4, 3, [1]), 'late', 0), (2, (4, 3, [1]), 'ok', 3), (1, (4, 9, []), 'ok', 0), (2, (4, 3, [1]), 'duplicate', 0),
                                (1, (12, 5, []), 'late', 2), (3, (12, 30, []), 'ok', 25), (4, (4, 14, []), 'ok', 0), (5, (2, 0, []), 'late', 0),
                                (6, (2, 0, []), 'ok', 2), (5, (2, 3, []), 'ok', 0), (7, (2, 0, []), 'ok', 0)):
        assert len(pair.judge(argparse.Namespace(number=number, ack=ack), why)) == n, number
    assert pair.horizon == 32


def parts(rows):
    """Bases, stamps, statements, heads of chunks, reports, details and parts of texts."""
    named = lambda begin: {name: raw for name, raw in rows.items() if name.startswith(begin)}
    assert named('base ') == {f'base {b}': frame.write_base(b) for b in (4, 127, 128, 2048)}
    assert [stamp(raw) for raw in named('stamp ').values()] == [
        {'clock_ms': 66051, 'one_way_ms': 667}, {'clock_ms': 1, 'one_way_ms': None},
        {'clock_ms': 16777215, 'last_received': 9, 'held_ms': 258}]
    says = [(4, 0xC, []), (4, 7, [1, 3]), (12, 0xABC, []), (12, 7, [1, 4]), (12, 30, [20, 25])]
    assert list(named('statement: ').values()) == [frame.statement(*each) for each in says]
    assert [frame.read_statement(io.BytesIO(raw).read) for raw in named('statement: ').values()] == says
    heads = named('head of a map chunk')
    assert frame.chunks(heads.pop('head of a map chunk that fills the rest of a full frame') + bytes(99)) == [(1, bytes(99))]
    assert heads == {f'head of a map chunk of {n} bytes': frame.chunk(1, bytes(n))[:-n] for n in (26, 27, 300)}
    poses = [status.pose(raw).get('path') for name, raw in rows.items() if ' pose' in name or 'pose: ' in name or 'with a path' in name]
    assert poses == [None, [(2.4, -3.4), (-0.6, -3.4)], None], poses
    reports = [status.report(raw) for raw in rows.values() if raw[:4] == hx('0109BEEF')]
    assert [('summary' in r, 'placement' in r, 'disk' in r) for r in reports] == [
        (False, False, False), (True, False, False), (False, True, False), (False, False, True)]
    details = {name: status.details(raw) for name, raw in named('details: ').items()}
    assert all(details.values()) and details['details: more of label 5'] == {'intent': (2, 5)}, details
    assert details['details: a trail to (1, -2) m: 9 s ago at (2.4, -3.4), 12 s ago at (-0.6, -3.4)']['trail'] == [
        (9, 1.4, -1.4), (12, -1.6, -1.4)]
    assert set(details['details: these faults, more of label 5, this registration and this trail']) == {
        'faults', 'intent', 'registration', 'trail'}
    texts = [(name, raw[0 if 'tree' in name else 1:]) for name, raw in named(('part of the ', 'part of a ', 'layer chunk: ')).items()
             if 'digest of confidence' not in name]
    for name, raw in texts:
        digest, last, first, text = status.part(raw)
        assert not last or first or digest == status.text_digest(text), name
    first, second = (status.part(rows[name][1:])[3] for name in ('the same in two chunks, the first', 'the second'))
    assert status.descriptor(first + second)['name'] == 'depth'
    print(len(reports), 'reports,', len(details), 'details and', len(texts), 'parts of texts of', len(rows), 'parts')


def stamp(raw):
    """2.4"""
    clock, rest = int.from_bytes(raw[:3], 'big'), int.from_bytes(raw[-2:], 'big')
    if len(raw) == 5:
        return {'clock_ms': clock, 'one_way_ms': None if rest == 0xFFFF else rest}
    return {'clock_ms': clock, 'last_received': raw[3], 'held_ms': rest}


def golden_keys(doc):
    """12.1, keys.json and the rows of 12.6."""
    M = bytes(range(16))
    assert keys.prf(M, M, b'').hex() == '4427d64b8e1e1451fc445960f0839bb0'
    k = keys.vehicle_key(M, 1)
    H, s, v = keys.hello_key(k), hx('0102030405060708'), hx('1112131415161718')
    plain, secret = (keys.Session(k, 0x5CE70001, 1, s, v, e) for e in (False, True))
    h, b = b'head', b'body of a frame'
    sealed = secret.seal(0, 5, h, b)
    values = {
        'fingerprint': keys.fingerprint(M),
        'line of the key file, as ASCII': f'scenecast-key 2 {M.hex()} {keys.fingerprint(M).hex()}'.encode(),
        'line of the key file of vehicle 1, as ASCII': keys.vehicle_line(M, 1).encode(),
        'hello tag of the parts "hello", "" and 0102': keys.prf(H, bytes(16), keys.join(b'hello', b'', hx('0102')))[:8],
        'tag, e = 0, down': plain.seal(0, 5, h, b)[-8:],
        'tag, e = 0, up': plain.seal(1, 5, h, b)[-8:],
        'ciphertext, e = 1, down': sealed[len(h):-8],
        'tag, e = 1, down': sealed[-8:],
        'part 0 of the offer of a next key, M = sixteen bytes 5A': keys.offer(k, b'Z' * 16, 1, 0),
        'part 1 of it': keys.offer(k, b'Z' * 16, 1, 1),
        'K of vehicle 1': k, 'C': keys.call_key(M), 'H': H, 'JOIN("hello", "", `0102`)': keys.join(b'hello', b'', hx('0102')), 'R': keys.root(k),
        'session key, e = 0': plain.key, 'session key, e = 1': secret.key,
        'frame nonce, down': keys.frame_nonce(0, 5), 'frame nonce, up': keys.frame_nonce(1, 5),
        'JOIN(head, body)': keys.join(h, b)}
    table = re.findall(r'^\| ([^|]+) \| `([0-9a-f]+)` \|$', doc.split('### 12.6')[1].split('## 13')[0], re.M)
    wanted = {row['name']: row['bytes'] for row in read('keys.json')} | dict(table)
    assert wanted == {name: value.hex() for name, value in values.items()}
    print(len(wanted), 'keys and tags')


def upward(raw):
    """Whether a frame is from a vehicle."""
    return raw[1] >> 4 != 0 if raw[0] & 4 else raw[1] >> 7 == 1


def well_formed(f):
    """2.5, 11: whether no chunk ends after the frame."""
    try:
        return frame.chunks(f.body) is not None
    except Short:
        return False


def frames(vectors):
    """Each frame verified by a follower without a key, with one, or with one and encryption; read; and written again."""
    mission, M = int(vectors['mission'], 16), hx(vectors['key'])
    k, calls = keys.vehicle_key(M, 1), keys.call_key(M)
    followers = [Follower(mission), *(Follower(mission, k, e, calls=calls) for e in (False, True))]
    for vector in vectors['frames']:
        name, raw = vector['name'], hx(vector['bytes'])
        heard = [(fo, f) for fo in followers if (f := fo.take(upward(raw), raw)) and well_formed(f)]
        assert bool(heard) == (vector['says'] is not None) != name.startswith('refused: '), name
        for fo, f in heard:
            assert content(f) == vector['says'], (name, content(f))
            up = f.src != 0
            seal = {'session': f.session, 'peer': f.peer, 'peer_nonce': fo.nonces[f.peer], 'key': fo.hello_key(f)} if f.H else {
                'session': f.peer[up], 'peer': f.peer[not up], 'key': fo.crypts.get(f.peer)}
            short = f.ack and f.ack[0] == 2
            turn = 0x80 | f.ack[1] << 5 | f.turn if short else f.turn
            chunks = b''.join(frame.chunk(*each) for each in frame.chunks(f.body))
            again = frame.write(f.src, f.dst, number=f.number, base=f.base, remaining=f.remaining, turn=turn, stamp=f.stamp, hello=bool(f.H),
                                ack=frame.statement(*f.ack) if f.ack and not short else None, body=chunks.ljust(len(f.body), b'\0'), nonce=f.nonce,
                                mission=mission, **seal)
            assert again == raw, (name, again.hex())
    print(len(vectors['frames']), 'frames,', sum(v['says'] is None for v in vectors['frames']), 'of them refused')


def content(f):
    """What the vectors say about a frame: of a hello number 0 and base 1, of an extended chunk the bytes after its kind."""
    says = {'from': f.src, 'to': f.dst, 'number': f.number, 'base': 1 if f.H else f.base, 'remaining': f.remaining,
            'session': f'{f.session:04x}' if f.H else None, 'turn': f.turn, 'stamp': stamp(f.stamp) if f.stamp else None,
            'nonce': f.nonce.hex() if f.H and f.K else None, 'ack': dict(zip(('horizon_bits', 'horizon_low', 'lost'), f.ack)) if f.ack else None,
            'chunks': [{'kind': EXTENDED[p[0]] if k == 7 else KINDS[k], 'payload': p[k == 7:].hex()} for k, p in frame.chunks(f.body)]}
    return {name: value for name, value in says.items() if value is not None}


def grid(vector):
    """The cells with a label."""
    return {(vector['x'] + i, vector['y'] + j): int(label)
            for j, row in enumerate(vector['rows']) for i, label in enumerate(row.split()) if label != '0'}


def maps(name, doc):
    """Each chunk; each decision of the first one, and the end of its code string (A.6)."""
    vectors, keyed_with = read(name), set()
    for i, vector in enumerate(vectors['chunks']):
        base, (trace, coders) = grid(vector['base']), watch()
        got = mapchunk.decode(hx(vector['chunk']), base)
        assert {c: v for c, v in {**base, **got[3]}.items() if v} == grid(vector['result']), vector['name']
        keyed_with |= {key for d in trace for key, _ in d['keyed']}
        if i == 0 and vectors['trace']:
            at, (x, y, w, _) = -1, got[2]
            for d in trace:
                at += d['kind'] in ('calm', 'flip', 'unseen')
                d['cell'] = [x + at % w, y + at // w]
            assert trace == vectors['trace']
            c, = coders
            end = re.search(r'low = (\w+), range = (\w+), above =\s+(\w+), and (\d+) bits', doc).groups()
            assert end == (*(f'{v:08X}' for v in (c.low, c.range, c.above)), str(c.shifted))
    assert name != 'context.json' or 0xFFFFFFFF in keyed_with
    print(len(vectors['chunks']), 'chunks and', len(vectors['trace']), 'decisions of', name)


decide, decision, end = context.Stage.decide, context.Coder.decision, context.Coder.end


def watch():
    """The decisions of the next chunk, and its coder."""
    trace, coders = [], []

    def stage(self, coder, direct, keyed, sets, curve):
        trace.append({'kind': self.name, 'direct': list(direct), 'keyed': [list(k) for k in keyed], 'sets': list(sets), 'curve': curve})
        return decide(self, coder, direct, keyed, sets, curve)

    def plain(self, one):
        if not trace or 'yes' in trace[-1]:
            kind = {4096: 'cleared', 32768: 'bit'}.get(one, 'group')
            trace.append({'kind': kind, 'direct': [], 'keyed': [], 'sets': [], 'curve': 0})
        yes = decision(self, one)
        trace[-1] |= {'one': one, 'yes': yes}
        return yes
    context.Stage.decide, context.Coder.decision, context.Coder.end = stage, plain, lambda c: (coders.append(c), end(c))
    return trace, coders


def sequence(vectors):
    """The map of a passive receiver after each frame that arrives."""
    fo, digests = Follower(int(vectors['mission'], 16)), 0
    for i, vector in enumerate(vectors['frames']):
        raw = hx(vector['bytes'])
        if vector['lost']:
            continue
        f = fo.take(upward(raw), raw)
        assert f, i
        got = None
        if f.src and not f.H:
            m, shown = fo.replica.map, 0
            for cell, label in m.shown.items():
                shown ^= term(cell, label)
            got = [fold(m.hash), fold(shown)]
            digests += 1
        assert got == vector.get('digests'), (i, f.result, got)
    assert fo.replica.map.shown == grid(vectors['map']) and not fo.replica.diverged
    print(len(vectors['frames']), 'frames of a sequence,', digests, 'digests')


def finish(vector):
    """An object is whole with the parts that say so, not earlier."""
    got = objects.Objects()
    for part in vector['parts']:
        before = len(got.finished)
        if not part['lost']:
            got.part(hx(part['payload']))
        assert (len(got.finished) > before) == part['whole'], vector['name']
    assert [raw for _, raw in got.finished] == [hx(vector['bytes'])], vector['name']
    print('object', vector['name'] + ':', len(vector['parts']), 'parts,', 'repaired' if got.repaired else 'as it was sent')


if __name__ == '__main__':
    main()

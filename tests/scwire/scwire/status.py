"""Sections 5.1, 6.7, 6.8, 7, 8.7: everything that a vehicle sends beside labels and objects."""
from .bits import Bits, Short
from .crc import crc16

MODES = ['survey', 'hold', 'return', 'surface', 'abort', 'done']
REASONS = ['the survey', 'order', 'fence', 'distance', 'time', 'silence', 'depth or altitude', 'no path']
SLOTS = ['utility', 'constraints', 'settings', 'budget', 'requests', 'fix', 'limits', 'fence', 'destination', 'areas']
CODES = {1: 'applied', 2: 'unreadable', 3: 'other epoch', 4: 'no such label', 5: 'out of range', 6: 'contradiction',
         7: 'too late', 8: 'outside', 9: 'not able', 10: 'disk', 11: 'lost record', 12: 'old series', 15: 'received'}


def pose(d):
    if len(d) < 15:
        raise Short('pose length')
    b = Bits(d)
    o = {}
    m = b.u(3)
    if m > 5:
        raise Short('mode')
    o['mode'], way, o['autopilot_silent'], o['reason'] = MODES[m], b.u(1), b.u(1), REASONS[b.u(3)]
    o['x'], o['y'], o['depth'] = b.s(24) / 10, b.s(24) / 10, b.u(16) / 10
    o['heading'], o['sigma'], o['fix_age'], o['cells'] = b.u(8) * 360 / 256, b.u(8) / 4, b.u(8), b.u(24)
    if not way:
        if len(d) != 15:
            raise Short('pose length')
        return o
    x, y = b.s(24), b.s(24)
    o['waypoint'], o['path'] = (x / 10, y / 10), []
    if len(d) > 21:
        o['continues'], n = b.u(1), b.u(3)
        if n:
            w = b.u(5)
            if not 1 <= w <= 25:
                raise Short('path bits')
            need = 0
            for _ in range(n):
                dx, dy = b.s(w), b.s(w)
                if dx == dy == 0:
                    raise Short('no leg')
                need = max(need, width(dx), width(dy))
                x, y = x + dx, y + dy
                o['path'].append((x / 10, y / 10))
            if need != w:
                raise Short('path bits')
        elif not o['continues']:
            raise Short('empty path')
        b.zeros()
    return o


def width(v):
    return (v if v >= 0 else ~v).bit_length() + 1


def part(d):
    """5.2: (digest, whether it is the last, place, bytes)."""
    if len(d) < 4:
        raise Short('part')
    digest, last, wide, first, p = int.from_bytes(d[:2], 'big'), d[2] >> 7, d[2] >> 6 & 1, d[2] & 63, d[3:]
    if wide:
        first, p = first << 8 | p[0], p[1:]
    if not p or wide != (first > 63):
        raise Short('part')
    return digest, last, first, p


def text_digest(d):
    return crc16(d) or 1


def trail(d):
    b = Bits(d)
    n, w = b.u(4), b.u(4) + 1
    if n == 0:
        raise Short('trail')
    x = y = age = need = 0
    out = []
    for _ in range(n):
        a, dx, dy = b.u(8), b.s(w), b.s(w)
        if a < age or dx == dy == 0:
            raise Short('trail')
        age, x, y, need = a, x + dx, y + dy, max(need, width(dx), width(dy))
        out.append((age, x / 10, y / 10))
    b.zeros()
    if need != w:
        raise Short('trail bits')
    return out


def report(d):
    if len(d) < 11:
        raise Short('report length')
    b = Bits(d)
    o = {'epoch': b.u(8), 'labels': b.u(8), 'digest': b.u(16)}
    v, s = b.u(12), b.u(4)
    o['budget'] = v << s
    o['unauthenticated'] = b.u(8)
    v, s = b.u(4), b.u(4)
    o['backlog'] = v << s
    v, s = b.u(4), b.u(4)
    o['backlog_other'] = v << s
    has = [i for i in range(10) if b.u(1)]
    if b.u(3):
        raise Short('report reserved')
    summary, placement, disk = b.u(1), b.u(1), b.u(1)
    versions = [b.u(8) for _ in has]
    o['slots'] = {SLOTS[i]: (ver, CODES.get(b.u(4), 'bad')) for i, ver in zip(has, versions)}
    if len(has) % 2 and b.u(4) or any(c == 'bad' for _, c in o['slots'].values()):
        raise Short('report code')
    if (b.n - b.p) // 8 != 3 * summary + 7 * placement + disk:
        raise Short('report length')
    if summary:
        o['in_force'] = [n for n in ('utility', 'settings', 'budget', 'limits', 'fence', 'destination', 'areas') if b.u(1)]
        if b.u(1):
            raise Short('report reserved')
        o['summary'] = b.u(16)
    if placement:
        o['placement'] = (b.u(8), b.s(24) / 10, b.s(24) / 10)
        if o['placement'][0] == 0:
            raise Short('placement')
    if disk:
        if b.u(1):
            raise Short('report reserved')
        o['disk'] = (b.u(1), b.u(1), b.u(5))
    return o


def details(d):
    """7: faults, intent, registration, trail; None if they make no sense."""
    if not d or not d[0]:
        return None
    o, p = {}, d[1:]
    try:
        if d[0] & 0x80:
            o['faults'], p = p[0], p[1:]
        if d[0] & 0x40:
            n = 2 if p[0] in (2, 4, 5) else 1
            o['intent'], p = tuple(p[:n]), p[n:]
            if len(o['intent']) != n or o['intent'][0] > 5 or n == 2 and not 1 <= o['intent'][1] <= (4 if o['intent'][0] == 4 else 254):
                return None
        if d[0] & 0x20:
            if len(p) < 4:
                return None
            o['registration'], p = (p[0] >> 6, p[0] & 63, p[1] * 2, int.from_bytes(p[2:4], 'big')), p[4:]
        if d[0] & 0x10:
            n = (8 + (p[0] >> 4) * (8 + 2 * ((p[0] & 15) + 1)) + 7) // 8
            if len(p) < n:
                return None
            o['trail'], p = trail(p[:n]), p[n:]
    except (IndexError, Short):
        return None
    return None if o.get('faults') == 0 or p and not d[0] & 15 else o


def extended(d):
    """(name, value) of a chunk of kind 7 that a vehicle sends."""
    if not d:
        return 'empty', None
    k, p = d[0], d[1:]
    if k == 0:
        if len(p) < 14 or len(p) < 14 + min(p[13], 12):
            raise Short('introduction')
        return 'introduction', {'edge': int.from_bytes(p[:3], 'big') / 10000, 'series': p[3:9].hex(), 'hours': int.from_bytes(p[10:13], 'big')}
    if k == 1:
        if not p or p[0] not in (0, 2, 3, 6, 7, 8, 9):
            raise Short('content')
        return 'content', (p[0], *part(p[1:]))
    if k == 3:
        return 'details', details(p)
    if k == 4:
        if not p or not 1 <= p[0] <= 254:
            raise Short('name')
        return 'name', (p[0], *part(p[1:]))
    if k == 5:
        return 'tree', part(p)
    return f'unknown {k}', p.hex()


def descriptor(d):
    """6.7: a whole descriptor of a layer."""
    if len(d) < 14:
        raise Short('descriptor')
    s = lambda v: int.from_bytes(v, 'big', signed=True)
    n, u = (d[12] >> 4) + 1, d[12] & 15
    if len(d) != 13 + n + u or u > 8 or d[0] & 1 or not 1 <= d[2] <= 254 or d[3] > 100:
        raise Short('descriptor')
    return {'spread': d[0] >> 6, 'end': d[0] >> 4 & 3, 'quantity': d[0] >> 2 & 3, 'doubling': d[0] >> 1 & 1, 'palette': d[1],
            'levels': d[2], 'share': d[3], 'scale': s(d[4:7]) * 10.0 ** s(d[7:8]), 'offset': s(d[8:11]) * 10.0 ** s(d[11:12]),
            'name': d[13:13 + n].decode(), 'unit': d[13 + n:].decode(), 'digest': text_digest(d)}

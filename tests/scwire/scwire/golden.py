"""The examples of sections 11 and 12.6 and of appendix A against this package."""
import os
import re
from . import context, frame, keys, cobs, mapchunk, status
hx = lambda s: bytes.fromhex(s.replace('\n', ' '))


def main():
    assert cobs.encode(hx('11 00 22')) == hx('2B 29 3A 29 09 2B')
    for n in (0, 1, 253, 254, 255, 508, 509, 700):
        for f in (bytes(n) + b'\1', b'\1' * n + b'\2', os.urandom(n + 1)):
            assert cobs.decode(cobs.encode(f)[1:-1], 5000) == f
    assert [frame.write_base(b) for b in (127, 128, 2048)] == [hx('7f'), hx('8080'), hx('8800')]
    assert frame.statement(0xABC, []) == hx('ABC0')
    assert frame.statement(7, [1, 4]) == hx('007124') and frame.losses(hx('24')) == [1, 4]
    assert frame.losses(frame.loss_code([20, 25])) == [20, 25]
    assert frame.nearest(3, 250, 8) == 259 and frame.nearest(250, 259, 8) == 250
    assert frame.nearest(3, 65530) == 65539 and frame.nearest(65530, 65540) == 65530
    # Ascon, 12.1 and 12.6
    doc = open(os.environ['WIRE_MD']).read()
    k = bytes(range(16))
    assert keys.prf(k, k, b'').hex() == '4427d64b8e1e1451fc445960f0839bb0'
    assert keys.fingerprint(k).hex() == '95fb836d'
    M, C, k = k, keys.call_key(k), keys.vehicle_key(k, 1)
    H, HC = keys.hello_key(k), keys.hello_key(C)
    table = dict(re.findall(r'^\| ([^|]+) \| `([^`]+)` \|$', doc.split('### 12.6')[1].split('## 13')[0], re.M))
    assert table['K of vehicle 1'] == k.hex() and table['C'] == C.hex() and table['H'] == H.hex() and table['R'] == keys.root(k).hex()
    assert table['key file of vehicle 1'] == keys.vehicle_line(M, 1), keys.vehicle_line(M, 1)
    assert table['part 0 of the offer of a next key, M = sixteen bytes 5A'] == keys.offer(k, b'Z' * 16, 1, 0).hex()
    assert table['part 1 of it'] == keys.offer(k, b'Z' * 16, 1, 1).hex()
    assert keys.prf(H, bytes(16), keys.join(b'hello', b'', hx('0102')))[:8].hex() == table['hello tag of these three parts']
    m, s, v = 0x5CE70001, hx('0102030405060708'), hx('1112131415161718')
    s0, s1 = keys.Session(k, m, 1, s, v, False), keys.Session(k, m, 1, s, v, True)
    assert s0.key.hex() == table['session key, e = 0'] and s1.key.hex() == table['session key, e = 1']
    h, b = b'head', b'body of a frame'
    assert s0.seal(0, 5, h, b)[-8:].hex() == table['tag, e = 0, down'] and s0.seal(1, 5, h, b)[-8:].hex() == table['tag, e = 0, up']
    assert s1.seal(0, 5, h, b).hex() == h.hex() + table['ciphertext, e = 1, down'] + table['tag, e = 1, down']
    # 11.2: parse, check, write again
    ex = {}
    for part in re.split(r'\n\*\*', doc.split('### 11.2')[1].split('## 12 Keys')[0])[1:]:
        name = part.split('**')[0]
        code = part.split('```text\n')[1].split('```')[0]
        ex[name] = hx(' '.join(l for l in code.split('\n') if re.fullmatch(r'([0-9A-F]{2} ?)+', l.strip())))
    ok = 0
    for name, raw in ex.items():
        f = frame.parse(raw)
        peer = {'call': 0, 'here': 0xC0DE, 'keyed call': 0, 'keyed here': 0xC0DE}.get(
            name, 0 if f.H and f.src == 0 else 0x1234 if f.src == 0 else 0xBEEF)
        pn = {0: bytes(8), 0xC0DE: hx('2122232425262728'), 0xBEEF: s, 0x1234: v}[peer]
        ss = s1 if 'encrypted' in name else s0
        if not f.H:
            f.session = 0xBEEF if f.src == 0 else 0x1234
            f.number = frame.number_in(f, m, peer, f.session, 0, ss if f.K else None)
            assert f.number is not None, name
        elif f.K:
            assert keys.hello_tag(HC if name == 'keyed call' else H, m, peer, pn, f.unsealed) == f.seal, name
        else:
            assert frame.hello_crc(m, peer, f.unsealed) == f.seal, name
        cs = frame.chunks(f.body)
        w = frame.write(f.src, f.dst, f.session, f.number, f.base, f.remaining, turn=f.turn, stamp=f.stamp, hello=bool(f.H),
                        ack=frame.statement(*f.ack) if f.ack else None, body=f.body, mission=m, peer=peer, peer_nonce=pn,
                        key=(HC if name == 'keyed call' else H if f.H else ss) if f.K else None, nonce=f.nonce)
        assert w == raw, (name, w.hex(), raw.hex())
        ok += 1
        print(f'{name:40} {len(raw):3} bytes, chunks {[(k, len(p)) for k, p in cs]}')
    print(ok, 'frames of 11.2 and 11.3 verified and written again')
    parts(doc.split('### 11.1')[1].split('### 11.2')[0])
    long_numbers(m)
    appendix(doc.split('### A.6')[1])


def parts(doc):
    """11.1: reports, details and parts of texts."""
    rows = {name: hx(bytes_) for name, bytes_ in re.findall(r'^\| (.+?) \| `([0-9A-F ]+)` \|$', doc, re.M)}
    reports = [status.report(raw) for raw in rows.values() if raw[:4] == hx('0109BEEF')]
    assert [('summary' in r, 'placement' in r, 'disk' in r) for r in reports] == [
        (False, False, False), (True, False, False), (False, True, False), (False, False, True)]
    details = {name: status.details(raw) for name, raw in rows.items() if name.startswith('details: ')}
    assert all(details.values()) and details['details: more of label 5'] == {'intent': (2, 5)}, details
    assert details['details: a trail to (1, -2) m: 9 s ago at (2.4, -3.4), 12 s ago at (-0.6, -3.4)']['trail'] == [
        (9, 1.4, -1.4), (12, -1.6, -1.4)]
    assert set(details['details: these faults, more of label 5, this registration and this trail']) == {
        'faults', 'intent', 'registration', 'trail'}
    texts = [(name, raw[1:]) for name, raw in rows.items() if name.startswith(('part of the name', 'part of a content', 'layer chunk: ')) and raw[0] >> 6 != 1]
    texts += [(name, raw) for name, raw in rows.items() if name.startswith('part of the tree')]
    for name, raw in texts:
        digest, last, first, text = status.part(raw)
        assert not last or first or digest == status.text_digest(text) or 'BEEF' in name, name
    print(len(reports), 'reports,', len(details), 'details and', len(texts), 'parts of texts of 11.1')


def long_numbers(m):
    """2.1, 2.2: both lengths of a number; a highest number that is too high."""
    for number, base, highest in (300, 127, 173), (300, 127, 2300), (300, 128, 2300), (70000, 2048, 68000):
        raw = frame.write(1, 0, 7, number, base, 3, mission=m, peer=9)
        f = frame.parse(raw)
        assert (f.base, f.src, f.dst, f.remaining, len(raw)) == (base, 1, 0, 3, 9 if base < 128 else 11)
        assert frame.number_in(f, m, 9, 7, highest) == number


def appendix(doc):
    """A.6, each decision, and a chunk in which a hash is FFFFFFFF."""
    cells = lambda rows: {(x, y): int(v) for y, r in enumerate(rows.split('/')) for x, v in enumerate(r.split()) if v != '0'}
    trace, coders, hashes = [], [], []
    decide, decision, end = context.Stage.decide, context.Coder.decision, context.Coder.end

    def stage(self, coder, direct, keyed, sets, curve):
        trace.append([*direct, *(f'{k}:{s}' for k, s in keyed), *sets, curve])
        hashes.extend(k for k, _ in keyed)
        return decide(self, coder, direct, keyed, sets, curve)

    def plain(self, one):
        if not trace or trace[-1][-1] in ('yes', 'no'):
            trace.append([])
        yes = decision(self, one)
        trace[-1] += [one, 'yes' if yes else 'no']
        return yes
    context.Stage.decide, context.Coder.decision, context.Coder.end = stage, plain, lambda c: (coders.append(c), end(c))
    got = mapchunk.decode(hx(re.search(r'\| chunk \| `(.*?)`', doc)[1]), {(x, y): 1 for x in range(6) for y in range(6)})
    assert got[3] == {(4, 2): 3, (6, 2): 1, (2, 3): 0, (4, 3): 3, (6, 3): 9}, got
    lines = doc.split('curve    one  is\n')[1].split('```')[0].rstrip('\n').split('\n')
    head = r'(\d,\d)?\s*(calm|flip|unseen|label \d|cleared|group \d|bit \d)\s'
    assert [re.sub(head, '', l).split() for l in lines] == [[str(v) for v in t] for t in trace]
    c, = coders
    end_of_string = re.search(r'low = (\w+), range = (\w+), above = (\w+), and (\d+) bits', doc).groups()
    assert end_of_string == (*(f'{v:08X}' for v in (c.low, c.range, c.above)), str(c.shifted))
    print(len(trace), 'decisions of A.6')
    old, new = cells('105 65 168 0 0 0 / 52 0 0 0 0 0 / 0 0 0 0 0 0'), cells('105 65 168 0 0 0 / 52 52 0 0 0 7 / 9 8 0 0 3 1')
    got = mapchunk.decode(hx('80 00 22 88 40 00 79 6A 3F 05 3C 2D D0'), old)
    assert {**old, **got[3]} == new and 0xFFFFFFFF in hashes, got


if __name__ == '__main__':
    main()

"""The examples of sections 11 and 12.6 against this package."""
import os
import re
from . import frame, keys, cobs
hx = lambda s: bytes.fromhex(s.replace('\n', ' '))


def main():
    assert cobs.encode(hx('11 00 22')) == hx('2B 29 3A 29 09 2B')
    for n in (0, 1, 253, 254, 255, 508, 509, 700):
        for f in (bytes(n) + b'\1', b'\1' * n + b'\2', os.urandom(n + 1)):
            assert cobs.decode(cobs.encode(f)[1:-1], 5000) == f
    assert [frame.write_base(b) for b in (127, 128, 2048)] == [hx('7f'), hx('8080'), hx('8800')]
    assert frame.statement(0xABC, []) == hx('ABC0')
    assert frame.statement(7, [1, 4]) == hx('007112') and frame.losses(hx('12')) == [1, 4]
    assert frame.statement(30, [20, 25]) == hx('01E2BE23') and frame.losses(hx('BE23')) == [20, 25]
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
        if f.K:
            if f.H:
                assert keys.hello_tag(HC if name == 'keyed call' else H, m, peer, pn, f.unsealed) == f.seal, name
            else:
                body = ss.open(f.src != 0, f.number16, f.head, f.body, f.seal)
                assert body is not None, name
                f.body = body
        else:
            assert frame.crc_of(m, peer, f.unsealed, len(raw)) == f.seal, name
        cs = frame.chunks(f.body)
        w = frame.write(f.src, f.dst, f.session, f.number16, f.base, f.remaining, turn=f.turn, stamp=f.stamp, hello=bool(f.H),
                        ack=frame.statement(*f.ack) if f.ack else None, body=f.body, mission=m, peer=peer, peer_nonce=pn,
                        key=(HC if name == 'keyed call' else H if f.H else ss) if f.K else None, nonce=f.nonce)
        assert w == raw, (name, w.hex(), raw.hex())
        ok += 1
        print(f'{name:40} {len(raw):3} bytes, chunks {[(k, len(p)) for k, p in cs]}')
    print(ok, 'frames of 11.2 and 11.3 verified and written again')


main()

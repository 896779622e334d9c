-- Wireshark dissector for version 4 of the wire of scenecast (protocol/WIRE.md; numbers in comments are its sections).
-- Wireshark 3.6 or later. README.md beside this file explains the installation and the preferences.

local scenecast = Proto("scenecast", "scenecast acoustic link")
local f, names = {}, {}

-- Lua 5.4 (Wireshark 4.4) has no bit32, and its operator is a syntax error for Lua 5.2: hence the string.
local xor = bit32 and bit32.bxor or load("return function(a, b) return a ~ b end")()

-- Fields -------------------------------------------------------------------------------------------------------------

names.yes_no = {[0] = "no", [1] = "yes"}
names.kind = {[0] = "nothing more", "map", "pose", "slot", "object", "report", "layer", "extended"}
names.extended = {[0] = "introduction", "content in force", "inquiry", "details", "name of a label", "tree of labels", "caller",
    "next key"}
names.slot = {[0] = "utility", "constraints", "settings", "budget", "requests", "fix", "limits", "fence", "destination", "areas"}
names.mode = {[0] = "survey", "hold", "return", "surface", "abort", "done"}
names.reason = {[0] = "the survey", "order", "outside the fence", "distance used up", "time used up", "silence of the surface",
    "depth or altitude", "no allowed path"}
names.decision = {"applied", "unreadable", "labels of another epoch", "label not on the map", "out of range", "contradiction",
    "too late", "outside of the area or band", "not able", "disk does not keep it", "record lost", "newer order of another surface",
    [15] = "received, not decided"}
names.codec = {[0] = "png", "context"}
names.stride = {[0] = "every cell", "every fourth cell"}
names.layer_type = {[0] = "map chunk of levels", "digest", "part of the descriptor"}
names.intent = {[0] = "unseen floor", "unusual cells", "more of a label", "destination", "weighted area", "another look at a label"}
names.placed = {[0] = "odometry and compass", "overlap with the frame before", "overlap with an earlier track",
    "registration is off"}
names.fault = {"no image", "image dropped", "no pose", "unusable pose", "autopilot does not follow", "input refused",
    "no image mapped", "no distances"}

local function field(kind, shape, values, list)
    for name, label in list:gmatch("([%w._]+) = ([^;]+);") do
        f[name] = ProtoField[kind]("scenecast." .. name, label, shape, values)
    end
end

field("uint8", base.DEC, names.yes_no, [[
    flag.ack = Ack statement (A); flag.turn = Turn byte (T); flag.hello = Hello (H); flag.stamp = Time stamp (S);
    flag.keyed = Keyed (K); flag.up = From the vehicle (U); intro.takes_over = Takes over;
    intro.refuses = Refuses; intro.no_memory = No memory; intro.plain = Plain; intro.encrypts = Encrypts; intro.tags_all = Tags all;
    intro.full_duplex = Full duplex; part.last = Ends the text (L);
    part.wide = Wide place (W); pose.waypoint = A waypoint follows; pose.silent = The autopilot does not answer;
    path.continues = The plan continues; details.has.faults = Faults follow (F); details.has.intent = Intent follows (I);
    details.has.registration = Registration follows (R); details.has.trail = Trail follows (T); report.has.summary = Summary;
    report.has.placement = Placement; report.has.disk = State of a disk; disk.journal = The journal cannot be written;
    disk.checkpoint = The checkpoint cannot be written;]])
field("uint32", base.DEC, nil, [[
    version = Version; near = Base, if near; more = Remaining, if few; vehicle = Vehicle; from = From; to = To; base = Base; number = Number, low bits;
    number.full = Number; remaining = Remaining; turn = Turn; stamp.clock = Clock (ms); stamp.one_way = One way (ms);
    stamp.heard = Last frame of the surface, low 8; stamp.held = Held since (ms); ack.horizon = Horizon, low 12, 4 or 2;
    ack.length = Bytes of loss code; ack.lost = Lost, low 12 or 4; chunk.length = Bytes of payload;
    intro.edge = Edge of a cell (0.1 mm, 0: no map); intro.silence = Silence (8 s);
    intro.name_length = Bytes of the name; intro.clock = Clock (hours since 1970);
    intro.frame_bytes = Longest frame (bytes, 0: not known); intro.latitude = Latitude of the origin (180 / 2^24 degrees from -90);
    intro.longitude = Longitude of the origin (360 / 2^24 degrees from -180);
    part.first = Place of the first byte; map.width = Width; map.height = Height; layer.index = Layer; label = Label;
    pose.heading = Heading (1/256 of a turn); pose.sigma = Standard deviation (quarter metres);
    pose.fix_age = Age of the last fix (s); pose.explored = Explored cells; path.count = Waypoints in the path;
    trail.count = Corners of the trail; intent.operand = Label or area; registration.share = Part placed by images (1/63);
    registration.sigma = Standard deviation (2 cm); registration.loops = Frames placed by an earlier track;
    report.epoch = Label epoch; report.labels = Labels; report.budget = Budget (bit/s); report.refused = Unauthenticated frames;
    report.backlog.labels = Backlog of labels (bytes); report.backlog.rest = Backlog of layers and images (bytes);
    report.version = Version, low 8; placement.version = Version of the placement;
    disk.free = Free space (n: at least 2^(n - 2) MB); object.number = Object; object.source = Source symbols;
    object.bytes = Bytes of a symbol; object.first = First symbol; slot.version = Version;
    key.part = Part;]])
field("int32", base.DEC, nil, "map.x = x (steps); map.y = y (steps);")
field("uint16", base.HEX, nil, [[
    session = Session; part.digest = Digest of the text; map.check = Check; layer.digest = Digest of the levels;
    report.digest = Digest of the acked map; report.contents = Digest of the content in force; inquiry.digest = Digest held;
    faults = Faults;]])
field("double", nil, nil, [[
    pose.x = x (m); pose.y = y (m); pose.depth = Depth (m); waypoint.x = x of the waypoint (m);
    waypoint.y = y of the waypoint (m); placement.east = East (m); placement.north = North (m);]])
field("bytes", nil, nil, [[
    unread = Not read; nonce = Nonce; ack.code = Loss code; ciphertext = Ciphertext; payload = Payload; padding = Nothing more;
    intro.series = Series; crc = CRC; tag = Tag; key.fingerprint = Fingerprint of the next mission key;]])
field("string", nil, nil, "seal.status = Seal; chunk.name = Chunk; intro.name = Name;")
for name, values in pairs {["chunk.kind"] = "kind", ["chunk.extended"] = "extended", ["slot.number"] = "slot", ["pose.mode"] = "mode",
        ["pose.reason"] = "reason", ["report.slot"] = "slot", ["report.decision"] = "decision", ["report.in_force"] = "slot",
        ["map.codec"] = "codec", ["map.stride"] = "stride", ["layer.type"] = "layer_type", ["intent"] = "intent",
        ["registration.placed"] = "placed"} do
    f[name] = ProtoField.uint8("scenecast." .. name, (name:gsub("[._]", " "):gsub("^%l", string.upper)), base.DEC, names[values])
end
scenecast.fields = f

local broken = ProtoExpert.new("scenecast.broken", "A rule is broken", expert.group.MALFORMED, expert.severity.ERROR)
local skipped = ProtoExpert.new("scenecast.skipped", "A receiver skips this", expert.group.PROTOCOL, expert.severity.NOTE)
local bad_crc = ProtoExpert.new("scenecast.crc.wrong", "The CRC is wrong", expert.group.CHECKSUM, expert.severity.WARN)
scenecast.experts = {broken, skipped, bad_crc}

-- Preferences --------------------------------------------------------------------------------------------------------

scenecast.prefs.mission = Pref.string("Mission id", "", "mission.id, decimal or with 0x; empty: no CRC is checked")
scenecast.prefs.encrypted = Pref.bool("Encrypted", false, "link.encrypt: chunks of numbered frames with a tag are ciphertext")
scenecast.prefs.ports = Pref.range("UDP ports", "", "Ports of modems of the kind udp", 65535)

local ports = ""

function scenecast.prefs_changed()
    local table_ = DissectorTable.get("udp.port")
    if ports ~= "" then table_:remove(ports, scenecast) end
    ports = tostring(scenecast.prefs.ports or "")
    if ports ~= "" then table_:add(ports, scenecast) end
end

local function mission()
    local id = tonumber(scenecast.prefs.mission)
    return id and id >= 0 and id < 2 ^ 32 and math.floor(id) == id and math.floor(id) or nil
end

-- Reading ------------------------------------------------------------------------------------------------------------

local function fail(text, ...) error({rule = text:format(...)}, 0) end

-- Runs a reader of bytes; a broken rule becomes an expert item, an error of this script stays one.
local function guard(tree, read, ...)
    local fine, result = pcall(read, ...)
    if fine then return result end
    if type(result) ~= "table" then error(result, 0) end
    tree:add_proto_expert_info(broken, result.rule)
end

local Reader = {}
Reader.__index = Reader

-- Reads the bits of the bytes from `first` to before `stop`.
local function reader(tvb, first, stop)
    return setmetatable({tvb = tvb, data = tvb:raw(), at = first * 8, stop = stop * 8}, Reader)
end

function Reader:left() return math.floor((self.stop - self.at) / 8) end

function Reader:take(n)
    if self.at + n > self.stop then fail("It ends too early") end
    local from, value = self.at, 0
    for i = from, from + n - 1 do
        value = value * 2 + math.floor(self.data:byte(math.floor(i / 8) + 1) / 2 ^ (7 - i % 8)) % 2
    end
    self.at = from + n
    local first = math.floor(from / 8)
    return value, self.tvb(first, math.floor((from + n - 1) / 8) - first + 1)
end

local function signed(value, n) return value >= 2 ^ (n - 1) and value - math.floor(2 ^ n) or value end

function Reader:put(tree, name, n, change)
    local value, range = self:take(n)
    if change then value = change(value, n) end
    return value, tree:add(f[name], range, value)
end

function Reader:bytes(tree, name, n)
    if self:left() < n then fail("It ends too early") end
    local first = math.floor(self.at / 8)
    self.at = self.at + n * 8
    if n > 0 then return tree:add(f[name], self.tvb(first, n)) end
end

function Reader:rest(tree, name)
    self.at = math.ceil(self.at / 8) * 8
    return self:bytes(tree, name, self:left())
end

function Reader:skip(n)
    if self.at + n > self.stop then fail("It ends too early") end
    self.at = self.at + n
end

function Reader:zeros(n, what) if n > 0 and self:take(n) ~= 0 then fail("%s is not 0", what) end end

-- The bits after a value, up to a whole byte, and no byte more.
function Reader:finish(what)
    if self:left() > 0 then fail("%s is too long", what) end
    self:zeros(self.stop - self.at, "The end of " .. what)
end

local function metres(value, n) return signed(value, n) / 10 end
local function shifted(value) return math.floor(value / 16) * math.floor(2 ^ (value % 16)) end
local function tenth(value) return value / 10 end
local function plus_one(value) return value + 1 end
local changes = {m = metres, x = shifted, d = tenth, p = plus_one}

-- Reads fields such as "pose.x m24": the name, the change of the value (see `changes`), the bits. Returns the values by name.
function Reader:all(tree, layout)
    local values = {}
    for name, change, bits in layout:gmatch("([%w._]+) (%a?)(%d+)") do
        if name == "zeros" then self:zeros(tonumber(bits), "A reserved bit")
        else values[name] = self:put(tree, name, tonumber(bits), changes[change]) end
    end
    return values
end

-- Contents of chunks. Each reads the payload `r` into `tree` and may return words for the info line ---------------------

local content, extended = {}, {}

-- 5.2
local function part(r, tree)
    local wide = r:all(tree, "part.digest 16, part.last 1, part.wide 1")["part.wide"]
    local first = r:put(tree, "part.first", wide == 1 and 14 or 6)
    if wide == 1 and first < 64 then fail("The place %d has 14 bits", first) end
    if r:left() < 1 then fail("A part without bytes") end
    r:rest(tree, "payload")
end

-- 6.3
local function map_chunk(r, tree)
    r:all(tree, "map.codec 1, map.stride 1")
    local place = ({7, 8, 9, 10, 11, 12, 16, 32})[r:take(3) + 1]
    r:put(tree, "map.x", place, signed)
    r:put(tree, "map.y", place, signed)
    local side = ({4, 6, 7, 10})[r:take(2) + 1]
    local width, height = r:put(tree, "map.width", side, plus_one), (r:put(tree, "map.height", side, plus_one))
    r:put(tree, "map.check", 8)
    r:rest(tree, "payload")
    if width * height > 65536 then fail("The area is more than 65 536 cells") end
    return ("%dx%d"):format(width, height)
end

content[1] = function(r, tree) return "map " .. map_chunk(r, tree) end

-- 7, pose
local function path(r, tree)
    local v = r:all(tree, "path.continues 1, path.count 3")
    local count = v["path.count"]
    local width = count > 0 and r:take(5) or 0
    if v["path.continues"] + count == 0 or count > 0 and (width < 1 or width > 25) then fail("Another encoding of the path") end
    r:skip(2 * width * count)
end

content[2] = function(r, tree)
    local v = r:all(tree, [[pose.mode 3, pose.waypoint 1, pose.silent 1, pose.reason 3, pose.x m24, pose.y m24, pose.depth d16,
        pose.heading 8, pose.sigma 8, pose.fix_age 8, pose.explored 24]])
    if v["pose.waypoint"] == 1 then
        r:all(tree, "waypoint.x m24, waypoint.y m24")
        if r:left() > 0 then path(r, tree) end
    end
    r:finish("the pose")
    if v["pose.mode"] > 5 then fail("The mode is %d", v["pose.mode"]) end
end

-- 8.1
content[3] = function(r, tree)
    local low, range = r:take(3)
    local number = low + 8 * r:take(5)
    local item = tree:add(f["slot.number"], range, number)
    local version = r:put(tree, "slot.version", 16)
    r:rest(tree, "payload")
    if not names.slot[number] then item:add_proto_expert_info(skipped, "A slot of a later version") end
    return ("slot %s version %d"):format(names.slot[number] or number, version)
end

-- 9
content[4] = function(r, tree)
    local v = r:all(tree, "object.number 11, object.source p11, object.bytes p6, object.first 12")
    local source, bytes, first = v["object.source"], v["object.bytes"], v["object.first"]
    local count, over = math.floor(r:left() / bytes), r:left() % bytes
    local item = r:rest(tree, "payload")
    if count == 0 or over > 0 then fail("The symbols are not whole") end
    item:append_text((" (symbols %d to %d)"):format(first, first + count - 1))
    local blocks = math.ceil(source / 128)
    local symbols = source + blocks * (255 - math.ceil(source / blocks))
    if source * bytes <= 5 or (source - 1) * bytes >= 16389 or first + count > symbols then fail("The object breaks a range") end
    return ("object %d symbols %d to %d"):format(v["object.number"], first, first + count - 1)
end

-- 7, report
local function report_slots(r, tree, slots)
    local versions = {}
    for i in ipairs(slots) do versions[i] = {r:take(8)} end
    for i, number in ipairs(slots) do
        local decision, range = r:take(4)
        local branch = tree:add(f["report.slot"], range, number)
        branch:add(f["report.version"], versions[i][2], versions[i][1])
        local item = branch:add(f["report.decision"], range, decision)
        if not names.decision[decision] then item:add_proto_expert_info(broken, "A reserved decision") end
    end
    r:zeros(#slots % 2 * 4, "The half byte after the decisions")
end

local function report_summary(r, tree)
    for _, number in ipairs {0, 2, 3, 6, 7, 8, 9} do
        local held, range = r:take(1)
        if held == 1 then tree:add(f["report.in_force"], range, number) end
    end
    r:all(tree, "zeros 1, report.contents 16")
end

content[5] = function(r, tree)
    r:all(tree, [[report.epoch 8, report.labels 8, report.digest 16, report.budget x16, report.refused 8,
        report.backlog.labels x8, report.backlog.rest x8]])
    local slots = {}
    for number = 0, 9 do if r:take(1) == 1 then slots[#slots + 1] = number end end
    local has = r:all(tree, "zeros 3, report.has.summary 1, report.has.placement 1, report.has.disk 1")
    report_slots(r, tree, slots)
    if has["report.has.summary"] == 1 then report_summary(r, tree) end
    if has["report.has.placement"] == 1 then
        local v = r:all(tree, "placement.version 8, placement.east m24, placement.north m24")
        if v["placement.version"] == 0 then fail("The version of the placement is 0") end
    end
    if has["report.has.disk"] == 1 then r:all(tree, "zeros 1, disk.journal 1, disk.checkpoint 1, disk.free 5") end
    r:finish("the report")
end

-- 6.7
content[6] = function(r, tree)
    local v = r:all(tree, "layer.type 2, zeros 2, layer.index 4")
    local kind, name = v["layer.type"], ("layer %d "):format(v["layer.index"])
    if kind == 0 then return name .. map_chunk(r, tree) end
    if kind == 3 then fail("The type is 3") end
    if kind == 2 then part(r, tree) return name .. "descriptor" end
    r:put(tree, "layer.digest", 16)
    r:finish("the digest")
    return name .. "digest"
end

content[7] = function(r, tree, frame)
    if r:left() == 0 then tree:add_proto_expert_info(skipped, "Kind 7 without a payload") return end
    local kind, item = r:put(tree, "chunk.extended", 8)
    if extended[kind] then return extended[kind](r, tree, frame) or names.extended[kind] end
    item:add_proto_expert_info(skipped, "An unknown extended kind")
    r:rest(tree, "payload")
    return "extended kind " .. kind
end

-- 5.1
local function introduction(r, tree)
    r:put(tree, "intro.edge", 24)
    r:bytes(tree, "intro.series", 6)
    local v = r:all(tree, [[intro.takes_over 1, intro.refuses 1, intro.no_memory 1, intro.silence 5, intro.clock 24, intro.plain 1,
        intro.encrypts 1, intro.tags_all 1, intro.full_duplex 1, intro.name_length 4]])
    r:bytes(tree, "intro.name", v["intro.name_length"])
    if r:left() >= 2 then r:put(tree, "intro.frame_bytes", 16) end
    if r:left() >= 6 then r:all(tree, "intro.latitude 24, intro.longitude 24") end
    r:rest(tree, "payload")
    if v["intro.name_length"] > 12 then fail("The name has more than 12 bytes") end
    return v["intro.refuses"] == 1
end

extended[0] = function(r, tree, frame)
    frame.refuses = introduction(r, tree)
    frame.introduced = true
    return frame.refuses and "introduction (refuses)" or "introduction"
end
extended[6] = function(r, tree) introduction(r, tree) end

-- 8.7
extended[1] = function(r, tree)
    local slot = r:put(tree, "slot.number", 8)
    part(r, tree)
    return "content of " .. (names.slot[slot] or "slot " .. slot)
end
extended[2] = function(r, tree)
    for _ = 1, 7 do r:put(tree, "inquiry.digest", 16) end
    r:rest(tree, "payload")
end

-- 7, details
local details = {}

function details.faults(r, tree)
    local value, item = r:put(tree, "faults", 8)
    for bit, name in ipairs(names.fault) do
        if math.floor(value / 2 ^ (8 - bit)) % 2 == 1 then item:append_text(", " .. name) end
    end
    if value == 0 then fail("The faults are 0") end
end

function details.intent(r, tree)
    local value = r:put(tree, "intent", 8)
    if value > 5 then fail("The intent is %d", value) end
    local most = ({[2] = 254, [4] = 4, [5] = 254})[value]
    local operand = most and r:put(tree, "intent.operand", 8)
    if most and (operand < 1 or operand > most) then fail("The label or area is %d", operand) end
end

function details.registration(r, tree)
    r:all(tree, "registration.placed 2, registration.share 6, registration.sigma 8, registration.loops 16")
end

function details.trail(r, tree)
    local count = r:put(tree, "trail.count", 4)
    local width = r:take(4) + 1
    if count == 0 then fail("A trail without corners") end
    r:skip(count * (8 + 2 * width))
    r:zeros(-r.at % 8, "The end of the trail")
end

extended[3] = function(r, tree)
    local has = r:all(tree, "details.has.faults 1, details.has.intent 1, details.has.registration 1, details.has.trail 1")
    local any = false
    local later = r:take(4)
    for _, name in ipairs {"faults", "intent", "registration", "trail"} do
        if has["details.has." .. name] == 1 then
            details[name](r, tree)
            any = true
        end
    end
    if later == 0 then r:finish("the details") else r:rest(tree, "payload") end
    if not any then fail("Details without a part") end
end

-- 6.8, 6.9, 4.4
extended[4] = function(r, tree)
    local label = r:put(tree, "label", 8)
    if label == 0 or label == 255 then fail("The label is %d", label) end
    part(r, tree)
    return "name of label " .. label
end
extended[5] = function(r, tree) part(r, tree) end
extended[7] = function(r, tree)
    if r:put(tree, "key.part", 8) > 1 then fail("The part is neither 0 nor 1") end
    r:bytes(tree, "key.fingerprint", 4)
    r:bytes(tree, "payload", 16)
    r:finish("the part of a key")
end

-- Seals (2.2) ----------------------------------------------------------------------------------------------------------

local crc24_table, crc32c_table = {}, {}
for i = 0, 255 do
    local left, right = i * 65536, i
    for _ = 1, 8 do
        left = left * 2 >= 2 ^ 24 and xor(left * 2 - 16777216, 0x864CFB) or left * 2
        right = right % 2 == 1 and xor(math.floor(right / 2), 0x82F63B78) or math.floor(right / 2)
    end
    crc24_table[i], crc32c_table[i] = left, right
end

local function be(value, n)
    return n == 0 and "" or be(math.floor(value / 256), n - 1) .. string.char(value % 256)
end

local function crc24(text)
    local crc = 0xB704CE
    for i = 1, #text do crc = xor(crc % 65536 * 256, crc24_table[xor(math.floor(crc / 65536), text:byte(i))]) end
    return be(crc, 3)
end

local function crc32c(text)
    local crc = 0xFFFFFFFF
    for i = 1, #text do crc = xor(math.floor(crc / 256), crc32c_table[xor(crc % 256, text:byte(i))]) end
    return be(0xFFFFFFFF - crc, 4)
end

-- Of each vehicle the runs of the surface, and the pairs of runs, the latest first; of each packet what its check yielded.
local surface_runs, run_pairs, results = {}, {}, {}
function scenecast.init() surface_runs, run_pairs, results = {}, {}, {} end

local function remember(all, vehicle, run, same)
    local list = all[vehicle] or {}
    for i = #list, 1, -1 do if same(list[i]) then run = table.remove(list, i) end end
    table.insert(list, 1, run)
    -- An 8-bit number costs 256 CRCs in each pair, so only the latest few are kept.
    list[5] = nil
    all[vehicle] = list
end

local function note_hello(frame, sealed_to)
    if frame.version ~= 4 or not frame.introduced then return end
    local session = frame.session
    if frame.from == 0 then
        remember(surface_runs, frame.to, session, function(run) return run == session end)
    elseif sealed_to and not frame.refuses then
        remember(run_pairs, frame.from, {surface = sealed_to, vehicle = session, [0] = 0, [1] = 0},
            function(run) return run.surface == sealed_to and run.vehicle == session end)
    end
end

local function check_hello(frame, id, body, seal)
    local candidates = frame.from == 0 and {0} or not frame.introduced and {frame.session} or surface_runs[frame.from]
    if not candidates then return "cannot be checked" end
    for _, session in ipairs(candidates) do
        if crc24(be(id, 4) .. be(session, 2) .. body) == seal then
            note_hello(frame, session)
            return "right"
        end
    end
    return "wrong"
end

-- 3.2
local function nearest(low, bits, highest)
    local size = math.floor(2 ^ bits)
    local first = highest - math.floor(size / 2)
    local number = first + (low - first) % size
    return number < 0 and low or number
end

local function check_numbered(frame, id, body, seal)
    local list = run_pairs[frame.vehicle]
    if not list then return "cannot be checked" end
    for _, pair in ipairs(list) do
        local receiver, sender = pair.vehicle, pair.surface
        if frame.up == 1 then receiver, sender = sender, receiver end
        local highest = pair[frame.up]
        for high = -1, frame.bits == 8 and 255 or -1 do
            local number = high < 0 and nearest(frame.number, frame.bits, highest) or nearest(high * 256 + frame.number, 16, highest)
            if crc32c(be(id, 4) .. be(receiver, 2) .. be(sender, 2) .. be(number % 65536, 2) .. body) == seal then
                pair[frame.up] = math.max(highest, number)
                return "right", number
            end
        end
    end
    return "wrong"
end

-- Packets are read again in any order, so only the first reading checks and learns.
local function check(frame, pinfo, body, seal)
    if not pinfo.visited or not results[pinfo.number] then
        local id, status, number = mission(), "cannot be checked", nil
        if frame.keyed == 1 and frame.hello == 1 then
            -- Without the key nothing verifies it, but its runs are those of numbered frames with a CRC (`down`).
            note_hello(frame, (surface_runs[frame.from] or {})[1])
        elseif id and frame.keyed == 0 then
            status, number = (frame.hello == 1 and check_hello or check_numbered)(frame, id, body, seal)
        end
        results[pinfo.number] = {status = status, number = number}
    end
    return results[pinfo.number]
end

-- Frame ----------------------------------------------------------------------------------------------------------------

-- 3.3: distances of the lost frames from the horizon.
local function losses(r)
    local lost, distance = {}, 0
    if r.at == r.stop then return lost end
    if r:take(1) == 0 then
        for i = 0, r.stop - r.at - 1 do if r:take(1) == 1 then lost[#lost + 1] = i end end
        return lost
    end
    while true do
        local ones = 0
        while r.at < r.stop and r:take(1) == 1 do ones = ones + 1 end
        if r.stop - r.at < 3 then return lost end
        distance = distance + ones * 8 + r:take(3)
        if distance >= 4096 then return lost end
        lost[#lost + 1] = distance
        distance = distance + 1
    end
end

local function ack(r, tree, frame)
    local first, size, distances = math.floor(r.at / 8), 4096, {}
    local is_far = r:take(1) == 1
    local horizon = r:put(tree, "ack.horizon", is_far and 12 or 4)
    if is_far then
        local length = r:put(tree, "ack.length", 3)
        if length == 7 then length = r:put(tree, "ack.length", 8) end
        local code = math.floor(r.at / 8)
        r:bytes(tree, "ack.code", length)
        distances = losses(reader(r.tvb, code, code + length))
    else
        size = 16
        for distance = 1, 3 do if r:take(1) == 1 then distances[#distances + 1] = distance end end
    end
    local numbers = {}
    for i, distance in ipairs(distances) do
        numbers[i] = math.floor((horizon - distance) % size)
        tree:add(f["ack.lost"], r.tvb(first, math.floor(r.at / 8) - first), numbers[i])
    end
    local lost = #numbers > 0 and (" (lost %s%s)"):format(table.concat(numbers, " ", 1, math.min(8, #numbers)),
        #numbers > 8 and " ..." or "") or ""
    table.insert(frame.words, "ack " .. horizon .. lost)
end

local function stamp(r, tree, frame)
    if frame.hello == 1 then return r:bytes(tree, "unread", frame.from == 0 and 5 or 6) end
    r:all(tree, "stamp.clock 24, " .. (frame.from == 0 and "stamp.one_way 16" or "stamp.heard 8, stamp.held 16"))
end

local function hello_ends(r, tree, frame)
    local v = r:all(tree, "from 4, to 4, session 16")
    frame.from, frame.to, frame.session = v.from, v.to, v.session
    r:bytes(tree, "unread", 3)
    if frame.session == 0 then fail("The session is 0") end
    if frame.from == 15 or (frame.from == 0) == (frame.to == 0) or frame.from > 0 and frame.to == 15 then
        fail("No hello goes from %d to %d", frame.from, frame.to)
    end
end

local function numbered_ends(r, tree, frame)
    local v = r:all(tree, "flag.up 1, more 3, vehicle 4")
    frame.up, frame.more, frame.vehicle = v["flag.up"], v.more, v.vehicle
    frame.from, frame.to = frame.up * frame.vehicle, (1 - frame.up) * frame.vehicle
    local least, wide = 1, 0
    frame.base = frame.near
    if frame.near == 0 then
        wide = r:take(1)
        frame.base = r:put(tree, "base", wide == 1 and 15 or 7)
        least = wide == 1 and 128 or 4
    end
    frame.bits = wide == 1 and 16 or 8
    frame.number = r:put(tree, "number", frame.bits)
    if frame.vehicle < 1 or frame.vehicle > 14 then fail("The vehicle is %d", frame.vehicle) end
    if frame.base < least or frame.base > 2048 then fail("The base is %d", frame.base) end
end

local function header(r, tree, frame)
    local first = r.data:byte(1)
    if math.floor(first / 4) % 2 == 1 or first < 128 then
        frame.version = r:put(tree, "version", 3)
    else
        r:take(1)
        frame.version, frame.near = 4, r:put(tree, "near", 2)
    end
    for _, name in ipairs {"ack", "turn", "hello", "stamp", "keyed"} do frame[name] = r:put(tree, "flag." .. name, 1) end
    if frame.version ~= 4 and (frame.hello == 0 or frame.version < 2) then fail("The version is %d", frame.version) end
    local seal = frame.keyed == 1 and 8 or frame.hello == 1 and 3 or 4
    if r:left() < seal then fail("There is no room for the seal") end
    r.stop = r.stop - seal * 8
    local ends = frame.hello == 1 and hello_ends or numbered_ends
    ends(r, tree, frame)
    if frame.hello == 1 or frame.more == 7 then
        local value, item = r:put(tree, "remaining", 8)
        item:append_text(frame.from == 0 and (" (%d bits on air)"):format(value * 32) or " (frames)")
    end
    if frame.turn == 1 and frame.from ~= 0 and frame.hello == 0 then
        local is_heard = r:take(1) == 1
        if is_heard then table.insert(frame.words, "ack " .. r:put(tree, "ack.horizon", 2))
        elseif r:take(2) ~= 0 then fail("Low bits of a horizon in a turn byte without a statement") end
        if is_heard and frame.ack == 1 then fail("There are two statements") end
        local value, item = r:put(tree, "turn", 5)
        frame.time = value < 8 and value or (4 + value % 4) * 2 ^ (math.floor(value / 4) - 1)
        item:append_text((" (%g s)"):format(frame.time / 4))
    elseif frame.turn == 1 then
        local value, item = r:put(tree, "turn", 8)
        frame.time = value
        item:append_text((" (%g s)"):format(value / 4))
    end
    if frame.stamp == 1 then stamp(r, tree, frame) end
    if frame.hello == 1 and frame.keyed == 1 then r:bytes(tree, "nonce", 8) end
    if frame.ack == 1 then ack(r, tree, frame) end
    frame.complete = true
end

-- A letter for the end that sends a chunk: v, s, or none for both.
local function sender(kind, payload)
    if kind < 7 then return ("vvsvvv"):sub(kind, kind) end
    return payload and payload > 0 and ("vsvvvvs"):sub(payload, payload) or ""
end

local function chunk(r, tree, frame)
    local first = math.floor(r.at / 8)
    local kind, length = r:take(3), r:take(5)
    if kind == 0 then
        r.at = first * 8
        return r:rest(tree, "padding")
    end
    if length == 31 then length = r:left()
    elseif length > 26 then length = 27 + 256 * (length - 27) + r:take(8) end
    if length > r:left() then fail("A chunk runs past the end of the frame") end
    local from = math.floor(r.at / 8)
    local branch = tree:add(f["chunk.name"], r.tvb(first, from + length - first), names.kind[kind])
    branch:add(f["chunk.kind"], r.tvb(first, 1), kind)
    branch:add(f["chunk.length"], r.tvb(first, from - first), length)
    local payload = length > 0 and r.data:byte(from + 1) or nil
    if sender(kind, payload) == (frame.from == 0 and "v" or "s") then
        branch:add_proto_expert_info(skipped, "Only the other end sends this kind")
    end
    r.at = (from + length) * 8
    local words = guard(branch, function()
        return content[kind](reader(r.tvb, from, from + length), branch, frame) or names.kind[kind]
    end) or names.kind[kind] .. " (malformed)"
    table.insert(frame.words, words)
    if words ~= names.kind[kind] then branch:append_text(": " .. words) end
end

local function body(r, tree, frame)
    if frame.hello == 0 and frame.keyed == 1 and scenecast.prefs.encrypted then
        if r:rest(tree, "ciphertext") then table.insert(frame.words, "ciphertext") end
        return
    end
    while r:left() > 0 do chunk(r, tree, frame) end
end

local function seal(r, tree, frame, pinfo)
    local first, length = math.floor(r.stop / 8), #r.data - math.floor(r.stop / 8)
    local range = r.tvb(first, length)
    local item = tree:add(frame.keyed == 1 and f.tag or f.crc, range)
    local result = check(frame, pinfo, r.data:sub(1, first), r.data:sub(first + 1))
    local words = (frame.keyed == 1 and "tag " or "CRC ") .. result.status
    tree:add(f["seal.status"], range, words):set_generated()
    if result.number then tree:add(f["number.full"], range, result.number):set_generated() end
    if result.status == "wrong" then
        item:add_proto_expert_info(bad_crc, "Damaged, of another mission, or between runs whose hellos are not in the capture")
        table.insert(frame.words, words)
    end
    frame.number = result.number or frame.number
end

local function end_name(address)
    return address == 0 and "surface" or address == 15 and "everybody" or "vehicle " .. address
end

local function info(frame)
    if not frame.complete then return "malformed frame" end
    local text = end_name(frame.from) .. " > "
    if frame.hello == 0 then
        text = ("%s%s #%d base %d"):format(text, end_name(frame.to), frame.number, frame.base)
    else
        local kind = frame.to == 15 and "call" or (frame.introduced or frame.from == 0) and "hello" or "answer to the call"
        text = ("%s%s %s %04X"):format(text, end_name(frame.to), kind, frame.session)
    end
    if frame.from == 0 and frame.turn == 1 then text = ("%s, grant %g s"):format(text, frame.time / 4) end
    return table.concat({text, table.concat(frame.words, ", ")}, #frame.words > 0 and ", " or "")
end

function scenecast.dissector(tvb, pinfo, root)
    pinfo.cols.protocol = "scenecast"
    if tvb:len() == 0 then
        pinfo.cols.info = "empty frame"
        return
    end
    local tree, frame, r = root:add(scenecast, tvb()), {words = {}}, reader(tvb, 0, tvb:len())
    guard(tree, function()
        if tvb:reported_len() > tvb:len() then fail("The capture cut the frame") end
        header(r, tree, frame)
    end)
    if frame.complete then
        guard(tree, body, r, tree, frame)
        seal(r, tree, frame, pinfo)
    end
    pinfo.cols.info = info(frame)
end

DissectorTable.get("udp.port"):add_for_decode_as(scenecast)
DissectorTable.get("wtap_encap"):add((wtap_encaps or wtap).USER0, scenecast)

#!/usr/bin/env python3
"""Move one node of a .glb along x: move_node.py IN.glb OUT.glb NAME METRES

NAME is how the node's name begins; of several, the middle one moves."""
import json
import struct
import sys

source, target, name, metres = sys.argv[1:]
data = open(source, "rb").read()
length = struct.unpack("<I", data[12:16])[0]
document, rest = json.loads(data[20 : 20 + length]), data[20 + length :]
nodes = [n for n in document["nodes"] if n.get("name", "").startswith(name) and "translation" in n]
node = nodes[len(nodes) // 2]
node["translation"][0] += float(metres)
text = json.dumps(document, separators=(",", ":")).encode()
text += b" " * (-len(text) % 4)
with open(target, "wb") as out:
    out.write(struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest)))
    out.write(struct.pack("<I4s", len(text), b"JSON") + text + rest)
print("moved", node["name"])

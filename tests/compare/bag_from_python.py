#!/usr/bin/env python3
"""Writes rosbags from the public description of the format (http://wiki.ros.org/Bags/Format/2.0) and of the encoding of
messages, and compares them with a run by the program. Standard library only.

    bag_from_python.py GRAPNEL SCENARIO
"""

import bz2
import csv
import json
import math
import os
import struct
import subprocess
import sys
import tempfile

DEFINITION = """# The state of joints
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
"""


def field(name, value):
    data = name.encode() + b"=" + value
    return struct.pack("<I", len(data)) + data


def record(fields, data):
    header = b"".join(field(name, value) for name, value in fields.items())
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


def stamp(time):
    seconds = math.floor(time)
    return struct.pack("<II", seconds, round(1e9 * (time - seconds)))


def text(value):
    return struct.pack("<I", len(value)) + value.encode()


def joint_state(number, time, names, positions):
    data = struct.pack("<I", number) + stamp(time) + text("")
    data += struct.pack("<I", len(names)) + b"".join(text(name) for name in names)
    data += struct.pack(f"<I{len(positions)}d", len(positions), *positions)
    return data + struct.pack("<II", 0, 0)


def bag(messages, compression, is_closed, size=4096):
    """A bag of one topic with 50 messages in a chunk, with indices if it is closed. Its first record has `size` bytes."""
    connection = record(
        {"op": b"\x07", "conn": struct.pack("<I", 0), "topic": b"/joint_states"},
        field("topic", b"/joint_states") + field("type", b"sensor_msgs/JointState")
        + field("md5sum", b"3066dcd76a6cfaef579bd0f34173e9fd") + field("message_definition", DEFINITION.encode()))
    body, infos = b"", b""
    begin = 13 + 4 + size + 4
    for first in range(0, len(messages), 50):
        part = messages[first:first + 50]
        data, index = (connection if first == 0 else b""), b""
        for time, message in part:
            index += stamp(time) + struct.pack("<I", len(data))
            data += record({"op": b"\x02", "conn": struct.pack("<I", 0), "time": stamp(time)}, message)
        place = begin + len(body)
        packed = bz2.compress(data) if compression == "bz2" else data
        if not is_closed and first + 50 >= len(messages):  # its size is not known yet
            body += record({"op": b"\x05", "compression": b"none", "size": struct.pack("<I", 0)}, b"") + data[:-7]
            break
        body += record({"op": b"\x05", "compression": compression.encode(), "size": struct.pack("<I", len(data))}, packed)
        body += record({"op": b"\x04", "ver": struct.pack("<I", 1), "conn": struct.pack("<I", 0),
                        "count": struct.pack("<I", len(part))}, index)
        infos += record({"op": b"\x06", "ver": struct.pack("<I", 1), "chunk_pos": struct.pack("<Q", place),
                         "start_time": stamp(part[0][0]), "end_time": stamp(part[-1][0]),
                         "count": struct.pack("<I", 1)}, struct.pack("<II", 0, len(part)))
    header = {"op": b"\x03", "index_pos": struct.pack("<Q", begin + len(body) if is_closed else 0),
              "conn_count": struct.pack("<I", 1), "chunk_count": struct.pack("<I", (len(messages) + 49) // 50)}
    length = sum(len(field(name, value)) for name, value in header.items())
    head = record(header, b" " * (size - length))
    assert len(head) == 4 + size + 4
    return b"#ROSBAG V2.0\n" + head + body + (connection + infos if is_closed else b"")


def main():
    program, scenario = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)

        def grapnel(*arguments, code=0):
            done = subprocess.run([program, *arguments], capture_output=True, text=True, check=False)
            assert done.returncode == code, f"{arguments}: exit {done.returncode}\n{done.stdout}{done.stderr}"
            return done.stdout + done.stderr

        grapnel("run", scenario, "-o", "run", "--quiet", "--set", "output.interval=0.2")
        grapnel("export", "run", "--csv")
        with open("run/timeseries.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        column = "joints/position/{} [rad]"
        names = [name[len("joints/position/"):-len(" [rad]")] for name in rows[0] if name.startswith("joints/position/")]
        messages = []
        for i, row in enumerate(rows):
            time = 1.7e9 + 1.05 * float(row["time [s]"])  # the clock is 5 % fast
            order = names[::-1] if i % 2 else names
            positions = [math.degrees(float(row[column.format(name)])) for name in order]
            messages.append((time + 0.03, joint_state(i, time, order, positions)))
        series = "".join(
            f"  - {{name: {name}, run: joints/position/{name}, log: '/joint_states.position[{name}]', unit: deg,\n"
            "     uncertainty: 0.001}\n" for name in names)
        with open("map.yaml", "w", encoding="utf-8") as file:
            file.write("time: {column: header.stamp, offset: -1.7e9, reference: 1.7e9, "
                       f"drift: {1 / 1.05 - 1}}}\nquantities:\n{series}")
        for compression, is_closed in (("none", True), ("bz2", True), ("none", False)):
            with open("log.bag", "wb") as file:
                file.write(bag(messages, compression, is_closed))
            printed = " ".join(grapnel("compare", "run", "log.bag", "--map", "map.yaml").split())
            assert ("was not closed" in printed) == (not is_closed), printed
            with open("run/compare-log/comparison.json", encoding="utf-8") as file:
                result = json.load(file)
            assert result["log"]["format"] == "rosbag"
            assert result["agrees"] == "yes" and len(result["quantities"]) == len(names) >= 4, result
            for one in result["quantities"]:
                assert one["samples"] == len(rows) - (0 if is_closed else 1), one["samples"]
                # At 1.7e9 s a double has a resolution of 0.24 us: the four samples of the impact are apart by less.
                assert one["rms"] < 2e-6, one["rms"]  # 0.3 us at 0.3 rad/s: 1e-7
            print(f"{compression}, {'closed' if is_closed else 'open'}: rms {max(q['rms'] for q in result['quantities']):.2g} rad")
        # Without the drift the log disagrees.
        with open("map.yaml", encoding="utf-8") as file:
            mapping = file.read().replace(f"drift: {1 / 1.05 - 1}", "drift: 0")
        with open("map.yaml", "w", encoding="utf-8") as file:
            file.write(mapping)
        grapnel("compare", "run", "log.bag", "--map", "map.yaml", code=1)


if __name__ == "__main__":
    main()

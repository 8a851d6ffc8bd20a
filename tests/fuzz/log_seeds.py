#!/usr/bin/env python3
"""Writes small MCAP and rosbag files as a fuzzer's first inputs. Checksums are 0, so that changed files are read.

    log_seeds.py FOLDER
"""

import os
import struct
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "compare"))
import bag_from_python  # noqa: E402

IMU = """std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[3] orientation_covariance
geometry_msgs/Vector3 angular_velocity
uint8[] raw
================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""


def text(value):
    return struct.pack("<I", len(value)) + value


def record(code, content):
    return struct.pack("<BQ", code, len(content)) + content


def imu(k):
    return struct.pack("<4BIII2s2x10dI2B", 0, 1, 0, 0, k, 0, 2, b"i", *[0.1 * k + i for i in range(10)], 2, 1, 2)


def mcap(messages, schema, encoding, topic):
    records = record(3, struct.pack("<H", 1) + b"".join(text(part) for part in schema))
    records += record(4, struct.pack("<HH", 1, 1) + text(topic) + text(encoding) + struct.pack("<I", 0))
    for k, data in enumerate(messages):
        records += record(5, struct.pack("<HIQQ", 1, k, 1000 * k, 900 * k) + data)
    chunk = record(6, struct.pack("<QQQI", 0, 0, len(records), 0) + text(b"") + struct.pack("<Q", len(records)) + records)
    end = record(15, struct.pack("<I", 0)) + record(2, bytes(20)) + b"\x89MCAP0\r\n"
    return b"\x89MCAP0\r\n" + record(1, text(b"") + text(b"")) + chunk + end


def main():
    folder = sys.argv[1]
    transforms = b'{"transforms":[{"child_frame_id":"base","translation":{"x":1,"y":null,"z":[1e9,true]}}]}'
    files = {
        "imu.mcap": mcap([imu(k) for k in range(3)], (b"sensor_msgs/msg/Imu", b"ros2msg", IMU.encode()), b"cdr",
                         b"/imu/data"),
        "tf.mcap": mcap([transforms] * 3, (b"tf", b"jsonschema", b'{"properties":{"transforms":{"type":"array"}}}'),
                        b"json", b"/tf"),
    }
    states = [(k, bag_from_python.joint_state(k, k, ["elbow", "wrist"], [k, 2 * k])) for k in range(3)]
    for compression in ("none", "bz2"):
        files[f"{compression}.bag"] = bag_from_python.bag(states, compression, True, 100)
    for name, data in files.items():
        with open(os.path.join(folder, name), "wb") as file:
            file.write(data)


if __name__ == "__main__":
    main()

"""Trajectories written by `matterixc emit`, read by programs of the ROS world.

    python3 -m venv venv && venv/bin/pip install mcap-ros2-support==0.6.0 rosbags==0.11.9
    matterixc emit tests/emit/arm.mtx --target joint-trajectory -o arm.mcap
    venv/bin/python tests/peers/trajectories.py arm.mcap

mcap-ros2-support decodes every message by the definition in the file; rosbags decodes it by its own and must write it again
with the same bytes. Times ascend, and a motion begins where the one before it ended.
"""

import sys

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_typestore

TYPE = "trajectory_msgs/msg/JointTrajectory"
store = get_typestore(Stores.ROS2_HUMBLE)
count, stood = 0, {}
with open(sys.argv[1], "rb") as file:
    for schema, channel, message, decoded in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
        assert schema.name == TYPE, schema.name
        again = bytes(store.serialize_cdr(store.deserialize_cdr(message.data, TYPE), TYPE))
        assert again == message.data, f"{channel.topic}: {len(again)} bytes for {len(message.data)}"
        times = [p.time_from_start.sec + p.time_from_start.nanosec * 1e-9 for p in decoded.points]
        assert all(a < b for a, b in zip(times, times[1:])), times
        assert all(len(p.positions) == len(decoded.joint_names) for p in decoded.points)
        before = stood.get(channel.topic, decoded.points[0].positions)
        assert all(abs(a - b) < 1e-6 for a, b in zip(before, decoded.points[0].positions)), channel.topic
        stood[channel.topic] = decoded.points[-1].positions
        count += 1
assert count > 0
print(f"ok    {count} messages on {len(stood)} topics, the same bytes when written again")

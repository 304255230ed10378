"""A recorded Franka Panda judged by programs that know nothing of this project.

    pip install -r tests/peers/requirements.txt
    pip install --no-deps robosuite==1.5.2 panda-python==1.1.1 example-robot-data==6.0.0
    matterixc run examples/redox.mtx --fidelity motion --out out
    python tests/peers/replay.py out/recording.mcap panda

Limits and contacts by MuJoCo with robosuite's Panda (meshes of the maker), kinematics by Pinocchio with the Panda of
example-robot-data and by panda_py, torques by inverse dynamics, tracking by a simulated arm under computed torque. The
last line counts what was judged; the exit status is 1 if anything is wrong.
"""

import importlib.util
import json
import pathlib
import sys

import mujoco
import numpy
import pinocchio
from mcap.reader import make_reader

ARM = 7
# Greatest acceleration (rad/s2) and jerk (rad/s3) of each joint: libfranka, include/franka/rate_limiting.h.
SPEED = numpy.array([2.175] * 4 + [2.61] * 3)
ACCELERATION = numpy.array([15, 7.5, 10, 12.5, 15, 20, 20])
JERK = numpy.array([7500, 3750, 5000, 6250, 7500, 10000, 10000])
# Torque of each joint, N m: the maker's data sheet (also franka_description 1.0.1).
TORQUE = numpy.array([87.0] * 4 + [12.0] * 3)
# Samples further apart belong to different motions, s.
PAUSE = 0.06
FRAME = 2e-3

wrong = []


def judge(what, value, limit, unit):
    good = bool(value <= limit)
    print(f"{'ok   ' if good else 'WRONG'} {what}: {value:.3g} {unit} of {limit:.3g}")
    if not good:
        wrong.append(what)


def packages(name):
    spec = importlib.util.find_spec(name)
    return pathlib.Path(spec.origin).parent if spec.origin else pathlib.Path(spec.submodule_search_locations[0])


def matrix(transform):
    t, r = transform["translation"], transform["rotation"]
    out = pinocchio.SE3.Identity()
    out.translation = numpy.array([t["x"], t["y"], t["z"]])
    out.rotation = pinocchio.Quaternion(r["w"], r["x"], r["y"], r["z"]).normalized().matrix()
    return out


def read(path, robot):
    """Samples (time, positions, speeds, accelerations), frames over time, points of things, grips."""
    samples, frames, points, grips = [], {}, {}, []
    with open(path, "rb") as file:
        for _, channel, message in make_reader(file).iter_messages(topics=["/joints", "/tf", "/grips"]):
            time, content = message.log_time * 1e-9, json.loads(message.data)
            if channel.topic == "/joints":
                joints = {j["name"]: j for j in content["joints"]}
                own = [joints.get(f"{robot}.panda_joint{i + 1}") for i in range(ARM)]
                if all(own):
                    samples.append([time] + [numpy.array([j[k] for j in own]) for k in ("position", "velocity", "acceleration")])
            elif channel.topic == "/tf":
                for transform in content["transforms"]:
                    name = transform["child_frame_id"]
                    if transform["parent_frame_id"] == "lab":
                        frames.setdefault(name, []).append((time, matrix(transform)))
                    else:
                        points[name] = (transform["parent_frame_id"], matrix(transform))
            elif content["robot"] == robot:
                grips.append((time, content["items"]))
    return samples, frames, points, grips


def at(way, time):
    return [pose for when, pose in way if when <= time + 1e-9][-1]


def motions(samples):
    """Stretches of samples that follow one another and move."""
    out = [[]]
    for sample in samples:
        if out[-1] and sample[0] - out[-1][-1][0] > PAUSE:
            out.append([])
        out[-1].append(sample)
    return [m for m in out if len(m) > 2 and any(numpy.abs(s[2]).max() > 1e-6 for s in m)]


def hermite(ts, q, v, time):
    i = min(max(numpy.searchsorted(ts, time, side="right") - 1, 0), len(ts) - 2)
    h = max(ts[i + 1] - ts[i], 1e-12)
    s = min(max((time - ts[i]) / h, 0.0), 1.0)
    position = (2 * s**3 - 3 * s**2 + 1) * q[i] + (s**3 - 2 * s**2 + s) * h * v[i]
    position += (3 * s**2 - 2 * s**3) * q[i + 1] + (s**3 - s**2) * h * v[i + 1]
    return position, v[i] + s * (v[i + 1] - v[i])


def full_mass(model, data):
    out = numpy.zeros((model.nv, model.nv))
    try:
        mujoco.mj_fullM(model, data, out)
    except TypeError:
        mujoco.mj_fullM(model, out, data.qM)
    return out


def track(model, motion):
    """Greatest and last error (rad) of an arm under computed torque with feedback, its torques within the actuators'."""
    data = mujoco.MjData(model)
    ts = numpy.array([s[0] for s in motion]) - motion[0][0]
    q, v = (numpy.array([s[k] for s in motion]) for k in (1, 2))
    data.qpos[:ARM] = q[0]
    worst = 0.0
    for step in range(int(numpy.ceil(ts[-1] / model.opt.timestep))):
        goal, speed = hermite(ts, q, v, step * model.opt.timestep)
        mujoco.mj_forward(model, data)
        wanted = 400 * (goal - data.qpos[:ARM]) + 40 * (speed - data.qvel[:ARM])
        ahead = hermite(ts, q, v, (step + 1) * model.opt.timestep)[1]
        wanted += (ahead - speed) / model.opt.timestep
        data.ctrl[:ARM] = full_mass(model, data)[:ARM, :ARM] @ wanted + data.qfrc_bias[:ARM] - data.qfrc_passive[:ARM]
        mujoco.mj_step(model, data)
        worst = max(worst, numpy.abs(goal - data.qpos[:ARM]).max())
    return worst, data.qpos[:ARM].copy()


def main():
    path, robot = sys.argv[1], sys.argv[2]
    samples, frames, points, grips = read(path, robot)
    moving = motions(samples)
    if not moving:
        sys.exit(f"no motion of `{robot}` in {path}")

    model = mujoco.MjModel.from_xml_path(str(packages("robosuite") / "models/assets/robots/panda/robot.xml"))
    data = mujoco.MjData(model)
    q, v, a = (numpy.array([s[k] for s in samples]) for k in (1, 2, 3))
    ts = numpy.array([s[0] for s in samples])
    lower, upper = model.jnt_range[:ARM].T
    judge("positions beyond the limits", max(0.0, (lower - q).max(), (q - upper).max()), 1e-9, "rad")
    judge("speed", (numpy.abs(v) / SPEED).max(), 1 + 1e-6, "of the maker's")
    judge("acceleration", (numpy.abs(a) / ACCELERATION).max(), 1 + 1e-6, "of the maker's")
    away, jerk = 0.0, 0.0
    for motion in moving:
        for (t0, q0, v0, a0), (t1, q1, v1, a1) in zip(motion, motion[1:]):
            if (h := t1 - t0) > 1e-6:
                away = max(away, numpy.abs((q1 - q0 - 0.5 * (v0 + v1) * h) / (ACCELERATION * h * h / 4)).max())
                jerk = max(jerk, numpy.abs((a1 - a0) / h / JERK).max())
    judge("jerk between samples", jerk, 1.0, "of the maker's")
    judge("positions against speeds", away, 1.0, "of what the greatest acceleration explains")

    # Kinematics, two ways.
    urdf = next(iter(pathlib.Path(sys.prefix).glob("lib/python*/site-packages/cmeel.prefix/share/example-robot-data/robots/panda_description/urdf/panda.urdf")))
    chain = pinocchio.buildModelFromUrdf(str(urdf))
    state, tip = chain.createData(), chain.getFrameId("panda_link8")

    def link8(configuration):
        pinocchio.framesForwardKinematics(chain, state, numpy.concatenate([configuration, numpy.zeros(chain.nq - ARM)]))
        return state.oMf[tip].copy()

    base = frames[f"{robot}.panda_link0"][0][1]
    far = 0.0
    for time, configuration, *_ in samples:
        recorded = base.inverse() * at(frames[f"{robot}.panda_link8"], time)
        own = link8(configuration)
        far = max(far, numpy.linalg.norm(own.homogeneous - recorded.homogeneous))
    judge("link8 against Pinocchio", far, 1e-6, "m")
    try:
        import panda_py
    except ImportError as why:
        print(f"skipped panda_py: {why}")
    else:
        far = 0.0
        for _, configuration, *_ in samples:
            own = link8(configuration)
            tool = own.translation + own.rotation @ [0, 0, 0.103]
            far = max(far, numpy.linalg.norm(tool - panda_py.fk(configuration)[:3, 3]))
        judge("hand against panda_py", far, 1e-4, "m")

    # Contacts and torques along all motions.
    contacts, share = 0, numpy.zeros(ARM)
    for motion in moving:
        stretch = numpy.array([s[0] for s in motion])
        rows = [numpy.array([s[k] for s in motion]) for k in (1, 2, 3)]
        for time in numpy.arange(stretch[0], stretch[-1], 0.005):
            data.qpos[:ARM], data.qvel[:ARM] = hermite(stretch, rows[0], rows[1], time)
            data.qacc[:ARM] = [numpy.interp(time, stretch, rows[2][:, j]) for j in range(ARM)]
            mujoco.mj_inverse(model, data)
            contacts += data.ncon
            share = numpy.maximum(share, numpy.abs(data.qfrc_inverse[:ARM]) / TORQUE)
    judge("contacts of the arm with itself", contacts, 0, "")
    judge("torque", share.max(), 1.0, "of the maker's")

    # An arm with masses follows them.
    error, ends = 0.0, 0.0
    for motion in moving:
        worst, last = track(model, motion)
        error = max(error, worst)
        ends = max(ends, numpy.linalg.norm(link8(last).translation - link8(motion[-1][1]).translation))
    judge("tracking", error, 0.01, "rad")
    judge("end of a tracked motion", ends, FRAME, "m")

    # Grips are at the frames of what is gripped.
    off, hand = 0.0, next(n for n in frames if n.startswith(f"{robot}.") and n.endswith("tcp"))
    for time, items in grips:
        if items:
            thing = at(frames[items[0]], time)
            own = [thing * inner for name, (above, inner) in points.items() if above == items[0]]
            reached = at(frames[hand], time).translation
            off = max(off, min(numpy.linalg.norm(p.translation - reached) for p in own))
    judge(f"{sum(1 for _, i in grips if i)} grips, from the frame", off, FRAME, "m")
    way = sum(m[-1][0] - m[0][0] for m in moving)
    print(f"{len(moving)} motions, {len(ts)} samples, {way:.1f} s; {len(wrong)} wrong")
    sys.exit(1 if wrong else 0)


main()

"""Forward kinematics of the robots in assets/robots by Pinocchio and by MuJoCo.

    pip install pin==4.1.0 mujoco==4.0.0 numpy
    python runtime/motion/tests/peers/forward.py golden            writes golden/NAME.tsv, 50 configurations each
    python runtime/motion/tests/peers/forward.py many FOLDER N     writes FOLDER/NAME.tsv, N configurations each

A line of NAME.tsv is the configuration, then the tip's position (m) and rotation matrix by rows, by Pinocchio. MuJoCo computes
the same from the same file; the greatest difference between the two is printed. `many` is read by
`MATTERIX_FORWARD=FOLDER cargo test -p matterix-motion --test forward`.
"""

import pathlib
import re
import sys

import mujoco
import numpy
import pinocchio

HERE = pathlib.Path(__file__).resolve().parent
ROBOTS = HERE.parents[3] / "assets" / "robots"
TIPS = {
    "panda": "panda_hand_tcp",
    "fr3": "fr3_hand_tcp",
    "ur3e": "tool0",
    "ur5e": "tool0",
    "iiwa7": "link_ee",
    "iiwa14": "link_ee",
    "kmr_iiwa": "link_ee",
}


def mujoco_model(path):
    # MuJoCo keeps links without mass, and links fixed to others, only when asked to; it refuses the Panda's inertia.
    options = '<mujoco><compiler fusestatic="false" balanceinertia="true" boundmass="1e-6" boundinertia="1e-9"/></mujoco>'
    text = path.read_text()
    return mujoco.MjModel.from_xml_string(re.sub(r"(<robot[^>]*>)", r"\1" + options, text, count=1))


def configurations(model, count, random):
    """Random positions of all joints that are not followers; unbounded ones within 2 pi."""
    lower, upper = [], []
    for name, joint in zip(model.names[1:], model.joints[1:]):
        bounded = joint.nq == joint.nv
        lower.append(model.lowerPositionLimit[joint.idx_q] if bounded else -2 * numpy.pi)
        upper.append(model.upperPositionLimit[joint.idx_q] if bounded else 2 * numpy.pi)
    return random.uniform(lower, upper, (count, len(lower)))


def place(model, data, tip, values):
    q = numpy.zeros(model.nq)
    for value, joint in zip(values, model.joints[1:]):
        if joint.nq == joint.nv:
            q[joint.idx_q] = value
        else:
            q[joint.idx_q], q[joint.idx_q + 1] = numpy.cos(value), numpy.sin(value)
    pinocchio.framesForwardKinematics(model, data, q)
    return data.oMf[tip]


def main():
    golden = sys.argv[1] == "golden"
    folder = HERE.parent / "golden" if golden else pathlib.Path(sys.argv[2])
    count = 50 if golden else int(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    random = numpy.random.default_rng(7)
    for name, tip_name in TIPS.items():
        path = ROBOTS / name / f"{name}.urdf"
        whole = pinocchio.buildModelFromUrdf(str(path))
        fingers = [i for i, n in enumerate(whole.names) if "finger" in n]
        model = pinocchio.buildReducedModel(whole, fingers, pinocchio.neutral(whole))
        data, tip = model.createData(), model.getFrameId(tip_name)
        mj = mujoco_model(path)
        mjdata, body = mujoco.MjData(mj), mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_BODY, tip_name)
        addresses = [mj.joint(n).qposadr[0] for n in model.names[1:]]
        worst, lines = 0.0, []
        for values in configurations(model, count, random):
            pose = place(model, data, tip, values)
            mjdata.qpos[:] = 0.0
            mjdata.qpos[addresses] = values
            mujoco.mj_kinematics(mj, mjdata)
            worst = max(worst, abs(pose.translation - mjdata.xpos[body]).max())
            numbers = [*values, *pose.translation, *pose.rotation.flatten()]
            lines.append("\t".join(repr(float(x)) for x in numbers))
        (folder / f"{name}.tsv").write_text(f"# {tip_name}\n" + "\n".join(lines) + "\n")
        print(f"{name}: {count} configurations, Pinocchio and MuJoCo differ by {worst:.1e} m at most")


main()

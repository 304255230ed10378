"""Inverse kinematics of the same robots and poses by TRAC-IK, OptIK and ikpy.

    pip install pin==4.1.0 pytracik==0.0.3 optik-py==0.5.0 ikpy==4.2.1 numpy
    cargo bench -p matterix-motion --bench kinematics -- poses FOLDER
    python runtime/motion/benches/kinematics/peers.py FOLDER [COUNT]

The poses are those of the configurations in FOLDER, computed by Pinocchio; searches begin in the middle of the limits. A pose
is reached when the solution is within all limits and the tip, computed by Pinocchio, within 1 mm and 0.1 deg. Times include
the call from Python, some 2 us. TRAC-IK runs two threads at once and has 20 ms; OptIK runs one, for up to 100 ms.
"""

import pathlib
import re
import sys
import time
import warnings

import numpy
import optik
import pinocchio
import pytracik

HERE = pathlib.Path(__file__).resolve().parent
ROBOTS = HERE.parents[3] / "assets" / "robots"
warnings.filterwarnings("ignore")


def bare(path, folder):
    """The links and joints alone, in URDF 1.0: not all readers know capsules."""
    text = re.sub(r"<(visual|collision)>.*?</\1>\s*", "", path.read_text(), flags=re.S)
    text = re.sub(r' (version|acceleration|jerk)="[0-9.]*"(?=[ />])', "", text.replace('<?xml version="1.0"?>', ""))
    out = folder / f"{path.stem}.bare.urdf"
    out.write_text(text)
    return out


class Robot:
    def __init__(self, name, tip, folder, urdf):
        lines = (folder / f"{name}.tsv").read_text().splitlines()[1:]
        self.all = numpy.array([[float(x) for x in line.split("\t")] for line in lines])
        self.urdf, self.tip_name = urdf, tip
        whole = pinocchio.buildModelFromUrdf(str(urdf))
        fingers = [i for i, n in enumerate(whole.names) if "finger" in n]
        self.model = pinocchio.buildReducedModel(whole, fingers, pinocchio.neutral(whole))
        self.data, self.tip = self.model.createData(), self.model.getFrameId(tip)
        self.root = self.model.frames[1].name
        bounded = [j.nq == j.nv for j in self.model.joints[1:]]
        index = [j.idx_q for j in self.model.joints[1:]]
        self.lower = numpy.array([self.model.lowerPositionLimit[i] if b else -1e9 for i, b in zip(index, bounded)])
        self.upper = numpy.array([self.model.upperPositionLimit[i] if b else 1e9 for i, b in zip(index, bounded)])
        self.middle = numpy.where(bounded, (self.lower + self.upper) / 2, 0.0)

    def pose(self, values):
        q = numpy.zeros(self.model.nq)
        for value, joint in zip(values, self.model.joints[1:]):
            if joint.nq == joint.nv:
                q[joint.idx_q] = value
            else:
                q[joint.idx_q], q[joint.idx_q + 1] = numpy.cos(value), numpy.sin(value)
        pinocchio.framesForwardKinematics(self.model, self.data, q)
        return self.data.oMf[self.tip].copy()

    def reaches(self, solution, target):
        if solution is None or len(solution) != len(self.middle):
            return False
        if (solution < self.lower - 1e-9).any() or (solution > self.upper + 1e-9).any():
            return False
        off = self.pose(solution).actInv(target)
        return numpy.linalg.norm(off.translation) < 1e-3 and numpy.linalg.norm(pinocchio.log3(off.rotation)) < numpy.deg2rad(0.1)


def trac_ik(robot):
    solver = pytracik.TRAC_IK(robot.root, robot.tip_name, robot.urdf.read_text(), 0.02, 1e-6, pytracik.SolveType.Speed)

    def solve(target):
        quaternion = pinocchio.Quaternion(target.rotation)
        found = pytracik.ik(solver, robot.middle, *target.translation, *quaternion.coeffs())
        return numpy.array(found[1:]) if found[0] >= 0 else None

    return solve


def optik_speed(robot):
    solver = optik.Robot.from_urdf_file(str(robot.urdf), robot.root, robot.tip_name)
    solver.set_parallelism(1)
    config = optik.SolverConfig(solution_mode="speed", max_time=0.1, tol_f=1e-12)

    def solve(target):
        found = solver.ik(config, target.homogeneous, robot.middle)
        return None if found is None else numpy.array(found[0])

    return solve


def ikpy_scipy(robot):
    from ikpy.chain import Chain

    chain = Chain.from_urdf_file(str(robot.urdf), base_elements=[robot.root])
    names = list(robot.model.names[1:])
    places = [next(i for i, link in enumerate(chain.links) if link.name == n) for n in names]
    chain.active_links_mask = numpy.array([i in places for i in range(len(chain.links))])
    start = numpy.zeros(len(chain.links))
    start[places] = robot.middle
    tip = len(chain.links)

    def solve(target):
        return chain.inverse_kinematics_frame(target.homogeneous, initial_position=start, orientation_mode="all")[places]

    if chain.links[tip - 1].name == "":
        raise ValueError("no tip")
    return solve


def main():
    folder = pathlib.Path(sys.argv[1])
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 10_000
    print("| robot | peer | poses | reached | median | mean | 95 % |\n| --- | --- | --- | --- | --- | --- | --- |")
    for path in sorted(folder.glob("*.tsv")):
        name = path.stem
        tip = path.read_text().splitlines()[0].removeprefix("# ")
        robot = Robot(name, tip, folder, bare(ROBOTS / name / f"{name}.urdf", folder))
        for peer, make, most in (("TRAC-IK", trac_ik, count), ("OptIK", optik_speed, count), ("ikpy", ikpy_scipy, 20)):
            try:
                solve = make(robot)
                targets = [robot.pose(q) for q in robot.all[: min(most, count)]]
                times, reached = [], 0
                for target in targets:
                    began = time.perf_counter()
                    solution = solve(target)
                    times.append((time.perf_counter() - began) * 1e6)
                    reached += bool(robot.reaches(solution, target))
                share = 100 * reached / len(targets)
                middle, late = numpy.percentile(times, [50, 95])
                row = f"{len(targets)} | {share:.2f} % | {middle:.1f} us | {numpy.mean(times):.1f} us | {late:.1f} us"
            except BaseException as error:  # a panic of a library in Rust is no Exception
                row = f"0 | failed: {error} | | |"
            print(f"| {name} | {peer} | {row} |", flush=True)


main()

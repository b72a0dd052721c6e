"""Builds meshes of equal size with tetralod and with VTK's vtkUnstructuredGridQuadricDecimation, measures both by the same means,
and prints tables: started by `cargo xtask bench --against-vtk`. Needs vtk and, for memory, Linux.

    run.py TETRALOD MEASURE FOLDER INPUT...        MEASURE: the program of benches/quality
"""

import json
import os
import subprocess
import sys
from pathlib import Path

SHARES = [0.5, 0.2, 0.1, 0.05, 0.02]
# A decimation that takes longer is given up.
PATIENCE = 300
# VTK meets what it is asked for within a few tetrahedra, or it is stuck far above.
STUCK = 0.1


def run(arguments):
    """What a program prints, and the most memory that it took, in bytes; ends if it fails."""
    with subprocess.Popen(list(map(str, arguments)), stdout=subprocess.PIPE, text=True) as process:
        output = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{' '.join(map(str, arguments))} failed: {process.returncode}")
    return output, 1024 * usage.ru_maxrss


def decimated(mesh, field, share, target):
    """What decimate.py says, or why it said nothing."""
    script = Path(__file__).with_name("decimate.py")
    command = [sys.executable, script, mesh, field, str(share), target]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return None, f"took more than {PATIENCE} s"
    if done.returncode:
        return None, f"ended with {done.returncode}"
    return json.loads(done.stdout), None


class Volume:
    """A set: the mesh, its MT file and what each program took for it."""

    def __init__(self, tools, folder, path):
        self.tetralod, self.measure = tools
        self.folder = folder
        self.name = path.stem
        self.mesh, self.mt = folder / "input.vtu", folder / "built.mt"
        self.field = run([self.measure, "tetrahedra", path, self.mesh])[0].strip()
        arguments = ["build", self.mesh, "-o", self.mt, "--threads", 1, "--json"]
        report, self.bytes = run([self.tetralod, *arguments])
        self.built = json.loads(report)

    def meshes(self):
        """For each share the meshes of equal size, of tetralod and of VTK, and what VTK took."""
        for share in SHARES:
            own, theirs = (self.folder / f"{tool}{share}.vtu" for tool in ("tetralod", "vtk"))
            took, failure = decimated(self.mesh, self.field, share, theirs)
            if failure:
                yield share, None, failure, None
                continue
            arguments = ["extract", self.mt, "--budget", took["tets"], "--json", "-o"]
            bound = json.loads(run([self.tetralod, *arguments, own])[0])["relative_error_bound"]
            yield share, (own, theirs), took, bound
            if took["tets"] > (1 + STUCK) * share * self.built["tetrahedra"]:
                # It went no further, and would not for less.
                return


def percent(part):
    return f"{100 * part:.3g}"


def both(rows, key):
    """The numbers of the two meshes, the least one bold."""
    least = min(row[key] for row in rows)
    return " | ".join(f"**{percent(row[key])}**" if row[key] == least else percent(row[key]) for row in rows)


def counts(ours, theirs, key):
    return f"{ours[key]} | {theirs[key]}"


def main(tetralod, measure, folder, *inputs):
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    errors, costs, won, rows = [], [], {"max": 0, "rms": 0}, 0
    for path in map(Path, inputs):
        print(path, file=sys.stderr)
        volume = Volume((tetralod, measure), folder, path)
        of_vtk = []
        for share, meshes, took, bound in volume.meshes():
            head = f"| {volume.name} | {percent(share)} "
            if meshes is None:
                errors.append(f"{head}| VTK {took} | | | | | | | | | | | |")
                continue
            lines = run([measure, "compare", volume.mesh, *meshes])[0].splitlines()
            whole, *found = map(json.loads, lines)
            ours, theirs = found
            of_vtk.append((took, theirs["tets"]))
            if ours["tets"] <= theirs["tets"]:
                rows += 1
                for key in won:
                    won[key] += ours[key] <= theirs[key]
            errors.append(
                f"{head}| {counts(ours, theirs, 'tets')} | {percent(bound)} | {both(found, 'max')} "
                f"| {both(found, 'rms')} | {counts(ours, theirs, 'outside')} | {counts(ours, theirs, 'turned')} "
                f"| {percent(ours['volume'] / whole['volume'] - 1)} | {percent(theirs['volume'] / whole['volume'] - 1)} |"
            )
        removed = volume.built["tetrahedra"] - volume.built["base_tetrahedra"]
        seconds = volume.built["seconds"]
        cost = f"| {volume.name} | {volume.built['tetrahedra']} | {seconds:.1f} | {removed / seconds / 1000:.0f} "
        cost += f"| {volume.bytes / 1e6:.0f} "
        if of_vtk:
            took, left = of_vtk[-1]
            speed = (volume.built["tetrahedra"] - left) / took["seconds"] / 1000
            cost += f"| {took['seconds']:.1f} | {speed:.0f} | {took['bytes'] / 1e6:.0f} |"
        else:
            cost += "| – | – | – |"
        costs.append(cost)
    print(f"Of {rows} pairs of meshes of equal size tetralod has the lower or the same maximum in {won['max']}, root of the mean square in "
          f"{won['rms']}.\n")
    print("| set | of the input % | tets | VTK's | bound % | max % | VTK's | RMS % | VTK's | outside | VTK's | turned | VTK's | volume % "
          "| VTK's |")
    print("|---|--:" + "|--:" * 13 + "|")
    print("\n".join(errors))
    print("\n| set | tets | build s | thousand/s | MB | VTK, to the least s | thousand/s | MB |")
    print("|---|--:" + "|--:" * 6 + "|")
    print("\n".join(costs))


main(*sys.argv[1:])

"""thermbalctl simulate against ngspice: the network as a circuit (temperature = voltage, heat = current)."""
import csv
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

PROGRAM = pathlib.Path(os.environ["THERMBAL_BIN_DIR"]) / "thermbalctl"
STEP_S, END_S = 60, 7200

MODEL = """
[model]
ambient_C = 20.0
[[node]]
name = "bearing"
heat_capacity_J_per_K = 2500.0
[[node]]
name = "housing"
heat_capacity_J_per_K = 16000.0
[[link]]
between = ["bearing", "housing"]
conductance_W_per_K = 8.0
[[link]]
between = ["housing", "ambient"]
conductance_W_per_K = 5.0
[[source]]
node = "bearing"
power_W = 140.0
[[sensor]]
channel = "T2"
node = "bearing"
[[sensor]]
channel = "T3"
node = "housing"
[[effect]]
kind = "friction_viscosity"
source = "bearing"
beta_per_K = 0.025
[[effect]]
kind = "preload_growth"
source = "bearing"
growth_per_K = 0.03
[[effect]]
kind = "surface_nonlinearity"
exponent = 0.3
[[effect]]
kind = "sensor_lag"
channel = "T2"
time_constant_s = 200.0
"""

# B sources carry the nonlinear currents; RL and CL are the lagging sensor behind an ideal amplifier.
NETLIST = f"""* two thermal masses with friction that depends on temperature and a surface that is not linear
Va amb 0 DC 20
Cb bear 0 2500 IC=20
Ch hous 0 16000 IC=20
Rbh bear hous 0.125
Bf 0 bear I=140*exp(-0.025*(V(bear)-20))*max(0,1+0.03*(V(bear)-V(hous)))
Bs hous 0 I=5*pow((V(hous)-20)*(V(hous)-20)+1,0.15)/pow(10,0.3)*(V(hous)-20)
El seen 0 bear 0 1
RL seen read 200
CL read 0 1 IC=20
.options reltol=1e-7 abstol=1e-9 vntol=1e-9 method=gear maxord=4
.tran {STEP_S} {END_S} 0 5 UIC
.control
run
linearize v(read) v(hous)
set wr_singlescale
wrdata OUT v(read) v(hous)
quit 0
.endc
.end
"""


def simulated(folder):
    (folder / "model.toml").write_text(MODEL)
    subprocess.run([PROGRAM, "simulate", folder / "model.toml", "--duration-min", str(END_S / 60), "--every-s", str(STEP_S),
                    "--csv", folder / "ours.csv"], check=True, timeout=60)
    with open(folder / "ours.csv", newline="") as file:
        return {float(row["time_s"]): (float(row["T2"]), float(row["T3"])) for row in csv.DictReader(file)}


def circuit(folder):
    (folder / "network.cir").write_text(NETLIST.replace("OUT", str(folder / "spice.txt")))
    subprocess.run(["ngspice", "-b", folder / "network.cir"], check=True, timeout=60, capture_output=True, cwd=folder)
    rows = [[float(word) for word in line.split()] for line in (folder / "spice.txt").read_text().splitlines()]
    return {row[0]: (row[1], row[2]) for row in rows}


def main():
    if shutil.which("ngspice") is None:
        print("skipped: ngspice is not installed")
        return 77
    with tempfile.TemporaryDirectory() as name:
        ours, theirs = simulated(pathlib.Path(name)), circuit(pathlib.Path(name))
    compared = worst = 0
    for time_s, values in theirs.items():
        nearest = round(time_s / STEP_S) * STEP_S
        if abs(time_s - nearest) > 1e-6 or nearest not in ours:
            continue
        compared += 1
        worst = max(worst, *(abs(a - b) for a, b in zip(values, ours[nearest])))
    rise = max(max(values) for values in ours.values()) - 20.0
    print(f"{compared} samples, largest difference {worst:.2e} C, rise {rise:.1f} C")
    return 0 if compared == END_S // STEP_S + 1 and worst < 5e-3 and rise > 8.0 else 1


if __name__ == "__main__":
    sys.exit(main())

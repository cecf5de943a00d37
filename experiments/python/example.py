"""Two controllers on a plant neither knows, and a variant of one's own. Cells for an editor that runs them (`# %%`), or
as a whole:

    PYTHONPATH=build/release/python python3 experiments/python/example.py [figure.png]
"""

# %% Two variants on the truth plant, with a payload that nobody told them of
import sys

import numpy as np

import solenoid

task = solenoid.scenario("sine", trajectory="sine", plant="twin", noise=True, payload_kg=0.1)
runs = {name: solenoid.simulate(solenoid.variant(name), task, seed=1) for name in ("thesis_pd", "nine_robust")}
for name, run in runs.items():
    m = run.metrics
    print(f"{name:12} RMSE {m.rmse_mm:.4f} mm, {m.switches_per_s:.0f} switches/s, {m.air_g:.2f} g of air")

# %% What the second believed the payload to be, after a second of motion
print(f"payload, estimated: {runs['nine_robust'].payload_kg[2000]:.3f} kg")

# %% A variant of one's own: the same with dearer switches
quiet = solenoid.variant("mine", base="nine_robust", cost={"switching": 1e-7})
runs["mine"] = solenoid.simulate(quiet, task)
print(f"mine: RMSE {runs['mine'].metrics.rmse_mm:.4f} mm, {runs['mine'].metrics.switches_per_s:.0f} switches/s")

# %% The loop by hand: any other controller could stand here
controller, plant = solenoid.Controller(quiet, task), solenoid.Plant(quiet, task, seed=1)
errors = np.empty(len(runs["mine"]))
for k in range(len(errors)):
    sensors = plant.read(k * 1e-3)
    decision = controller.step(sensors)
    plant.write(decision.command)
    errors[k] = decision.reference_m - sensors.truth[0]
print(f"by hand: RMSE {1e3 * np.sqrt(np.mean(errors**2)):.4f} mm")

# %% A campaign as a table
rows = solenoid.table(solenoid.run_campaign(variants=["thesis_pd", "nine_state"], scenarios=["cycloidal_0", "sine_0"]))
for row in rows:
    print(f"{row['scenario']:12} {row['variant']:12} {row['rmse_mm']:.4f} mm")

# %% Errors over time
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(9, 5), layout="constrained")
for name, run in runs.items():
    above.plot(run.time_s, 1e3 * (run.reference_m - run.truth[:, 0]), label=name, linewidth=0.8)
below.plot(run.time_s, 1e-3 * run.truth[:, 2:], linewidth=0.8, label=["chamber A", "chamber B"])
above.set_ylabel("error, mm")
below.set(xlabel="time, s", ylabel="pressure (mine), kPa")
above.legend(loc="upper right")
below.legend(loc="upper right")
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "solenoid.png", dpi=120)

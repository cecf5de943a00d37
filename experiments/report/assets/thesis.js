// What the thesis prints for a run, where report.json has it (experiments/systems/actuator/simulation/thesis_cell.hpp).

// Keys of a run's metrics, and the thesis's figure beside each.
const THESIS_KEYS = { rmse_mm: "rmse_mm", mae_mm: "mae_mm", rmse_measured_mm: "rmse_mm", mae_measured_mm: "mae_mm", sse_mean_abs_mm: "sse_mm", sse_abs_mean_mm: "sse_mm", ssa_mm: "ssa_mm" };

// The thesis's simulations are set against the true position, its measurements against the measured one.
function thesisFigure(run, key) {
  const measured = key.includes("measured");
  if (!run.thesis || (key.startsWith("rmse") || key.startsWith("mae") ? measured !== run.thesis.measured : false)) return undefined;
  return run.thesis[THESIS_KEYS[key]];
}

const thesisHeading = (run) => `thesis, ${run.thesis.measured ? "measured" : "simulated"} (Table ${run.thesis.table})`;

const thesisNumber = (text) => (text === undefined ? undefined : Number(text.replace("<", "")));

// The column of runs that stands after a metric's; none after most.
function thesisColumns(key) {
  if (key !== "rmse_mm" && key !== "mae_mm") return [];
  return [{
    key: `thesis_${key}`, label: "Thesis", unit: "mm", optional: true, title: "the same in the thesis's table", value: (r) => thesisNumber(r.thesis?.[key]),
    show: (r) => (r.thesis ? element("span", { title: `Table ${r.thesis.table}, ${r.thesis.measured ? "measured" : "simulated"}` }, r.thesis[key]) : "-"),
  }];
}

// Tables and text: what was asked, verdicts, timing, seeds, problems, where the numbers come from.

// A table from columns of [heading, cell of a row, "number" or ""].
function table(caption, columns, rows) {
  const head = columns.map(([heading, , kind]) => el("th", { scope: "col", class: kind }, heading));
  const body = rows.map((row) =>
    el("tr", {}, columns.map(([, cell, kind], index) =>
      el(index === 0 ? "th" : "td", { class: kind, scope: index === 0 ? "row" : undefined }, cell(row)))));
  return el("div", { class: "wide", tabindex: "0", role: "region", "aria-label": caption },
    el("table", {}, el("caption", {}, caption), el("thead", {}, el("tr", {}, head)), el("tbody", {}, body)));
}

const part = (id, heading, ...children) =>
  el("section", { id, class: "part", "aria-labelledby": `${id}-title` }, el("h2", { id: `${id}-title` }, heading), ...children);

function percent(fraction) {
  return known(fraction) ? `${Math.round(100 * fraction)} %` : NONE;
}

function timingPart() {
  if (!report.timing.length) return null;
  const time = (seconds) => (known(seconds) ? (seconds < 1e-3 ? `${short(1e6 * seconds)} µs` : seconds < 1 ? `${short(1e3 * seconds)} ms` : `${short(seconds)} s`) : NONE);
  return part("timing", "Costs and times", table("Costs and times of a step beside the paper's", [
    ["method", (row) => row.method, ""],
    ["size", (row) => row.size, ""],
    ["cost, paper", (row) => short(row.paper_cost), "number"],
    ["cost", (row) => short(row.cost), "number"],
    ["step, paper", (row) => time(row.paper_time_s), "number"],
    ["step", (row) => time(row.time_s), "number"],
    ["ratio", (row) => short(row.ratio), "number"],
    ["how measured", (row) => row.note, "text"],
  ], report.timing));
}

function seedsPart() {
  if (!report.seeds.length) return null;
  const columns = [
    ["controller", (row) => row.controller, ""],
    ["course", (row) => row.course, ""],
    ["runs", (row) => String(row.runs), "number"],
    ["completed", (row) => percent(row.completed_fraction), "number"],
    ["of all, safe", (row) => percent(row.safe_fraction), "number"],
    ["median of max |LTR|", (row) => fixed(row.ltr_abs_median, 3), "number"],
    ["worst", (row) => fixed(row.ltr_abs_worst, 3), "number"],
    ["mean km/h", (row) => fixed(row.speed_mean_median_kmh, 1), "number"],
    ["lowest km/h", (row) => fixed(row.speed_min_worst_kmh, 1), "number"],
    ["off path m", (row) => fixed(row.path_deviation_worst_m, 2), "number"],
    ["cost, median", (row) => short(row.cost_median), "number"],
  ];
  // Several long tables would hide what comes below.
  const names = [...new Set(report.seeds.map((row) => row.scene))];
  return part("seeds", "Over the seeds", names.map((name) => {
    const rows = table(`Outcomes over the recording seeds: ${name}`, columns, report.seeds.filter((row) => row.scene === name));
    return names.length > 1 ? el("details", {}, el("summary", {}, name), rows) : rows;
  }));
}

function runsTable(scene) {
  const has = (name) => scene.runs.some((run) => known(run.figures[name]));
  const figure = (heading, name, digits) =>
    has(name) ? [[heading, (run) => (digits === undefined ? short(run.figures[name]) : fixed(run.figures[name], digits)), "number"]] : [];
  return table(`Runs: ${scene.title}`, [
    ["run", (run) => [swatch(run.look), " ", run.label], ""],
    ["outcome", (run) => outcomeBadge(run), ""],
    ...figure("end s", "end_time_s", 2),
    ...figure("max |LTR|", "ltr_abs_max", 3),
    ...figure("|LTR| > 1 s", "ltr_violation_s", 2),
    ...figure("max roll °", "roll_abs_max_deg", 1),
    ...figure("min km/h", "speed_min_kmh", 1),
    ...figure("mean km/h", "speed_mean_kmh", 1),
    ...figure("off path m", "path_deviation_max_m", 2),
    ...figure("correction °", "steering_correction_max_deg", 1),
    ...figure("cost", "cost"),
    ...figure("fallback steps", "fallback_steps", 0),
    ...figure("step µs median", "step_time_median_us", 0),
    ...figure("longest", "step_time_max_us", 0),
  ], scene.runs);
}

function problemsPart() {
  if (!report.problems.length) return null;
  return part("problems", "Files not read, or not wholly", table("Problems with files", [
    ["file", (problem) => problem.file, ""],
    ["line", (problem) => (known(problem.line) ? String(problem.line) : NONE), "number"],
    ["what", (problem) => problem.reason, "text"],
  ], report.problems));
}

function aboutPart() {
  const from = report.provenance;
  const rates = report.scenes.filter((scene) => scene.grid.count > 0).map((scene) => {
    const shown = 1 / scene.grid.step_s;
    const logged = scene.runs.map((run) => run.log_interval_s).filter((s) => s > 0);
    const rate = logged.length ? `, logged at ${short(1 / Math.min(...logged))} Hz` : "";
    return `${scene.title}: ${short(shown)} values a second${rate}`;
  });
  const facts = [
    ["Version", from.version],
    ["Command", from.command],
    ["Seeds", from.seeds.join(", ")],
    ["Machine", from.machine],
  ].filter(([, value]) => value);
  return part("about", "About these numbers",
    report.notes.map((note) => el("p", {}, prose(note))),
    el("p", {}, "Tables are computed from every row of the logs. Plots and replay show fewer values (",
      rates.join("; "), "), 16 bits each: plots keep the smallest and the largest of what they leave out, the replay follows straight lines. Full data are in the logs, figures and tables for a paper beside this page."),
    el("dl", { class: "facts" }, facts.map(([name, value]) => [el("dt", {}, name), el("dd", {}, value)])));
}

function header() {
  const counts = {};
  for (const scene of report.scenes)
    for (const run of scene.runs) counts[outcomeWords(run)] = (counts[outcomeWords(run)] ?? 0) + 1;
  const words = Object.entries(counts).map(([words, n]) => `${n} ${words}`).join(", ");
  const runs = report.scenes.reduce((sum, scene) => sum + scene.runs.length, 0);
  document.getElementById("top").append(
    el("h1", {}, report.title),
    ...report.asked.map((text) => el("p", { class: "lead" }, prose(text))),
    el("p", { class: "soft" }, `${runs} run${runs === 1 ? "" : "s"} shown: ${words}.`,
      report.unlogged_runs ? [` The verdicts count ${report.unlogged_runs} more, whose numbers are in `, el("code", {}, "tables/runs.csv"), "."] : null),
    report.problems.length ? el("p", { class: "notice" },
      `${report.problems.length} problem${report.problems.length === 1 ? "" : "s"} with files: `,
      el("a", { href: "#problems" }, "see which"), ".") : "");
}


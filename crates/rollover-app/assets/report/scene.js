// A scene: its runs, its plots, its replay.

// A run with its columns unpacked and looked up by time.
class RunView {
  constructor(data, grid) {
    Object.assign(this, data);
    this.grid = grid;
    this.column = {};
    for (const [name, packed] of Object.entries(data.columns)) this.column[name] = unpack(packed);
    const end = data.figures.end_time_s;
    this.end = known(end) ? end : grid.start_s;
    const loads = LOADS.filter((name) => this.has(name)).map((name) => data.columns[name].high);
    this.fullLoad = Math.max(1, ...loads);
  }

  has(...names) {
    return names.every((name) => this.column[name] !== undefined);
  }

  // The value at a time, on a line between the samples; after the end, the last one.
  at(name, time) {
    const values = this.column[name];
    const place = Math.max(0, (Math.min(time, this.end) - this.grid.start_s) / this.grid.step_s);
    let before = Math.min(values.length - 1, Math.floor(place));
    const share = Math.min(1, place - before);
    const after = Math.min(values.length - 1, before + 1);
    if (Number.isNaN(values[before])) return time > this.end ? this.lastOf(values) : NaN;
    if (share === 0 || Number.isNaN(values[after])) return values[before];
    return values[before] + share * (values[after] - values[before]);
  }

  lastOf(values) {
    let last = values.length - 1;
    while (last >= 0 && Number.isNaN(values[last])) last--;
    return last >= 0 ? values[last] : NaN;
  }

  smoothRoll(time) {
    return this.at(this.has("roll_smooth_deg") ? "roll_smooth_deg" : "roll_deg", time);
  }

  // Direction of travel, where the heading is not logged.
  courseAt(time) {
    const step = this.grid.step_s;
    const [dx, dy] = ["x_m", "y_m"].map((name) => this.at(name, time + step) - this.at(name, time - step));
    return Math.atan2(dy, dx) || 0;
  }

  // Which wheels carry nothing.
  lifted(time) {
    return LOADS.map((name) => this.has(name) && this.at(name, time) < LIFTED_N);
  }

  // Whether the run has ended in a rollover or a spin by then.
  over(time) {
    return this.ended_early && time >= this.end - 1e-9;
  }

  // When a vehicle comes into danger: |LTR| at its limit for the first time, else at its largest.
  dangerTime(limit) {
    const values = this.column.ltr;
    const first = values ? values.findIndex((v) => Math.abs(v) > limit) : -1;
    return first < 0 ? this.peakTime() : Math.min(this.end, this.grid.start_s + first * this.grid.step_s);
  }

  peakTime() {
    const values = this.column.ltr;
    if (!values) return this.grid.start_s;
    let peak = -1;
    values.forEach((v, k) => {
      if (!Number.isNaN(v) && (peak < 0 || Math.abs(v) > Math.abs(values[peak]))) peak = k;
    });
    return Math.min(this.end, this.grid.start_s + Math.max(0, peak) * this.grid.step_s);
  }
}

const scenes = [];

class SceneView {
  constructor(data, index) {
    Object.assign(this, data);
    this.key = `scene-${index + 1}`;
    this.number = index + 1;
    this.start = this.grid.start_s;
    this.runs = data.runs.filter((run) => Object.keys(run.columns).length).map((run) => new RunView(run, this.grid));
    this.end = Math.max(this.start, ...this.runs.map((run) => run.end));
    this.box = bounds(this);
    this.plots = [];
    this.element = part(this.key, this.title,
      this.description ? el("p", {}, prose(this.description)) : null);
    this.element.classList.add("scene");
    if (this.runs.length) this.build();
  }

  indexAt(time) {
    return Math.max(0, Math.min(this.grid.count - 1, Math.round((time - this.start) / this.grid.step_s)));
  }

  build() {
    this.replay = new Replay(this);
    this.toggles = this.runs.map((run) => el("button", {
      type: "button", class: "toggle", "aria-pressed": String(run.shown), title: run.description || undefined,
      onclick: () => this.toggle(run),
    }, swatch(run.look), el("span", {}, run.label)));
    this.castButtons = this.casts.map((cast) => el("button", {
      type: "button", class: "cast", onclick: () => this.showCast(cast),
    }, cast.name));
    this.plotsBox = el("div", { class: "plots" });
    if (this.box) {
      this.course = el("canvas", { class: "course", role: "img", "aria-label": `The road from above: ${this.title}` });
      this.course.addEventListener("click", (event) => this.goToPlace(event));
      this.plotsBox.append(el("figure", { "data-plot": "road" }, el("div", { class: "plot-head" },
        el("h4", {}, "Road from above")), this.course,
        el("figcaption", {}, "Where the vehicles went; A and B are at the replay's time. A click moves the replay there.")));
    }
    const notes = this.runs.filter((run) => run.description);
    this.element.append(
      runsTable(this),
      notes.length ? el("details", {}, el("summary", {}, "What the controllers are"),
        el("dl", { class: "facts" }, notes.map((run) => [el("dt", {}, run.label), el("dd", {}, prose(run.description))]))) : "",
      this.runs.length > 3 ? el("div", { class: "casts", role: "group", "aria-label": "Choices of runs for the plots" },
        el("span", { class: "soft" }, "Show"), this.castButtons,
        el("button", { type: "button", onclick: () => this.showAll(true) }, "All"),
        el("button", { type: "button", onclick: () => this.showAll(false) }, "None")) : "",
      el("div", { class: "toggles", role: "group", "aria-label": "Runs shown in the plots" }, this.toggles),
      el("p", { class: "soft small-print hint" }, "Drag over a plot to zoom, double click to see all, click to move the replay. Press ? for keys."),
      el("div", { class: "stage" }, this.plotsBox, this.replay.element));
  }

  // Draws what needs a place on the page.
  drawPlots() {
    if (!this.runs.length) return;
    const times = Array.from({ length: this.grid.count }, (_, k) => this.start + k * this.grid.step_s);
    for (const plot of report.plots) {
      const lines = [];
      for (const run of this.runs) {
        if (!run.has(plot.column)) continue;
        if (plot.companion && run.has(plot.companion))
          lines.push({ label: run.label, values: run.column[plot.companion], look: run.look, thin: true, run: null, owner: run });
        lines.push({ label: run.label, values: run.column[plot.column], look: run.look, run, owner: run });
      }
      const says = lines.some(({ values }) => values.some((v) => v !== 0 && !Number.isNaN(v)));
      if (!lines.length || !says) continue;
      this.add(timePlot(this, { ...plot, atLeast: plot.at_least, limits: this.limit_values[plot.name] ?? [] }, lines, times));
    }
    this.times = times;
    this.drawLoadsPlot();
    if (this.profile) this.add(profilePlot(this));
    // Not within the observer: a plot that grows would call it again.
    new ResizeObserver(() => requestAnimationFrame(() => this.resize())).observe(this.plotsBox);
    repaints.push(() => {
      for (const { u } of this.plots) u.redraw(false);
      this.replay.draw();
    });
    // Of many runs only one of each controller is drawn at first.
    for (const run of this.runs.filter((one) => !one.shown)) this.show(run, false);
    this.resize();
    this.replay.draw();
  }

  add(plot) {
    this.plots.push(plot);
    this.plotsBox.append(plot.figure);
  }

  loadLines() {
    const run = this.replay.first;
    return LOADS.map((name, wheel) => ({
      label: WHEELS[wheel], look: WHEEL_LOOKS[wheel],
      values: run.has(name) ? run.column[name].map((v) => v / 1000) : new Float64Array(this.grid.count).fill(NaN),
    }));
  }

  // Wheel loads of vehicle A: four lines are enough for one plot.
  drawLoadsPlot() {
    if (!this.runs.some((run) => run.has(...LOADS))) return;
    this.loads = timePlot(this, {
      name: "wheel-loads", title: "Wheel loads", axis: "kN", digits: 2, atLeast: [0, 1], limits: [],
      caption: "Vertical tyre loads of vehicle A. Blue: left, orange: right; whole line: front, dashed: rear.",
    }, this.loadLines(), this.times);
    this.add(this.loads);
    this.chosen();
  }

  // Vehicle A or B is another one.
  chosen() {
    if (!this.loads) return;
    const lines = this.loadLines();
    this.loads.lines.forEach((line, index) => (line.values = lines[index].values));
    this.loads.heading.textContent = `Wheel loads of A, ${this.replay.first.label}`;
    this.loads.describe();
    this.loads.u.setData([this.times, ...lines.map((line) => nullGaps(line.values))], false);
  }

  toggle(run) {
    this.show(run, !run.shown);
    this.replay.draw();
  }

  // A comparison: its runs in the plots, its first two of a kind each in the replay.
  showCast({ runs }) {
    this.runs.forEach((run, index) => this.show(run, runs.includes(index)));
    this.replay.choose(...this.replay.pairOf(runs.map((index) => this.runs[index])));
  }

  showAll(shown) {
    for (const run of this.runs) this.show(run, shown);
    this.replay.draw();
  }

  show(run, shown) {
    run.shown = shown;
    this.toggles[this.runs.indexOf(run)].setAttribute("aria-pressed", String(shown));
    for (const { u, lines } of this.plots)
      u.batch(() => lines.forEach((line, index) => {
        if (line.owner === run) u.setSeries(index + 1, { show: shown });
      }));
  }

  // Values beside the cursor, or at the replay's time when there is none.
  showValues() {
    const hovered = this.plots.find(({ u }) => known(u.cursor.idx) && u.cursor.left >= 0);
    const index = hovered ? hovered.u.cursor.idx : this.indexAt(this.replay.time);
    if (index === this.valuesAt && !this.replay.playing && this.valuesKey === this.shownKey()) return;
    this.valuesAt = index;
    this.valuesKey = this.shownKey();
    for (const plot of this.plots) plot.show(index);
  }

  shownKey() {
    return this.runs.map((run) => (run.shown ? 1 : 0)).join("") + this.runs.indexOf(this.replay.first);
  }

  // One plot was zoomed: so are the others.
  zoomed(source) {
    if (this.zooming) return;
    this.zooming = true;
    const { min, max } = source.scales.x;
    for (const plot of this.plots)
      if (plot.u !== source && plot.u.cursor.sync?.key === this.key) plot.u.setScale("x", { min, max });
    this.zooming = false;
    for (const plot of this.plots) plot.mark(this.replay.time);
  }

  resize() {
    // Paper has its own width.
    if (printing) return;
    for (const plot of this.plots) plot.resize();
    if (this.replay) this.replay.draw();
  }

  // A click on the course: the moment at which A was nearest.
  goToPlace(event) {
    const run = this.replay.first;
    if (!this.courseView || !run.has("x_m", "y_m")) return;
    const [px, py] = [event.offsetX, event.offsetY];
    let best = -1;
    let least = Infinity;
    run.column.x_m.forEach((x, k) => {
      const distance = Math.hypot(this.courseView.x(x) - px, this.courseView.y(run.column.y_m[k]) - py);
      if (distance < least) [best, least] = [k, distance];
    });
    if (best >= 0) this.replay.goTo(this.start + best * this.grid.step_s);
  }
}

function scrollTo(element) {
  element.scrollIntoView({ behavior: calm.matches ? "auto" : "smooth", block: "start" });
}

// Shows a run as vehicle A of its scene.
function showRun(sceneName, label) {
  const scene = scenes.find((one) => one.name === sceneName);
  const run = scene?.runs.find((one) => one.label === label);
  if (!run) return;
  const { first, second } = scene.replay;
  scene.show(run, true);
  scene.replay.choose(run, run === second ? first : second);
  scene.replay.goTo(run.peakTime());
  scrollTo(scene.element);
}


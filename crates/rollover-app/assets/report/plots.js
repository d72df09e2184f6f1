// Plots over time: one uPlot each, cursors and zoom linked within a scene.

const PLOT_HEIGHT = 200;
const AXIS_WIDTH = 54;
// Limits farther off than this share of the data's range would flatten what there is to see.
const LIMIT_REACH = 0.6;

const nullGaps = (values) => Array.from(values, (v) => (Number.isNaN(v) ? null : v));

// The last number along x carries the unit.
function axes(label, unit) {
  const common = {
    stroke: () => ink().soft,
    grid: { stroke: () => ink().line, width: 1 },
    ticks: { stroke: () => ink().line, width: 1, size: 5 },
    font: "12px system-ui, sans-serif",
  };
  return [
    { ...common, size: 30, values: (u, ticks) => ticks.map((t, index) =>
      `${Number(t.toFixed(6))}${index === ticks.length - 1 ? ` ${unit}` : ""}`) },
    { ...common, size: AXIS_WIDTH, label, labelSize: 16, labelFont: "12px system-ui, sans-serif", labelGap: 0 },
  ];
}

// The range of a vertical axis: data, what must be in view, limits that are near.
function verticalRange(low, high, atLeast, limits) {
  if (!known(low) || !known(high)) return [0, 1];
  if (atLeast) {
    low = Math.min(low, atLeast[0]);
    high = Math.max(high, atLeast[1]);
  }
  const reach = LIMIT_REACH * (high - low);
  for (const limit of limits.filter((v) => v >= low - reach && v <= high + reach)) {
    low = Math.min(low, limit);
    high = Math.max(high, limit);
  }
  const margin = 0.06 * (high - low) || 0.5;
  return [low - margin, high + margin];
}

function drawLimits(u, limits) {
  const { ctx } = u;
  ctx.save();
  ctx.beginPath();
  ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
  ctx.clip();
  ctx.strokeStyle = ink().edge;
  ctx.lineWidth = devicePixelRatio;
  for (const value of limits) {
    const y = Math.round(u.valToPos(value, "y", true)) + 0.5;
    ctx.beginPath();
    ctx.moveTo(u.bbox.left, y);
    ctx.lineTo(u.bbox.left + u.bbox.width, y);
    ctx.stroke();
  }
  ctx.restore();
}

// A cross where a run ended early.
function drawEnds(u, scene, lines) {
  const { ctx } = u;
  const size = 5 * devicePixelRatio;
  ctx.save();
  ctx.lineWidth = 2.5 * devicePixelRatio;
  lines.forEach(({ run }, index) => {
    if (!run?.ended_early || !u.series[index + 1].show) return;
    const values = u.data[index + 1];
    let last = values.length - 1;
    while (last >= 0 && values[last] === null) last--;
    if (last < 0) return;
    const [x, y] = [u.valToPos(u.data[0][last], "x", true), u.valToPos(values[last], "y", true)];
    if (x < u.bbox.left || x > u.bbox.left + u.bbox.width) return;
    ctx.strokeStyle = colour(run.look);
    ctx.beginPath();
    for (const side of [-1, 1]) {
      ctx.moveTo(x - size, y - side * size);
      ctx.lineTo(x + size, y + side * size);
    }
    ctx.stroke();
  });
  ctx.restore();
}

// One plot. `lines` are {label, values, look, thin, run}; thin ones have no value beside the cursor.
function timePlot(scene, { title, axis, caption, digits, atLeast, limits, name }, lines, times) {
  const values = el("div", { class: "values", "aria-hidden": "true" });
  const heading = el("h4", {}, title);
  const holder = el("div", { class: "plot" });
  const figure = el("figure", { "data-plot": name }, el("div", { class: "plot-head" }, heading, values), holder,
    el("figcaption", {}, caption));
  const marker = el("div", { class: "now" });
  const labels = [];
  const thick = lines.filter((line) => !line.thin);
  for (const line of thick) {
    const text = el("span", {});
    labels.push({ line, text, chip: el("span", { class: "value" }, swatch(line.look), text) });
  }
  values.append(...labels.map(({ chip }) => chip));
  const options = {
    width: 600,
    height: PLOT_HEIGHT,
    legend: { show: false },
    scales: { x: { time: false }, y: { range: (u, low, high) => verticalRange(low, high, atLeast, limits) } },
    axes: axes(axis, "s"),
    // What a click is, and what the end of a drag, is told apart below.
    cursor: { sync: { key: scene.key, setSeries: false }, drag: { x: true, y: false, click: () => {} }, y: false, points: { size: 7 } },
    series: [{}, ...lines.map((line) => ({
      label: line.label,
      stroke: () => colour(line.look, line.thin ? 0.55 : 1),
      width: line.thin ? 1 : 2,
      dash: line.thin ? [] : dashes(line.look),
      points: { show: false },
    }))],
    hooks: {
      drawAxes: [(u) => drawLimits(u, limits)],
      draw: [(u) => drawEnds(u, scene, lines)],
      setCursor: [() => scene.showValues()],
      setScale: [(u, key) => {
        if (key === "x") scene.zoomed(u);
      }],
      ready: [(u) => {
        u.over.append(marker);
        let pressed = 0;
        u.over.addEventListener("mousedown", (event) => (pressed = event.clientX));
        u.over.addEventListener("click", (event) => {
          // The end of a drag is a zoom, not a click.
          if (Math.abs(event.clientX - pressed) < 4)
            scene.replay.goTo(u.posToVal(event.clientX - u.over.getBoundingClientRect().left, "x"));
        });
      }],
    },
  };
  const u = new uPlot(options, [times, ...lines.map((line) => nullGaps(line.values))], holder);
  u.root.setAttribute("role", "img");
  const describe = () => u.root.setAttribute("aria-label",
    `${heading.textContent} over time: ${thick.map((line) => line.label).join(", ")}. ${caption}`);
  describe();
  return {
    u, figure, lines, heading, describe,
    // Values at an instant.
    show(index) {
      for (const { line, text, chip } of labels) {
        const visible = !line.owner || line.owner.shown;
        chip.hidden = !visible;
        if (visible) text.textContent = `${fixed(line.values[index], digits)}`;
      }
    },
    // The line at the replay's time.
    mark(time) {
      const x = u.valToPos(time, "x");
      marker.hidden = !(x >= 0 && x <= u.over.clientWidth);
      marker.style.transform = `translateX(${x}px)`;
    },
    resize() {
      const width = Math.max(240, Math.floor(holder.clientWidth));
      if (width !== u.width) u.setSize({ width, height: PLOT_HEIGHT });
    },
  };
}

// Heights along the road: not over time, so not linked.
function profilePlot(scene) {
  const { station_m, left_m, right_m } = scene.profile;
  const mm = (heights) => heights.map((h) => (known(h) ? 1000 * h : null));
  const holder = el("div", { class: "plot" });
  const series = WHEEL_LOOKS.slice(0, 2).map((look, index) => ({
    label: index ? "right" : "left", stroke: () => colour(look), width: 1.2, points: { show: false } }));
  const u = new uPlot({
    width: 600, height: PLOT_HEIGHT, legend: { show: false }, axes: axes("mm", "m"),
    scales: { x: { time: false } }, cursor: { drag: { x: true, y: false }, y: false }, series: [{}, ...series],
  }, [station_m, mm(left_m), mm(right_m)], holder);
  u.root.setAttribute("role", "img");
  u.root.setAttribute("aria-label", "Height of the ground along the road, under the left and the right wheels");
  const figure = el("figure", { "data-plot": "terrain" }, el("div", { class: "plot-head" },
    el("h4", {}, "Height of the ground"),
    el("div", { class: "values" }, WHEEL_LOOKS.slice(0, 2).map((look, index) =>
      el("span", { class: "value" }, swatch(look), index ? "right wheels" : "left wheels")))), holder,
    el("figcaption", {}, "Along the centre line of the road, over the distance in m."));
  const nothing = () => {};
  return { u, figure, lines: [], show: nothing, mark: nothing, describe: nothing,
    resize: () => u.setSize({ width: Math.max(240, Math.floor(holder.clientWidth)), height: PLOT_HEIGHT }) };
}

// Left and right by hue, front and rear by dash.
const WHEEL_LOOKS = [
  { light: [0, 95, 173], dark: [92, 173, 255], dash: [0, 0] },
  { light: [213, 94, 0], dark: [255, 140, 66], dash: [0, 0] },
  { light: [0, 95, 173], dark: [92, 173, 255], dash: [6, 4] },
  { light: [213, 94, 0], dark: [255, 140, 66], dash: [6, 4] },
];
const WHEELS = ["front left", "front right", "rear left", "rear right"];
const LOADS = ["load_front_left_n", "load_front_right_n", "load_rear_left_n", "load_rear_right_n"];


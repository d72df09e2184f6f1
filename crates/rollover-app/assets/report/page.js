// What all parts share: the data, elements, numbers, colours.

// What goes wrong is kept for the self-test and shown to the reader.
const failures = [];
addEventListener("error", (event) => failures.push(String(event.message)));
addEventListener("unhandledrejection", (event) => failures.push(String(event.reason)));
document.addEventListener("securitypolicyviolation", (event) =>
  failures.push(`forbidden: ${event.violatedDirective} ${event.blockedURI}`));

const report = JSON.parse(document.getElementById("report-data").textContent);

// An element with attributes and children. Strings become text, never markup.
function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.flat(Infinity).filter((child) => child !== undefined && child !== null));
  return node;
}

// Text in which backticks mark names.
const prose = (text) => text.split("`").map((words, index, parts) =>
  (index % 2 && index < parts.length - 1 ? el("code", {}, words) : index % 2 ? `\`${words}` : words));

const NONE = "–";
const known = (value) => typeof value === "number" && Number.isFinite(value);
const fixed = (value, digits) => (known(value) ? value.toFixed(digits).replace(/^-(0(\.0*)?)$/, "$1") : NONE);

// Three digits that count; powers of ten where zeros would hide the size.
function short(value) {
  if (!known(value)) return NONE;
  const size = Math.abs(value);
  if (size === 0) return "0";
  if (size >= 1e5 || size < 1e-3) return value.toExponential(2).replace("e+", "e");
  return Number(value.toPrecision(size >= 1000 ? 4 : 3)).toString();
}

const OUTCOMES = {
  completed: ["good", "✓", "completed"],
  left_road: ["fair", "!", "left the road"],
  spun_out: ["bad", "✕", "spun out"],
  rolled_over: ["bad", "✕", "rolled over"],
};

// A mark with a sign and words: colour alone says nothing to some.
const badge = (kind, sign, words) =>
  el("span", { class: `badge ${kind}` }, el("span", { "aria-hidden": "true" }, `${sign} `), words);

function outcomeBadge(run) {
  const [kind, sign, words] = OUTCOMES[run.outcome] ?? ["unknown", "?", "not known"];
  return badge(kind, sign, words);
}

function outcomeWords(run) {
  return (OUTCOMES[run.outcome] ?? ["", "", "not known"])[2];
}

// The numbers of a packed column; a gap is NaN.
function unpack(packed) {
  const bytes = atob(packed.data);
  const values = new Float64Array(bytes.length / 2);
  const unit = (packed.high - packed.low) / 65534;
  for (let k = 0; k < values.length; k++) {
    const code = bytes.charCodeAt(2 * k) + 256 * bytes.charCodeAt(2 * k + 1);
    values[k] = code === 65535 ? NaN : packed.low + unit * code;
  }
  return values;
}

const darkScheme = matchMedia("(prefers-color-scheme: dark)");
const calm = matchMedia("(prefers-reduced-motion: reduce)");
let printing = false;
const isDark = () => darkScheme.matches && !printing;
const INK = {
  light: { ink: "#24282d", soft: "#5c646d", line: "#e2e5e9", page: "#ffffff", road: "#eceef1", edge: "#8b929b", warn: "#b3400a", tyre: "#2c3036", glass: "#dfe6ee" },
  dark: { ink: "#e7eaee", soft: "#a3abb5", line: "#2e343b", page: "#15181c", road: "#252a31", edge: "#7d8691", warn: "#ff9a63", tyre: "#0b0d10", glass: "#303a45" },
};
const ink = () => (isDark() ? INK.dark : INK.light);

function colour(look, alpha = 1) {
  const [r, g, b] = isDark() ? look.dark : look.light;
  return `rgba(${r},${g},${b},${alpha})`;
}
const dashes = (look) => (look.dash[0] ? look.dash : []);

// A short sample of a run's line.
function swatch(look) {
  const NS = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(NS, "svg");
  for (const [name, value] of [["viewBox", "0 0 26 10"], ["width", "26"], ["height", "10"], ["aria-hidden", "true"], ["class", "swatch"]])
    svg.setAttribute(name, value);
  const line = document.createElementNS(NS, "line");
  for (const [name, value] of [["x1", 1], ["y1", 5], ["x2", 25], ["y2", 5], ["stroke-width", 3], ["stroke-dasharray", dashes(look).join(" ")]])
    line.setAttribute(name, value);
  const paint = () => line.setAttribute("stroke", colour(look));
  paint();
  repaints.push(paint);
  svg.append(line);
  return svg;
}

// What is drawn again when the colours change.
const repaints = [];
function repaint() {
  for (const paint of repaints) paint();
}
darkScheme.addEventListener("change", repaint);

// A canvas as sharp as the screen; returns its context in CSS pixels.
function canvasContext(canvas) {
  const width = canvas.clientWidth || 300;
  const height = canvas.clientHeight || 150;
  const ratio = printing ? 2 : devicePixelRatio || 1;
  const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== w || canvas.height !== h) {
    canvas.width = w;
    canvas.height = h;
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}


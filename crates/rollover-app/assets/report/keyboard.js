// Keys. They act on the scene that is in view.

const KEYS = [
  ["Space", "play, pause"],
  ["← →", "a step back, ahead; with Shift a second"],
  ["Home, End", "to the start, to the end"],
  ["+ −", "faster, slower"],
  ["1 … 9", "to a scene"],
  ["?", "this help"],
];

function sceneInView() {
  const within = document.activeElement?.closest?.(".scene");
  const usable = scenes.filter((scene) => scene.replay);
  const focused = usable.find((scene) => scene.element === within);
  if (focused) return focused;
  const middle = innerHeight / 2;
  const distance = ({ element }) => {
    const { top, bottom } = element.getBoundingClientRect();
    return Math.max(0, top - middle, middle - bottom);
  };
  return usable.sort((a, b) => distance(a) - distance(b))[0];
}

function help() {
  const dialog = document.getElementById("help");
  if (!dialog.childElementCount)
    dialog.append(el("h2", { id: "help-title" }, "Keys"),
      el("dl", { class: "facts" }, KEYS.map(([key, words]) => [el("dt", {}, el("kbd", {}, key)), el("dd", {}, words)])),
      el("p", {}, "With the mouse: drag over a plot to zoom, double click to see all, click to move the replay."),
      el("button", { type: "button", onclick: () => dialog.close() }, "Close"));
  if (!dialog.open) dialog.showModal();
}

function onKey(event) {
  if (event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented) return;
  const { target, key } = event;
  const tag = target.tagName;
  if (document.getElementById("help").open) return;
  if (key === "?") return help();
  // A list, a slider or a table that can be scrolled has its own use for some keys.
  const own = { SELECT: /./, INPUT: /^(Arrow|Home|End|Page)/, BUTTON: /^( |Enter)$/, A: /^Enter$/, SUMMARY: /^( |Enter)$/ }[tag];
  if (own?.test(key) || (target.classList?.contains("wide") && /^Arrow/.test(key))) return;
  if (/^[1-9]$/.test(key)) {
    const scene = scenes[Number(key) - 1];
    if (scene) scrollTo(scene.element);
    return;
  }
  const replay = sceneInView()?.replay;
  if (!replay) return;
  const step = event.shiftKey ? 1 : replay.scene.grid.step_s;
  const actions = {
    " ": () => replay.toggle(),
    ArrowLeft: () => replay.goTo(replay.time - step),
    ArrowRight: () => replay.goTo(replay.time + step),
    Home: () => replay.goTo(replay.scene.start),
    End: () => replay.goTo(replay.scene.end),
    "+": () => replay.changeRate(1),
    "=": () => replay.changeRate(1),
    "-": () => replay.changeRate(-1),
  };
  if (!actions[key]) return;
  event.preventDefault();
  actions[key]();
}


// Puts the page together.

function navigation(parts) {
  const link = ([id, words]) => el("li", {}, el("a", { href: `#${id}` }, words));
  document.getElementById("nav").append(el("ul", {}, parts.map(link)),
    el("button", { type: "button", class: "small", onclick: help, "aria-label": "Keys" }, "?"));
}

// On paper everything is light, and plots have the paper's width.
const PRINT_WIDTH = 660;
function forPaper(on) {
  if (printing === on) return;
  printing = on;
  // Paper cannot be unfolded.
  for (const details of document.querySelectorAll("details")) {
    if (on) details.dataset.folded = String(!details.open);
    details.open = on || details.dataset.folded !== "true";
  }
  for (const scene of scenes) {
    for (const { u } of scene.plots) if (on) u.setSize({ width: PRINT_WIDTH, height: PLOT_HEIGHT - 20 });
    if (!on) scene.resize();
  }
  repaint();
}

function start() {
  header();
  const content = document.getElementById("content");
  const parts = [["claims", "Claims", claimsPart()], ["timing", "Times", timingPart()], ["seeds", "Seeds", seedsPart()]];
  report.scenes.forEach((data, index) => {
    const scene = new SceneView(data, index);
    scenes.push(scene);
    parts.push([scene.key, `${index + 1} ${scene.title}`, scene.element]);
  });
  parts.push(["problems", "Problems", problemsPart()], ["about", "About", aboutPart()]);
  const there = parts.filter(([, , element]) => element);
  content.append(...there.map(([, , element]) => element));
  navigation(there);
  for (const scene of scenes) scene.drawPlots();
  document.addEventListener("keydown", onKey);
  addEventListener("beforeprint", () => forPaper(true));
  addEventListener("afterprint", () => forPaper(false));
  if (location.hash === "#selftest") selftest();
}

start();

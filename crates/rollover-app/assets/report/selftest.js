// The page tests itself when it is opened with #selftest: the result is in the attribute
// data-selftest of the root element.

const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

// A number that changes with a canvas's picture; 0 for an empty one.
function fingerprint(canvas) {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let sum = 0;
  for (let k = 0; k < data.length; k += 4) if (data[k + 3]) sum = (sum * 31 + data[k] + 7 * data[k + 1] + 13 * data[k + 2] + k) % 2147483647;
  return sum;
}

// Pixels of a plot in the colour of one of its lines.
function drawnLine(plot) {
  const canvas = plot.u.ctx.canvas;
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const looks = plot.lines.filter((line) => !line.thin).map((line) => (isDark() ? line.look.dark : line.look.light));
  for (let k = 0; k < data.length; k += 4)
    if (data[k + 3] > 200 && looks.some(([r, g, b]) => Math.abs(data[k] - r) + Math.abs(data[k + 1] - g) + Math.abs(data[k + 2] - b) < 12)) return true;
  return false;
}

function mouse(target, kind, x, y) {
  const box = target.getBoundingClientRect();
  target.dispatchEvent(new MouseEvent(kind, { bubbles: true, clientX: box.left + x, clientY: box.top + y, detail: 1, view: window }));
}
const press = (key) => document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));

// Claims: a row for each, that unfolds by keyboard and leads to its run.
async function testClaims(check) {
  const rows = [...document.querySelectorAll("#claims details.claim")];
  const ids = report.claims.map((claim) => (claim.settings === "paper" ? claim.id.replace(/-paper$/, "") : claim.id));
  check("claims are there", rows.length === new Set(ids).size);
  check("claims say their verdicts", rows.every((row) => Object.keys(VERDICTS).some((verdict) => row.querySelector("summary").innerText.includes(verdict))));
  check("claims are folded", rows.every((row) => !row.open));
  for (const row of rows) {
    const summary = row.querySelector("summary");
    summary.focus();
    check("claims have the focus", document.activeElement === summary);
    // The browser makes a click of a key that the page leaves alone.
    for (const key of [" ", "Enter"]) {
      const event = new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true });
      check("claims have their keys", summary.dispatchEvent(event) && scenes.every((scene) => !scene.replay?.playing));
    }
    summary.click();
    check("claims unfold", row.open && row.querySelector(".claim-more").clientHeight > 0);
  }
  for (const row of rows) row.open = false;
  forPaper(true);
  check("claims are unfolded on paper", rows.every((row) => row.open));
  forPaper(false);
  check("claims fold again", rows.every((row) => !row.open));
  for (const button of document.querySelectorAll("#claims button.link")) {
    button.click();
    const label = button.textContent.replace(/^Show /, "");
    check("a claim leads to its run", scenes.some(({ replay }) => replay?.first.label === label && replay.first.shown));
  }
  document.activeElement?.blur();
}

async function testScene(scene, check) {
  const name = (what) => `${scene.key}: ${what}`;
  const timed = scene.plots.filter((plot) => plot.lines.length);
  check(name("plots are drawn"), timed.length > 0 && timed.every(drawnLine));
  const [one, other] = timed;
  const middle = one.u.over.clientWidth / 2;
  mouse(one.u.over, "mouseenter", middle, 50);
  mouse(one.u.over, "mousemove", middle, 50);
  await wait(60);
  if (other) check(name("cursors are linked"), one.u.cursor.idx !== null && one.u.cursor.idx === other.u.cursor.idx);
  check(name("values are shown"), [...one.figure.querySelectorAll(".value")].some((value) => /\d/.test(value.textContent)));
  mouse(one.u.over, "mousedown", middle, 50);
  mouse(one.u.over, "mouseup", middle, 50);
  mouse(one.u.over, "click", middle, 50);
  const clicked = one.u.posToVal(middle, "x");
  check(name("a click moves the replay"), Math.abs(scene.replay.time - clicked) < 2 * scene.grid.step_s + 0.05);
  mouse(one.u.over, "mouseleave", -5, -5);
  one.u.setScale("x", { min: scene.start, max: (scene.start + scene.end) / 2 });
  await wait(30);
  if (other) check(name("zoom is linked"), Math.abs(other.u.scales.x.max - (scene.start + scene.end) / 2) < 1e-6);
  one.u.setScale("x", { min: scene.start, max: scene.start + (scene.grid.count - 1) * scene.grid.step_s });
  scene.replay.goTo(scene.start + 0.3 * (scene.end - scene.start));
  const canvases = [scene.replay.behind, ...(scene.box ? [scene.replay.above, scene.course] : [])];
  const pictures = () => [...canvases.map(fingerprint), scene.replay.readout.textContent, scene.replay.slider.value];
  const [before, then] = [pictures(), scene.replay.time];
  scene.replay.toggle();
  // Half a second of the replay; a slow machine takes longer.
  for (let k = 0; k < 100 && scene.replay.time < Math.min(scene.end, then + 0.5); k++) await wait(100);
  scene.replay.pause();
  await wait(60);
  check(name("the replay plays"), scene.replay.time >= Math.min(scene.end, then + 0.5));
  check(name("the replay is drawn"), before.every((sum) => sum !== 0));
  check(name("the replay moves"), pictures().some((sum, k) => sum !== before[k]));
  scene.replay.goTo(scene.end);
  check(name("the end is shown"), scene.replay.clock.textContent === `${fixed(scene.end, 2)} s`);
  for (const run of scene.runs) scene.replay.choose(run, null);
  scene.show(scene.runs[0], true);
  scene.toggles[0].click();
  check(name("a run can be hidden"), scene.runs[0].shown === false);
  scene.toggles[0].click();
  scene.casts.forEach((cast, index) => {
    scene.castButtons[index].click();
    check(name(`${cast.name} are shown`), scene.runs.every((run, k) => run.shown === cast.runs.includes(k)));
  });
  scene.element.scrollIntoView();
  scene.replay.goTo(scene.start);
  press("ArrowRight");
  check(name("keys step"), scene.replay.time > scene.start);
  press(" ");
  check(name("space plays"), scene.replay.playing);
  press(" ");
  check(name("space pauses"), !scene.replay.playing);
}

async function selftest() {
  const failed = [];
  // What is seen before anything is touched.
  const drawn = scenes.map((scene) => scene.runs.filter((run) => run.shown).map((run) => run.label));
  const pairs = scenes.filter((scene) => scene.replay).map((scene) => scene.replay.pair().map(({ run }) => run.label));
  let checks = 0;
  const check = (what, holds) => {
    checks += 1;
    if (!holds) failed.push(what);
  };
  try {
    // Plots draw themselves after the page is put together.
    await wait(300);
    await testClaims(check);
    for (const scene of scenes.filter((one) => one.replay)) await testScene(scene, check);
    press("?");
    check("? opens the help", document.getElementById("help").open);
    document.getElementById("help").close();
    const wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
    check(`no scrolling sideways (${wide} px)`, wide <= 0);
    forPaper(true);
    await wait(60);
    check("plots are drawn on paper", scenes.every((scene) => scene.plots.filter((plot) => plot.lines.length).every(drawnLine)));
    forPaper(false);
    await wait(60);
    const odd = /.{0,40}(\[object|undefined|NaN).{0,20}/.exec(document.body.innerText);
    check(`all text is text: ${odd?.[0]}`, !odd);
    check("nothing is loaded", performance.getEntriesByType("resource").length === 0);
    // A report without a run has nothing to test but that it opens.
    check("scenes are there", scenes.length === report.scenes.length);
  } catch (error) {
    failed.push(String(error.stack ?? error));
  }
  const plots = scenes.reduce((sum, scene) => sum + scene.plots.length, 0);
  const result = { ok: failed.length === 0 && failures.length === 0, checks, plots, drawn, pairs, failed, errors: failures };
  document.documentElement.dataset.selftest = JSON.stringify(result);
  // A test that shows the page in a narrow frame hears of it.
  if (parent !== window) parent.postMessage({ selftest: result }, "*");
}


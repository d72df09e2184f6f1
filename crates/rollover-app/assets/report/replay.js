// The replay of a scene: its clock, its controls, its pictures.

const RATES = [0.1, 0.25, 0.5, 1, 2, 4];

// The next picture; the clock goes on where the browser draws none, as for a covered window.
function nextFrame(draw) {
  let drawn = false;
  const once = () => {
    if (drawn) return;
    drawn = true;
    draw(performance.now());
  };
  requestAnimationFrame(once);
  setTimeout(once, 250);
}

class Replay {
  constructor(scene) {
    this.scene = scene;
    this.time = scene.start;
    this.playing = false;
    this.rate = 1;
    [this.first, this.second] = this.pairOf(scene.runs.filter((run) => run.shown));
    this.time = (this.second ?? this.first).dangerTime(scene.limits.ltr ?? 1);
    this.build();
  }

  // The paper shows these two: data-driven control against control on a model, else the driver.
  pairOf(runs) {
    const first = (role) => runs.find((run) => run.role === role);
    const one = first("deepc") ?? runs[0] ?? this.scene.runs[0];
    const others = ["lmpc", "driver", "floor"].map(first).concat(runs, this.scene.runs);
    return [one, others.find((run) => run && run !== one) ?? null];
  }

  // The vehicles shown, each with its letter.
  pair() {
    return [this.first, this.second].filter(Boolean).map((run, index) => ({ run, letter: "AB"[index] }));
  }

  build() {
    const { scene } = this;
    const select = (letter, chosen, choose, none) => {
      const box = el("select", { onchange: (event) => choose(event.target.value) },
        none ? el("option", { value: "" }, "nobody") : null,
        scene.runs.map((run, index) => el("option", { value: index, selected: run === chosen }, run.label)));
      return [el("label", { class: "choice" }, el("span", { class: "letter" }, letter), box), box];
    };
    const choice = (value) => (value === "" ? null : scene.runs[Number(value)]);
    const [labelA, boxA] = select("A", this.first, (value) => this.choose(choice(value), this.second));
    const [labelB, boxB] = select("B", this.second, (value) => this.choose(this.first, choice(value)), true);
    this.boxes = [boxA, boxB];
    this.above = el("canvas", { class: "above", role: "img" });
    this.behind = el("canvas", { class: "behind", role: "img" });
    this.readout = el("div", { class: "readout" });
    this.playButton = el("button", { type: "button", class: "play", onclick: () => this.toggle() });
    this.slider = el("input", {
      type: "range", min: 0, max: scene.grid.count - 1, step: 1, "aria-label": "Time of the replay",
      oninput: () => this.goTo(scene.start + this.slider.valueAsNumber * scene.grid.step_s),
    });
    this.clock = el("output", { class: "clock" });
    this.rateBox = el("select", { "aria-label": "Speed of the replay", onchange: (event) => (this.rate = Number(event.target.value)) },
      RATES.map((rate) => el("option", { value: rate, selected: rate === 1 }, `${rate}×`)));
    const go = (words, time) => el("button", { type: "button", class: "small", onclick: () => this.goTo(time()) }, words);
    this.element = el("div", { class: "replay", role: "group", "aria-label": `Replay: ${scene.title}` },
      el("div", { class: "choices" }, labelA, labelB),
      scene.box ? this.above : null,
      this.behind,
      el("div", { class: "controls" }, this.playButton, this.slider, this.clock, this.rateBox),
      el("div", { class: "jumps" }, go("Largest |LTR| of A", () => this.first.peakTime()),
        go("Largest |LTR| of B", () => (this.second ?? this.first).peakTime()), go("End of A", () => this.first.end)),
      this.readout,
      scene.vehicle.assumed ? el("p", { class: "soft small-print" }, "Typical measures: the log does not say what vehicle it was.") : null);
    this.showButton();
  }

  choose(first, second) {
    this.first = first ?? this.first;
    this.second = second === this.first ? null : second;
    this.boxes[0].value = this.scene.runs.indexOf(this.first);
    this.boxes[1].value = this.second ? this.scene.runs.indexOf(this.second) : "";
    this.scene.chosen();
    this.draw();
  }

  showButton() {
    this.playButton.textContent = this.playing ? "❚❚" : "▶";
    this.playButton.setAttribute("aria-label", this.playing ? "Pause" : "Play");
  }

  toggle() {
    if (this.playing) return this.pause();
    for (const other of scenes) other.replay?.pause();
    if (this.time >= this.scene.end - this.scene.grid.step_s / 2) this.time = this.scene.start;
    this.playing = true;
    this.showButton();
    let last = null;
    const frame = (now) => {
      if (!this.playing) return;
      // After a pause of the page itself the replay goes on, it does not jump.
      const passed = last === null ? 0 : Math.min(0.1, (now - last) / 1000);
      // Who wants little motion sees four pictures a second.
      if (last === null || !calm.matches || now - last >= 250) {
        last = now;
        this.time = Math.min(this.scene.end, this.time + (calm.matches ? 0.25 * (passed > 0) : passed) * this.rate);
        this.draw();
        if (this.time >= this.scene.end) return this.pause();
      }
      nextFrame(frame);
    };
    nextFrame(frame);
  }

  pause() {
    this.playing = false;
    this.showButton();
  }

  goTo(time) {
    this.time = Math.max(this.scene.start, Math.min(this.scene.end, time));
    this.draw();
  }

  changeRate(by) {
    const at = RATES.indexOf(this.rate) + by;
    if (at < 0 || at >= RATES.length) return;
    this.rate = RATES[at];
    this.rateBox.value = this.rate;
  }

  draw() {
    const { scene, time } = this;
    if (scene.box) drawAbove(this.above, scene, time);
    drawBehind(this.behind, scene, time);
    if (scene.course) scene.courseView = drawCourse(scene.course, scene, time);
    this.slider.value = Math.round((time - scene.start) / scene.grid.step_s);
    this.slider.setAttribute("aria-valuetext", `${fixed(time, 2)} s`);
    this.clock.textContent = `${fixed(time, 2)} s`;
    this.readout.replaceChildren(...this.pair().map(({ run, letter }) => this.state(run, letter)));
    const names = this.pair().map(({ run, letter }) => `${letter} ${run.label}`).join(" and ");
    this.above.setAttribute("aria-label", `The road from above with ${names}`);
    this.behind.setAttribute("aria-label", `The vehicles from behind with wheel loads: ${names}`);
    for (const plot of scene.plots) plot.mark(time);
    scene.showValues();
  }

  state(run, letter) {
    const { time } = this;
    const item = (name, text) => el("span", {}, el("span", { class: "soft" }, `${name} `), text);
    const value = (name, column, digits, unit) => (run.has(column) ? item(name, `${fixed(run.at(column, time), digits)} ${unit}`) : null);
    const words = { rolled_over: "has rolled over", spun_out: "has spun out" }[run.outcome];
    return el("div", { class: "state" },
      el("span", { class: "letter" }, letter), swatch(run.look),
      value("speed", "speed_kmh", 1, "km/h"), value("target", "target_speed_kmh", 1, "km/h"),
      value("steering wheel", "steering_wheel_deg", 1, "°"),
      run.over(time) ? badge("bad", "✕", `${words} at ${fixed(run.end, 2)} s`)
        : time > run.end + 1e-9 ? badge("unknown", "■", `log ends at ${fixed(run.end, 2)} s`) : null);
  }
}


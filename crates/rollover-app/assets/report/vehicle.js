// The vehicle from above and from behind.

const RAD = Math.PI / 180;
const WHEEL_RADIUS_M = 0.32;
const WHEEL_WIDTH_M = 0.2;
const OVERHANG_M = 0.85;
const ROLL_AXIS_HEIGHT_M = 0.12;
// Where clearance is not logged, what the body leans on its springs before the axle tilts.
const LEAN_ON_SPRINGS_DEG = 5;
// A wheel that carries less is in the air.
const LIFTED_N = 1;

function box(context, x, y, w, h, r) {
  context.beginPath();
  context.roundRect(x, y, w, h, r);
}

function drawFromAbove(context, scene, view, { run, letter }, time) {
  const shape = scene.vehicle;
  const [x, y] = [run.at("x_m", time), run.at("y_m", time)];
  if (Number.isNaN(x) || Number.isNaN(y)) return;
  const heading = run.has("yaw_deg") ? run.at("yaw_deg", time) * RAD : run.courseAt(time);
  const m = view.scale;
  context.save();
  context.translate(view.x(x), view.y(y));
  context.rotate(-heading);
  const front = shape.cg_to_front_axle_m;
  const rear = shape.wheelbase_m - front;
  const half = shape.width_m / 2;
  const steer = run.has("steering_wheel_deg") ? (run.at("steering_wheel_deg", time) / shape.steering_ratio) * RAD : 0;
  const lifted = run.lifted(time);
  const place = [[front, 1], [front, -1], [-rear, 1], [-rear, -1]];
  place.forEach(([along, side], wheel) => {
    context.save();
    context.translate(along * m, (-side * shape.track_m * m) / 2);
    if (wheel < 2) context.rotate(-(Number.isNaN(steer) ? 0 : steer));
    context.fillStyle = lifted[wheel] ? ink().warn : ink().tyre;
    const [l, w] = [2 * WHEEL_RADIUS_M * m, WHEEL_WIDTH_M * m];
    box(context, -l / 2, -w / 2, l, w, 2);
    context.fill();
    context.strokeStyle = ink().soft;
    context.lineWidth = 1;
    context.stroke();
    context.restore();
  });
  const length = (shape.wheelbase_m + 2 * OVERHANG_M) * m;
  const back = -(rear + OVERHANG_M) * m;
  const over = run.over(time);
  context.globalAlpha = over ? 0.55 : 0.88;
  context.fillStyle = colour(run.look);
  const narrow = 0.42 * half * m;
  box(context, back, -half * m + 0.12 * half * m, length, 1.76 * half * m, 0.4 * m);
  context.fill();
  context.globalAlpha = 1;
  // Windscreen and rear window show which way it faces.
  context.fillStyle = ink().glass;
  box(context, (front - 1.0) * m, -half * m + narrow, 0.55 * m, 2 * (half * m - narrow), 0.1 * m);
  context.fill();
  box(context, back + 0.75 * m, -half * m + narrow, 0.32 * m, 2 * (half * m - narrow), 0.1 * m);
  context.fill();
  context.rotate(heading);
  context.fillStyle = ink().page;
  context.font = `bold ${Math.max(11, Math.min(18, 0.8 * m))}px system-ui, sans-serif`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillText(letter, 0, 0);
  if (over) cross(context, 0, 0, 1.6 * m, ink().warn);
  context.restore();
}

// How far the axles tilt, rad: by the height of the lifted wheels where it is logged.
function axleTilt(run, roll, track, time) {
  const side = Math.sign(roll) || 1;
  if (run.has("two_wheel_clearance_m")) {
    const clearance = run.at("two_wheel_clearance_m", time);
    const tilt = Math.asin(Math.min(1, Math.max(0, clearance || 0) / track));
    // Springs at full droop lower the wheels: the axle never leans more than the body.
    return side * Math.min(tilt, Math.abs(roll));
  }
  const lifted = run.lifted(time);
  const off = (lifted[0] && lifted[2]) || (lifted[1] && lifted[3]);
  return off ? side * Math.max(0, Math.abs(roll) - LEAN_ON_SPRINGS_DEG * RAD) : 0;
}

// One vehicle from behind in a region of a canvas: gauge, body, wheels, loads.
function drawFromBehind(context, scene, { run, letter }, time, region) {
  const shape = scene.vehicle;
  const { x: left, width, height } = region;
  const middle = left + width / 2;
  const colours = ink();
  context.save();
  context.textBaseline = "middle";
  let top = 4;
  if (run.has("ltr")) {
    drawGauge(context, scene, run, run.at("ltr", time), { x: left + 14, y: top, width: width - 28 });
    top += 46;
  }
  const loads = LOADS.every((name) => run.has(name)) ? LOADS.map((name) => run.at(name, time)) : null;
  const barsHeight = loads ? 92 : 0;
  const ground = height - barsHeight - 12;
  const scale = Math.min((width - 16) / 2.9, (ground - top) / 1.85);
  const roll = run.has("roll_deg") ? (run.smoothRoll(time) || 0) * RAD : 0;
  const tilt = axleTilt(run, roll, shape.track_m, time);
  const outer = (Math.sign(roll) || 1) * (shape.track_m / 2);
  context.strokeStyle = colours.edge;
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(left + 6, ground);
  context.lineTo(left + width - 6, ground);
  context.stroke();
  context.save();
  context.beginPath();
  context.rect(left, 0, width, ground + 1);
  context.clip();
  context.translate(middle, ground);
  context.scale(scale, -scale);
  // The picture follows a vehicle that tips.
  context.translate(-outer * (1 - Math.cos(tilt)) - 0.7 * Math.sin(tilt), 0);
  // The axles turn about the wheels that stay on the ground.
  context.translate(outer, 0);
  context.rotate(-tilt);
  context.translate(-outer, 0);
  const lifted = run.lifted(time);
  for (const side of [-1, 1]) {
    const rear = side < 0 ? 2 : 3;
    context.fillStyle = lifted[rear] ? colours.warn : colours.tyre;
    box(context, (side * shape.track_m) / 2 - WHEEL_WIDTH_M / 2, 0, WHEEL_WIDTH_M, 2 * WHEEL_RADIUS_M, 0.05);
    context.fill();
    context.strokeStyle = colours.soft;
    context.lineWidth = 1 / scale;
    context.stroke();
  }
  context.strokeStyle = colours.soft;
  context.lineWidth = 0.06;
  context.beginPath();
  context.moveTo(-shape.track_m / 2, WHEEL_RADIUS_M);
  context.lineTo(shape.track_m / 2, WHEEL_RADIUS_M);
  context.stroke();
  // The body leans on its springs by what is left of the roll angle.
  context.translate(0, ROLL_AXIS_HEIGHT_M);
  context.rotate(-(roll - tilt));
  context.translate(0, -ROLL_AXIS_HEIGHT_M);
  drawBody(context, shape, run, run.over(time), scale);
  context.restore();
  context.fillStyle = colour(run.look);
  context.font = "bold 14px system-ui, sans-serif";
  context.textAlign = "left";
  context.fillText(letter, left + 10, top + 8);
  if (run.has("roll_deg")) {
    context.textAlign = "right";
    context.font = "12px system-ui, sans-serif";
    context.fillStyle = colours.soft;
    context.fillText(`roll ${fixed(run.smoothRoll(time), 1)}°`, left + width - 10, top + 8);
  }
  if (loads) drawLoads(context, run, loads, { x: left, y: ground + 14, width, height: barsHeight - 4, full: run.fullLoad });
  context.restore();
}

function drawBody(context, shape, run, over, scale) {
  const half = shape.width_m / 2;
  const colours = ink();
  context.globalAlpha = over ? 0.6 : 1;
  context.fillStyle = colour(run.look);
  box(context, -half, 0.24, 2 * half, 0.62, 0.14);
  context.fill();
  context.beginPath();
  context.moveTo(-0.88 * half, 0.84);
  context.lineTo(-0.66 * half, 1.36);
  context.quadraticCurveTo(0, 1.48, 0.66 * half, 1.36);
  context.lineTo(0.88 * half, 0.84);
  context.closePath();
  context.fill();
  context.fillStyle = colours.glass;
  context.beginPath();
  context.moveTo(-0.72 * half, 0.9);
  context.lineTo(-0.57 * half, 1.28);
  context.quadraticCurveTo(0, 1.37, 0.57 * half, 1.28);
  context.lineTo(0.72 * half, 0.9);
  context.closePath();
  context.fill();
  context.fillStyle = "#c62828";
  for (const side of [-1, 1]) {
    box(context, side * 0.82 * half - 0.13, 0.6, 0.26, 0.12, 0.03);
    context.fill();
  }
  context.globalAlpha = 1;
  // The centre of gravity, quartered.
  const r = 0.075;
  for (let quarter = 0; quarter < 4; quarter++) {
    context.beginPath();
    context.moveTo(0, shape.cg_height_m);
    context.arc(0, shape.cg_height_m, r, (quarter * Math.PI) / 2, ((quarter + 1) * Math.PI) / 2);
    context.fillStyle = quarter % 2 ? "#ffffff" : "#111111";
    context.fill();
  }
  context.beginPath();
  context.arc(0, shape.cg_height_m, r, 0, 2 * Math.PI);
  context.strokeStyle = "#111111";
  context.lineWidth = 1 / scale;
  context.stroke();
}

// Load transfer ratio from −1.25 to 1.25, right to left as the load goes: a left turn loads the right.
function drawGauge(context, scene, run, ltr, { x, y, width }) {
  const colours = ink();
  const place = (value) => x + width / 2 + (Math.max(-1.25, Math.min(1.25, value)) / 2.5) * width;
  context.fillStyle = colours.road;
  box(context, x, y + 18, width, 10, 5);
  context.fill();
  if (known(ltr)) {
    const [from, to] = [place(0), place(ltr)];
    context.fillStyle = Math.abs(ltr) >= 1 ? colours.warn : colour(run.look);
    context.fillRect(Math.min(from, to), y + 18, Math.abs(to - from), 10);
  }
  context.strokeStyle = colours.soft;
  context.lineWidth = 1;
  context.font = "11px system-ui, sans-serif";
  context.fillStyle = colours.soft;
  for (const value of [-1, 0, 1]) {
    context.textAlign = "center";
    context.fillText(String(value).replace("-", "−"), place(value), y + 37);
    context.beginPath();
    context.moveTo(place(value), y + 15);
    context.lineTo(place(value), y + 31);
    context.stroke();
  }
  if (known(run.ltr_limit) && run.ltr_limit < 1) {
    context.setLineDash([2, 2]);
    for (const value of [-run.ltr_limit, run.ltr_limit]) {
      context.beginPath();
      context.moveTo(place(value), y + 14);
      context.lineTo(place(value), y + 32);
      context.stroke();
    }
    context.setLineDash([]);
  }
  context.textAlign = "center";
  context.font = "bold 13px system-ui, sans-serif";
  context.fillStyle = Math.abs(ltr) >= 1 ? colours.warn : colours.ink;
  context.fillText(`LTR ${fixed(ltr, 2)}`, x + width / 2, y + 7);
}

// A bar per wheel, left and right as seen from behind.
function drawLoads(context, run, loads, { x, y, width, height, full }) {
  const colours = ink();
  const order = [[0, 0.14, "FL"], [2, 0.34, "RL"], [3, 0.66, "RR"], [1, 0.86, "FR"]];
  const bar = Math.min(26, width * 0.13);
  const tall = height - 30;
  context.textAlign = "center";
  for (const [wheel, share, name] of order) {
    const centre = x + share * width;
    const load = loads[wheel];
    const up = known(load) && load < LIFTED_N;
    const level = known(load) ? Math.max(0, Math.min(1, load / full)) * tall : 0;
    context.strokeStyle = up ? colours.warn : colours.line;
    context.lineWidth = up ? 2 : 1;
    context.setLineDash(up ? [3, 3] : []);
    context.strokeRect(centre - bar / 2, y, bar, tall);
    context.setLineDash([]);
    context.fillStyle = colour(run.look, 0.85);
    context.fillRect(centre - bar / 2, y + tall - level, bar, level);
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = up ? colours.warn : colours.soft;
    const unit = width > 200 ? " kN" : "";
    context.fillText(up ? "lifted" : known(load) ? `${fixed(load / 1000, 1)}${unit}` : NONE, centre, y + tall + 9);
    context.fillText(name, centre, y + tall + 22);
  }
}

function drawBehind(canvas, scene, time) {
  const { context, width, height } = canvasContext(canvas);
  const pair = scene.replay.pair();
  pair.forEach((one, index) => {
    const share = width / pair.length;
    drawFromBehind(context, scene, one, time, { x: index * share, width: share, height });
  });
  if (pair.length > 1) {
    context.strokeStyle = ink().line;
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(width / 2, 6);
    context.lineTo(width / 2, height - 6);
    context.stroke();
  }
}


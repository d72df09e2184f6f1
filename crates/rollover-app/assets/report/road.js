// The road from above: the whole course, and the view that follows the vehicles.

// A line through points given by functions of an index; gaps lift the pen.
function path(context, count, x, y) {
  context.beginPath();
  let down = false;
  for (let k = 0; k < count; k++) {
    const [px, py] = [x(k), y(k)];
    if (Number.isNaN(px) || Number.isNaN(py)) down = false;
    else if (down) context.lineTo(px, py);
    else {
      context.moveTo(px, py);
      down = true;
    }
  }
}

// A picture of the heights, dark where low; made once per colour scheme.
function terrainPicture(scene) {
  const map = scene.terrain;
  if (!map) return null;
  const dark = isDark();
  if (scene.picture?.dark === dark) return scene.picture;
  const heights = scene.heights ??= unpack(map.heights_m);
  const canvas = el("canvas", { width: map.columns, height: map.rows });
  const context = canvas.getContext("2d");
  const image = context.createImageData(map.columns, map.rows);
  const { low, high } = map.heights_m;
  for (let row = 0; row < map.rows; row++)
    for (let column = 0; column < map.columns; column++) {
      const height = heights[row * map.columns + column];
      const at = 4 * ((map.rows - 1 - row) * map.columns + column);
      const level = (height - low) / (high - low || 1);
      const [from, to] = dark ? [24, 92] : [176, 246];
      const shade = from + (to - from) * level;
      image.data.set([shade, shade * 0.97, shade * 0.9, Number.isNaN(height) ? 0 : 255], at);
    }
  context.putImageData(image, 0, 0);
  return (scene.picture = { canvas, dark });
}

// Ground and road in a view {x(m), y(m), scale}.
function drawGround(context, scene, view) {
  const picture = terrainPicture(scene);
  if (picture) {
    const map = scene.terrain;
    context.imageSmoothingEnabled = true;
    const half = map.spacing_m / 2;
    context.drawImage(picture.canvas, view.x(map.x_min_m - half), view.y(map.y_min_m + (map.rows - 0.5) * map.spacing_m),
      map.columns * map.spacing_m * view.scale, map.rows * map.spacing_m * view.scale);
  }
  const road = scene.road;
  if (!road) return;
  const line = (points) => path(context, points.length, (k) => view.x(points[k][0]), (k) => view.y(points[k][1]));
  if (road.centre.length && !picture) {
    line(road.centre);
    context.strokeStyle = ink().road;
    context.lineJoin = "round";
    context.lineWidth = Math.max(1, road.width_m * view.scale);
    context.stroke();
  }
  context.strokeStyle = ink().edge;
  context.lineWidth = 1.2;
  for (const edge of [road.left, road.right]) {
    line(edge);
    context.stroke();
  }
  if (view.scale > 2 && road.centre.length) {
    line(road.centre);
    context.setLineDash([3 * view.scale, 3 * view.scale]);
    context.strokeStyle = ink().line;
    context.stroke();
    context.setLineDash([]);
  }
}

// The smallest box around road and runs, m.
function bounds(scene) {
  const box = { left: Infinity, right: -Infinity, bottom: Infinity, top: -Infinity };
  const take = (x, y) => {
    if (Number.isNaN(x) || Number.isNaN(y)) return;
    box.left = Math.min(box.left, x);
    box.right = Math.max(box.right, x);
    box.bottom = Math.min(box.bottom, y);
    box.top = Math.max(box.top, y);
  };
  for (const line of scene.road ? [scene.road.left, scene.road.right, scene.road.centre] : [])
    for (const [x, y] of line) take(x, y);
  for (const run of scene.runs) if (run.has("x_m", "y_m")) run.column.x_m.forEach((x, k) => take(x, run.column.y_m[k]));
  return box.left <= box.right ? box : null;
}

// The whole course with all runs that are shown. Returns the view, so that a click finds its place.
function drawCourse(canvas, scene, time) {
  const { context, width, height } = canvasContext(canvas);
  const box = scene.box;
  const margin = 14;
  const scale = Math.min((width - 2 * margin) / Math.max(box.right - box.left, 1), (height - 2 * margin) / Math.max(box.top - box.bottom, 1));
  const [cx, cy] = [(box.left + box.right) / 2, (box.bottom + box.top) / 2];
  const view = { scale, x: (x) => width / 2 + (x - cx) * scale, y: (y) => height / 2 - (y - cy) * scale };
  drawGround(context, scene, view);
  for (const run of scene.runs.filter((run) => run.shown && run.has("x_m", "y_m"))) {
    const { x_m, y_m } = run.column;
    path(context, x_m.length, (k) => view.x(x_m[k]), (k) => view.y(y_m[k]));
    context.strokeStyle = colour(run.look);
    context.lineWidth = 2;
    context.setLineDash(dashes(run.look));
    context.stroke();
    context.setLineDash([]);
    if (run.ended_early) cross(context, view.x(run.at("x_m", run.end)), view.y(run.at("y_m", run.end)), 5, colour(run.look));
  }
  drawPlaces(context, view, scene.replay.pair().filter(({ run }) => run.has("x_m", "y_m")), time);
  scaleBar(context, view.scale, width, height);
  return view;
}

// Where the vehicles of the replay are; letters side by side where they would hide each other.
function drawPlaces(context, view, pair, time) {
  const places = pair.map(({ run }) => [view.x(run.at("x_m", time)), view.y(run.at("y_m", time))]);
  const close = places.length > 1 && Math.hypot(places[0][0] - places[1][0], places[0][1] - places[1][1]) < 16;
  pair.forEach(({ run, letter }, index) => {
    const [x, y] = places[index];
    const shift = close ? (index ? 9 : -9) : 0;
    context.beginPath();
    context.arc(x + shift, y - Math.abs(shift), 8, 0, 2 * Math.PI);
    context.fillStyle = colour(run.look);
    context.fill();
    context.fillStyle = ink().page;
    context.font = "bold 11px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(letter, x + shift, y - Math.abs(shift) + 0.5);
    if (close) context.fillStyle = colour(run.look);
    if (close) context.fillRect(x - 1.5, y - 1.5, 3, 3);
  });
}

function cross(context, x, y, size, stroke) {
  context.strokeStyle = stroke;
  context.lineWidth = 2.5;
  context.beginPath();
  context.moveTo(x - size, y - size);
  context.lineTo(x + size, y + size);
  context.moveTo(x - size, y + size);
  context.lineTo(x + size, y - size);
  context.stroke();
}

// A bar of a round length.
function scaleBar(context, scale, width, height) {
  const wanted = 70 / scale;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const length = [5, 2, 1].map((n) => n * power).find((n) => n <= wanted) ?? power;
  const [x, y] = [width - 12 - length * scale, height - 10];
  context.strokeStyle = context.fillStyle = ink().soft;
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(x, y - 4);
  context.lineTo(x, y);
  context.lineTo(x + length * scale, y);
  context.lineTo(x + length * scale, y - 4);
  context.stroke();
  context.font = "11px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "bottom";
  context.fillText(`${length} m`, x + (length * scale) / 2, y - 3);
}

// The view that follows the vehicles of the replay.
function drawAbove(canvas, scene, time) {
  const { context, width, height } = canvasContext(canvas);
  const pair = scene.replay.pair().filter(({ run }) => run.has("x_m", "y_m"));
  if (!pair.length) return;
  const places = pair.map(({ run }) => [run.at("x_m", time), run.at("y_m", time)]);
  const xs = places.map(([x]) => x);
  const ys = places.map(([, y]) => y);
  // Vehicles far apart would be specks: then the first stays in the middle.
  const apart = Math.max(Math.max(...xs) - Math.min(...xs), Math.max(...ys) - Math.min(...ys));
  const together = apart < 130;
  const cx = together ? (Math.max(...xs) + Math.min(...xs)) / 2 : xs[0];
  const cy = together ? (Math.max(...ys) + Math.min(...ys)) / 2 : ys[0];
  const span = together ? Math.max(34, apart + 22) : 60;
  const scale = Math.min(width, height * 1.3) / span;
  const view = { scale, x: (x) => width / 2 + (x - cx) * scale, y: (y) => height / 2 - (y - cy) * scale };
  drawGround(context, scene, view);
  pair.forEach(({ run }) => {
    const { x_m, y_m } = run.column;
    const now = Math.min(scene.indexAt(time), x_m.length - 1);
    const trail = (from, to) => path(context, to - from, (k) => view.x(x_m[from + k]), (k) => view.y(y_m[from + k]));
    context.strokeStyle = colour(run.look, 0.35);
    context.lineWidth = 1.5;
    context.setLineDash([2, 5]);
    trail(now, x_m.length);
    context.stroke();
    context.setLineDash([]);
    context.strokeStyle = colour(run.look);
    context.lineWidth = 2.5;
    trail(Math.max(0, now - Math.round(6 / scene.grid.step_s)), now + 1);
    context.lineTo(view.x(run.at("x_m", time)), view.y(run.at("y_m", time)));
    context.stroke();
  });
  [...pair].reverse().forEach((one) => drawFromAbove(context, scene, view, one, time));
  scaleBar(context, scale, width, height);
}


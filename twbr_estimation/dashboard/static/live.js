// Draws what comes over the web socket: traces and errors into charts, the pose into the scene.
// One picture per animation frame at most, none while the page is hidden.

const WINDOW = 30.0; // seconds kept and shown
const BAND = "2 sigma";

const styles = {
  reference: { color: "#888888", width: 2 },
  active: { color: "#1976d2", width: 2 },
  corrected: { color: "#26a69a", width: 1, off: true },
  raw: { color: "#ef6c00", width: 1, off: true },
};

function rotation(axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle);
  if (axis === "x") return [[1, 0, 0], [0, c, -s], [0, s, c]];
  if (axis === "y") return [[c, 0, s], [0, 1, 0], [-s, 0, c]];
  return [[c, -s, 0], [s, c, 0], [0, 0, 1]];
}

function product(a, b) {
  return a.map((row) => b[0].map((_, j) => row.reduce((sum, value, k) => sum + value * b[k][j], 0)));
}

class Robot {
  constructor(index, ids) {
    this.index = index;
    this.ids = ids;
    this.traces = new Map();
    this.errors = [];
    this.pose = {};
    this.paused = false;
    this.dirty = false;
    this.drawn = 0;
    this.frames = 0;
    this.known = "";
    this.connect();
    requestAnimationFrame(() => this.draw());
  }

  connect() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    this.socket = new WebSocket(`${scheme}://${location.host}/stream/${this.index}`);
    this.socket.onmessage = (event) => this.take(JSON.parse(event.data));
    this.socket.onclose = () => {
      if (!this.closed) setTimeout(() => this.connect(), 1000);
    };
  }

  take(frame) {
    this.frames += 1;
    if (frame.reset) {
      this.traces.clear();
      this.errors = [];
    }
    for (const [name, points] of Object.entries(frame.traces)) {
      if (!this.traces.has(name)) this.traces.set(name, []);
      this.traces.get(name).push(...points);
    }
    this.errors.push(...frame.errors);
    this.pose = frame.pose;
    this.trim();
    this.dirty = true;
  }

  latest() {
    let latest = -Infinity;
    for (const points of this.traces.values()) {
      if (points.length) latest = Math.max(latest, points[points.length - 1][0]);
    }
    return latest;
  }

  trim() {
    const first = this.latest() - WINDOW;
    const old = (points) => points.length > 1 && points[0][0] < first;
    for (const points of this.traces.values()) while (old(points)) points.shift();
    while (old(this.errors)) this.errors.shift();
  }

  pause(paused) {
    this.paused = paused;
    this.dirty = true;
  }

  draw() {
    if (this.closed) return;
    requestAnimationFrame(() => this.draw());
    if (!this.dirty || document.hidden) return;
    this.dirty = false;
    this.drawPose();
    if (!this.paused) this.drawCharts();
  }

  drawCharts() {
    const tilt = getElement(this.ids.tilt)?.chart;
    const error = getElement(this.ids.error)?.chart;
    const latest = this.latest();
    if (!tilt || !error || !isFinite(latest)) return;
    const axis = { min: Math.max(0, latest - WINDOW), max: Math.max(WINDOW, latest) };
    const names = [...this.traces.keys()].sort();
    const series = names.map((name) => ({
      name,
      id: name,
      type: "line",
      showSymbol: false,
      animation: false,
      lineStyle: { width: styles[name]?.width ?? 1 },
      ...(styles[name] ? { color: styles[name].color } : {}),
      data: this.traces.get(name),
    }));
    const option = { xAxis: axis, series };
    if (names.join() !== this.known) {
      const fresh = names.filter((name) => !this.known.split(",").includes(name));
      this.known = names.join();
      option.legend = { data: names, selected: {} };
      for (const name of fresh) option.legend.selected[name] = !styles[name]?.off;
    }
    tilt.setOption(option);
    const band = (sign) => this.errors.map(([t, , deviation]) => [t, sign * 2 * deviation]);
    const edge = { type: "line", name: BAND, showSymbol: false, animation: false, color: "#bbbbbb" };
    error.setOption({
      xAxis: axis,
      series: [
        { ...edge, id: "upper", lineStyle: { type: "dashed" }, data: band(1) },
        { ...edge, id: "lower", lineStyle: { type: "dashed" }, data: band(-1) },
        {
          type: "line", name: "error", id: "error", showSymbol: false, animation: false,
          color: "#c62828", lineStyle: { width: 1.5 },
          data: this.errors.map(([t, value]) => [t, value]),
        },
      ],
    });
  }

  drawPose() {
    const scene = getElement(this.ids.scene);
    const { tilt, roll, heading, wheel, reference } = this.pose;
    if (!scene?.rotate) return;
    const turn = rotation("z", heading ?? 0);
    const stand = (lean) => product(turn, product(rotation("x", roll ?? 0), rotation("y", lean)));
    try {
      if (tilt !== null && tilt !== undefined) scene.rotate(this.ids.body, stand(tilt));
      if (reference !== null && reference !== undefined) scene.rotate(this.ids.ghost, stand(reference));
      scene.rotate(this.ids.wheels, product(turn, rotation("y", wheel ?? 0)));
      this.drawn += 1;
    } catch (problem) {
      console.warn("the scene cannot be drawn", problem);
    }
  }

  close() {
    this.closed = true;
    this.socket.close();
  }
}

window.twbr = {
  robots: new Map(),
  start(index, ids) {
    this.robots.get(index)?.close();
    this.robots.set(index, new Robot(index, ids));
  },
  pause(index, paused) {
    this.robots.get(index)?.pause(paused);
  },
  zoomOut(index) {
    const ids = this.robots.get(index)?.ids;
    for (const id of [ids?.tilt, ids?.error]) {
      getElement(id)?.chart?.dispatchAction({ type: "dataZoom", start: 0, end: 100 });
    }
  },
};

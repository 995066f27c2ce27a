// Draws what comes over the web socket: traces and errors into charts, the pose into the scene.
// One picture per animation frame at most, the charts ten times a second: they cost most, and half a
// minute of them moves by two pixels meanwhile. A hidden page leaves the stream. Keys and the pad drive:
// a command is repeated while it is held, and ends with the key, the page's focus or the connection.

const WINDOW = 30.0; // seconds kept and shown
const BAND = "2 sigma";
const CHARTS = 100; // least time between two drawings of the charts [ms]
const REPEAT = 100; // of a held command [ms]
const RECONNECT = 1000; // [ms]
const STILL = 500; // without a new picture, until the charts show values under the pointer [ms]
const KNOB = 32; // way of the knob from the middle of the pad [px]
const LOOK_BACK = 5000; // over which pictures are judged [ms]
const LATE = 100; // time between two pictures that is usual and still fine [ms]
const SILENT = 3000; // without a message of the server, which sends one a second at least [ms]
const BEHIND = 300; // age of a picture, above the least of this connection, that is still fine [ms]
const DIRECTIONS = {
  w: [1, 0], s: [-1, 0], a: [0, 1], d: [0, -1],
  arrowup: [1, 0], arrowdown: [-1, 0], arrowleft: [0, 1], arrowright: [0, -1],
};
const STOPS = ["disable", "stop recording"]; // done whenever the connection comes again
const PUSHES = { q: "push back", e: "push forward" };

// Limits of the tilt's axis where it spans less than two degrees: noise shall look small.
const HEIGHT = {
  min: ({ min, max }) => (max - min < 2 ? Math.floor(min + max - 2) / 2 : null),
  max: ({ min, max }) => (max - min < 2 ? Math.ceil(min + max + 2) / 2 : null),
};

const styles = {
  reference: { color: "#888888", width: 3, z: 1 }, // below the estimates
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

function median(values) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)];
}

// What is said of pictures, [time drawn, age] in ms each: nothing where they are in time.
function lateness(pictures) {
  if (pictures.length < 3) return "";
  const apart = median(pictures.slice(1).map(([time], i) => time - pictures[i][0]));
  const behind = median(pictures.map(([, age]) => age));
  if (apart <= LATE && behind <= BEHIND) return "";
  const delay = behind > BEHIND ? `, ${(behind / 1000).toFixed(1)} s behind` : "";
  return `late: ${(1000 / apart).toFixed(1)} pictures a second${delay}`;
}

// Let one chart show the time that another one shows.
function zoomAlike(from, to) {
  const [wanted] = from.getOption().dataZoom, [present] = to.getOption().dataZoom;
  if (wanted.start === present.start && wanted.end === present.end) return;
  to.dispatchAction({ type: "dataZoom", dataZoomIndex: 0, start: wanted.start, end: wanted.end });
}

class Robot {
  constructor(index, ids) {
    this.index = index;
    this.ids = ids;
    this.shown = [];
    this.clear();
    this.pose = {};
    this.paused = false;
    this.dirty = false;
    this.outdated = false; // the charts
    this.charted = -Infinity;
    this.drawn = 0;
    this.frames = 0;
    this.known = "";
    this.tips = null;
    this.pictures = [];
    this.heard = performance.now();
    this.sizes = new ResizeObserver(() => this.fit());
    this.judging = setInterval(() => this.judge(), 1000);
    this.pad = new Pad(ids.pad === null ? null : getHtmlElement(ids.pad), (command) => this.say({ drive: command }));
    this.connect();
    requestAnimationFrame(() => this.draw());
  }

  connect() {
    if (this.closed || document.hidden || this.socket?.readyState <= WebSocket.OPEN) return;
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    this.socket = new WebSocket(`${scheme}://${location.host}/stream/${this.index}`);
    this.socket.onopen = () => {
      this.least = Infinity; // of this clock over that of the server [ms]
      this.pictures = [];
      this.say({ show: this.shown });
    };
    this.socket.onmessage = (event) => this.take(JSON.parse(event.data));
    this.socket.onclose = () => {
      this.pad.release();
      setTimeout(() => this.connect(), RECONNECT);
    };
  }

  // The page is hidden or shown again.
  look(hidden) {
    if (hidden) this.socket?.close();
    else {
      this.heard = performance.now();
      this.connect();
    }
  }

  say(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  take(frame) {
    this.heard = performance.now();
    if (!frame.reset && !Object.keys(frame.traces).length) return; // nothing has arrived there
    this.frames += 1;
    this.sent = 1000 * frame.at;
    this.least = Math.min(this.least, performance.now() - this.sent);
    if (frame.reset) this.clear();
    for (const [name, points] of Object.entries(frame.traces)) {
      if (!this.traces.has(name)) this.traces.set(name, []);
      this.traces.get(name).push(...points);
    }
    this.errors.push(...frame.errors);
    this.pose = frame.pose;
    this.trim();
    this.dirty = true;
  }

  clear() {
    this.traces = new Map(this.ids.onRequest.map((name) => [name, []]));
    this.errors = [];
  }

  // Ask for the traces on request that the legend shows.
  show(selected) {
    this.shown = this.ids.onRequest.filter((name) => selected[name]);
    this.say({ show: this.shown });
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
    this.watch();
    if (document.hidden) return;
    const now = performance.now();
    if (this.dirty) {
      this.dirty = false;
      this.outdated = true;
      this.pictures.push([now, now - this.sent - this.least]);
      this.drawPose();
    }
    if (!this.outdated || this.paused || now < this.charted + CHARTS) return;
    this.outdated = false;
    this.charted = now;
    this.drawCharts();
  }

  get silence() {
    return document.hidden ? 0 : performance.now() - this.heard;
  }

  // Say where the page does not keep up: what it shows is then old.
  judge() {
    if (this.ids.late === null) return;
    const now = performance.now(), { silence } = this;
    this.pictures = this.pictures.filter(([time]) => time >= now - LOOK_BACK);
    const label = getHtmlElement(this.ids.late);
    if (!label) return;
    const words = silence > SILENT ? `late: no connection for ${Math.round(silence / 1000)} s` : lateness(this.pictures);
    label.textContent = document.hidden ? "" : words;
  }

  drawCharts() {
    const tilt = getElement(this.ids.tilt)?.chart;
    const error = getElement(this.ids.error)?.chart;
    const latest = this.latest();
    if (!tilt || !error || !isFinite(latest)) return;
    if (this.listened !== tilt) this.listen(tilt, error);
    this.showTips(false);
    clearTimeout(this.still);
    this.still = setTimeout(() => this.showTips(true), STILL);
    const axis = { min: Math.max(0, latest - WINDOW), max: Math.max(WINDOW, latest) };
    const names = [...this.traces.keys()].sort();
    const series = names.map((name) => ({
      name,
      id: name,
      type: "line",
      showSymbol: false,
      animation: false,
      lineStyle: { width: styles[name]?.width ?? 1 },
      z: styles[name]?.z ?? 2,
      ...(styles[name] ? { color: styles[name].color } : {}),
      data: this.traces.get(name),
    }));
    const option = { xAxis: axis, yAxis: HEIGHT, series };
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

  listen(tilt, error) {
    this.listened = tilt;
    this.tips = null;
    tilt.on("legendselectchanged", (event) => this.show(event.selected));
    tilt.on("datazoom", () => zoomAlike(tilt, error));
    error.on("datazoom", () => zoomAlike(error, tilt));
  }

  // Values under the pointer: where the picture moves they would be those of another time.
  showTips(shown) {
    if (shown === this.tips) return;
    this.tips = shown;
    for (const id of [this.ids.tilt, this.ids.error]) {
      getElement(id)?.chart?.setOption({ tooltip: { show: shown } });
    }
  }

  // A resized window gives the scene of a hidden tab no size; it gets one when the tab is shown.
  watch() {
    const element = getHtmlElement(this.ids.scene);
    if (!element || element === this.watched) return;
    this.watched = element;
    this.sizes.disconnect();
    this.sizes.observe(element);
  }

  fit() {
    const scene = getElement(this.ids.scene);
    if (this.watched.clientWidth && scene?.renderer) scene.resize();
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
    clearInterval(this.judging);
    this.sizes.disconnect();
    this.pad.close();
    this.socket?.close();
  }
}

// What keys and a finger ask for: shares of the largest speed forward and of the turn to the left.
class Pad {
  constructor(element, send) {
    this.element = element;
    this.send = send;
    this.keys = new Map();
    this.finger = null;
    this.stick = [0, 0];
    if (!element) return;
    element.addEventListener("pointerdown", (event) => {
      this.finger = event.pointerId;
      element.setPointerCapture(event.pointerId);
      this.point(event);
    });
    element.addEventListener("pointermove", (event) => this.point(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      element.addEventListener(end, (event) => this.lift(event));
    }
  }

  get visible() {
    return !!this.element?.offsetParent;
  }

  point(event) {
    if (event.pointerId !== this.finger) return;
    const box = this.element.getBoundingClientRect();
    const share = (way) => Math.max(-1, Math.min(1, way / KNOB));
    this.stick = [
      -share(event.clientY - box.top - box.height / 2),
      -share(event.clientX - box.left - box.width / 2),
    ];
    this.update();
  }

  lift(event) {
    if (event.pointerId !== this.finger) return;
    this.finger = null;
    this.stick = [0, 0];
    this.update();
  }

  press(key) {
    this.keys.set(key, DIRECTIONS[key]);
    this.update();
  }

  letGo(key) {
    if (this.keys.delete(key)) this.update();
  }

  release() {
    this.keys.clear();
    this.finger = null;
    this.stick = [0, 0];
    this.update();
  }

  command() {
    if (!this.visible) return [0, 0];
    const sum = (i) => [...this.keys.values()].reduce((total, each) => total + each[i], this.stick[i]);
    return [0, 1].map((i) => Math.max(-1, Math.min(1, sum(i))));
  }

  // Send what is held, now and again until it is nothing.
  update() {
    const command = this.command();
    const held = command[0] !== 0 || command[1] !== 0;
    if (held || this.timer) this.send(command);
    const knob = this.element?.firstElementChild;
    if (knob) knob.style.transform = `translate(${-KNOB * command[1]}px, ${-KNOB * command[0]}px)`;
    clearTimeout(this.timer);
    this.timer = held ? setTimeout(() => this.update(), REPEAT) : null;
  }

  close() {
    this.release();
    this.element = null;
  }
}

window.twbr = {
  robots: new Map(),
  lateness,
  isConnected() {
    return !((shownRobot()?.silence ?? 0) > SILENT);
  },
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

// The pad on the robot's tab that is shown.
function shownRobot() {
  return [...window.twbr.robots.values()].find((robot) => robot.pad.visible);
}

function isTyping(event) {
  const { target } = event;
  return target instanceof HTMLElement && (target.isContentEditable
    || (["INPUT", "TEXTAREA", "SELECT"].includes(target.tagName) || target.closest(".q-slider, .q-select")));
}

function releaseAll() {
  for (const robot of window.twbr.robots.values()) robot.pad.release();
}

// What is pressed without a connection would be done at some later moment: only stopping may.
addEventListener("click", (event) => {
  const button = event.target.closest?.(".twbr-actions button");
  if (!button || STOPS.includes(button.dataset.mark) || window.twbr.isConnected()) return;
  event.stopImmediatePropagation();
}, true);
addEventListener("keydown", (event) => {
  const robot = shownRobot(), key = event.key.toLowerCase();
  if (!robot || isTyping(event) || event.ctrlKey || event.altKey || event.metaKey) return;
  if (DIRECTIONS[key]) {
    event.preventDefault();
    if (!event.repeat) robot.pad.press(key);
  } else if (PUSHES[key] && !event.repeat) {
    const card = robot.pad.element.closest(".q-card");
    card?.querySelector(`[data-mark="${PUSHES[key]}"]`)?.click();
  }
});
addEventListener("keyup", (event) => {
  for (const robot of window.twbr.robots.values()) robot.pad.letGo(event.key.toLowerCase());
});
addEventListener("blur", releaseAll);
addEventListener("pagehide", releaseAll);
document.addEventListener("visibilitychange", () => {
  if (document.hidden) releaseAll();
  for (const robot of window.twbr.robots.values()) robot.look(document.hidden);
});

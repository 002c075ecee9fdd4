// Makes plots and turning bodies of the data of a page. In: the JSON of #plots, as ground/chart/src/live.rs has it. Out: in each
// [data-panel] a plot over the picture, in each [data-scene] a canvas. What a test asks for stands in data- attributes: points drawn, range shown.
(() => {
"use strict";
const page = JSON.parse(document.getElementById("plots").textContent);
const MAX_HEIGHT = 300, LEAST_SPAN = 1e-7;

// Columns: whole steps from a least value.
const decoded = new Map();
function column(index) {
  if (!decoded.has(index)) {
    const { least, step, bytes, text } = page.columns[index];
    const raw = Uint8Array.from(atob(text), (c) => c.charCodeAt(0)), view = new DataView(raw.buffer);
    const values = new Float64Array(raw.length / bytes);
    for (let k = 0; k < values.length; k++) {
      const code = bytes === 2 ? view.getUint16(2 * k, true) : view.getUint32(4 * k, true);
      values[k] = bytes === 2 && code === 65535 ? NaN : least + step * code;
    }
    decoded.set(index, values);
  }
  return decoded.get(index);
}

// First index at or after a value.
function lower(values, value) {
  let low = 0, high = values.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] < value) low = middle + 1; else high = middle;
  }
  return low;
}

const make = (name, parent, text, kind) => {
  const element = document.createElement(name);
  if (text) element.textContent = text;
  if (kind) element.className = kind;
  if (parent) parent.append(element);
  return element;
};
let style = getComputedStyle(document.documentElement);
const colour = (name) => style.getPropertyValue(typeof name === "number" ? "--c" + name : name).trim();

// A value with the digits that its span needs.
function said(value, span) {
  const size = Math.abs(value);
  if (!(span > 0)) span = size || 1;
  if (size !== 0 && (size >= 1e6 || Math.max(size, span) < 1e-3)) return value.toExponential(3);
  return value.toFixed(Math.min(8, Math.max(0, 3 - Math.floor(Math.log10(span)))));
}
const value = (axis, place, span) => {
  if (axis.names.length) return axis.names[Math.round(place) - 1] || "";
  return axis.log ? said(10 ** place, 10 ** place) : said(place, span);
};
function ticks(axis, splits, step) {
  const most = Math.max(...splits.map(Math.abs));
  return splits.map((place) => {
    if (axis.names.length) return axis.names[Math.round(place) - 1] || "";
    if (axis.log) return Number.isInteger(place) ? (Math.abs(place) < 3 ? String(10 ** place).slice(0, 4) : "1e" + place) : "";
    if (most >= 1e6 || (most < 1e-4 && most > 0)) return place === 0 ? "0" : place.toExponential(1);
    return place.toFixed(Math.min(8, Math.max(0, -Math.floor(Math.log10(step) + 1e-9))));
  });
}
function split(axis, min, max, step) {
  if (axis.names.length || (axis.log && max - min >= 1.5)) step = Math.max(1, axis.names.length ? 1 : Math.ceil((max - min) / 8));
  const all = [];
  for (let k = Math.ceil(min / step - 1e-9); k * step <= max + 1e-9 * step && all.length < 200; k++) all.push(k * step);
  return all;
}

// Panels whose x axes have the same label are moved together.
const groups = new Map();
class Group {
  constructor(key) { this.key = key; this.panels = []; this.scenes = []; this.shown = null; }
  get ends() {
    return [Math.min(...this.panels.map((panel) => panel.spec.x.from)), Math.max(...this.panels.map((panel) => panel.spec.x.to))];
  }
  zoom(from, to) {
    const [least, most] = this.ends, whole = most - least;
    if (!(to - from > LEAST_SPAN * whole)) return;
    if (from < least) { to = Math.min(most, to + least - from); from = least; }
    if (to > most) { from = Math.max(least, from - to + most); to = most; }
    this.shown = to - from > (1 - 1e-9) * whole ? null : [from, to];
    for (const panel of this.panels) panel.show();
  }
  whole() { this.shown = null; for (const panel of this.panels) panel.show(); }
  by(panel, factor, shift, about = 0.5) {
    const [from, to] = panel.range, span = to - from, pivot = from + about * span + shift * span;
    this.zoom(pivot - about * span * factor, pivot + (1 - about) * span * factor);
  }
  point(time, from) { for (const scene of this.scenes) if (scene !== from) scene.turn(time); }
}
function group(key) {
  if (!groups.has(key)) groups.set(key, new Group(key));
  return groups.get(key);
}

class Panel {
  constructor(element, figure) {
    this.element = element;
    this.figure = figure;
    this.spec = page.panels[element.dataset.panel];
    this.group = group(this.spec.x.label);
    this.group.panels.push(this);
  }
  get range() { return this.group.shown || [this.spec.x.from, this.spec.x.to]; }
  get layers() {
    this.made ??= this.spec.layers.map((layer) => ({
      ...layer,
      ...(layer.x === undefined ? {} : { x: column(layer.x), low: column(layer.low), high: column(layer.high) }),
    }));
    return this.made;
  }
  is_shown(layer) { return !this.figure.hidden.has(layer.name); }
  get height() { return Math.round(Math.max(200, Math.min(MAX_HEIGHT, 0.5 * this.element.clientWidth))); }

  // What y shows of the part of x that is shown; panels that share their y axis keep it alike.
  heights() {
    const { y } = this.spec;
    if (!this.group.shown && !this.figure.hidden.size || y.fixed) return [y.from, y.to];
    const alike = y.shared ? this.figure.panels.filter((other) => other.spec.y.shared && other.spec.y.label === y.label) : [this];
    let least = Infinity, most = -Infinity, strips = 0;
    for (const panel of alike) {
      const [from, to] = panel.range;
      strips = Math.max(strips, panel.spec.layers.filter((layer) => layer.kind === "strip" && layer.spans.length).length);
      for (const layer of panel.layers) {
        if (!layer.x || !panel.is_shown(layer)) continue;
        for (let k = lower(layer.x, from); k < layer.x.length && layer.x[k] <= to; k++) {
          if (layer.low[k] < least) least = layer.low[k];
          if (layer.high[k] > most) most = layer.high[k];
        }
      }
    }
    if (!(least <= most)) return [y.from, y.to];
    const span = Math.max(most - least, y.span, 1e-6 * Math.max(Math.abs(least), Math.abs(most)), 1e-12), middle = 0.5 * (least + most);
    return [middle - (0.56 + 0.04 * strips) * span, middle + 0.56 * span];
  }

  open() {
    if (this.plot) return;
    const { spec, element } = this;
    const small = element.clientWidth < 450;
    const axis = (which, side) => ({
      side, scale: which, label: spec[which].label, labelSize: 20, labelGap: 0, font: (small ? 11 : 12) + "px system-ui", labelFont: "13px system-ui",
      stroke: () => colour("--ink"), grid: { stroke: () => colour("--line"), width: 1 }, ticks: { stroke: () => colour("--line"), width: 1, size: 4 },
      size: which === "x" ? 34 : small ? 48 : 58, space: which === "x" ? (small ? 50 : 64) : 34, gap: 4,
      splits: (u, i, min, max, step) => split(spec[which], min, max, step),
      values: (u, splits, i, space, step) => ticks(spec[which], splits, step),
    });
    element.classList.add("live");
    this.under = make("p", element, "", "under");
    const holder = make("div", element, "", "plot");
    holder.tabIndex = 0;
    holder.setAttribute("role", "group");
    holder.setAttribute("aria-label", `${spec.title || this.figure.title}: plot. Arrows move along x, plus and minus zoom, Home shows all, shift and arrows move the pointer.`);
    this.holder = holder;
    this.plot = new uPlot({
      width: element.clientWidth, height: this.height, legend: { show: false }, padding: [8, 12, 0, 0],
      cursor: {
        y: false, points: { show: false }, sync: { key: spec.x.label, setSeries: false, scales: ["x", null] },
        drag: { x: true, y: false, setScale: false, dist: 4 },
        bind: { dblclick: () => () => this.group.whole(), mousedown: (u, target, usual) => (event) => {
          this.is_dragged = !event.shiftKey;
          return event.shiftKey ? this.pan(event) : usual(event);
        } },
      },
      scales: { x: { time: false, range: () => this.range }, y: { range: () => this.heights() } },
      axes: [axis("x", 2), axis("y", 3)],
      series: [{}, { stroke: "transparent", paths: () => null, points: { show: false } }],
      hooks: {
        draw: [() => this.draw()],
        setCursor: [() => this.say()],
        setSelect: [(u) => {
          const { left, width } = u.select, [from, to] = [left, left + width].map((px) => u.posToVal(px, "x"));
          if (!(width > 0)) return;
          u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
          // The plots beside it are told of the selection too; one of them zooms.
          if (this.is_dragged) this.group.zoom(from, to);
          this.is_dragged = false;
        }],
      },
    }, [[spec.x.from, spec.x.to], [spec.y.from, spec.y.to]], holder);
    holder.addEventListener("keydown", (event) => this.key(event));
    this.touch();
    this.plot.over.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      const box = this.plot.over.getBoundingClientRect();
      this.group.by(this, event.deltaY > 0 ? 1.25 : 0.8, 0, (event.clientX - box.left) / box.width);
    }, { passive: false });
    new ResizeObserver(() => {
      if (element.clientWidth > 0) this.plot.setSize({ width: element.clientWidth, height: this.height });
    }).observe(element);
    this.show();
  }

  show() {
    if (!this.plot) return;
    const [from, to] = this.range, [low, high] = this.heights();
    this.plot.batch(() => {
      this.plot.setScale("x", { min: from, max: to });
      this.plot.setScale("y", { min: low, max: high });
    });
    Object.assign(this.element.dataset, { from, to });
  }

  pan(start) {
    const [from, to] = this.range, span = to - from, width = this.plot.over.clientWidth;
    const move = (event) => { const by = (start.clientX - event.clientX) / width * span; this.group.zoom(from + by, to + by); };
    const end = () => { removeEventListener("mousemove", move); removeEventListener("mouseup", end); };
    addEventListener("mousemove", move);
    addEventListener("mouseup", end);
  }

  // One finger: the pointer, or pan where something is hidden. Two: zoom and pan. A double tap: all of it.
  touch() {
    const { over } = this.plot;
    let began = null, tapped = 0;
    const places = (event) => [...event.touches].slice(0, 2).map((touch) => touch.clientX - over.getBoundingClientRect().left);
    const start = (event) => { began = { at: places(event), range: this.range, y: event.touches[0]?.clientY, moved: false }; };
    over.addEventListener("touchstart", start, { passive: true });
    over.addEventListener("touchmove", (event) => {
      if (!began || began.at.length !== event.touches.length) return start(event);
      const now = places(event), [from, to] = began.range, width = over.clientWidth, at = (px) => from + (px / width) * (to - from);
      if (now.length === 2) {
        event.preventDefault();
        const [one, other] = [...began.at].sort((a, b) => a - b), [left, right] = now.sort((a, b) => a - b);
        const scale = (at(other) - at(one)) / Math.max(8, right - left);
        began.moved = true;
        this.group.zoom(at(one) - left * scale, at(one) + (width - left) * scale);
      } else {
        const dx = now[0] - began.at[0], dy = event.touches[0].clientY - began.y;
        if (!began.moved && Math.abs(dx) < Math.max(8, Math.abs(dy))) return;
        if (event.cancelable) event.preventDefault();
        began.moved = true;
        if (this.group.shown) this.group.zoom(from - (dx / width) * (to - from), to - (dx / width) * (to - from));
        else this.plot.setCursor({ left: now[0], top: 10 });
      }
    }, { passive: false });
    over.addEventListener("touchend", (event) => {
      if (began && !began.moved && began.at.length === 1) {
        if (event.timeStamp - tapped < 350) this.group.whole();
        tapped = event.timeStamp;
        this.plot.setCursor({ left: began.at[0], top: 10 });
      }
      began = null;
    });
  }

  key(event) {
    const { plot } = this;
    const width = plot.over.clientWidth, step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (step && event.shiftKey) {
      const left = plot.cursor.left >= 0 ? plot.cursor.left : width / 2;
      plot.setCursor({ left: Math.max(0, Math.min(width, left + step * width / 100)), top: 10 });
    } else if (step) this.group.by(this, 1, 0.2 * step);
    else if (event.key === "+" || event.key === "=") this.group.by(this, 0.5, 0);
    else if (event.key === "-") this.group.by(this, 2, 0);
    else if (event.key === "Home" || event.key === "Escape" || event.key === "0") this.group.whole();
    else return;
    event.preventDefault();
  }

  // What stands under the pointer: of each layer the nearest point.
  say() {
    const { plot, spec, under } = this, { left } = plot.cursor;
    under.replaceChildren();
    if (!(left >= 0)) return;
    const at = plot.posToVal(left, "x"), [from, to] = this.range, { min, max } = plot.scales.y;
    const reach = 12 / plot.over.clientWidth * (to - from);
    let near = at;
    const items = [];
    for (const layer of this.layers) {
      if (!this.is_shown(layer)) continue;
      if (layer.kind === "instants") {
        for (const [x, name] of layer.instants) if (Math.abs(x - at) <= 0.5 * reach) items.push([layer.colour, name]);
      } else if (layer.kind === "spans" || layer.kind === "strip") {
        if (layer.name && layer.spans.some(([one, other]) => at >= one - 0.2 * reach && at <= other + 0.2 * reach)) items.push([layer.colour, layer.name]);
      } else {
        let k = lower(layer.x, at);
        if (k === layer.x.length || (k > 0 && at - layer.x[k - 1] < layer.x[k] - at)) k--;
        if (k < 0 || Math.abs(layer.x[k] - at) > Math.max(reach, (layer.x[layer.x.length - 1] - layer.x[0]) / layer.x.length)) continue;
        near = layer.x[k];
        if (Number.isNaN(layer.low[k])) continue;
        const numbers = [layer.low[k], layer.high[k]].map((place) => value(spec.y, place, max - min));
        const one = layer.kind === "bars" ? numbers[layer.high[k] > 0 ? 1 : 0] : numbers[0] === numbers[1] ? numbers[0] : numbers.join(" to ");
        items.push([layer.colour, `${layer.name} ${one}`.trim()]);
      }
    }
    make("span", under, `${spec.x.label.replace(/\s*\[.*\]/, "")} ${value(spec.x, near, to - from)}`);
    for (const [shade, text] of items) {
      const item = make("span", under, "", "c" + shade);
      make("i", item);
      item.append(text);
    }
    this.group.point(at, null);
  }

  draw() {
    const { plot } = this, { ctx } = plot, { left, top, width, height } = plot.bbox, px = devicePixelRatio || 1;
    const [from, to] = this.range;
    const X = (place) => plot.valToPos(place, "x", true), Y = (place) => plot.valToPos(place, "y", true);
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, top, width, height);
    ctx.clip();
    ctx.lineJoin = "round";
    let strips = 0, points = 0;
    for (const layer of this.layers) {
      if (!this.is_shown(layer)) { strips += layer.kind === "strip"; continue; }
      ctx.strokeStyle = ctx.fillStyle = colour(layer.colour);
      ctx.lineWidth = 1.5 * px;
      ctx.setLineDash(layer.kind === "dashes" || layer.kind === "instants" ? [6 * px, 4 * px] : []);
      ctx.globalAlpha = layer.kind === "band" ? 0.28 : layer.kind === "spans" ? 0.15 : 1;
      ctx.beginPath();
      if (layer.spans) {
        const foot = top + height - (1 + 8 * strips) * px;
        for (const [one, other] of layer.spans) {
          if (other < from || one > to) continue;
          const [a, b] = [X(Math.max(one, from)), X(Math.min(other, to))];
          if (layer.kind === "strip") ctx.rect(a, foot - 6 * px, Math.max(1.5 * px, b - a), 6 * px);
          else ctx.rect(a, top, Math.max(1.5 * px, b - a), height);
          points++;
        }
        strips += layer.kind === "strip";
        ctx.fill();
        continue;
      }
      if (layer.instants) {
        let last = -Infinity;
        ctx.font = 11 * px + "px system-ui";
        const seen = layer.instants.filter(([x]) => x >= from && x <= to);
        for (const [x] of seen) { ctx.moveTo(X(x), top); ctx.lineTo(X(x), top + height); }
        ctx.stroke();
        // A name along its line, where it has room.
        for (const [x, name] of seen) {
          const at = X(x);
          if (at - last < 13 * px) continue;
          last = at;
          ctx.save();
          ctx.translate(at + (at + 14 * px > left + width ? -4 : 11) * px, top + 4 * px);
          ctx.rotate(Math.PI / 2);
          ctx.textAlign = "left";
          ctx.textBaseline = "alphabetic";
          // A rim of the page's colour: the next line is often closer than the name is wide.
          ctx.setLineDash([]);
          ctx.lineWidth = 4 * px;
          ctx.lineJoin = "round";
          ctx.strokeStyle = colour("--back");
          ctx.strokeText(name, 0, 4 * px);
          ctx.fillStyle = colour("--soft");
          ctx.fillText(name, 0, 4 * px);
          ctx.restore();
        }
        points += seen.length;
        continue;
      }
      const { x, low, high } = layer;
      const first = Math.max(0, lower(x, from) - 1), last = Math.min(x.length, lower(x, to) + 2);
      if (layer.kind === "line" || layer.kind === "dashes") {
        let is_open = false;
        for (let k = first; k < last; k++) {
          if (Number.isNaN(low[k])) { is_open = false; continue; }
          points++;
          const at = X(x[k]), y = Y(low[k]);
          if (is_open) ctx.lineTo(at, y);
          else {
            ctx.moveTo(at, y);
            // A single point is no line: it is drawn as a short one.
            if (k + 1 >= last || Number.isNaN(low[k + 1])) ctx.lineTo(at + 1.5 * px, y);
          }
          is_open = true;
        }
        ctx.stroke();
      } else if (layer.kind === "band") {
        for (let k = first; k < last; k++) {
          const start = k;
          while (k < last && !Number.isNaN(low[k])) k++;
          if (k === start) continue;
          ctx.moveTo(X(x[start]), Y(low[start]));
          for (let j = start + 1; j < k; j++) ctx.lineTo(X(x[j]), Y(low[j]));
          for (let j = k - 1; j >= start; j--) ctx.lineTo(X(x[j]), Y(high[j]));
          ctx.closePath();
          points += k - start;
        }
        ctx.fill();
      } else {
        for (let k = first; k < last; k++) {
          if (Number.isNaN(low[k])) continue;
          points++;
          const at = X(x[k]), y = Y(low[k]);
          if (layer.kind === "dots") ctx.rect(at - 1.6 * px, y - 1.6 * px, 3.2 * px, 3.2 * px);
          else if (layer.kind === "whiskers") { ctx.moveTo(at, y); ctx.lineTo(at, Y(high[k])); }
          else { const half = X(x[k] + layer.half) - at; ctx.rect(at - half, Y(high[k]), 2 * half, y - Y(high[k])); }
        }
        if (layer.kind === "whiskers") ctx.stroke(); else ctx.fill();
      }
    }
    ctx.restore();
    this.element.dataset.points = points;
  }
}

// A figure: its legend switches layers in all its panels, its buttons move them.
class Figure {
  constructor(section) {
    this.title = section.querySelector("h2").textContent;
    this.hidden = new Set();
    this.panels = [...section.querySelectorAll("[data-panel]")].map((element) => new Panel(element, this));
    for (const item of section.querySelectorAll(".bar li")) {
      const name = item.textContent, button = make("button");
      button.append(...item.childNodes);
      button.setAttribute("aria-pressed", "true");
      button.title = "show or hide";
      item.append(button);
      button.addEventListener("click", () => {
        if (!this.hidden.delete(name)) this.hidden.add(name);
        button.setAttribute("aria-pressed", String(!this.hidden.has(name)));
        for (const panel of this.panels) panel.show(), panel.plot?.redraw(false, false);
      });
    }
    const tools = make("div", section.querySelector(".bar"), "", "tools");
    const tool = (text, title, act) => {
      const button = make("button", tools, text);
      button.title = title;
      button.setAttribute("aria-label", title);
      // Each group once.
      button.addEventListener("click", () => new Map(this.panels.map((panel) => [panel.group, panel])).forEach((panel, group) => act(group, panel)));
    };
    tool("−", "zoom out", (group, panel) => group.by(panel, 2, 0));
    tool("+", "zoom in", (group, panel) => group.by(panel, 0.5, 0));
    tool("◂", "earlier", (group, panel) => group.by(panel, 1, -0.5));
    tool("▸", "later", (group, panel) => group.by(panel, 1, 0.5));
    tool("all", "show all", (group) => group.whole());
  }
}

// A body that turns: q v q*, seen from azimuth and elevation.
class Scene {
  constructor(element) {
    this.element = element;
    this.spec = page.scenes[element.dataset.scene];
    this.group = group(this.spec.time);
    this.group.scenes.push(this);
    this.poses = this.spec.poses.map((poses) => ({ ...poses, t: column(poses.t), q: poses.q.map(column) })).filter((poses) => poses.t.length);
    if (!this.poses.length) return;
    element.classList.add("live");
    Object.assign(this, { azimuth: this.spec.azimuth, elevation: this.spec.elevation });
    this.canvas = make("canvas", element);
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "the body as it was turned; drag or arrows look at it from another side");
    const row = make("div", element, "", "time");
    this.play = make("button", row, "▶");
    this.play.setAttribute("aria-label", "play");
    this.slider = make("input", row);
    const { t } = this.poses[0];
    Object.assign(this.slider, { type: "range", min: t[0], max: t[t.length - 1], step: "any", value: t[0] });
    this.slider.setAttribute("aria-label", this.spec.time);
    this.output = make("output", row);
    const legend = make("div", element, "", "under");
    for (const poses of this.poses) { const item = make("span", legend, "", "c" + poses.colour); make("i", item); item.append(poses.name); }
    this.slider.addEventListener("input", () => this.lead(Number(this.slider.value)));
    this.play.addEventListener("click", () => this.run());
    this.canvas.addEventListener("pointerdown", (event) => { this.held = [event.clientX, event.clientY]; this.canvas.setPointerCapture(event.pointerId); });
    this.canvas.addEventListener("pointerup", () => { this.held = null; });
    this.canvas.addEventListener("pointercancel", () => { this.held = null; });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!this.held) return;
      this.look((event.clientX - this.held[0]) * 0.01, (event.clientY - this.held[1]) * 0.01);
      this.held = [event.clientX, event.clientY];
    });
    this.canvas.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
      if (by) { this.look(...by); event.preventDefault(); }
    });
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.turn(t[0]);
  }
  look(azimuth, elevation) {
    this.azimuth += azimuth;
    this.elevation = Math.max(-1.5, Math.min(1.5, this.elevation + elevation));
    this.draw();
  }
  // Turns, and takes the pointers of the plots along.
  lead(time) {
    this.turn(time);
    for (const { plot } of this.group.panels) if (plot) plot.setCursor({ left: plot.valToPos(time, "x"), top: 10 }, false);
    for (const panel of this.group.panels) if (panel.plot && panel.range[0] <= time && time <= panel.range[1]) panel.say();
  }
  run() {
    const { t } = this.poses[0], span = t[t.length - 1] - t[0];
    if (this.running) { cancelAnimationFrame(this.running); this.running = 0; this.play.textContent = "▶"; return; }
    this.play.textContent = "⏸";
    let last = performance.now(), time = this.time >= t[t.length - 1] ? t[0] : this.time;
    const step = (now) => {
      // All of it in half a minute.
      time += (now - last) / 30_000 * span;
      last = now;
      this.lead(Math.min(time, t[t.length - 1]));
      if (time >= t[t.length - 1]) { this.running = 0; this.play.textContent = "▶"; } else this.running = requestAnimationFrame(step);
    };
    this.running = requestAnimationFrame(step);
  }
  turn(time) {
    if (!this.canvas) return;
    this.time = time;
    this.slider.value = time;
    const name = this.spec.time.replace(/\s*\[.*\]/, "");
    this.output.textContent = `${name} ${said(time, this.slider.max - this.slider.min)}`;
    this.draw();
  }
  draw() {
    const { canvas, spec } = this, px = devicePixelRatio || 1, side = canvas.clientWidth;
    if (!side) return;
    const tall = Math.min(side, 360);
    canvas.style.height = tall + "px";
    canvas.width = side * px;
    canvas.height = tall * px;
    const ctx = canvas.getContext("2d"), unit = 0.36 * tall * px, [sa, ca, se, ce] = [Math.sin(this.azimuth), Math.cos(this.azimuth), Math.sin(this.elevation), Math.cos(this.elevation)];
    const towards = [ce * ca, ce * sa, -se], right = [sa, -ca, 0];
    const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    const up = cross(towards, right), dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const seen = (v) => [canvas.width / 2 + unit * dot(right, v), canvas.height / 2 - unit * dot(up, v)];
    const arrow = (tip, name, shade, width, dash) => {
      ctx.strokeStyle = ctx.fillStyle = shade;
      ctx.lineWidth = width * px;
      ctx.setLineDash(dash ? [4 * px, 4 * px] : []);
      ctx.beginPath();
      ctx.moveTo(...seen([0, 0, 0]));
      ctx.lineTo(...seen(tip));
      ctx.stroke();
      ctx.font = 12 * px + "px system-ui";
      ctx.textAlign = "center";
      ctx.textBaseline = "middle";
      if (name) ctx.fillText(name, ...seen(tip.map((part) => 1.13 * part)));
    };
    for (const { tip, name } of spec.world) arrow(tip, name, colour("--soft"), 1, true);
    this.poses.forEach((poses, index) => {
      let k = lower(poses.t, this.time);
      if (k === poses.t.length || (k > 0 && this.time - poses.t[k - 1] < poses.t[k] - this.time)) k--;
      const [w, ...u] = poses.q.map((part) => part[k]);
      if (Number.isNaN(w)) return;
      const turned = (v) => { const t = cross(u, v).map((part) => 2 * part), ut = cross(u, t); return v.map((part, j) => part + w * t[j] + ut[j]); };
      const faces = spec.faces.map((face) => ({ face, corners: face.corners.map(turned) }));
      const depth = ({ corners }) => corners.reduce((sum, corner) => sum + dot(towards, corner), 0) / corners.length;
      faces.sort((one, other) => depth(one) - depth(other));
      for (const { face, corners } of faces) {
        ctx.beginPath();
        corners.forEach((corner, j) => (j ? ctx.lineTo(...seen(corner)) : ctx.moveTo(...seen(corner))));
        ctx.closePath();
        ctx.setLineDash([]);
        ctx.lineWidth = (index ? 1.2 : 1) * px;
        ctx.strokeStyle = ctx.fillStyle = colour(index ? poses.colour : face.colour);
        if (!index) { ctx.globalAlpha = 0.4; ctx.fill(); ctx.globalAlpha = 1; }
        ctx.stroke();
      }
      for (const { tip, name, colour: shade } of spec.body) arrow(turned(tip), index ? "" : name, colour(index ? poses.colour : shade), index ? 1.2 : 2, index > 0);
    });
    this.element.dataset.time = this.time;
  }
}

const sections = [...document.querySelectorAll("section")].filter((section) => section.querySelector("[data-panel]"));
const figures = sections.map((section) => new Figure(section));
const scenes = [...document.querySelectorAll("[data-scene]")].map((element) => new Scene(element));
const panels = figures.flatMap((figure) => figure.panels);
// Plots are made when they come near the window: a long page is there at once.
const near = new IntersectionObserver((entries) => {
  for (const { isIntersecting, target } of entries) {
    if (!isIntersecting) continue;
    near.unobserve(target);
    panels.find((panel) => panel.element === target).open();
  }
}, { rootMargin: "400px" });
for (const panel of panels) near.observe(panel.element);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  style = getComputedStyle(document.documentElement);
  for (const { plot } of panels) plot?.redraw(false, true);
  for (const scene of scenes) scene.draw();
});
document.documentElement.dataset.plots = "made";
})();

"use strict";
// Curves and bars over one time axis, with a cursor that follows; SVG, drawn anew when the page changes its width.
const SimreconCharts = (() => {
  const SVG = "http://www.w3.org/2000/svg";
  const RIGHT = 14;

  function make(name, attributes = {}, text) {
    const node = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    return node;
  }

  function html(name, attributes = {}, ...inside) {
    const node = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    node.append(...inside);
    return node;
  }

  // About `count` round numbers from low to high.
  function ticks(low, high, count) {
    const rough = (high - low) / Math.max(count, 1) || 1, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map(m => m * power).find(s => s >= rough - 1e-12);
    const found = [];
    for (let value = Math.ceil(low / step - 1e-9) * step; value <= high + 1e-9 * step; value += step) found.push(value);
    return found.map(value => Math.abs(value) < 1e-9 * step ? 0 : value);
  }

  // The least range that holds one, and all values that are known.
  function span(values, low, high) {
    for (const value of values) {
      if (value === null) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    return [low, high];
  }

  function shown(value, digits = 3) {
    if (value === null || value === undefined) return "–";
    const size = Math.abs(value);
    return size >= 100 ? value.toFixed(0) : size >= 10 ? value.toFixed(Math.min(1, digits)) : value.toFixed(Math.min(2, digits));
  }

  // One row of the page: `series` of curves, or `bars`, or `cells`.
  class Track {
    constructor(charts, options) {
      Object.assign(this, { height: 96, lines: [], series: [], unit: "", digits: 2, zero: true }, options);
      this.charts = charts;
      this.outputs = [];
      this.figure = html("figure", { class: "track" });
      this.caption = html("figcaption");
      this.plot = html("div", { class: "plot" });
      this.figure.append(this.caption, this.plot);
      this.label();
    }

    label() {
      const title = html("span", { class: "title" }, this.title);
      if (this.unit) title.append(html("span", { class: "unit" }, ` ${this.unit}`));
      const legend = html("span", { class: "legend" });
      this.outputs = this.series.map(line => {
        const value = html("b");
        legend.append(html("span", { class: "key" }, html("i", { class: line.class }), `${line.label} `, value));
        return value;
      });
      this.caption.replaceChildren(title, ...(this.extra ? [this.extra] : []), legend);
    }

    change(options) {
      Object.assign(this, options);
      this.label();
      this.draw();
    }

    range() {
      let low = this.zero ? 0 : Infinity, high = this.zero ? 0 : -Infinity;
      for (const line of this.series) for (const values of [line.values, ...(line.band || [])]) [low, high] = span(values, low, high);
      for (const line of this.lines) high = Math.max(high, line.value);
      const least = this.least || 1e-3, slack = Math.max(0.06 * (high - low), (least - (high - low)) / 2);
      return [low < 0 || !this.zero ? low - slack : low, high + slack];
    }

    draw() {
      const { width, left } = this.charts, svg = make("svg", { width, height: this.height, role: "img", "aria-label": this.says() });
      this.svg = svg;
      this.shade();
      if (this.bars) this.drawBars(); else if (this.cells) this.drawCells(); else this.drawCurves();
      svg.append(make("line", { class: "edge", x1: left, x2: left, y1: 0, y2: this.height }));
      this.plot.replaceChildren(svg);
    }

    says() {
      if (this.bars) return `${this.title}: ${this.bars.map(bar => bar.label).join(", ") || "none"}`;
      if (this.cells) return `${this.title}: ${this.cells.map(cell => cell.verdict).join(", ")}`;
      const parts = this.series.map(line => {
        const [low, high] = span(line.values, Infinity, -Infinity);
        return `${line.label} from ${shown(low)} to ${shown(high)}`;
      });
      return `${this.title}, ${this.unit}: ${parts.join("; ")}`;
    }

    // Frames that are not simulated.
    shade() {
      for (const [from, to] of this.charts.lost) {
        const x = this.charts.x(from);
        this.svg.append(make("rect", { class: "lost", x, y: 0, width: Math.max(this.charts.x(to) - x, 1), height: this.height }));
      }
    }

    drawCurves() {
      const [low, high] = this.range(), { left, width } = this.charts, top = 6, bottom = this.height - 8;
      const y = value => bottom - (value - low) / (high - low) * (bottom - top);
      for (const value of ticks(low, high, this.height / 34)) {
        this.svg.append(make("line", { class: value === 0 ? "grid nought" : "grid", x1: left, x2: width - RIGHT, y1: y(value), y2: y(value) }));
        this.svg.append(make("text", { class: "tick", x: left - 7, y: y(value) + 4, "text-anchor": "end" }, +value.toPrecision(6)));
      }
      for (const line of this.lines) {
        this.svg.append(make("line", { class: "mark", x1: left, x2: width - RIGHT, y1: y(line.value), y2: y(line.value) }));
        this.svg.append(make("text", { class: "note", x: width - RIGHT - 4, y: y(line.value) - 4, "text-anchor": "end" }, line.label));
      }
      const times = this.charts.times;
      for (const line of this.series) {
        let path = "";
        line.values.forEach((value, i) => { if (value !== null) path += `${path ? "L" : "M"}${this.charts.x(times[i]).toFixed(1)} ${y(value).toFixed(1)}`; });
        if (line.band) this.svg.append(make("path", { class: `area ${line.class}`, d: this.between(line.band, y) }));
        if (line.filled) this.svg.append(make("path", { class: `area ${line.class}`, d: `${path}L${this.charts.x(times.at(-1)).toFixed(1)} ${y(0)}L${this.charts.x(times[0]).toFixed(1)} ${y(0)}Z` }));
        this.svg.append(make("path", { class: `curve ${line.class}`, d: path }));
      }
    }

    // The area between two curves, one piece for each run of frames in which both are known.
    between([lows, highs], y) {
      let path = "";
      const point = (values, i) => `${this.charts.x(this.charts.times[i]).toFixed(1)} ${y(values[i]).toFixed(1)}`;
      for (let from = 0; from < lows.length; from++) {
        if (lows[from] === null || highs[from] === null) continue;
        let to = from;
        while (to + 1 < lows.length && lows[to + 1] !== null && highs[to + 1] !== null) to++;
        const frames = Array.from({ length: to - from + 1 }, (_, i) => from + i);
        path += `M${[...frames.map(i => point(highs, i)), ...frames.reverse().map(i => point(lows, i))].join("L")}Z`;
        from = to;
      }
      return path;
    }

    drawBars() {
      const { left, width } = this.charts;
      this.bars.forEach((bar, row) => {
        const y = 3 + 18 * row;
        this.svg.append(make("text", { class: "tick", x: left - 7, y: y + 11, "text-anchor": "end" }, bar.label));
        this.svg.append(make("line", { class: "grid", x1: left, x2: width - RIGHT, y1: y + 7, y2: y + 7 }));
        for (const [from, to] of bar.spans) {
          const x = this.charts.x(from), rect = make("rect", { class: `bar ${bar.class}`, x, y, rx: 3, height: 14, width: Math.max(this.charts.x(to) - x, 2) });
          rect.append(make("title", {}, `${bar.label}: ${from.toFixed(2)} to ${to.toFixed(2)} s`));
          this.svg.append(rect);
        }
      });
      if (!this.bars.length) this.svg.append(make("text", { class: "note", x: left + 8, y: 16 }, "nothing touches"));
    }

    drawCells() {
      const signs = { good: "✓", doubtful: "?", bad: "✕" };
      for (const cell of this.cells) {
        const x = this.charts.x(cell.from_s) + 0.5, wide = Math.max(this.charts.x(cell.to_s) - x - 0.5, 1);
        const rect = make("rect", { class: `cell ${cell.verdict}`, x, y: 2, rx: 3, height: 18, width: wide });
        rect.append(make("title", {}, `${cell.from_s.toFixed(1)} to ${cell.to_s.toFixed(1)} s: ${cell.verdict}${cell.reason ? `, ${cell.reason}` : ""}`));
        this.svg.append(rect);
        if (wide > 16) this.svg.append(make("text", { class: "sign", x: x + wide / 2, y: 15.5, "text-anchor": "middle" }, signs[cell.verdict] || ""));
      }
    }

    at(frame) {
      this.series.forEach((line, i) => { this.outputs[i].textContent = shown(line.values[frame], this.digits); });
    }
  }

  class Charts {
    constructor(box, curves, onSeek) {
      Object.assign(this, { box, curves, onSeek, times: curves.times_s, tracks: [], frame: 0 });
      this.last = this.times.at(-1) || 1;
      this.lost = this.spansOf(curves.status.map(status => status === 1));
      this.cursor = html("div", { class: "cursor", "aria-hidden": "true" });
      this.axis = html("div", { class: "axis" });
      box.append(this.axis, this.cursor);
      box.addEventListener("pointerdown", event => this.press(event));
      box.addEventListener("pointermove", event => { if (this.held) this.seek(event); });
      for (const end of ["pointerup", "pointercancel"]) box.addEventListener(end, () => { this.held = false; });
    }

    spansOf(status) {
      const found = [];
      status.forEach((flag, i) => {
        if (!flag) return;
        const from = this.times[Math.max(i - 1, 0)], to = this.times[i];
        if (i && status[i - 1]) found.at(-1)[1] = to; else found.push([from, to]);
      });
      return found;
    }

    add(options) {
      const track = new Track(this, options);
      this.tracks.push(track);
      this.box.insertBefore(track.figure, this.axis);
      return track;
    }

    x(time) { return this.left + time / this.last * (this.width - this.left - RIGHT); }

    press(event) {
      if (!event.target.closest(".plot, .axis") || event.button) return;
      this.held = true;
      this.box.setPointerCapture(event.pointerId);
      this.seek(event);
    }

    seek(event) {
      const at = event.clientX - this.box.getBoundingClientRect().left;
      const share = (at - this.left) / (this.width - this.left - RIGHT);
      this.onSeek(Math.min(Math.max(share, 0), 1) * this.last);
    }

    draw() {
      this.width = this.box.clientWidth;
      if (!this.width) return;
      this.left = this.width < 560 ? 70 : 104;
      for (const track of this.tracks) track.draw();
      const svg = make("svg", { width: this.width, height: 26, "aria-hidden": "true" });
      for (const time of ticks(0, this.last, this.width / 110)) {
        const x = this.x(time);
        svg.append(make("line", { class: "edge", x1: x, x2: x, y1: 0, y2: 5 }));
        svg.append(make("text", { class: "tick", x, y: 18, "text-anchor": "middle" }, `${+time.toPrecision(6)} s`));
      }
      this.axis.replaceChildren(svg);
      this.point(this.time || 0, this.frame);
      this.tell();
    }

    point(time, frame) {
      Object.assign(this, { time, frame });
      this.cursor.style.transform = `translateX(${this.x(time)}px)`;
    }

    tell() {
      for (const track of this.tracks) track.at(this.frame);
    }
  }

  return { Charts, html, shown };
})();

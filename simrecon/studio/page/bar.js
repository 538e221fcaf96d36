// The bar under the view: time, plots with a cursor, and the strip of contacts. It talks to the studio by a
// websocket of its own; the view above it is viser's.
"use strict";
(() => {
  // A browser that draws on the processor draws half as many dots each way: viser takes that from the address.
  const probe = document.createElement("canvas").getContext("webgl2");
  const named = probe && probe.getExtension("WEBGL_debug_renderer_info");
  const renderer = probe ? String(probe.getParameter(named ? named.UNMASKED_RENDERER_WEBGL : probe.RENDERER)) : "";
  const slow = /swiftshader|llvmpipe|software|basic render/i.test(renderer);
  if (slow && !location.search.includes("fixedDpr")) {
    history.replaceState(null, "", `${location.pathname}${location.search || "?"}&fixedDpr=0.5`);
  }
  if (probe && probe.getExtension("WEBGL_lose_context")) probe.getExtension("WEBGL_lose_context").loseContext();

  const LEFT = 104, RULER = 16, PLOT = 30, GAP = 4, INK = "#23272e", A = "#2b5fb4", B = "#d9730d";
  const MODES = {
    auto: "as it is found", always: "it touches throughout", never: "it touches nothing", grounded: "it is on what bears it, and may slide",
  };
  const WISH = { touch: "#1d8a4e", free: "#b3261e", auto: "#8b93a0" };
  let clip = { times: [], parts: [], inside: [] }, time = { t: 0, playing: false, speed: 1, loop: null };
  let state = { edits: false, unsaved: false, undo: "", redo: "", run: "" };
  let socket = null, brush = "scrub", drag = null, sent = 0, waiting = null, refused = "";

  const bar = document.createElement("div");
  bar.id = "studio-bar";
  bar.innerHTML = `<div class="row">
    <button id="studio-play" title="play or stop (space)">Play</button>
    <select id="studio-speed" title="speed" aria-label="speed">${[0.1, 0.25, 0.5, 1, 2]
      .map((v) => `<option value="${v}"${v === 1 ? " selected" : ""}>${v}×</option>`).join("")}</select>
    <span id="studio-time"></span>
    <span>drag:</span>
    ${["scrub", "loop", "touch", "free", "auto", "clear"]
      .map((b) => `<button class="brush" data-brush="${b}">${b}</button>`).join("")}
    <button id="studio-undo" title="undo (Ctrl+Z)">Undo</button>
    <button id="studio-redo" title="redo (Ctrl+Y)">Redo</button>
    <span class="grow" id="studio-words"></span></div>
    <div id="studio-strip"><canvas id="studio-canvas"
      aria-label="time, vertical force, height of the pelvis, and contacts"></canvas><div id="studio-cursor"></div>
    <div id="studio-modes"></div></div>`;
  const find = (id) => bar.querySelector(`#studio-${id}`);
  const canvas = find("canvas"), pen = canvas.getContext("2d");

  const say = (message) => {
    if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
  };
  // One seek is under way at a time, and the last place wins: a busy studio is not flooded.
  const seek = (t) => {
    waiting = t;
    if (sent && performance.now() - sent < 250) return;
    sent = performance.now();
    say({ do: "seek", t });
    waiting = null;
  };

  const range = () => clip.times.length ? [clip.times[0], clip.times[clip.times.length - 1]] : [0, 1];
  const x = (t) => { const [a, b] = range(); return LEFT + (t - a) / Math.max(b - a, 1e-6) * (canvas.clientWidth - LEFT - 12); };
  const at = (px) => { const [a, b] = range(); return Math.min(Math.max(a + (px - LEFT) / (canvas.clientWidth - LEFT - 12) * (b - a), a), b); };
  const top = () => RULER + 2 * (PLOT + GAP);
  const rowHeight = () => clip.parts.length ? Math.max((canvas.clientHeight - top()) / clip.parts.length, 6) : 9;

  function draw() {
    const ratio = window.devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
    if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
      canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio);
    }
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, w, h);
    pen.font = "10px system-ui, sans-serif";
    pen.textBaseline = "middle";
    ruler(w);
    curve("force, N", clip.force, clip.b && clip.b.force, RULER, true);
    curve("pelvis, m", clip.height, clip.b && clip.b.height, RULER + PLOT + GAP, false);
    strip(w);
    placeModes();
    if (time.loop) {
      pen.fillStyle = "#2b5fb41c";
      pen.fillRect(x(time.loop[0]), 0, x(time.loop[1]) - x(time.loop[0]), h);
    }
    if (drag && drag.kind !== "scrub") {
      pen.fillStyle = (WISH[drag.kind] || A) + "55";
      const y = drag.row === null ? 0 : top() + drag.row * rowHeight();
      pen.fillRect(x(Math.min(drag.from, drag.to)), y, Math.abs(x(drag.to) - x(drag.from)), drag.row === null ? h : rowHeight());
    }
    cursor();
  }

  // The cursor is an element of its own: what is below it is drawn again only where it has changed.
  function cursor() {
    find("cursor").style.transform = `translateX(${x(time.t) - 0.75}px)`;
    const row = clip.times.length ? nearest(clip.times, time.t) : 0;
    const at = (curves, name, unit, digits) => {
      const value = curves && curves[name] && curves[name][nearest(curves.times, time.t)];
      return value === null || value === undefined ? "" : `, ${value.toFixed(digits)} ${unit}`;
    };
    const b = clip.b ? `; B${at(clip.b, "force", "N", 0)}${at(clip.b, "height", "m", 2)}`.replace("B,", "B") : "";
    find("time").textContent = `${time.t.toFixed(2)} s, frame ${row} of ${clip.times.length}`
      + at(clip, "force", "N", 0) + at(clip, "height", "m", 2) + (b === "; B" ? "" : b);
  }

  function ruler(w) {
    const [a, b] = range(), step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60].find((s) => (b - a) / s <= w / 80) || 120;
    pen.fillStyle = "#59616d"; pen.textAlign = "center";
    for (let t = Math.ceil(a / step) * step; t <= b + 1e-9; t += step) {
      pen.fillText(t.toFixed(step < 1 ? 1 : 0), x(t), 6);
      pen.fillRect(x(t), 11, 1, 4);
    }
    pen.fillStyle = "#b3261e";
    for (const one of clip.inside) for (const [p, q] of one.spans) pen.fillRect(x(p), 13, Math.max(x(q) - x(p), 2), 3);
    pen.textAlign = "left"; pen.fillStyle = "#59616d"; pen.fillText("time, s", 0, 6);
  }

  function curve(name, own, other, y, fromZero) {
    pen.fillStyle = "#f1f3f6"; pen.fillRect(LEFT, y, canvas.clientWidth - LEFT - 12, PLOT);
    const values = [...(own || []), ...(other || [])].filter((v) => v !== null);
    pen.fillStyle = "#59616d"; pen.textAlign = "left"; pen.fillText(name, 0, y + 10);
    if (!values.length) return;
    let low = Math.min(...values), high = Math.max(...values);
    if (fromZero) low = Math.min(0, low);
    if (high - low < 1e-6) high = low + 1;
    pen.fillStyle = "#8b93a0"; pen.textAlign = "right";
    pen.fillText(high.toFixed(fromZero ? 0 : 2), LEFT - 4, y + 5); pen.fillText(low.toFixed(fromZero ? 0 : 2), LEFT - 4, y + PLOT - 4);
    line(clip.times, own, A); if (clip.b) line(clip.b.times, other, B);
    function line(times, points, colour) {
      if (!points) return;
      pen.strokeStyle = colour; pen.lineWidth = 1.25; pen.beginPath();
      let down = false;
      points.forEach((v, i) => {
        if (v === null) { down = false; return; }
        const px = x(times[i]), py = y + PLOT - 2 - (v - low) / (high - low) * (PLOT - 4);
        if (down) pen.lineTo(px, py); else pen.moveTo(px, py);
        down = true;
      });
      pen.stroke();
    }
  }

  function strip(w) {
    const height = rowHeight();
    clip.parts.forEach((part, i) => {
      const y = top() + i * height;
      pen.fillStyle = i % 2 ? "#f6f7f9" : "#eceff3"; pen.fillRect(LEFT, y, w - LEFT - 12, height - 1);
      pen.fillStyle = INK; pen.textAlign = "left";
      pen.fillText(part.name.replace("_", " ") + (part.mode === "auto" ? "" : `: ${part.mode}`), 0, y + height / 2);
      const bars = (spans, colour, from, to) => {
        pen.fillStyle = colour;
        for (const [p, q] of spans) {
          const left = Math.max(x(p), LEFT), right = Math.min(x(q), w - 12);
          if (right > left) pen.fillRect(left, y + from * height, Math.max(right - left, 1.5), (to - from) * height);
        }
      };
      bars(part.found, A + "88", 0.08, clip.b ? 0.45 : 0.85);
      bars(part.found_b, B + "99", 0.5, 0.85);
      for (const kind of ["auto", "free", "touch"]) {
        bars(part[kind], WISH[kind] + "66", 0, 0.95); bars(part[kind], WISH[kind], 0.8, 1);
      }
    });
  }

  // What holds of a part where nothing is painted: its name is a menu. The words are drawn below it.
  function placeModes() {
    const box = find("modes"), names = clip.parts.map((part) => part.name).join();
    if (box.dataset.names !== names) {
      box.dataset.names = names;
      box.replaceChildren(...clip.parts.map((part) => {
        const words = part.name.replace("_", " "), menu = document.createElement("select");
        menu.setAttribute("aria-label", `${words}: mode`);
        menu.dataset.part = part.name;
        for (const [mode, meaning] of Object.entries(MODES)) menu.add(new Option(`${words}: ${mode} (${meaning})`, mode));
        menu.addEventListener("change", () => say({ do: "mode", part: part.name, mode: menu.value }));
        return menu;
      }));
    }
    [...box.children].forEach((menu, i) => {
      const part = clip.parts[i];
      Object.assign(menu.style, { top: `${top() + i * rowHeight()}px`, height: `${rowHeight()}px`, width: `${LEFT - 4}px` });
      menu.title = `${part.name.replace("_", " ")}: ${part.mode}, ${MODES[part.mode]}. Click for another mode.`;
      if (document.activeElement !== menu || menu.value !== part.mode) menu.value = part.mode;
      menu.disabled = !state.edits;
    });
  }

  const nearest = (times, t) => {
    let low = 0, high = times.length - 1;
    while (high - low > 1) { const mid = (low + high) >> 1; if (times[mid] <= t) low = mid; else high = mid; }
    return high > 0 && Math.abs(times[high] - t) < Math.abs(times[low] - t) ? high : low;
  };

  function show() {
    find("play").textContent = time.playing ? "Stop" : "Play";
    find("play").setAttribute("aria-pressed", String(time.playing));
    find("speed").value = String(time.speed);
    for (const button of bar.querySelectorAll(".brush")) {
      button.setAttribute("aria-pressed", String(button.dataset.brush === brush));
    }
    for (const each of bar.querySelectorAll("button, select")) each.disabled = !state.edits;
    find("undo").disabled = !state.edits || !state.undo; find("undo").title = `undo ${state.undo} (Ctrl+Z)`;
    find("redo").disabled = !state.edits || !state.redo; find("redo").title = `redo ${state.redo} (Ctrl+Y)`;
    const words = find("words"), deep = clip.inside.map((one) => one.words).join("; ");
    words.className = refused || deep ? "grow bad" : "grow";
    words.textContent = refused || (state.run ? `run: ${state.run}` : "") || deep || (state.unsaved ? "unsaved edits" : "");
    if (!state.edits && socket && socket.readyState === WebSocket.OPEN) {
      words.innerHTML = '<span class="only">read only: another browser edits</span>';
    }
    requestAnimationFrame(draw);
  }

  canvas.addEventListener("pointerdown", (event) => {
    if (!state.edits) return;
    const box = canvas.getBoundingClientRect(), y = event.clientY - box.top, t = at(event.clientX - box.left);
    const row = y >= top() ? Math.min(Math.floor((y - top()) / rowHeight()), clip.parts.length - 1) : null;
    const paints = brush in WISH || brush === "clear";
    const kind = brush === "loop" || event.shiftKey ? "loop" : paints && row !== null ? brush : "scrub";
    drag = { kind, from: t, to: t, row: kind === "loop" || kind === "scrub" ? null : row };
    canvas.setPointerCapture(event.pointerId);
    if (kind === "scrub") { say({ do: "play", on: false }); seek(t); }
    refused = "";
    show();
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!drag) return;
    drag.to = at(event.clientX - canvas.getBoundingClientRect().left);
    if (drag.kind === "scrub") { time.t = drag.to; seek(drag.to); cursor(); }
    else requestAnimationFrame(draw);
  });
  const end = () => {
    if (!drag) return;
    const done = drag;
    drag = null;
    if (done.kind === "scrub") { sent = 0; seek(done.to); }
    else if (done.kind === "loop") say({ do: "loop", a: done.from, b: done.to });
    else say({ do: "paint", part: clip.parts[done.row].name, brush: done.kind, a: done.from, b: done.to });
    show();
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  bar.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (!button) return;
    if (button.dataset.brush) { brush = button.dataset.brush; show(); }
    if (button.id === "studio-play") say({ do: "play", on: !time.playing });
    if (button.id === "studio-undo") say({ do: "undo" });
    if (button.id === "studio-redo") say({ do: "redo" });
  });
  find("speed").addEventListener("change", (event) => say({ do: "speed", v: Number(event.target.value) }));
  window.addEventListener("keydown", (event) => {
    if (event.target.closest("input, textarea, select, [contenteditable]")) return;
    const key = event.key.toLowerCase(), step = (n) => {
      const row = Math.min(Math.max(nearest(clip.times, time.t) + n, 0), clip.times.length - 1);
      if (clip.times.length) { say({ do: "play", on: false }); say({ do: "seek", t: clip.times[row] }); }
    };
    if (key === " " && !event.target.closest("button")) { say({ do: "play", on: !time.playing }); event.preventDefault(); }
    else if ((event.ctrlKey || event.metaKey) && key === "z") { say({ do: event.shiftKey ? "redo" : "undo" }); event.preventDefault(); }
    else if ((event.ctrlKey || event.metaKey) && key === "y") { say({ do: "redo" }); event.preventDefault(); }
    else if (key === "," ) step(-1);
    else if (key === ".") step(1);
  });
  // Leaving with unsaved edits asks.
  window.addEventListener("beforeunload", (event) => {
    if (state.unsaved && state.edits) { event.preventDefault(); event.returnValue = ""; }
  });

  function connect() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    socket = new WebSocket(`${scheme}://${location.host}/studio/bar`);
    socket.onmessage = (event) => {
      const said = JSON.parse(event.data);
      if (said.type === "clip") clip = said;
      else if (said.type === "time") {
        const only = said.playing === time.playing && said.speed === time.speed
          && JSON.stringify(said.loop) === JSON.stringify(time.loop);
        if (!drag || drag.kind !== "scrub") time = said; else time = { ...said, t: drag.to };
        sent = 0;
        if (waiting !== null) seek(waiting);
        if (only) { cursor(); return; }
      } else if (said.type === "state") state = said;
      else if (said.type === "refused") refused = said.words;
      show();
    };
    socket.onclose = () => { state = { ...state, edits: false }; refused = "the studio does not answer"; show(); setTimeout(connect, 1000); };
    socket.onopen = () => { refused = ""; if (slow) socket.send("slow"); };
  }
  const begin = () => { document.body.appendChild(bar); new ResizeObserver(draw).observe(canvas); connect(); show(); };
  if (document.body) begin(); else window.addEventListener("DOMContentLoaded", begin);
})();

"use strict";
(() => {
  const { html, shown, Charts } = SimreconCharts, { View, nearest, bytesOf } = SimreconScene;
  const data = JSON.parse(document.getElementById("data").textContent), model = document.getElementById("model").textContent;
  const $ = id => document.getElementById(id), curves = data.curves, times = curves.times_s;
  const last = Math.max(times.at(-1), data.ghosts ? data.ghosts.to_s : 0);
  const SPEEDS = [0.1, 0.25, 0.5, 1, 2], WORDS_MS = 90, SPANS_MAX = 6;
  const state = { time: 0, frame: 0, playing: false, speed: 1, joint: 0, told: 0 };
  const root = document.documentElement;
  let view = null, charts = null, tick = 0;

  // Head

  function head() {
    const verdict = data.verdict ? data.verdict.verdict : "no verdict";
    $("verdict").textContent = verdict;
    if (data.verdict) $("verdict").classList.add(verdict);
    const lost = curves.status.some(status => status === 1), planned = curves.status.every(status => status === 2);
    $("facts").textContent = [
      `${times.at(-1).toFixed(2)} s`, `${data.frame_count} frames${times.length < data.frame_count ? `, ${times.length} of them here` : ""}`,
      planned ? "planned, not simulated" : lost ? "not all simulated" : "all simulated", `body weight ${curves.weight_N.toFixed(0)} N`,
    ].join(" · ");
    $("version").textContent = data.version;
    if (planned) $("executed").textContent = "Nothing was simulated: poses and forces are a plan.";
    else if (lost) $("executed").append(" Shaded frames are not simulated: they show the kinematic fit, without forces.");
    if (data.video) { $("video").href = data.video; $("video").hidden = false; }
    const reasons = data.verdict ? data.verdict.reasons : [];
    $("reasons").replaceChildren(...reasons.map(reason => {
      const line = html("p", {}, html("span", { class: reason.verdict }, `${reason.verdict}: `), reason.reason);
      line.append(html("small", {}, reason.advice));
      return line;
    }));
    const spans = poorSpans(), as = spans.length ? "Nothing speaks against this result as a whole." : "Nothing speaks against this result.";
    if (!reasons.length) $("reasons").append(html("p", { class: "unit" }, data.verdict ? as : "This result was made by an earlier version."));
    for (const span of spans.slice(0, SPANS_MAX)) {
      const at = html("button", { type: "button", class: "link", title: "Go there" }, `${span.from_s.toFixed(1)} to ${span.to_s.toFixed(1)} s`);
      at.addEventListener("click", () => seek(span.from_s));
      $("reasons").append(html("p", {}, at, " ", html("span", { class: span.verdict }, span.verdict), `: ${span.reason}`));
    }
    if (spans.length > SPANS_MAX) $("reasons").append(html("p", { class: "unit" }, `and ${spans.length - SPANS_MAX} more, below`));
    const list = html("dl", { class: "figures" });
    for (const [title, value] of data.highlights) list.append(html("dt", {}, title), html("dd", {}, value));
    $("reasons").append(list);
  }

  // Seconds that are not good, those in a row with one reason together.
  function poorSpans() {
    const spans = [];
    for (const second of data.seconds) {
      const before = spans.at(-1);
      if (before && before.verdict === second.verdict && before.reason === second.reason) before.to_s = second.to_s;
      else spans.push({ ...second });
    }
    return spans.filter(span => span.verdict !== "good");
  }

  // What holds at the cursor

  const now = {};
  function prepareNow() {
    const rows = [["left", "Left foot", "N"], ["right", "Right foot", "N"], ["sum", "All contacts", "N"],
      ["height", "Root height", "m"], ["speed", "Root speed", "m/s"], ["touch", "Touching", ""]];
    for (const [key, title, unit] of rows) {
      const value = html("dd");
      $("now").append(html("dt", {}, title), value);
      now[key] = { value, unit };
      if (unit !== "N") continue;
      now[key].bar = html("i");
      $("now").append(html("div", { class: `meter ${key}`, "aria-hidden": "true" }, now[key].bar));
    }
  }

  function showNow() {
    const { frame, time } = state, feet = curves.feet_N;
    const fitted = curves.status[frame] === 1 ? ", not simulated" : "";
    $("now-time").textContent = `${(data.began_s + times[frame]).toFixed(2)} s${fitted}`;
    const values = { left: feet.left_foot[frame], right: feet.right_foot[frame], sum: curves.grf_N[frame],
      height: curves.root_height_m[frame], speed: curves.root_speed_mps[frame] };
    for (const [key, value] of Object.entries(values)) {
      now[key].value.textContent = `${shown(value, now[key].bar ? 0 : 2)} ${now[key].unit}`;
      if (now[key].bar) now[key].bar.style.transform = `scaleX(${Math.min(Math.max(value / (2.5 * curves.weight_N), 0), 1)})`;
    }
    const touching = curves.contacts.filter(part => part.spans_s.some(([a, b]) => a <= times[frame] && times[frame] <= b));
    now.touch.value.textContent = touching.map(part => part.part).join(", ") || "nothing";
    $("clock").replaceChildren(html("b", {}, `${time.toFixed(2)} s`), ` of ${last.toFixed(2)} · ${frame}`);
  }

  // Curves

  const side = name => name.startsWith("left") ? "c-left" : name.startsWith("right") ? "c-right" : "c-sum";
  const short = name => name.replace(/^left /, "L ").replace(/^right /, "R ");

  function prepareCharts() {
    charts = new Charts($("charts"), curves, seek);
    const bands = curves.bands_N || {};
    charts.add({ title: "Vertical force", unit: curves.bands_N ? "N, and 90 % bands" : "N", height: 130, digits: 0, least: 100,
      lines: [{ value: curves.weight_N, label: "body weight" }], series: [
        { label: "all", class: "c-sum", values: curves.grf_N, band: bands.all },
        { label: "left foot", class: "c-left", values: curves.feet_N.left_foot, band: bands.left_foot, filled: !bands.left_foot },
        { label: "right foot", class: "c-right", values: curves.feet_N.right_foot, band: bands.right_foot, filled: !bands.right_foot }] });
    const bars = curves.contacts.map(part => ({ label: short(part.part), class: side(part.part), spans: part.spans_s }));
    charts.add({ title: "Contact", height: Math.max(18 * bars.length + 6, 24), bars });
    charts.add({ title: "Root height", unit: "m", height: 84, zero: false, least: 0.1, series: [{ label: "pelvis", class: "c-third", values: curves.root_height_m }] });
    charts.add({ title: "Root speed", unit: "m/s", height: 84, least: 0.2, series: [{ label: "pelvis", class: "c-third", values: curves.root_speed_mps }] });
    const chooser = html("select", { "aria-label": "Joint" }, ...curves.joints.map((name, i) => html("option", { value: i }, name)));
    const knee = curves.joints.indexOf("left knee");
    chooser.value = state.joint = Math.max(knee, 0);
    const lines = rows => curves.axes.map((label, k) => ({ label, class: ["c-left", "c-right", "c-third"][k], values: rows[state.joint][k] }));
    const angles = charts.add({ title: "Joint angle", unit: "°", height: 110, least: 5, digits: 1, extra: chooser, series: lines(curves.angles_deg) });
    const torques = charts.add({ title: "Joint torque", unit: "Nm", height: 110, least: 5, digits: 1, series: lines(curves.torques_Nm) });
    const filtered = `below ${curves.cutoff_Hz} Hz`, power = () => [{ label: "power", class: "c-third", values: curves.powers_W[state.joint] }];
    const [moments, powers] = curves.powers_W ? [
      charts.add({ title: "Joint moment", unit: `Nm, ${filtered}`, height: 110, least: 5, digits: 1, series: lines(curves.moments_Nm) }),
      charts.add({ title: "Joint power", unit: `W, ${filtered}`, height: 110, least: 20, digits: 0, series: power() }),
    ] : [];
    chooser.addEventListener("change", () => {
      state.joint = +chooser.value;
      angles.change({ series: lines(curves.angles_deg) });
      torques.change({ title: `Joint torque`, series: lines(curves.torques_Nm) });
      if (moments) moments.change({ series: lines(curves.moments_Nm) });
      if (powers) powers.change({ series: power() });
      charts.tell();
    });
    charts.add({ title: "Verdict by second", height: 22, cells: data.seconds });
  }

  // Tables

  function prepareTables() {
    for (const table of data.tables) {
      const wide = table.head.length > 0, body = html("tbody");
      for (const row of table.rows) {
        body.append(html("tr", {}, ...row.map((text, i) => i ? html("td", {}, text) : html("th", { scope: "row" }, text))));
      }
      const sheet = html("table", {}, html("caption", {}, table.title));
      if (wide) sheet.append(html("thead", {}, html("tr", {}, ...table.head.map(text => html("th", { scope: "col" }, text)))));
      sheet.append(body);
      $("tables").append(html("div", { class: `card${wide ? " wide" : ""}`, ...(wide ? { tabindex: 0, role: "region", "aria-label": table.title } : {}) }, sheet));
    }
  }

  // Time

  function seek(time) {
    state.time = Math.min(Math.max(time, 0), last);
    state.frame = nearest(times, state.time);
    if (view) { view.setTime(state.time); placeStill(); }
    charts.point(state.time, state.frame);
    const moment = performance.now();
    if (state.playing && moment - state.told < WORDS_MS) return; // words that nobody can read cost the most
    state.told = moment;
    $("scrub").value = state.time;
    charts.tell();
    showNow();
  }

  function play(on = !state.playing) {
    if (on && state.time >= last) seek(0);
    state.playing = on;
    seek(state.time);
    tick = performance.now();
    $("play").textContent = on ? "❚❚" : "▶";
    $("play").setAttribute("aria-label", on ? "Pause" : "Play");
  }

  function step(frames) {
    play(false);
    seek(times[Math.min(Math.max(state.frame + frames, 0), times.length - 1)]);
  }

  function speed(change) {
    const at = SPEEDS.indexOf(state.speed) + change;
    state.speed = SPEEDS[Math.min(Math.max(at, 0), SPEEDS.length - 1)];
    $("speed").value = state.speed;
  }

  function loop(moment) {
    if (state.playing) {
      const next = state.time + Math.min((moment - tick) / 1000, 0.25) * state.speed;
      seek(next >= last ? 0 : next);
    }
    tick = moment;
    if (view) view.draw(state.playing);
    requestAnimationFrame(loop);
  }

  // The camera's own view

  function placeStill() {
    const real = view.shown.real, still = $("still");
    const image = real ? data.stills.reduce((best, one) => Math.abs(one.frame - state.frame) < Math.abs(best.frame - state.frame) ? one : best, data.stills[0]) : null;
    still.hidden = !image;
    if (!real) return;
    const [wide, tall] = data.camera.size_px, { width, height } = view.size, scale = Math.min(width / wide, height / tall);
    const box = { width: wide * scale, height: tall * scale, left: (width - wide * scale) / 2, top: (height - tall * scale) / 2 };
    if (image) {
      if (still.dataset.frame !== String(image.frame)) { still.src = image.image; still.dataset.frame = image.frame; }
      for (const [key, value] of Object.entries(box)) still.style[key] = `${value}px`;
    }
    view.placeReal(box);
  }

  // Toggles

  const TOGGLES = [
    ["Skin", "B", () => view.shown.body === "skin", on => view.apply({ body: on ? "skin" : "primitives" }), "Skin, or the primitives that are simulated"],
    ["Fit", "G", () => view.shown.ghost, on => view.apply({ ghost: on }), "The kinematic fit as a ghost", () => data.fit],
    ["Futures", "N", () => view.shown.futures, on => view.apply({ futures: on }), "What may follow, as ghosts", () => data.ghosts],
    ["Forces", "F", () => view.shown.forces, on => view.apply({ forces: on }), "Forces of contact: half a metre is a body weight"],
    ["Mass centre", "M", () => view.shown.mass, on => view.apply({ mass: on }), "The centre of mass, and the floor below it"],
    ["Camera", "C", () => view.shown.real, on => { view.apply({ real: on }); placeStill(); }, "From the camera that saw it", () => data.camera],
    ["Follow", "L", () => view.shown.follow, on => view.apply({ follow: on }), "The view goes along with the person"],
  ];

  function prepareToggles() {
    for (const [title, key, get, set, text, there] of TOGGLES) {
      if (there && !there()) continue;
      const button = html("button", { type: "button", title: `${text} (${key})`, "aria-pressed": get(), "data-key": key }, title);
      button.addEventListener("click", () => { set(!get()); button.setAttribute("aria-pressed", get()); });
      $("toggles").append(button);
    }
    const colours = [["var(--left)", "left"], ["var(--right)", "right"], ["#e5484d", `force, ½ m is ${curves.weight_N.toFixed(0)} N`]];
    if (data.fit) colours.push(["#6f7cff", "kinematic fit"]);
    if (data.ghosts) colours.push(["#2a9d6f", `${data.ghosts.count} futures from ${(data.began_s + data.ghosts.from_s).toFixed(2)} s on`]);
    $("legend").append(...colours.map(([colour, text]) => html("li", {}, html("i", { style: `background:${colour}` }), text)));
  }

  // Keys

  const KEYS = { "space": "play or pause", "← →": "a frame back, on", "shift ← →": "ten frames", "home end": "start, end", "[ ]": "slower, faster",
    ...Object.fromEntries(TOGGLES.map(([title, key]) => [key.toLowerCase(), title.toLowerCase()])), "r": "view as at first", "d": "light or dark", "?": "these keys" };

  function prepareKeys() {
    for (const [key, text] of Object.entries(KEYS)) $("key-list").append(html("dt", {}, html("kbd", {}, key)), html("dd", {}, text));
    document.addEventListener("keydown", event => {
      if (event.ctrlKey || event.metaKey || event.altKey || $("keys").open || event.target.matches("select")) return;
      if (event.target.matches("input") && event.key.startsWith("Arrow")) event.preventDefault();
      const many = event.shiftKey ? 10 : 1;
      const done = { " ": () => event.target.matches("button, a, summary") ? false : play(), ArrowLeft: () => step(-many), ArrowRight: () => step(many), Home: () => seek(0), End: () => seek(last),
        "[": () => speed(-1), "]": () => speed(1), r: () => view && view.frameAll(), d: theme, "?": () => $("keys").showModal() }[event.key];
      const toggle = document.querySelector(`#toggles [data-key="${CSS.escape(event.key.toUpperCase())}"]`);
      if (done) { if (done() !== false) event.preventDefault(); } else if (toggle) toggle.click();
    });
  }

  const wish = matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => root.dataset.theme ? root.dataset.theme === "dark" : wish.matches;
  const showTheme = () => { if (view) view.setTheme(isDark()); };

  function theme() {
    root.dataset.theme = isDark() ? "light" : "dark";
    showTheme();
  }

  function prepareControls() {
    $("scrub").max = last;
    $("scrub").addEventListener("input", () => { play(false); seek(+$("scrub").value); });
    $("play").addEventListener("click", () => play());
    $("speed").append(...SPEEDS.map(value => html("option", { value }, `${value}×`)));
    $("speed").value = 1;
    $("speed").addEventListener("change", () => { state.speed = +$("speed").value; });
    $("theme").addEventListener("click", theme);
    $("help").addEventListener("click", () => $("keys").showModal());
    $("save").addEventListener("click", () => {
      const link = html("a", { download: `${data.name}.glb`, href: URL.createObjectURL(new Blob([bytesOf(model)], { type: "model/gltf-binary" })) });
      link.click();
      URL.revokeObjectURL(link.href);
    });
    new ResizeObserver(() => { charts.draw(); }).observe($("charts"));
    addEventListener("beforeprint", () => {
      charts.draw();
      if (!view) return;
      view.setTheme(false);
      const picture = html("img", { id: "printed", alt: "", src: view.picture(), style: "inset:0;width:100%;height:100%;object-fit:contain" });
      $("view").append(picture);
    });
    addEventListener("afterprint", () => { const picture = $("printed"); if (picture) picture.remove(); showTheme(); });
  }

  async function prepareView() {
    try {
      view = new View($("canvas"), data);
      view.resize($("view").clientWidth, $("view").clientHeight);
      await view.load(model);
    } catch (error) {
      view = null;
      $("message").textContent = `The 3D view needs WebGL, which this browser does not give (${String(error.message || error).replace(/\.$/, "")}).`;
      $("message").hidden = false;
      return;
    }
    prepareToggles();
    showTheme();
    wish.addEventListener("change", showTheme);
    new ResizeObserver(() => { view.resize($("view").clientWidth, $("view").clientHeight); placeStill(); }).observe($("view"));
  }

  head();
  prepareNow();
  prepareCharts();
  prepareTables();
  prepareControls();
  prepareKeys();
  charts.draw();
  seek(0);
  prepareView().then(() => {
    const from = /(?:^#|&)t=([\d.]+)/.exec(location.hash);
    seek(from ? +from[1] - data.began_s : 0);
    requestAnimationFrame(loop);
    window.simrecon = { view, seek, play, state }; // for who looks at the page with a program
    root.dataset.ready = view ? "3d" : "flat";
  });
})();

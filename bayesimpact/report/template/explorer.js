/* The explorer of a report: recording, residual and unexplained force on one time axis. */
(function () {
  "use strict";
  const root = document.getElementById("explore");
  const block = document.getElementById("explorer-data");
  if (!root || !block || typeof uPlot === "undefined") return;
  const content = JSON.parse(block.textContent);
  const part = (name) => root.querySelector('[data-part="' + name + '"]');
  const colours = { recorded: "#56B4E9", band: "#B98200", force: "#333333", grid: "#e4e2dc", text: "#444" };
  const modelColours = content.models.length > 1 ? ["#C2570A", "#0072B2"] : ["#C2570A"];
  const state = { recording: content.first, model: content.models.length - 1, min: 0, max: 1, impact: -1 };
  let charts = [], data = null;

  function bytes(text) {
    const raw = atob(text), out = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
    return out.buffer;
  }
  function integers(packed) {
    return Array.from(new Int16Array(bytes(packed.data)), (x) => (x === -32768 ? null : x * packed.scale));
  }
  function unpack(r) {
    if (r.unpacked) return r.unpacked;
    const samples = Array.from(new Float32Array(bytes(r.samples)), (x) => (isFinite(x) ? x : null));
    const times = samples.map((_, i) => i * r.interval);
    const residuals = r.residuals.map(integers);
    const models = residuals.map((e) => samples.map((y, i) => (y === null || e[i] === null ? null : y - e[i] * r.toUnit)));
    const found = { times: times, samples: samples, residuals: residuals, models: models };
    if (r.force) {
      found.force = integers(r.force);
      const half = integers(r.forceBand);
      found.low = found.force.map((f, i) => (f === null || half[i] === null ? null : f - half[i]));
      found.high = found.force.map((f, i) => (f === null || half[i] === null ? null : f + half[i]));
    }
    r.unpacked = found;
    return found;
  }
  function write(value, digits) {
    if (value === null || value === undefined || !isFinite(value)) return "–";
    return value.toFixed(digits).replace("-", "\u2212");
  }
  function reach(list) { // largest size in a list of arrays
    let size = 0;
    for (const values of list) for (const x of values) if (Math.abs(x) > size) size = Math.abs(x);
    return size || 1;
  }
  function digits(size) { // decimals that show about four digits of numbers of this size
    return Math.min(8, Math.max(0, 3 - Math.floor(Math.log10(size))));
  }

  function options(title, height, places, series, range, bands, last) {
    const axis = { stroke: colours.text, grid: { stroke: colours.grid, width: 1 }, ticks: { stroke: colours.grid, width: 1 }, font: "12px sans-serif" };
    return {
      width: part("charts").clientWidth, height: height, title: "",
      cursor: { sync: { key: "explore" }, drag: { x: true, y: false }, points: { size: 7 } },
      scales: { x: { time: false }, y: range ? { range: range } : {} },
      axes: [
        Object.assign({}, axis, { size: last ? 46 : 26, label: last ? "time since the first sample (s)" : undefined, labelSize: 18, labelFont: "12px sans-serif", values: (u, v) => v.map((x) => write(x, 3).replace(/\.?0+$/, "")) }),
        Object.assign({}, axis, { size: 58, label: title, labelSize: 18, labelFont: "12px sans-serif", values: (u, v) => v.map((x) => write(x, 6).replace(/\.?0+$/, "")) }),
      ],
      bands: bands || [],
      series: [{ label: "time (s)", value: (u, x) => write(x, 4) }].concat(
        series.map((s) => Object.assign({ points: { show: false }, value: (u, x) => write(x, places) }, s))),
      hooks: { setScale: [(u, key) => { if (key === "x") follow(u); }] },
    };
  }
  function follow(chart) { // all charts show the same stretch of time
    if (!charts.includes(chart)) return;
    const x = chart.scales.x, near = 1e-6 * (state.max - state.min);
    if (x.min === null || (Math.abs(x.min - state.min) < near && Math.abs(x.max - state.max) < near)) return;
    state.impact = -1;
    show(x.min, x.max);
  }
  function show(min, max) {
    const end = data.times[data.times.length - 1], least = 8 * (data.times[1] - data.times[0]);
    const width = Math.min(Math.max(max - min, least), end);
    state.min = Math.min(Math.max(0, min), end - width);
    state.max = state.min + width;
    for (const chart of charts) chart.setScale("x", { min: state.min, max: state.max });
    part("shown").textContent = "Shown: " + write(state.min, 3) + " to " + write(state.max, 3) + " s";
  }

  function build() {
    const old = charts;
    charts = []; // so that the new ones do not speak before they are all there
    for (const chart of old) chart.destroy();
    const r = content.recordings[state.recording], k = state.model, holder = part("charts");
    data = unpack(r);
    const [word, unit, residualUnit] = r.words;
    const colour = modelColours[k], count = data.times.length, constant = (x) => new Float64Array(count).fill(x);
    const gap = { dash: [6, 4], width: 1, stroke: "#888" };
    const motion = [data.times, data.samples, data.models[k]];
    const lines = [
      // circles about the model's line as soon as there is room for them
      { label: "recorded (" + unit + ")", stroke: colours.recorded, width: 3, points: { size: 7, space: 9, width: 1.5, fill: "#fff" } },
      { label: content.models[k], stroke: colour, width: 1.5 },
    ];
    if (r.level !== null) {
      motion.push(constant(r.level));
      lines.push(Object.assign({ label: "stop" }, gap));
    }
    const limit = 1.05 * Math.max(reach([data.residuals[k]]), 2.2 * r.noise);
    const band = Object.assign({}, gap, { stroke: colours.band });
    const panels = [
      [options(word + " (" + unit + ")", 230, digits(reach([data.samples])), lines), motion],
      [options("residual (" + residualUnit + ")", 170, digits(limit),
        [{ label: "recorded \u2212 " + content.models[k] + " (" + residualUnit + ")", stroke: colour, width: 1 },
          Object.assign({ label: "+2 sd of the noise" }, band), Object.assign({ label: "\u22122 sd" }, band)], [-limit, limit], [], !data.force),
      [data.times, data.residuals[k], constant(2 * r.noise), constant(-2 * r.noise)]],
    ];
    if (data.force) {
      const size = 1.05 * reach([data.low, data.high]), edge = { width: 0, stroke: "rgba(0,0,0,0)" };
      panels.push([options("unexplained force (" + content.forceUnit + ")", 190, digits(size),
        [{ label: "left out by the base model (" + content.forceUnit + ")", stroke: colours.force, width: 1.5 },
          Object.assign({ label: "95 %" }, edge), Object.assign({ label: "5 %" }, edge)],
        [-size, size], [{ series: [2, 3], fill: "rgba(90,90,90,0.22)" }], true),
      [data.times, data.force, data.high, data.low]]);
    }
    charts = panels.map((panel) => new uPlot(panel[0], panel[1], holder));
    for (const button of root.querySelectorAll("[data-impact]")) button.disabled = !r.impacts.length;
    part("best").disabled = r.best === null;
  }
  function whole() { state.impact = -1; show(0, data.times[data.times.length - 1]); }
  function impact(number) {
    const r = content.recordings[state.recording];
    if (!r.impacts.length) return;
    state.impact = Math.min(Math.max(number, 0), r.impacts.length - 1);
    around(r.impacts[state.impact]);
  }
  function around(first) { // from shortly before a contact until the motion has left the stop
    const r = content.recordings[state.recording], y = data.models[data.models.length - 1];
    let last = first;
    if (r.level === null) last = first + Math.round(0.1 * y.length);
    else while (last < y.length - 1 && y[last] >= r.level) last++;
    const margin = Math.max(8, Math.round(0.6 * (last - first)));
    show((first - margin) * r.interval, (last + margin) * r.interval);
  }
  function step(by) {
    const r = content.recordings[state.recording], middle = 0.5 * (state.min + state.max);
    if (state.impact >= 0) return impact(state.impact + by);
    if (state.min === 0 && state.max >= data.times[data.times.length - 1]) return impact(by > 0 ? 0 : r.impacts.length - 1);
    const later = r.impacts.findIndex((i) => i * r.interval > middle);
    impact((later < 0 ? r.impacts.length : later) - (by > 0 ? 0 : 1));
  }
  function zoom(factor) {
    const middle = 0.5 * (state.min + state.max), half = 0.5 * factor * (state.max - state.min);
    show(middle - half, middle + half);
  }
  function pan(part) {
    const by = part * (state.max - state.min);
    show(state.min + by, state.max + by);
  }

  content.recordings.forEach((r, i) => {
    const option = document.createElement("option");
    option.value = String(i);
    option.textContent = r.name + (r.case ? ", case " + r.case : "");
    part("recording").appendChild(option);
  });
  part("recording").value = String(state.recording);
  part("recording").addEventListener("change", (event) => {
    state.recording = Number(event.target.value);
    build();
    whole();
  });
  content.models.forEach((name, i) => {
    const label = document.createElement("label"), input = document.createElement("input");
    input.type = "radio";
    input.name = "explorer-model";
    input.value = String(i);
    input.checked = i === state.model;
    input.addEventListener("change", () => {
      const min = state.min, max = state.max;
      state.model = i;
      build();
      show(min, max);
    });
    label.append(input, " " + name);
    part("models").appendChild(label);
  });
  part("models").hidden = content.models.length < 2;
  const actions = {
    whole: whole, best: () => {
      const r = content.recordings[state.recording];
      state.impact = r.impacts.indexOf(r.best);
      around(r.best);
    },
    previous: () => step(-1), next: () => step(1), closer: () => zoom(0.5), wider: () => zoom(2),
    earlier: () => pan(-0.5), later: () => pan(0.5),
  };
  for (const name of Object.keys(actions)) part(name).addEventListener("click", actions[name]);
  for (const button of root.querySelectorAll("[data-impact]")) button.hidden = content.recordings.every((r) => !r.impacts.length);
  part("best").hidden = content.recordings.every((r) => r.best === null);
  root.addEventListener("dblclick", (event) => { if (part("charts").contains(event.target)) whole(); });
  new ResizeObserver(() => {
    const width = part("charts").clientWidth;
    for (const chart of charts) if (width && chart.width !== width) chart.setSize({ width: width, height: chart.height });
  }).observe(part("charts"));

  root.hidden = false;
  build();
  whole();
})();

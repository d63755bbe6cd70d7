// The runs of a diagnosis, to be explored: pick a run, a channel and an axis; point at a row; drag to zoom.
"use strict";
(() => {
  const home = document.getElementById("explore");
  const data = JSON.parse(document.getElementById("curves").textContent);
  // Of what swings, what its people look at: each output's rate against the output, by central differences.
  const rate = (time, values) => {
    const half = Math.max(1, Math.round(values.length / 300));
    return values.map((v, i) => {
      const [a, b] = [i - half, i + half];
      const known = a >= 0 && b < values.length && values[a] != null && values[b] != null && v != null && time[b] > time[a];
      return known ? (values[b] - values[a]) / (time[b] - time[a]) : null;
    });
  };
  if (data.phase) {
    data.channels.slice().forEach(({ label, unit }, c) => {
      const words = label.replace(/ \([^)]*\)$/, "");
      data.channels.push({ label: `rate of ${words} (${unit ? unit + "/s" : "1/s"})`, unit: unit ? unit + "/s" : "1/s", sigma: null, axis: -1 - c, place: null, words: `phase portrait of ${words}` });
      for (const run of data.runs) {
        const { measured, before, after } = run.channels[c];
        const of = (values) => rate(run.inputs[0], values);
        run.channels.push({ measured: of(measured), before: of(before), after: after && of(after), aside: [] });
      }
    });
  }
  const state = { run: data.first, channel: 0, axis: data.channels[0].axis, log: data.log_first };
  let charts = [];
  let printing = false;

  const element = (tag, attributes = {}, ...children) => {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  };
  const light = { ink: "#1c2430", soft: "#5b6675", line: "#dde2e8", data: "#5b6675", before: "#c2410c", after: "#0369a1", shade: "#f59e0b33", band: "#0369a114" };
  const colours = () => {
    if (printing) return light;
    const style = getComputedStyle(document.documentElement);
    return Object.fromEntries(Object.keys(light).map((key) => [key, style.getPropertyValue("--" + key).trim() || light[key]]));
  };
  const short = (value, digits = 5) => (value == null || Number.isNaN(value) ? "–" : String(Number(value.toPrecision(digits))));
  const sigmas = (value) => (value == null ? "?" : value >= 100 ? value.toFixed(0) : value.toPrecision(2)) + " σ";

  // What is shown of one run, or of all of them one after the other: rows as they were measured, and their order along the axis.
  const view = () => {
    const c = state.channel;
    const runs = state.run < 0 ? data.runs : [data.runs[state.run]];
    const rows = { x: [], measured: [], before: [], after: [], run: [], aside: [] };
    for (const run of runs) {
      const { measured, before, after, aside } = run.channels[c];
      const own = state.axis >= 0 ? run.inputs[state.axis] : run.channels[-1 - state.axis].measured;
      for (let i = 0; i < measured.length; i++) {
        rows.x.push(own ? own[i] : i);
        rows.measured.push(measured[i]);
        rows.before.push(before[i]);
        rows.after.push(after ? after[i] : null);
        rows.aside.push(aside.includes(i));
        rows.run.push(run.label);
      }
    }
    if (state.log) {
      const above = (v) => (v > 0 ? v : null);
      rows.x = rows.x.map(above);
      for (const key of ["measured", "before", "after"]) rows[key] = rows[key].map(above);
    }
    const order = rows.x.map((x, i) => i).filter((i) => rows.x[i] != null).sort((a, b) => rows.x[a] - rows.x[b] || a - b);
    return { rows, order };
  };

  // A line through rows in the order in which they were measured, broken between runs and where a value is missing.
  const line = (rows, key) => (u) => {
    const path = new Path2D();
    let pen = false;
    rows[key].forEach((y, i) => {
      if (y == null || rows.x[i] == null) pen = false;
      else {
        const [px, py] = [u.valToPos(rows.x[i], "x", true), u.valToPos(y, "y", true)];
        if (pen && rows.run[i] === rows.run[i - 1]) path.lineTo(px, py);
        else path.moveTo(px, py);
        pen = true;
      }
    });
    return { stroke: path, fill: null, clip: null, flags: 1 };
  };

  const chart = (place, shown, height, { label, series, log, band, shade, aside, axisLabel, pointed, equal }) => {
    const { rows, order } = shown;
    const pick = (values) => order.map((i) => values[i] ?? null);
    const at = (colour) => () => colours()[colour];
    const dots = Math.max(3, Math.min(6, 900 / Math.sqrt(order.length + 1) / 8));
    const axis = (text, size) => ({ label: text, labelSize: 22, labelFont: "12px system-ui", font: "12px system-ui", size, stroke: at("soft"), values: (u, splits) => splits.map((v) => (v == null || (log && short(v, 1) !== short(v, 6)) ? "" : short(v, 6))), grid: { stroke: at("line"), width: 0.7 }, ticks: { stroke: at("line"), width: 0.7 } });
    // Seen from above, a metre is as long along as across.
    const ends = (values) => values.reduce(([l, h], v) => (v == null ? [l, h] : [Math.min(l, v), Math.max(h, v)]), [Infinity, -Infinity]);
    const [wide, tall] = [ends(pick(rows.x)), ends(series.flatMap((s) => pick(rows[s.key])))];
    const pixel = equal ? Math.max((wide[1] - wide[0]) / (place.clientWidth - 108), (tall[1] - tall[0]) / (height - 66), 1e-12) * 1.1 : 0;
    const roomy = (low, top) => [low * (low / top) ** 0.03, top * (top / low) ** 0.03];
    const about = ([low, top], pixels) => [0.5 * (low + top) - 0.5 * pixel * pixels, 0.5 * (low + top) + 0.5 * pixel * pixels];
    const options = {
      width: place.clientWidth, height, legend: { show: false }, padding: [8, 24, 0, 0],
      cursor: { sync: { key: "run", setSeries: false, scales: ["x", null] }, drag: { x: true, y: false, dist: 4 }, y: false, points: { size: 8 } },
      scales: { x: { time: false, distr: log ? 3 : 1, range: pixel ? (u, low, top) => (low === wide[0] && top === wide[1] ? about(wide, place.clientWidth - 108) : [low, top]) : log ? (u, low, top) => (low === wide[0] && top === wide[1] ? roomy(low, top) : [low, top]) : undefined }, y: { distr: log && !band ? 3 : 1, range: (u, low, high) => {
        if (low == null) return [0, 1];
        if (log && !band) return roomy(low, high);
        if (pixel) return about(tall, height - 66);
        if (band) [low, high] = [Math.min(low, -band), Math.max(high, band)];
        const room = 0.06 * (high - low) || 0.5 * Math.abs(high) || 1e-9;
        return [low - room, high + room];
      } } },
      axes: [axis(axisLabel, 36), axis(label, 62)],
      series: [{}].concat(series.map((s) => ({
        stroke: at(s.colour), width: 1.6, dash: s.dash, spanGaps: false,
        paths: s.dots ? () => null : line(rows, s.key),
        points: { show: s.dots, size: s.size ?? dots, fill: at(s.colour), stroke: at(s.colour), width: 0 },
      }))),
      hooks: {
        drawClear: [(u) => {
          const { ctx, bbox } = u;
          ctx.save();
          ctx.beginPath();
          ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
          ctx.clip();
          if (shade) {
            const [a, b] = shade.map((v) => u.valToPos(v, "x", true));
            ctx.fillStyle = colours().shade;
            ctx.fillRect(a, bbox.top, Math.max(b - a, 1), bbox.height);
          }
          if (band) {
            const [a, b] = [band, -band].map((v) => u.valToPos(v, "y", true));
            ctx.fillStyle = colours().band;
            ctx.fillRect(bbox.left, a, bbox.width, b - a);
          }
          ctx.restore();
        }],
        draw: [(u) => {
          // Rows that were set aside wear a ring.
          u.ctx.save();
          u.ctx.strokeStyle = colours().before;
          u.ctx.lineWidth = 1.5 * devicePixelRatio;
          order.filter((i) => rows.aside[i] && rows[aside][i] != null).forEach((i) => {
            u.ctx.beginPath();
            u.ctx.arc(u.valToPos(rows.x[i], "x", true), u.valToPos(rows[aside][i], "y", true), 6 * devicePixelRatio, 0, 7);
            u.ctx.stroke();
          });
          u.ctx.restore();
        }],
        setCursor: [(u) => pointed(u.cursor.idx == null ? null : order[u.cursor.idx])],
        setScale: [(u, key) => {
          if (key !== "x") return;
          for (const other of charts) {
            const { min, max } = u.scales.x;
            if (other !== u && (other.scales.x.min !== min || other.scales.x.max !== max)) other.setScale("x", { min, max });
          }
        }],
      },
    };
    return new uPlot(options, [pick(rows.x), ...series.map((s) => pick(rows[s.key]))], place);
  };

  const mark = (kind) => {
    const drawn = { data: "<circle cx='11' cy='5' r='3.2' fill='var(--data)'/>", before: "<path d='M0 5H22' stroke='var(--before)' stroke-width='2' stroke-dasharray='5 3'/>", after: "<path d='M0 5H22' stroke='var(--after)' stroke-width='2'/>" }[kind];
    const holder = element("span");
    holder.innerHTML = `<svg viewBox="0 0 22 10" class="mark" aria-hidden="true">${drawn}</svg>`;
    return holder.firstChild;
  };

  const draw = () => {
    charts.forEach((c) => c.destroy());
    charts = [];
    const channel = data.channels[state.channel];
    const shown = view();
    const { rows } = shown;
    rows.left = rows.measured.map((m, i) => (m == null || rows.before[i] == null ? null : m - rows.before[i]));
    rows.now = rows.measured.map((m, i) => (m == null || rows.after[i] == null ? null : m - rows.after[i]));
    const unit = channel.unit ? " " + channel.unit : "";
    const axisLabel = state.axis >= 0 ? data.variables[state.axis].label : data.channels[-1 - state.axis].label;
    const single = rows.run.every((run, i) => run !== rows.run[i - 1]);
    const pointed = (i) => {
      const empty = i == null || i === undefined;
      const what = (key, value) => { values[key].textContent = empty ? "" : " " + value; };
      what("data", short(rows.measured[i]) + unit);
      what("before", short(rows.before[i]) + unit + (rows.left[i] == null ? "" : ` (off by ${short(rows.left[i], 3)})`));
      if (data.changed) what("after", short(rows.after[i]) + unit + (rows.now[i] == null ? "" : ` (off by ${short(rows.now[i], 3)})`));
      where.textContent = empty ? "Point at a row for its values, drag to zoom, double-click for all." : `run ${rows.run[i]}, ${axisLabel}: ${short(rows.x[i])}${rows.aside[i] ? ", set aside" : ""}`;
    };
    const place = channel.place;
    const inRun = state.run < 0 || !place || place.runs.length === 0 || place.runs.includes(data.runs[state.run].label);
    const shade = place && place.variable === state.axis && inRun ? [place.from, place.to] : null;
    shadeKey.hidden = !shade;
    bandKey.hidden = !channel.sigma;
    const fits = [{ key: "before", colour: "before", dash: [6, 4], dots: single, size: 11 }];
    if (data.changed) fits.push({ key: "after", colour: "after", dots: single, size: 11 });
    const lefts = [{ key: "left", colour: "before", dots: true }];
    if (data.changed) lefts.push({ key: "now", colour: "after", dots: true });
    const common = { log: state.log, axisLabel, pointed };
    const equal = data.plan && !state.log && state.channel === data.plan[1] && state.axis === -1 - data.plan[0];
    charts.push(chart(above, shown, equal ? 420 : 320, { ...common, equal, label: channel.label, aside: "measured", series: [...fits, { key: "measured", colour: "data", dots: true }] }));
    charts.push(chart(below, shown, 210, { ...common, label: "residual" + (channel.unit ? ` (${channel.unit})` : ""), aside: "left", series: lefts, band: channel.sigma ? 2 * channel.sigma : null, shade }));
    pointed(null);
  };

  const choice = (label, options, value, change) => {
    const select = element("select", { "aria-label": label });
    options.forEach(([v, text]) => select.append(element("option", { value: v }, text)));
    select.value = value;
    select.addEventListener("change", () => { change(Number(select.value)); draw(); });
    return select;
  };
  const controls = element("div", { class: "controls" });
  const order = data.runs.map((r, i) => i);
  const runs = order.map((i) => {
    const r = data.runs[i];
    return [i, `run ${r.label}: off by ${sigmas(r.before)}${data.changed ? `, now ${sigmas(r.after)}` : ""}`];
  });
  if (runs.length > 1) {
    runs.push([-1, `all ${runs.length} runs`]);
    const picker = choice("run", runs, state.run, (v) => { state.run = v; });
    const step = (by, text, name) => {
      const button = element("button", { type: "button", "aria-label": name, title: name }, text);
      button.addEventListener("click", () => {
        picker.selectedIndex = (picker.selectedIndex + by + runs.length) % runs.length;
        picker.dispatchEvent(new Event("change"));
      });
      return button;
    };
    controls.append(step(-1, "‹", "run that misses more"), picker, step(1, "›", "run that misses less"));
  }
  if (data.channels.length > 1) {
    const named = data.channels.map((c, i) => [i, c.words ?? c.label]);
    if (data.plan) named.push([-1, "seen from above"]);
    controls.append(choice("channel", named, 0, (v) => {
      const [own, portrait] = [state.axis >= 0, data.channels[state.channel].words];
      state.channel = v < 0 ? data.plan[1] : v;
      if (v < 0) state.axis = -1 - data.plan[0];
      else if (own || portrait || data.channels[v].words || -1 - state.axis === v) state.axis = data.channels[v].axis;
      axes.value = state.axis;
    }));
  }
  const along = data.variables.map((v, i) => [i, "against " + v.label]).concat(data.channels.length > 1 ? data.channels.map((c, i) => [-1 - i, "against " + c.label]).filter((a, i) => !data.channels[i].words) : []);
  const axes = choice("horizontal axis", along, state.axis, (v) => { state.axis = v; });
  if (along.length > 1) controls.append(axes);
  if (data.log) {
    const box = element("input", { type: "checkbox" });
    box.checked = state.log;
    box.addEventListener("change", () => { state.log = box.checked; draw(); });
    controls.append(element("label", {}, box, " logarithmic"));
  }
  const all = element("button", { type: "button" }, "show all");
  all.addEventListener("click", () => draw());
  controls.append(all);

  const values = {};
  const legend = element("p", { class: "key note" });
  for (const [kind, words] of [["data", "measured"], ["before", "simulated"], ["after", "with what was found"]]) {
    if (kind === "after" && !data.changed) continue;
    values[kind] = element("output", { class: "num" });
    legend.append(element("span", {}, mark(kind), words, values[kind]));
  }
  const shadeKey = element("span", {}, element("i", { style: "background:var(--shade);height:.8rem" }), "rows to which the misfit is traced");
  const bandKey = element("span", {}, element("i", { style: "background:var(--band);height:.8rem" }), "twice the noise");
  legend.append(shadeKey, bandKey);
  const where = element("p", { class: "note where" });
  const [above, below] = [element("div", { class: "plot" }), element("div", { class: "plot" })];
  home.replaceChildren(controls, element("figure", {}, above, below), legend, where);
  if (data.every > 1) home.append(element("p", { class: "note" }, `Of the rows of a run every ${data.every}th is drawn.`));
  draw();

  let width = above.clientWidth;
  addEventListener("resize", () => {
    if (above.clientWidth !== width) { width = above.clientWidth; charts.forEach((c) => c.setSize({ width, height: c.height })); }
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => charts.forEach((c) => c.redraw()));
  // On paper everything is light.
  const print = matchMedia("print");
  print.addEventListener("change", () => { printing = print.matches; charts.forEach((c) => c.redraw()); });
  document.documentElement.dataset.explored = "yes";
})();

// --- the plot ------------------------------------------------------------------------------------

/** A logarithmic axis over [low, high], drawn from `from` to `to`. */
const logAxis = (low, high, from, to) => {
  const a = Math.log10(low), b = Math.log10(high);
  const axis = (value) => from + ((Math.log10(value) - a) / (b - a)) * (to - from);
  axis.low = low;
  axis.high = high;
  axis.ticks = [];
  const steps = b - a < 1.3 ? [1, 2, 3, 5, 7] : b - a < 2.6 ? [1, 2, 5] : [1];
  for (let power = Math.floor(a); power <= Math.ceil(b); ++power)
    for (const step of [1, 2, 3, 4, 5, 6, 7, 8, 9]) {
      const value = Number(`${step}e${power}`);
      if (value >= low * 0.999 && value <= high * 1.001)
        axis.ticks.push({value, decade: step === 1, named: steps.includes(step)});
    }
  return axis;
};
const tickText = (value) =>
    value >= 1e-4 && value < 1e5 ? String(value) : minus(value.toExponential(0).replace("+", ""));

/** What the plot shows now: its points, their marks by result id, and at(point) → x, y. */
let drawn = {points: [], marks: new Map()};

const leastError = 1e-7;  // what is smaller stands on a line of its own below the axis
const belowAxis = (p) => !(p.error > leastError);

/** Sizes and axes: those of all points, so that they stay while the legend turns kernels off. */
const frameOf = (all, error) => {
  const width = Math.max(byId("canvas").clientWidth || 900, 280), small = width < 560;
  const height = small ? 360 : Math.round(Math.min(540, width * 0.5));
  const left = small ? 46 : 66, right = width - 14, top = 12, bottom = height - 66;
  const errors = [...all.map((p) => p.error), error].filter((e) => e > leastError);
  const times = all.map((p) => p.time).filter((time) => time > 0);
  const low = errors.length ? Math.min(...errors) / 1.5 : 1e-4;
  const high = errors.length ? Math.max(...errors) * 1.35 : 0.1;
  const early = times.length ? Math.min(...times) / 1.3 : 0.1;
  const late = times.length ? Math.max(...times) * 1.3 : 10;
  const x = logAxis(early, Math.max(late, early * 5), left + 8, right);
  const y = logAxis(low, Math.max(high, low * 10), bottom, top);
  const floor = bottom + 18;
  const at = (p) => [p.time > 0 ? x(p.time) : left, belowAxis(p) ? floor : y(p.error)];
  return {width, height, small, left, right, top, bottom, floor, x, y, at};
};

/** The error of the reference itself, the grid, the axes. */
const drawGround = (svg, frame, all, error) => {
  const {width, height, small, left, right, top, bottom, floor, x, y} = frame;
  const middle = {x: (left + right) / 2, "text-anchor": "middle"};
  if (error > leastError) {
    const edge = y(error), above = edge - 4 > top + 8;
    const text =
        small ? `reference ±${number(error)}` : `standard error of the reference, ${number(error)}`;
    svg.append(
        s("rect", {class: "floor", x: left, y: edge, width: right - left, height: bottom - edge}),
        s("line", {class: "floor-edge", x1: left, x2: right, y1: edge, y2: edge}),
        s("text", {x: right - 4, y: above ? edge - 4 : edge + 13, "text-anchor": "end"}, text));
  }
  for (const {value, decade, named} of x.ticks) {
    const at = x(value), kind = decade ? "grid decade" : "grid";
    svg.append(s("line", {class: kind, x1: at, x2: at, y1: top, y2: bottom}));
    if (named && (!small || decade || x.ticks.length < 14))
      svg.append(s("text", {x: at, y: height - 27, "text-anchor": "middle"}, tickText(value)));
  }
  for (const {value, decade, named} of y.ticks) {
    const at = y(value), kind = decade ? "grid decade" : "grid";
    svg.append(s("line", {class: kind, x1: left, x2: right, y1: at, y2: at}));
    if (named)
      svg.append(s("text", {x: left - 7, y: at + 4, "text-anchor": "end"}, tickText(value)));
  }
  svg.append(s("path", {class: "axis", d: `M${left} ${top}V${bottom}H${right}`}));
  if (all.some(belowAxis)) {
    const zero = all.filter(belowAxis).every((p) => p.error === 0);
    svg.append(
        s("path", {class: "axis", "stroke-dasharray": "1 3", d: `M${left} ${floor}H${right}`}),
        s("text", {x: left - 7, y: floor + 4, "text-anchor": "end"}, zero ? "0" : "< 1e−7"));
  }
  const time = small ?
      "ms per frame" :
      `milliseconds per frame, ${state.threads === 1 ? "1 thread" : `${state.threads} threads`}`;
  svg.append(s("text", {...middle, y: height - 7}, time));
  if (!small)
    svg.append(
        s("text",
          {"text-anchor": "middle", transform: `translate(13 ${(top + bottom) / 2}) rotate(-90)`},
          measures[state.measure].name));
  if (!all.length)
    svg.append(s("text", {...middle, y: (top + bottom) / 2}, "nothing was measured here"));
};

/** Steps, because between two marks of the front the slower one is not there yet. */
const drawFront = (svg, front, at) => {
  const steps = front.map((p, i) => {
    const [px, py] = at(p).map((v) => v.toFixed(1));
    return i ? `H${px}V${py}` : `M${px} ${py}`;
  });
  if (steps.length) svg.append(s("path", {class: "front", d: steps.join("")}));
};

const drawMark = (p, front, at) => {
  const [px, py] = at(p), {result} = p, radius = front ? 6.6 : 4.3;
  const name = `${result.kernel}, ${result.setting}: ${milliseconds(p.time)}, ` +
      `${measures[state.measure].name} ${number(p.error)}${front ? ", on the front" : ""}`;
  return s(
      "g", {
        class: "mark",
        transform: `translate(${px.toFixed(1)} ${py.toFixed(1)})`,
        role: "button",
        tabindex: "-1",
        "data-id": result.id,
        "aria-label": name,
        onfocus: () => showTip(p),
        onblur: hideTip
      },
      markOf(result.kernel, radius), s("circle", {class: "ring", r: radius + 4.5}));
};

/** The settings of a kernel, joined in the order of the report. */
const drawSeries = (svg, name, points, onFront, at) => {
  const look = looks(name), group = s("g", {class: "series", "data-kernel": name});
  const order = state.cell.results;
  const joined = points.slice()
                     .sort((a, b) => order.indexOf(a.result) - order.indexOf(b.result))
                     .map((p) => at(p).map((v) => v.toFixed(1)).join(" "));
  if (joined.length > 1)
    group.append(s("path", {
      class: "join",
      stroke: look.colour,
      "stroke-dasharray": look.dash || null,
      d: `M${joined.join("L")}`
    }));
  for (const p of points) {
    const mark = drawMark(p, onFront.has(p.result.id), at);
    drawn.marks.set(p.result.id, mark);
    group.append(mark);
  }
  svg.append(group);
};

const drawPlot = () => {
  const {cell, threads, meaning} = state, measure = measures[state.measure];
  const all = pointsOf(cell, meaning, threads, state.measure);
  const shown = all.filter((p) => !hidden.has(p.result.kernel));
  const reference = referenceOf(cell, meaning);
  const error = measure.floor ? reference.standard_error : measure.floorOf?.(cell) ?? 0;
  const frame = frameOf(all, error), front = frontOf(all, threads, state.measure).filter((p) => shown.includes(p));
  const svg = s("svg", {
    viewBox: `0 0 ${frame.width} ${frame.height}`,
    role: "group",
    "aria-label": `Error over time of ${cell.scene}. Arrow keys go from mark to mark in order ` +
        "of time; Enter chooses."
  });
  drawn = {svg, points: shown, front, marks: new Map(), at: frame.at, width: frame.width};
  drawGround(svg, frame, all, error);
  drawFront(svg, front, frame.at);
  const onFront = new Set(front.map((p) => p.result.id)), groups = new Map();
  for (const p of shown) groups.set(p.result.kernel, [...(groups.get(p.result.kernel) ?? []), p]);
  for (const [name, points] of groups) drawSeries(svg, name, points, onFront, frame.at);
  nameSeries(svg, groups, onFront, frame.at, frame);

  const chosen = drawn.marks.get(state.point);
  (chosen ?? drawn.marks.get(shown[0]?.result.id))?.setAttribute("tabindex", "0");
  chosen?.classList.add("chosen");
  svg.addEventListener("pointermove", (event) => {
    const p = nearest(event);
    if (p) showTip(p);
    else hideTip();
  });
  svg.addEventListener("pointerleave", hideTip);
  svg.addEventListener("click", (event) => {
    const p = nearest(event);
    if (p) choosePoint(p.result.id);
  });
  svg.addEventListener("keydown", onKey);
  byId("canvas").replaceChildren(svg);

  byId("plot-title")
      .replaceChildren(
          h("b", null, cell.scene), `, ${radiusText(cell)}: ${cell.what}. `,
          h("span", {class: "soft"},
            `${cell.width} × ${cell.height}, ${whole(cell.triangles)} ` +
                `triangles, ${percent(cell.background_share)} background`));
  drawLegend(cell, all);
  drawNotes(cell, all, reference);
};

/** Writes names beside marks where there is room: those on the front first. */
const nameSeries = (svg, groups, onFront, at, frame) => {
  const taken = drawn.points.map((p) => {
    const [px, py] = at(p);
    return [px - 7, py - 7, px + 7, py + 7];
  });
  const free = (box) => box[0] >= frame.left && box[2] <= frame.right && box[1] >= frame.top - 8 &&
      box[3] <= frame.bottom &&
      taken.every((t) => t[2] < box[0] || t[0] > box[2] || t[3] < box[1] || t[1] > box[3]);
  const series =
      [...groups]
          .map(([name, points]) => [name, points, points.some((p) => onFront.has(p.result.id))])
          .sort((a, b) => b[2] - a[2]);
  for (const [name, points, front] of series) {
    if (frame.small && !front) continue;
    const wide = name.length * 6.1 + 4, high = 13;
    const anchors = points.slice().sort(
        (a, b) => onFront.has(b.result.id) - onFront.has(a.result.id) || a.time - b.time);
    search: for (const p of [anchors[0], ...anchors.slice(1).reverse()]) {
      const [px, py] = at(p);
      for (const [dx, dy] of [
               [9, -13], [11, 0], [9, 13], [-wide - 11, 0], [-wide - 8, 13], [-wide - 8, -13],
               [-wide / 2, 19], [-wide / 2, -19]]) {
        const box = [px + dx, py + dy - high / 2, px + dx + wide, py + dy + high / 2];
        if (!free(box)) continue;
        taken.push(box);
        svg.querySelector(`[data-kernel="${CSS.escape(name)}"]`)
            .append(s("text", {class: "label", x: box[0] + 2, y: box[3] - 3}, name));
        break search;
      }
    }
  }
};

const nearest = (event) => {
  const box = drawn.svg.getBoundingClientRect(), scale = drawn.width / box.width;
  const px = (event.clientX - box.left) * scale, py = (event.clientY - box.top) * scale;
  let best = null, least = 22 * 22;
  for (const p of drawn.points) {
    const [x, y] = drawn.at(p), distance = (x - px) ** 2 + (y - py) ** 2;
    if (distance < least) [best, least] = [p, distance];
  }
  return best;
};

const showTip = (p) => {
  const {cell} = state, tip = byId("tip"), kernel = kernelOf(p.result);
  const row = (name, value) => h("tr", null, h("td", null, name), h("td", null, value));
  tip.replaceChildren(
      h("b", null, p.result.kernel), h("span", {class: "soft"}, p.result.setting),
      h("table", null, row("time", milliseconds(p.time)),
        row("per pixel", [number(nanosecondsPerPixel(cell, p.result, p.time)), " ns"]),
        row(measures[state.measure].brief ?? measures[state.measure].name, number(p.error)),
        state.measure === "rmse" ? null : row("RMSE", number(p.result.error.rmse)),
        kernel.comparable || state.measure !== "rmse" ?
            null :
            row("best monotone fit", number(p.result.error.fitted_rmse)),
        drawn.front.includes(p) ? row("", "on the Pareto front") : null,
        kernel.comparable ? null : row("", "estimates something else")));
  tip.hidden = false;
  for (const [id, mark] of drawn.marks) mark.classList.toggle("near", id === p.result.id);
  const box = drawn.svg.getBoundingClientRect(), scale = box.width / drawn.width;
  const [x, y] = drawn.at(p), page = document.documentElement.clientWidth;
  const px = box.left + x * scale, py = box.top + y * scale;
  const leftward = px + 16 + tip.offsetWidth > page - 6;
  const upward = py + 16 + tip.offsetHeight > window.innerHeight - 6;
  const tipLeft = Math.max(6, leftward ? px - 16 - tip.offsetWidth : px + 16);
  tip.style.left = `${Math.min(tipLeft, page - tip.offsetWidth - 6) + window.scrollX}px`;
  tip.style.top = `${(upward ? py - 16 - tip.offsetHeight : py + 16) + window.scrollY}px`;
};
const hideTip = () => {
  byId("tip").hidden = true;
  for (const mark of drawn.marks.values()) mark.classList.remove("near");
};

const onKey = (event) => {
  const id = event.target.closest?.("[data-id]")?.dataset.id;
  if (!id) return;
  if (event.key === "Enter" || event.key === " ") {
    event.preventDefault();
    choosePoint(id);
    return;
  }
  if (event.key === "Escape") return hideTip();
  const order = drawn.points.map((p) => p.result.id), now = order.indexOf(id),
        last = order.length - 1;
  const next = {
    ArrowRight: Math.min(now + 1, last),
    ArrowDown: Math.min(now + 1, last),
    ArrowLeft: Math.max(now - 1, 0),
    ArrowUp: Math.max(now - 1, 0),
    Home: 0,
    End: last
  }[event.key];
  if (next === undefined) return;
  event.preventDefault();
  for (const mark of drawn.marks.values()) mark.setAttribute("tabindex", "-1");
  const mark = drawn.marks.get(order[next]);
  mark.setAttribute("tabindex", "0");
  mark.focus();
};

const drawLegend = (cell, all) => {
  const names = [...new Set(all.map((p) => p.result.kernel))];
  const order = report.kernels.map((kernel) => kernel.name);
  names.sort((a, b) => order.indexOf(a) - order.indexOf(b));
  const dim = (name) => {
    for (const group of drawn.svg.querySelectorAll(".series"))
      group.classList.toggle("dim", name !== null && group.dataset.kernel !== name);
  };
  const focused = document.activeElement?.dataset?.legend;
  const turn = (change) => () => {
    change();
    drawPlot();
  };
  byId("legend").replaceChildren(
      ...names.map(
          (name) =>
              h("button", {
                type: "button",
                "aria-pressed": String(!hidden.has(name)),
                "data-legend": name,
                title: kernels.get(name)?.what,
                onclick: turn(() => (hidden.has(name) ? hidden.delete(name) : hidden.add(name))),
                onpointerenter: () => dim(hidden.has(name) ? null : name),
                onpointerleave: () => dim(null)
              },
                keyOf(name), name)),
      h("button", {
        type: "button",
        class: "quiet",
        "data-legend": "/all",
        onclick: turn(() => hidden.clear())
      },
        "all"),
      h("button", {
        type: "button",
        class: "quiet",
        "data-legend": "/none",
        onclick: turn(() => names.forEach((n) => hidden.add(n)))
      },
        "none"));
  if (focused) byId("legend").querySelector(`[data-legend="${CSS.escape(focused)}"]`)?.focus();
};

const drawNotes = (cell, all, reference) => {
  const notes = [];
  const otherwise = all.some((p) => !kernelOf(p.result).comparable);
  const rows = all.filter((p) => p.result.row_step > 1);
  const untimed =
      cell.results.filter((r) => r.meaning === state.meaning && !timingOf(r, state.threads)).length;
  notes.push([
    "Reference: ", meaningName(reference.meaning), ", ", meanings[reference.meaning]?.[1], "; ",
    whole(reference.directions), " directions per pixel, standard error ",
    number(reference.standard_error), "."
  ]);
  if (otherwise && !["fitted", "rank"].includes(state.measure))
    notes.push([
      "Hollow marks estimate something else than the reference holds. Compare them by the error ",
      "after the best monotone fit, or by rank correlation."
    ]);
  if (state.measure === "field")
    notes.push("Only kernels over depth and normals have an error against the height field.");
  if (rows.length)
    notes.push([
      rows.map((p) => `${p.result.id} (1 row in ${p.result.row_step})`).join(", "),
      ": computed in a part of the rows, and timed for these alone; never on the front."
    ]);
  if (untimed)
    notes.push([
      untimed, untimed === 1 ? " result was" : " results were",
      " timed with another number of threads only."
    ]);
  for (const {kernel, slope} of cell.slopes)
    if (all.some((p) => p.result.kernel === kernel))
      notes.push([
        kernel, ": its error falls as directions to the power of ", plain(slope),
        "; independent samples would give −0.5."
      ]);
  byId("plot-notes").replaceChildren(...notes.map((text) => h("p", null, text)));
};

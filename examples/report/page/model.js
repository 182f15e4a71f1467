// --- the report ----------------------------------------------------------------------------------

const report = JSON.parse(byId("report").textContent);
const kernels = new Map(report.kernels.map((kernel) => [kernel.name, kernel]));
const kernelOf = (result) => kernels.get(result.kernel) ??
    {name: result.kernel, family: "", what: "", estimates: "", comparable: true};

/** Pictures are decoded block by block, when the first of a block is wanted. */
const pictureBlocks = new Map();
const pictureOf = (cell, name) => {
  const block = name === cell.shaded ? "shaded" : report.cells.indexOf(cell);
  if (!pictureBlocks.has(block)) {
    const node = byId(`pictures-${block}`);
    pictureBlocks.set(block, node ? JSON.parse(node.textContent) : {});
  }
  return pictureBlocks.get(block)[`${cell.id}/${name}`] ?? null;
};

const timingOf = (result, threads) =>
    result.timings.find((timing) => timing.threads === threads) ?? null;
const threadCounts = [
  ...new Set(report.cells.flatMap(
      (cell) => cell.results.flatMap((result) => result.timings.map((timing) => timing.threads))))
].sort((a, b) => a - b);
const referenceOf = (cell, meaning) =>
    cell.references.find((reference) => reference.meaning === meaning);
const nanosecondsPerPixel = (cell, result, time) => {
  const rows = Math.ceil(cell.height / result.row_step);
  const pixels = cell.width * rows * (1 - cell.background_share);
  return pixels > 0 ? (time * 1e6) / pixels : null;
};

const meanings = {
  "visibility":
      ["visibility", "the cosine-weighted share of directions that meet nothing within the radius"],
  "obscurance": ["obscurance", "the same, but a hit at distance d counts 1 − exp(−σ d), not 0"],
  "visibility-secondary": [
    "visibility, secondary rays", "visibility with two secondary rays for each open primary ray"
  ],
  "obscurance-secondary": [
    "obscurance, secondary rays", "obscurance with two secondary rays for each open primary ray"
  ],
};
const meaningName = (meaning) => meanings[meaning]?.[0] ?? meaning;

/** Errors that the plot can show: all are better when smaller, and 0 at best. */
const measures = {
  rmse: {
    name: "RMSE",
    of: (r) => r.error.rmse,
    floor: true,
    what: "Root of the mean square of kernel − reference over the pixels that show a surface. " +
        "The usual one."
  },
  fitted: {
    name: "RMSE after the best monotone fit",
    brief: "monotone fit",
    of: (r) => r.error.fitted_rmse,
    floor: true,
    what: "The RMSE that is left after the best non-decreasing function of the kernel's " +
        "value. It forgives a wrong scale or curve, and nothing else."
  },
  rank: {
    name: "1 − rank correlation",
    brief: "1 − rank corr.",
    of: (r) => Math.max(0, 1 - r.error.rank_correlation),
    what: "How far the order of the pixels from dark to bright is from that of the reference " +
        "(Spearman). 0: the same order; 1: no relation."
  },
  mae: {
    name: "mean absolute error",
    brief: "mean abs.",
    of: (r) => r.error.mae,
    what: "The mean of |kernel − reference|. It minds a few large errors less than the RMSE."
  },
  bias: {
    name: "|bias|",
    of: (r) => Math.abs(r.error.bias),
    what: "The mean of kernel − reference. Below zero: too dark on the whole. The plot shows " +
        "its size."
  },
  p99: {
    name: "99th percentile of the error",
    brief: "p99",
    of: (r) => r.error.p99,
    what: "99 of 100 pixels have a smaller error."
  },
  max: {
    name: "largest error",
    brief: "maximum",
    of: (r) => r.error.max,
    what: "The error of the worst pixel."
  },
  ssim: {
    name: "1 − SSIM",
    of: (r) => Math.max(0, 1 - r.error.ssim),
    what: "1 minus the structural similarity: how much the local structure differs. 0: alike."
  },
  field: {
    name: "RMSE against the height field",
    brief: "height field",
    of: (r) => r.height_field_error?.rmse ?? null,
    floorOf: (cell) => cell.height_field?.standard_error,
    what: "The RMSE against reference b, for kernels that see one depth buffer."
  },
};

// --- what a kernel looks like: colour and shape by method, inner mark and dashes by variant ------

const looks = (() => {
  const known = {
    chebyshev: ["vermillion", "circle"],
    alchemy: ["blue", "square"],
    scalable: ["sky", "up"],
    horizon: ["green", "diamond"],
    bitmask: ["purple", "down"],
    outline: ["yellow", "hexagon"],
    traced: ["ink", "star"],
    information: ["orange", "cross"],
  };
  const spare = [["soft", "circle"], ["soft", "square"], ["soft", "up"], ["soft", "diamond"]];
  const dashes = ["", "6 3", "1.5 3", "8 3 1.5 3"];
  const seen = new Map(), result = new Map();
  for (const kernel of report.kernels) {
    const method = kernel.family === "outline" ? "outline" : kernel.name.split("-")[0];
    const variant = seen.get(method) ?? 0;
    seen.set(method, variant + 1);
    const [colour, shape] = known[method] ?? spare[seen.size % spare.length];
    result.set(kernel.name, {
      colour: `var(--${colour})`,
      shape,
      variant: variant % 5,
      dash: dashes[variant % dashes.length],
      hollow: !kernel.comparable
    });
  }
  return (name) => result.get(name) ??
      {colour: "var(--soft)", shape: "circle", variant: 0, dash: "", hollow: false};
})();

const polygon = (corners, radius, turn, inner = 1) => {
  const points = [];
  for (let i = 0; i < corners; ++i) {
    const angle = turn + (2 * Math.PI * i) / corners, size = i % 2 ? radius * inner : radius;
    points.push(`${(size * Math.sin(angle)).toFixed(2)} ${(-size * Math.cos(angle)).toFixed(2)}`);
  }
  return `M${points.join("L")}Z`;
};
const shapes = {
  circle: (r) => `M${- r} 0A${r} ${r} 0 1 1 ${r} 0A${r} ${r} 0 1 1 ${- r} 0Z`,
  square: (r) => polygon(4, r * 1.25, Math.PI / 4),
  diamond: (r) => polygon(4, r * 1.3, 0),
  up: (r) => polygon(3, r * 1.32, 0),
  down: (r) => polygon(3, r * 1.32, Math.PI),
  hexagon: (r) => polygon(6, r * 1.12, 0),
  star: (r) => polygon(10, r * 1.4, 0, 0.46),
  cross: (r) => {
    const a = r * 1.15, b = r * 0.42;
    return `M${- b} ${- a}H${b}V${- b}H${a}V${b}H${b}V${a}H${- b}V${b}H${- a}V${- b}H${- b}Z`;
  },
};
/** The mark of a kernel, about the origin. */
const markOf = (name, radius) => {
  const look = looks(name), inside = look.hollow ? look.colour : "var(--panel)";
  const bar = {stroke: inside, "stroke-width": 1.4}, r = radius * 0.62;
  const inner = [
    null,
    s("circle", {r: radius * 0.3, fill: inside}),
    s("path", {d: `M${- r} 0H${r}`, ...bar}),
    s("path", {d: `M0 ${- r}V${r}`, ...bar}),
    s("path", {d: `M${- r} 0H${r}M0 ${- r}V${r}`, ...bar}),
  ][look.variant];
  return [
    s("path", {
      d: shapes[look.shape](radius),
      stroke: look.colour,
      "stroke-width": 1.5,
      "stroke-linejoin": "round",
      fill: look.hollow ? "var(--panel)" : look.colour
    }),
    inner
  ];
};
const keyOf = (name) => {
  const look = looks(name);
  return s(
      "svg", {class: "key", viewBox: "-17 -8 34 16", "aria-hidden": "true"}, s("path", {
        d: "M-16 0H16",
        stroke: look.colour,
        "stroke-opacity": 0.6,
        "stroke-width": 1.3,
        "stroke-dasharray": look.dash || null
      }),
      markOf(name, 5));
};

// --- what is chosen ------------------------------------------------------------------------------

const usual = report.cells.find((cell) => cell.radius_factor === 1) ?? report.cells[0];
const state = {
  cell: usual,
  threads: threadCounts[0],
  measure: "rmse",
  meaning: "visibility",
  point: null
};
const hidden = new Set();  // kernels that the legend has turned off

const cellAt = (scene, factor) => {
  const own = report.cells.filter((cell) => cell.scene === scene);
  return own.find((cell) => cell.radius_factor === factor) ??
      own.find((cell) => cell.radius_factor === 1) ?? own[0];
};

const pointsOf = (cell, meaning, threads, measure) => {
  const points = [];
  for (const result of cell.results) {
    const timing = timingOf(result, threads), error = measures[measure].of(result);
    if (result.meaning === meaning && timing && isNumber(error))
      points.push({result, timing, time: timing.median, error});
  }
  return points.sort((a, b) => a.time - b.time || a.error - b.error);
};
/** Points such that none is both faster and closer; equal ones stay together. */
const frontOf = (points, threads, measure) => {
  if (measure === "rmse") return points.filter((p) => p.result.pareto.includes(threads));
  const front = [];
  for (const p of points) {
    if (p.result.slow || p.result.row_step > 1) continue;
    const last = front[front.length - 1];
    if (!last || p.error < last.error || (p.error === last.error && p.time === last.time))
      front.push(p);
  }
  return front;
};

const writeHash = () => {
  const parts = [state.cell.id, state.threads, state.measure, state.meaning, state.point ?? ""];
  try {
    history.replaceState(null, "", `#=${parts.map(encodeURIComponent).join("/")}`);
  } catch { /* a frame without a history */
  }
};
const readHash = () => {
  if (!location.hash.startsWith("#=")) return;
  let parts = [];
  try {
    parts = location.hash.slice(2).split("/").map(decodeURIComponent);
  } catch {
    return;
  }
  const cell = report.cells.find((c) => c.id === parts[0]);
  if (!cell) return;
  state.cell = cell;
  if (threadCounts.includes(Number(parts[1]))) state.threads = Number(parts[1]);
  if (Object.hasOwn(measures, parts[2] ?? "")) state.measure = parts[2];
  state.meaning = parts[3];
  state.point = parts[4] || null;
};
/** Whether the cell has results with that error against the reference. */
const isUsed = (measure) => state.cell.results.some(
    (result) => result.meaning === state.meaning && isNumber(measures[measure].of(result)));
/** Keeps the choice where the cell has it, and takes the nearest thing where it has not. */
const settle = () => {
  const {cell} = state;
  if (!referenceOf(cell, state.meaning))
    state.meaning = (referenceOf(cell, "visibility") ?? cell.references[0]).meaning;
  if (!isUsed(state.measure)) state.measure = "rmse";
  const points = pointsOf(cell, state.meaning, state.threads, state.measure);
  const has = (test) => points.find(test)?.result.id;
  const front = frontOf(points, state.threads, state.measure);
  if (!has((p) => p.result.id === state.point))
    state.point = has((p) => p.result.kernel === "horizon" && p.result.default) ??
        front[Math.floor(front.length / 2)]?.result.id ?? points[0]?.result.id ?? null;
};

const choices = (title, name, options, chosen, choose) =>
    h("fieldset", null, h("legend", null, title),
      h("div", {class: "options"},
        options.map(
            ([value, text, what]) =>
                h("label", {title: what}, h("input", {
                    type: "radio",
                    name,
                    value: String(value),
                    checked: value === chosen,
                    onchange: () => choose(value)
                  }),
                  h("span", null, text)))));
const fraction = (factor) => (factor === 0.5 ? "½" : String(factor));
const radiusText = (cell) =>
    cell.radius === null ? "unlimited radius" : `radius ${plain(cell.radius)}`;

const drawScenes = () => {
  const scenes = [...new Set(report.cells.map((cell) => cell.scene))];
  byId("scenes").replaceChildren(
      h("fieldset", {class: "scenes"}, h("legend", {class: "visually-hidden"}, "Scene"),
        scenes.map((scene) => {
          const cell = cellAt(scene, 1), picture = pictureOf(cell, cell.shaded);
          return h(
              "label", {title: cell.what}, h("input", {
                type: "radio",
                name: "scene",
                value: scene,
                checked: scene === state.cell.scene,
                onchange: () => choose({cell: cellAt(scene, state.cell.radius_factor)})
              }),
              h("span", {class: "thumb"},
                picture && h("img", {src: picture, alt: "", decoding: "async"})),
              h("span", {class: "name"}, scene));
        })));
};
const drawChoices = () => {
  const own = report.cells.filter((cell) => cell.scene === state.cell.scene);
  const {cell} = state;
  const used = Object.entries(measures).filter(([key]) => isUsed(key));
  // A radio that was just used keeps the focus when the group is drawn again.
  const active = document.activeElement?.name, value = document.activeElement?.value;
  const groups = [
    choices(
        "Radius of the occlusion", "radius",
        own.map(
            (c) =>
                [c.id, c.radius === null ? "unlimited" : `${fraction(c.radius_factor)} × usual`,
                 radiusText(c)]),
        cell.id, (id) => choose({cell: own.find((c) => c.id === id)})),
    cell.references.length < 2 ? null :
                                 choices(
                                     "Reference", "meaning",
                                     Object.keys(meanings)
                                         .filter((meaning) => referenceOf(cell, meaning))
                                         .map((meaning) => [meaning, ...meanings[meaning]]),
                                     state.meaning, (meaning) => choose({meaning})),
    threadCounts.length < 2 ?
        null :
        choices(
            "Threads", "threads",
            threadCounts.map((threads) => [threads, threads === 1 ? "1" : `all ${threads}`]),
            state.threads, (threads) => choose({threads})),
    choices(
        "Error", "measure", used.map(([key, {name, brief, what}]) => [key, brief ?? name, what]),
        state.measure, (measure) => choose({measure})),
  ];
  byId("choices").replaceChildren(...groups.filter((group) => group !== null));
  if (active)
    document.querySelector(`#choices input[name="${active}"][value="${CSS.escape(value)}"]`)
        ?.focus();
};

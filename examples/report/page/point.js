// --- the chosen point ----------------------------------------------------------------------------

const pairs = (...rows) =>
    h("dl", {class: "pairs"},
      rows.filter(Boolean).map(
          ([name, value, what]) => [h("dt", {title: what}, name), h("dd", null, value)]));

/** The command that measures the scene of a cell alone, and leaves this page as it is. */
const commandOf = (cell) => {
  const word = "(?:'[^']*'|[^\\s'-][^\\s]*)";
  const scenes = new RegExp(` --scene(?:[ =]${word})+`, "g"),
        out = new RegExp(` --out[ =]${word}`, "g");
  const command = report.run.command.replace(out, "");
  return cell.what === "a mesh from a file" ?
      `${command} --out one-scene` :
      `${command.replace(scenes, "")} --scene ${cell.scene} --out one-scene`;
};

let beside = "reference", gain = 4, panelRun = 0;

const drawPoint = () => {
  const {cell, threads} = state, panel = byId("point");
  const result = cell.results.find((r) => r.id === state.point);
  const run = ++panelRun;
  if (!result) {
    panel.replaceChildren();
    return;
  }
  const kernel = kernelOf(result), reference = referenceOf(cell, result.meaning);
  const onFront =
      frontOf(pointsOf(cell, result.meaning, threads, state.measure), threads, state.measure)
          .some((p) => p.result === result);
  panel.replaceChildren(
      h("header", null, h("h3", null, keyOf(result.kernel), `${result.kernel}, ${result.setting}`),
        onFront ? h("span", {class: "badge"}, "on the front") : null,
        result.default ? h("span", {class: "badge"}, "the library's default") : null,
        kernel.comparable ? null : h("span", {class: "badge"}, "hollow: see the monotone fit"),
        result.row_step > 1 ? h("span", {class: "badge"}, `1 row in ${result.row_step}`) : null),
      h("p", null, `${kernel.what}. `,
        h("span", {class: "soft"}, `It estimates: ${kernel.estimates}.`)),
      picturesOf(cell, result, reference, run), numbersOf(cell, result, reference));
};

const picturesOf = (cell, result, reference, run) => {
  const others = [["reference", "a: ray traced", reference.picture]];
  if (cell.height_field) others.push(["field", "b: the height field", cell.height_field.picture]);
  others.push(["shaded", "the scene in colour", cell.shaded]);
  if (result.without && cell.results.some((r) => r.id === result.without))
    others.push(["without", `without leaving out: ${result.without}`, result.without]);
  if (result.plan?.picture) others.push(["plan", "what its plan leaves out", result.plan.picture]);
  const other = others.find(([key]) => key === beside) ?? others[0];
  const mine = pictureOf(cell, result.id), theirs = pictureOf(cell, other[2]);
  const shape = `aspect-ratio: ${cell.width} / ${cell.height}`;
  const missing = (name) =>
      h("div", {class: "none"}, `There is no picture of ${name} in this page.`);

  const stage = h("div", {class: "stage compare"});
  stage.style.cssText = shape;
  if (mine && theirs) {
    const cut = h("img", {src: mine, alt: `${result.kernel}, ${result.setting}`, class: "mine"});
    const handle = h("div", {class: "handle"});
    const slider = h("input", {
      type: "range",
      min: "0",
      max: "100",
      step: "0.5",
      value: "50",
      "aria-label":
          "How much of the kernel's picture is shown; the rest is what it is compared with"
    });
    const move = () => {
      cut.style.clipPath = `inset(0 ${100 - slider.value}% 0 0)`;
      handle.style.left = `${slider.value}%`;
    };
    slider.addEventListener("input", move);
    move();
    stage.append(
        h("img", {src: theirs, alt: other[1], class: "theirs"}), cut,
        h("span", {class: "tag one"}, result.id), h("span", {class: "tag two"}, other[1]), handle,
        slider);
  } else {
    stage.append(missing(mine ? other[1] : result.id));
  }

  const select =
      h("select", {
        onchange: (event) => {
          beside = event.target.value;
          drawPoint();
          byId("point").querySelector("select").focus();
        }
      },
        others.map(([key, name]) => h("option", {value: key, selected: key === other[0]}, name)));

  const map = h("div", {class: "stage difference"});
  map.style.cssText = shape;
  const against = ["shaded", "plan"].includes(other[0]) ? others[0] : other;
  const base = pictureOf(cell, against[2]);
  const ramp = h("i"), ends = [h("span"), h("span", null, "0"), h("span")];
  const gainText = h("span");
  const slider = h("input", {
    type: "range",
    min: "0",
    max: "6",
    step: "1",
    value: String(Math.log2(gain)),
    "aria-label": "Gain of the error map"
  });
  let paint = () => {};
  const label = () => {
    ends[0].textContent = `${minus(String(-1 / gain))} too dark`;
    ends[2].textContent = `+${1 / gain} too bright`;
    gainText.textContent = `× ${gain}`;
    const [below, middle, above] = mapColours().map((c) => `rgb(${c.join(" ")})`);
    ramp.style.background = `linear-gradient(to right, ${below}, ${middle}, ${above})`;
  };
  slider.addEventListener("input", () => {
    gain = 2 ** Number(slider.value);
    label();
    paint();
  });
  label();
  if (mine && base) {
    const canvas = h("canvas", {role: "img", "aria-label": `${result.id} minus ${against[1]}`});
    map.append(canvas, h("span", {class: "tag one"}, `kernel − ${against[1]}`));
    Promise.all([pixelsOf(mine), pixelsOf(base)])
        .then(([a, b]) => {
          if (run !== panelRun) return;
          paint = () => paintDifference(canvas, a, b);
          repaint = () => {
            label();
            paint();
          };
          paint();
        })
        .catch(() => map.replaceChildren(missing("the difference")));
  } else {
    map.append(missing("the difference"));
  }

  return h(
      "div", {class: "pictures"},
      h("figure", null, stage, h("figcaption", null, h("label", null, "beside it ", select))),
      h("figure", null, map,
        h("figcaption", null, h("span", {class: "scale"}, ramp, ends),
          h("label", {class: "gain"}, "gain", slider, gainText))));
};

/** The pixels of a picture, one number from 0 to 255 each. */
const pixelsOf = async (address) => {
  const image = new Image();
  image.src = address;
  await image.decode();
  const canvas = h("canvas", {width: image.naturalWidth, height: image.naturalHeight});
  const context = canvas.getContext("2d", {willReadFrequently: true});
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, canvas.width, canvas.height);
};
const mapColours = () => {
  const dark = isDark();
  return [
    dark ? [70, 160, 255] : [0, 76, 153], dark ? [24, 27, 31] : [250, 250, 248],
    dark ? [255, 136, 40] : [190, 64, 0]
  ];
};
const paintDifference = (canvas, a, b) => {
  const width = Math.min(a.width, b.width), height = Math.min(a.height, b.height);
  canvas.width = width;
  canvas.height = height;
  const context = canvas.getContext("2d"), out = context.createImageData(width, height);
  const [below, middle, above] = mapColours();
  for (let y = 0; y < height; ++y)
    for (let x = 0; x < width; ++x) {
      const difference = (a.data[4 * (y * a.width + x)] - b.data[4 * (y * b.width + x)]) / 255;
      const share = Math.min(1, Math.abs(difference) * gain), end = difference < 0 ? below : above;
      const i = 4 * (y * width + x);
      for (let k = 0; k < 3; ++k) out.data[i + k] = middle[k] + share * (end[k] - middle[k]);
      out.data[i + 3] = 255;
    }
  context.putImageData(out, 0, 0);
};
let repaint = () => {};

const numbersOf = (cell, result, reference) => {
  const {error, work} = result, field = cell.height_field;
  const steps = [
    ["a − b", field?.error.rmse, "what the depth buffer does not know"],
    ["b − c", result.estimator_error?.rmse, "what the estimator gets wrong"],
    ["c − kernel", result.own_error?.rmse, "what the implementation gets wrong"],
    ["a − kernel", error.rmse, "all of it"],
  ];
  const most = Math.max(...steps.map((step) => step[1] ?? 0), 1e-9);
  const seesScreen = result.height_field_error !== null || result.estimator_error !== null;
  const bars = h("div", {class: "bars"}, steps.map(([name, value, what]) => {
    const bar = h("i");
    bar.style.width = `${(100 * (value ?? 0)) / most}%`;
    return [
      h("span", {title: what}, name), h("span", {class: "bar", title: what}, bar),
      h("span", {class: "value"}, number(value))
    ];
  }));
  const times = result.timings.map((timing) => {
    const perPixel = nanosecondsPerPixel(cell, result, timing.median);
    return [
      h("h4", null, timing.threads === 1 ? "Time, 1 thread" : `Time, ${timing.threads} threads`),
      pairs(
          [`median of ${timing.rounds}`, milliseconds(timing.median)],
          isNumber(perPixel) && ["per surface pixel", `${number(perPixel)} ns`],
          timing.rounds > 1 && ["fastest", milliseconds(timing.min)],
          timing.rounds > 1 && ["nine of ten within", milliseconds(timing.p90)],
          ...(timing.passes.length > 1 ?
                  timing.passes.map((pass) => [`pass: ${pass.name}`, milliseconds(pass.median)]) :
                  []))
    ];
  });
  return h(
      "div", {class: "numbers"},
      h("div", null, h("h4", null, "Error against the reference"),
        pairs(
            ["RMSE", number(error.rmse), measures.rmse.what],
            ["after the best monotone fit", number(error.fitted_rmse), measures.fitted.what],
            ["rank correlation", number(error.rank_correlation), measures.rank.what],
            ["bias", number(error.bias), measures.bias.what],
            ["mean absolute", number(error.mae), measures.mae.what],
            ["99 % of pixels below", number(error.p99), measures.p99.what],
            ["maximum", number(error.max), measures.max.what],
            ["SSIM", number(error.ssim), measures.ssim.what],
            ["pixels compared", whole(error.pixels)],
            ["standard error of the reference", number(reference.standard_error)])),
      h("div", null, times),
      h("div", null, seesScreen ? [h("h4", null, "Where the error comes from (RMSE)"), bars] : null,
        h("h4", null, "Memory and work"),
        pairs(
            ["scratch and buffers", bytes(result.memory)],
            result.structures > 0 && ["structures", bytes(result.structures)],
            result.preparation > 0 &&
                ["preparation, once per scene", milliseconds(result.preparation)],
            ["passes", whole(work.passes)],
            work.skipped_passes > 0 && ["passes left out", whole(work.skipped_passes)],
            work.samples > 0 && ["samples", whole(work.samples)],
            work.skipped_samples > 0 && ["samples left out", whole(work.skipped_samples)],
            work.rays > 0 && ["rays", whole(work.rays)],
            work.skipped_rays > 0 && ["rays left out", whole(work.skipped_rays)],
            ["pixels", whole(work.pixels)], ["background", whole(work.background)],
            work.skipped > 0 && ["pixels left out", whole(work.skipped)])),
      h("div", null, h("h4", null, "Parameters"),
        pairs(...Object.entries(result.parameters)
                  .map(
                      ([name, value]) =>
                          [name.replace(/_/g, " "),
                           typeof value === "number" ? plain(value) : String(value ?? "none")])),
        h("h4", null, "Get it again"), h("code", {class: "command"}, commandOf(cell)),
        h("span", {class: "soft"}, `writes it as cells/${cell.id}/${result.id}.jpg`)));
};

const choosePoint = (id) => {
  state.point = id;
  for (const [other, mark] of drawn.marks) {
    mark.classList.toggle("chosen", other === id);
    mark.setAttribute("tabindex", other === id ? "0" : "-1");
  }
  for (const row of document.querySelectorAll("#results tbody tr"))
    row.classList.toggle("chosen", row.dataset.id === id);
  drawPoint();
  writeHash();
};

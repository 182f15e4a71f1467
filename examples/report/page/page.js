// --- what stands still ---------------------------------------------------------------------------

const drawMeaning = () => {
  const terms = Object.values(measures).map(({name, what}) => [name, what]).concat([
    [
      "time",
      "The median over rounds in which all kernels take turns, so that a change in the " +
          "machine's speed meets all of them. A frame has all passes of a kernel; its passes " +
          "are timed as well. Preparation, once per scene, is apart."
    ],
    [
      "Pareto front",
      "Results for which no other one with the same reference is both faster and closer. " +
          "Results that were computed in a part of the rows never count."
    ],
    [
      "memory",
      "Bytes beside inputs, output and scene: scratch, and buffers between passes. " +
          "Structures are what the preparation made, such as the hierarchy over triangles."
    ],
    [
      "left out",
      "Pixels, samples, rays and passes that a kernel could prove, or was told, not to need."
    ],
    [
      "plan",
      "A pass before a kernel that finds out what it may leave out. Exact: no bit of the picture " +
          "changes. To a tolerance: no pixel gets brighter by more. Its time is part of the frame."
    ],
  ]);
  byId("measures")
      .replaceChildren(
          ...terms.flatMap(([name, what]) => [h("dt", null, name), h("dd", null, what)]));
  const fronts = (kernel) =>
      report.cells
          .filter(
              (cell) => cell.results.some(
                  (r) => r.kernel === kernel.name && r.pareto.includes(state.threads)))
          .length;
  byId("kernels-table")
      .replaceChildren(table(
          "Kernels",
          [
            {title: "kernel", of: (k) => k.name, text: (k) => [keyOf(k.name), k.name]},
            {title: "family", of: (k) => k.family},
            {title: "what it is", of: (k) => k.what, kind: "wrap"},
            {title: "what it estimates", of: (k) => k.estimates, kind: "wrap"},
            {
              title: "comparable",
              of: (k) => (k.comparable ? "yes" : "no"),
              what: "it estimates what its reference holds"
            },
            numeric(
                "on fronts", fronts, "cells in which one of its settings is on the front",
                (k) => `${fronts(k)}`),
            {title: "needs", of: (k) => k.needs},
            {title: "source", of: (k) => k.source, kind: "wrap"},
          ],
          report.kernels));
};

const drawStill = () => {
  const {machine, run} = report;
  const fact = (name, value) => h("div", null, h("dt", null, name), h("dd", null, value));
  byId("machine").replaceChildren(
      fact("machine", machine.cpu), fact("threads", machine.threads),
      fact("compiler", machine.compiler), fact("nook", report.nook),
      fact(
          "pictures",
          [
            run.width, " × ", run.height, ", ", whole(run.directions), " directions per pixel",
            run.quick ? ", quick" : ""
          ]),
      fact(
          "took",
          run.seconds < 90 ? `${Math.round(run.seconds)} s` : `${number(run.seconds / 60)} min`),
      fact("command", h("code", null, run.command)));
  byId("again-text")
      .replaceChildren(
          h("p", null, "All of it, with the same pictures, times and tables:"),
          h("code", {class: "command"}, run.command),
          h("p", null, "One scene, with all its radii, to a folder of its own:"),
          h("code", {class: "command"}, commandOf(report.cells[0])),
          h("p", null,
            "Errors come out the same to the last bit on the same build; times are those of " +
                "your ",
            "machine. Beside this page lie report.json, with every number shown here, " +
                "report.csv, ",
            "one line per result and number of threads, and the folder cells with all pictures. ",
            "The address of this page keeps the choice of scene, radius, threads, error and ",
            "point, so that a figure can be passed on as a link."),
          h("p", null, "What got worse since an older report:"),
          h("code", {class: "command"}, `${run.command} --compare old/report.json`));
  drawCalibration();
  drawStability();
};

const drawCell = () => {
  for (const node of document.querySelectorAll(".of-cell"))
    node.textContent = `${state.cell.scene}, ${radiusText(state.cell)}`;
  for (const input of document.querySelectorAll("#scenes input"))
    input.checked = input.value === state.cell.scene;
  drawChoices();
  drawPlot();
  drawPoint();
  drawResults();
  drawSplit();
  drawSkipped();
  drawPlanned();
  drawWinners();
  drawMeaning();
};
const choose = (change) => {
  Object.assign(state, change);
  settle();
  hideTip();
  drawCell();
  writeHash();
};

// --- light and dark, paper -----------------------------------------------------------------------

const darkQuery = matchMedia("(prefers-color-scheme: dark)");
let printing = false;
const themes = ["auto", "light", "dark"];
const stored = () => {
  try {
    return localStorage.getItem("nook-theme");
  } catch {
    return null;
  }
};
const isDark = () => {
  const theme = document.documentElement.dataset.theme;
  return !printing && (theme ? theme === "dark" : darkQuery.matches);
};
const setTheme = (theme) => {
  if (theme === "auto") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = theme;
  byId("theme").textContent = {auto: "◐ as the system", light: "○ light", dark: "● dark"}[theme];
  byId("theme").setAttribute("aria-label", `Colours: ${theme}. Press for the next.`);
  try {
    localStorage.setItem("nook-theme", theme);
  } catch { /* not kept */
  }
  repaint();
};
byId("theme").addEventListener("click", () => {
  const now = document.documentElement.dataset.theme ?? "auto";
  setTheme(themes[(themes.indexOf(now) + 1) % themes.length]);
});
darkQuery.addEventListener("change", () => repaint());
const printQuery = matchMedia("print");
printQuery.addEventListener("change", () => {
  printing = printQuery.matches;
  repaint();
});
for (const [event, value] of [["beforeprint", true], ["afterprint", false]])
  window.addEventListener(event, () => {
    printing = value;
    repaint();
  });

// --- begin ---------------------------------------------------------------------------------------

readHash();
settle();
setTheme(themes.includes(stored()) ? stored() : "auto");
drawScenes();
drawStill();
drawCell();
let widthDrawn = byId("canvas").clientWidth;
new ResizeObserver(() => {
  const width = byId("canvas").clientWidth;
  if (width === widthDrawn || printing) return;
  widthDrawn = width;
  drawPlot();
}).observe(byId("canvas"));
window.addEventListener("hashchange", () => {
  if (!location.hash.startsWith("#=")) return;
  readHash();
  settle();
  drawCell();
});

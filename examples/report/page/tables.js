// --- tables --------------------------------------------------------------------------------------

/**
 * A table that sorts. A column: {title, what, of(row) → number or text or null, text(row) → string
 * or nodes, kind: "number" or "wrap"}. What has no value comes last, both ways round. The first
 * column names the row.
 */
const table = (caption, columns, rows, {id = null} = {}) => {
  const order = {column: null, down: false};
  const body = h("tbody");
  const heads = columns.map(
      (column, i) =>
          h("th",
            {scope: "col", class: column.kind === "number" ? "number" : null, title: column.what},
            h("button", {type: "button", onclick: () => sortBy(i)}, column.title)));
  const content = ({kind, of, text}, row) => {
    if (text) return text(row);
    return kind === "number" ? number(of(row)) : of(row) ?? "–";
  };
  const cellOf = (row) => (column, i) =>
      h(i ? "td" : "th", {class: column.kind, scope: i ? null : "row"}, content(column, row));
  const made =
      rows.map((row) => ({row, node: h("tr", {"data-id": id?.(row)}, columns.map(cellOf(row)))}));
  const sortBy = (i) => {
    const {of} = columns[i];
    order.down = order.column === i && !order.down;
    order.column = i;
    const none = (value) => value === null || value === undefined || value === "";
    made.sort((a, b) => {
      const p = of(a.row), q = of(b.row);
      if (none(p) || none(q)) return none(p) - none(q);
      const sign = typeof p === "number" && typeof q === "number" ?
          p - q :
          String(p).localeCompare(String(q), "en", {numeric: true});
      return order.down ? -sign : sign;
    });
    heads.forEach((head, k) => {
      if (k === i) head.setAttribute("aria-sort", order.down ? "descending" : "ascending");
      else head.removeAttribute("aria-sort");
    });
    body.append(...made.map((entry) => entry.node));
  };
  body.append(...made.map((entry) => entry.node));
  return h(
      "div", {class: "box", tabindex: "0", role: "region", "aria-label": caption},
      h("table", {class: "sheet"}, h("caption", {class: "visually-hidden"}, caption),
        h("thead", null, h("tr", null, heads)), body));
};

const kernelColumn = {
  title: "kernel",
  of: (r) => r.kernel,
  text: (r) => [keyOf(r.kernel), r.kernel]
};
const settingColumn = {
  title: "setting",
  of: (r) => r.setting,
  text: (r) =>
      h("button", {
        type: "button",
        class: "link",
        onclick: () => {
          if (r.meaning !== state.meaning) choose({meaning: r.meaning, point: r.id});
          else choosePoint(r.id);
          byId("point").scrollIntoView({block: "start"});
        }
      },
        r.setting || "–")
};
const numeric = (title, of, what, text) => ({title, of, what, text, kind: "number"});
const timeNow = (r) => timingOf(r, state.threads)?.median ?? null;

const drawResults = () => {
  const {cell, threads} = state;
  const several = cell.references.length > 1;
  byId("results-table")
      .replaceChildren(table(
          `All results of ${cell.id}`,
          [
            kernelColumn,
            settingColumn,
            ...(several ? [{title: "against", of: (r) => meaningName(r.meaning)}] : []),
            {
              title: "front",
              what: "on the Pareto front of RMSE",
              of: (r) => (r.pareto.includes(threads) ? "front" : null),
              text: (r) => (r.pareto.includes(threads) ? "●" : "")
            },
            numeric(
                "ms", timeNow, `median of a frame, ${threads} thread${threads === 1 ? "" : "s"}`),
            numeric(
                "p90 ms", (r) => timingOf(r, threads)?.p90 ?? null,
                "at least nine of ten frames took no longer"),
            numeric("RMSE", (r) => r.error.rmse, measures.rmse.what),
            numeric("monotone fit", (r) => r.error.fitted_rmse, measures.fitted.what),
            numeric("rank corr.", (r) => r.error.rank_correlation, measures.rank.what),
            numeric("bias", (r) => r.error.bias, measures.bias.what),
            numeric("mean abs.", (r) => r.error.mae, measures.mae.what),
            numeric("p99", (r) => r.error.p99, measures.p99.what),
            numeric("max", (r) => r.error.max, measures.max.what),
            numeric("SSIM", (r) => r.error.ssim, measures.ssim.what),
            numeric(
                "memory", (r) => r.memory, "scratch and buffers between passes",
                (r) => bytes(r.memory)),
            numeric(
                "preparation", (r) => r.preparation || null, "once per scene",
                (r) => (r.preparation > 0 ? milliseconds(r.preparation) : "–")),
          ],
          cell.results, {id: (r) => r.id}));
  for (const row of document.querySelectorAll("#results tbody tr"))
    row.classList.toggle("chosen", row.dataset.id === state.point);
};

const drawSplit = () => {
  const {cell} = state, place = byId("split-table");
  const rows = cell.results.filter((r) => r.height_field_error || r.estimator_error || r.own_error);
  if (!rows.length) {
    place.replaceChildren(
        h("p", {class: "note"},
          "No kernel of this cell works on a depth buffer alone, so there is nothing to split."));
    return;
  }
  const field = cell.height_field;
  place.replaceChildren(
      !field ? [] :
               h("p", null, "Height field: ", field.slices, " slices per pixel, ",
                 field.row_step > 1 ? `1 row in ${field.row_step}, ` : "", "standard error ",
                 number(field.standard_error), ". It is ", number(field.error.rmse),
                 " from the traced scene (RMSE), ", number(field.error.bias), " on average."),
      table(
          `Where the error comes from, ${cell.id}`,
          [
            kernelColumn,
            settingColumn,
            numeric(
                "a − b", () => field?.error.rmse ?? null, "what the depth buffer does not know"),
            numeric(
                "b − c", (r) => r.estimator_error?.rmse ?? null, "what the estimator gets wrong"),
            numeric("bias of c − b", (r) => r.estimator_error?.bias ?? null),
            numeric(
                "c − kernel", (r) => r.own_error?.rmse ?? null,
                "what the implementation gets wrong"),
            numeric("largest c − kernel", (r) => r.own_error?.max ?? null),
            numeric(
                "b − kernel", (r) => r.height_field_error?.rmse ?? null,
                "against the height field"),
            numeric("a − kernel", (r) => r.error.rmse, "against the traced scene: all of it"),
          ],
          rows));
};

const twinOf = (cell, result) => cell.results.find((other) => other.id === result.without) ?? null;
/** How many times as fast as the same with all, over rounds that both took part in. */
const speedUpOf = (result) => {
  const ratio = timingOf(result, state.threads)?.ratio;
  return ratio > 0 ? 1 / ratio : null;
};
/** The time of the plan relative to that of the kernel without one. */
const planCost = (cell, result) => {
  const twin = twinOf(cell, result), plan = timingOf(result, state.threads)?.plan;
  const all = twin && timeNow(twin);
  return all > 0 && isNumber(plan) ? plan / all : null;
};
const shareOf = (part, rest) => (part > 0 ? part / (part + rest) : null);
const leftOut = ({work}) => ({
  pixels: work.skipped > 0 ? work.skipped / (work.pixels - work.background) : null,
  samples: shareOf(work.skipped_samples, work.samples),
  rays: shareOf(work.skipped_rays, work.rays),
  passes: shareOf(work.skipped_passes, work.passes)
});
const planText = ({plan}) => {
  if (!plan) return null;
  if (plan.tolerance === null) return `${plan.kind}, no bound`;
  return `${plan.kind}, ${plan.tolerance > 0 ? `to ${plain(plan.tolerance)}` : "exact"}`;
};

const drawPlans = () => {
  const {cell} = state;
  const exact = cell.results.filter((r) => r.plan?.tolerance === 0);
  const costs =
      exact.map((r) => [r.without, planCost(cell, r)]).filter(([, cost]) => isNumber(cost));
  byId("planning-cost")
      .replaceChildren(
          costs.length ? `Planning where nothing is left out costs ${
                             costs.map(([id, cost]) => `${percent(cost)} of ${id}`).join(", ")}.` :
                         "");
  const groups = ({background_groups, inactive_groups, active_groups}) =>
      background_groups + inactive_groups + active_groups;
  const drawnPlans = cell.results.filter((r) => r.plan?.picture && pictureOf(cell, r.plan.picture));
  const swatch = (colour, text) => {
    const box = h("i");
    box.style.background = colour;
    return h("span", {class: "swatch"}, box, text);
  };
  byId("plan-pictures")
      .replaceChildren(
          ...drawnPlans.map(({id, plan}) => {
            const all = groups(plan);
            return h(
                "figure", null, h("img", {
                  src: pictureOf(cell, plan.picture),
                  alt: `what the plan of ${id} leaves out`,
                  width: cell.width,
                  height: cell.height
                }),
                h("figcaption", null, h("b", null, planText({plan})), ` – ${id}: of the groups, `,
                  `${percent(plan.inactive_groups / all)} are left out and `,
                  `${percent(plan.background_groups / all)} have no surface`));
          }),
          ...(drawnPlans.length ?
                  [h("p", {class: "notes"}, swatch("#0f1217", "no surface"),
                     swatch("#777", "left out"),
                     swatch("rgb(252 232 36)", "worked on"))] :
                  []));
};

const drawSkipped = () => {
  const {cell} = state, place = byId("skipped-table");
  drawPlans();
  const rows = cell.results.filter(
      (r) => r.without || Object.values(leftOut(r)).some((value) => value !== null));
  if (!rows.length) {
    place.replaceChildren(
        h("p", {class: "note"}, "Nothing was left out here beside the background."));
    return;
  }
  const before = (r) => (twinOf(cell, r) ? timeNow(twinOf(cell, r)) : null);
  const marked = (value, text, good) => {
    if (!isNumber(value)) return "–";
    return h("span", {class: good === null ? null : good ? "better" : "worse"}, text);
  };
  const gain = (r) => {
    const value = speedUpOf(r);
    return marked(value, `${number(value)} ×`, value === 1 ? null : value > 1);
  };
  const change = (r) => r.added_error?.rmse_change ?? null;
  const part = (title, key, what) =>
      numeric(title, (r) => leftOut(r)[key], what, (r) => percent(leftOut(r)[key]));
  const added = (title, key, what, text = number) => numeric(
      title, (r) => r.added_error?.[key] ?? null, what,
      (r) => (r.added_error ? text(r.added_error[key]) : "–"));
  place.replaceChildren(table(
      `What was left out, ${cell.id}`,
      [
        kernelColumn,
        settingColumn,
        {title: "plan", of: planText},
        numeric(
            "times as fast", speedUpOf,
            "below one: it costs more than it saves; the median over rounds that both took part in",
            gain),
        numeric("ms", timeNow, "plan included"),
        numeric("ms with all", before, "without leaving anything out"),
        numeric("plan ms", (r) => timingOf(r, state.threads)?.plan ?? null, "the plan alone"),
        numeric(
            "plan / with all", (r) => planCost(cell, r),
            "what planning costs where nothing is left out", (r) => percent(planCost(cell, r))),
        part("pixels left out", "pixels", "share of the surface pixels"),
        part("samples left out", "samples", "share of the samples of the other pixels"),
        part("rays left out", "rays", "share of the rays that would have been shot"),
        part("passes left out", "passes", "share of the passes over the picture"),
        added("added error", "rmse", "RMSE against the picture with all"),
        added("largest", "max", "the largest difference to the picture with all"),
        added("changed", "changed", "pixels of which any bit differs", whole),
        numeric(
            "change of RMSE", change, "RMSE less RMSE with all, against the reference",
            (r) => marked(
                change(r), `${change(r) > 0 ? "+" : ""}${number(change(r))}`,
                change(r) === 0 ? null : change(r) < 0)),
        {title: "the same with all", of: (r) => r.without, text: (r) => r.without ?? "–"},
      ],
      rows));
};

/** One line per cell, one column per kernel with a plan. */
const drawPlanned = () => {
  const place = byId("plans-table");
  const names = [...new Set(
      report.cells.flatMap((cell) => cell.results.filter((r) => r.plan).map((r) => r.kernel)))];
  if (!names.length) {
    place.replaceChildren(h("p", {class: "note"}, "Nothing was planned."));
    return;
  }
  // At the library's defaults, or else the first setting.
  const resultOf = (cell, name) => {
    const own = cell.results.filter((r) => r.kernel === name && r.plan);
    return own.find((r) => twinOf(cell, r)?.default) ?? own[0] ?? null;
  };
  const column = (name) => ({
    title: name,
    kind: "number",
    what: kernels.get(name)?.what,
    of: (cell) => {
      const result = resultOf(cell, name);
      return result && speedUpOf(result);
    },
    text: (cell) => {
      const result = resultOf(cell, name), gain = result && speedUpOf(result);
      if (!isNumber(gain)) return "–";
      const cost = planCost(cell, result);
      return [
        `${number(gain)} ×`, h("br"),
        h("span", {class: "soft"}, `${percent(leftOut(result).pixels ?? 0)} out`), h("br"),
        h("span", {class: "soft"}, `plan ${percent(cost)}`)
      ];
    }
  });
  const rows = report.cells.filter((cell) => cell.results.some((r) => r.plan));
  place.replaceChildren(table(
      "Plans, scene by scene", [{title: "scene", of: (cell) => cell.id}, ...names.map(column)],
      rows));
};

const budgets = [5, 10, 20, 40, 80, 160, Infinity];  // nanoseconds per surface pixel
const drawWinners = () => {
  const {threads} = state, measure = measures[state.measure];
  byId("winners-text")
      .replaceChildren(
          "For each scene and radius: the setting of the least error (", measure.name,
          ") among those ",
          "that take no more than so many nanoseconds per surface pixel, against visibility, with ",
          threads === 1 ? "one thread" : `${threads} threads`,
          ". The choices of error and threads above the plot apply.");
  const rows = report.cells.map((cell) => {
    const points = pointsOf(cell, "visibility", threads, state.measure)
                       .filter((p) => !p.result.slow && p.result.row_step === 1);
    const best = budgets.map((budget) => {
      let winner = null;
      for (const p of points)
        if ((nanosecondsPerPixel(cell, p.result, p.time) ?? 0) <= budget &&
            (!winner || p.error < winner.error))
          winner = p;
      return winner;
    });
    return {cell, best};
  });
  const show = ({cell}, {result}) => {
    choose({cell, meaning: "visibility", point: result.id});
    byId("point").scrollIntoView({block: "start"});
  };
  const radius = ({radius_factor}) =>
      radius_factor === null ? "unlimited" : `${fraction(radius_factor)} × radius`;
  const budgetColumn = (budget, i) => ({
    title: Number.isFinite(budget) ? `${budget} ns` : "any time",
    what: "sorts by the error",
    of: (row) => row.best[i]?.error ?? null,
    text: (row) => {
      const winner = row.best[i];
      if (!winner) return "–";
      return [
        h("button", {type: "button", class: "link", onclick: () => show(row, winner)},
          winner.result.id),
        h("br"), h("span", {class: "soft"}, number(winner.error))
      ];
    }
  });
  const columns = [
    {
      title: "scene",
      of: ({cell}) => cell.id,
      text: ({cell}) => [cell.scene, h("br"), h("span", {class: "soft"}, radius(cell))]
    },
    ...budgets.map(budgetColumn)
  ];
  byId("winners-table").replaceChildren(table("Who wins where", columns, rows));
};

const drawCalibration = () => {
  const place = byId("calibration-table"), found = report.calibration;
  if (!found) {
    place.replaceChildren(h("p", {class: "note"}, "This run did not calibrate."));
    return;
  }
  const gainOf = (before, now) => (before > 0 ? 1 - now / before : null);
  const signed = (value) => !isNumber(value) ?
      "–" :
      h("span",
        {class: value > 0.005 ? "better" :
             value < -0.005   ? "worse" :
                                null},
        `${value > 0 ? "+" : ""}${percent(value)}`);
  const changes = (r) => {
    const names = Object.keys({...r.parameters, ...r.default_parameters})
                      .filter((name) => r.parameters[name] !== r.default_parameters[name]);
    const text = (value) => (typeof value === "number" ? plain(value) : String(value ?? "none"));
    const change = (name) => [name.replace(/_/g, " "), text(r.default_parameters[name]), "→",
                              text(r.parameters[name])]
                                 .join(" ");
    return names.map(change).join(", ");
  };
  place.replaceChildren(
      h("p", null, "For each kernel and time budget, the parameters of the least error, found on ",
        found.train.join(", "), " and reported on ", found.held_out.join(", "),
        ", which the search never saw. Pictures of ", found.size.join(" × "), ", ",
        whole(found.directions), " directions per pixel, one thread. The default is the ",
        "library's, with the best sampling that fits the same budget. What counts is the gain on ",
        "the views held out."),
      table(
          "Calibration",
          [
            kernelColumn,
            numeric(
                "budget", (r) => r.budget, "nanoseconds per pixel", (r) => `${plain(r.budget)} ns`),
            numeric(
                "gain, held out", (r) => gainOf(r.default_held_out_error, r.held_out_error),
                "how much smaller the RMSE gets on views held out",
                (r) => signed(gainOf(r.default_held_out_error, r.held_out_error))),
            numeric(
                "gain, train", (r) => gainOf(r.default_train_error, r.train_error),
                "the same on the views of the search",
                (r) => signed(gainOf(r.default_train_error, r.train_error))),
            numeric("RMSE, held out", (r) => r.held_out_error),
            numeric(
                "default", (r) => r.default_held_out_error,
                "RMSE of the defaults on views held out"),
            numeric("ns", (r) => r.time, "nanoseconds per pixel, tuned"),
            numeric("ns, default", (r) => r.default_time, "nanoseconds per pixel, defaults"),
            {
              title: "what changes",
              of: changes,
              kind: "wrap",
              text: (r) =>
                  h("span", {title: `all parameters: ${parametersText(r.parameters)}`},
                    changes(r) || "nothing")
            },
          ],
          found.rows));
};

// --- stability -----------------------------------------------------------------------------------

const metricText = (value) => (isNumber(value) ? number(value) : "–");
const drawStability = () => {
  const place = byId("stability-tables");
  const {families, rows} = report.stability;
  if (!families.length) {
    place.replaceChildren(h("p", {class: "note"}, "This run has no stability table."));
    return;
  }
  place.replaceChildren(...families.map((family) => {
    const own = rows.filter((row) => row.family === family.name);
    const algorithms = family.algorithms
                           .map((algorithm) => {
                             const mine = own.filter((row) => row.algorithm === algorithm.name);
                             const worst = Object.fromEntries(family.metrics.map(({name}) => {
                               let found = null, none = 0;
                               for (const row of mine) {
                                 const value = row.metrics[name];
                                 if (!isNumber(value)) ++none;
                                 else if (!found || value > found.value) found = {value, row};
                               }
                               return [name, {found, none}];
                             }));
                             return {algorithm, mine, worst};
                           })
                           .filter((entry) => entry.mine.length);
    const cases = new Map(family.cases.map((entry) => [entry.name, entry.what]));
    const where =
        (row) => [row.case, row.worst || parametersText(row.parameters)].filter(Boolean).join(": ");
    const first = family.metrics.find((metric) => metric.name !== "nan")?.name;
    const worstInput = (entry) => {
      const at = entry.worst[first]?.found;
      return at && at.value > 0 ? where(at.row) : null;
    };
    const summary = table(
        `${family.name}: the worst of all cases`,
        [
          {
            title: "algorithm",
            of: (e) => e.algorithm.name,
            text: (e) => h("span", {title: e.algorithm.what}, e.algorithm.name)
          },
          ...family.metrics.map(
              (metric) => numeric(
                  metric.name.replace(/_/g, " "), (e) => e.worst[metric.name].found?.value ?? null,
                  metric.what,
                  (e) => {
                    const {found, none} = e.worst[metric.name];
                    return h(
                        "span", {title: found && found.value > 0 ? `at ${where(found.row)}` : null},
                        metricText(found?.value),
                        none && found ? h("span", {
                          class: "soft",
                          title: `${none} of ${e.mine.length} rows without a number`
                        },
                                          ` +${none}\u202f–`) :
                                        null);
                  })),
          {
            title: `worst input (${(first ?? "").replace(/_/g, " ")})`,
            of: worstInput,
            kind: "wrap"
          },
          {title: "what it is", of: (e) => e.algorithm.what, kind: "wrap"},
        ],
        algorithms);
    const all =
        h("details", {
          ontoggle: (event) => {
            if (!event.target.open || all.childElementCount > 1) return;
            all.append(table(
                `${family.name}: all rows`,
                [
                  {
                    title: "case",
                    of: (r) => r.case,
                    text: (r) => h("span", {title: cases.get(r.case)}, r.case)
                  },
                  {title: "algorithm", of: (r) => r.algorithm},
                  {title: "parameters", of: (r) => parametersText(r.parameters)},
                  ...family.metrics.map(
                      (metric) => numeric(
                          metric.name.replace(/_/g, " "), (r) => r.metrics[metric.name],
                          metric.what, (r) => metricText(r.metrics[metric.name]))),
                  {title: "worst input", of: (r) => r.worst || null, kind: "wrap"},
                ],
                own));
          }
        },
          h("summary", null, `all ${own.length} rows`));
    return h(
        "div", {class: "family"}, h("h3", null, family.name.replace(/-/g, " ")),
        h("p", {class: "soft"}, `${family.what}.`), summary, all);
  }));
};

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

const drawSkipped = () => {
  const {cell} = state, place = byId("skipped-table");
  const rows =
      cell.results.filter((r) => r.work.skipped > 0 || r.work.skipped_rays > 0 || r.without);
  if (!rows.length) {
    place.replaceChildren(
        h("p", {class: "note"}, "Nothing was left out here beside the background."));
    return;
  }
  const twin = (r) => cell.results.find((other) => other.id === r.without);
  const before = (r) => (twin(r) ? timeNow(twin(r)) : null);
  const saved = (r) => (before(r) > 0 && timeNow(r) !== null ? 1 - timeNow(r) / before(r) : null);
  const added = (r) => (twin(r) ? r.error.rmse - twin(r).error.rmse : null);
  const signed = (value, text, good) => !isNumber(value) ?
      "–" :
      h("span",
        {class: value === 0 ? null :
             good           ? "better" :
                              "worse"},
        value > 0 ? `+${text}` : text);
  const pixelShare = ({work}) =>
      (work.skipped > 0 && work.pixels > 0 ? work.skipped / work.pixels : null);
  const rayShare = (r) =>
      r.work.skipped_rays > 0 ? r.work.skipped_rays / (r.work.rays + r.work.skipped_rays) : null;
  place.replaceChildren(table(
      `What was left out, ${cell.id}`,
      [
        kernelColumn,
        settingColumn,
        numeric(
            "pixels left out", pixelShare, "share of all pixels", (r) => percent(pixelShare(r))),
        numeric(
            "rays left out", rayShare, "share of the rays that would have been shot",
            (r) => percent(rayShare(r))),
        {title: "the same with all", of: (r) => r.without, text: (r) => r.without ?? "–"},
        numeric(
            "time saved", saved, "below zero: it costs more than it saves",
            (r) => signed(saved(r), percent(saved(r)), saved(r) > 0)),
        numeric(
            "added error", added, "RMSE less RMSE with all",
            (r) => signed(added(r), number(added(r)), added(r) <= 0)),
        numeric("ms with all", before, "without leaving anything out"),
        numeric("ms", timeNow),
        numeric("RMSE with all", (r) => twin(r)?.error.rmse ?? null),
        numeric("RMSE", (r) => r.error.rmse),
      ],
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

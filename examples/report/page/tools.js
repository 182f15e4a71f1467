// --- small tools ---------------------------------------------------------------------------------

const byId = (id) => document.getElementById(id);
const fill = (node, attributes, children) => {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return node;
};
/** An HTML element. Text goes in as text: no name in a report is ever read as markup. */
const h = (name, attributes, ...children) =>
    fill(document.createElement(name), attributes, children);
const s = (name, attributes, ...children) =>
    fill(document.createElementNS("http://www.w3.org/2000/svg", name), attributes, children);

const isNumber = (value) => typeof value === "number" && Number.isFinite(value);
const minus = (text) => text.replace(/-/g, "−");
/** Three digits; a power of ten where the number would be long. */
const number = (value) => {
  if (!isNumber(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) {
    const [digits, power] = value.toExponential(size >= 1e6 ? 2 : 1).split("e");
    return minus(`${digits}e${Number(power)}`);
  }
  if (size >= 1000) return minus(String(Math.round(value)));
  return minus(size < 0.01 ? value.toPrecision(2) : value.toPrecision(3));
};
/** A setting, as somebody would write it. */
const plain = (value) => (isNumber(value) ? minus(String(Number(value.toPrecision(4)))) : "–");
const whole = (value) => value.toLocaleString("en").replace(/,/g, "\u202f");
const percent = (value) => (isNumber(value) ? minus(`${(100 * value).toFixed(1)} %`) : "–");
const milliseconds = (value) => {
  if (!isNumber(value)) return "–";
  return value >= 1000 ? `${number(value / 1000)} s` : `${number(value)} ms`;
};
const bytes = (value) => {
  if (value < 1024) return `${value} B`;
  return value < 1024 * 1024 ? `${number(value / 1024)} KiB` : `${number(value / 1048576)} MiB`;
};
const parametersText = (parameters) =>
    Object.entries(parameters)
        .map(([name, value]) => [name.replace(/_/g, " "), isNumber(value) ? plain(value) : value])
        .map((pair) => pair.join(" "))
        .join(", ");

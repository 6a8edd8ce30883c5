// The page, from the report.

const report = JSON.parse(document.getElementById("data").textContent);
const kDashes = ["", "7 4", "2 4", "9 3 2 3"];
const kFactsFirst = ["date", "processor", "processors", "usable processors", "SMT", "virtualised", "kernel",
  "clock source", "governor", "isolated processors", "nohz_full", "transparent hugepages", "SCHED_FIFO",
  "load before", "used by others", "stolen", "arbiter", "compiler", "build"];

// Each system has one colour in the whole report; new ones of a measure take what is free in it.
const look = (() => {
  const looks = new Map();
  const counts = {ours: 4, peer: 8, floor: 4};
  for (const measure of report.measures) {
    const results = measure.cases.flatMap((each) => each.results);
    const taken = (role) => results.map(({system}) => looks.get(system))
      .filter((each) => each?.role === role).map((each) => each.n);
    for (const {system, role} of results) {
      if (looks.has(system)) continue;
      let n = 0;
      while (taken(role).includes(n)) ++n;
      looks.set(system, {role, n, colour: `var(--${role}-${n % counts[role]})`,
        dash: role === "floor" ? kDashes[1 + n % 3] : kDashes[Math.floor(n / counts[role]) % 4]});
    }
  }
  return (system) => looks.get(system);
})();

const unitOf = (measure, one) => one.unit ?? measure.unit;
const figureOf = (result) => result.value ?? result.p50;
const isRate = (unit) => unit.endsWith("/s");

function header() {
  const met = report.targets.filter((target) => target.met).length;
  const parts = [`${report.quick ? "quick" : "full"} run`, report.machine?.date];
  if (report.targets.length) parts.push(`${met} of ${report.targets.length} targets met`);
  return element("header", {},
    element("h1", {}, "Arbiter: what arbitration costs here"),
    element("div", {class: "soft"}, parts.filter(Boolean).join(" · ")),
    element("nav", {}, ...report.measures.map(({name, title}) => element("a", {href: `#${name}`}, title))));
}

function warnings() {
  if (!report.warnings.length) return null;
  return element("section", {class: "card warnings"},
    element("strong", {}, "What may have spoilt these figures"),
    element("ul", {}, ...report.warnings.map((each) => element("li", {}, each))));
}

function machine() {
  if (!report.machine) return null;
  const rest = Object.keys(report.machine).filter((key) => !kFactsFirst.includes(key));
  const facts = [...kFactsFirst, ...rest].filter((key) => key in report.machine).map((key) => {
    const value = report.machine[key];
    return element("div", Array.isArray(value) ? {class: "wide"} : {}, element("dt", {}, key),
      element("dd", {}, Array.isArray(value) ? value.join(", ") : String(value)));
  });
  return element("section", {class: "card"}, element("h2", {}, "The machine"),
    element("dl", {class: "facts"}, ...facts));
}

function targetRow({name, limit, measured, unit, met}) {
  const verdict = measured === undefined ? ["unknown", "– not measured"] :
    met ? ["met", "✓ met"] : ["missed", "✗ missed"];
  const share = measured === undefined || !(limit > 0) ? 0 : Math.min(1, measured / limit / 2);
  const meter = element("div", {class: "meter"},
    element("i", {style: `width:${100 * share}%;background:var(--${met ? "good" : "bad"})`}), element("b"));
  return element("tr", {}, element("td", {}, name), element("td", {}, `≤ ${amount(limit, unit)}`),
    element("td", {}, measured === undefined ? "" : amount(measured, unit)),
    element("td", {class: "text"}, meter),
    element("td", {class: "text"}, element("span", {class: `badge ${verdict[0]}`}, verdict[1])));
}

function table(titles, rows, kind = "") {
  const head = titles.map((title) => element("th", {}, title));
  return element("div", {class: "scroll"}, element("table", {class: kind},
    element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...rows)));
}

function targets() {
  if (!report.targets.length) return null;
  return element("section", {class: "card"}, element("h2", {}, "Targets"),
    element("p", {class: "soft"}, "Ratios are of one run; the line in each bar is the limit."),
    table(["target", "limit", "measured", "", ""], report.targets.map(targetRow)));
}

// Our first system in a case is what the others are compared with.
const reference = (one) => one.results.find((each) => each.role === "ours" && figureOf(each) > 0);

function resultRow(result, unit, ours, {hasTimes, hasRatios}) {
  const name = element("td", {},
    element("span", {class: "chip", style: `background:${look(result.system).colour}`}),
    result.system, element("span", {class: "role"}, result.role));
  const ratio = (key) => result.role !== "ours" && ours?.[key] > 0 && result[key] > 0 ?
    `${digits(ours[key] / result[key])} ×` : "";
  const hasValue = result.value !== undefined;
  const cells = hasTimes ?
    [...["p50", "p99", "p99.9", "max"].map((key) => amount(result[key], "ns")),
      result.count?.toLocaleString("en") ?? ""] :
    [hasValue ? amount(result.value, unit) : ""];
  if (hasTimes && hasValue) cells[0] = amount(result.value, unit);
  if (hasRatios) cells.push(ratio(hasValue ? "value" : "p50"));
  if (hasRatios && hasTimes) cells.push(ratio("p99"));
  return element("tr", {class: result.role}, name, ...cells.map((cell) => element("td", {}, cell)),
    element("td", {class: "note"}, result.note ?? ""));
}

function resultTable(measure, one) {
  const has = {hasTimes: one.results.some((each) => each.count), hasRatios: ratios(one).length > 0};
  const titles = has.hasTimes ? ["system", "p50", "p99", "p99.9", "max", "samples"] : ["system", "value"];
  if (has.hasRatios) titles.push(...(has.hasTimes ? ["ours ÷ it, p50", "p99"] : ["ours ÷ it"]));
  const rows = one.results.map((each) => resultRow(each, unitOf(measure, one), reference(one), has));
  return table([...titles, ""], rows, has.hasTimes ? "" : "values");
}

function ratios(one) {
  const ours = reference(one);
  if (!ours) return [];
  return one.results.filter((each) => each.role !== "ours" && figureOf(each) > 0)
    .map((each) => ({system: each.system, ratio: figureOf(ours) / figureOf(each)}));
}

function figure(caption, chart, kind = "curves") {
  return element("figure", {class: kind}, element("figcaption", {}, caption), chart);
}

function caseSection(measure, one, isOpen) {
  const figures = [];
  if (one.results.some((each) => each.curve)) {
    figures.push(figure("Time by percentile: lower is better", percentileChart(look, one.results)));
  }
  const rows = ratios(one);
  if (rows.length) {
    const better = isRate(unitOf(measure, one)) ? "right" : "left";
    const of = one.results.some((each) => each.curve) ? "p50 of " : "";
    figures.push(figure(`${of}${reference(one).system} ÷ theirs: ${better} of 1, ours is faster`,
      ratioBars(look, rows), "bars"));
  }
  const section = element("details", isOpen ? {open: ""} : {},
    element("summary", {}, element("h3", {}, one.name)));
  if (figures.length) {
    section.append(element("div", {class: figures.length === 1 ? "pictures single" : "pictures"}, ...figures));
  }
  section.append(resultTable(measure, one));
  return section;
}

// Cases with an x are points of curves; "64 B, spinning" and "64 B, blocking" belong to two pictures.
function scaling(measure) {
  const groups = new Map();
  for (const one of measure.cases.filter((each) => each.x > 0)) {
    const comma = one.name.indexOf(", ");
    const variant = `${comma < 0 ? "" : one.name.slice(comma + 2)}`;
    const key = variant + unitOf(measure, one);
    if (!groups.has(key)) groups.set(key, {variant, cases: [], unit: unitOf(measure, one)});
    groups.get(key).cases.push(one);
  }
  const figures = [];
  for (const {variant, cases, unit} of groups.values()) {
    if (new Set(cases.map((each) => each.x)).size < 2) continue;
    const what = cases.some((each) => each.results.some((one) => one.p50)) ? "p50" : "value";
    const caption = `${what} by ${measure.x_label}${variant && `: ${variant}`}`;
    figures.push(figure(caption, scalingChart(look, cases, figureOf, unit, measure.x_label)));
  }
  if (!figures.length) return null;
  return element("div", {class: figures.length === 1 ? "pictures single" : "pictures",
    style: "grid-template-columns:repeat(auto-fit,minmax(min(100%,480px),1fr))"}, ...figures);
}

function measureSection(measure) {
  return element("section", {class: "card", id: measure.name}, element("h2", {}, measure.title),
    element("p", {class: "soft"}, measure.explanation), scaling(measure),
    ...measure.cases.map((one, i) => caseSection(measure, one, i < 4)));
}

document.getElementById("report").replaceChildren(...[header(), warnings(), targets(),
  ...report.measures.map(measureSection), machine()].filter(Boolean));

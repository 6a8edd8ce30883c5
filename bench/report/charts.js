// Pictures, as SVG. A `look` gives each system its colour, the same in the whole report.

// Logarithmic, from the decade parts around the values to pixels; ticks at 1, 2, 5 or at decades.
function logScale(values, from, to) {
  const positive = values.filter((value) => value > 0);
  let low = Math.min(...positive);
  let high = Math.max(...positive);
  const steps = high / low > 2e3 ? [1] : [1, 2, 5];
  const all = [];
  for (let decade = Math.floor(Math.log10(low)) - 1; decade <= Math.ceil(Math.log10(high)); ++decade) {
    for (const step of steps) all.push(step * 10 ** decade);
  }
  low = all.filter((each) => each <= low * 1.000001).pop();
  high = all.find((each) => each >= high * 0.999999) ?? high;
  if (high <= low) high = low * 10;
  const at = (value) =>
    from + (to - from) * Math.log(Math.max(value, low) / low) / Math.log(high / low);
  return {at, ticks: all.filter((each) => each >= low * 0.999 && each <= high * 1.001)};
}

// Labels at these heights, moved apart where they would overlap, within the picture.
function spread(labels, gap, bottom) {
  labels.sort((a, b) => a.y - b.y);
  for (let i = 1; i < labels.length; ++i) {
    labels[i].y = Math.max(labels[i].y, labels[i - 1].y + gap);
  }
  for (let i = labels.length - 1, limit = bottom; i >= 0; --i, limit -= gap) {
    labels[i].y = Math.min(labels[i].y, limit);
  }
}

const kFrame = {width: 760, height: 390, left: 62, right: 178, top: 14, bottom: 46};

function frameFor(systems) {
  const height = Math.max(kFrame.height, 70 + 15 * systems);
  return {...kFrame, height, x0: kFrame.left, x1: kFrame.width - kFrame.right, y0: height - kFrame.bottom,
    y1: kFrame.top};
}

function axes(frame, y, unit, xTicks, xLabel) {
  const parts = [];
  for (const value of y.ticks) {
    parts.push(svg("line", {class: "grid", x1: frame.x0, x2: frame.x1, y1: y.at(value), y2: y.at(value)}));
    parts.push(svg("text", {x: frame.x0 - 8, y: y.at(value) + 4, "text-anchor": "end"}, tick(value, unit)));
  }
  for (const [at, label] of xTicks) {
    parts.push(svg("line", {class: "grid", x1: at, x2: at, y1: frame.y0, y2: frame.y1}));
    parts.push(svg("text", {x: at, y: frame.y0 + 18, "text-anchor": "middle"}, label));
  }
  parts.push(svg("line", {class: "axis", x1: frame.x0, x2: frame.x1, y1: frame.y0, y2: frame.y0}));
  parts.push(svg("text", {x: (frame.x0 + frame.x1) / 2, y: frame.y0 + 38, "text-anchor": "middle"}, xLabel));
  return parts;
}

function line(points) {
  return points.map(([x, y], i) => `${i ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join("");
}

// One line for each system: `marks` are the dots on it, `title` is said when it is pointed at.
function series(look, frame, system, parts, label) {
  const {colour, role, dash} = look(system);
  const group = svg("g", {class: `series ${role}`});
  for (const part of parts) {
    if (part.path) {
      const path = svg("path", {d: part.path, stroke: colour, class: part.kind ?? ""});
      if (dash && part.kind !== "gap") path.setAttribute("stroke-dasharray", dash);
      group.append(path);
    } else {
      group.append(svg("circle", {cx: part.x, cy: part.y, r: 3.2, fill: colour},
        svg("title", {}, part.title)));
    }
  }
  group.append(svg("line", {x1: label.from[0] + 5, y1: label.from[1], x2: frame.x1 + 14, y2: label.y,
    stroke: colour, opacity: 0.4}));
  group.append(svg("text", {x: frame.x1 + 18, y: label.y + 4, style: `fill:${colour}`}, system));
  return group;
}

function picture(frame, ...parts) {
  return svg("svg", {viewBox: `0 0 ${frame.width} ${frame.height}`, role: "img"}, ...parts);
}

// Durations by percentile, as HdrHistogram draws them: the further right, the rarer.
function percentileChart(look, results) {
  const shown = results.filter((result) => result.curve);
  const frame = frameFor(shown.length);
  const nines = Math.min(5, Math.max(2, ...shown.map((each) => Math.log10(each.count))));
  const maximum = nines + 0.7;
  const x = (value) => frame.x0 + (frame.x1 - frame.x0) * value / maximum;
  const y = logScale(shown.flatMap((each) => [Math.max(each.min, 0.5), each.max]), frame.y0, frame.y1);
  const names = ["0", "90 %", "99 %", "99.9 %", "99.99 %", "99.999 %"];
  const ticks = names.map((name, i) => [x(i), name]).filter((_, i) => i <= nines);
  const labels = shown.map((each) => ({system: each.system, y: y.at(each.max), from: [x(maximum), y.at(each.max)]}));
  spread(labels, 15, frame.y0);
  const lines = shown.map((each) => {
    const points = each.curve.filter(([share]) => share < 1)
      .map(([share, ns]) => [-Math.log10(1 - share), ns]).filter(([at]) => at <= nines + 0.001);
    const pixels = points.map(([at, ns]) => [x(at), y.at(ns)]);
    const end = [x(maximum), y.at(each.max)];
    const title = `${each.system}: at most ${amount(each.max, "ns")} of ${each.count.toLocaleString("en")}`;
    return series(look, frame, each.system, [
      {path: line(pixels)}, {path: line([pixels[pixels.length - 1], end]), kind: "gap"},
      {x: end[0], y: end[1], title},
    ], labels.find((label) => label.system === each.system));
  });
  return picture(frame, ...axes(frame, y, "ns", [...ticks, [x(maximum), "max"]],
    "percentile, on the scale of 1 / (1 − percentile)"), ...lines);
}

// A figure that changes with `x`: both axes logarithmic.
function scalingChart(look, cases, figure, unit, xLabel) {
  const systems = [...new Set(cases.flatMap((each) => each.results.filter(figure).map((one) => one.system)))];
  const frame = frameFor(systems.length);
  const lines = systems.map((system) => ({system, points: cases.map((each) => {
    const found = each.results.find((one) => one.system === system && figure(one));
    return found && [each.x, figure(found)];
  }).filter(Boolean)}));
  const xs = cases.map((each) => each.x);
  const low = Math.min(...xs);
  const high = Math.max(...xs);
  const x = (value) => high === low ? (frame.x0 + frame.x1) / 2 :
    frame.x0 + 12 + (frame.x1 - frame.x0 - 24) * Math.log(value / low) / Math.log(high / low);
  const y = logScale(lines.flatMap((each) => each.points.map((point) => point[1])), frame.y0, frame.y1);
  const name = xLabel === "bytes" ? bytes : (value) => digits(value).replace(/\.0+$/, "");
  const labels = lines.map(({system, points}) => {
    const last = points[points.length - 1];
    return {system, y: y.at(last[1]), from: [x(last[0]), y.at(last[1])]};
  });
  spread(labels, 15, frame.y0);
  return picture(frame,
    ...axes(frame, y, unit, [...new Set(xs)].map((value) => [x(value), name(value)]), xLabel),
    ...lines.map(({system, points}, i) => series(look, frame, system, [
      {path: line(points.map(([at, value]) => [x(at), y.at(value)]))},
      ...points.map(([at, value]) => ({x: x(at), y: y.at(value),
        title: `${system}, ${name(at)}: ${amount(value, unit)}`})),
    ], labels.find((label) => label.system === system))));
}

// What ours is of each other's, as bars from 1.
function ratioBars(look, rows) {
  const frame = {width: 440, height: 44 + 26 * rows.length};
  const [x0, x1] = [150, 385];
  const x = logScale([...rows.map((row) => row.ratio), 0.5, 2], x0, x1);
  const parts = [];
  for (const value of x.ticks.filter((_, i, all) => all.length < 8 || i % 2 === all.indexOf(1) % 2)) {
    parts.push(svg("line", {class: value === 1 ? "axis" : "grid", x1: x.at(value), x2: x.at(value), y1: 8,
      y2: frame.height - 24}));
    parts.push(svg("text", {x: x.at(value), y: frame.height - 8, "text-anchor": "middle"}, `${value}`));
  }
  rows.forEach(({system, ratio}, i) => {
    const top = 14 + 26 * i;
    const [from, to] = [x.at(Math.min(ratio, 1)), x.at(Math.max(ratio, 1))];
    parts.push(svg("g", {class: `series ${look(system).role}`},
      svg("text", {x: x0 - 10, y: top + 12, "text-anchor": "end"}, system),
      svg("rect", {x: from, y: top, width: Math.max(1.5, to - from), height: 16, rx: 3,
        fill: look(system).colour}),
      svg("text", {class: "figure", x: Math.max(to, x.at(1)) + 6, y: top + 12}, `${digits(ratio)} ×`)));
  });
  return picture(frame, ...parts);
}

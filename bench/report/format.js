"use strict";
// Numbers as text, and elements.

// Three digits: 5.02, 50.2, 502; thin groups beyond.
function digits(value) {
  if (value === 0) return "0";
  const size = Math.floor(Math.log10(Math.abs(value)));
  if (size < -3) return value.toExponential(1);
  if (size >= 4) return Math.round(value).toLocaleString("en").replaceAll(",", "\u2009");
  return value.toFixed(Math.min(3, Math.max(0, 2 - size)));
}

const kTimes = [[1e9, "s"], [1e6, "ms"], [1e3, "µs"], [1, "ns"]];
const kTimeUnits = {ns: 1, "µs": 1e3, us: 1e3, ms: 1e6, s: 1e9};

// A value with its unit: times in the unit that suits, large numbers with a prefix.
function amount(value, unit) {
  if (value === undefined) return "";
  if (unit in kTimeUnits) {
    const ns = value * kTimeUnits[unit];
    const [size, name] = kTimes.find(([size]) => Math.abs(ns) >= size) || [1, "ns"];
    return `${digits(ns / size)} ${name}`;
  }
  if (unit === "1/s" || unit === "/s") {
    for (const [size, prefix] of [[1e9, "G"], [1e6, "M"], [1e3, "k"]]) {
      if (value >= size) return `${digits(value / size)} ${prefix}/s`;
    }
  }
  return unit === "x" ? `${digits(value)} ×` : `${digits(value)} ${unit}`;
}

// As a tick of an axis: 1 ns, 20 µs, without needless digits.
function tick(value, unit) {
  return amount(value, unit).replace(/(\.\d*?)0+(?=\D)/, "$1").replace(/\.(?=\D)/, "");
}

function bytes(value) {
  if (value >= 1 << 20) return `${value / (1 << 20)} MiB`;
  return value >= 1 << 10 ? `${value / (1 << 10)} KiB` : String(value);
}

function element(name, attributes = {}, ...children) {
  return filled(document.createElement(name), attributes, children);
}

function svg(name, attributes = {}, ...children) {
  return filled(document.createElementNS("http://www.w3.org/2000/svg", name), attributes, children);
}

function filled(made, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

#include "report_assets.h"

namespace nadir::record {

// Colours c0 to c5 keep apart for the common kinds of colour blindness (after Okabe and Ito, Color Universal Design,
// 2008; darkened on white for contrast). Paper gets the light ones.
const std::string_view report_style = R"css(
:root { color-scheme: light dark; --page: #f4f5f7; --card: #fff; --text: #1b2129; --soft: #5b6673; --rule: #dde1e6;
  --grid: #e8ebee; --good: #00734f; --warn: #a84300; --accent: #0a66a8;
  --c0: #0072b2; --c1: #d55e00; --c2: #00916a; --c3: #a6508a; --c4: #8a6d00; --c5: #3c3c3c; }
@media screen and (prefers-color-scheme: dark) {
  :root { --page: #12161b; --card: #1a2027; --text: #e4e8ec; --soft: #9aa6b2; --rule: #2d353e;
    --grid: #29313a; --good: #4fd0a0; --warn: #ffab6b; --accent: #6cb8f0;
    --c0: #56b4e9; --c1: #ff9044; --c2: #35c79b; --c3: #e29ac9; --c4: #e8d44d; --c5: #c9ced4; }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--text); font: 15px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
header, main, footer { max-width: 1240px; margin: 0 auto; padding: 0 20px; }
header { padding-top: 36px; }
h1 { margin: 0; font-size: 30px; line-height: 1.2; letter-spacing: -0.01em; }
h2 { margin: 0 0 4px; font-size: 20px; line-height: 1.3; }
h3 { margin: 0; font-size: 15px; line-height: 1.4; }
p { margin: 0; }
h1, h2, h3, p, li, td, th, dd { overflow-wrap: anywhere; }
.subtitle { margin-top: 6px; color: var(--soft); font-size: 16px; white-space: pre-line; }
nav { display: flex; flex-wrap: wrap; gap: 2px 20px; margin-top: 20px; }
a { color: var(--accent); text-decoration: none; }
a:hover { text-decoration: underline; }

.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(165px, 1fr)); gap: 12px; margin: 22px 0 0; }
.figures > div { padding: 14px 16px; background: var(--card); border: 1px solid var(--rule); border-top: 3px solid var(--rule); border-radius: 8px; }
.figures dt { color: var(--soft); font-size: 13px; }
.figures dd { margin: 0; }
.figures .value { font-size: 28px; font-weight: 600; line-height: 1.25; font-variant-numeric: tabular-nums; }
.figures .unit { margin-left: 4px; color: var(--soft); font-size: 15px; font-weight: 400; }
.figures .remark { font-size: 13px; color: var(--soft); }
.figures .good { border-top-color: var(--good); }
.figures .warn { border-top-color: var(--warn); }
.figures .good .state { color: var(--good); }
.figures .warn .state { color: var(--warn); }

section { margin-top: 40px; scroll-margin-top: 12px; }
.text { max-width: 46em; color: var(--soft); white-space: pre-line; }
.grid { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 16px; margin-top: 14px; }
.grid > :last-child:nth-child(odd) { grid-column: 1 / -1; }
.item { margin: 0; padding: 14px 16px; min-width: 0; background: var(--card); border: 1px solid var(--rule); border-radius: 8px; }

.chart .legend { display: flex; flex-wrap: wrap; gap: 0 18px; margin: 2px 0 8px; padding: 0; list-style: none; font-size: 13px; }
.legend i { display: inline-block; width: 20px; margin-right: 7px; border-top: 3px solid var(--c); vertical-align: middle; }
.legend .dashed i { border-top-style: dashed; }
.legend .dotted i { border-top-style: dotted; }
.legend output { display: inline-block; min-width: 5.5em; margin-left: 7px; font-weight: 600; font-variant-numeric: tabular-nums; }
.legend output:empty { min-width: 0; margin: 0; }
.chart .label { color: var(--soft); font-size: 13px; }
.chart .below { margin-top: 24px; text-align: right; }
.chart .below output { float: left; color: var(--text); font-weight: 600; font-variant-numeric: tabular-nums; }
.chart .note { color: var(--soft); font-size: 13px; }
.plot { display: block; width: calc(100% - var(--left) - 14px); height: 220px; margin: 8px 14px 0 var(--left); overflow: visible;
  font-size: 13px; font-variant-numeric: tabular-nums; touch-action: pan-y; }
.plot text { fill: var(--soft); }
.plot .nothing { font-size: 15px; }
.plot .rule { stroke: var(--grid); }
.plot .axis { stroke: var(--soft); }
.lines { overflow: visible; }
.line { fill: none; stroke: var(--c); stroke-width: 1.8; stroke-linejoin: round; stroke-linecap: round; vector-effect: non-scaling-stroke; }
.dots { stroke: var(--c); stroke-width: 5; stroke-linecap: round; vector-effect: non-scaling-stroke; }
.line.dashed { stroke-dasharray: 7 5; stroke-width: 1.6; }
.line.dotted { stroke-dasharray: 1 5; stroke-width: 2.6; }
.line.mark { stroke-linecap: butt; stroke-width: 2; }
.bar { fill: var(--c0); stroke: var(--card); stroke-width: 1; vector-effect: non-scaling-stroke; }
.bar:hover { fill: var(--c4); }
line.reference { stroke: var(--soft); stroke-dasharray: 5 4; stroke-width: 1.3; }
text.reference { fill: var(--text); paint-order: stroke; stroke: var(--card); stroke-width: 4px; stroke-linejoin: round; }
.cursor { stroke: var(--soft); stroke-width: 1; visibility: hidden; }
.dot { fill: var(--c); stroke: var(--card); stroke-width: 1.5; visibility: hidden; }
.c0 { --c: var(--c0); } .c1 { --c: var(--c1); } .c2 { --c: var(--c2); } .c3 { --c: var(--c3); } .c4 { --c: var(--c4); } .c5 { --c: var(--c5); } .strong { --c: var(--text); }

.picture label { display: block; cursor: zoom-in; text-align: center; }
.picture img { display: block; max-width: 100%; max-height: 88vh; width: auto; height: auto; margin: 0 auto; border-radius: 4px; }
.picture figcaption { margin-top: 8px; color: var(--soft); font-size: 13px; }
.picture input { position: absolute; opacity: 0; }
.picture input:focus-visible + label { outline: 3px solid var(--accent); outline-offset: 3px; }
.picture input:checked + label { position: fixed; z-index: 9; inset: 0; overflow: auto; padding: 12px; background: #0b0e11f5; cursor: zoom-out; }
.picture input:checked + label img { max-width: none; max-height: none; }

body:has(.picture input:checked) { overflow: hidden; }

.table { overflow-x: auto; }
table { width: 100%; border-collapse: collapse; font-size: 14px; }
.table h3, .list h3 { margin-bottom: 6px; }
th { color: var(--soft); font-weight: 600; text-align: left; }
th, td { padding: 5px 18px 5px 0; border-bottom: 1px solid var(--rule); vertical-align: top; overflow-wrap: normal; }
tr > :last-child { padding-right: 0; }
tr:last-child td { border-bottom: 0; }
.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
.list ul { margin: 0; padding-left: 18px; font-size: 14px; }
.list li { margin: 3px 0; }
footer { margin-top: 40px; padding-bottom: 32px; color: var(--soft); font-size: 13px; }

@media (max-width: 760px) {
  header, main, footer { padding-left: 12px; padding-right: 12px; }
  header { padding-top: 22px; }
  h1 { font-size: 24px; }
  .grid { grid-template-columns: minmax(0, 1fr); gap: 12px; }
  .figures { grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 8px; }
  .figures > div { padding: 10px 12px; }
  .figures .value { font-size: 22px; }
  .item { padding: 12px; }
  .plot { height: 190px; }
}
@media print {
  body { background: #fff; font-size: 11pt; }
  nav, .legend output, .below output { display: none; }
  .item, .figures > div { break-inside: avoid; }
  h2, h3 { break-after: avoid; }
  section { margin-top: 24px; }
  .plot { height: 150px; }
  .picture img { max-height: 22cm; }
}
)css";

const std::string_view report_script = R"js(
'use strict';
// Read-outs: the sample nearest to the pointer, in all charts with the same x label
(() => {
  const make = (parent, name, attributes) => {
    const element = document.createElementNS(parent.namespaceURI, name);
    for (const key in attributes) element.setAttribute(key, attributes[key]);
    return parent.appendChild(element);
  };
  const axis = text => {
    const [low, high, power, decimals] = text.split(' ').map(Number);
    return { low, high, value: f => low + f * (high - low), fraction: v => (v - low) / (high - low),
             text: (v, more) => (v / 10 ** power).toFixed(Math.min(decimals + more, 17)).replace('-', '\u2212') };
  };
  const charts = [];
  for (const figure of document.querySelectorAll('.chart')) {
    const paths = [...figure.querySelectorAll('.line:not(.mark)')];
    if (!paths.length) continue;
    const plot = figure.querySelector('.plot'), below = figure.querySelector('.below');
    const chart = { plot, label: below.textContent, x: axis(plot.dataset.x), y: axis(plot.dataset.y) };
    chart.cursor = make(plot, 'line', { class: 'cursor', y1: 0, y2: '100%' });
    chart.time = make(below, 'output', {});
    const names = figure.querySelectorAll('.legend output');
    chart.lines = paths.map((path, i) => ({
      name: names[i], dot: make(plot, 'circle', { class: 'dot ' + path.classList[1], r: 4 }),
      points: path.getAttribute('d').split(/[M ]/).slice(1).map(Number) }));
    charts.push(chart);
  }
  const show = (chart, value) => {
    const wanted = value === null ? NaN : 1000 * chart.x.fraction(value), inside = wanted >= 0 && wanted <= 1000;
    let at = NaN;
    for (const line of chart.lines) {
      let best = -1, distance = Infinity;
      if (inside) {
        for (let i = 0; i < line.points.length; i += 2) {
          const d = Math.abs(line.points[i] - wanted);
          if (d < distance) { distance = d; best = i; }
        }
      }
      // Where the line is broken there is nothing to read
      const seen = best >= 0 && distance < 20;
      line.dot.style.visibility = seen ? 'visible' : 'hidden';
      line.name.textContent = seen ? chart.y.text(chart.y.value(1 - line.points[best + 1] / 1000), 2) : inside ? '\u2013' : '';
      if (!seen) continue;
      line.dot.setAttribute('cx', line.points[best] / 10 + '%');
      line.dot.setAttribute('cy', line.points[best + 1] / 10 + '%');
      if (!(Math.abs(at - wanted) <= distance)) at = line.points[best];
    }
    const seen = at === at;
    chart.cursor.style.visibility = seen ? 'visible' : 'hidden';
    chart.cursor.setAttribute('x1', at / 10 + '%');
    chart.cursor.setAttribute('x2', at / 10 + '%');
    chart.time.textContent = seen ? 'at ' + chart.x.text(chart.x.value(at / 1000), 2) : '';
  };
  for (const chart of charts) {
    const together = charts.filter(other => other.label === chart.label);
    const move = event => {
      const box = chart.plot.getBoundingClientRect();
      const value = chart.x.value(Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)));
      for (const other of together) show(other, value);
    };
    const area = chart.plot.parentNode;
    area.addEventListener('pointermove', move);
    area.addEventListener('pointerdown', move);
    area.addEventListener('pointerleave', () => { for (const other of together) show(other, null); });
  }
  // A picture in full size goes back on Escape
  addEventListener('keydown', event => {
    if (event.key === 'Escape') for (const box of document.querySelectorAll('.picture input')) box.checked = false;
  });
})();
)js";

}  // namespace nadir::record

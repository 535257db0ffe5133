'use strict';
// Curves over time, each as large as its box; a panel holds no more than it shows.
const COLOR = {
  command: '#777777', measured: '#000000', band: 'rgba(86, 180, 233, 0.45)', edge: '#0072b2',
  force: '#009e73', alarm: '#b35900', told: '#12324f', soft: '#5c6873',
};
// Okabe and Ito's, for readers who do not tell red from green; Eq. (2) alone is grey.
const PLAIN = '#b4bac0', OTHERS = '#4d5862';
const STRUCTURES = ['#e69f00', '#56b4e9', '#009e73', '#f0e442', '#cc79a7', '#0072b2', '#d55e00'];
const LEFT = 58, RIGHT = 16;  // of the picture, for numbers [px]
const SLOTS = STRUCTURES.length + 2;

const digits = (v, n) => v == null ? '-' :
  v && (Math.abs(v) < 1e-3 || Math.abs(v) >= 1e5) ? v.toExponential(n - 1) : String(Number(v.toPrecision(n)));

function make(tag, properties, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

const stroke = (color, width, dash) =>
  ({stroke: color, width, dash, points: {show: false}, spanGaps: false});

// A little room above and below; axes stay where there is nothing to draw.
const roomy = (_, least, most) => least == null ? [-1, 1] : uPlot.rangeNum(least, most, 0.08, true);

class Panel {
  // title, or what returns it; keys: [{label, color, line, dash, series}]; series, bands, hooks: of uPlot;
  // x(): range; y(u, least, most): range, where it is not automatic; axis: times are told below;
  // steps: of the numbers at the left, where not all will do;
  // sync: name of those whose cursors go together; readout(u, index): text under the pointer.
  constructor(parent, options) {
    this.chart = null;
    this.options = options;
    this.keys = (options.keys || []).map((key) => this.key(key));
    this.readout = make('span', {className: 'readout'});
    this.title = make('b');
    this.caption = make('figcaption', {}, this.title, ...this.keys, this.readout);
    this.box = make('div', {className: 'chart'});
    this.figure = make('figure', {}, this.caption, this.box);
    this.box.setAttribute('role', 'img');
    this.rename();
    parent.append(this.figure);
    this.resized = new ResizeObserver(() => { if (this.data) this.draw(); });
    this.resized.observe(this.box);
  }

  rename() {
    const {title} = this.options;
    this.title.textContent = typeof title === 'string' ? title : title();
    this.box.setAttribute('aria-label', this.title.textContent);
  }

  key({label, color, line, dash, series}) {
    const key = make('button', {type: 'button', className: line ? 'key line' : 'key', textContent: label});
    key.style.setProperty('--swatch', color);
    if (dash) key.style.setProperty('--dash', 'dashed');
    key.setAttribute('aria-pressed', 'true');
    key.addEventListener('click', () => {
      const show = key.getAttribute('aria-pressed') !== 'true';
      key.setAttribute('aria-pressed', String(show));
      for (const i of series || []) this.chart.setSeries(i, {show});
    });
    return key;
  }

  show(data) {
    this.data = data;
    this.draw();
  }

  draw() {
    const size = {width: this.box.clientWidth, height: this.box.clientHeight};
    if (size.width < 40 || size.height < 20) return;  // not seen
    if (!this.chart) this.chart = new uPlot({...size, ...this.made()}, this.data, this.box);
    else {
      if (this.chart.width !== size.width || this.chart.height !== size.height) this.chart.setSize(size);
      this.chart.setData(this.data);
    }
  }

  made() {
    const {x, y, axis, sync, series, bands, hooks, readout} = this.options;
    const cursor = {drag: {x: false, y: false}, y: false, points: {show: false}};
    if (sync) cursor.sync = {key: sync};
    return {
      scales: {x: {time: false, auto: false, range: x}, y: {range: y || roomy}},
      padding: [6, RIGHT, axis ? 0 : 4, 0],
      axes: [
        {size: axis ? 26 : 4, grid: {width: 0.5}, ticks: {show: false}, font: '12px system-ui',
          values: (_, at) => axis ? at.map((v) => `${digits(v, 6)} s`) : at.map(() => '')},
        {size: LEFT, grid: {width: 0.5}, ticks: {show: false}, font: '12px system-ui', space: axis ? 28 : 18, incrs: this.options.steps,
          values: this.options.values || ((_, at) => at.map((v) => digits(v, 6)))},
      ],
      legend: {show: false}, cursor, series: [{}, ...series], bands,
      hooks: {...hooks, setCursor: [(u) => {
        const i = u.cursor.idx;
        const told = i == null || !readout ? '' : readout(u, i);
        if (this.readout.textContent !== told) this.readout.textContent = told;
      }]},
    };
  }

  remove() {
    this.resized.disconnect();
    if (this.chart) this.chart.destroy();
    this.figure.remove();
  }
}

// What the caption of a band says: for which share it is made, and from what.
function bandName(state) {
  const told = state.coverage;
  const level = told && told.level != null ? `${digits(100 * told.level, 3)} % band` : 'band';
  return told && told.forecast ? `${level}, fixed before the data` : level;
}

// Which share of the time that a box shows lies left of a pointer.
function across(event, box) {
  const {left, width} = box.getBoundingClientRect();
  return (event.clientX - left - LEFT) / (width - LEFT - RIGHT);
}

// Dragging moves, two fingers or Ctrl and the wheel zoom; a click alone is none of them.
function gestures(box, move, zoom) {
  const held = new Map();
  let apart = 0;
  const spread = () => {
    const [a, b] = [...held.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  box.addEventListener('pointerdown', (event) => {
    held.set(event.pointerId, {x: event.clientX, y: event.clientY});
    if (held.size === 2) apart = spread();
    box.setPointerCapture(event.pointerId);
  });
  box.addEventListener('pointermove', (event) => {
    const before = held.get(event.pointerId);
    if (!before) return;
    held.set(event.pointerId, {x: event.clientX, y: event.clientY});
    if (held.size === 1) move((before.x - event.clientX) / (box.clientWidth - LEFT - RIGHT));
    else if (held.size === 2 && apart > 0) {
      const ratio = spread() / apart;
      if (ratio > 1.4 || ratio < 0.7) { zoom(ratio > 1 ? -1 : 1, null); apart = spread(); }
    }
  });
  for (const over of ['pointerup', 'pointercancel'])
    box.addEventListener(over, (event) => held.delete(event.pointerId));
  box.addEventListener('wheel', (event) => {
    if (!event.ctrlKey && !event.metaKey) return;
    event.preventDefault();
    zoom(Math.sign(event.deltaY), across(event, box));
  }, {passive: false});
}

// The weights of what explains the samples as one stacked band, with what happened above it.
class Weights extends Panel {
  constructor(parent, {x, log, shown}) {
    const series = [], bands = [];
    for (let i = 0; i < SLOTS; i++) {
      const fill = () => this.colors[i] || PLAIN;
      series.push({...stroke('#ffffff', 0.7), fill: i ? undefined : fill, paths: uPlot.paths.stepped({align: 1})});
      if (i) bands.push({series: [i + 1, i], fill});
    }
    super(parent, {
      title: 'weight [%]', axis: true, series, bands, x, y: () => [0, 100],
      keys: [], steps: [25, 50], values: (_, at) => at.map(String),
      readout: (u, i) => `${digits(u.data[0][i], 5)} s: ` + this.shares(u, i),
      hooks: {draw: [(u) => this.annotate(u, log(), shown())]},
    });
    this.colors = [];
    this.names = [];
    this.caption.append(
      ...[['alarm', '\u25BC', COLOR.alarm], ['diagnosis', '\u2506', COLOR.told], ['samples shown', '\u2501', COLOR.told]]
        .map(([label, sign, color]) => {
          const mark = make('span', {textContent: sign + ' '});
          mark.style.color = color;
          return make('span', {}, mark, label);
        }));
  }

  // names: structures in the order in which they came; rows: their weights, NaN where not carried.
  take(times, names, rows, stop) {
    const many = names.length > SLOTS;
    const last = many ? SLOTS - 1 : names.length;
    this.names = many ? [...names.slice(0, last), 'others'] : names;
    let used = 0;
    this.colors = this.names.map((name, i) =>
      many && i === last ? OTHERS : name === 'Eq. (2)' ? PLAIN : STRUCTURES[used++ % STRUCTURES.length]);
    // A weight holds until the next one is told.
    const at = times.length && stop > times[times.length - 1] ? [...times, stop] : [...times];
    const sums = Array.from({length: SLOTS}, () => new Array(at.length).fill(0));
    for (let j = 0; j < at.length; j++) {
      let sum = 0;
      const from = Math.min(j, times.length - 1);
      const upTo = (i) => { for (let k = i; k < SLOTS; k++) sums[k][j] = 100 * sum; };
      names.forEach((_, i) => {
        sum += rows[i][from] || 0;
        upTo(Math.min(i, SLOTS - 1));
      });
    }
    this.show([at, ...sums]);
  }

  weight(u, i, j) { return u.data[i + 1][j] - (i ? u.data[i][j] : 0); }

  shares(u, j) {
    return this.names.map((name, i) => [name, this.weight(u, i, j)]).filter(([, w]) => w >= 0.5)
      .sort((a, b) => b[1] - a[1]).map(([name, w]) => `${name} ${w.toFixed(0)} %`).join(', ');
  }

  annotate(u, log, [start, stop]) {
    const {ctx} = u, {left, top, width, height} = u.bbox, ratio = devicePixelRatio;
    ctx.save();
    ctx.font = `${12 * ratio}px system-ui`;
    ctx.textAlign = 'center';
    ctx.textBaseline = 'middle';
    this.names.forEach((name, i) => this.label(u, name, i));
    const x = (t) => u.valToPos(t, 'x', true);
    ctx.fillStyle = COLOR.told;
    const from = Math.max(x(start), left), to = Math.min(x(stop), left + width);
    if (to > from) ctx.fillRect(from, top + height - 4 * ratio, Math.max(to - from, 2 * ratio), 4 * ratio);
    for (const entry of log) {
      const at = x(entry.start);
      if (at < left - 1 || at > left + width + 1) continue;
      if (entry.level > 0) {
        ctx.fillStyle = COLOR.alarm;
        ctx.beginPath();
        ctx.moveTo(at, top + 9 * ratio);
        ctx.lineTo(at - 5 * ratio, top);
        ctx.lineTo(at + 5 * ratio, top);
        ctx.fill();
      } else if (entry.of === 'diagnosis') {
        ctx.strokeStyle = COLOR.told;
        ctx.setLineDash([4 * ratio, 3 * ratio]);
        ctx.beginPath();
        ctx.moveTo(at, top);
        ctx.lineTo(at, top + height);
        ctx.stroke();
      }
    }
    ctx.restore();
  }

  // Write a name where its part of the band is thick for longest, if there is room.
  label(u, name, i) {
    const {ctx} = u, times = u.data[0], ratio = devicePixelRatio;
    let best = [0, 0, 0], begun = -1;
    for (let j = 0; j <= times.length; j++) {
      const thick = j < times.length && this.weight(u, i, j) * u.bbox.height / 100 > 16 * ratio;
      if (thick && begun < 0) begun = j;
      if (!thick && begun >= 0) {
        const end = Math.min(j, times.length - 1);
        const room = u.valToPos(times[end], 'x', true) - u.valToPos(times[begun], 'x', true);
        if (room > best[2]) best = [begun, end, room];
        begun = -1;
      }
    }
    if (best[2] < ctx.measureText(name).width + 8 * ratio) return;
    const middle = (times[best[0]] + times[best[1]]) / 2;
    let j = best[0];
    while (j + 1 <= best[1] && times[j + 1] <= middle) j++;
    const height = u.data[i + 1][j] - this.weight(u, i, j) / 2;
    ctx.fillStyle = ['#0072b2', OTHERS].includes(this.colors[i]) ? '#ffffff' : '#1d2733';
    ctx.fillText(name, u.valToPos(middle, 'x', true), u.valToPos(height, 'y', true));
  }
}

// One parameter over the whole test; grey where a window says little more than the prior.
class Trend extends Panel {
  constructor(parent, name, x) {
    super(parent, {
      title: name, x, sync: 'course', values: (_, at) => at.map((v) => digits(v, 4)),
      series: [stroke('rgba(0, 114, 178, 0.5)', 0.6), stroke('rgba(0, 114, 178, 0.5)', 0.6),
        stroke(COLOR.edge, 1.6), stroke('#8a94a0', 1.6)],
      bands: [{series: [1, 2], fill: COLOR.band}],
      y: (u) => this.range(u.data),
      readout: (u, i) => u.data[1][i] == null ? '' :
        `${digits(u.data[0][i], 5)} s: ${digits(u.data[2][i], 4)} to ${digits(u.data[1][i], 4)}`,
    });
    this.now = make('span', {className: 'now'});
    this.caption.append(this.now);
  }

  // The first windows know little: their intervals may leave the picture, the last ones never.
  range([, upper, lower]) {
    const told = (row) => row.filter((v) => v != null && isFinite(v)).sort((a, b) => a - b);
    const low = told(lower), high = told(upper);
    if (!low.length) return [0, 1];
    const end = (row) => { for (let i = row.length - 1; i >= 0; i--) if (row[i] != null) return row[i]; };
    const least = Math.min(low[Math.floor(0.1 * low.length)], end(lower));
    const most = Math.max(high[Math.floor(0.9 * (high.length - 1))], end(upper));
    const more = 0.12 * (most - least) || Math.abs(most) || 1;
    return [least - more, most + more];
  }
}
